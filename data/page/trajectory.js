// The data of a run: its curves, and the least and largest value over any part of them.

// The inverse of the program's packing: a double for each block, single-precision offsets from it.
function unpack(packed, block) {
  const base = doubles(packed.base), offset = new Float32Array(bytesOf(packed.offset).buffer);
  const values = new Float64Array(offset.length);
  for (let i = 0; i < values.length; i++) values[i] = base[Math.floor(i / block)] + offset[i];
  return values;
}

// The first index in [low, high) whose value is not below x, or high.
function lowerBound(values, x, low = 0, high = values.length) {
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (values[middle] < x) low = middle + 1;
    else high = middle;
  }
  return low;
}

// The first index whose value is above x, or the length.
function upperBound(values, x) {
  let i = lowerBound(values, x);
  while (i < values.length && values[i] === x) i++;
  return i;
}

// Least and largest value of any stretch of a column, in logarithmic time: level k + 1 has those of eight of level k.
class Pyramid {
  constructor(low, high) {
    this.levels = [{ low, high }];
    while (low.length > Pyramid.FACTOR) {
      const size = Math.ceil(low.length / Pyramid.FACTOR);
      const nextLow = new Float64Array(size).fill(Infinity), nextHigh = new Float64Array(size).fill(-Infinity);
      for (let i = 0; i < low.length; i++) {
        const k = Math.floor(i / Pyramid.FACTOR);
        // NaN compares false, and so leaves no trace.
        if (low[i] < nextLow[k]) nextLow[k] = low[i];
        if (high[i] > nextHigh[k]) nextHigh[k] = high[i];
      }
      this.levels.push({ low: nextLow, high: nextHigh });
      low = nextLow;
      high = nextHigh;
    }
  }

  // Sets this.low and this.high for the entries from, from + 1, ..., to - 1; low > high where none is a number.
  extremes(from, to) {
    let least = Infinity, most = -Infinity;
    for (let k = 0; from < to; k++) {
      const { low, high } = this.levels[k];
      const take = i => {
        if (low[i] < least) least = low[i];
        if (high[i] > most) most = high[i];
      };
      if (k + 1 === this.levels.length) while (from < to) take(from++);
      while (from < to && from % Pyramid.FACTOR) take(from++);
      while (from < to && to % Pyramid.FACTOR) take(--to);
      from /= Pyramid.FACTOR;
      to /= Pyramid.FACTOR;
    }
    this.low = least;
    this.high = most;
  }
}
Pyramid.FACTOR = 8;

// The samples in order of time, or buckets: the least and largest of some consecutive ones.
class Trajectory {
  constructor(json) {
    this.json = json;
    this.time = doubles(json.time);
    this.size = this.time.length;
    this.bucketEnd = doubles(json.bucket_end);
    // The bucket that an entry is, or -1.
    this.bucket = null;
    if (this.bucketEnd.length) {
      this.bucket = new Int32Array(this.size).fill(-1);
      let entry = 0, bucket = 0;
      for (const stretch of json.stretches) {
        for (const end = entry + stretch.entries; entry < end; entry++) {
          if (stretch.bucket) this.bucket[entry] = bucket++;
        }
      }
    }
    this.known = new Map(json.channels.map(channel => [channel.name, channel]));
    this.decoded = new Map();
  }

  has(name) {
    return this.known.has(name) || this.decoded.has(name);
  }

  unit(name) {
    return (this.known.get(name) || this.decoded.get(name)).unit;
  }

  // Decoded when it is first asked for, so that the page opens quickly.
  channel(name) {
    let channel = this.decoded.get(name);
    if (!channel && this.known.has(name)) {
      const packed = this.known.get(name);
      const low = unpack(packed.value, this.json.block);
      channel = this.add(name, low, this.withHighs(low, packed.bucket_high), packed.unit);
    }
    return channel;
  }

  withHighs(low, packed) {
    if (!this.bucket) return low;
    const highs = unpack(packed, this.json.block), high = low.slice();
    // Least and largest are rounded apart from each other, and must not cross where they are equal.
    for (let i = 0; i < high.length; i++) if (this.bucket[i] >= 0) high[i] = Math.max(low[i], highs[this.bucket[i]]);
    return high;
  }

