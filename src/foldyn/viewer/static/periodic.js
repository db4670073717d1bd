// Periodic motions: a response curve or a backbone, and the motion at a point of it.
import { AXES, Analysis, TURNS } from "./analysis.js";
import { CURVES } from "./colors.js";
import { greatest } from "./curves.js";
import { number, readable, titled } from "./numbers.js";
import { Result, boxAround } from "./result.js";

const REACH = 0.1; // largest displacement that needs no enlargement, in sizes of the sheet
const SAMPLES = 128; // of a period in charts
const MARKS = { // their sides, how they are turned, and their letters
  fold: [24, 0, "○"], pitchfork: [4, Math.PI / 4, "□"], "period doubling": [4, 0, "◇"],
  "Neimark-Sacker": [3, -Math.PI / 2, "△"],
};

// The motions of a curve: its points are the moments.
class Orbits extends Result {
  get rows() {
    return this.displacement.samples / this.x.length;
  }

  // Displacements (3n) of the motion at a point, at a phase of the drive.
  moved(point, phase) {
    const { displacement, room, rows } = this;
    const size = this.sizes[point];
    const angle = phase / this.periods[point];
    displacement.row(point * rows, size, room, false);
    for (let j = 1; j < rows; j++) displacement.row(point * rows + j, size * wave(j, angle), room, true);
    return room;
  }

  // Displacement of a node along an axis over a period of the motion at a point.
  cycle(point, node, axis) {
    if (this.node !== node || this.axis !== axis) Object.assign(this, { node, axis, values: this.history(node, axis) });
    const { rows, values } = this;
    return Array.from({ length: SAMPLES + 1 }, (_, k) => {
      const angle = (2 * Math.PI * k) / SAMPLES;
      let sum = 0;
      for (let j = 0; j < rows; j++) sum += values[point * rows + j] * wave(j, angle);
      return this.sizes[point] * sum;
    });
  }

  // The point nearest to a place of the chart.
  nearest(x, y) {
    const [wide, high] = [(greatest(this.x) - Math.min(...this.x)) || 1, greatest(this.y) || 1];
    const apart = (k) => Math.hypot((this.x[k] - x) / wide, (this.y[k] - y) / high);
    return this.x.reduce((best, _, k) => (apart(k) < apart(best) ? k : best), 0);
  }
}

// Function of a coefficient: 1, cos, sin, cos 2, sin 2, ...
function wave(j, angle) {
  const turned = Math.ceil(j / 2) * angle;
  return j % 2 || !j ? Math.cos(turned) : Math.sin(turned);
}

export class Periodic extends Analysis {
  speeds = [2, 1, 0.5, 0.25];

  async loaded(about, sheet, store) {
    const [x, y, sizes] = await Promise.all(["x", "y", "sizes"].map((name) => store.get(about[name])));
    const displacement = await store.changing(about.displacement);
    const result = new Orbits(about, sheet, { x, y, sizes, displacement, fields: {}, energies: {} });
    result.largest = greatest(sizes);
    return result;
  }

  // It begins at the largest stable motion; all are enlarged by one factor, if they are small.
  prepare() {
    const { page } = this;
    const [{ y, stable, bifurcations }] = page.results;
    const lasting = y.map((value, k) => (stable[k] === false || bifurcations[k] ? -1 : value));
    page.moment ??= lasting.indexOf(Math.max(...lasting));
    if (page.ready) return;
    const wanted = Math.min(...page.results.map(({ sheet, largest }) => (REACH * sheet.size) / (largest || 1)));
    const power = Math.floor(Math.log10(wanted));
    const digit = [5, 2, 1].find((one) => one * 10 ** power <= wanted);
    page.scale = Math.min(1000, Math.max(1, digit * 10 ** power));
  }

  box(results) {
    return boxAround(results, this.page.scale * Math.max(...results.map(({ sheet, largest }) => largest / sheet.size)));
  }

  // The result at whose curve a reader has pointed; others show the nearest of their motions.
  get leader() {
    const { shown } = this.page;
    return shown.find(({ index }) => index === this.led) ?? shown[0];
  }

  get range() {
    return [0, this.leader.x.length - 1];
  }

  moment(result) {
    const { leader } = this;
    const point = Math.min(Math.round(this.page.moment), leader.x.length - 1);
    return result === leader ? point : result.nearest(leader.x[point], leader.y[point]);
  }

