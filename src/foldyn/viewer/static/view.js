// The sheets in three dimensions, side by side or overlaid, and what is written over them.
import { Camera, steer } from "./camera.js";
import { CURVES, KINDS, LOOKS } from "./colors.js";
import { GLPainter } from "./gl.js";
import { number, readable } from "./numbers.js";
import { CanvasPainter } from "./painter.js";

const NEAR = 28; // pixels around a node in which it is taken
const DASH = 10.5; // pixels, of a dash and its gap
const MOST_WORDS = 60; // supports and arrows in all views, beyond which they are left out

export class View {
  // page: gives `results` shown, their `levels`, `node`, `look`; is told `pick(node)` and `redraw()`
  constructor(stage, page) {
    Object.assign(this, { stage, page });
    this.canvas = stage.querySelector(".sheet");
    this.over = stage.querySelector(".over");
    this.context = this.over.getContext("2d");
    try {
      if (page.plain) throw new Error("asked to do without");
      this.painter = new GLPainter(this.canvas);
      this.canvas.addEventListener("webglcontextlost", () => this.withoutGL());
    } catch {
      this.withoutGL();
    }
    this.camera = new Camera(page.about.view);
    this.made = new Map();
    steer(this.over, this.camera, {
      view: (x, y) => this.at(x, y),
      changed: () => page.redraw(),
      tapped: (x, y) => this.pick(x, y),
    });
  }

  get kind() {
    return this.painter instanceof GLPainter ? "webgl" : "canvas";
  }

  withoutGL() {
    const fresh = this.canvas.cloneNode(); // a canvas keeps its first kind of context
    this.canvas.replaceWith(fresh);
    this.canvas = fresh;
    this.painter = new CanvasPainter(fresh);
    this.made?.clear();
    if (this.page.ready) this.resize();
  }

  // Rectangles of the stage, each with the results drawn in it.
  views() {
    const { page, stage } = this;
    const shown = page.shown;
    const [width, height] = [stage.clientWidth, stage.clientHeight];
    if (page.layout === "over" || shown.length < 2) {
      return [{ x: 0, y: 0, width, height, results: shown }];
    }
    const columns = best(shown.length, width / height);
    const rows = Math.ceil(shown.length / columns);
    return shown.map((result, k) => ({
      x: Math.round(((k % columns) * width) / columns),
      y: Math.round((Math.floor(k / columns) * height) / rows),
      width: Math.round(width / columns), height: Math.round(height / rows), results: [result],
    }));
  }

  at(x, y) {
    const inside = (v) => x >= v.x && x < v.x + v.width && y >= v.y && y < v.y + v.height;
    return this.views().find(inside) ?? this.views()[0];
  }

  resize() {
    this.dpr = Math.min(2, devicePixelRatio || 1);
    for (const canvas of [this.canvas, this.over]) {
      canvas.width = Math.round(this.stage.clientWidth * this.dpr);
      canvas.height = Math.round(this.stage.clientHeight * this.dpr);
    }
  }

  buffers(sheet) {
    if (!this.made.has(sheet)) this.made.set(sheet, this.painter.sheet(sheet));
    return this.made.get(sheet);
  }

  draw() {
    const { page, painter, camera, dpr } = this;
    const tones = LOOKS[page.theme];
    painter.begin(tones.background, dpr);
    const kinds = KINDS.map((kind) => ({ width: kind.width, color: kind[page.theme] }));
    const thin = kinds.map((kind) => ({ width: 1, color: tones.ghost }));
    const { context } = this;
    context.setTransform(dpr, 0, 0, dpr, 0, 0);
    context.clearRect(0, 0, this.over.width, this.over.height);
    const views = this.views();
    for (const view of views) {
      const overlaid = view.results.length > 1;
      const look = {
        dpr, front: tones.front, back: tones.back, alpha: 1, lines: 1, kinds, ghost: false,
        map: page.map,
        period: (DASH * camera.extent(view.width / view.height)) / (view.height / 2),
      };
      const ghost = { ...look, front: tones.ghost, back: tones.ghost, alpha: 0.28, kinds: thin, ghost: true };
      if (page.ghost) {
        const { sheet } = view.results[0];
        painter.draw(this.buffers(sheet), sheet.nodes, null, view, camera, ghost);
      }
      for (const result of view.results) {
        const own = CURVES[page.theme][result.index % 8];
        const tinted = overlaid
          ? { ...look, front: own, back: own, alpha: 0.45, kinds: kinds.map((kind) => ({ ...kind, color: own })) }
          : look;
        const levels = overlaid ? null : result.shown;
        painter.draw(this.buffers(result.sheet), result.positions, levels, view, camera, tinted);
      }
      this.annotate(view, tones, views.length);
    }
  }

