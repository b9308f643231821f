// A quantity along the branches of a continuation, over the number that varies; special points in the plane of two numbers.

const signed = text => new Int8Array(bytesOf(text).buffer);
const value = doubles(study.number.values), stability = signed(study.stability), links = signed(study.links), special = signed(study.special);
for (const quantity of study.quantities) {
  quantity.low = doubles(quantity.low);
  quantity.high = quantity.high && doubles(quantity.high);
}
const real = doubles(study.real), imaginary = doubles(study.imaginary), width = value.length ? real.length / value.length : 0;
const branchOf = new Int32Array(value.length);
study.branches.forEach((branch, index) => branchOf.fill(index, branch.first, branch.first + branch.points));
const STABILITY = ["stable", "unstable", "neutral"], DASHES = [[], [7, 4], [1.5, 3]];
const PLANE = "plane";

// Colours of lines, which are those of the figures; black is light on a dark page.
const colorOf = branch => (branch.steady ? css("--text") : css("--cycles"));
const inkOf = mark => (mark.color === "#000000" ? css("--text") : mark.color);
const shown = (number, units, show = rounded) => (Number.isNaN(number) ? "none" : show(number) + (units === "1" ? "" : ` ${units}`));

const view = { quantity: study.quantities[study.first], point: -1, points: false };

// The places that the pointer finds: point of a branch, or of a curve, with its place on the canvas.
const canvas = byId("map"), context = canvas.getContext("2d");
const EDGE = { left: 84, right: 16, top: 12, bottom: 46 };
let places = [], range = null;
const widthOf = () => canvas.clientWidth - EDGE.left - EDGE.right;
const heightOf = () => canvas.clientHeight - EDGE.top - EDGE.bottom;
const toX = x => EDGE.left + (x - range.left) / (range.right - range.left) * widthOf();
const toY = y => EDGE.top + (range.high - y) / (range.high - range.low) * heightOf();

function rangeOf(xs, ys) {
  const ends = values => {
    let [low, high] = [Infinity, -Infinity];
    for (const own of values) if (Number.isFinite(own)) [low, high] = [Math.min(low, own), Math.max(high, own)];
    const room = (high - low || Math.abs(low) || 1) * 0.04;
    return low > high ? [0, 1] : [low - room, high + room];
  };
  const [left, right] = ends(xs), [low, high] = ends(ys);
  return { left, right, low, high };
}

function mark(kind, x, y, radius = 5) {
  const { corners, filled, cross } = kind, ink = inkOf(kind);
  context.setLineDash([]);
  context.lineWidth = 1.6;
  context.strokeStyle = ink;
  context.fillStyle = filled ? ink : css("--card");
  context.beginPath();
  if (!corners) context.arc(x, y, radius, 0, 7);
  else corners.forEach(([u, v], i) => context[cross ? (i % 2 ? "lineTo" : "moveTo") : i ? "lineTo" : "moveTo"](x + radius * u, y + radius * v));
  if (corners && !cross) context.closePath();
  if (!cross) context.fill();
  context.stroke();
}

// The lines of one value of the quantity: each piece from where its stability begins to where it ends.
function lines(values) {
  for (const branch of study.branches) {
    context.strokeStyle = colorOf(branch);
    context.lineWidth = 2;
    const end = branch.first + branch.points - 1;
    let last = -1;
    for (let k = branch.first; k < end; k++) {
      if (!Number.isFinite(values[k]) || !Number.isFinite(values[k + 1])) {
        last = -1;
        continue;
      }
      if (links[k] !== last) {
        if (last >= 0) context.stroke();
        context.setLineDash(DASHES[links[k]]);
        context.beginPath();
        context.moveTo(toX(value[k]), toY(values[k]));
      }
      last = links[k];
      context.lineTo(toX(value[k + 1]), toY(values[k + 1]));
      if (k + 1 === end || !Number.isFinite(values[k + 2])) {
        context.stroke();
        last = -1;
      }
    }
  }
  context.setLineDash([]);
}

