// Numbers, units and axes: ticks, SI prefixes, and an offset where the digits that change are far from the first.

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"], [1e-15, "f"]];
const FONT = '12px system-ui, "DejaVu Sans", sans-serif', SMALL_FONT = '9px system-ui, "DejaVu Sans", sans-serif';

// Colours by name, as the style has them: there are light ones and dark ones. Others are colours themselves.
let palette = new Map();
const inked = colour => (colour[0] === "#" ? colour : `var(--${colour})`);
function ink(colour) {
  if (colour[0] === "#") return colour;
  if (!palette.has(colour)) palette.set(colour, getComputedStyle(document.documentElement).getPropertyValue(`--${colour}`).trim());
  return palette.get(colour);
}

// Below this part of a value, the step between two ticks is read better without the value's leading digits.
const OFFSET_BELOW = 1e-4;

const minus = text => text.replaceAll("-", "−");
const power = exponent => `10${String(Number(exponent)).replace(/./g, c => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] || "⁻")}`;

// A number as one writes it: 2.7e-12 is 2.7·10⁻¹².
function typographic(text) {
  const [digits, exponent] = text.split("e");
  if (exponent === undefined) return minus(text);
  return minus(digits === "1" || digits === "-1" ? digits.replace("1", "") : `${digits}·`) + power(exponent);
}

// A number with so many digits at most, without a prefix.
function plain(value, digits = 17) {
  const short = digits < 17 ? Number(value.toPrecision(digits)) : value, size = Math.abs(short);
  return typographic(short === 0 || (size >= 1e-3 && size < 1e6) ? String(short) : short.toExponential());
}

// UDUNITS as one writes it: "rad s-1" is rad/s, "s-1" is s⁻¹.
const readable = unit => (unit === "1" ? "" : unit.replace(/(?<=.) ([a-z]+)-1$/i, "/$1").replace(/(?<=[a-z])-?\d+/gi, n => power(n).slice(2)));

// The prefix of a size; a power of ten where a unit takes none.
function prefixFor(size, unit) {
  if (!(size > 0) || !isFinite(size)) return PREFIXES[3];
  if (unit === "1" || unit.startsWith("kg")) {
    const exponent = 3 * Math.floor(Math.log10(size * 1.0000001) / 3);
    return exponent < -3 || exponent > 3 ? [10 ** exponent, `${power(exponent)} `] : PREFIXES[3];
  }
  return PREFIXES.find(([factor]) => size >= factor * 0.9999999) || PREFIXES[PREFIXES.length - 1];
}

// A value with a prefix and some digits.
function withUnit(value, unit, digits = 6) {
  if (!isFinite(value)) return minus(String(value));
  if (unit === "1") return plain(value, digits);
  if (value === 0) return `0 ${readable(unit)}`;
  const [factor, prefix] = prefixFor(Math.abs(value), unit);
  if (Math.abs(value) < factor) return `${typographic(value.toExponential(2))} ${readable(unit)}`;
  return `${minus((value / factor).toPrecision(digits))} ${prefix}${readable(unit)}`;
}

// A value as it is read from an axis: in the axis' prefix and from its offset, with three digits more than the ticks.
function onAxis(value, axis, unit, from = 0) {
  if (!isFinite(value)) return minus(String(value));
  const number = (value - from - axis.offset) / axis.factor, text = number.toFixed(Math.min(axis.decimals + 3, 20));
  const sign = (axis.offset !== 0 || from !== 0) && number > 0 ? "+" : "";
  return `${sign}${minus(text)}${axis.prefix.startsWith("10") ? "·" : " "}${axis.prefix}${readable(unit)}`;
}

// About one tick in `spacing` pixels; of a number of things only at `whole` ones, which have no prefix. Ticks leave out prefix and
// offset, which are for the name of the axis.
function axisOf(from, to, pixels, spacing, whole = false, unit = "s") {
  const span = to - from, rough = span * spacing / pixels;
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = Math.max(decade * [1, 2, 5, 10].find(m => m * decade >= rough * 0.9999999), whole ? 1 : 0);
  const size = Math.max(Math.abs(from), Math.abs(to));
  let offset = 0, offsetText = "", shown = size;
  if (step < size * OFFSET_BELOW) {
    const digits = Math.floor(Math.log10(span)) + 1, round = 10 ** digits;
    offset = Math.round((from + to) / 2 / round) * round;
    offsetText = offset.toFixed(Math.min(Math.max(0, -digits), 20));
    shown = Math.max(Math.abs(from - offset), Math.abs(to - offset));
  }
  const [factor, prefix] = whole ? [1, ""] : prefixFor(shown, unit);
  const decimals = Math.min(Math.max(0, -Math.floor(Math.log10(step / factor) + 1e-6)), 20);
  const ticks = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9 * step && ticks.length < 100; k++) {
    const value = (k * step - offset) / factor;
    const text = value.toFixed(decimals), zero = Number(text) === 0;
    const sign = offset !== 0 && value > 0 && !zero ? "+" : "";
    ticks.push({ value: k * step, text: zero ? (0).toFixed(decimals) : sign + minus(text) });
  }
  return { ticks, prefix, factor, decimals, offset, offsetText: minus(offsetText) };
}

