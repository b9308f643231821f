// Points of a study or a continuation over two of their columns, in the colours of a third, and lines through and between them.

const { columns, scale, lines, marks, overlays } = page;
for (const column of columns) {
  for (const part of ["low", "high", "imaginary"]) if (column[part]) column[part] = doubles(column[part]);
  column.axis = column.role === "axis";
  column.levels = column.axis ? Float64Array.from(new Set(column.low)).filter(Number.isFinite).sort() : [];
  column.title = column.symbol ? `${column.label} ${column.symbol}` : column.label;
}
const status = page.status ? codes(page.status) : new Int8Array(page.count), which = page.which ? codes(page.which) : new Int8Array(page.count);
const failures = new Map(page.failures), COMPLETE = 0, FAILED = 1;
const axes = columns.filter(({ axis }) => axis), varying = axes.filter(({ levels }) => levels.length > 1);
const values = columns.filter(({ role }) => role === "value");
const xs = varying.length ? varying : axes.slice(0, 1);
const ys = [...columns.filter(({ name }) => varying.length > 1 && varying.some(axis => axis.name === name) || overlays.some(({ y }) => y === name)), ...values];

// What is chosen.
const [x, y, colour] = page.first.map(index => (index === null ? null : columns[index]));
const view = { x, y, colour, held: new Map(), log: false, point: -1, dots: false, window: null };
// The points in view, the places that the pointer finds, and the frame.
let shown = [], places = [], plot = null, sides = null, range = null;

const canvas = byId("map"), MANY = 2000;
const measured = (column, value) => (column.logarithmic ? Math.log10(value) : value);
const isCells = () => page.grid && view.y.axis;
const inPlane = () => overlays.filter(({ x, y }) => x === view.x.name && y === view.y.name);
// Along an axis that is neither x nor y, the points of a grid have one value.
const heldAxes = () => (page.grid ? varying.filter(axis => axis !== view.x && axis !== view.y) : []);

function extent(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return [low, high];
}

// An axis of the frame; of cells with the edges of each level, halfway between them.
function sideOf(column, own) {
  const all = own.map(value => measured(column, value)), base = { label: column.title, unit: column.units, words: column.words, logarithmic: column.logarithmic };
  if (!isCells()) {
    const [low, high] = padded(...extent(all), 0.04);
    return { ...base, low, high };
  }
  const levels = [...new Set(all)].sort((a, b) => a - b), edges = new Map();
  const middles = levels.slice(1).map((level, i) => (level + levels[i]) / 2);
  const half = levels.length > 1 ? 0 : 0.05 * Math.abs(levels[0]) || 0.5;
  const first = half ? levels[0] - half : 2 * levels[0] - middles[0];
  const last = half ? levels[0] + half : 2 * levels[levels.length - 1] - middles[middles.length - 1];
  const ends = [first, ...middles, last];
  levels.forEach((level, i) => edges.set(level, [ends[i], ends[i + 1]]));
  return { ...base, low: first, high: last, edges };
}

// What is drawn last lies on top: of codes with colours of their own the first.
const ordered = points => (view.colour && view.colour.colours.length ? [...points].sort((a, b) => view.colour.low[b] - view.colour.low[a]) : points);

const codesShown = () => view.colour.words.filter(([code]) => shown.some(point => view.colour.low[point] === code));

// The colour of a point; null without a value.
function colourOf(point) {
  const { colour } = view;
  if (!colour) return "blue";
  const value = colour.low[point];
  if (status[point] !== COMPLETE || Number.isNaN(value)) return null;
  let share = 0;
  if (colour.colours.length) return colour.colours[value];
  if (colour.words.length) {
    const own = codesShown();
    share = own.findIndex(([code]) => code === value) / Math.max(own.length - 1, 1);
  } else {
    const [low, high] = range;
    if (high > low) share = view.log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  }
  return scale[Math.min(Math.floor(share * scale.length), scale.length - 1)];
}

