// The data of the page: decoding, and the least and largest value over any stretch.

const byId = id => document.getElementById(id);

// Typed arrays have the byte order of the machine; every machine with a browser today is little-endian, as the data.
function bytesOf(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

const doubles = text => new Float64Array(bytesOf(text).buffer);
const codes = text => new Int8Array(bytesOf(text).buffer);

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
