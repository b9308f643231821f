// The panels over time: one view for all of them, drawn column of pixels by column of pixels.

// The ground of a mode, and the colour of a curve that passes through several, by the mode's name.
const SHADES = { "separated": "separated", "stick": "stick", "slip-forward": "slip", "slip-backward": "backward", "engaged": "slip" };
const MODE_COLOURS = { "separated": "grey", "stick": "vermillion", "slip-forward": "blue", "slip-backward": "purple", "engaged": "blue" };

// The mark of a kind of event: colour, outline around (0, 0), whether it is filled.
const mark = (colour, path, filled) => ({ colour, path, filled });
const GLYPHS = {
  stick: mark("vermillion", "M-4-4H4V4H-4Z", true),
  slip: mark("blue", "M0-5L5 4H-5Z", true),
  reversal: mark("purple", "M0-5L5 0L0 5L-5 0Z", true),
  separation: mark("black", "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0-4 0Z", false),
  contact: mark("black", "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0-4 0Z", true),
  kick: mark("green", "M0-6L1.8-1.8L6 0L1.8 1.8L0 6L-1.8 1.8L-6 0L-1.8-1.8Z", true),
  corner: mark("grey", "M-5 4L0-4L5 4", false),
  destabilised: mark("black", "M0-5L5 4H-5Z", false),
  restabilised: mark("black", "M0 5L5-4H-5Z", false),
};

const LEFT = 66, RIGHT = 10, PANEL = 122, STRIP = 22, AXIS = 40;
// The part of the run below which a view is short.
const CHANGE_BELOW = 0.1;
// The shortest view: events are known to about 1e-12 s, times of 7 s resolve 1e-15 s.
const SHORTEST = 1e-7;

// A channel of the first run less the same of the second.
const DIFFERENCE = "difference_of_";

// Two runs are told apart by their hues: cool colours, drawn full, and warm ones, dashed.
const COOL = ["blue", "green", "grey", "sky", "black"], WARM = ["vermillion", "purple", "orange", "wine", "olive"];
function coloured(curves, hues) {
  const own = curves.filter(({ limit }) => !limit).map((curve, k) => ({ ...curve, colour: hues[k % hues.length] }));
  const limit = own.find(isThin) || own[0];
  return curves.map(curve => (curve.limit ? { ...curve, colour: limit.colour } : own.find(({ name }) => name === curve.name)));
}
const isThin = ({ name }) => name.startsWith("breakaway");

// Lines of events are drawn where there is room between them, px.
const BETWEEN_EVENTS = 20;

// The panels of one run, or of two: each curve of the first with that of the second beside it, and behind the panels of quantities
// those of their differences. A limit is drawn, but the panel's range does not follow it. A panel of changes counts from the left
// edge of the view when that is short: within a cycle, energies change by millionths of themselves.
function panelsOf(panels, sources) {
  const known = (curves, source) => curves.filter(({ name }) => source.trajectory.has(name)).map(curve => ({ ...curve, source }));
  const [first, second] = sources;
  return panels.flatMap(panel => {
    const own = second ? coloured(known(panel.curves, first), COOL) : known(panel.curves, first);
    const other = second ? coloured(known(panel.curves, second), WARM) : [];
    const curves = own.flatMap(curve => [curve, ...other.filter(({ name }) => name === curve.name)]);
    const differences = known(panel.curves.map(curve => ({ ...curve, name: DIFFERENCE + curve.name })), first);
    const title = `Difference, ${panel.title[0].toLowerCase()}${panel.title.slice(1)}`;
    return [{ ...panel, curves }, { title, curves: differences, shown: panel.shown && !panel.change }].filter(({ curves }) => curves.length);
  });
}