function draw() {
  const width = canvas.clientWidth, height = canvas.clientHeight, context = prepare(canvas, width, height), cells = isCells();
  const own = column => shown.flatMap(point => (column.high ? [column.low[point], column.high[point]] : [column.low[point]])).filter(Number.isFinite);
  const ofOverlays = k => inPlane().flatMap(({ curves }) => curves.flatMap(({ pieces }) => pieces.flat().map(place => place[k])));
  sides = { x: sideOf(view.x, [...own(view.x), ...ofOverlays(0)]), y: sideOf(view.y, [...own(view.y), ...ofOverlays(1)]) };
  for (const k of view.window ? ["x", "y"] : []) [sides[k].low, sides[k].high] = view.window[k];
  range = view.colour && extent(own(view.colour));
  const hasBar = view.colour && !view.colour.words.length && range[1] >= range[0];
  context.save();
  plot = frame(context, width, height, sides.x, sides.y, hasBar ? 84 : 36);
  const toX = value => plot.toX(measured(view.x, value)), toY = value => plot.toY(measured(view.y, value));
  context.clip();
  places = [];
  if (lines.length) drawLines(context, toX, toY);
  else drawPoints(context, cells);
  for (const { curves, labels } of inPlane()) drawOverlay(context, curves, labels, toX, toY);
  for (const { box: [left, right, top, bottom] } of places.filter(({ point }) => view.point >= 0 && point === view.point)) {
    context.beginPath();
    if (cells) context.rect(left + 1, top + 1, right - left - 2, bottom - top - 2);
    else context.arc(left, top, 8, 0, 7);
    outlined(context, "vermillion");
  }
  context.restore();
  context.strokeStyle = ink("frame");
  context.strokeRect(plot.left + 0.5, plot.top + 0.5, plot.right - plot.left - 1, plot.bottom - plot.top - 1);
  if (hasBar) drawBar(context, height);
  canvas.dataset.points = String(shown.length);
  canvas.dataset.frame = JSON.stringify(plot);
}

// White below, so that a line shows on every colour.
function outlined(context, colour) {
  for (const [colourOfLine, wide] of [["#ffffff", 5], [ink(colour), 2.5]]) {
    context.strokeStyle = colourOfLine;
    context.lineWidth = wide;
    context.stroke();
  }
  context.lineWidth = 1;
}

function drawPoints(context, cells) {
  for (const point of ordered(shown)) {
    const [u, v] = [measured(view.x, view.x.low[point]), measured(view.y, view.y.low[point])], own = colourOf(point);
    const isComplete = status[point] === COMPLETE;
    if (!cells) {
      if (!Number.isFinite(v)) continue;
      const [left, top] = [plot.toX(u), plot.toY(v)];
      places.push({ point, box: [left, left, top, top] });
      context.beginPath();
      context.arc(left, top, shown.length > MANY ? 2.2 : 4, 0, 7);
      context.fillStyle = ink(own || "nothing");
      if (isComplete) context.fill();
      context.strokeStyle = isComplete ? "#00000066" : ink("axis");
      // The outlines of many points would hide their colours.
      if (shown.length <= MANY || !isComplete) context.stroke();
      continue;
    }
    const [left, right] = sides.x.edges.get(u).map(plot.toX), [bottom, top] = sides.y.edges.get(v).map(plot.toY);
    places.push({ point, box: [left, right, top, bottom] });
    context.fillStyle = ink(own || (isComplete ? "nothing" : "card"));
    context.fillRect(left, top, right - left + 0.6, bottom - top + 0.6);
    if (isComplete) continue;
    context.strokeStyle = ink("axis");
    const strokes = [[[left, bottom], [right, top]], [[left, top], [right, bottom]]];
    trace(context, status[point] === FAILED ? strokes : strokes.slice(0, 1), x => x, y => y);
  }
}

const DASHES = { solid: [], thin: [], dashed: [7, 4], dotted: [1.5, 3] };
const BORDERS = { thin: "solid" };

