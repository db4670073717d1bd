// The sheets in three dimensions, side by side or overlaid, and what is written over them.
import { annotate } from "./annotations.js";
import { Camera, steer } from "./camera.js";
import { CURVES, KINDS, LOOKS } from "./colors.js";
import { GLPainter } from "./gl.js";
import { CanvasPainter } from "./painter.js";

const NEAR = 28; // pixels around a node in which it is taken
const DASH = 10.5; // pixels, of a dash and its gap
const PLAIN = 26; // pixels of an edge, below which lines are finer
const FAINT = 10; // below which they grow faint,
const GONE = 4; // and below which they are not drawn, unless they show values
const MANY = 40000; // ends of edges, beyond which what is hidden does not shine through
const SEE_THROUGH = 0.3; // opacity of panels over a photograph

export class View {
  // page: gives `results` shown, their `levels`, `node`, `look`; is told `pick(node)` and `redraw()`
  constructor(stage, page) {
    Object.assign(this, { stage, page });
    this.canvas = stage.querySelector(".sheet");
    this.over = stage.querySelector(".over");
    this.context = this.over.getContext("2d");
    this.under = stage.querySelector(".under").getContext("2d");
    try {
      if (page.asked.has("plain")) throw new Error("asked to do without");
      this.painter = new GLPainter(this.canvas, page.asked.has("webgl"));
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

  get size() {
    return { width: this.stage.clientWidth, height: this.stage.clientHeight };
  }

  // Rectangles of the stage, each with the results drawn in it.
  views() {
    const { page } = this;
    const { shown } = page;
    const { width, height } = this.size;
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
    for (const canvas of [this.under.canvas, this.canvas, this.over]) {
      canvas.width = Math.round(this.size.width * this.dpr);
      canvas.height = Math.round(this.size.height * this.dpr);
    }
  }

  buffers(sheet) {
    if (!this.made.has(sheet)) this.made.set(sheet, this.painter.sheet(sheet));
    return this.made.get(sheet);
  }

  // Give back what was made for sheets that are shown no more.
  forget() {
    for (const made of this.made.values()) made.free();
    this.made.clear();
  }

  close() {
    this.forget();
    this.painter.gl?.getExtension("WEBGL_lose_context")?.loseContext(); // browsers have few of them
  }

  draw() {
    const { page, painter, camera, dpr, context } = this;
    this.stage.style.background = LOOKS[page.theme].background;
    painter.begin(dpr);
    for (const each of [context, this.under]) {
      each.setTransform(dpr, 0, 0, dpr, 0, 0);
      each.clearRect(0, 0, this.size.width, this.size.height);
    }
    const views = this.views();
    for (const view of views) {
      this.photograph(this.under, view);
      for (const { sheet, positions, shown, look } of this.layers(view)) {
        painter.draw(this.buffers(sheet), positions, shown, view, camera, look);
      }
    }
    annotate(context, page, views, this.size, LOOKS[page.theme]);
  }

  // Sheets that a view draws, the rest shape first: { sheet, positions, shown, look }.
  layers(view) {
    const { page, camera, dpr } = this;
    const tones = LOOKS[page.theme];
    const [{ sheet, shown }] = view.results;
    const perMeter = camera.perMeter(view);
    const edge = perMeter * sheet.edge;
    const fine = Math.min(1, Math.max(0.25, edge / PLAIN));
    const lines = shown?.on === "bar" || shown?.on === "crease" ? 1 : Math.min(1, Math.max(0, (edge - GONE) / (FAINT - GONE)));
    const kinds = KINDS.map((kind) => ({ width: fine * kind.width, color: kind[page.theme] }));
    const look = {
      dpr, front: tones.front, back: tones.back, alpha: camera.photograph ? SEE_THROUGH : 1, lines, kinds, fine,
      ghost: false, faint: sheet.edges.length < MANY, map: page.map, period: DASH / perMeter,
    };
    const own = (result) => {
      const color = CURVES[page.theme][result.index % 8];
      return { ...look, front: color, back: color, alpha: 0.45, kinds: kinds.map((kind) => ({ ...kind, color })) };
    };
    const overlaid = view.results.length > 1;
    const layers = view.results.map((result) => ({
      sheet: result.sheet, positions: result.positions, shown: overlaid ? null : result.shown,
      look: overlaid ? own(result) : look,
    }));
    if (page.ghost) {
      const thin = kinds.map(() => ({ width: fine, color: tones.ghost }));
      const ghost = { ...look, front: tones.ghost, back: tones.ghost, alpha: 0.28, kinds: thin, ghost: true, faint: false };
      layers.unshift({ sheet, positions: sheet.nodes, shown: null, look: ghost });
    }
    return layers;
  }

  // The photograph of the moment, if the camera stands where it was taken.
  photograph(context, view) {
    const { camera, page } = this;
    if (!camera.photograph) return;
    const { factor, left, top } = camera.framed(view);
    const [width, height] = camera.photograph.size;
    context.save();
    context.beginPath();
    context.rect(view.x, view.y, view.width, view.height);
    context.clip();
    context.drawImage(page.photograph(), view.x + left, view.y + top, factor * width, factor * height);
    context.restore();
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
