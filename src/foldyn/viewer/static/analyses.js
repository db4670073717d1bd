// What differs between kinds of results: how time runs, the charts, the words.
import { Chart, keys } from "./charts.js";
import { DASHES, CURVES } from "./colors.js";
import { at, cut, evenly, lastOfInterest } from "./curves.js";
import { number, readable, spectrum, titled } from "./numbers.js";
import { boxAround, boxOfMotion } from "./result.js";

const SPEEDS = [4, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];
const SHOWING = 8; // s, that a motion takes on the page
const TURNS = 0.6; // per second, of what swings
const SWING = 0.12; // largest motion of what swings, in sizes of the sheet
const AXES = "xyz";

class Analysis {
  speeds = [4, 2, 1, 0.5, 0.25];
  speed = 1;
  most = 4; // results that are shown to begin with
  fields = [["displacement", "displacement"]];
  overlays = true;
  histories = true;
  curves = true;

  constructor(page) {
    this.page = page;
  }

  prepare() {}

  box(results) {
    return boxOfMotion(results, this.page.scale);
  }

  pace(speed) {
    return `${speed} ×`;
  }

  caption(result) {
    return result.name;
  }

  moment() {
    return this.page.moment;
  }

  swing() {
    return 1;
  }

  // Part of the range that has passed, and the moment at one.
  get part() {
    const [low, high] = this.range;
    return (this.page.moment - low) / (high - low || 1);
  }

  at(part) {
    const [low, high] = this.range;
    return low + part * (high - low);
  }

  // A chart in a new place, with the names of its curves below if there are several.
  chart(host, options) {
    const place = document.createElement("div");
    host.append(place);
    const plot = new Chart(place, options);
    if (options.curves.length > 1) host.append(keys(options.curves));
    return plot;
  }

  table() {
    const heads = this.plots.flatMap(({ plot, xlabel, ylabel }) =>
      plot.curves.flatMap(({ name }) => [xlabel, `${ylabel} ${name}`]));
    const columns = this.plots.flatMap(({ plot }) => plot.curves.flatMap(({ x, y }) => [x, y]));
    const rows = Math.max(...columns.map((column) => column.length));
    const quoted = heads.map((head) => `"${head.replaceAll('"', "'")}"`);
    return [quoted, ...Array.from({ length: rows }, (_, k) => columns.map((column) => column[k] ?? ""))];
  }

  // Values of the chosen node or crease of a result at all samples, and what they are.
  chosen(result) {
    const { page } = this;
    if (page.crease !== null && result.fields.fold_angle) {
      return { values: result.fields.fold_angle.values.history(page.crease), unit: "°", name: this.place };
    }
    return { values: result.history(page.node ?? 0, page.axis), unit: "m", name: this.place };
  }

  get place() {
    const { page } = this;
    return page.crease === null
      ? `node ${page.node ?? 0}, ${AXES[page.axis]}`
      : `dihedral of crease ${page.crease}`;
  }

  // "node 8 moved by x 32.6, y −22.5, z −4.76 mm": of the first result, at the moment.
  moved() {
    const { page } = this;
    const [result] = page.shown;
    const node = page.node ?? 0;
    const moved = result.moved(this.moment(result), page.phase).subarray(3 * node, 3 * node + 3);
    const [factor, unit] = readable(Math.max(...moved.map(Math.abs)), "m");
    const parts = [...moved].map((value, k) => `${AXES[k]} ${number(value * factor)}`);
    return `Node ${node} moved by ${parts.join(", ")} ${unit} (${page.caption(result)}).`;
  }
}

class Motion extends Analysis {
  fields = [["displacement", "displacement"], ["speed", "speed"]];

  prepare() {
    const { results } = this.page;
    this.range = [
      Math.min(...results.map(({ moments }) => moments[0])),
      Math.max(...results.map(({ moments }) => moments.at(-1))),
    ];
    const wanted = (this.range[1] - this.range[0]) / SHOWING;
    const off = (speed) => Math.abs(Math.log(wanted / speed));
    this.speeds = SPEEDS;
    this.speed = SPEEDS.reduce((best, speed) => (off(speed) < off(best) ? speed : best));
    this.digits = Math.max(2, Math.min(6, 3 - Math.floor(Math.log10(this.range[1] - this.range[0] || 1))));
  }

  pace(speed) {
    if (speed === 1) return "real";
    return speed > 1 ? `${speed} × real` : `1/${Math.round(1 / speed)} of real`;
  }

  advance(seconds) {
    const [low, high] = this.range;
    const next = this.page.moment + seconds * this.speed;
    this.page.moment = next > high ? low : next;
  }

  clock() {
    return `t = ${this.page.moment.toFixed(this.digits)} s`;
  }

  words() {
    return `${this.clock()}. ${this.moved()}`;
  }