function drawLines(context, toX, toY) {
  for (const { color, style, pieces, once } of lines) {
    context.strokeStyle = ink(color);
    context.lineWidth = 2;
    context.setLineDash(DASHES[style]);
    // The least and the largest value of what does not move coincide; two dashed lines would look full.
    for (const side of [view.y.low, !once && view.y.high].filter(Boolean)) {
      const parts = pieces.flatMap(piece => piece.map(point => [view.x.low[point], side[point]]).reduce((parts, place) => {
        if (Number.isFinite(place[1])) parts[parts.length - 1].push(place);
        else parts.push([]);
        return parts;
      }, [[]]));
      trace(context, parts, toX, toY);
    }
  }
  context.setLineDash([]);
  for (const side of [view.y.low, view.y.high].filter(Boolean)) {
    for (const point of shown) {
      if (!Number.isFinite(side[point])) continue;
      const [left, top] = [toX(view.x.low[point]), toY(side[point])], kind = markOf(point);
      places.push({ point, box: [left, left, top, top] });
      if (kind) drawMark(context, kind, left, top);
      else if (view.dots) {
        context.fillStyle = ink("axis");
        context.fillRect(left - 1.5, top - 1.5, 3, 3);
      }
    }
  }
}

const [marked, kinds] = marks || [0, []], markOf = point => kinds[columns[marked].low[point]];

function drawOverlay(context, curves, labels, toX, toY) {
  for (const curve of curves) {
    context.strokeStyle = ink(curve.color);
    context.lineWidth = curve.style === "thin" ? 1 : 2.5;
    context.setLineDash(DASHES[curve.style] || []);
    if (curve.style in DASHES) trace(context, curve.pieces, toX, toY);
    for (const at of curve.pieces.flat()) {
      const [left, top] = [toX(at[0]), toY(at[1])];
      places.push({ curve, at, box: [left, left, top, top] });
      if (!(curve.style in DASHES)) drawMark(context, { colour: curve.color, path: "M-5 0A5 5 0 1 0 5 0A5 5 0 1 0-5 0Z", filled: curve.style === "points" }, left, top);
    }
  }
  context.setLineDash([]);
  context.lineWidth = 3;
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (const [[u, v], text] of labels) {
    context.strokeStyle = ink("ground");
    context.strokeText(text, toX(u), toY(v));
    context.fillStyle = ink("axis");
    context.fillText(text, toX(u), toY(v));
  }
}

// The scale of colours with its name below the frame.
function drawBar(context, height) {
  const { left, right } = plot, top = height - 46, [low, high] = view.log ? range.map(Math.log10) : range;
  const side = { low, high, label: view.colour.title, unit: view.colour.units, logarithmic: view.log }, axis = ticksOf(side, right - left, 75);
  scale.forEach((colour, i) => {
    context.fillStyle = colour;
    context.fillRect(left + (right - left) * i / scale.length, top, (right - left) / scale.length + 0.6, 10);
  });
  context.strokeStyle = ink("frame");
  context.strokeRect(left + 0.5, top + 0.5, right - left - 1, 9);
  context.fillStyle = ink("axis");
  context.textBaseline = "top";
  context.textAlign = "center";
  const ticks = high > low ? axis.ticks : [{ value: low, text: plain(range[0], 6) }];
  for (const { value, text } of ticks) context.fillText(text, left + (high > low ? (value - low) / (high - low) : 0.5) * (right - left), top + 13);
  const name = high > low ? nameOf(side, axis) : [side.label, readable(side.unit)].filter(Boolean).join(", ");
  write(context, name, Math.max((left + right - context.measureText(name).width) / 2, 2), top + 29);
}