function drawBranches() {
  const sides = [view.quantity.low, view.quantity.high].filter(Boolean);
  range = rangeOf(value, sides.flatMap(side => [...side]));
  places = [];
  for (const side of sides) {
    lines(side);
    for (let k = 0; k < value.length; k++) {
      if (!Number.isFinite(side[k])) continue;
      const [x, y] = [toX(value[k]), toY(side[k])];
      places.push({ point: k, x, y });
      if (view.points && special[k] < 0) {
        context.fillStyle = colorOf(study.branches[branchOf[k]]);
        context.beginPath();
        context.arc(x, y, 2.6, 0, 7);
        context.fill();
      }
    }
  }
  for (const { point, x, y } of places) if (special[point] >= 0) mark(study.marks[special[point]], x, y);
}

function drawPlane() {
  const all = study.curves.flatMap(curve => curve.points);
  range = rangeOf(all.map(at => at[0]), all.map(at => at[1]));
  places = [];
  study.curves.forEach(curve => {
    context.strokeStyle = study.marks[curve.special].line;
    context.lineWidth = 2;
    context.beginPath();
    curve.points.forEach(([u, v], i) => {
      const [x, y] = [toX(u), toY(v)];
      context[i ? "lineTo" : "moveTo"](x, y);
      places.push({ curve, at: [u, v], x, y });
    });
    context.stroke();
  });
}

function draw() {
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  canvas.width = Math.round(wide * ratio);
  canvas.height = Math.round(high * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, wide, high);
  context.font = "12.5px system-ui, sans-serif";
  context.save();
  context.beginPath();
  context.rect(EDGE.left, EDGE.top, widthOf(), heightOf());
  context.clip();
  if (view.quantity === PLANE) drawPlane();
  else drawBranches();
  for (const { x, y } of places.filter(place => view.point >= 0 && place.point === view.point)) {
    for (const [color, thick] of [["#fff", 5], ["#d55e00", 2.5]]) {
      context.strokeStyle = color;
      context.lineWidth = thick;
      context.beginPath();
      context.arc(x, y, 9, 0, 7);
      context.stroke();
    }
  }
  context.restore();
  frame();
  canvas.dataset.points = String(places.length);
}

function frame() {
  const label = (name, units) => words(name) + (units === "1" ? "" : ` (${units})`);
  context.lineWidth = 1;
  context.strokeStyle = context.fillStyle = css("--text");
  context.strokeRect(EDGE.left, EDGE.top, widthOf(), heightOf());
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const [at, name] of ticks(range.left, range.right, false, 7)) {
    context.fillRect(toX(at) - 0.5, EDGE.top + heightOf(), 1, 5);
    context.fillText(name, toX(at), EDGE.top + heightOf() + 8);
  }
  context.fillText(label(study.number.name, study.number.units), EDGE.left + widthOf() / 2, EDGE.top + heightOf() + 27);
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const [at, name] of ticks(range.low, range.high, false, 7)) {
    context.fillRect(EDGE.left - 5, toY(at) - 0.5, 5, 1);
    context.fillText(name, EDGE.left - 8, toY(at));
  }
  context.save();
  context.translate(13, EDGE.top + heightOf() / 2);
  context.rotate(-Math.PI / 2);
  context.textAlign = "center";
  context.fillText(view.quantity === PLANE ? label(study.second.name, study.second.units) : label(view.quantity.words, view.quantity.units), 0, 0);
  context.restore();
}

