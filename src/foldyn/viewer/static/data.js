// Arrays of a page: base64, raw deflate, bytes by weight, differences over time; see arrays.py.

const TYPES = {
  i8: Int8Array, i16: Int16Array, u8: Uint8Array, u16: Uint16Array, u32: Uint32Array,
  f32: Float32Array,
};

export function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  return bytes;
}

export async function inflated(bytes) {
  const stream = new DecompressionStream("deflate-raw");
  const writer = stream.writable.getWriter();
  const done = writer.write(bytes).then(() => writer.close());
  const [content] = await Promise.all([new Response(stream.readable).arrayBuffer(), done]);
  return new Uint8Array(content);
}

// Values of an array, row by row, from its inflated bytes.
export function restored(raw, { type, shape, differences }) {
  const Type = TYPES[type];
  const width = Type.BYTES_PER_ELEMENT;
  const count = raw.length / width;
  const bytes = new Uint8Array(raw.length);
  for (let weight = 0; weight < width; weight++) {
    for (let k = 0, from = weight * count, to = weight; k < count; k++, to += width) {
      bytes[to] = raw[from + k];
    }
  }
  const columns = new Type(bytes.buffer);
  const rows = shape[0];
  const across = rows ? count / rows : 0;
  for (let pass = 0; pass < differences; pass++) { // sums wrap around as the differences did
    for (let c = 0; c < across; c++) {
      for (let k = c * rows + 1, end = (c + 1) * rows; k < end; k++) columns[k] += columns[k - 1];
    }
  }
  if (shape.length === 1) return columns;
  const values = new Type(count);
  for (let c = 0, from = 0; c < across; c++) {
    for (let row = 0, to = c; row < rows; row++, from++, to += across) values[to] = columns[from];
  }
  return values;
}

// Arrays by name; `find` gives the base64 text of one.
export class Store {
  constructor(about, find) {
    this.about = about;
    this.find = find;
    this.kept = new Map();
  }

  get(name) {
    if (!this.kept.has(name)) this.kept.set(name, this.load(name));
    return this.kept.get(name);
  }

  async load(name) {
    const about = this.about[name];
    const text = about && this.find(name);
    if (!text) throw new Error(`there is no array "${name}"`);
    const values = restored(await inflated(bytesOf(text)), about);
    const count = about.shape.reduce((a, b) => a * b, 1);
    if (values.length !== count) throw new Error(`"${name}": ${values.length} values of ${count}`);
    return values;
  }

  // Values over time: their number, rows of them, and the history of one.
  async changing(about) {
    const parts = about.values
      ? [await this.get(about.values)]
      : [await this.get(about.histories), await this.get(about.shapes)];
    return about.values
      ? new Samples(about.shape, parts[0], this.about[about.values].step)
      : new Product(about, ...parts);
  }
}

class Changing {
  constructor(shape) {
    this.samples = shape[0];
    this.width = shape.slice(1).reduce((a, b) => a * b, 1);
  }

  // Values between sample k and the next, a part of the way; in `out` (width).
  between(k, part, out) {
    const next = Math.min(k + 1, this.samples - 1);
    this.row(k, 1 - part, out, false);
    if (part > 0) this.row(next, part, out, true);
    return out;
  }

  // The largest of the values, or of the lengths of vectors of three.
  largest(vectors = false) {
    const row = new Float32Array(this.width);
    const size = vectors ? 3 : 1;
    let top = 0;
    for (let k = 0; k < this.samples; k++) {
      this.row(k, 1, row, false);
      for (let j = 0; j < row.length; j += size) {
        const value = vectors ? Math.hypot(row[j], row[j + 1], row[j + 2]) : Math.abs(row[j]);
        if (value > top) top = value;
      }
    }
    return top;
  }
}

class Samples extends Changing {
  constructor(shape, values, step) {
    super(shape);
    Object.assign(this, { values, step });
  }

  row(k, factor, out, add) {
    const f = factor * this.step;
    const first = k * this.width;
    for (let j = 0; j < this.width; j++) out[j] = (add ? out[j] : 0) + f * this.values[first + j];
  }

  history(j) {
    return Float64Array.from({ length: this.samples }, (_, k) => this.step * this.values[k * this.width + j]);
  }
}

class Product extends Changing {
  constructor({ shape, sizes }, histories, shapes) {
    super(shape);
    Object.assign(this, { histories, shapes, sizes });
  }

  between(k, part, out) {
    const next = Math.min(k + 1, this.samples - 1);
    const { histories, sizes } = this;
    const count = sizes.length;
    out.fill(0, 0, this.width);
    for (let r = 0; r < count; r++) {
      const weight = (1 - part) * histories[k * count + r] + part * histories[next * count + r];
      this.add(r, sizes[r] * weight, out);
    }
    return out;
  }

  row(k, factor, out, add) {
    const { histories, sizes, width } = this;
    if (!add) out.fill(0, 0, width);
    for (let r = 0; r < sizes.length; r++) {
      this.add(r, factor * sizes[r] * histories[k * sizes.length + r], out);
    }
  }

  add(r, factor, out) {
    if (factor === 0) return;
    const { shapes, width } = this;
    for (let j = 0, at = r * width; j < width; j++, at++) out[j] += factor * shapes[at];
  }

  history(j) {
    const { histories, shapes, sizes, width } = this;
    const weights = sizes.map((size, r) => size * shapes[r * width + j]);
    return Float64Array.from({ length: this.samples }, (_, k) => {
      let sum = 0;
      for (let r = 0; r < weights.length; r++) sum += weights[r] * histories[k * weights.length + r];
      return sum;
    });
  }
}
