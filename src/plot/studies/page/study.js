// The points of a study over two of its axes, in the colours of a quantity.

const status = bytesOf(study.status);
for (const column of [...study.axes, ...study.quantities]) column.values = doubles(column.values);
for (const axis of study.axes) axis.levels = Float64Array.from(new Set(axis.values)).sort();
const failures = new Map(study.failures);
const COMPLETE = 0, FAILED = 1;

// Values of a point in words.
const axisValue = (axis, value, show = rounded) => (axis.words.length ? axis.words[value] : show(value) + unitOf(axis));
function quantityValue(quantity, point, show = rounded) {
  const value = quantity.values[point];
  if (status[point] === FAILED) return "the run failed";
  if (status[point] !== COMPLETE) return "not run";
  if (Number.isNaN(value)) return "none";
  const flag = quantity.flags.find(entry => entry[0] === value);
  return flag ? flag[1] : show(value) + unitOf(quantity);
}

// What is chosen.
const varying = study.axes.filter(axis => axis.levels.length > 1);
const numeric = varying.filter(axis => !axis.words.length);
const order = [...numeric, ...varying.filter(axis => axis.words.length), ...study.axes];
const inOrder = [...new Set(order)].slice(0, 2).sort((a, b) => study.axes.indexOf(a) - study.axes.indexOf(b));
const traced = study.boundary && ["x", "y"].map(side => study.axes.find(axis => axis.name === study.boundary[side]));
const view = {
  quantity: study.quantities[study.first],
  x: traced ? traced[0] : inOrder[0],
  // With one axis alone the quantity is the height.
  y: traced ? traced[1] : varying.length > 1 ? inOrder[1] : null,
  held: new Map(),
  log: false,
  point: -1,
};

function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map((entry, index) => new Option(entry[0], String(index), false, entry[1] === chosen)));
  select.onchange = () => {
    choose(entries[select.selectedIndex][1], select.id);
  };
}
// Values over two decades are told apart by their logarithms.
function ownScale() {
  const values = view.quantity.values.filter(Number.isFinite), low = values.reduce((a, b) => Math.min(a, b), Infinity);
  view.log = low > 0 && !view.quantity.flags.length && values.some(value => value >= 100 * low);
}
function choose(value, id) {
  if (id === "quantity") {
    view.quantity = value;
    ownScale();
  }
  if (id === "x") {
    if (value === view.y) view.y = view.x;
    view.x = value;
  }
  if (id === "y") {
    if (value === view.x) view.x = view.y || view.x;
    view.y = value === view.x ? view.y : value;
  }
  refresh();
}

// A grid shows a plane: the other axes are held, each at one of its levels. A sample shows all of its points.
const beside = () => (study.is_grid ? varying.filter(axis => axis !== view.x && axis !== view.y) : []);
function heldSelects() {
  byId("held").replaceChildren(...beside().map(axis => {
    if (!view.held.has(axis)) view.held.set(axis, axis.levels[Math.floor(axis.levels.length / 2)]);
    const label = document.createElement("label"), select = label.appendChild(document.createElement("select"));
    label.prepend(`${words(axis.name)} `);
    for (const level of axis.levels) select.append(new Option(axisValue(axis, level), "", false, level === view.held.get(axis)));
    select.setAttribute("aria-label", words(axis.name));
    select.addEventListener("change", () => {
      view.held.set(axis, axis.levels[select.selectedIndex]);
      refresh();
    });
    return label;
  }));
}

// The places on the canvas. Cells of a grid reach to the middle between the levels, by the logarithm on such an axis.
const canvas = byId("map"), context = canvas.getContext("2d");
const EDGE = { left: 76, right: 96, top: 12, bottom: 46 };
let shown = [], sides = null;
// Of every point that is shown its box on the canvas, or for a dot its middle twice: left, right, top, bottom.
let boxes = new Float64Array(0);

const measure = (logarithmic, value) => (logarithmic ? Math.log(value) : value);
function sideOf(axis, values, cells) {
  const logarithmic = axis.logarithmic ?? false;
  const levels = [...new Set(values)].sort((a, b) => a - b).map(value => measure(logarithmic, value));
  const edges = new Map();
  let low = levels[0], high = levels[levels.length - 1];
  if (cells) {
    const half = levels.length > 1 ? 0 : Math.max(Math.abs(low) * 0.05, 0.5);
    levels.forEach((level, i) => {
      const before = i ? (levels[i - 1] + level) / 2 : half ? level - half : level - (levels[1] - level) / 2;
      const last = i === levels.length - 1;
      const after = last ? (half ? level + half : level + (level - levels[i - 1]) / 2) : (level + levels[i + 1]) / 2;
      edges.set(level, [before, after]);
    });
    low = edges.get(low)[0];
    high = edges.get(high)[1];
  } else {
    const room = (high - low || Math.abs(low) || 1) * 0.04;
    [low, high] = [low - room, high + room];
  }
  return { axis, logarithmic, edges, low, high };
}

