// The page: data in, figures out, and what the pointer and the keys do.

const source = new Source(page, new Trajectory(page.trajectory));
const { trajectory, events } = source;
// A second run, drawn over the first.
const second = page.second ? new Source(page.second, new Trajectory(page.second.trajectory)) : null;
const cycles = Object.fromEntries(Object.entries(page.cycles).map(([name, text]) => [name, doubles(text)]));
const certified = page.certified && { ...page.certified, uncertainty: doubles(page.certified.uncertainty), verdict: codes(page.certified.verdict) };

showTexts(page);
if (certified) showCertifiedEvents(events, certified);
if (second) showPair(page, events, second.events);
if (page.orbit) {
  new Orbit(portraitCard(page.orbit), page.orbit);
  showCycles(cycles);
  byId("last-period").hidden = !page.orbit.period;
  byId("last-period").addEventListener("click", () => chart.setView(page.orbit.to - page.orbit.period, page.orbit.to));
}
const root = byId("chart");
root.classList.toggle("bands", trajectory.bucket !== null);
const chart = new Chart(root, page.panels, second ? [source, second] : [source], afterDraw);
const overview = new Overview(byId("overview"), chart);
const list = new EventList(byId("events"), events, certified, goToEvent);
const portraits = page.portraits.map(one => new Portrait(portraitCard(one), source, one.x, one.y));
const durations = new Durations(byId("durations"), cycles, k => goToEvent(lowerBound(events.time, cycles.start[k])));
onTheme.push(() => chart.schedule(), () => durations.draw());

// Portraits of more entries than this wait until the view rests.
const QUICK = 600;
let resting = 0;
const READING = "Point at a curve to read it.";
byId("sample-time").textContent = READING;
// Where the pointer is over the figure, px.
let pointer = null;

// Entries first to last - 1 are in view.
function inView() {
  const first = lowerBound(trajectory.time, chart.from);
  let last = lowerBound(trajectory.time, chart.to);
  if (last < trajectory.size && trajectory.time[last] === chart.to) last++;
  return [first, last];
}

// Portraits leave out the final stick, whose oscillation would hide the cycles, unless the view begins in it.
const lastContact = events.kind.findLastIndex(code => ["stick", "slip", "reversal", "separation", "contact"].includes(events.kinds[code]));
const endsInStick = !page.orbit && lastContact >= 0 && events.kinds[events.kind[lastContact]] === "stick";
const settled = endsInStick ? events.time[lastContact] : Infinity;
function drawPortraits() {
  const [first, end] = inView(), cut = lowerBound(trajectory.time, settled), last = first < cut - 1 ? Math.min(end, cut) : end;
  // With a neighbour on each side, or a short view would have nothing to draw.
  for (const portrait of portraits) portrait.draw(Math.max(first - 1, 0), Math.min(last + 1, trajectory.size));
}

// After each frame of the chart: the rest of the page that depends on the view.
function afterDraw() {
  const span = withUnit(chart.to - chart.from, "s", 4);
  const digits = Math.min(Math.max(3, 3 - Math.floor(Math.log10(chart.to - chart.from))), 12);
  const [first, last] = inView();
  let bands = 0;
  if (trajectory.bucket) for (let i = first; i < last; i++) bands += trajectory.isBucket(i);
  const held = `${(last - first - bands).toLocaleString("en")} samples${bands ? ` and ${bands.toLocaleString("en")} bands` : ""}`;
  overview.draw();
  byId("view").textContent = `${chart.from.toFixed(digits)} to ${chart.to.toFixed(digits)} s (${span})`;
  byId("in-view").textContent = `${held} in view`;
  root.dataset.from = String(chart.from);
  root.dataset.to = String(chart.to);
  if (pointer !== null) hover(pointer);
  showUndersampled();
  showCursors();
  keepView();
  clearTimeout(resting);
  if (last - first < QUICK) drawPortraits();
  else resting = setTimeout(drawPortraits, 150);
}