  annotate(view, tones, count) {
    const { context, camera, page } = this;
    const project = camera.projector(view);
    const place = (result, node) => {
      const [x, y, z] = result.positions.subarray(3 * node, 3 * node + 3);
      return project(x, y, z, [0, 0, 0]);
    };
    context.save();
    context.beginPath();
    context.rect(view.x, view.y, view.width, view.height);
    context.clip();
    context.font = "12px system-ui, sans-serif";
    const [first] = view.results;
    if (page.marks && first.sheet.held.length * count <= MOST_WORDS) {
      for (const [node] of first.sheet.held) this.support(place(first, node), tones.support);
    }
    if (page.marks && first.sheet.loads.length * count <= MOST_WORDS) {
      for (const [node, force] of first.sheet.loads) this.arrow(place(first, node), force, tones.load);
    }
    if (page.node !== null) {
      for (const result of view.results) {
        const [x, y] = place(result, page.node);
        context.beginPath();
        context.arc(x, y, 5.5, 0, 7);
        context.fillStyle = page.color(result);
        context.fill();
        context.lineWidth = 1.5;
        context.strokeStyle = tones.ink;
        context.stroke();
      }
      const [x, y] = place(first, page.node);
      this.words(`node ${page.node}`, x + 10, y - 9, tones, "left");
    }
    if (page.crease !== null) this.highlight(first, project, tones);
    if (count > 1 || view.results.length > 1) {
      const name = view.results.map((result) => page.caption(result)).join(", ");
      this.words(name, view.x + view.width / 2, view.y + 18, tones, "center");
    }
    if (view.x === 0 && view.y === 0) this.triad(view, tones);
    if (view.y === 0 && view.x + view.width >= this.stage.clientWidth - 1) this.ruler(view, tones);
    context.restore();
  }

  support([x, y], color) {
    const { context } = this;
    context.beginPath();
    context.moveTo(x, y + 1);
    context.lineTo(x - 5.5, y + 11);
    context.lineTo(x + 5.5, y + 11);
    context.closePath();
    context.fillStyle = color;
    context.fill();
  }

