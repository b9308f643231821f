// Axes: ticks, SI prefixes, and an offset where the digits that change are far from the first.

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"], [1e-15, "f"]];
const FONT = '12px system-ui, "DejaVu Sans", sans-serif';

// The colours of the page by name, as its style has them: there are light ones and dark ones.
let palette = new Map();
function ink(name) {
  if (!palette.has(name)) palette.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return palette.get(name);
}

// Below this part of a value, the step between two ticks is read better without the value's leading digits.
const OFFSET_BELOW = 1e-4;

function prefixFor(size) {
  if (!(size > 0) || !isFinite(size)) return PREFIXES[3];
  return PREFIXES.find(([factor]) => size >= factor * 0.9999999) || PREFIXES[PREFIXES.length - 1];
}

const minus = text => text.replace("-", "−");

// UDUNITS as one writes it: "rad s-1" is rad/s.
const readable = unit => (unit === "1" ? "" : unit.replace(/ ?s-1$/, "/s"));

// A value with a prefix and some digits.
function withUnit(value, unit, digits = 6) {
  if (!isFinite(value)) return minus(String(value));
  if (value === 0) return `0 ${readable(unit)}`;
  const [factor, prefix] = prefixFor(Math.abs(value));
  if (Math.abs(value) < factor) return minus(`${value.toExponential(2)} ${readable(unit)}`);
  return minus(`${(value / factor).toPrecision(digits)} ${prefix}${readable(unit)}`);
}

// A value as it is read from an axis: in the axis' prefix and from its offset, with three digits more than the ticks.
function onAxis(value, axis, unit, from = 0) {
  if (!isFinite(value)) return minus(String(value));
  const number = (value - from - axis.offset) / axis.factor, text = number.toFixed(Math.min(axis.decimals + 3, 20));
  const sign = (axis.offset !== 0 || from !== 0) && number > 0 ? "+" : "";
  return `${sign}${minus(text)} ${axis.prefix}${readable(unit)}`;
}

// About one tick in `spacing` pixels, of a number of things only at `whole` ones, which have no prefix; `label` is what the tick labels
// leave out: prefix and offset.
function axisOf(from, to, pixels, spacing, whole = false) {
  const span = to - from, rough = span * spacing / pixels;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = Math.max(power * [1, 2, 5, 10].find(m => m * power >= rough * 0.9999999), whole ? 1 : 0);
  const size = Math.max(Math.abs(from), Math.abs(to));
  let offset = 0, offsetText = "", shown = size;
  if (step < size * OFFSET_BELOW) {
    const digits = Math.floor(Math.log10(span)) + 1, round = 10 ** digits;
    offset = Math.round((from + to) / 2 / round) * round;
    offsetText = offset.toFixed(Math.min(Math.max(0, -digits), 20));
    shown = Math.max(Math.abs(from - offset), Math.abs(to - offset));
  }
  const [factor, prefix] = whole ? [1, ""] : prefixFor(shown);
  const decimals = Math.min(Math.max(0, -Math.floor(Math.log10(step / factor) + 1e-6)), 20);
  const ticks = [];
  for (let k = Math.ceil(from / step); k * step <= to && ticks.length < 100; k++) {
    const value = (k * step - offset) / factor;
    const text = value.toFixed(decimals), zero = Number(text) === 0;
    const sign = offset !== 0 && value > 0 && !zero ? "+" : "";
    ticks.push({ value: k * step, text: zero ? (0).toFixed(decimals) : sign + minus(text) });
  }
  return { ticks, prefix, factor, decimals, offset, offsetText: minus(offsetText) };
}

// A canvas that fills its place, sharp on any screen; returns its context in CSS pixels.
function prepare(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = FONT;
  context.lineWidth = 1;
  return context;
}

// Some room above and below the values; a range for a constant as well.
function padded(low, high) {
  if (!(low <= high)) return [0, 1];
  const range = high - low, size = Math.max(Math.abs(low), Math.abs(high));
  const pad = range > size * 1e-13 ? range * 0.07 : size * 1e-3 || 1;
  return [low - pad, high + pad];
}