// Whether some of what is in view is between too few samples.
const someSparse = [source, second].filter(one => one && one.sparse.from.length);
byId("undersampled").hidden = !someSparse.length;
function showUndersampled() {
  const inView = ({ sparse: { from, to } }) => Math.max(lowerBound(from, chart.to) - upperBound(to, chart.from), 0);
  const stretches = someSparse.reduce((sum, one) => sum + inView(one), 0);
  const remedies = someSparse.filter(inView).map(one => one.sparse.remedy).filter(Boolean);
  const text = stretches ? `Dotted: ${stretches === 1 ? "a stretch" : `${stretches} stretches`} between events with too few samples for a true curve; only the states at the events are exact. ` : "";
  const said = [text, ...remedies].join();
  if (said === byId("undersampled").dataset.said) return;
  byId("undersampled").dataset.said = said;
  byId("undersampled").replaceChildren(text, ...remedies.flatMap(remedy => {
    const command = element("code", remedy);
    return ["For samples there: ", command, " ", ...copyButton(command), " "];
  }));
}

// A few natural periods around it, or as much as it takes to have samples on both sides.
function goToEvent(index) {
  const { time, size } = trajectory, at = events.time[index], i = trajectory.nearest(at);
  const around = Math.max(time[Math.min(i + 5, size - 1)] - at, at - time[Math.max(i - 5, 0)]);
  const wish = Math.max(4 * (page.natural_period || 0), 2.2 * around);
  const span = Math.min(wish, Math.max(chart.to - chart.from, 2.2 * around));
  chart.setView(at - span / 2, at + span / 2);
  choose(index);
}

function choose(index) {
  list.choose(index);
  durations.chosen = cycles.start.length ? lowerBound(cycles.start, events.time[index] + 1e-15) - 1 : -1;
  durations.draw();
  byId("event-detail").replaceChildren(...eventDetail(source, index));
}

// The next event after the chosen one or, if that is out of view, after the middle of the view.
function step(by) {
  if (!events.time.length) return;
  const at = events.time[list.chosen], middle = (chart.from + chart.to) / 2;
  let next = list.chosen + by;
  if (!(at >= chart.from && at <= chart.to)) next = lowerBound(events.time, middle) - (by < 0 ? 1 : 0);
  goToEvent(Math.min(Math.max(next, 0), events.time.length - 1));
}

// From the first stick to the last of all runs; a single stick, which ends the motion, is no stick-slip.
const sticksOf = ({ events: { kinds, kind, time } }) => Array.from(time).filter((_, k) => kinds[kind[k]] === "stick");
const sticks = chart.sources.map(sticksOf).filter(times => times.length > 1).flat().sort((a, b) => a - b);
function stickSlipView() {
  const [first, last] = [sticks[0], sticks[sticks.length - 1]];
  const margin = Math.max((last - first) * 0.05, 2 * (page.natural_period || 1e-4));
  return [first - margin, last + margin];
}

const wholeRun = () => chart.setView(...chart.limits);
// At first a short interval of stick-slip, or the last of many periods, or the whole run.
const MANY_PERIODS = 25, FEW_PERIODS = 5;
function firstView() {
  const whole = chart.limits[1] - chart.limits[0], period = page.orbit?.period;
  const [from, to] = sticks.length ? stickSlipView() : chart.limits;
  if (to - from < whole / 3) chart.setView(from, to);
  else if (period && whole > MANY_PERIODS * period) chart.setView(page.orbit.to - FEW_PERIODS * period, page.orbit.to);
  else wholeRun();
}
byId("whole").addEventListener("click", wholeRun);
byId("stick-slip").disabled = !sticks.length;
byId("stick-slip").addEventListener("click", () => chart.setView(...stickSlipView()));
byId("zoom-in").addEventListener("click", () => chart.zoom(0.5));
byId("zoom-out").addEventListener("click", () => chart.zoom(2));
byId("previous").addEventListener("click", () => step(-1));
byId("next").addEventListener("click", () => step(1));
byId("log-durations").addEventListener("change", event => {
  durations.logarithmic = event.target.checked;
  durations.draw();
});
new ResizeObserver(() => {
  durations.draw();
  chart.schedule();
}).observe(byId("durations"));