const widthOf = () => canvas.clientWidth - EDGE.left - EDGE.right;
const heightOf = () => canvas.clientHeight - EDGE.top - EDGE.bottom;
const toX = place => EDGE.left + (place - sides.x.low) / (sides.x.high - sides.x.low) * widthOf();
const toY = place => EDGE.top + (1 - (place - sides.y.low) / (sides.y.high - sides.y.low)) * heightOf();
const columnY = () => view.y || { name: view.quantity.name, units: view.quantity.units, words: [], logarithmic: false, values: view.quantity.values };
const placeOf = point => [measure(sides.x.logarithmic, view.x.values[point]), measure(sides.y.logarithmic, columnY().values[point])];

// The scale of colours over all that is shown.
function scaleOf() {
  const values = shown.map(point => view.quantity.values[point]).filter(Number.isFinite);
  let low = Infinity, high = -Infinity;
  for (const value of values) [low, high] = [Math.min(low, value), Math.max(high, value)];
  const log = view.log && low > 0;
  return { low, high, log, canLog: low > 0 && high > low };
}
let scale = null;
const codes = () => view.quantity.flags.filter(flag => shown.some(point => view.quantity.values[point] === flag[0]));
function colorOf(point) {
  const value = view.quantity.values[point];
  if (status[point] !== COMPLETE || Number.isNaN(value)) return null;
  let share;
  if (view.quantity.flags.length) {
    const own = codes();
    share = own.findIndex(flag => flag[0] === value) / Math.max(own.length - 1, 1);
  } else {
    const { low, high, log } = scale;
    share = high > low ? (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)) : 0;
  }
  return study.colors[Math.min(Math.floor(share * study.colors.length), study.colors.length - 1)];
}


