// Results as the page shows them: where the nodes of a sheet are at a moment, and what colors it.

import { BOUNDARY } from "./colors.js";

const SHEET_ARRAYS = ["nodes", "triangles", "panel", "edges", "kind", "crease", "along", "bars"];

export async function loadedSheet(about, store) {
  const arrays = await Promise.all(
    SHEET_ARRAYS.map((name) => (about[name] ? store.get(about[name]) : null)),
  );
  const sheet = { ...about };
  SHEET_ARRAYS.forEach((name, k) => (sheet[name] = arrays[k]));
  sheet.count = sheet.nodes.length / 3;
  sheet.box = [0, 1, 2].map((d) => extremes(sheet.nodes, d));
  sheet.size = Math.hypot(...sheet.box.map(([low, high]) => high - low)) || 1;
  sheet.edge = meanLength(sheet);
  sheet.inner = sheet.kind.indexOf(BOUNDARY); // the boundary comes last
  if (sheet.inner < 0) sheet.inner = sheet.kind.length;
  return sheet;
}

// One result: displacements of a sheet over moments (s, steps along a path, numbers of modes, Hz).
export class Result {
  constructor(about, sheet, parts) {
    Object.assign(this, about, { sheet }, parts);
    this.complex = this.displacement.width === 6 * sheet.count; // real parts, then imaginary ones
    this.room = new Float32Array(this.displacement.width);
    this.positions = new Float32Array(3 * sheet.count);
    this.largest = this.displacement.largest(true);
  }

  static async load(about, sheet, store) {
    const fields = await Promise.all(Object.entries(about.fields ?? {}).map(
      async ([key, field]) => [key, { ...field, values: await store.changing(field.values) }],
    ));
    const energies = await Promise.all(Object.entries(about.energies ?? {}).map(
      async ([name, array]) => [name, await store.get(array)],
    ));
    return new Result(about, sheet, {
      displacement: await store.changing(about.displacement),
      moments: about.moments ? Float64Array.from(await store.get(about.moments)) : null,
      load: about.load ? await store.get(about.load) : null,
      force: about.force ? await store.get(about.force) : null,
      fields: Object.fromEntries(fields),
      energies: Object.fromEntries(energies),
    });
  }

  // Sample at or before a moment, and the part of the way to the next.
  place(moment) {
    const { moments } = this;
    if (!moments) return [moment, 0];
    let [low, high] = [0, moments.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (moments[middle] <= moment) low = middle;
      else high = middle;
    }
    const gap = moments[high] - moments[low];
    return [low, gap > 0 ? Math.min(1, Math.max(0, (moment - moments[low]) / gap)) : 0];
  }

  // Displacements (3n) at a moment and a phase of what swings.
  moved(moment, phase = 0) {
    const [k, part] = this.place(moment);
    this.sample = part < 1 ? k : k + 1;
    this.displacement.between(k, part, this.room);
    if (!this.complex) return this.room;
    const half = this.room.length / 2;
    const [c, s] = [Math.cos(phase), Math.sin(phase)];
    for (let j = 0; j < half; j++) this.room[j] = c * this.room[j] - s * this.room[half + j];
    return this.room.subarray(0, half);
  }

  // Put the nodes where they are then; displacements are multiplied by `scale`.
  move(moment, phase, scale) {
    const { nodes } = this.sheet;
    const moved = this.moved(moment, phase);
    for (let j = 0; j < nodes.length; j++) this.positions[j] = nodes[j] + scale * moved[j];
    return moved;
  }