function showKey() {
  const entries = [], crossed = "linear-gradient(to top right, transparent 45%, currentColor 45% 55%, transparent 55%)";
  const box = (background, name) => entries.push(keyEntry(swatch("", { background }), name));
  const line = ({ color, style, label }) => label && entries.push(keyEntry(lineSwatch(color, BORDERS[style] || style), label));
  if (view.colour) {
    for (const [code, word] of view.colour.words.length ? codesShown() : []) box(inked(colourOf(shown.find(point => view.colour.low[point] === code && status[point] === COMPLETE)) || "nothing"), word);
    if (shown.some(point => status[point] === COMPLETE && Number.isNaN(view.colour.low[point]))) box(inked("nothing"), "no value");
  }
  if (shown.some(point => status[point] === FAILED)) box(`${crossed}, ${crossed.replace("top", "bottom")}`, "failed");
  if (shown.some(point => status[point] > FAILED)) box(crossed, "not run");
  if (shown.some(point => Number.isFinite(view.y.low[point]))) lines.forEach(line);
  kinds.forEach((one, kind) => {
    if (columns[marked].low.includes(kind) && values.includes(view.y)) entries.push(keyEntry(markElement(one), one.name));
  });
  for (const curve of inPlane().flatMap(({ curves }) => curves)) {
    if (curve.style in DASHES) line(curve);
    else entries.push(keyEntry(markElement({ colour: curve.color, path: "M-5 0A5 5 0 1 0 5 0A5 5 0 1 0-5 0Z", filled: curve.style === "points" }), curve.label));
  }
  byId("key").replaceChildren(...entries);
}

function fill(select, entries, chosen, choose) {
  select.replaceChildren(...entries.map(([name, value]) => new Option(name, "", false, value === chosen)));
  select.onchange = () => choose(entries[select.selectedIndex][1]);
  select.parentElement.hidden = entries.length < 2;
}

// Values over two decades are told apart by their logarithms.
function ownScale() {
  const [low, high] = view.colour ? extent(view.colour.low) : [0, 0];
  view.log = low > 0 && !view.colour.words.length && high >= 100 * low;
}

// The part that the file is about: the region of a calibration. What is around it is one click away.
function regionShown() {
  const [region] = inPlane().filter(({ region }) => region);
  if (!region) return null;
  const side = k => padded(...extent(region.curves.flatMap(({ pieces }) => pieces.flat()).map(at => measured([view.x, view.y][k], at[k]))), REGION_MARGIN);
  return { x: side(0), y: side(1) };
}
const REGION_MARGIN = 0.4;

function choose(role, column) {
  // An axis that both would have is exchanged.
  if (role === "x" && column === view.y) view.y = view.x;
  if (role === "y" && column === view.x) view.x = view.y.axis ? view.y : xs.find(axis => axis !== column);
  view[role] = column;
  if (role === "colour") ownScale();
  else view.window = regionShown();
  refresh();
  hover(view.point < 0 ? null : { point: view.point });
}

function refresh() {
  fill(byId("y"), ys.map(column => [column.label, column]), view.y, column => choose("y", column));
  fill(byId("x"), xs.map(column => [column.label, column]), view.x, column => choose("x", column));
  fill(byId("colour"), lines.length ? [] : [...values.map(column => [column.label, column]), ["none", null]], view.colour, column => choose("colour", column));
  byId("held").replaceChildren(...heldAxes().map(axis => {
    const label = element("label", axis.label), select = label.appendChild(element("select"));
    if (!view.held.has(axis)) view.held.set(axis, axis.levels[Math.floor(axis.levels.length / 2)]);
    fill(select, [...axis.levels].map(level => [written(axis, level), level]), view.held.get(axis), level => {
      view.held.set(axis, level);
      refresh();
    });
    return label;
  }));
  const held = heldAxes();
  shown = Array.from(status.keys()).filter(point => held.every(axis => axis.low[point] === view.held.get(axis)));
  draw();
  byId("log").parentElement.hidden = !view.colour || view.colour.words.length > 0 || !(range[0] > 0 && range[1] > range[0]);
  byId("log").checked = view.log;
  byId("dots").parentElement.hidden = !lines.length;
  byId("region").hidden = byId("everything").hidden = !regionShown();
  showKey();
}
for (const [id, name] of [["log", "log"], ["dots", "dots"]]) {
  byId(id).addEventListener("change", event => {
    view[name] = event.target.checked;
    draw();
  });
}

// Digits of what the pointer reads.
const BRIEF = 9;

// A value in words: a given one with `digits` if there are more, a computed one with the digits that are known.
function written(column, value, digits = BRIEF) {
  if (Number.isNaN(value)) return "none";
  const word = column.words.find(([code]) => code === value);
  if (word) return word[1];
  return column.digits === null ? `${plain(value, digits)} ${readable(column.units)}`.trim() : withUnit(value, column.units, column.digits).trim();
}

