// Motions: histories and spectra of nodes and creases, and energies.
import { Analysis, SHOWING } from "./analysis.js";
import { at, cut, evenly, lastOfInterest } from "./curves.js";
import { spectrum, titled } from "./numbers.js";

const SPEEDS = [4, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];
const SPAN = 3; // decades of spectra

export class Motion extends Analysis {
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

  draw(host) {
    const { page } = this;
    const { curves: values, unit, label } = this.histories();
    const seek = (time) => page.seek(time);
    const curves = page.shown.map((result, k) => page.curve(result, result.moments, values[k]));
    this.chart(host, {
      label: `${this.place} over time`, xlabel: "time (s)", ylabel: label, curves, seek,
      follow: () => [page.moment, page.shown.map((result, k) => [page.moment, at(result, values[k], page.moment)])],
    });
    if (page.shown.every(({ moments }) => moments.length > 16 && evenly(moments))) {
      const spectra = page.shown.map((result, k) => {
        const { moments } = result;
        return page.curve(result, ...spectrum(values[k], (moments.at(-1) - moments[0]) / (moments.length - 1)));
      });
      const most = Math.max(...spectra.map(lastOfInterest));
      this.chart(host, {
        label: `spectrum of ${this.place}`, xlabel: "frequency (Hz)", ylabel: titled("amplitude", unit),
        curves: spectra.map((curve) => cut(curve, most)), log: true, decades: SPAN, follow: () => [],
      });
    }
    this.energies(host, {
      xlabel: "time (s)", x: ({ moments }) => moments, seek, now: () => page.moment,
    });
  }
}
