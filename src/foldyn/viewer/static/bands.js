// Bands of a repeated cell, and the Bloch mode of a point of a band, running over several cells.
import { Analysis, TURNS } from "./analysis.js";
import { Waves, repeated } from "./cells.js";
import { CURVES, DASHES, ramp } from "./colors.js";
import { contour, levels } from "./contours.js";
import { number } from "./numbers.js";

const REACH = 0.12; // largest motion, in sizes of the cell
const ARRAYS = ["frequency", "places", "maps", "damping", "attenuation", "levels"];
const LINES = 8; // of one frequency

export class Bands extends Analysis {
  speeds = [2, 1, 0.5, 0.25];
  overlays = false;
  nodal = false;

  async loaded(about, sheet, store) {
    this.sheets ??= new Map();
    const { cells } = this.page.about;
    if (!this.sheets.has(sheet)) this.sheets.set(sheet, repeated(sheet, cells));
    const parts = await Promise.all(ARRAYS.map(async (name) => [name, about[name] ? await store.get(about[name]) : null]));
    const result = new Waves(about, this.sheets.get(sheet), {
      displacement: await store.changing(about.displacement),
      zone: about.zone ? await store.changing(about.zone) : null,
      ...Object.fromEntries(parts), fields: {}, energies: {},
    });
    result.largest = 1;
    result.rest(0, cells);
    return result;
  }

  get band() {
    return this.page.band ?? 0; // the page keeps it when results are replaced
  }

  set band(band) {
    this.page.band = band;
  }

  prepare() {
    const { about } = this.page;
    this.range = [0, about.path.length - 1];
    this.state = Math.min(this.state ?? Math.floor(about.states.length / 2), Math.max(0, about.states.length - 1));
    this.band = Math.min(this.band, this.page.results[0].sizes[2] - 1);
    const [, corner] = about.ticks;
    this.page.moment ??= Math.max(1, about.path.findIndex((along) => along >= 0.6 * corner[0]));
    this.slider();
  }