function valueOf(column, point, digits = BRIEF) {
  if (!column.axis && status[point] !== COMPLETE) return status[point] === FAILED ? "the run failed" : "not run";
  const low = written(column, column.low[point], digits);
  if (column.high) return `${low} to ${written(column, column.high[point])}`;
  const turn = column.imaginary && column.imaginary[point];
  return turn ? `${plain(column.low[point], column.digits)} ${turn < 0 ? "−" : "+"} ${plain(Math.abs(turn), column.digits)} i ${readable(column.units)}`.trim() : low;
}

const groupOf = point => page.groups.findLastIndex(first => first <= point);
const titleOf = point => (page.groups.length ? `Branch ${groupOf(point)}, point ${point - page.groups[groupOf(point)]}` : `Point ${point}`);

// The place at a position on the canvas: a cell, or what is nearest.
function placeAt(x, y) {
  if (x < plot.left || x > plot.right || y < plot.top || y > plot.bottom) return null;
  let best = isCells() ? 1e-9 : 20 ** 2, found = null;
  for (const place of places) {
    const [left, right, top, bottom] = place.box;
    // How far it is outside of the box; of points in one place a special one is found.
    const u = Math.max(left - x, x - right, 0), v = Math.max(top - y, y - bottom, 0), distance = u * u + v * v - (markOf(place.point) ? 4 : 0);
    if (distance < best) [best, found] = [distance, place];
  }
  return found;
}

function hover(place) {
  const parts = [];
  if (place && place.curve) parts.push(...[view.x, view.y].map((column, k) => `${column.label} = ${written(column, place.at[k])}`), place.curve.label);
  if (place && !place.curve) {
    const { point } = place, own = [view.y, view.colour].filter(column => column && !column.axis);
    if (page.groups.length) parts.push(titleOf(point));
    parts.push(...axes.filter(axis => Number.isFinite(axis.low[point])).map(axis => `${axis.label} = ${valueOf(axis, point)}`));
    parts.push(...columns.filter(column => column.role === "brief" && !Number.isNaN(column.low[point])).map(column => valueOf(column, point)));
    parts.push(...new Set(own.map(column => `${column.label}: ${valueOf(column, point)}`)));
  }
  byId("readout").textContent = parts.join("; ") || explanation();
}

// What is drawn, where the pointer reads nothing.
function explanation() {
  const told = [view.colour || view.y].filter(({ axis, about, label, name }) => !axis && about && about !== label && about !== name);
  return [...told.map(({ label, about }) => `${label[0].toUpperCase()}${label.slice(1)}: ${about}.`), "Point at the figure to read values."].join(" ");
}