  charts(host) {
    const { page } = this;
    const chosen = page.shown.map((result) => this.chosen(result));
    const top = Math.max(...chosen.flatMap(({ values }) => [values.reduce((a, b) => Math.max(a, Math.abs(b)), 0)]));
    const [factor, unit] = readable(top, chosen[0].unit);
    const seek = (time) => page.seek(time);
    const curves = page.shown.map((result, k) =>
      page.curve(result, result.moments, chosen[k].values.map((value) => value * factor)));
    const ylabel = titled(chosen[0].name, unit);
    const history = this.chart(host, {
      label: `${this.place} over time`, xlabel: "time (s)", ylabel, curves, seek,
    });
    history.follow = () => history.show(page.moment, page.shown.map((result, k) => at(result, curves[k].y, page.moment)));
    this.plots = [{ plot: history, xlabel: "time (s)", ylabel }];
    const plots = [history];
    const even = page.shown.filter(({ moments }) => evenly(moments));
    if (even.length === page.shown.length && even[0].moments.length > 16) {
      const spectra = page.shown.map((result, k) => {
        const { moments } = result;
        const dt = (moments.at(-1) - moments[0]) / (moments.length - 1);
        return page.curve(result, ...spectrum(curves[k].y, dt));
      });
      const most = Math.max(...spectra.map(lastOfInterest));
      const plot = this.chart(host, {
        label: `spectrum of ${this.place}`, xlabel: "frequency (Hz)", ylabel: titled("amplitude", unit),
        curves: spectra.map((curve) => cut(curve, most)),
      });
      this.plots.push({ plot, xlabel: "frequency (Hz)", ylabel: titled("amplitude", unit) });
      plots.push(plot);
    }
    const energies = energyChart(this, host, page.shown[0], "time (s)", page.shown[0].moments, seek);
    if (energies) plots.push(energies);
    return plots;
  }
}

class Path extends Analysis {
  prepare() {
    this.range = [0, Math.max(...this.page.results.map(({ moments }) => moments.at(-1)))];
  }

  advance(seconds) {
    const [low, high] = this.range;
    const next = this.page.moment + (seconds * this.speed * (high - low)) / SHOWING;
    this.page.moment = next > high ? low : next;
  }

  clock() {
    const { page } = this;
    const [result] = page.shown;
    const [k, part] = result.place(page.moment);
    const unstable = result.stable && !(result.stable[k] && result.stable[Math.min(k + 1, result.stable.length - 1)] || part === 0 && result.stable[k]);
    return `load factor ${number(at(result, result.load, page.moment), 4)}${unstable ? ", unstable" : ""}`;
  }

  words() {
    return `${this.clock()}. ${this.moved()}`;
  }

  charts(host) {
    const { page } = this;
    const chosen = page.shown.map((result) => this.chosen(result));
    const top = Math.max(...chosen.map(({ values }) => values.reduce((a, b) => Math.max(a, Math.abs(b)), 0)));
    const [factor, unit] = readable(top, chosen[0].unit);
    const curves = page.shown.map((result, k) => ({
      ...page.curve(result, chosen[k].values.map((value) => value * factor), [...result.load]),
      stable: result.stable,
    }));
    const xlabel = titled(chosen[0].name, unit);
    const plot = this.chart(host, {
      label: `load factor against ${this.place}; dashed where unstable`, xlabel, ylabel: "load factor",
      curves, free: true, seek: (k) => page.seek(page.shown[0].moments[k]),
    });
    plot.follow = () => {
      const [result] = page.shown;
      plot.show(at(result, curves[0].x, page.moment), [at(result, curves[0].y, page.moment)]);
    };
    this.plots = [{ plot, xlabel, ylabel: "load factor" }];
    const [result] = page.shown;
    const steps = Float64Array.from(result.moments, (_, k) => k);
    const seek = (step) => page.seek(at({ place: () => [Math.floor(step), step % 1] }, result.moments, 0));
    const energies = energyChart(this, host, result, "point", steps, seek, () => {
      const [k, part] = result.place(page.moment);
      return k + part;
    });
    return energies ? [plot, energies] : [plot];
  }
}

class Modes extends Analysis {
  most = 6;
  overlays = false;
  histories = false;
  curves = false;

  prepare() {
    this.range = [0, 1];
  }

  box(results) {
    return boxAround(results, SWING);
  }

  caption(result) {
    return `${result.name}: ${number(result.frequency, 4)} Hz`;
  }

  moment(result) {
    return result.mode;
  }

  // Shapes are as large as their greatest motion lets them be seen.
  swing(result) {
    return (SWING * result.sheet.size * Math.sin(this.page.phase)) / (result.largest || 1);
  }

  get part() {
    return (this.page.phase / (2 * Math.PI)) % 1;
  }

  at(part) {
    this.page.phase = 2 * Math.PI * part;
    return 0;
  }

  advance(seconds) {
    this.page.phase += 2 * Math.PI * TURNS * this.speed * seconds;
  }

