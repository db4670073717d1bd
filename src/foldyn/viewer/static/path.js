// Paths of equilibria: the load factor over a displacement, with its stability; where supports move,
// their force takes its place.
import { Analysis, SHOWING } from "./analysis.js";
import { at, between } from "./curves.js";
import { number } from "./numbers.js";

export class Path extends Analysis {
  factor = "load factor";
  dashed = "; dashed where unstable";

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
    const { stable } = result;
    const unstable = stable && (!stable[k] || (part > 0 && !stable[Math.min(k + 1, stable.length - 1)]));
    return `${this.factor} ${number(at(result, result.load, page.moment), 4)}${unstable ? ", unstable" : ""}`;
  }

  words() {
    return `${this.clock()}. ${this.moved()}`;
  }

  draw(host) {
    const { page } = this;
    const { curves: values, label } = this.histories();
    const curves = page.shown.map((result, k) =>
      ({ ...page.curve(result, values[k], [...driven(result)]), stable: result.stable }));
    const { way } = page.shown[0];
    const ylabel = way ? `force of the supports along ${way} (N)` : this.factor;
    this.chart(host, {
      label: `${ylabel} against ${this.place}${this.dashed}`, xlabel: label, ylabel,
      curves, free: true, seek: (k) => page.seek(page.shown[0].moments[k]),
      follow: () => {
        const points = page.shown.map((result, k) =>
          [at(result, values[k], page.moment), at(result, driven(result), page.moment)]);
        return [points[0][0], points];
      },
    });
    const [first] = page.shown;
    this.energies(host, {
      xlabel: "point", x: ({ moments }) => Float64Array.from(moments, (_, k) => k),
      seek: (point) => page.seek(between(first.moments, point)),
      now: (result) => {
        const [k, part] = result.place(page.moment);
        return k + part;
      },
    });
  }
}

function driven(result) {
  return result.force ?? result.load;
}
