// A sheet at rest.
import { Analysis } from "./analysis.js";

export class Shape extends Analysis {
  fields = [];
  curves = false;
  nodal = false;
  moves = false;

  prepare() {
    this.range = [0, 0];
  }

  advance() {}

  clock() {
    return "";
  }

  words() {
    const { sheet } = this.page.results[0];
    return `${sheet.vertices} vertices, ${sheet.creases.length} creases.`;
  }

  draw() {}
}
