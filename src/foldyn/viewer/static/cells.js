// A cell that repeats: its sheet several times, and Bloch waves that run over it.
import { Result, extremes } from "./result.js";

// The sheet of all cells; nodes of the cell R = 0 come first.
export function repeated(sheet, cells) {
  const { inner, kind } = sheet;
  const copies = (values, width, shift, from = 0, to = values.length / width) => cells.flatMap((_, c) =>
    Array.from(values.subarray(width * from, width * to), (value) => value + shift * c));
  const edges = (name, width, shift) => { // the boundary comes last
    const ends = [[0, inner], [inner, kind.length]];
    return sheet[name].constructor.from(ends.flatMap((part) => copies(sheet[name], width, shift, ...part)));
  };
  const panels = 1 + sheet.panel.reduce((most, panel) => Math.max(most, panel), 0);
  return {
    ...sheet, cell: sheet, count: cells.length * sheet.count, inner: cells.length * inner,
    nodes: Float32Array.from(copies(sheet.nodes, 3, 0)),
    triangles: Uint32Array.from(copies(sheet.triangles, 3, sheet.count)),
    panel: Uint32Array.from(copies(sheet.panel, 1, panels)),
    edges: edges("edges", 2, sheet.count), kind: edges("kind", 1, 0), crease: edges("crease", 1, 0),
    along: edges("along", 2, 0),
    bars: sheet.bars && Uint32Array.from(copies(sheet.bars, 2, sheet.count)),
  };
}

// Powers of affine maps (3 x 4), multiplied.
const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

function after(one, two) {
  const out = new Array(12);
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 4; j++) {
      out[4 * i + j] = (j === 3 ? one[4 * i + 3] : 0)
        + one[4 * i] * two[j] + one[4 * i + 1] * two[4 + j] + one[4 * i + 2] * two[8 + j];
    }
  }
  return out;
}

export class Waves extends Result {
  // The frequency (Hz) of a band at a phase of the path.
  hertz(state, phase, band) {
    const [, phases, bands] = this.sizes;
    return this.frequency[(state * phases + phase) * bands + band];
  }

  // The nearest phase that has a Bloch mode.
  kept(phase) {
    return Math.min(Math.round(phase / this.every), this.rows - 1) * this.every;
  }

  get rows() {
    return Math.ceil(this.sizes[1] / this.every);
  }

  // Put the cells where they are in a state.
  rest(state, cells) {
    if (this.sheet.state === state) return;
    const { sheet } = this;
    const { count } = sheet.cell;
    const periods = cells[0].length;
    const at = (k) => [...this.maps.subarray(12 * (state * periods + k), 12 * (state * periods + k + 1))];
    const place = this.places.subarray(3 * count * state, 3 * count * (state + 1));
    sheet.state = state;
    sheet.turns = cells.map((step, c) => {
      let map = identity;
      step.forEach((power, k) => {
        for (let j = 0; j < power; j++) map = after(map, at(k));
      });
      turned(map, place, sheet.nodes, 3 * count * c, true);
      return map;
    });
    const ends = [0, 1, 2].map((d) => extremes(sheet.nodes, d));
    for (let j = 0; j < sheet.nodes.length; j++) sheet.nodes[j] -= (ends[j % 3][0] + ends[j % 3][1]) / 2; // states share a center
    sheet.box = ends.map(([low, high]) => [(low - high) / 2, (high - low) / 2]);
  }

  // Nodes at a moment of a wave: Re(shape exp(i (wave . R - phase))), turned with the cells.
  ride(sample, wave, cells, phase, scale) {
    const { sheet } = this;
    const half = 3 * sheet.cell.count;
    this.displacement.row(sample, 1, this.room, false);
    const own = (this.own ??= new Float32Array(half));
    const moved = (this.tiled ??= new Float32Array(sheet.nodes.length));
    cells.forEach((step, c) => {
      const angle = step.reduce((sum, power, k) => sum + power * wave[k], -phase);
      const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
      for (let j = 0; j < half; j++) own[j] = cos * this.room[j] - sin * this.room[half + j];
      turned(sheet.turns[c], own, moved, half * c, false);
    });
    for (let j = 0; j < moved.length; j++) this.positions[j] = sheet.nodes[j] + scale * moved[j];
    return moved;
  }
}

// Vectors under a map, with or without its shift, into `out` from a place on.
function turned(map, values, out, from, shifted) {
  for (let j = 0; j < values.length; j += 3) {
    for (let i = 0; i < 3; i++) {
      out[from + j + i] = map[4 * i] * values[j] + map[4 * i + 1] * values[j + 1] + map[4 * i + 2] * values[j + 2]
        + (shifted ? map[4 * i + 3] : 0);
    }
  }
}