  advance(seconds) {
    this.page.phase += 2 * Math.PI * TURNS * this.speed * seconds;
  }

  clock() {
    const { leader, page: { about } } = this;
    const point = this.moment(leader);
    const kind = leader.bifurcations[point] || { true: "stable", false: "unstable" }[leader.stable[point]];
    const where = about.hertz ? `${number(leader.x[point], 4)} Hz` : `factor ${number(leader.x[point], 4)}`;
    return [where, ...(kind ? [kind] : [])].join(", ");
  }

  words() {
    const { leader, page: { about } } = this;
    const point = this.moment(leader);
    const [factor, unit] = readable(leader.y[point], about.measured);
    const twice = leader.periods[point] > 1 ? `, repeats after ${leader.periods[point]} periods of the drive` : "";
    const branch = leader.branches[point] ? `, branch ${leader.branches[point]}` : "";
    return `${this.clock()}${branch}${twice}: ${about.measure} ${number(leader.y[point] * factor)} ${unit}. ${this.moved()}`;
  }

  draw(host) {
    this.curve(host);
    this.period(host);
  }

  curve(host) {
    const { page } = this;
    const { about, shown } = page;
    const [factor, unit] = readable(Math.max(...shown.map(({ y }) => greatest(y))), about.measured);
    const curves = shown.flatMap((result) => branches(result).map(([number, first, last]) => {
      const part = (values) => Array.from(values).slice(first, last);
      const names = part(result.bifurcations);
      const own = number ? `branch ${number}` : "curve";
      return {
        name: shown.length > 1 ? `${result.name}${number ? `, ${own}` : ""}` : own, result, first, last,
        color: CURVES[page.theme][(shown.length > 1 ? result.index : number) % 8], dash: [],
        x: part(result.x), y: part(result.y).map((value) => value * factor),
        stable: part(result.stable).map((stable, k) => stable !== false || names[k] !== ""), // neither at bifurcations
        marks: names.flatMap((name, k) => (MARKS[name] ? [[k, ...MARKS[name]]] : [])),
      };
    }));
    this.chart(host, {
      label: `${about.measure} over the ${about.along}; dashed where unstable`, xlabel: about.along,
      ylabel: titled(about.measure, unit), curves, free: true, all: true, height: 330,
      seek: (k, j) => {
        this.led = curves[j].result.index;
        page.seek(curves[j].first + k);
      },
      follow: () => [0, curves.map(({ result, first, last, x, y }) => {
        const k = this.moment(result);
        return k >= first && k < last ? [x[k - first], y[k - first]] : [NaN, NaN];
      })],
    });
    const found = Object.keys(MARKS).filter((name) => shown.some(({ bifurcations }) => bifurcations.includes(name)));
    const notes = found.map((name) => `${MARKS[name][2]} ${name}`);
    if (shown.some(({ stable }) => stable.includes(false))) notes.push("dashed: unstable");
    const told = Object.assign(document.createElement("p"), { className: "told" });
    told.textContent = ["Click a point of a curve to see its motion", ...notes].join("; ");
    host.append(told);
  }

  // The chosen node over a period, of the motion shown.
  period(host) {
    const { page } = this;
    const { about, shown } = page;
    const node = page.node ?? 0;
    const [factor, unit] = readable(Math.max(...shown.map(({ largest }) => largest)), "m");
    const curves = () => shown.map((result) => {
      const point = this.moment(result);
      const values = result.cycle(point, node, page.axis);
      const x = values.map((_, k) => (result.periods[point] * k) / SAMPLES);
      return page.curve(result, x, values.map((value) => value * factor));
    });
    let drawn = this.moment(shown[0]);
    this.chart(host, {
      label: `node ${node} over a period`, xlabel: about.driven ? "periods of the drive" : "periods",
      ylabel: titled(`node ${node}, ${AXES[page.axis]}`, unit), curves: curves(),
      follow: (plot) => {
        const point = this.moment(shown[0]);
        if (point !== drawn) plot.put(curves());
        drawn = point;
        const turns = page.phase / (2 * Math.PI) / shown[0].periods[point];
        return [shown[0].periods[point] * (turns - Math.floor(turns))];
      },
    });
  }
}

// Branches of a result: their number, the first point, and the one after the last.
function branches({ branches: of }) {
  const starts = of.flatMap((number, k) => (k && of[k - 1] === number ? [] : [k]));
  return starts.map((first, k) => [of[first], first, starts[k + 1] ?? of.length]);
}