function draw() {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12.5px system-ui, sans-serif";
  const text = css("--text"), faint = css("--faint");
  const cells = study.is_grid && view.y !== null;
  const values = column => shown.map(point => column.values[point]).filter(Number.isFinite);
  sides = { x: sideOf(view.x, values(view.x), cells), y: sideOf(columnY(), values(columnY()), cells) };
  scale = scaleOf();
  context.save();
  context.beginPath();
  context.rect(EDGE.left, EDGE.top, widthOf(), heightOf());
  context.clip();
  boxes = new Float64Array(4 * shown.length);
  for (const [index, point] of shown.entries()) {
    const [x, y] = placeOf(point), color = colorOf(point);
    if (cells) {
      const [left, right] = sides.x.edges.get(x).map(toX), [bottom, top] = sides.y.edges.get(y).map(toY);
      boxes.set([left, right, top, bottom], 4 * index);
      context.fillStyle = color || (status[point] === COMPLETE ? "#9a9a9a" : css("--card"));
      context.fillRect(left, top, right - left + 0.6, bottom - top + 0.6);
      if (status[point] !== COMPLETE) {
        context.strokeStyle = text;
        context.beginPath();
        context.moveTo(left, bottom);
        context.lineTo(right, top);
        if (status[point] === FAILED) {
          context.moveTo(left, top);
          context.lineTo(right, bottom);
        }
        context.stroke();
      }
    } else {
      boxes.set([toX(x), toX(x), toY(y), toY(y)], 4 * index);
      if (!Number.isFinite(y)) continue;
      context.beginPath();
      context.arc(toX(x), toY(y), shown.length > 2000 ? 2 : 4, 0, 7);
      context.fillStyle = color || "#9a9a9a";
      if (status[point] === COMPLETE) context.fill();
      context.strokeStyle = status[point] === COMPLETE ? "#0006" : text;
      context.stroke();
    }
  }
  if (study.boundary && view.x.name === study.boundary.x && view.y && view.y.name === study.boundary.y) {
    for (const curve of study.boundary.curves) {
      // White below, so that the line shows on every colour.
      for (const [color, thick] of [["#fff", 5], [curve.color, 2.5]]) {
        context.strokeStyle = color;
        context.lineWidth = thick;
        for (const piece of curve.pieces) {
          context.beginPath();
          piece.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](toX(measure(sides.x.logarithmic, x)), toY(measure(sides.y.logarithmic, y))));
          context.stroke();
        }
      }
    }
    context.lineWidth = 1;
  }
  if (view.point >= 0 && shown.includes(view.point)) {
    const [x, y] = placeOf(view.point);
    for (const [color, thick] of [["#fff", 5], ["#d55e00", 2.5]]) {
      context.strokeStyle = color;
      context.lineWidth = thick;
      context.beginPath();
      if (cells) {
        const [left, right] = sides.x.edges.get(x).map(toX), [bottom, top] = sides.y.edges.get(y).map(toY);
        context.rect(left + 1, top + 1, right - left - 2, bottom - top - 2);
      } else context.arc(toX(x), toY(y), 7, 0, 7);
      context.stroke();
    }
    context.lineWidth = 1;
  }
  context.restore();
  context.strokeStyle = text;
  context.strokeRect(EDGE.left, EDGE.top, widthOf(), heightOf());
  context.fillStyle = text;
  context.textAlign = "center";
  context.textBaseline = "top";
  const label = column => words(column.name) + (column.units && column.units !== "1" ? ` (${column.units})` : "");
  const named = side => (side.axis.words.length ? side.axis.levels.length && [...side.axis.levels].map(level => [level, side.axis.words[level]]) : ticks(side.low, side.high, side.logarithmic, 7));
  for (const [at, name] of named(sides.x)) {
    context.fillRect(toX(at) - 0.5, EDGE.top + heightOf(), 1, 5);
    context.fillText(name, toX(at), EDGE.top + heightOf() + 8);
  }
  context.fillText(label(view.x), EDGE.left + widthOf() / 2, EDGE.top + heightOf() + 27);
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const [at, name] of named(sides.y)) {
    context.fillRect(EDGE.left - 5, toY(at) - 0.5, 5, 1);
    context.fillText(name, EDGE.left - 8, toY(at));
  }
  context.save();
  context.translate(13, EDGE.top + heightOf() / 2);
  context.rotate(-Math.PI / 2);
  context.textAlign = "center";
  context.fillText(label(columnY()), 0, 0);
  context.restore();
  if (!view.quantity.flags.length && scale.high >= scale.low) {
    const left = canvas.clientWidth - EDGE.right + 16, top = EDGE.top + 22, tall = heightOf() - 22;
    study.colors.forEach((color, i) => {
      context.fillStyle = color;
      context.fillRect(left, top + tall * (1 - (i + 1) / study.colors.length), 16, tall / study.colors.length + 0.6);
    });
    context.strokeStyle = faint;
    context.strokeRect(left, top, 16, tall);
    context.fillStyle = text;
    context.textAlign = "left";
    const { low, high, log } = scale, [from, to] = [measure(log, low), measure(log, high)];
    if (to > from) {
      for (const [at, name] of ticks(from, to, log, 6)) context.fillText(name, left + 20, top + tall * (1 - (at - from) / (to - from)));
    } else context.fillText(rounded(low), left + 20, top + tall / 2);
    if (view.quantity.units !== "1") context.fillText(view.quantity.units, left, EDGE.top + 6);
  }
  canvas.dataset.points = String(shown.length);
}

function key() {
  const entries = [];
  const add = (name, background, className = "") => {
    const entry = document.createElement("span"), swatch = entry.appendChild(document.createElement("i"));
    swatch.className = className;
    swatch.style[className ? "borderTopColor" : "background"] = background;
    entry.append(name);
    entries.push(entry);
  };
  const own = codes();
  own.forEach((flag, i) => add(flag[1], study.colors[Math.min(Math.floor(i / Math.max(own.length - 1, 1) * study.colors.length), study.colors.length - 1)]));
  if (shown.some(point => status[point] === COMPLETE && Number.isNaN(view.quantity.values[point]))) add("no value", "#9a9a9a");
  const crossed = "linear-gradient(to top right, transparent 45%, currentColor 45% 55%, transparent 55%)";
  if (shown.some(point => status[point] === FAILED)) add("failed", `${crossed}, linear-gradient(to bottom right, transparent 45%, currentColor 45% 55%, transparent 55%)`);
  if (shown.some(point => status[point] > FAILED)) add("not run", crossed);
  if (study.boundary && view.y && view.x.name === study.boundary.x && view.y.name === study.boundary.y) {
    for (const [label, color] of new Map(study.boundary.curves.map(curve => [curve.label, curve.color]))) add(label, color, "line");
  }
  byId("key").replaceChildren(...entries);
}

function refresh() {
  fill(byId("quantity"), study.quantities.map(quantity => [`${words(quantity.name)}: ${quantity.long_name}`, quantity]), view.quantity);
  const choices = (varying.length ? varying : study.axes).map(axis => [words(axis.name), axis]);
  fill(byId("x"), choices, view.x);
  fill(byId("y"), view.y ? choices : [["the quantity", null]], view.y);
  heldSelects();
  const held = beside();
  shown = Array.from(status.keys()).filter(point => held.every(axis => axis.values[point] === view.held.get(axis)));
  draw();
  byId("log").disabled = !scale.canLog;
  byId("log").checked = view.log;
  key();
}
byId("log").addEventListener("change", event => {
  view.log = event.target.checked;
  draw();
});