// As a POSIX shell takes it, and as TOML does.
const inShell = text => (/^[A-Za-z0-9_./=:,+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);
const inToml = word => (word === "true" || word === "false" ? word : JSON.stringify(word));

function commandOf(point) {
  const command = page.commands[which[point]];
  if (!command) return null;
  const of = (_, key) => {
    if (key === "point") return String(point - (page.groups[groupOf(point)] || 0));
    if (key === "group") return String(groupOf(point));
    const { words, low } = columns[key], word = words.find(([code]) => code === low[point]);
    return word ? inToml(word[1]) : String(low[point]);
  };
  const options = command.options.filter(([, only]) => !only || only[1].includes(columns[only[0]].low[point])).map(([text]) => {
    const [option, ...argument] = text.split(" ");
    return `${option} ${inShell(argument.join(" ").replace(/\{(\d+|point|group)\}/g, of))}`;
  });
  return [command.start, ...options].join(" ");
}

function select(point) {
  if (point === undefined || point < 0) return;
  view.point = point;
  const command = commandOf(point);
  byId("point").textContent = titleOf(point);
  byId("chosen").hidden = false;
  byId("unchosen").hidden = true;
  byId("command").textContent = command || "";
  byId("command").hidden = byId("copy").hidden = !command;
  byId("copy").lastChild.textContent = "";
  byId("command-hint").textContent = command ? page.commands[which[point]].hint : "The file does not say how its points are computed: it was written by an earlier version of the program, or its settings are too long.";
  const message = status[point] === FAILED ? failures.get(point) || "This run failed." : "";
  byId("failure").hidden = !message;
  byId("failure").textContent = message;
  const told = columns.filter(column => (column.axis || status[point] === COMPLETE) && (column.role === "value" && page.status || !Number.isNaN(column.low[point])));
  const table = tableOf(null, told.map(column => [column.label, valueOf(column, point, 17)]), 1);
  table.querySelectorAll("tr").forEach((line, k) => (line.title = told[k].about));
  byId("values").replaceChildren(table);
  hover({ point });
  draw();
}

byId("copy").append(...copyButton(byId("command")));

const at = event => {
  const box = canvas.getBoundingClientRect();
  return placeAt(event.clientX - box.left, event.clientY - box.top);
};
canvas.addEventListener("pointermove", event => hover(at(event)));
canvas.addEventListener("pointerleave", () => hover(view.point < 0 ? null : { point: view.point }));
canvas.addEventListener("click", event => {
  const place = at(event);
  if (place && !place.curve) select(place.point);
});

// The wheel zooms where the pointer is, as in the figure of a run.
canvas.addEventListener("wheel", event => {
  if (!event.ctrlKey && !event.metaKey && document.activeElement !== canvas) return;
  event.preventDefault();
  const box = canvas.getBoundingClientRect(), factor = 1.0018 ** event.deltaY;
  const zoomed = ({ low, high }, share) => [low, high].map(end => end * factor + (low + share * (high - low)) * (1 - factor));
  view.window = {
    x: zoomed(sides.x, (event.clientX - box.left - plot.left) / (plot.right - plot.left)),
    y: zoomed(sides.y, (plot.bottom - event.clientY + box.top) / (plot.bottom - plot.top)),
  };
  draw();
}, { passive: false });
for (const [one, kind, window] of [[canvas, "dblclick", () => null], [byId("everything"), "click", () => null], [byId("region"), "click", regionShown]]) {
  one.addEventListener(kind, () => {
    view.window = window();
    draw();
  });
}

// The next point along a branch, or the first one of another branch.
function alongGroups(point, [right, up]) {
  const own = groupOf(point), first = page.groups[own], last = (page.groups[own + 1] || page.count) - 1;
  if (right) return Math.min(Math.max(point + right, first), last);
  return page.groups[(own + up + page.groups.length) % page.groups.length];
}

// The nearest point in a direction, off its line as little as possible.
function towards(point, [right, up]) {
  const middle = ({ box: [left, end, top, bottom] }) => [(left + end) / 2, (top + bottom) / 2];
  const from = places.find(place => place.point === point);
  if (!from) return shown[0];
  const [x0, y0] = middle(from);
  let best = Infinity, found = -1;
  for (const place of places.filter(({ curve }) => !curve)) {
    const [x, y] = middle(place), along = (x - x0) * right + (y0 - y) * up, off = Math.abs((x - x0) * up) + Math.abs((y0 - y) * right);
    if (along > 0.5 && along + 8 * off < best) [best, found] = [along + 8 * off, place.point];
  }
  return found;
}

const firstInView = () => {
  const isInside = ({ curve, box: [left, right, top, bottom] }) => !curve && right >= plot.left && left <= plot.right && bottom >= plot.top && top <= plot.bottom;
  return (places.find(isInside) || { point: shown[0] }).point;
};

canvas.addEventListener("keydown", event => {
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!way || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  if (view.point < 0) select(firstInView());
  else select((page.groups.length ? alongGroups : towards)(view.point, way));
});
canvas.setAttribute("aria-label", `The points of the file. ${page.hint}`);
byId("hint").textContent = `${page.hint} Ctrl (or ⌘) and wheel: zoom; after a click on the figure the wheel alone. Double click: everything.`;
ownScale();
view.window = regionShown();
refresh();
hover(null);
showTheme();
onTheme.push(() => {
  draw();
  showKey();
});
new ResizeObserver(draw).observe(byId("plot"));