// [left, right, colour] of the modes between two times, each pixel once; `x` is the place of a time, `end` the right edge.
function shadesOf({ start, code, names }, from, to, x, end) {
  const shades = [];
  let drawn = LEFT;
  for (let i = Math.max(lowerBound(start, from) - 1, 0); i < start.length && start[i] < to; i++) {
    const next = i + 1 < start.length ? start[i + 1] : Infinity, right = Math.min(x(next), end);
    if (right < drawn + 0.5 && next < to) continue;
    shades.push([Math.max(x(start[i]), drawn), right, SHADES[names[code[i]]]]);
    drawn = right;
  }
  return shades;
}

class Chart {
  // `sources` are one run or two; the first has the ground and the list of events.
  constructor(root, panels, sources, onDraw) {
    Object.assign(this, { root, sources, onDraw, trajectory: sources[0].trajectory, run: sources[0] });
    const ends = sources.flatMap(({ events, trajectory }) => [...events.time.slice(-1), trajectory.end(trajectory.size - 1)]);
    this.limits = [Math.min(...sources.map(({ trajectory }) => trajectory.time[0])), Math.max(...ends)];
    if (!(this.limits[1] > this.limits[0])) this.limits[1] = this.limits[0] + 1e-3;
    [this.from, this.to] = this.limits;
    this.strip = root.appendChild(document.createElement("canvas"));
    this.panels = panelsOf(panels, sources).map(definition => this.makePanel(definition));
    this.axis = root.appendChild(element("canvas", undefined, "axis"));
    this.strip.style.height = `${STRIP * sources.length}px`;
    this.axis.style.height = `${AXIS}px`;
    this.pending = false;
    new ResizeObserver(() => this.schedule()).observe(root);
  }

  makePanel(definition) {
    const box = this.root.appendChild(element("div", undefined, "panel"));
    const panel = { ...definition, box, heading: box.appendChild(element("b")), canvas: null, scale: null };
    panel.unit = this.trajectory.unit(definition.curves[0].name);
    const legend = box.appendChild(element("div", undefined, "legend")), two = panel.curves.some(({ source }) => source !== this.run);
    // Wide below narrow: curves that coincide are all seen. The second of two runs is above the first.
    const own = panel.curves.filter(curve => !isThin(curve));
    panel.curves = panel.curves.map(curve => {
      const button = legend.appendChild(element("button"));
      const made = { ...curve, on: true, shift: 0, thin: isThin(curve), wide: two ? Number(curve.source === this.run) : Math.min(own.length - 1 - own.indexOf(curve), 2), button, output: null };
      button.type = "button";
      button.setAttribute("aria-pressed", "true");
      const label = element("span", two && !curve.limit ? `${this.sources.indexOf(curve.source) + 1}  ` : "");
      label.append(...typeset(curve.label));
      button.append(lineSwatch(curve.colour, curve.limit || curve.source !== this.run ? "dashed" : "solid"), label);
      // Of a limit there is no reading.
      if (!curve.limit) made.output = button.appendChild(element("output"));
      button.addEventListener("click", () => this.switchCurve(made, !made.on));
      return made;
    });
    panel.canvas = box.appendChild(element("canvas"));
    panel.canvas.style.height = `${PANEL}px`;
    box.hidden = !panel.shown;
    return panel;
  }

  switchCurve(curve, on) {
    curve.on = on;
    curve.button.setAttribute("aria-pressed", String(on));
    this.schedule();
  }

  showPanel(panel, shown) {
    panel.shown = shown;
    panel.box.hidden = !shown;
    this.schedule();
  }

  // Sets the view, as close as the limits allow, and draws it with the next frame.
  setView(from, to) {
    const [first, last] = this.limits, whole = last - first;
    // Zoomed in and out again the run is whole, to the last bit.
    const span = to - from > whole * (1 - 1e-9) ? whole : Math.max(to - from, SHORTEST);
    const middle = (from + to) / 2;
    this.from = Math.min(Math.max(middle - span / 2, first), last - span);
    this.to = this.from + span;
    this.schedule();
  }

