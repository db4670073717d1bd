// The same sheets without WebGL2, on a 2D canvas: panels are filled pixel by pixel with their depth,
// so that they hide each other rightly even where they cross; lines are drawn by the canvas, faint
// where they lie behind a panel.
import { BAR, BOUNDARY, HIDDEN, KINDS, ramp, rgb } from "./colors.js";

const MOST_PIXELS = 600000; // of the panels' picture; beyond it pixels are larger

const STEP = 3; // pixels between the places of a line that are looked at

export class CanvasPainter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.maps = { sequential: ramp("sequential"), diverging: ramp("diverging") };
    this.layer = document.createElement("canvas");
  }

  sheet(sheet) {
    return { ...sheet, free() {} };
  }

  begin(background, dpr) {
    const { context, canvas } = this;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.fillStyle = background;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(dpr, 0, 0, dpr, 0, 0);
  }

  draw(sheet, positions, shown, view, camera, look) {
    const whole = view.width * view.height * look.dpr ** 2;
    const density = look.dpr * Math.min(1, Math.sqrt(MOST_PIXELS / whole));
    const width = Math.max(1, Math.round(view.width * density));
    const height = Math.max(1, Math.round(view.height * density));
    const seen = this.projected(positions, camera, { x: 0, y: 0, width, height });
    const depth = this.fill(sheet, positions, seen, shown, [width, height], camera, look);
    const { context } = this;
    context.save();
    context.beginPath();
    context.rect(view.x, view.y, view.width, view.height);
    context.clip();
    context.globalAlpha = look.alpha;
    context.drawImage(this.layer, 0, 0, width, height, view.x, view.y, view.width, view.height);
    context.translate(view.x, view.y);
    this.strokes(sheet, seen, shown, { depth, width, height, density, size: camera.size }, look);
    context.restore();
  }

  projected(positions, camera, view) {
    const project = camera.projector(view);
    const out = new Float32Array(positions.length);
    const place = [0, 0, 0];
    for (let k = 0; k < out.length; k += 3) {
      project(positions[k], positions[k + 1], positions[k + 2], place);
      out.set(place, k);
    }
    return out;
  }

  // Paint the panels into the layer and return the depth of each of its pixels.
  fill(sheet, x, seen, shown, [width, height], camera, look) {
    const [right, up, toward] = camera.basis;
    const light = [0, 1, 2].map((k) => -0.35 * right[k] + 0.62 * up[k] + 0.7 * toward[k]);
    const [front, back, map] = [rgb(look.front), rgb(look.back), this.maps[look.map ?? "sequential"]];
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    const depth = new Float32Array(width * height).fill(-Infinity);
    const color = (base, bright) => (0xff000000 | (Math.min(255, base[2] * bright) << 16)
      | (Math.min(255, base[1] * bright) << 8) | Math.min(255, base[0] * bright)) >>> 0;
    const toned = (level, bright) => {
      const at = 4 * Math.round(255 * Math.min(1, Math.max(0, level)));
      return color([map[at], map[at + 1], map[at + 2]], 0.4 + 0.6 * bright);
    };
    const { triangles, panel } = sheet;
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
      const [ax, ay, bx, by] = [seen[a], seen[a + 1], seen[b], seen[b + 1]];
      const [cx, cy] = [seen[c], seen[c + 1]];
      const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
      if (Math.abs(area) < 1e-9) continue;
      const e = [x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]];
      const f = [x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]];
      const n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
      const length = Math.hypot(...n) || 1;
      const along = (d) => Math.abs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) / length;
      const bright = 0.62 + 0.32 * along(light) + 0.1 * along(toward);
      const paper = shown?.on === "panel"
        ? toned(shown.levels[panel[t / 3]], bright)
        : color(area < 0 ? front : back, bright); // y is down
      const levels = shown?.on === "node"
        ? [shown.levels[a / 3], shown.levels[b / 3], shown.levels[c / 3]] : null;
      const top = Math.max(0, Math.ceil(Math.min(ay, by, cy) - 0.5));
      const bottom = Math.min(height - 1, Math.floor(Math.max(ay, by, cy) - 0.5));
      for (let row = top; row <= bottom; row++) {
        const py = row + 0.5;
        let [low, high] = [Infinity, -Infinity];
        for (const [px, qx, pY, qY] of [[ax, bx, ay, by], [bx, cx, by, cy], [cx, ax, cy, ay]]) {
          if ((pY <= py) === (qY <= py)) continue;
          const cut = px + ((py - pY) / (qY - pY)) * (qx - px);
          low = Math.min(low, cut);
          high = Math.max(high, cut);
        }
        const first = Math.max(0, Math.ceil(low - 0.5));
        const last = Math.min(width - 1, Math.floor(high - 0.5));
        for (let column = first; column <= last; column++) {
          const px = column + 0.5;
          const v = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area;
          const w = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area;
          const z = seen[a + 2] + v * (seen[b + 2] - seen[a + 2]) + w * (seen[c + 2] - seen[a + 2]);
          const place = row * width + column;
          if (z <= depth[place]) continue;
          depth[place] = z;
          pixels[place] = levels
            ? toned(levels[0] + v * (levels[1] - levels[0]) + w * (levels[2] - levels[0]), bright)
            : paper;
        }
      }
    }
    Object.assign(this.layer, { width, height });
    this.layer.getContext("2d").putImageData(image, 0, 0);
    return depth;
  }

  strokes(sheet, seen, shown, raster, look) {
    const groups = new Map(); // lines that look alike are one stroke
    const add = (key, style, from, to) => {
      if (!groups.has(key)) groups.set(key, { ...style, path: new Path2D() });
      const { path } = groups.get(key);
      path.moveTo(...from);
      path.lineTo(...to);
    };
    const lines = (ends, kindOf, levelOf) => {
      for (let k = 0; k < ends.length / 2; k++) {
        const kind = kindOf(k);
        const level = levelOf && kind !== BOUNDARY ? levelOf(k) : null;
        const style = this.style(kind, level, look);
        for (const [from, to, hidden] of parts(seen, 3 * ends[2 * k], 3 * ends[2 * k + 1], raster)) {
          if (hidden && look.ghost) continue;
          add(`${hidden} ${kind} ${style.color} ${style.width}`, { ...style, hidden }, from, to);
        }
      }
    };
    if (sheet.bars && shown?.on === "bar") lines(sheet.bars, () => BAR, (k) => shown.levels[k]);
    const told = shown?.on === "crease" ? (k) => shown.levels[sheet.crease[k]] : null;
    lines(sheet.edges, (k) => sheet.kind[k], told);
    const { context } = this;
    for (const { path, color, width, dash, hidden } of groups.values()) {
      context.globalAlpha = look.lines * (hidden ? HIDDEN : 1);
      context.strokeStyle = color;
      context.lineWidth = width;
      context.setLineDash(dash);
      context.stroke(path);
    }
  }

  style(kind, level, look) {
    const { color, width } = look.kinds[kind];
    if (level === null) return { color, width, dash: look.ghost ? [] : KINDS[kind].dash };
    const map = this.maps[look.map ?? "sequential"];
    const at = 4 * Math.round(255 * Math.min(1, Math.max(0, level)));
    const tone = `rgb(${map[at]}, ${map[at + 1]}, ${map[at + 2]})`;
    return { color: tone, width: Math.max(width, 1.5 + 4 * Math.abs(level - 0.5) * width), dash: [] };
  }
}