  // Values of a field at a moment as levels from 0 to 1 of its largest, `top`.
  levels(key, moment, moved, top) {
    const out = (this.levelRoom ??= {});
    if (key === "displacement") {
      const levels = (out[key] ??= new Float32Array(this.sheet.count));
      for (let k = 0; k < levels.length; k++) {
        levels[k] = Math.hypot(moved[3 * k], moved[3 * k + 1], moved[3 * k + 2]) / top;
      }
      return { on: "node", levels };
    }
    if (key === "speed") {
      const levels = this.speeds(moment, (out[key] ??= new Float32Array(this.sheet.count)));
      for (let k = 0; k < levels.length; k++) levels[k] /= top;
      return { on: "node", levels };
    }
    const field = this.fields[key];
    if (!field) return null;
    const levels = (out[key] ??= new Float32Array(field.values.width));
    field.values.between(...this.place(moment), levels);
    const [middle, half] = field.signed ? [0.5, 0.5] : [0, 1];
    for (let k = 0; k < levels.length; k++) levels[k] = middle + (half * levels[k]) / top;
    return { on: field.on, levels };
  }

  // Speeds (m/s) of the nodes between two samples.
  speeds(moment, out) {
    const { moments, displacement } = this;
    const k = Math.min(this.place(moment)[0], moments.length - 2);
    const factor = 1 / (moments[k + 1] - moments[k]);
    const row = (this.difference ??= new Float32Array(displacement.width));
    displacement.row(k, -factor, row, false);
    displacement.row(k + 1, factor, row, true);
    for (let j = 0; j < out.length; j++) out[j] = Math.hypot(row[3 * j], row[3 * j + 1], row[3 * j + 2]);
    return out;
  }

  top(key) {
    if (key === "displacement") return this.largest;
    if (key === "speed") {
      if (this.fastest) return this.fastest;
      const room = new Float32Array(this.sheet.count);
      const stride = Math.max(1, Math.floor((this.displacement.width * this.moments.length) / 1e6));
      for (let k = 0; k < this.moments.length - 1; k += stride) {
        this.fastest = Math.max(this.fastest ?? 0, ...this.speeds(this.moments[k], room));
      }
      return this.fastest;
    }
    const field = this.fields[key];
    if (!field) return 0;
    return (field.top ??= field.values.largest());
  }

  // Displacement (m) of a node along an axis at all samples; of what swings, its imaginary parts too.
  history(node, axis, imaginary = false) {
    return this.displacement.history((imaginary ? 3 * this.sheet.count : 0) + 3 * node + axis);
  }
}

// Mean length of the pattern's edges, each of one piece or more.
function meanLength({ along, crease }) {
  let total = 0;
  let count = 0;
  for (let k = 0; k < crease.length; k++) {
    total += along[2 * k + 1] - along[2 * k];
    if (along[2 * k] === 0) count++;
  }
  return total / count || 1;
}

// Least and greatest coordinate along an axis.
export function extremes(nodes, axis) {
  let [low, high] = [Infinity, -Infinity];
  for (let k = axis; k < nodes.length; k += 3) {
    low = Math.min(low, nodes[k]);
    high = Math.max(high, nodes[k]);
  }
  return [low, high];
}

// The box (low, high) of sheets at rest with a margin (parts of their sizes).
export function boxAround(results, margin) {
  const ends = (k, pick) => pick(...results.map(({ sheet }) => sheet.box[k][pick === Math.max ? 1 : 0]));
  const size = margin * Math.max(...results.map(({ sheet }) => sheet.size));
  return [[0, 1, 2].map((k) => ends(k, Math.min) - size), [0, 1, 2].map((k) => ends(k, Math.max) + size)];
}

// The box of all positions that results take.
export function boxOfMotion(results, scale) {
  const [low, high] = boxAround(results, 0);
  for (const result of results) {
    const { nodes } = result.sheet;
    const { samples, width } = result.displacement;
    const row = new Float32Array(width);
    const stride = Math.max(1, Math.floor((samples * width) / 2e6));
    for (let k = 0; k < samples; k += stride) {
      result.displacement.row(k, 1, row, false);
      for (let j = 0; j < nodes.length; j++) {
        const value = nodes[j] + scale * row[j];
        if (value < low[j % 3]) low[j % 3] = value;
        if (value > high[j % 3]) high[j % 3] = value;
      }
    }
  }
  return [low, high];
}
