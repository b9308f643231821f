// What is text on the page of a run.

const micro = text => text.replace(/ us$/, " µs").replace(/\d+(\.\d+)?e-?\d+/g, typographic);
const spaced = name => name.replaceAll("_", " ");

function showTexts(run) {
  const headline = run.headline.map(({ name, value, paper }) => [name, micro(value), ...(run.beside_paper ? [micro(paper)] : [])]);
  byId("headline").append(tableOf(["", "this run", ...(run.beside_paper ? ["paper"] : [])], headline));
  byId("provenance").append(tableOf(null, run.provenance.map(([name, value]) => [spaced(name.replace(/_s$/, ", s")), value])));
  if (run.certificate) showCertificate(run.certificate);
  byId("notes").append(...[...run.trajectory.notes, ...run.notes].map(note => element("li", note)));
  byId("case").textContent = run.case_text;
  byId("resolved").textContent = run.resolved;
}

// The card of a portrait, before the summary; returns the place of its figure.
function portraitCard({ heading, id, hint }) {
  const card = element("section", undefined, "card"), figure = element("div", undefined, "figure"), words = element("p", undefined, "hint");
  figure.id = id;
  words.append(...typeset(hint));
  card.append(element("h2", heading), figure, words);
  byId("cards").insertBefore(card, byId("summary"));
  return figure;
}

// A bound with two digits, rounded up.
function bound(value) {
  const text = value.toExponential(1);
  if (Number(text) >= value) return text;
  return (Number(text) + Number(`1e${text.split("e")[1]}`) / 10).toExponential(1);
}

// Event times, s, with their uncertainty: up to the second digit of it. A double knows a time to half of its last digit.
function certifiedTime(time, uncertainty) {
  if (!isFinite(uncertainty)) return time.toFixed(12);
  const known = Math.max(uncertainty, Math.abs(time) * 2 ** -53);
  if (known === 0) return `${time.toFixed(15)} ± 0`;
  const shown = time.toFixed(Math.min(Math.max(1 + Math.ceil(-Math.log10(known)), 3), 15));
  return `${shown} ± ${typographic(bound(known + Math.abs(Number(shown) - time)))}`;
}

const verdictOf = (certified, index) => (certified.verdicts[certified.verdict[index]] || "not certified").replaceAll("-", " ");
const MOST_CERTIFIED = 1000;

function showCertifiedEvents({ time, kind, kinds }, certified) {
  const rows = Array.from(time.slice(0, MOST_CERTIFIED), (at, k) => [
    String(k), kinds[kind[k]], certifiedTime(at, certified.uncertainty[k]), verdictOf(certified, k),
  ]);
  const box = byId("certificate").appendChild(element("div", undefined, "scroll"));
  const table = tableOf(["", "event", "time, s", "verdict"], rows);
  table.id = "certified-events";
  box.append(table);
  if (time.length > rows.length) byId("certificate").append(element("p", `The first ${rows.length} of ${time.length} events.`, "hint"));
  const raw = byId("raw-columns");
  if (raw) byId("certificate").append(raw);
}

// The attributes; the columns as they are in the file behind a fold, in groups of one length.
function showCertificate({ attributes, columns }) {
  const place = byId("certificate");
  byId("certificate-card").hidden = false;
  if (attributes.length) place.append(tableOf(null, attributes.map(([name, value]) => [spaced(name), value.replace(/^\d+(\.\d+)?e-?\d+$/, typographic)])));
  if (!columns.length) return;
  const fold = place.appendChild(element("details"));
  fold.id = "raw-columns";
  fold.append(element("summary", `${columns.length === 1 ? "The column" : `All ${columns.length} columns`} of /certificate as they are in the file`));
  fold.addEventListener("toggle", () => {
    if (!fold.open || fold.children.length > 1) return;
    // Columns of one length belong together.
    for (const rows of new Set(columns.map(column => column.rows))) {
      const together = columns.filter(column => column.rows === rows).map(column => ({ ...column, values: doubles(column.values) }));
      const header = ["", ...together.map(({ name, unit }) => (unit && unit !== "1" ? `${name}, ${unit}` : name))];
      const lines = Array.from(together[0].values, (_, k) => [String(k), ...together.map(({ values }) => plain(values[k], 13))]);
      fold.appendChild(element("div", undefined, "scroll")).append(tableOf(header, lines, 1));
      if (lines.length < rows) fold.append(element("p", `The first ${lines.length} of ${rows} rows.`, "hint"));
    }
  });
}

const MOST_PAIRS = 2000;

