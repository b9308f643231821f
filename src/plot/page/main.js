// The page: data in, figures out, and what the pointer and the keys do.

const run = JSON.parse(byId("run-data").textContent);
const trajectory = new Trajectory(JSON.parse(byId("trajectory-data").textContent));

run.modes.start = doubles(run.modes.start);
run.modes.code = codes(run.modes.code);
const events = run.events;
events.time = doubles(events.time);
events.kind = codes(events.kind);
events.mode_after = codes(events.mode_after);
events.internal_force = doubles(events.internal_force);
events.states = new Map(events.states.map(({ name, before, after }) => [name, { before: doubles(before), after: doubles(after) }]));
const cycles = Object.fromEntries(Object.entries(run.cycles).map(([name, text]) => [name, doubles(text)]));

// What stick can carry: mu_0 r F_n, either way.
if (run.breakaway_arm !== null) {
  const force = trajectory.channel("normal_force");
  const times = (values, factor) => values.map(value => value * factor);
  const high = factor => (force.high === force.low ? null : times(force.high, factor));
  const low = times(force.low, run.breakaway_arm), back = times(force.low, -run.breakaway_arm);
  trajectory.add("breakaway_torque", low, high(run.breakaway_arm) || low, "{{torque}}");
  trajectory.add("breakaway_torque_backward", high(-run.breakaway_arm) || back, back, "{{torque}}");
}

showTexts(run, trajectory.json);
const root = byId("chart");
const chart = new Chart(root, trajectory, run, afterDraw);
const list = new EventList(byId("events"), events, goToEvent);
const portraits = [
{{portraits}}];
const durations = new Durations(byId("durations"), cycles, k => goToEvent(lowerBound(events.time, cycles.start[k])));

// Portraits of more entries than this wait until the view rests.
const QUICK = 600;
let resting = 0;
// Where the pointer is over the figure, px.
let pointer = null;

// Entries first to last - 1 are in view.
function inView() {
  const first = lowerBound(trajectory.time, chart.from);
  let last = lowerBound(trajectory.time, chart.to);
  if (last < trajectory.size && trajectory.time[last] === chart.to) last++;
  return [first, last];
}

function drawPortraits() {
  const [first, last] = inView();
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
  byId("view").textContent = `${chart.from.toFixed(digits)} to ${chart.to.toFixed(digits)} s (${span}); ${held} in view`;
  root.dataset.from = String(chart.from);
  root.dataset.to = String(chart.to);
  if (pointer !== null) hover(pointer);
  clearTimeout(resting);
  if (last - first < QUICK) drawPortraits();
  else resting = setTimeout(drawPortraits, 150);
}

// A few natural periods around it, or as much as it takes to have samples on both sides.
function goToEvent(index) {
  const { time, size } = trajectory, at = events.time[index], i = trajectory.nearest(at);
  const around = Math.max(time[Math.min(i + 5, size - 1)] - at, at - time[Math.max(i - 5, 0)]);
  const wish = Math.max(4 * (run.natural_period || 0), 2.2 * around);
  const span = Math.min(wish, Math.max(chart.to - chart.from, 2.2 * around));
  chart.setView(at - span / 2, at + span / 2);
  choose(index);
}

function choose(index) {
  list.choose(index);
  durations.chosen = cycles.start.length ? lowerBound(cycles.start, events.time[index] + 1e-15) - 1 : -1;
  durations.draw();
  byId("event-detail").replaceChildren(...eventDetail(run, trajectory, index));
}

// The next event after the chosen one or, if that is out of view, after the middle of the view.
function step(by) {
  if (!events.time.length) return;
  const at = events.time[list.chosen], middle = (chart.from + chart.to) / 2;
  let next = list.chosen + by;
  if (!(at >= chart.from && at <= chart.to)) next = lowerBound(events.time, middle) - (by < 0 ? 1 : 0);
  goToEvent(Math.min(Math.max(next, 0), events.time.length - 1));
}