  arrow([x, y], force, color) {
    const { context, camera } = this;
    const [right, up] = camera.basis;
    const dot = (d) => force.reduce((sum, value, k) => sum + value * d[k], 0);
    const [dx, dy] = [34 * dot(right), -34 * dot(up)];
    const length = Math.hypot(dx, dy);
    if (length < 3) return;
    const [ux, uy] = [dx / length, dy / length];
    context.strokeStyle = context.fillStyle = color;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + dx - 6 * ux, y + dy - 6 * uy);
    context.stroke();
    context.beginPath();
    context.moveTo(x + dx, y + dy);
    context.lineTo(x + dx - 9 * ux - 4 * uy, y + dy - 9 * uy + 4 * ux);
    context.lineTo(x + dx - 9 * ux + 4 * uy, y + dy - 9 * uy - 4 * ux);
    context.fill();
  }

  highlight(result, project, tones) {
    const { context, page } = this;
    const { sheet, positions } = result;
    context.lineWidth = 6;
    context.globalAlpha = 0.55;
    context.strokeStyle = tones.selected;
    for (let k = 0; k < sheet.crease.length; k++) {
      if (sheet.crease[k] !== page.crease) continue;
      const [a, b] = [3 * sheet.edges[2 * k], 3 * sheet.edges[2 * k + 1]];
      const from = project(positions[a], positions[a + 1], positions[a + 2], [0, 0, 0]);
      const to = project(positions[b], positions[b + 1], positions[b + 2], [0, 0, 0]);
      context.beginPath();
      context.moveTo(from[0], from[1]);
      context.lineTo(to[0], to[1]);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  words(text, x, y, tones, align) {
    const { context } = this;
    context.textAlign = align;
    context.lineWidth = 3;
    context.strokeStyle = tones.background;
    context.strokeText(text, x, y);
    context.fillStyle = tones.ink;
    context.fillText(text, x, y);
  }

  triad({ x, y }, tones) {
    const { context, camera } = this;
    const [right, up] = camera.basis;
    const [cx, cy] = [x + 40, y + 46];
    [["x", "#d55e00"], ["y", "#2f8f6f"], ["z", "#2a78b5"]].forEach(([name, color], k) => {
      const [dx, dy] = [24 * right[k], -24 * up[k]];
      context.strokeStyle = color;
      context.lineWidth = 2;
      context.beginPath();
      context.moveTo(cx, cy);
      context.lineTo(cx + dx, cy + dy);
      context.stroke();
      this.words(name, cx + 1.4 * dx, cy + 1.4 * dy + 4, tones, "center");
    });
  }

  ruler(view, tones) {
    const { context, camera } = this;
    const perMeter = view.height / 2 / camera.extent(view.width / view.height);
    const wanted = Math.min(110, 0.3 * view.width) / perMeter;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].find((f) => f * power <= wanted) * power;
    const [factor, unit] = readable(length, "m");
    const [right, top] = [view.x + view.width - 16, view.y + 26];
    context.strokeStyle = tones.ink;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(right - length * perMeter, top - 5);
    context.lineTo(right - length * perMeter, top);
    context.lineTo(right, top);
    context.lineTo(right, top - 5);
    context.stroke();
    this.words(`${number(length * factor)} ${unit}`, right - (length * perMeter) / 2, top - 9, tones, "center");
  }

  // The node next to a place of the stage, or else the crease.
  pick(x, y) {
    const view = this.at(x, y);
    const [result] = view.results;
    const { sheet, positions } = result;
    const project = this.camera.projector(view);
    const place = (node) => project(...positions.subarray(3 * node, 3 * node + 3), [0, 0, 0]);
    const depth = 0.02 * NEAR / this.camera.size; // of two nodes as near, the front one
    let [best, least] = [null, Infinity];
    for (let node = 0; node < sheet.vertices; node++) {
      const [px, py, pz] = place(node);
      const apart = Math.hypot(px - x, py - y);
      const cost = apart - depth * pz;
      if (apart < NEAR / 2 && cost < least) [best, least] = [node, cost];
    }
    if (best !== null) return this.page.pickNode(best);
    for (let k = 0; k < sheet.crease.length; k++) {
      if (sheet.crease[k] >= sheet.creases.length) continue;
      const [a, b] = [place(sheet.edges[2 * k]), place(sheet.edges[2 * k + 1])];
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const part = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1);
      const t = Math.min(1, Math.max(0, part));
      const apart = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
      const cost = apart - depth * (a[2] + t * (b[2] - a[2]));
      if (apart < NEAR / 3 && cost < least) [best, least] = [sheet.crease[k], cost];
    }
    if (best !== null) this.page.pickCrease(best);
  }
}

// Columns that leave the largest views of about 1.4 : 1.
function best(count, aspect) {
  let [columns, size] = [1, 0];
  for (let c = 1; c <= count; c++) {
    const side = Math.min(aspect / c / 1.4, 1 / Math.ceil(count / c));
    if (side > size + 1e-9) [columns, size] = [c, side];
  }
  return columns;
}