const kindsPresent = events.kinds.filter((_, code) => events.kind.includes(code));
const filter = byId("event-filter");
filter.append(new Option(`all ${events.time.length}`, ""), ...kindsPresent.map(kind => new Option(kind, kind)));
filter.addEventListener("change", () => list.filter(filter.value));

// The legend: the runs; the ground of each mode, with the mark of the event that begins it; the other events.
const key = byId("key"), inModes = [...new Set(source.modes.code)].filter(code => code in source.modes.names).map(code => source.modes.names[code]);
const BEGINS = { "stick": "stick", "slip-forward": "slip", "separated": "separation" };
byId("runs").hidden = !second;
root.classList.toggle("two", second !== null);
document.body.classList.toggle("certified", Boolean(certified));
for (const [number, one, hues, style] of second ? [[1, page, COOL, "solid"], [2, page.second, WARM, "dashed"]] : []) {
  const entry = byId("runs").appendChild(element("span"));
  entry.append(...hues.slice(0, 3).map(colour => lineSwatch(colour, style)), `run ${number}: ${one.file}`);
}
if (second) {
  byId("runs").append(element("span", "Ground, list and cards: run 1."));
  byId("events-of").textContent = "Events of run 1";
}
for (const mode of inModes) {
  const ground = swatch("", { background: inked(SHADES[mode]) }), begin = kindsPresent.includes(BEGINS[mode]) && BEGINS[mode];
  if (begin) ground.append(markElement(GLYPHS[begin]));
  key.append(keyEntry(ground, mode === "slip-forward" && !inModes.includes("slip-backward") ? "slip" : mode.replace("-", " ")));
}
const begun = inModes.map(mode => BEGINS[mode]);
for (const kind of kindsPresent.filter(kind => !begun.includes(kind))) key.append(keyEntry(markElement(GLYPHS[kind]), kind));
if (someSparse.length) key.append(keyEntry(lineSwatch("axis", "dotted"), "too few samples"));

const choices = byId("panel-choice").querySelector("div"), boxes = [];
for (const panel of chart.panels) {
  const label = choices.appendChild(element("label")), box = label.appendChild(element("input"));
  boxes.push(box);
  box.type = "checkbox";
  box.checked = panel.shown;
  label.append(" ", ...typeset(panel.title));
  box.addEventListener("change", () => chart.showPanel(panel, box.checked));
}

// The pointer. Only canvases take part, so that legends keep their clicks.
const onCanvas = event => event.target instanceof HTMLCanvasElement;
const place = event => event.clientX - root.getBoundingClientRect().left;
let drag = null;

// The wheel is the page's, unless a key says otherwise or the figure has the focus.
root.addEventListener("wheel", event => {
  if (!onCanvas(event)) return;
  const modified = event.ctrlKey || event.metaKey;
  if (!modified && document.activeElement !== root) return;
  event.preventDefault();
  const unit = event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : 1;
  // A pinch on a touchpad comes as small turns of the wheel with Ctrl.
  const gain = event.ctrlKey && Math.abs(event.deltaY * unit) < 50 ? 8 : 1;
  if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) chart.pan(event.deltaX * unit / chart.plotWidth);
  else chart.zoom(1.0018 ** (event.deltaY * unit * gain), chart.timeAt(place(event)));
}, { passive: false });

// Two fingers are the figure's, one that moves up or down is the page's.
for (const kind of ["touchstart", "touchmove"]) {
  root.addEventListener(kind, event => {
    if (event.touches.length > 1) event.preventDefault();
  }, { passive: false });
}

// Where the pointers that are down are, px; and of two, the times that stay under them.
const down = new Map();
let pinch = null;

