// The panels over time: one view for all of them, drawn column of pixels by column of pixels.

// Okabe and Ito's colours, which colour-blind readers can tell apart.
const BLUE = "#0072B2", VERMILLION = "#D55E00", GREEN = "#009E73", ORANGE = "#E69F00", PURPLE = "#CC79A7", BLACK = "#000000";

// By mode code's name: what is behind the curves.
const SHADES = { "separated": "#d9d9d9", "stick": "#fae8c2", "slip-forward": "#ffffff", "slip-backward": "#f4e2ec"{{shades}} };

// By kind: colour, outline around (0, 0), whether it is filled.
const GLYPHS = {
  stick: [VERMILLION, "M-4-4H4V4H-4Z", true],
  slip: [BLUE, "M0-5L5 4H-5Z", true],
  reversal: [PURPLE, "M0-5L5 0L0 5L-5 0Z", true],
  separation: [BLACK, "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0-4 0Z", false],
  contact: [BLACK, "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0-4 0Z", true],
  kick: [GREEN, "M0-6L1.8-1.8L6 0L1.8 1.8L0 6L-1.8 1.8L-6 0L-1.8-1.8Z", true],
  corner: ["#555555", "M-5 4L0-4L5 4", false],
  destabilised: [BLACK, "M0-5L5 4H-5Z", false],
  restabilised: [BLACK, "M0 5L5-4H-5Z", false],
};

// [channel, name, colour]; a limit is drawn, but the panel's range does not follow it. A panel of changes counts from the
// left edge of the view when that is short: within a cycle, energies change by millionths of themselves.
const PANELS = [
{{panels}}];

const LEFT = 66, RIGHT = 10, PANEL = 122, STRIP = 22, AXIS = 40;
// The part of the run below which a view is short.
const CHANGE_BELOW = 0.1;
// The shortest view: events are known to about 1e-12 s, times of 7 s resolve 1e-15 s.
const SHORTEST = 1e-7;

class Chart {
  // `run` has modes {start, code, names} and events {time, kind, kinds, states}, decoded.
  constructor(root, trajectory, run, onDraw) {
    Object.assign(this, { root, trajectory, run, onDraw });
    const times = [...run.events.time.slice(-1), trajectory.end(trajectory.size - 1)];
    this.limits = [trajectory.time[0], Math.max(...times)];
    if (!(this.limits[1] > this.limits[0])) this.limits[1] = this.limits[0] + 1e-3;
    [this.from, this.to] = this.limits;
    this.strip = root.appendChild(document.createElement("canvas"));
    this.panels = PANELS.map(definition => this.makePanel(definition));
    this.axis = root.appendChild(document.createElement("canvas"));
    this.strip.style.height = `${STRIP}px`;
    this.axis.style.height = `${AXIS}px`;
    this.pending = false;
    new ResizeObserver(() => this.schedule()).observe(root);
  }

  makePanel(definition) {
    const box = this.root.appendChild(document.createElement("div"));
    const legend = box.appendChild(document.createElement("div"));
    legend.className = "legend";
    const title = legend.appendChild(document.createElement("b"));
    const curves = definition.curves.filter(([name]) => this.trajectory.has(name));
    const panel = { title: definition.title, box, titleElement: title, canvas: null, shown: definition.shown, change: definition.change, curves: [] };
    for (const [name, label, colour, limit] of curves) {
      const curve = { name, colour, limit: limit === "limit", thin: name.startsWith("breakaway"), on: true, output: null };
      panel.curves.push(curve);
      const button = legend.appendChild(document.createElement("button"));
      button.type = "button";
      button.setAttribute("aria-pressed", "true");
      const swatch = button.appendChild(document.createElement("i"));
      swatch.style.borderColor = colour;
      if (curve.limit) swatch.style.borderTopStyle = "dashed";
      button.append(label);
      curve.output = button.appendChild(document.createElement("output"));
      button.addEventListener("click", () => {
        curve.on = !curve.on;
        button.setAttribute("aria-pressed", String(curve.on));
        this.schedule();
      });
    }
    panel.canvas = box.appendChild(document.createElement("canvas"));
    panel.canvas.style.height = `${PANEL}px`;
    box.hidden = !panel.shown;
    return panel;
  }