// The point at a place on the canvas: that of its cell, or the nearest dot.
function pointAt(x, y) {
  if (x < EDGE.left || x > EDGE.left + widthOf() || y < EDGE.top || y > EDGE.top + heightOf()) return -1;
  const cells = study.is_grid && view.y !== null;
  let best = cells ? 1e-9 : 18 ** 2, found = -1;
  for (let i = 0; i < shown.length; i++) {
    // How far it is outside of the box.
    const u = Math.max(boxes[4 * i] - x, x - boxes[4 * i + 1], 0), v = Math.max(boxes[4 * i + 2] - y, y - boxes[4 * i + 3], 0);
    const distance = u * u + v * v;
    if (distance < best) [best, found] = [distance, shown[i]];
  }
  return found;
}

function hover(point) {
  const parts = point < 0 ? [] : study.axes.map(axis => `${words(axis.name)} = ${axisValue(axis, axis.values[point])}`);
  if (point >= 0) parts.push(`${words(view.quantity.name)}: ${quantityValue(view.quantity, point)}`);
  byId("readout").textContent = parts.join("; ");
}

// A word as TOML, true and false as they are.
const inToml = word => (word === "true" || word === "false" ? word : JSON.stringify(word));

function commandOf(point) {
  if (!study.command) return null;
  const parts = [study.command];
  for (const axis of study.axes) {
    const value = axis.words.length ? inToml(axis.words[axis.values[point]]) : exact(axis.values[point]);
    for (const name of axis.keys) {
      parts.push("--set", inShell(`${name}=${value}`));
      const method = name === "solver.method" && axis.words[axis.values[point]];
      if (study.default_tolerance && ["auto", "cvode", "arkode", "series"].includes(method)) parts.push("--set", `solver.rtol=${study.default_tolerance}`);
    }
  }
  parts.push("-o", inShell(`${study.stem}-${point}.h5`));
  return parts.join(" ");
}

function select(point) {
  if (point < 0) return;
  view.point = point;
  const command = commandOf(point);
  byId("point").textContent = `Point ${point}`;
  byId("chosen").hidden = false;
  byId("command").textContent = command || "";
  byId("command").hidden = byId("copy").hidden = !command;
  byId("copied").textContent = "";
  byId("command-hint").textContent = command
    ? "Runs this point by itself. A case in a file is named as the study names it: run the command in the study's folder."
    : "The file does not say how its points are run: it was written by an earlier version of the program, or its settings are too long.";
  const message = status[point] === FAILED ? failures.get(point) || "This run failed." : "";
  byId("failure").hidden = !message;
  byId("failure").textContent = message;
  byId("values").replaceChildren(
    ...study.axes.map(axis => row(words(axis.name), axisValue(axis, axis.values[point], exact), axis.long_name)),
    ...(status[point] === COMPLETE ? study.quantities.map(quantity => row(words(quantity.name), quantityValue(quantity, point, exact), quantity.long_name)) : []),
  );
  hover(point);
  draw();
}

const place = event => {
  const box = canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};
canvas.addEventListener("pointermove", event => hover(pointAt(...place(event))));
canvas.addEventListener("pointerleave", () => hover(view.point));
canvas.addEventListener("click", event => select(pointAt(...place(event))));
canvas.addEventListener("keydown", event => {
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!way || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  if (view.point < 0 || !shown.includes(view.point)) return select(shown[0]);
  // The nearest point in the direction, off its line as little as possible.
  const [x0, y0] = placeOf(view.point).map((place, i) => (i ? toY : toX)(place));
  let best = Infinity, found = -1;
  for (const point of shown) {
    const [u, v] = placeOf(point), x = toX(u) - x0, y = y0 - toY(v);
    const along = x * way[0] + y * way[1], off = Math.abs(x * way[1]) + Math.abs(y * way[0]);
    if (along > 0.5 && along + 8 * off < best) [best, found] = [along + 8 * off, point];
  }
  select(found);
});
new ResizeObserver(draw).observe(byId("plot"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

byId("title").textContent = study.title;
const failed = status.filter(code => code === FAILED).length;
byId("subtitle").textContent = `${study.file}: ${study.points.toLocaleString("en")} points${failed ? `, ${failed} of them failed` : ""}`;
if (!study.complete) {
  byId("notice").hidden = false;
  byId("notice").textContent = "This sweep is not complete: points that were not run are struck through.";
}
ownScale();
refresh();