  // The box of all states, with room for the waves.
  box(results) {
    const { cells, states } = this.page.about;
    let [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (const result of results) {
      for (let state = 0; state < (states.length || 1); state++) {
        result.rest(state, cells);
        low = low.map((value, k) => Math.min(value, result.sheet.box[k][0]));
        high = high.map((value, k) => Math.max(value, result.sheet.box[k][1]));
      }
      result.rest(this.state ?? 0, cells);
    }
    return [low, high];
  }

  // A slider for the states.
  slider() {
    const { page } = this;
    const { states, varied, unit } = page.about;
    page.root.querySelector(".states")?.remove();
    if (states.length < 2) return;
    const label = document.createElement("label");
    label.className = "states";
    const input = Object.assign(document.createElement("input"), {
      type: "range", min: 0, max: states.length - 1, step: 1, value: this.state,
    });
    const told = document.createElement("output");
    const tell = () => (told.textContent = `${number(states[this.state], 4)}${unit}`);
    input.addEventListener("input", () => this.show(Number(input.value)));
    label.append(varied, input, told);
    page.$("charts").before(label);
    this.tell = () => {
      input.value = this.state;
      tell();
    };
    tell();
  }

  show(state) {
    if (state === this.state) return;
    this.state = state;
    this.tell?.();
    this.page.charts();
    if (!this.page.playing) this.page.say();
  }

  get phase() {
    return Math.round(this.page.moment);
  }

  advance(seconds) {
    this.page.phase += 2 * Math.PI * TURNS * this.speed * seconds;
  }

  swing(result) {
    const { nodes } = result.sheet.cell;
    result.reach ??= Math.hypot(...[0, 1, 2].map((k) => {
      let [low, high] = [Infinity, -Infinity];
      for (let j = k; j < nodes.length; j += 3) [low, high] = [Math.min(low, nodes[j]), Math.max(high, nodes[j])];
      return high - low;
    }));
    return REACH * result.reach;
  }

  move(result, scale) {
    const { about, phase } = this.page;
    const at = result.kept(this.phase);
    const [, , bands] = result.sizes;
    result.rest(this.state, about.cells);
    const sample = (this.state * bands + this.band) * result.rows + at / result.every;
    return result.ride(sample, about.wave[at], about.cells, phase, scale);
  }

  clock() {
    const [first] = this.page.shown;
    return `band ${this.band + 1}, ${number(first.hertz(this.state, first.kept(this.phase), this.band), 4)} Hz`;
  }

  words() {
    const { about, shown } = this.page;
    const at = shown[0].kept(this.phase);
    const wave = about.wave[at].map((phase) => `${number(phase / Math.PI, 3)}π`).join(", ");
    const state = about.states.length ? `, ${about.varied} ${number(about.states[this.state], 4)}${about.unit}` : "";
    return `${this.clock()[0].toUpperCase()}${this.clock().slice(1)}: Bloch mode at the phase ${wave} per period${state}.`;
  }

  draw(host) {
    this.path(host);
    this.decay(host);
    this.damping(host);
    this.gaps(host);
    this.zone(host);
  }

  // The greatest frequency of all states.
  get highest() {
    return 1.04 * Math.max(...this.page.shown.map(({ frequency }) => frequency.reduce((top, f) => (f > top ? f : top), 0))) || 1;
  }

  path(host) {
    const { page } = this;
    const { about, shown } = page;
    const [, , bands] = shown[0].sizes;
    const curves = shown.flatMap((result) => Array.from({ length: bands }, (_, band) => ({
      name: shown.length > 1 ? `${result.name}, band ${band + 1}` : `${band + 1}`,
      color: CURVES[page.theme][(shown.length > 1 ? result.index : band) % 8], dash: [],
      x: about.path, y: about.path.map((_, k) => result.hertz(this.state, k, band)),
    })));
    const seek = (k, curve) => {
      const before = this.band;
      this.band = curve % bands;
      page.seek(shown[Math.floor(curve / bands)].kept(k));
      if (this.band !== before && shown[0].zone) page.charts();
    };
    this.chart(host, {
      label: "frequencies of the bands along the path", xlabel: "wave vector", ylabel: "frequency (Hz)", curves, free: true,
      all: true, named: shown.length < 2, height: 330, ticks: { x: about.ticks }, seek,
      ranges: { x: [0, about.path.at(-1)], y: [0, this.highest] },
      shaded: shown[0].gaps.filter(([state]) => state === this.state).map(([, , low, high]) => [low, high]),
      follow: () => {
        const at = shown[0].kept(this.phase);
        return [0, curves.map((_, j) => (j % bands === this.band
          ? [about.path[at], shown[Math.floor(j / bands)].hertz(this.state, at, this.band)] : [NaN, NaN]))];
      },
    });
  }

  // Attenuation of waves of a frequency along legs of the path.
  decay(host) {
    const [{ attenuation, levels: every, legs }] = this.page.shown;
    if (!attenuation) return;
    const count = attenuation.length / legs.length / (this.page.about.states.length || 1);
    const from = (values, row) => [...values.subarray(row * count, (row + 1) * count)];
    const curves = legs.map((name, leg) => ({
      name, color: CURVES[this.page.theme][leg % 8], dash: [],
      x: from(attenuation, this.state * legs.length + leg), y: from(every, this.state),
    }));
    const reach = 1.04 * Math.max(...curves.flatMap(({ x }) => x)) || 1;
    this.chart(host, {
      label: "attenuation of waves by frequency", xlabel: "attenuation (Np per cell)", ylabel: "frequency (Hz)", curves,
      free: true, height: 300, ranges: { x: [0, reach], y: [0, this.highest] }, follow: () => [0, []],
    });
  }

  damping(host) {
    const { about, shown: [{ damping, sizes: [, phases, bands] }] } = this.page;
    if (!damping) return;
    const curves = Array.from({ length: bands }, (_, band) => ({
      name: `${band + 1}`, color: CURVES[this.page.theme][band % 8], dash: [],
      x: about.path, y: about.path.map((_, k) => 100 * damping[(this.state * phases + k) * bands + band]),
    }));
    const sorted = curves.flatMap(({ y }) => y).filter(Number.isFinite).sort((a, b) => a - b);
    const most = 1.3 * sorted[Math.floor(0.9 * sorted.length)] || 1; // ratios grow without end toward Γ
    this.chart(host, {
      label: "damping ratios of the waves along the path", xlabel: "wave vector", ylabel: "damping (%)", curves, free: true,
      ticks: { x: about.ticks }, ranges: { x: [0, about.path.at(-1)], y: [0, most] }, follow: () => [0, []],
    });
  }

  // Widths of the full gaps over the states.
  gaps(host) {
    const { page } = this;
    const { states, varied, unit } = page.about;
    const [first] = page.shown;
    const below = [...new Set(first.gaps.map((gap) => gap[1]))].sort((a, b) => a - b);
    if (states.length < 2 || !below.length) return;
    const curves = below.map((band, k) => ({
      name: band ? `above band ${band}` : "below band 1", color: CURVES[page.theme][(band + 7) % 8], dash: DASHES[k % 5],
      x: states, y: states.map((_, state) => {
        const gap = first.gaps.find((one) => one[0] === state && one[1] === band);
        return gap ? gap[3] - gap[2] : 0;
      }),
    }));
    this.chart(host, {
      label: `width of full gaps over the ${varied}`, xlabel: unit ? `${varied} (${unit.trim()})` : varied,
      ylabel: curves.length > 1 ? "full gaps (Hz)" : `gap ${curves[0].name} (Hz)`, curves, follow: () => [states[this.state]],
      seek: (value) => this.show(states.reduce((best, one, k) =>
        (Math.abs(one - value) < Math.abs(states[best] - value) ? k : best), 0)),
    });
  }

  // Lines of one frequency of the band over the whole zone.
  zone(host) {
    const [{ zone, sizes: [, , bands] }] = this.page.shown;
    if (!zone) return;
    const n = Math.round(Math.sqrt(zone.width));
    const values = new Float32Array(zone.width);
    zone.row(this.state * bands + this.band, 1, values, false);
    const [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
    const colors = ramp("sequential");
    const lines = levels(low, high, LINES);
    const curves = lines.map((level, k) => {
      const from = this.page.theme === "dark" ? 20 : 70;
      const at = 4 * Math.round(from + (160 * k) / (lines.length - 1 || 1));
      const pieces = contour(values, n, level);
      return {
        name: `${number(level, 4)} Hz`, color: `rgb(${[...colors.slice(at, at + 3)].join(", ")})`, dash: [],
        x: pieces.flatMap(([x0, , x1]) => [x0, x1, NaN]), y: pieces.flatMap(([, y0, , y1]) => [y0, y1, NaN]),
      };
    });
    const ends = [[-Math.PI, "−π"], [0, "0"], [Math.PI, "π"]];
    const range = [-Math.PI, Math.PI];
    this.chart(host, {
      label: `lines of one frequency of band ${this.band + 1}`, xlabel: `band ${this.band + 1}: phase along period 1`,
      ylabel: "phase along period 2", curves, free: true, height: 300, ticks: { x: ends, y: ends },
      ranges: { x: range, y: range }, follow: () => [0, []],
    });
  }
}
