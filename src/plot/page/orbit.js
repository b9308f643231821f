
// Of two trains: one period of the motion that the run comes to, its cycles as a table, and a view of that period.

class Orbit {
  constructor(place, orbit) {
    Object.assign(this, figureCanvas(place), { orbit });
    this.lines = orbit.lines.map(({ mode, x, y }) => ({ mode, x: doubles(x), y: doubles(y) }));
    new ResizeObserver(() => this.draw()).observe(place);
  }

  draw() {
    const { place, orbit, lines } = this, width = place.clientWidth, height = place.clientHeight;
    const context = prepare(this.canvas, width, height);
    const axis = name => {
      let least = Infinity, most = -Infinity;
      for (const line of lines) for (const value of line[name]) [least, most] = [Math.min(least, value), Math.max(most, value)];
      const [low, high] = padded(least, most);
      return { low, high, ...orbit[name] };
    };
    const { toX, toY } = frame(context, width, height, axis("x"), axis("y"));
    context.save();
    context.clip();
    const colours = { "stick": VERMILLION, "separated": GREY, "slip-backward": PURPLE };
    for (const { mode, x, y } of lines) {
      context.beginPath();
      for (let i = 0; i < x.length; i++) context.lineTo(toX(x[i]), toY(y[i]));
      context.strokeStyle = ink(colours[mode] || BLUE);
      context.stroke();
    }
    context.restore();
  }
}

const orbit = new Orbit(byId("portrait-orbit"), run.orbit);
onTheme.push(() => orbit.draw());
const lastPeriod = byId("last-period");
if (lastPeriod) lastPeriod.addEventListener("click", () => chart.setView(run.orbit.to - run.orbit.period, run.orbit.to));

const MOST_CYCLES = 1000;
const cycleRows = Array.from(cycles.start.slice(0, MOST_CYCLES), (start, k) => {
  const stick = cycles.stick_duration[k], slip = cycles.slip_duration[k];
  return [String(k), `${start.toFixed(9)} s`, withUnit(stick, "s", 9), withUnit(slip, "s", 9), withUnit(stick + slip, "s", 9)];
});
if (cycleRows.length) byId("cycles").append(tableOf(["cycle", "begin", "stick", "slip", "period"], cycleRows, 1));
else byId("cycles").append(element("p", "This run has no cycle of stick and slip.", "hint"));
if (cycles.start.length > MOST_CYCLES) byId("cycles").append(element("p", `The first ${MOST_CYCLES} of ${cycles.start.length} on this page.`, "hint"));
