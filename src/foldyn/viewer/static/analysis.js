// What all kinds of results have in common: how time runs, the charts, the words.
import { Chart, keys } from "./charts.js";
import { CURVES, DASHES } from "./colors.js";
import { at, greatest } from "./curves.js";
import { number, readable, titled } from "./numbers.js";
import { Result, boxOfMotion } from "./result.js";

export const SHOWING = 8; // s, that a motion takes on the page
export const TURNS = 0.6; // per second, of what swings
export const SWING = 0.12; // largest motion of what swings, in sizes of the sheet
export const AXES = "xyz";

export class Analysis {
  speeds = [4, 2, 1, 0.5, 0.25];
  speed = 1;
  most = 4; // results that are shown to begin with
  fields = [["displacement", "displacement"]];
  overlays = true;
  curves = true; // charts beside the view
  nodal = true; // of the chosen node
  moves = true;
  hidden = new Set(); // names of curves that a reader has switched off

  constructor(page) {
    this.page = page;
  }

  prepare() {}

  // A result from its description.
  loaded(about, sheet, store) {
    return Result.load(about, sheet, store);
  }

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

  // Put the nodes of a result where they are now; returns their displacements, before the factor.
  move(result, factor) {
    return result.move(this.moment(result), this.page.phase, factor);
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

  // Draw the charts into a place; they are `plots` from then on.
  charts(host) {
    this.plots = [];
    this.draw(host);
    return this.plots;
  }

  // A chart in a new place, with the names of its curves below if there are several, and unless
  // `named` is false. `follow` tells it the moment: its place along the curves, and the curves' points
  // there.
  chart(host, options) {
    const place = document.createElement("div");
    host.append(place);
    const plot = new Chart(place, options);
    plot.follow = () => plot.show(...options.follow(plot));
    if (options.curves.length > 1 && options.named !== false) host.append(keys(plot, this.hidden, this.plots.length));
    this.plots.push(plot);
    return plot;
  }

  // What the charts show, as rows with heads.
  table() {
    const shown = this.plots.flatMap((plot) => plot.shown.map((curve) => [plot, curve]));
    const heads = shown.flatMap(([{ xlabel, ylabel }, { name }]) => [xlabel, `${ylabel} ${name}`]);
    const columns = shown.flatMap(([, { x, y }]) => [x, y]);
    const rows = Math.max(...columns.map((column) => column.length));
    const quoted = heads.map((head) => `"${head.replaceAll('"', "'")}"`);
    return [quoted, ...Array.from({ length: rows }, (_, k) => columns.map((column) => column[k] ?? ""))];
  }

  // The chosen node or crease of the results shown: curves of it over their samples, in a unit that
  // is easily read.
  histories() {
    const { page } = this;
    const turns = page.crease !== null;
    const values = page.shown.map((result) =>
      (turns ? result.fields.turn.values.history(page.crease) : result.history(page.node ?? 0, page.axis)));
    const [factor, unit] = readable(Math.max(...values.map(greatest)), turns ? "°" : "m");
    return { curves: values.map((each) => each.map((value) => value * factor)), unit, label: titled(this.place, unit) };
  }

  get place() {
    const { page } = this;
    return page.crease === null
      ? `node ${page.node ?? 0}, ${AXES[page.axis]}`
      : `turn of crease ${page.crease}`;
  }

  // "Node 8 moved by x 32.6, y −22.5, z −4.76 mm": of the first result, at the moment.
  moved() {
    const { page } = this;
    const [result] = page.shown;
    const moment = this.moment(result);
    if (page.crease !== null) {
      const turn = at(result, result.fields.turn.values.history(page.crease), moment);
      const ends = result.sheet.creases[page.crease].join(" and ");
      return `Crease ${page.crease}, nodes ${ends}, turned by ${number(turn)}° from rest (${page.caption(result)}).`;
    }
    const node = page.node ?? 0;
    const moved = result.moved(moment, page.phase).subarray(3 * node, 3 * node + 3);
    const [factor, unit] = readable(greatest(moved), "m");
    const parts = [...moved].map((value, k) => `${AXES[k]} ${number(value * factor)}`);
    return `Node ${node} moved by ${parts.join(", ")} ${unit} (${page.caption(result)}).`;
  }

  // Energies of one of the results over `x`, at the place `now` along it.
  energies(host, { xlabel, x, seek, now }) {
    const { page } = this;
    const having = page.shown.filter(({ energies }) => Object.keys(energies).length);
    if (!having.length) return;
    const result = having.find(({ name }) => name === this.told) ?? having[0];
    const { energies } = result;
    const names = Object.keys(energies);
    const [factor, unit] = readable(Math.max(...names.map((name) => greatest(energies[name]))), "J");
    const curves = names.map((name, k) => ({
      name, color: CURVES[page.theme][k % 8], dash: DASHES[k % 5], x: x(result),
      y: Float64Array.from(energies[name], (value) => value * factor),
    }));
    this.chart(host, {
      label: `energies, ${result.name}`, xlabel, ylabel: titled("energy", unit), curves, seek,
      follow: () => [now(result)],
    });
    if (having.length > 1) host.append(this.teller(having, result));
  }

  // A choice of the result whose energies are shown.
  teller(results, result) {
    const select = document.createElement("select");
    select.append(...results.map(({ name }) => new Option(name, name, false, name === result.name)));
    select.addEventListener("change", () => {
      this.told = select.value;
      this.page.charts();
    });
    select.dataset.key = "energies";
    const label = document.createElement("label");
    label.className = "told";
    label.append("Energies of ", select);
    return label;
  }
}