  clock() {
    return "in step, not at their own speeds";
  }

  words() {
    const names = this.page.shown.map((result) => `${this.caption(result)}, ${result.what}`);
    return `Modes ${names.join("; ")}.`;
  }

  // The modes as a table with a box to show each.
  charts(host) {
    const table = document.createElement("table");
    const row = (cells, tag) => {
      const line = table.insertRow();
      for (const cell of cells) {
        const place = document.createElement(tag);
        place.append(cell);
        line.append(place);
      }
    };
    row(["", "mode", "Hz", "damping", "what it does"], "th");
    for (const result of this.page.results) {
      const check = this.page.check(result);
      check.setAttribute("aria-label", `show mode ${result.name}`);
      const damping = result.damping === null ? "" : `${number(100 * result.damping)} %`;
      row([check, result.name, number(result.frequency, 4), damping, result.what], "td");
    }
    host.append(table);
    return [];
  }
}

class FrequencyResponse extends Analysis {
  speeds = [2, 1, 0.5, 0.25];

  prepare() {
    const { results } = this.page;
    this.range = [
      Math.min(...results.map(({ moments }) => moments[0])),
      Math.max(...results.map(({ moments }) => moments.at(-1))),
    ];
    const [first] = results;
    const { node, axis } = this.page;
    const imaginary = first.history(node ?? 0, axis, true);
    const amplitude = first.history(node ?? 0, axis).map((re, k) => Math.hypot(re, imaginary[k]));
    const peak = amplitude.indexOf(amplitude.reduce((a, b) => Math.max(a, b), 0));
    this.page.moment = first.moments[Math.max(peak, 0)];
  }

  box(results) {
    return boxAround(results, SWING);
  }

  advance(seconds) {
    this.page.phase += 2 * Math.PI * TURNS * this.speed * seconds;
  }

  // The shape at a frequency is as large as can be seen.
  swing(result) {
    const [k] = result.place(this.page.moment);
    const row = (this.row ??= new Float32Array(result.displacement.width));
    if (this.sized !== `${result.index} ${k}`) {
      result.displacement.row(k, 1, row, false);
      this.greatest = row.reduce((top, value) => Math.max(top, Math.abs(value)), 0) || 1;
      this.sized = `${result.index} ${k}`;
    }
    return (SWING * result.sheet.size) / this.greatest;
  }

  clock() {
    return `${number(this.page.moment, 4)} Hz`;
  }

  words() {
    return `Shape at ${this.clock()}, swinging once in ${number(1 / TURNS / this.speed)} s.`;
  }

  charts(host) {
    const { page } = this;
    const node = page.node ?? 0;
    const parts = page.shown.map((result) => [result.history(node, page.axis), result.history(node, page.axis, true)]);
    const seek = (frequency) => page.seek(frequency);
    const ylabel = titled(`amplitude, ${AXES[page.axis]}`, page.about.unit);
    const amplitude = page.shown.map((result, k) =>
      page.curve(result, result.moments, parts[k][0].map((re, j) => Math.hypot(re, parts[k][1][j]) || null)));
    const phase = page.shown.map((result, k) =>
      page.curve(result, result.moments, parts[k][0].map((re, j) => (Math.atan2(parts[k][1][j], re) * 180) / Math.PI)));
    this.plots = [
      [`amplitude of node ${node}`, ylabel, amplitude, true],
      [`phase of node ${node}`, "phase (°)", phase, false],
    ].map(([label, text, curves, log]) => ({
      plot: this.chart(host, { label, xlabel: "frequency (Hz)", ylabel: text, curves, seek, log }),
      xlabel: "frequency (Hz)", ylabel: text,
    }));
    return this.plots.map(({ plot }) => {
      plot.follow = () => plot.show(page.moment);
      return plot;
    });
  }
}

export const ANALYSES = { motion: Motion, path: Path, modes: Modes, response: FrequencyResponse };

function energyChart(analysis, host, result, xlabel, x, seek, place = () => analysis.page.moment) {
  const names = Object.keys(result.energies);
  if (!names.length) return null;
  const { page } = analysis;
  const top = Math.max(...names.map((name) => result.energies[name].reduce((a, b) => Math.max(a, Math.abs(b)), 0)));
  const [factor, unit] = readable(top, "J");
  const curves = names.map((name, k) => ({
    name, color: CURVES[page.theme][k % 8], dash: DASHES[k % 5], x,
    y: Float64Array.from(result.energies[name], (value) => value * factor),
  }));
  const ylabel = titled("energy", unit);
  const plot = analysis.chart(host, { label: `energies, ${result.name}`, xlabel, ylabel, curves, seek });
  if (page.results.length > 1) host.lastChild.prepend(`${result.name}: `);
  plot.follow = () => plot.show(place());
  analysis.plots.push({ plot, xlabel, ylabel });
  return plot;
}