  zoom(factor, at = (this.from + this.to) / 2) {
    const span = Math.min(Math.max((this.to - this.from) * factor, SHORTEST), this.limits[1] - this.limits[0]);
    const share = (at - this.from) / (this.to - this.from);
    this.setView(at - share * span, at + (1 - share) * span);
  }

  pan(share) {
    const by = share * (this.to - this.from);
    this.setView(this.from + by, this.to + by);
  }

  schedule() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.draw();
    });
  }

  x(time) {
    return LEFT + (time - this.from) * this.scale;
  }

  timeAt(x) {
    return this.from + (x - LEFT) / this.scale;
  }

  draw() {
    this.width = Math.max(this.root.clientWidth, LEFT + RIGHT + 50);
    this.plotWidth = this.width - LEFT - RIGHT;
    this.scale = this.plotWidth / (this.to - this.from);
    this.ticks = axisOf(this.from, this.to, this.plotWidth, 85);
    this.shades = shadesOf(this.run.modes, this.from, this.to, time => this.x(time), this.width - RIGHT);
    for (const source of this.sources) {
      source.columns = this.columnsInView(source.trajectory);
      source.marks = this.eventsInView(source.events);
      source.inView = [lowerBound(source.events.time, this.from), upperBound(source.events.time, this.to)];
      source.entries = source.columns[source.columns.length - 1] - source.columns[0];
      // Room for the states at the events as rings.
      source.rings = (source.inView[1] - source.inView[0]) * 24 <= this.plotWidth;
    }
    this.marks = this.run.marks;
    this.eventCount = this.run.inView[1] - this.run.inView[0];
    for (const panel of this.panels) if (panel.shown) this.drawPanel(panel);
    this.drawStrip();
    this.drawAxis();
    this.onDraw(this);
  }

  // Indices of entries: column c has those from starts[c] to starts[c + 1] - 1. The first and the last are the
  // neighbours of the view, to which the curves go on.
  columnsInView({ time, size }) {
    const starts = [];
    const last = Math.min(lowerBound(time, this.to) + 1, size);
    let i = Math.max(lowerBound(time, this.from) - 1, 0);
    while (i < last) {
      starts.push(i);
      const edge = Math.floor((time[i] - this.from) * this.scale) + 1;
      i++;
      if (time[i - 1] >= this.from && i < last && (time[i] - this.from) * this.scale < edge) {
        i = Math.max(lowerBound(time, this.from + edge / this.scale, i, last), i + 1);
      }
    }
    starts.push(last);
    return starts;
  }

  // [x, index] of the events, one of a kind in three pixels.
  eventsInView({ time, kind }) {
    const marks = [], latest = {};
    for (let i = lowerBound(time, this.from); i < time.length && time[i] <= this.to; i++) {
      const x = this.x(time[i]);
      if (x - latest[kind[i]] < 3) continue;
      latest[kind[i]] = x;
      marks.push([x, i]);
    }
    return marks;
  }

  drawPanel(panel) {
    const context = prepare(panel.canvas, this.width, PANEL);
    const right = this.width - RIGHT, top = 2, bottom = PANEL - 2;
    context.fillStyle = ink("ground");
    context.fillRect(LEFT, top, this.plotWidth, bottom - top);
    for (const [x0, x1, shade] of this.shades) {
      if (!shade) continue;
      context.fillStyle = ink(shade);
      context.fillRect(x0, top, x1 - x0, bottom - top);
    }
    const curves = panel.curves.filter(curve => curve.on);
    const change = panel.change && this.to - this.from < CHANGE_BELOW * (this.limits[1] - this.limits[0]);
    for (const curve of panel.curves) curve.shift = change ? curve.source.valueAt(curve.name, this.from) || 0 : 0;
    const [low, high] = this.rangeOf(curves);
    const y = value => bottom - (value - low) / (high - low) * (bottom - top);
    const axis = axisOf(low, high, bottom - top, 25, false, panel.unit);
    panel.scale = axis;
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const tick of axis.ticks) {
      const at = y(tick.value);
      context.fillStyle = ink("grid");
      context.fillRect(LEFT, Math.round(at), this.plotWidth, 1);
      context.fillStyle = ink("axis");
      if (at > 6 && at < PANEL - 6) context.fillText(tick.text, LEFT - 6, at);
    }
    context.fillStyle = ink("grid");
    for (const tick of this.ticks.ticks) context.fillRect(Math.round(this.x(tick.value)), top, 1, bottom - top);
    context.save();
    context.beginPath();
    context.rect(LEFT, top, this.plotWidth, bottom - top);
    context.clip();
    if (this.eventCount < this.plotWidth / BETWEEN_EVENTS) this.drawEventLines(context, top, bottom);
    for (const curve of curves) this.drawCurve(context, curve, value => y(value - curve.shift));
    context.restore();
    context.strokeStyle = ink("frame");
    context.strokeRect(LEFT + 0.5, top + 0.5, this.plotWidth - 1, bottom - top - 1);
    panel.heading.replaceChildren(...typeset(nameOf({ label: `${panel.title}${change ? " since the left edge" : ""}`, unit: panel.unit }, axis)));
  }

  rangeOf(curves) {
    let low = Infinity, high = -Infinity;
    const take = (value, shift) => {
      if (value - shift < low) low = value - shift;
      if (value - shift > high) high = value - shift;
    };
    for (const { name, source, limit, shift } of curves) {
      if (limit) continue;
      const { pyramid } = source.trajectory.channel(name), states = source.events.states.get(name);
      const first = source.columns[0], last = source.columns[source.columns.length - 1];
      // The neighbours of the view count only where the curve enters and leaves it.
      pyramid.extremes(Math.min(first + 1, last), Math.max(last - 1, first));
      const ends = [pyramid.low, pyramid.high, source.valueAt(name, this.from), source.valueAt(name, this.to)];
      if (states) {
        states.pyramid.extremes(...source.inView);
        ends.push(states.pyramid.low, states.pyramid.high);
      }
      for (const value of ends) if (isFinite(value)) take(value, shift);
    }
    // A torque that changes its sign has a limit on both sides.
    for (const { name, source, limit } of low < 0 && high > 0 ? curves : []) {
      if (!limit) continue;
      const { pyramid } = source.trajectory.channel(name);
      pyramid.extremes(source.columns[0], source.columns[source.columns.length - 1]);
      take(pyramid.low, 0);
    }
    return padded(low, high);
  }

  drawEventLines(context, top, bottom) {
    context.globalAlpha = 0.45;
    for (const [x, i] of this.marks) {
      context.fillStyle = ink(GLYPHS[this.run.events.kinds[this.run.events.kind[i]]].colour);
      context.fillRect(Math.round(x), top, 1, bottom - top);
    }
    context.globalAlpha = 1;
  }

  // The second of two runs is dashed where its samples are few: among many, dashes could not be told from the curve.
  drawCurve(context, curve, y) {
    const { source } = curve, { entries, trajectory } = source, second = source !== this.run && !curve.limit, dense = entries > 2 * this.plotWidth;
    // A line of one pixel takes a fraction of the time of a broader one; where it is dense, it looks the same.
    const thin = curve.limit || (second ? 1 : 4) * entries > this.plotWidth;
    const stroke = (dash, trace) => {
      context.beginPath();
      trace();
      context.strokeStyle = ink(curve.colour);
      context.lineWidth = curve.thin ? 1 : thin ? 1 + curve.wide : second ? 1.8 : 1.4 + 1.2 * curve.wide;
      context.setLineDash(dash);
      context.stroke();
      context.setLineDash([]);
    };
    if (dense) {
      stroke(curve.limit ? [5, 4] : [], () => this.traceColumns(context, source, curve, y));
    } else {
      const points = this.vertices(source, curve.name);
      stroke(curve.limit ? [5, 4] : second && !thin ? [7, 3] : [], () => this.traceVertices(context, source, points, y, false));
      if (source.sparse.from.length) stroke([2, 4], () => this.traceVertices(context, source, points, y, true));
    }
    if (trajectory.bucket) this.drawBands(context, source, curve, y);
    if (entries * 7 < this.plotWidth && !curve.limit) this.drawDots(context, source, curve, y);
    if (source.rings && !curve.limit) this.drawRings(context, source, curve, y);
  }

  // More entries than pixels: in each column from the first by way of least and largest to the last, states at events included.
  traceColumns(context, source, curve, y) {
    const { trajectory, columns, events } = source, { low, pyramid } = trajectory.channel(curve.name);
    const states = events.states.get(curve.name);
    let down = false, x = 0, latest = NaN;
    const to = value => {
      if (isNaN(value) || (down && value === latest)) return;
      if (down) context.lineTo(x, y(value));
      else context.moveTo(x, y(value));
      down = true;
      latest = value;
    };
    let event = states ? lowerBound(events.time, trajectory.time[columns[0]]) : 0;
    for (let c = 0; c + 1 < columns.length; c++) {
      const i = columns[c], j = columns[c + 1], first = low[i], last = low[j - 1], before = event;
      const end = j < trajectory.size ? trajectory.time[j] : Infinity;
      while (states && event < events.time.length && events.time[event] < end) event++;
      // In the middle of a pixel, or a line of one pixel would be two pale ones.
      x = Math.floor(this.x(trajectory.time[i])) + 0.5;
      latest = NaN;
      if (j === i + 1 && event === before) {
        // A bucket that is a column of its own is a band.
        if (trajectory.isBucket(i) || isNaN(first)) down = false;
        else to(first);
        continue;
      }
      pyramid.extremes(i, j);
      let { low: least, high: most } = pyramid;
      if (event > before) {
        states.pyramid.extremes(before, event);
        least = Math.min(least, states.pyramid.low);
        most = Math.max(most, states.pyramid.high);
      }
      if (least === Infinity) {
        down = false;
        continue;
      }
      const rising = !(last < first);
      to(first);
      to(rising ? least : most);
      to(rising ? most : least);
      to(last);
    }
  }

  // Few entries: each sample, and the states on both sides of the events between them. A NaN is a gap.
  vertices(source, name) {
    const { trajectory, columns, events } = source, { time } = trajectory, { low } = trajectory.channel(name);
    const states = events.states.get(name), times = [], values = [];
    const first = columns[0], last = columns[columns.length - 1];
    const push = (t, value) => {
      times.push(t);
      values.push(value);
    };
    let event = lowerBound(events.time, time[first]);
    const pass = until => {
      for (; states && event < events.time.length && events.time[event] <= until; event++) {
        push(events.time[event], states.before[event]);
        push(events.time[event], states.after[event]);
      }
    };
    for (let i = first; i < last; i++) {
      if (i > first) pass(time[i]);
      push(time[i], trajectory.isBucket(i) ? NaN : low[i]);
    }
    // Behind the last sample of the run.
    if (last === trajectory.size) pass(this.limits[1]);
    return { times, values };
  }

  // The lines that are in stretches with too few samples, or the others.
  traceVertices(context, source, { times, values }, y, sparse) {
    const left = this.timeAt(LEFT - 20), right = this.timeAt(this.width - RIGHT + 20), some = source.sparse.from.length > 0;
    let down = false;
    for (let k = 0; k < times.length; k++) {
      const t0 = k > 0 ? times[k - 1] : NaN, v0 = k > 0 ? values[k - 1] : NaN, t1 = times[k], v1 = values[k];
      const mine = some ? source.isSparse((t0 + t1) / 2) === sparse : !sparse;
      // The neighbours of the view may be a million pixels away: lines begin and end just outside of it instead.
      if (mine && t0 <= t1 && t1 >= left && t0 <= right && !isNaN(v0) && !isNaN(v1)) {
        const at = t => (t1 > t0 ? v0 + (v1 - v0) * (t - t0) / (t1 - t0) : v1);
        const begin = Math.max(t0, left), end = Math.min(t1, right);
        if (!down) context.moveTo(this.x(begin), y(begin === t0 ? v0 : at(begin)));
        down = true;
        context.lineTo(this.x(end), y(end === t1 ? v1 : at(end)));
      } else {
        down = false;
      }
    }
  }

  // What stands for samples that are not on the page: from the least to the largest value.
  drawBands(context, source, curve, y) {
    const { trajectory, columns } = source, { low, high } = trajectory.channel(curve.name);
    context.fillStyle = ink(curve.colour);
    context.globalAlpha = 0.5;
    for (let c = 0; c + 1 < columns.length; c++) {
      const i = columns[c];
      if (columns[c + 1] > i + 1 && source.entries > 2 * this.plotWidth) continue;
      for (let k = i; k < columns[c + 1]; k++) {
        if (!trajectory.isBucket(k)) continue;
        const x0 = Math.max(this.x(trajectory.time[k]), LEFT - 5), x1 = Math.min(this.x(trajectory.end(k)), this.width);
        const top = y(high[k]);
        context.fillRect(x0, top - 0.5, Math.max(x1 - x0, 1), y(low[k]) - top + 1);
      }
    }
    context.globalAlpha = 1;
  }

  // Where they are far enough apart, the samples themselves.
  drawDots(context, source, curve, y) {
    const { columns, trajectory } = source, values = trajectory.channel(curve.name).low;
    context.fillStyle = ink(curve.colour);
    context.beginPath();
    for (let i = columns[0]; i < columns[columns.length - 1]; i++) {
      const x = this.x(trajectory.time[i]);
      if (trajectory.isBucket(i) || isNaN(values[i]) || x < LEFT - 5 || x > this.width) continue;
      context.moveTo(x + 2, y(values[i]));
      context.arc(x, y(values[i]), 2, 0, 7);
    }
    context.fill();
  }

  // Events are not samples: the states before and after each are rings.
  drawRings(context, source, curve, y) {
    const states = source.events.states.get(curve.name);
    if (!states) return;
    context.strokeStyle = ink(curve.colour);
    context.lineWidth = 1;
    for (const [x, i] of source.marks) {
      for (const value of [states.before[i], states.after[i]]) {
        context.beginPath();
        context.arc(x, y(value), 3.5, 0, 7);
        context.stroke();
      }
    }
  }

  drawStrip() {
    const context = prepare(this.strip, this.width, STRIP * this.sources.length);
    context.textAlign = "right";
    context.textBaseline = "middle";
    this.sources.forEach(({ events: { kinds, kind }, marks }, k) => {
      context.fillStyle = ink("axis");
      context.fillText(this.sources.length > 1 ? `run ${k + 1}` : "events", LEFT - 6, STRIP * (k + 0.5));
      for (const [x, i] of marks) drawMark(context, GLYPHS[kinds[kind[i]]], x, STRIP * (k + 0.5));
    });
  }

  drawAxis() {
    const context = prepare(this.axis, this.width, AXIS);
    const { ticks, prefix, offset, offsetText } = this.ticks;
    context.fillStyle = ink("axis");
    context.textBaseline = "top";
    context.textAlign = "center";
    for (const tick of ticks) {
      const x = this.x(tick.value), half = context.measureText(tick.text).width / 2;
      context.fillRect(Math.round(x), 0, 1, 4);
      context.fillText(tick.text, Math.min(Math.max(x, half + 1), this.width - half - 1), 6);
    }
    const name = offset ? `t − ${offsetText} s, in ${prefix}s` : `time t, ${prefix}s`;
    context.fillText(name, LEFT + this.plotWidth / 2, 23);
  }
}