// A piece of line, or a mark, beside its name.
function key() {
  const entry = (name, paint) => {
    const entry = document.createElement("span"), swatch = entry.appendChild(document.createElement("canvas"));
    [swatch.width, swatch.height] = [60, 28];
    [swatch.style.width, swatch.style.height] = ["30px", "14px"];
    paint(swatch.getContext("2d"));
    entry.append(name);
    return entry;
  };
  const line = (color, dashes) => on => {
    on.scale(2, 2);
    on.strokeStyle = color;
    on.lineWidth = 2;
    on.setLineDash(dashes);
    on.beginPath();
    on.moveTo(1, 7);
    on.lineTo(29, 7);
    on.stroke();
  };
  const entries = [];
  if (view.quantity === PLANE) {
    for (const kind of new Set(study.curves.map(curve => curve.special))) entries.push(entry(study.marks[kind].name, line(study.marks[kind].line, [])));
  } else {
    for (const [steady, name] of [[true, "steady sliding"], [false, "cycles"]]) {
      const own = study.branches.filter(branch => branch.steady === steady);
      STABILITY.forEach((word, code) => {
        const there = own.some(branch => links.subarray(branch.first, branch.first + branch.points - 1).includes(code));
        if (there) entries.push(entry(`${name}, ${word}`, line(colorOf(own[0]), DASHES[code])));
      });
    }
    study.marks.forEach((kind, code) => {
      const paint = on => {
        const { corners, filled, cross } = kind;
        on.scale(2, 2);
        on.strokeStyle = on.fillStyle = inkOf(kind);
        on.lineWidth = 1.6;
        on.beginPath();
        if (!corners) on.arc(15, 7, 4.5, 0, 7);
        else corners.forEach(([u, v], i) => on[cross ? (i % 2 ? "lineTo" : "moveTo") : i ? "lineTo" : "moveTo"](15 + 4.5 * u, 7 + 4.5 * v));
        if (corners && !cross) on.closePath();
        if (filled) on.fill();
        on.stroke();
      };
      if (special.includes(code)) entries.push(entry(kind.name, paint));
    });
  }
  byId("key").replaceChildren(...entries);
}

function pointed(x, y) {
  let [best, found] = [20 ** 2, null];
  for (const place of places) {
    // Of points in one place a special one is found.
    const distance = (place.x - x) ** 2 + (place.y - y) ** 2 - (special[place.point] >= 0 ? 4 : 0);
    if (distance < best) [best, found] = [distance, place];
  }
  return found;
}

const nameOf = quantity => words(quantity.words);
function said(quantity, point, show = rounded) {
  const [low, high] = [quantity.low[point], quantity.high && quantity.high[point]];
  return quantity.high ? `${shown(low, "1", show)} to ${shown(high, quantity.units, show)}` : shown(low, quantity.units, show);
}
const placeOf = point => `branch ${branchOf[point]}, point ${point - study.branches[branchOf[point]].first}`;
function hover(place) {
  if (!place) {
    byId("readout").textContent = "";
  } else if (place.curve) {
    const { name, units } = study.second;
    byId("readout").textContent = `${study.marks[place.curve.special].words}: ${words(study.number.name)} = ${shown(place.at[0], study.number.units)}; ${words(name)} = ${shown(place.at[1], units)}`;
  } else {
    const point = place.point, kind = special[point] >= 0 ? `; ${study.marks[special[point]].words}` : "";
    byId("readout").textContent = `${placeOf(point)}: ${words(study.number.name)} = ${shown(value[point], study.number.units)}; ${nameOf(view.quantity)} ${said(view.quantity, point)}; ${STABILITY[stability[point]]}${kind}`;
  }
}

// Where cycles are born they have no size: the point is one of steady sliding.
const isSteady = point => study.branches[branchOf[point]].steady || special[point] >= 0 && study.marks[special[point]].steady;

function commandOf(point) {
  const branch = study.branches[branchOf[point]];
  if (!isSteady(point)) return `stickslip cycle ${inShell(study.file)} --branch ${branchOf[point]} --point ${point - branch.first}`;
  return study.modes && [study.modes, ...study.number.keys.map(name => `--set ${inShell(`${name}=${exact(value[point])}`)}`)].join(" ");
}