root.addEventListener("pointerdown", event => {
  if (!onCanvas(event) || event.button !== 0) return;
  if (event.pointerType !== "touch") root.focus({ preventScroll: true });
  event.target.setPointerCapture(event.pointerId);
  const x = place(event);
  down.set(event.pointerId, x);
  if (down.size === 2) {
    drag = null;
    pinch = [...down].map(([id, at]) => [id, chart.timeAt(at)]);
    hover(null);
    return;
  }
  drag = { x, from: chart.from, to: chart.to, moved: false, select: event.shiftKey, cursor: cursorAt(x, event.pointerType === "touch" ? 22 : 6) };
});

root.addEventListener("pointermove", event => {
  if (!onCanvas(event)) return;
  const x = place(event);
  if (down.has(event.pointerId)) down.set(event.pointerId, x);
  if (pinch) {
    const [[first, t1], [other, t2]] = pinch, x1 = down.get(first), x2 = down.get(other);
    // Where the fingers meet or cross there is no scale.
    if (Math.abs(x2 - x1) < 12 || (x2 - x1) * (t2 - t1) <= 0) return;
    const scale = (t2 - t1) / (x2 - x1), from = t1 - (x1 - LEFT) * scale;
    chart.setView(from, from + chart.plotWidth * scale);
    return;
  }
  if (!drag) {
    root.classList.toggle("on-cursor", cursorAt(x, 6) >= 0);
    hover(x);
    return;
  }
  drag.moved = drag.moved || Math.abs(x - drag.x) > 3;
  if (!drag.moved) return;
  if (drag.cursor >= 0) {
    placeCursor(drag.cursor, snapped(x));
    return;
  }
  hover(null);
  if (drag.select) {
    Object.assign(byId("selection").style, { left: `${Math.min(x, drag.x)}px`, width: `${Math.abs(x - drag.x)}px` });
    byId("selection").hidden = false;
    return;
  }
  root.classList.add("dragging");
  const by = (drag.x - x) * (drag.to - drag.from) / chart.plotWidth;
  chart.setView(drag.from + by, drag.to + by);
});

const endDrag = event => {
  const ended = drag;
  down.delete(event.pointerId);
  drag = null;
  root.classList.remove("dragging");
  byId("selection").hidden = true;
  if (pinch) {
    // The finger that stays down drags from here.
    const [rest] = down.values();
    if (rest !== undefined) drag = { x: rest, from: chart.from, to: chart.to, moved: true, select: false, cursor: -1 };
    pinch = null;
    return;
  }
  if (!ended || event.type === "pointercancel") return;
  const x = place(event);
  if (ended.select && ended.moved) chart.setView(...[chart.timeAt(ended.x), chart.timeAt(x)].sort((a, b) => a - b));
  else if (!ended.moved && event.target === chart.strip) clickEvent(x);
  else if (!ended.moved) hover(x);
};
root.addEventListener("pointerup", endDrag);
root.addEventListener("pointercancel", endDrag);
root.addEventListener("pointerleave", event => {
  if (event.pointerType !== "touch") hover(null);
});
root.addEventListener("dblclick", event => {
  if (onCanvas(event) && event.target !== chart.strip) wholeRun();
});

// The mark nearest to x, within its size.
function clickEvent(x) {
  let best = 8, found = -1;
  for (const [at, index] of chart.marks) {
    if (Math.abs(at - x) < best) [best, found] = [Math.abs(at - x), index];
  }
  if (found >= 0) goToEvent(found);
}