// Ticks at powers of ten, of an axis whose ends are decimal logarithms; at round values where there are no two of them.
function powersOf(from, to, pixels, spacing, unit) {
  const first = Math.ceil(from - 1e-9), last = Math.floor(to + 1e-9), step = Math.ceil((to - from) * spacing / pixels);
  const none = { prefix: "", factor: 1, decimals: 0, offset: 0, offsetText: "" };
  if (last <= first) {
    const axis = axisOf(10 ** from, 10 ** to, pixels, spacing, false, unit);
    return { ...axis, ticks: axis.ticks.filter(({ value }) => value > 0).map(tick => ({ ...tick, value: Math.log10(tick.value) })) };
  }
  const ticks = Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, k) => first + k * step);
  return { ...none, ticks: ticks.map(value => ({ value, text: power(value) })) };
}

// An axis {low, high, unit} by its kind: the codes of `words`, decimal logarithms, `whole` numbers, or any values.
function ticksOf({ low, high, unit, words, logarithmic, whole }, pixels, spacing) {
  if (words && words.length) return { ...axisOf(low, high, pixels, spacing, true), ticks: words.map(([value, text]) => ({ value, text })) };
  return logarithmic ? powersOf(low, high, pixels, spacing, unit) : axisOf(low, high, pixels, spacing, whole, unit);
}

// The name of an axis with its unit.
function nameOf({ label, unit }, { prefix, offset, offsetText }) {
  const own = `${prefix}${readable(unit)}`.trim();
  return [label, own, offset ? `from ${offsetText} ${readable(unit)}`.trim() : ""].filter(Boolean).join(", ");
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

// A text with its indices, from x on.
function write(context, text, x, y) {
  context.textAlign = "left";
  partsOf(text).forEach((part, k) => {
    context.font = k % 3 === 2 ? SMALL_FONT : FONT;
    context.fillText(part, x, k % 3 === 2 ? y + 3 : y);
    x += context.measureText(part).width;
  });
  context.font = FONT;
}

// A frame with two labelled axes in a figure, `below` pixels above its lower edge; returns the transforms of both coordinates.
function frame(context, width, height, x, y, below = 36) {
  const right = width - 8, top = 20, bottom = height - below, up = ticksOf(y, bottom - top, 34);
  const left = Math.max(62, ...up.ticks.map(({ text }) => context.measureText(text).width + 10));
  const across = ticksOf(x, right - left, 75);
  const toX = value => left + (value - x.low) / (x.high - x.low) * (right - left);
  const toY = value => bottom - (value - y.low) / (y.high - y.low) * (bottom - top);
  context.fillStyle = ink("axis");
  context.textBaseline = "top";
  context.textAlign = "center";
  for (const tick of across.ticks) {
    const half = context.measureText(tick.text).width / 2;
    context.fillText(tick.text, Math.min(toX(tick.value), width - half - 1), bottom + 4);
  }
  const name = nameOf(x, across);
  write(context, name, Math.max((left + right - context.measureText(name).width) / 2, 2), bottom + 19);
  context.textBaseline = "middle";
  write(context, nameOf(y, up), 2, 8);
  context.textAlign = "right";
  for (const tick of up.ticks) context.fillText(tick.text, left - 5, toY(tick.value));
  context.fillStyle = ink("grid");
  for (const tick of across.ticks) context.fillRect(Math.round(toX(tick.value)), top, 1, bottom - top);
  for (const tick of up.ticks) context.fillRect(left, Math.round(toY(tick.value)), right - left, 1);
  context.strokeStyle = ink("frame");
  context.strokeRect(left + 0.5, top + 0.5, right - left - 1, bottom - top - 1);
  context.beginPath();
  context.rect(left, top, right - left, bottom - top);
  return { toX, toY, left, right, top, bottom };
}

function figureCanvas(place) {
  const canvas = place.appendChild(document.createElement("canvas"));
  return { place, canvas };
}

// Some room above and below the values; a range for a constant as well.
function padded(low, high, share = 0.07) {
  if (!(low <= high)) return [0, 1];
  const range = high - low, size = Math.max(Math.abs(low), Math.abs(high));
  const pad = range > size * 1e-13 ? range * share : size * 1e-3 || 1;
  return [low - pad, high + pad];
}

// A mark {colour, path, filled} of an event or a special point, as an outline around (0, 0).
const outlines = new Map();
function drawMark(context, { colour, path, filled }, x, y) {
  if (!outlines.has(path)) outlines.set(path, new Path2D(path));
  context.save();
  context.translate(x, y);
  context.fillStyle = ink(filled ? colour : "ground");
  context.fill(outlines.get(path));
  context.strokeStyle = ink(colour);
  context.lineWidth = 1.3;
  context.stroke(outlines.get(path));
  context.restore();
}

// The same as an element of a list.
function markElement({ colour, path: outline, filled }) {
  const make = name => document.createElementNS("http://www.w3.org/2000/svg", name);
  const svg = make("svg"), path = svg.appendChild(make("path"));
  svg.setAttribute("class", "glyph");
  svg.setAttribute("viewBox", "-6 -6 12 12");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", outline);
  path.style.fill = inked(filled ? colour : "ground");
  path.style.stroke = inked(colour);
  path.setAttribute("stroke-width", "1.3");
  return svg;
}

// Pieces of points as one line.
function trace(context, pieces, toX, toY) {
  context.beginPath();
  for (const piece of pieces) piece.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](toX(x), toY(y)));
  context.stroke();
}