  // Sets the view, as close as the limits allow, and draws it with the next frame.
  setView(from, to) {
    const [first, last] = this.limits;
    const span = Math.min(Math.max(to - from, SHORTEST), last - first);
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
    this.columns = this.columnsInView();
    this.shades = this.shadesInView();
    this.marks = this.eventsInView();
    // Room for the states at the events.
    this.rings = this.eventCount * 24 <= this.plotWidth;
    for (const panel of this.panels) if (panel.shown) this.drawPanel(panel);
    this.drawStrip();
    this.drawAxis();
    this.onDraw(this);
  }

  // Indices of entries: column c has those from starts[c] to starts[c + 1] - 1. The first and the last are the
  // neighbours of the view, to which the curves go on.
  columnsInView() {
    const { time, size } = this.trajectory, starts = [];
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

  // [left, right, colour] of the modes, each pixel once.
  shadesInView() {
    const { start, code, names } = this.run.modes, shades = [];
    let drawn = LEFT;
    for (let i = Math.max(lowerBound(start, this.from) - 1, 0); i < start.length && start[i] < this.to; i++) {
      const end = i + 1 < start.length ? start[i + 1] : this.limits[1];
      const right = Math.min(this.x(end), this.width - RIGHT);
      if (right < drawn + 0.5 && end < this.to) continue;
      shades.push([Math.max(this.x(start[i]), drawn), right, SHADES[names[code[i]]]]);
      drawn = right;
    }
    return shades;
  }

  // [x, index] of the events, one of a kind in three pixels.
  eventsInView() {
    const { time, kind } = this.run.events, marks = [], latest = {};
    this.eventCount = 0;
    for (let i = lowerBound(time, this.from); i < time.length && time[i] <= this.to; i++) {
      this.eventCount++;
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
    context.fillStyle = SHADES["slip-forward"];
    context.fillRect(LEFT, top, this.plotWidth, bottom - top);
    for (const [x0, x1, colour] of this.shades) {
      if (colour === SHADES["slip-forward"]) continue;
      context.fillStyle = colour;
      context.fillRect(x0, top, x1 - x0, bottom - top);
    }
    const curves = panel.curves.filter(curve => curve.on);
    const change = panel.change && this.to - this.from < CHANGE_BELOW * (this.limits[1] - this.limits[0]);
    for (const curve of curves) curve.shift = change ? this.leftValue(curve) : 0;
    const [low, high] = this.rangeOf(curves);
    const y = value => bottom - (value - low) / (high - low) * (bottom - top);
    const axis = axisOf(low, high, bottom - top, 25);
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const tick of axis.ticks) {
      const at = y(tick.value);
      context.fillStyle = "#0000001c";
      context.fillRect(LEFT, Math.round(at), this.plotWidth, 1);
      context.fillStyle = INK;
      if (at > 6 && at < PANEL - 6) context.fillText(tick.text, LEFT - 6, at);
    }
    context.fillStyle = "#0000001c";
    for (const tick of this.ticks.ticks) context.fillRect(Math.round(this.x(tick.value)), top, 1, bottom - top);
    context.save();
    context.beginPath();
    context.rect(LEFT, top, this.plotWidth, bottom - top);
    context.clip();
    if (this.eventCount < this.plotWidth / 7) this.drawEventLines(context, top, bottom);
    for (const curve of curves) this.drawCurve(context, curve, value => y(value - curve.shift));
    context.restore();
    context.strokeStyle = "#999";
    context.strokeRect(LEFT + 0.5, top + 0.5, this.plotWidth - 1, bottom - top - 1);
    const unit = panel.curves.length ? readable(this.trajectory.channel(panel.curves[0].name).unit) : "";
    const offset = axis.offset ? `, from ${axis.offsetText} ${unit}` : "";
    panel.titleElement.textContent = `${panel.title}${change ? " since the left edge" : ""}, ${axis.prefix}${unit}${offset}`;
  }

  rangeOf(curves) {
    const first = this.columns[0], last = this.columns[this.columns.length - 1];
    let low = Infinity, high = -Infinity;
    for (const curve of curves) {
      if (curve.limit) continue;
      const { pyramid, low: values } = this.trajectory.channel(curve.name);
      // The neighbours of the view count only where the curve enters and leaves it.
      pyramid.extremes(Math.min(first + 1, last), Math.max(last - 1, first));
      const edges = [this.valueAt(values, this.from, first), this.valueAt(values, this.to, Math.max(last - 2, first))];
      const states = this.rings && this.run.events.states.get(curve.name);
      if (states) for (const [, i] of this.marks) edges.push(states.before[i], states.after[i]);
      low = Math.min(low, pyramid.low - curve.shift, ...edges.filter(isFinite).map(value => value - curve.shift));
      high = Math.max(high, pyramid.high - curve.shift, ...edges.filter(isFinite).map(value => value - curve.shift));
    }
    return padded(low, high);
  }

  leftValue(curve) {
    const value = this.valueAt(this.trajectory.channel(curve.name).low, this.from, this.columns[0]);
    return isFinite(value) ? value : 0;
  }

  // On the straight line from entry i to the next.
  valueAt(values, time, i) {
    const t = this.trajectory.time;
    if (i + 1 >= this.trajectory.size || !(time > t[i])) return values[i];
    return values[i] + (values[i + 1] - values[i]) * Math.min((time - t[i]) / (t[i + 1] - t[i]), 1);
  }

  drawEventLines(context, top, bottom) {
    for (const [x, i] of this.marks) {
      context.fillStyle = GLYPHS[this.run.events.kinds[this.run.events.kind[i]]][0] + "70";
      context.fillRect(Math.round(x), top, 1, bottom - top);
    }
  }

  drawCurve(context, curve, y) {
    context.beginPath();
    const entries = this.columns[this.columns.length - 1] - this.columns[0];
    const dense = entries > 2 * this.plotWidth;
    if (dense) this.traceColumns(context, curve, y);
    else this.traceVertices(context, curve, y);
    context.strokeStyle = curve.colour;
    // A line of one pixel takes a fraction of the time of a broader one; where it is dense, it looks the same.
    context.lineWidth = curve.thin || 4 * entries > this.plotWidth ? 1 : 1.4;
    context.setLineDash(curve.limit ? [5, 4] : []);
    context.stroke();
    context.setLineDash([]);
    if (this.trajectory.bucket) this.drawBands(context, curve, y);
    if (entries * 7 < this.plotWidth && !curve.limit) this.drawDots(context, curve, y);
    if (this.rings) this.drawRings(context, curve, y);
  }

  // More entries than pixels: in each column from the first by way of least and largest to the last.
  traceColumns(context, curve, y) {
    const { trajectory, columns } = this, { low, pyramid } = trajectory.channel(curve.name);
    let down = false, x = 0, latest = NaN;
    const to = value => {
      if (isNaN(value) || (down && value === latest)) return;
      if (down) context.lineTo(x, y(value));
      else context.moveTo(x, y(value));
      down = true;
      latest = value;
    };
    for (let c = 0; c + 1 < columns.length; c++) {
      const i = columns[c], j = columns[c + 1], first = low[i], last = low[j - 1];
      x = Math.round(this.x(trajectory.time[i]));
      latest = NaN;
      if (j === i + 1) {
        // A bucket that is a column of its own is a band.
        if (trajectory.isBucket(i) || isNaN(first)) down = false;
        else to(first);
        continue;
      }
      pyramid.extremes(i, j);
      if (pyramid.low === Infinity) {
        down = false;
        continue;
      }
      const rising = !(last < first);
      to(first);
      to(rising ? pyramid.low : pyramid.high);
      to(rising ? pyramid.high : pyramid.low);
      to(last);
    }
  }

  // Few entries: through each sample, and through the states on both sides of the events between them.
  traceVertices(context, curve, y) {
    const { trajectory, columns } = this, { time } = trajectory, { low } = trajectory.channel(curve.name);
    const states = this.rings && this.run.events.states.get(curve.name), eventTime = this.run.events.time;
    const first = columns[0], last = columns[columns.length - 1];
    const left = this.timeAt(LEFT - 20), right = this.timeAt(this.width - RIGHT + 20);
    let t0 = NaN, v0 = NaN, down = false, event = lowerBound(eventTime, time[first]);
    // The neighbours of the view may be a million pixels away: lines begin and end just outside of it instead.
    const to = (t1, v1) => {
      if (t0 <= t1 && t1 >= left && t0 <= right) {
        const at = t => (t1 > t0 ? v0 + (v1 - v0) * (t - t0) / (t1 - t0) : v1);
        const begin = Math.max(t0, left), end = Math.min(t1, right);
        if (!down) context.moveTo(this.x(begin), y(begin === t0 ? v0 : at(begin)));
        down = true;
        context.lineTo(this.x(end), y(end === t1 ? v1 : at(end)));
      } else {
        down = false;
      }
      t0 = isNaN(v1) ? NaN : t1;
      v0 = v1;
    };
    for (let i = first; i < last; i++) {
      for (; states && i > first && event < eventTime.length && eventTime[event] <= time[i]; event++) {
        to(eventTime[event], states.before[event]);
        to(eventTime[event], states.after[event]);
      }
      if (trajectory.isBucket(i)) to(NaN, NaN);
      else to(time[i], low[i]);
    }
  }

  // What stands for samples that are not on the page: from the least to the largest value.
  drawBands(context, curve, y) {
    const { trajectory, columns } = this, { low, high } = trajectory.channel(curve.name);
    context.fillStyle = `${curve.colour}80`;
    for (let c = 0; c + 1 < columns.length; c++) {
      const i = columns[c];
      if (columns[c + 1] > i + 1 && columns[columns.length - 1] - columns[0] > 2 * this.plotWidth) continue;
      for (let k = i; k < columns[c + 1]; k++) {
        if (!trajectory.isBucket(k)) continue;
        const x0 = Math.max(this.x(trajectory.time[k]), LEFT - 5), x1 = Math.min(this.x(trajectory.end(k)), this.width);
        const top = y(high[k]);
        context.fillRect(x0, top - 0.5, Math.max(x1 - x0, 1), y(low[k]) - top + 1);
      }
    }
  }

  // Where they are far enough apart, the samples themselves.
  drawDots(context, curve, y) {
    const { columns, trajectory } = this, values = trajectory.channel(curve.name).low;
    context.fillStyle = curve.colour;
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
  drawRings(context, curve, y) {
    const states = this.run.events.states.get(curve.name);
    if (!states) return;
    context.strokeStyle = curve.colour;
    context.lineWidth = 1;
    for (const [x, i] of this.marks) {
      for (const value of [states.before[i], states.after[i]]) {
        context.beginPath();
        context.arc(x, y(value), 3.5, 0, 7);
        context.stroke();
      }
    }
  }

  drawStrip() {
    const context = prepare(this.strip, this.width, STRIP);
    const { kinds, kind } = this.run.events;
    context.fillStyle = INK;
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.fillText("events", LEFT - 6, STRIP / 2);
    for (const [x, i] of this.marks) drawGlyph(context, kinds[kind[i]], x, STRIP / 2);
  }

  drawAxis() {
    const context = prepare(this.axis, this.width, AXIS);
    const { ticks, prefix, offset, offsetText } = this.ticks;
    context.fillStyle = INK;
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

const glyphPaths = Object.fromEntries(Object.entries(GLYPHS).map(([kind, [, outline]]) => [kind, new Path2D(outline)]));

function drawGlyph(context, kind, x, y) {
  const [colour, , filled] = GLYPHS[kind], path = glyphPaths[kind];
  context.save();
  context.translate(x, y);
  context.fillStyle = filled ? colour : "#ffffff";
  context.fill(path);
  context.strokeStyle = colour;
  context.lineWidth = 1.3;
  context.stroke(path);
  context.restore();
}

// The same as an element of a list.
function glyphElement(kind) {
  const [colour, outline, filled] = GLYPHS[kind];
  const make = name => document.createElementNS("http://www.w3.org/2000/svg", name);
  const svg = make("svg"), path = svg.appendChild(make("path"));
  svg.setAttribute("class", "glyph");
  svg.setAttribute("viewBox", "-6 -6 12 12");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", outline);
  path.setAttribute("fill", filled ? colour : "#ffffff");
  path.setAttribute("stroke", colour);
  path.setAttribute("stroke-width", "1.3");
  return svg;
}