function select(point) {
  view.point = point;
  const branch = study.branches[branchOf[point]], command = commandOf(point), place = placeOf(point);
  byId("point").textContent = place[0].toUpperCase() + place.slice(1);
  byId("chosen").hidden = false;
  byId("command").textContent = command || "";
  byId("command").hidden = byId("copy").hidden = !command;
  byId("copied").textContent = "";
  byId("command-hint").textContent = !command
    ? "The file does not say which case it is of."
    : isSteady(point)
      ? "Describes steady sliding there. A case in a file is named as the study names it: run the command in the study's folder."
      : "Finds the cycle from this point, and stores one period of it. Run the command in the folder of the file.";
  const spectrum = [];
  for (let i = 0; i < width; i++) {
    const [a, b] = [real[point * width + i], imaginary[point * width + i]];
    if (!Number.isNaN(a)) spectrum.push(b ? `${exact(a)} ${b < 0 ? "−" : "+"} ${exact(Math.abs(b))} i` : exact(a));
  }
  const kind = branch.steady ? "eigenvalue, 1/s" : "multiplier";
  byId("values").replaceChildren(
    row(words(study.number.name), shown(value[point], study.number.units, exact), study.number.keys.join(", ")),
    row("what", branch.steady ? "steady sliding" : branch.multiple ? `cycle of ${branch.multiple} periods of the drives` : "cycle", ""),
    row("stability", STABILITY[stability[point]], "what becomes of small disturbances"),
    ...(special[point] >= 0 ? [row("special point", study.marks[special[point]].words, "")] : []),
    ...(branch.steady ? [] : [row("events of a period", study.sequences[point] || "none", "")]),
    ...study.quantities.filter(quantity => !Number.isNaN(quantity.low[point])).map(quantity => row(nameOf(quantity), said(quantity, point, exact), quantity.name)),
    ...spectrum.map((one, i) => row(i ? "" : kind, one, kind)),
    row("this branch", `${branch.points} points${branch.parent === null ? "" : `, born on branch ${branch.parent}`}; ends: ${branch.end}`, ""),
  );
  hover({ point });
  draw();
}

function refresh() {
  const choices = study.quantities.map(quantity => [nameOf(quantity), quantity]);
  if (study.second && study.curves.length) choices.push(["special points in two numbers", PLANE]);
  const list = byId("quantity");
  list.replaceChildren(...choices.map(([name, choice]) => new Option(name, "", false, choice === view.quantity)));
  list.onchange = () => {
    view.quantity = choices[list.selectedIndex][1];
    refresh();
  };
  draw();
  key();
}

const at = event => {
  const box = canvas.getBoundingClientRect();
  return pointed(event.clientX - box.left, event.clientY - box.top);
};
canvas.addEventListener("pointermove", event => hover(at(event)));
canvas.addEventListener("pointerleave", () => hover(view.point < 0 ? null : { point: view.point }));
canvas.addEventListener("click", event => {
  const place = at(event);
  if (place && !place.curve) select(place.point);
});
canvas.addEventListener("keydown", event => {
  const way = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: 1, ArrowDown: -1 }[event.key];
  if (!way || event.ctrlKey || event.altKey || event.metaKey || !value.length) return;
  event.preventDefault();
  if (view.point < 0) return select(0);
  const own = branchOf[view.point], branch = study.branches[own];
  if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
    return select(Math.min(Math.max(view.point + way, branch.first), branch.first + branch.points - 1));
  }
  const other = (own + way + study.branches.length) % study.branches.length;
  if (study.branches[other].points) select(study.branches[other].first);
});
byId("points").addEventListener("change", event => {
  view.points = event.target.checked;
  draw();
});
new ResizeObserver(draw).observe(byId("plot"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);

byId("title").textContent = study.title;
byId("subtitle").textContent = `${study.file}: ${value.length.toLocaleString("en")} points of ${study.branches.length} ${study.branches.length === 1 ? "branch" : "branches"}`;
if (!study.complete) {
  byId("notice").hidden = false;
  byId("notice").textContent = "This continuation is not complete.";
}
refresh();
