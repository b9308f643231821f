// The whole run above the panels, with the part in view marked.

const OVERVIEW = { plot: 38, below: 20 };

class Overview {
  // The relative velocity of each run, or what the first panel shows.
  constructor(canvas, chart) {
    const curves = chart.panels.find(({ shown }) => shown)?.curves.slice(0, 1) || [];
    const own = source => (source.trajectory.has("relative_velocity") ? "relative_velocity" : curves[0]?.name);
    Object.assign(this, { canvas, chart, curves: chart.sources.map(source => ({ source, name: own(source) })).filter(({ name }) => name) });
    this.height = OVERVIEW.plot + OVERVIEW.below;
    canvas.style.height = `${this.height}px`;
    onTheme.push(() => (this.ground = null));
    this.listen();
  }

  x(time) {
    const [first, last] = this.chart.limits;
    return LEFT + (time - first) / (last - first) * this.chart.plotWidth;
  }

  timeAt(x) {
    const [first, last] = this.chart.limits;
    return first + (x - LEFT) / this.chart.plotWidth * (last - first);
  }

  // A drag of the mark moves the view, a click elsewhere brings it there. With the whole run in view, a drag chooses a part.
  listen() {
    const { canvas, chart } = this;
    let held = null;
    const move = x => {
      const time = this.timeAt(x), half = (chart.to - chart.from) / 2;
      if (held.begin === null) chart.setView(time - held.off - half, time - held.off + half);
      else if (Math.abs(x - held.x) > 3) chart.setView(...[held.begin, time].sort((a, b) => a - b));
    };
    canvas.addEventListener("pointerdown", event => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      const x = event.offsetX, time = this.timeAt(x), [left, right] = this.mark();
      held = { x, begin: this.isWhole() ? time : null, off: x >= left && x <= right ? time - (chart.from + chart.to) / 2 : 0 };
      move(x);
    });
    canvas.addEventListener("pointermove", event => held && move(event.offsetX));
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, () => (held = null));
  }

  isWhole() {
    const { from, to, limits: [first, last] } = this.chart;
    return to - from > 0.999 * (last - first);
  }

  // The edges of the part in view; a short one is as wide as the pointer can take.
  mark() {
    const [left, right] = [this.x(this.chart.from), this.x(this.chart.to)], more = Math.max(6 - right + left, 0) / 2;
    return [left - more, right + more];
  }

  // What does not change with the view is drawn once.
  paint(width) {
    const { chart } = this, right = LEFT + chart.plotWidth, [first, last] = chart.limits;
    this.ground = document.createElement("canvas");
    const context = prepare(this.ground, width, this.height);
    context.fillStyle = ink("ground");
    context.fillRect(LEFT, 1, chart.plotWidth, OVERVIEW.plot - 1);
    for (const [x0, x1, shade] of shadesOf(chart.run.modes, first, last, time => this.x(time), right)) {
      if (!shade) continue;
      context.fillStyle = ink(shade);
      context.fillRect(x0, 1, x1 - x0, OVERVIEW.plot - 1);
    }
    const columns = this.curves.map(({ source: { trajectory }, name }) => Array.from({ length: Math.floor(chart.plotWidth) + 1 }, (_, k) => {
      const { pyramid } = trajectory.channel(name), at = x => lowerBound(trajectory.time, this.timeAt(x));
      pyramid.extremes(Math.max(at(LEFT + k) - 1, 0), Math.min(at(LEFT + k + 1) + 1, trajectory.size));
      return [pyramid.low, pyramid.high];
    }).map(([low, high], k) => [LEFT + k, low, high]).filter(([, low, high]) => low <= high));
    const all = columns.flat(), [low, high] = padded(Math.min(...all.map(one => one[1])), Math.max(...all.map(one => one[2])), 0.1);
    const y = value => OVERVIEW.plot - (value - low) / (high - low) * (OVERVIEW.plot - 1);
    columns.forEach((points, k) => {
      context.fillStyle = ink(k ? WARM[0] : COOL[0]);
      for (const [x, least, most] of points) context.fillRect(x, y(most) - 0.75, 1, y(least) - y(most) + 1.5);
    });
    context.strokeStyle = ink("frame");
    context.strokeRect(LEFT + 0.5, 0.5, chart.plotWidth - 1, OVERVIEW.plot);
    const axis = axisOf(first, last, chart.plotWidth, 85);
    context.fillStyle = ink("axis");
    context.textBaseline = "middle";
    context.textAlign = "right";
    context.fillText("whole run", LEFT - 6, OVERVIEW.plot / 2);
    context.textBaseline = "top";
    context.fillText(`${axis.prefix}s`, LEFT - 6, OVERVIEW.plot + 4);
    context.textAlign = "center";
    for (const tick of axis.ticks) {
      const x = this.x(tick.value), half = context.measureText(tick.text).width / 2;
      context.fillRect(Math.round(x), OVERVIEW.plot, 1, 3);
      context.fillText(tick.text, Math.min(Math.max(x, half + 1), width - half - 1), OVERVIEW.plot + 4);
    }
  }

  draw() {
    const { chart, canvas } = this, { width } = chart;
    if (!this.ground || this.width !== width || this.ratio !== window.devicePixelRatio) {
      Object.assign(this, { width, ratio: window.devicePixelRatio });
      this.paint(width);
    }
    const context = prepare(canvas, width, this.height);
    context.drawImage(this.ground, 0, 0, width, this.height);
    const [left, right] = this.mark();
    // From the mark to the edges of the panels below.
    context.fillStyle = ink("select");
    context.beginPath();
    for (const [x, y] of [[left, 1], [right, 1], [right, OVERVIEW.plot], [LEFT + chart.plotWidth, this.height], [LEFT, this.height], [left, OVERVIEW.plot]]) context.lineTo(x, y);
    if (!this.isWhole()) context.fill();
    context.strokeStyle = ink("focus");
    context.lineWidth = 1.5;
    context.strokeRect(left, 0.75, right - left, OVERVIEW.plot - 0.5);
    context.lineWidth = 1;
  }
}