function stickSlipView() {
  const sticks = Array.from(events.kind.keys()).filter(i => events.kinds[events.kind[i]] === "stick");
  const first = events.time[sticks[0]], last = events.time[sticks[sticks.length - 1]];
  const margin = Math.max((last - first) * 0.05, 2 * (run.natural_period || 1e-4));
  return [first - margin, last + margin];
}

const wholeRun = () => chart.setView(...chart.limits);
byId("whole").addEventListener("click", wholeRun);
byId("stick-slip").disabled = !events.kind.some(code => events.kinds[code] === "stick");
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

const key = byId("mode-key");
for (const code of new Set(run.modes.code)) {
  const entry = key.appendChild(element("span"));
  entry.appendChild(element("i")).style.background = SHADES[run.modes.names[code]];
  entry.append(run.modes.names[code]);
}
for (const kind of kindsPresent) {
  const entry = key.appendChild(element("span"));
  entry.append(glyphElement(kind), kind);
}

const choices = byId("panel-choice").querySelector("div");
for (const panel of chart.panels) {
  const label = choices.appendChild(element("label")), box = label.appendChild(element("input"));
  box.type = "checkbox";
  box.checked = panel.shown;
  label.append(` ${panel.title}`);
  box.addEventListener("change", () => {
    panel.shown = box.checked;
    panel.box.hidden = !box.checked;
    chart.schedule();
  });
}

// The pointer. Only canvases take part, so that legends keep their clicks.
const onCanvas = event => event.target instanceof HTMLCanvasElement;
const place = event => event.clientX - root.getBoundingClientRect().left;
let drag = null;

root.addEventListener("wheel", event => {
  if (!onCanvas(event)) return;
  event.preventDefault();
  // A pinch on a touchpad comes as small turns of the wheel with Ctrl.
  const gain = event.ctrlKey ? 8 : 1;
  const unit = event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : 1;
  if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) chart.pan(event.deltaX * unit / chart.plotWidth);
  else chart.zoom(1.0018 ** (event.deltaY * unit * gain), chart.timeAt(place(event)));
}, { passive: false });

root.addEventListener("pointerdown", event => {
  if (!onCanvas(event) || event.button !== 0) return;
  root.focus({ preventScroll: true });
  event.target.setPointerCapture(event.pointerId);
  drag = { x: place(event), from: chart.from, to: chart.to, moved: false, select: event.shiftKey };
});

root.addEventListener("pointermove", event => {
  if (!onCanvas(event)) return;
  const x = place(event);
  if (!drag) {
    hover(x);
    return;
  }
  drag.moved = drag.moved || Math.abs(x - drag.x) > 3;
  if (!drag.moved) return;
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
  drag = null;
  root.classList.remove("dragging");
  byId("selection").hidden = true;
  if (!ended || event.type === "pointercancel") return;
  const x = place(event);
  if (ended.select && ended.moved) chart.setView(...[chart.timeAt(ended.x), chart.timeAt(x)].sort((a, b) => a - b));
  else if (!ended.moved && event.target === chart.strip) clickEvent(x);
};
root.addEventListener("pointerup", endDrag);
root.addEventListener("pointercancel", endDrag);
root.addEventListener("pointerleave", () => hover(null));
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
      if (entry < 0) {
        curve.output.textContent = "";
        continue;
      }
      const { low, high, unit } = trajectory.channel(curve.name);
      const text = withUnit(low[entry], unit);
      curve.output.textContent = trajectory.isBucket(entry) ? `${text} to ${withUnit(high[entry], unit)}` : text;
    }
  }
  byId("sample-time").textContent = entry < 0 ? "" : `sample at ${trajectory.time[entry].toFixed(12)} s`;
}

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
  Home: wholeRun,
  0: wholeRun,
};
root.addEventListener("keydown", event => {
  const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || event.ctrlKey || event.altKey || event.metaKey || event.target !== root) return;
  event.preventDefault();
  action(event);
});

chart.schedule();