// Events of both runs side by side, in order; those without a partner stand alone.
function showPair(run, first, second) {
  const partner = new Map(run.second.pairs), taken = new Set(partner.values());
  const rows = [], time = (events, k) => `${events.time[k].toFixed(12)}`;
  let next = 0;
  const alone = until => {
    for (; next < until; next++) if (!taken.has(next)) rows.push([second.kinds[second.kind[next]], "–", time(second, next), "–"]);
  };
  for (let k = 0; k < first.time.length; k++) {
    const other = partner.get(k);
    if (other !== undefined) alone(other);
    const both = other !== undefined;
    rows.push([first.kinds[first.kind[k]], time(first, k), both ? time(second, other) : "–", both ? withUnit(second.time[other] - first.time[k], "s", 4) : "–"]);
    if (both) next = other + 1;
  }
  alone(second.time.length);
  byId("pair-card").hidden = false;
  byId("pair").append(tableOf(["", `1 ${run.file}, s`, `2 ${run.second.file}, s`, "2 less 1"], rows.slice(0, MOST_PAIRS), 1));
  if (rows.length > MOST_PAIRS) byId("pair").append(element("p", `The first ${MOST_PAIRS} of ${rows.length}.`, "hint"));
}

const ROW_HEIGHT = 25;

// The events, of which only those in sight are elements: there may be thousands.
class EventList {
  constructor(root, events, certified, onChoose) {
    Object.assign(this, { root, events, certified, onChoose, chosen: -1 });
    this.spacer = root.appendChild(element("div"));
    this.filter("");
    root.addEventListener("scroll", () => this.draw());
    root.addEventListener("click", event => {
      const row = event.target.closest(".row");
      if (row) onChoose(Number(row.dataset.index));
    });
    root.addEventListener("keydown", event => {
      const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity }[event.key];
      if (step === undefined || !this.shown.length) return;
      event.preventDefault();
      const at = this.shown.indexOf(this.chosen);
      onChoose(this.shown[Math.min(Math.max(at + step, 0), this.shown.length - 1)]);
    });
    new ResizeObserver(() => this.draw()).observe(root);
  }

  // Shows the events of a kind, "" for all.
  filter(kind) {
    const { kinds, kind: code } = this.events;
    this.shown = Array.from(code.keys()).filter(i => !kind || kinds[code[i]] === kind);
    this.spacer.style.height = `${this.shown.length * ROW_HEIGHT}px`;
    this.draw();
  }

  choose(index) {
    this.chosen = index;
    const at = this.shown.indexOf(index);
    if (at >= 0) {
      const top = at * ROW_HEIGHT, { scrollTop, clientHeight } = this.root;
      if (top < scrollTop || top + ROW_HEIGHT > scrollTop + clientHeight) this.root.scrollTop = top - clientHeight / 2;
    }
    this.draw();
  }

  draw() {
    const { root, shown, events } = this;
    const first = Math.floor(root.scrollTop / ROW_HEIGHT);
    const visible = shown.slice(first, first + Math.ceil(root.clientHeight / ROW_HEIGHT) + 1);
    const rows = visible.map((i, k) => {
      const kind = events.kinds[events.kind[i]], row = element("div", undefined, "row");
      row.id = `event-${i}`;
      row.dataset.index = String(i);
      row.setAttribute("role", "option");
      row.setAttribute("aria-selected", String(i === this.chosen));
      row.style.top = `${(first + k) * ROW_HEIGHT}px`;
      const known = this.certified, time = known ? certifiedTime(events.time[i], known.uncertainty[i]) : events.time[i].toFixed(12);
      const verdict = known ? verdictOf(known, i) : "";
      row.append(markElement(GLYPHS[kind]), element("span", `${i}  ${kind}`), `${time} s${known ? (verdict === "converged" ? " ✓" : " ✗") : ""}`);
      row.title = verdict;
      return row;
    });
    root.replaceChildren(this.spacer, ...rows);
    root.setAttribute("aria-activedescendant", visible.includes(this.chosen) ? `event-${this.chosen}` : "");
  }
}

// The state on both sides of an event.
function eventDetail({ events, modes, trajectory }, index) {
  const kind = events.kinds[events.kind[index]];
  const rows = [];
  for (const [name, { before, after }] of events.states) {
    if (!trajectory.known.has(name)) continue;
    const unit = trajectory.unit(name);
    rows.push([spaced(name), withUnit(before[index], unit), withUnit(after[index], unit)]);
  }
  const force = withUnit(events.internal_force[index], "N");
  const head = element("p", undefined, "hint");
  head.append(...typeset(`Event ${index}: ${kind}, then ${modes.names[events.mode_after[index]]}. Internal force T_f/r ${force}.`));
  return [head, tableOf(["", "before", "after"], rows, 1)];
}

const MOST_CYCLES = 1000;

function showCycles({ start, stick_duration, slip_duration }) {
  const rows = Array.from(start.slice(0, MOST_CYCLES), (at, k) => {
    const [stick, slip] = [stick_duration[k], slip_duration[k]];
    return [String(k), `${at.toFixed(9)} s`, ...[stick, slip, stick + slip].map(duration => withUnit(duration, "s", 9))];
  });
  byId("cycles-card").hidden = false;
  if (rows.length) byId("cycles").append(tableOf(["cycle", "begin", "stick", "slip", "period"], rows, 1));
  else byId("cycles").append(element("p", "This run has no cycle of stick and slip.", "hint"));
  if (start.length > rows.length) byId("cycles").append(element("p", `The first ${rows.length} of ${start.length} on this page.`, "hint"));
}