// A line through the sample nearest to x, and the values there; null: none.
function hover(x) {
  pointer = x;
  const inside = x !== null && x >= LEFT && x <= chart.width - RIGHT;
  const cursor = byId("cursor");
  cursor.hidden = !inside;
  let entry = -1;
  if (inside) {
    entry = trajectory.nearest(chart.timeAt(x));
    const at = chart.x(trajectory.time[entry]);
    cursor.hidden = at < LEFT || at > chart.width - RIGHT;
    if (cursor.hidden) entry = -1;
    cursor.style.left = `${at}px`;
  }
  for (const panel of chart.panels) {
    for (const curve of panel.curves) {
      if (!panel.shown || curve.limit) continue;
      if (entry < 0 || !curve.on || !panel.scale) {
        curve.output.textContent = "";
        continue;
      }
      const { low, high, unit } = curve.source.trajectory.channel(curve.name), read = value => onAxis(value, panel.scale, unit, curve.shift);
      if (curve.source !== source) {
        const value = curve.source.valueAt(curve.name, trajectory.time[entry]);
        curve.output.textContent = isNaN(value) ? "" : read(value);
      } else curve.output.textContent = trajectory.isBucket(entry) ? `${read(low[entry])} to ${read(high[entry])}` : read(low[entry]);
    }
  }
  byId("sample-time").textContent = entry < 0 ? READING : `sample at ${trajectory.time[entry].toFixed(12)} s`;
}

// Two cursors at any times, s, or null; they are read from the curves.
const cursors = [null, null];
const measure = byId("measure");

// The cursor within `reach` pixels of x, or -1.
function cursorAt(x, reach) {
  const distance = cursors.map(time => (time === null ? Infinity : Math.abs(chart.x(time) - x)));
  const nearest = distance[1] < distance[0] ? 1 : 0;
  return distance[nearest] <= reach ? nearest : -1;
}

// The time at x, or that of an event within five pixels.
function snapped(x) {
  const near = chart.sources.flatMap(({ marks, events: { time } }) => marks.map(([at, i]) => [Math.abs(at - x), time[i]]));
  const [distance, time] = near.reduce((best, one) => (one[0] < best[0] ? one : best), [5, NaN]);
  return distance < 5 ? time : chart.timeAt(x);
}

function placeCursor(number, time) {
  cursors[number] = time === null ? null : Math.min(Math.max(time, chart.limits[0]), chart.limits[1]);
  chart.schedule();
}

function toggleCursor(number) {
  const share = number === 0 ? 1 / 3 : 2 / 3;
  placeCursor(number, cursors[number] === null ? chart.from + share * (chart.to - chart.from) : null);
}

for (const number of [0, 1]) byId(`cursor-button-${number + 1}`).addEventListener("click", () => toggleCursor(number));

// The cursors in the figure, and a table of what is at them.
let measured = "";
function showCursors() {
  cursors.forEach((time, number) => {
    const mark = byId(`mark-${number + 1}`);
    byId(`cursor-button-${number + 1}`).setAttribute("aria-pressed", String(time !== null));
    mark.hidden = time === null || time < chart.from || time > chart.to;
    if (!mark.hidden) mark.style.left = `${chart.x(time)}px`;
  });
  const set = cursors.map(time => time !== null);
  measure.hidden = !set[0] && !set[1];
  if (measure.hidden) return;
  const difference = set[0] && set[1] ? cursors[1] - cursors[0] : NaN;
  const times = cursors.map(time => (time === null ? "–" : `${time.toFixed(12)} s`));
  const rows = [
    ["time", ...times, isNaN(difference) ? "–" : withUnit(difference, "s", 9)],
    ["1/Δt", "", "", isNaN(difference) || difference === 0 ? "–" : withUnit(1 / difference, "Hz", 7)],
  ];
  for (const panel of chart.panels.filter(({ shown }) => shown)) {
    for (const { name, label, source: one } of panel.curves.filter(({ on, limit }) => on && !limit)) {
      const values = cursors.map(time => (time === null ? NaN : one.valueAt(name, time))), unit = one.trajectory.unit(name);
      const text = value => (isNaN(value) ? "–" : withUnit(value, unit, 7));
      rows.push([`${second ? `${chart.sources.indexOf(one) + 1} ` : ""}${panel.title}, ${label}`, ...values.map(text), text(values[1] - values[0])]);
    }
  }
  const shape = rows.map(([name]) => name).join();
  if (shape !== measured) {
    measured = shape;
    measure.replaceChildren(tableOf(["", "at cursor 1", "at cursor 2", "difference, 2 less 1"], rows, 1));
    return;
  }
  const lines = measure.querySelectorAll("tbody tr");
  rows.forEach((row, r) => row.slice(1).forEach((text, k) => (lines[r].children[k + 1].textContent = text)));
}