  add(name, low, high, unit) {
    const channel = { name, low, high, unit, pyramid: new Pyramid(low, high) };
    this.decoded.set(name, channel);
    return channel;
  }

  isBucket(entry) {
    return this.bucket !== null && this.bucket[entry] >= 0;
  }

  // When the entry ends: a sample where it begins.
  end(entry) {
    return this.isBucket(entry) ? this.bucketEnd[this.bucket[entry]] : this.time[entry];
  }

  nearest(time) {
    const i = Math.min(lowerBound(this.time, time), this.size - 1);
    return i > 0 && time - this.time[i - 1] < this.time[i] - time ? i - 1 : i;
  }
}

// A run as its curves need it: the trajectory, the modes {start, code, names}, the events {time, kind, kinds, states} and the
// stretches {from, to} with too few samples for a straight line between them.
class Source {
  constructor(run, trajectory) {
    this.trajectory = trajectory;
    this.modes = { names: run.modes.names, start: doubles(run.modes.start), code: codes(run.modes.code) };
    const { count, kinds, time, kind, mode_after, internal_force } = run.events;
    this.events = { count, kinds, time: doubles(time), kind: codes(kind), mode_after: codes(mode_after), internal_force: doubles(internal_force) };
    this.events.states = new Map(run.events.states.map(({ name, before, after }) => [name, Source.sides(doubles(before), doubles(after))]));
    this.sparse = { from: doubles(run.sparse.from), to: doubles(run.sparse.to), remedy: run.remedy };
    this.addLimit(run.breakaway_arms, run.torque_unit);
  }

  static sides(before, after) {
    const low = before.map((value, k) => Math.min(value, after[k])), high = before.map((value, k) => Math.max(value, after[k]));
    return { before, after, pyramid: new Pyramid(low, high) };
  }

  // What stick can carry: mu_0 r F_n, each way.
  addLimit(arms, unit) {
    if (arms === null || !this.trajectory.has("normal_force")) return;
    const force = this.trajectory.channel("normal_force"), states = this.events.states.get("normal_force");
    const times = (values, factor) => values.map(value => value * factor);
    // The backward limit matters where the torque is negative somewhere.
    const torque = this.trajectory.has("friction_torque") && this.trajectory.channel("friction_torque").low;
    const either = torque && torque.some(value => value < 0);
    const limits = [["breakaway_torque", arms[0]], ...(either ? [["breakaway_torque_backward", -arms[1]]] : [])];
    for (const [name, factor] of limits) {
      const one = times(force.low, factor), other = force.high === force.low ? one : times(force.high, factor);
      this.trajectory.add(name, factor > 0 ? one : other, factor > 0 ? other : one, unit);
      if (states) this.events.states.set(name, Source.sides(times(states.before, factor), times(states.after, factor)));
    }
  }

  // Whether the time is in a stretch with too few samples.
  isSparse(time) {
    const { from, to } = this.sparse, k = lowerBound(to, time);
    return k < to.length && from[k] < time;
  }

  // The value of a channel on its curve: a sample, or on the straight line between what is known on both sides.
  valueAt(name, time) {
    const { trajectory, events } = this, { time: t, size } = trajectory, values = trajectory.channel(name).low;
    const i = lowerBound(t, time);
    if (i < size && t[i] === time) return trajectory.isBucket(i) ? NaN : values[i];
    const states = events.states.get(name), k = lowerBound(events.time, time);
    let [t0, v0] = i > 0 ? [trajectory.end(i - 1), trajectory.isBucket(i - 1) ? NaN : values[i - 1]] : [-Infinity, NaN];
    let [t1, v1] = i < size ? [t[i], trajectory.isBucket(i) ? NaN : values[i]] : [Infinity, NaN];
    if (states && k < events.time.length && events.time[k] <= t1) [t1, v1] = [events.time[k], states.before[k]];
    if (states && k > 0 && events.time[k - 1] >= t0) [t0, v0] = [events.time[k - 1], states.after[k - 1]];
    if (time === t1) return v1;
    return v0 + (v1 - v0) * (time - t0) / (t1 - t0);
  }
}
