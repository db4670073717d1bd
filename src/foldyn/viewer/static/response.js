// Frequency responses: amplitude and phase, and the shape at a frequency.
import { AXES, Analysis, SWING, TURNS } from "./analysis.js";
import { greatest } from "./curves.js";
import { number, titled } from "./numbers.js";
import { boxAround } from "./result.js";

export class FrequencyResponse extends Analysis {
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
    const peak = amplitude.indexOf(greatest(amplitude));
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
    if (result.sized !== k) {
      const row = new Float32Array(result.displacement.width);
      result.displacement.row(k, 1, row, false);
      Object.assign(result, { sized: k, reach: greatest(row) || 1 });
    }
    return (SWING * result.sheet.size) / result.reach;
  }

  clock() {
    return `${number(this.page.moment, 4)} Hz`;
  }

  words() {
    return `Shape at ${this.clock()}, swinging once in ${number(1 / TURNS / this.speed)} s.`;
  }

  draw(host) {
    const { page } = this;
    const node = page.node ?? 0;
    const parts = page.shown.map((result) => [result.history(node, page.axis), result.history(node, page.axis, true)]);
    const curves = (value) => page.shown.map((result, k) =>
      page.curve(result, result.moments, parts[k][0].map((re, j) => value(re, parts[k][1][j]))));
    const chart = (what, ylabel, values, log) => this.chart(host, {
      label: `${what} of node ${node}`, xlabel: "frequency (Hz)", ylabel, curves: values, log,
      seek: (frequency) => page.seek(frequency), follow: () => [page.moment],
    });
    const amplitude = titled(`amplitude, ${AXES[page.axis]}`, page.about.unit);
    chart("amplitude", amplitude, curves((re, im) => Math.hypot(re, im) || null), true);
    chart("phase", "phase (°)", curves((re, im) => (Math.atan2(im, re) * 180) / Math.PI), false);
  }
}
