// What is text on the page. Every text of the run becomes the content of an element, never markup.

function element(name, content, className) {
  const made = document.createElement(name);
  if (content !== undefined) made.textContent = content;
  if (className) made.className = className;
  return made;
}

// Rows of texts; the first column is a name, and `numbers` says from which column on there are numbers.
function tableOf(header, rows, numbers = Infinity) {
  const table = element("table");
  if (header) {
    const line = table.appendChild(element("thead")).appendChild(element("tr"));
    header.forEach((text, k) => line.appendChild(element("th", text)).style.textAlign = k >= numbers ? "right" : "left");
  }
  const body = table.appendChild(element("tbody"));
  for (const row of rows) {
    const line = body.appendChild(element("tr"));
    row.forEach((text, k) => line.appendChild(element("td", text, k >= numbers ? "number" : k === 0 ? "name" : "")));
  }
  return table;
}

function showTexts(run, trajectory) {
  byId("title").textContent = run.title;
  byId("subtitle").textContent = `${run.file}: ${run.status} run, ${trajectory.samples.toLocaleString("en")} samples, ${run.events.count.toLocaleString("en")} events`;
  byId("notice").textContent = run.notice || "";
  byId("notice").hidden = !run.notice;
  const micro = text => text.replace(/ us$/, " µs");
  const headline = run.headline.map(({ name, value, paper }) => (run.beside_paper ? [name, micro(value), micro(paper)] : [name, micro(value)]));
  byId("headline").append(tableOf(["", "this run", ...(run.beside_paper ? ["paper"] : [])], headline));
  byId("provenance").append(tableOf(null, run.provenance.map(([name, value]) => [name.replaceAll("_", " "), value])));
  if (run.certificate) showCertificate(run.certificate);
  const precision = `Times, and the states at events, are exact. A sample's value is off by at most 1.2e-7 of the range that its channel has among ${trajectory.block} consecutive ones.`;
  const notes = [...trajectory.notes, ...run.notes, precision];
  byId("notes").append(...notes.map(note => element("li", note)));
  byId("case").textContent = run.case_text;
  byId("resolved").textContent = run.resolved;
}

function showCertificate({ attributes, columns }) {
  const place = byId("certificate");
  byId("certificate-card").hidden = false;
  if (attributes.length) place.append(tableOf(null, attributes));
  // Columns of one length belong together.
  for (const rows of new Set(columns.map(column => column.rows))) {
    const together = columns.filter(column => column.rows === rows).map(column => ({ ...column, values: doubles(column.values) }));
    const header = ["", ...together.map(({ name, unit }) => (unit && unit !== "1" ? `${name}, ${unit}` : name))];
    const lines = Array.from(together[0].values, (_, k) => [String(k), ...together.map(({ values }) => minus(Number(values[k].toPrecision(13)).toString()))]);
    const box = place.appendChild(element("div", undefined, "scroll"));
    box.append(tableOf(header, lines, 1));
    if (lines.length < rows) place.append(element("p", `The first ${lines.length} of ${rows} rows.`, "hint"));
  }
}

const ROW_HEIGHT = 25;

// The events, of which only those in sight are elements: there may be thousands.
class EventList {
  constructor(root, events, onChoose) {
    Object.assign(this, { root, events, onChoose, chosen: -1 });
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
      row.append(glyphElement(kind), element("span", `${i}  ${kind}`), `${events.time[i].toFixed(12)} s`);
      return row;
    });
    root.replaceChildren(this.spacer, ...rows);
    root.setAttribute("aria-activedescendant", visible.includes(this.chosen) ? `event-${this.chosen}` : "");
  }
}

// The state on both sides of an event.
function eventDetail(run, trajectory, index) {
  const { events, modes } = run, kind = events.kinds[events.kind[index]];
  const rows = [];
  for (const [name, { before, after }] of events.states) {
    const { unit } = trajectory.known.get(name);
    rows.push([name.replaceAll("_", " "), withUnit(before[index], unit), withUnit(after[index], unit)]);
  }
  const force = withUnit(events.internal_force[index], "N");
  const head = element("p", `Event ${index}: ${kind}, then ${modes.names[events.mode_after[index]]}. Internal force T_f/r ${force}.`, "hint");
  return [head, tableOf(["", "before", "after"], rows, 1)];
}
