// The small figures: phase portraits of what is in view, and the durations of sticks and slips.

// A frame with two labelled axes; returns the transforms of both coordinates.
function frame(context, width, height, x, y) {
  const left = 62, right = width - 8, top = 20, bottom = height - 36;
  const across = axisOf(x.low, x.high, right - left, 75, x.whole), up = axisOf(y.low, y.high, bottom - top, 34);
  const toX = value => left + (value - x.low) / (x.high - x.low) * (right - left);
  const toY = value => bottom - (value - y.low) / (y.high - y.low) * (bottom - top);
  const name = (axis, { label, unit }) => {
    const full = [axis.prefix + readable(unit), axis.offset ? `from ${axis.offsetText} ${readable(unit)}` : ""];
    return [label, ...full].filter(Boolean).join(", ");
  };
  context.fillStyle = ink("axis");
  context.textBaseline = "top";
  context.textAlign = "center";
  for (const tick of across.ticks) {
    const half = context.measureText(tick.text).width / 2;
    context.fillText(tick.text, Math.min(toX(tick.value), width - half - 1), bottom + 4);
  }
  context.fillText(name(across, x), (left + right) / 2, bottom + 19);
  context.textBaseline = "middle";
  context.textAlign = "right";
  for (const tick of up.ticks) context.fillText(tick.text, left - 5, toY(tick.value));
  context.textAlign = "left";
  context.fillText(name(up, y), 2, 8);
  context.fillStyle = ink("grid");
  for (const tick of across.ticks) context.fillRect(Math.round(toX(tick.value)), top, 1, bottom - top);
  for (const tick of up.ticks) context.fillRect(left, Math.round(toY(tick.value)), right - left, 1);
  context.strokeStyle = ink("frame");
  context.strokeRect(left + 0.5, top + 0.5, right - left - 1, bottom - top - 1);
  context.beginPath();
  context.rect(left, top, right - left, bottom - top);
  return { toX, toY };
}

function figureCanvas(place) {
  const canvas = place.appendChild(document.createElement("canvas"));
  return { place, canvas };
}

class Portrait {
  constructor(place, trajectory, modes, x, y) {
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
      const name = names[code[mode]];
      context.strokeStyle = ink(name === "stick" ? VERMILLION : name === "separated" ? GREY : BLUE);
      context.stroke();
    }
    context.restore();
  }
}

class Durations {
  constructor(place, cycles, onChoose) {
    Object.assign(this, figureCanvas(place), { cycles, chosen: -1, logarithmic: false });
    this.count = cycles.start.length;
    if (this.count) this.canvas.addEventListener("click", event => {
      const width = place.clientWidth, share = (event.offsetX - 62) / (width - 8 - 62);
      const cycle = Math.round(-0.5 + share * this.count);
      if (cycle >= 0 && cycle < this.count) onChoose(cycle);
    });
  }

  draw() {
    const { place, count, cycles } = this, width = place.clientWidth, height = place.clientHeight;
    const context = prepare(this.canvas, width, height);
    if (!count) {
      context.fillStyle = ink("axis");
      context.fillText("This run has no cycle of stick and slip.", 4, 30);
      return;
    }
    const all = [...cycles.stick_duration, ...cycles.slip_duration].filter(value => value > 0);
    const value = this.logarithmic ? Math.log10 : x => x;
    const most = Math.max(...all.map(value)), least = this.logarithmic ? Math.min(...all.map(value)) : 0;
    const pad = (most - least) * 0.06 || 0.1;
    const y = { low: this.logarithmic ? least - pad : 0, high: most + pad, label: this.logarithmic ? "log₁₀(duration/s)" : "duration", unit: this.logarithmic ? "1" : "s" };
    const x = { low: -0.5, high: count - 0.5, label: "cycle", unit: "1", whole: true };
    const { toX, toY } = frame(context, width, height, x, y);
    context.save();
    context.clip();
    if (this.chosen >= 0) {
      context.fillStyle = ink("chosen");
      context.fillRect(toX(this.chosen - 0.5), 0, Math.max(toX(this.chosen + 0.5) - toX(this.chosen - 0.5), 2), height);
    }
    for (let k = 0; k < count; k++) {
      drawGlyph(context, "stick", toX(k), toY(value(cycles.stick_duration[k])));
      drawGlyph(context, "slip", toX(k), toY(value(cycles.slip_duration[k])));
    }
    context.restore();
    // Which is which, where the upper edge has room.
    context.fillStyle = ink("axis");
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.fillText("slip", width - 10, 9);
    drawGlyph(context, "slip", width - 42, 9);
    context.fillText("stick", width - 56, 9);
    drawGlyph(context, "stick", width - 94, 9);
  }
}
