// The small figures of a run: phase portraits, and the durations of sticks and slips.

// The samples in view, in the colours of their modes.
class Portrait {
  constructor(place, { trajectory, modes }, x, y) {
    Object.assign(this, figureCanvas(place), { trajectory, modes, x, y });
  }

  // The samples from entry `first` to `last` - 1; buckets, which are no samples, leave gaps.
  draw(first, last) {
    const { trajectory, place } = this, width = place.clientWidth, height = place.clientHeight;
    const xs = trajectory.channel(this.x.name), ys = trajectory.channel(this.y.name);
    const context = prepare(this.canvas, width, height);
    const axis = (channel, { label }) => {
      channel.pyramid.extremes(first, last);
      const [low, high] = padded(channel.pyramid.low, channel.pyramid.high);
      return { low, high, label, unit: channel.unit };
    };
    const { toX, toY } = frame(context, width, height, axis(xs, this.x), axis(ys, this.y));
    context.save();
    context.clip();
    const { start, code, names } = this.modes;
    let mode = Math.max(lowerBound(start, trajectory.time[first]) - 1, 0);
    for (let i = first; i < last;) {
      while (mode + 1 < start.length && start[mode + 1] <= trajectory.time[i]) mode++;
      const end = mode + 1 < start.length ? start[mode + 1] : Infinity;
      context.beginPath();
      // From the last sample of the mode before, so that the line has no gap, unless the quantity jumps there.
      const before = i > first && !trajectory.isBucket(i - 1) && !this.y.jumps;
      if (before) context.moveTo(toX(xs.low[i - 1]), toY(ys.low[i - 1]));
      let down = before;
      for (; i < last && trajectory.time[i] < end; i++) {
        if (trajectory.isBucket(i)) {
          down = false;
          continue;
        }
        const px = toX(xs.low[i]), py = toY(ys.low[i]);
        if (down) context.lineTo(px, py);
        else context.moveTo(px, py);
        down = true;
      }
      context.strokeStyle = ink(MODE_COLOURS[names[code[mode]]] || "blue");
      context.stroke();
    }
    context.restore();
  }
}

// One period of the motion that a run without a stop settles to, through the states at events.
class Orbit {
  constructor(place, orbit) {
    const lines = orbit.lines.map(({ mode, x, y }) => ({ mode, x: doubles(x), y: doubles(y) }));
    Object.assign(this, figureCanvas(place), { orbit, lines });
    new ResizeObserver(() => this.draw()).observe(place);
    onTheme.push(() => this.draw());
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
    for (const { mode, x, y } of lines) {
      context.strokeStyle = ink(MODE_COLOURS[mode]);
      trace(context, [Array.from(x, (value, i) => [value, y[i]])], toX, toY);
    }
    context.restore();
  }
}

class Durations {
  constructor(place, cycles, onChoose) {
    Object.assign(this, figureCanvas(place), { cycles, chosen: -1, logarithmic: false, count: cycles.start.length });
    this.canvas.addEventListener("click", event => {
      const { left, right } = this.frame || { left: 0, right: 0 }, share = (event.offsetX - left) / (right - left);
      const cycle = Math.round(-0.5 + share * this.count);
      if (cycle >= 0 && cycle < this.count) onChoose(cycle);
    });
  }

  draw() {
    const { place, count, cycles, logarithmic } = this, width = place.clientWidth, height = place.clientHeight;
    const context = prepare(this.canvas, width, height);
    if (!count) {
      context.fillStyle = ink("axis");
      context.fillText("This run has no cycle of stick and slip.", 4, 30);
      return;
    }
    const value = logarithmic ? Math.log10 : x => x;
    const all = [...cycles.stick_duration, ...cycles.slip_duration].filter(duration => duration > 0).map(value);
    const most = Math.max(...all), least = logarithmic ? Math.min(...all) : 0, pad = (most - least) * 0.06 || 0.1;
    const y = { low: logarithmic ? least - pad : 0, high: most + pad, label: "duration", unit: "s", logarithmic };
    const x = { low: -0.5, high: count - 0.5, label: "cycle", unit: "1", whole: true };
    this.frame = frame(context, width, height, x, y);
    const { toX, toY, top, bottom } = this.frame;
    context.save();
    context.clip();
    if (this.chosen >= 0) {
      context.fillStyle = ink("chosen");
      context.fillRect(toX(this.chosen - 0.5), top, Math.max(toX(this.chosen + 0.5) - toX(this.chosen - 0.5), 2), bottom - top);
    }
    for (let k = 0; k < count; k++) {
      drawMark(context, GLYPHS.stick, toX(k), toY(value(cycles.stick_duration[k])));
      drawMark(context, GLYPHS.slip, toX(k), toY(value(cycles.slip_duration[k])));
    }
    context.restore();
    // Which is which, where the upper edge has room.
    context.fillStyle = ink("axis");
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.fillText("slip", width - 10, 9);
    drawMark(context, GLYPHS.slip, width - 42, 9);
    context.fillText("stick", width - 56, 9);
    drawMark(context, GLYPHS.stick, width - 94, 9);
  }
}