// The view as the fragment of the page's address: window, cursors, and what differs from the panels and curves of the beginning.
const slug = text => text.toLowerCase().replace(/[^a-z0-9]+/g, "-");
const shownAtFirst = chart.panels.map(({ shown }) => shown);
firstView();
const opened = [chart.from, chart.to];
const offName = (panel, { name, source: one }) => `${slug(panel.title)}.${name}${one === source ? "" : ".2"}`;
function viewText() {
  const parts = [];
  if (chart.from !== opened[0] || chart.to !== opened[1]) parts.push(`t=${chart.from},${chart.to}`);
  if (chart.panels.some(({ shown }, k) => shown !== shownAtFirst[k])) parts.push(`panels=${chart.panels.filter(({ shown }) => shown).map(({ title }) => slug(title)).join(",")}`);
  const off = chart.panels.flatMap(panel => panel.curves.filter(({ on }) => !on).map(curve => offName(panel, curve)));
  if (off.length) parts.push(`off=${off.join(",")}`);
  if (cursors.some(time => time !== null)) parts.push(`cursors=${cursors.map(time => (time === null ? "" : time)).join(",")}`);
  return parts.join("&");
}

let kept = "", keeping = 0;
function keepView() {
  clearTimeout(keeping);
  keeping = setTimeout(() => {
    const text = viewText();
    if (text === kept) return;
    kept = text;
    try {
      history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search);
    } catch {
      // A browser that does not let a page from disk do this has no address to share.
    }
  }, 200);
}

// Sets the view that the address names; what it does not name is as in the beginning.
function restoreView() {
  const text = decodeURIComponent(location.hash.slice(1));
  if (text === kept) return;
  const parts = new Map(text.split("&").map(part => part.split("=")));
  const all = name => (parts.get(name) || "").split(",");
  chart.panels.forEach((panel, k) => {
    chart.showPanel(panel, parts.has("panels") ? all("panels").includes(slug(panel.title)) : shownAtFirst[k]);
    boxes[k].checked = panel.shown;
    for (const curve of panel.curves) chart.switchCurve(curve, !all("off").includes(offName(panel, curve)));
  });
  const times = name => all(name).map(one => (one === "" || !isFinite(one) ? null : Number(one)));
  [0, 1].forEach(number => placeCursor(number, times("cursors")[number] ?? null));
  const [from, to] = times("t");
  if (from !== null && to !== undefined && to > from) chart.setView(from, to);
  else firstView();
  kept = text;
}
addEventListener("hashchange", restoreView);

const KEYS = {
  ArrowLeft: event => chart.pan(event.shiftKey ? -0.5 : -0.1),
  ArrowRight: event => chart.pan(event.shiftKey ? 0.5 : 0.1),
  ArrowUp: () => chart.zoom(0.8),
  ArrowDown: () => chart.zoom(1.25),
  "+": () => chart.zoom(0.5),
  "=": () => chart.zoom(0.5),
  "-": () => chart.zoom(2),
  n: () => step(1),
  p: () => step(-1),
  1: () => placeCursor(0, pointer === null ? chart.from + (chart.to - chart.from) / 3 : snapped(pointer)),
  2: () => placeCursor(1, pointer === null ? chart.to - (chart.to - chart.from) / 3 : snapped(pointer)),
  Escape: () => root.blur(),
  Home: wholeRun,
  0: wholeRun,
};
root.addEventListener("keydown", event => {
  const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || event.ctrlKey || event.altKey || event.metaKey || event.target !== root) return;
  event.preventDefault();
  action(event);
});

showTheme();
restoreView();
chart.schedule();