// Parts of the line between two nodes that are hidden or not, in pixels of the page.
function parts(seen, a, b, { depth, width, height, density, size }) {
  const at = (t) => [0, 1, 2].map((d) => seen[a + d] + t * (seen[b + d] - seen[a + d]));
  const pixels = Math.hypot(seen[b] - seen[a], seen[b + 1] - seen[a + 1]);
  const steps = Math.max(1, Math.min(400, Math.ceil(pixels / STEP)));
  const nearer = 4e-3 * size;
  // Behind all panels around it: steep panels of its own may be nearer on one side.
  const hidden = (t) => {
    const [x, y, z] = at(t);
    const [column, row] = [Math.floor(x), Math.floor(y)];
    if (column < 1 || row < 1 || column >= width - 1 || row >= height - 1) return false;
    for (let r = row - 1; r <= row + 1; r++) {
      for (let c = column - 1; c <= column + 1; c++) {
        if (depth[r * width + c] <= z + nearer) return false;
      }
    }
    return true;
  };
  const place = (t) => at(t).slice(0, 2).map((value) => value / density);
  const found = [];
  for (let k = 0, start = 0, was = null; k <= steps; k++) {
    const now = k < steps ? hidden((k + 0.5) / steps) : null;
    if (was !== null && now !== was) {
      found.push([place(start / steps), place(k / steps), was]);
      start = k;
    }
    was = now;
  }
  return found;
}
