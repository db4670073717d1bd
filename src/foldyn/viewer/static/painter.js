// The same sheets without WebGL2, on a 2D canvas: panels are filled pixel by pixel with their depth,
// so that they hide each other rightly even where they cross; lines are drawn by the canvas, faint
// where they lie behind a panel.
import { BAR, HIDDEN, KINDS, ramp, rgb } from "./colors.js";

const MOST_PIXELS = 600000; // of the panels' picture; beyond it pixels are larger
const STEP = 3; // pixels between the places of a line that are looked at
const NEARER = 4e-3; // of the sheet's size: what is less behind a panel is seen
const NOBODY = 0xffffffff;

export class CanvasPainter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.layer = document.createElement("canvas");
  }

  sheet(sheet) {
    return { ...sheet, free() {} };
  }

  begin(dpr) {
    const { context, canvas } = this;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.setTransform(dpr, 0, 0, dpr, 0, 0);
  }

  draw(sheet, positions, shown, view, camera, look) {
    const whole = view.width * view.height * look.dpr ** 2;
    const density = look.dpr * Math.min(1, Math.sqrt(MOST_PIXELS / whole));
    this.room = raster(sheet, positions, shown, view, camera, look, density, this.room);
    const { context, room } = this;
    const { width, height } = room;
    if (this.layer.width !== width || this.layer.height !== height) Object.assign(this.layer, { width, height });
    this.layer.getContext("2d").putImageData(room.image, 0, 0);
    context.save();
    context.beginPath();
    context.rect(view.x, view.y, view.width, view.height);
    context.clip();
    context.globalAlpha = look.alpha;
    context.drawImage(this.layer, 0, 0, width, height, view.x, view.y, view.width, view.height);
    context.translate(view.x, view.y);
    for (const { ends, color, width: broad, dash, opacity } of strokes(sheet, shown, room, look)) {
      context.globalAlpha = opacity;
      context.strokeStyle = color;
      context.lineWidth = broad;
      context.setLineDash(dash);
      context.beginPath();
      for (let k = 0; k < ends.length; k += 4) {
        context.moveTo(ends[k], ends[k + 1]);
        context.lineTo(ends[k + 2], ends[k + 3]);
      }
      context.stroke();
    }
    context.restore();
  }
}

// A picture of the panels in pixels, `density` for one of the page's, with the depth of each and the
// triangle it shows; in the room of an earlier one of its size, if there is one.
export function raster(sheet, positions, shown, view, camera, look, density, room = null) {
  const width = Math.max(1, Math.round(view.width * density));
  const height = Math.max(1, Math.round(view.height * density));
  const seen = projected(positions, camera, { x: 0, y: 0, width, height }, room?.seen);
  let out = room;
  if (out?.width !== width || out?.height !== height) {
    const image = new ImageData(width, height);
    out = {
      width, height, image, pixels: new Uint32Array(image.data.buffer),
      depth: new Float32Array(width * height), owner: new Uint32Array(width * height),
    };
  }
  Object.assign(out, { seen, density, size: camera.size });
  out.pixels.fill(0);
  out.depth.fill(-Infinity);
  out.owner.fill(NOBODY);
  fill(out, sheet, positions, shown, camera, look);
  return out;
}

function projected(positions, camera, view, room) {
  const project = camera.projector(view);
  const out = room?.length === positions.length ? room : new Float32Array(positions.length);
  const place = [0, 0, 0];
  for (let k = 0; k < out.length; k += 3) {
    project(positions[k], positions[k + 1], positions[k + 2], place);
    out[k] = place[0];
    out[k + 1] = place[1];
    out[k + 2] = place[2];
  }
  return out;
}

// How bright the light makes the paper of a triangle of nodes a, b, c.
export function brightness(x, a, b, c, light, toward) {
  const ex = x[b] - x[a];
  const ey = x[b + 1] - x[a + 1];
  const ez = x[b + 2] - x[a + 2];
  const fx = x[c] - x[a];
  const fy = x[c + 1] - x[a + 1];
  const fz = x[c + 2] - x[a + 2];
  const nx = ey * fz - ez * fy;
  const ny = ez * fx - ex * fz;
  const nz = ex * fy - ey * fx;
  const length = Math.sqrt(nx * nx + ny * ny + nz * nz) || 1;
  const lit = Math.abs(nx * light[0] + ny * light[1] + nz * light[2]);
  const faced = Math.abs(nx * toward[0] + ny * toward[1] + nz * toward[2]);
  return 0.62 + (0.32 * lit + 0.1 * faced) / length;
}

// Of colors for values less is taken away.
export const softened = (bright) => 0.4 + 0.6 * bright;

const TONES = { sequential: ramp("sequential"), diverging: ramp("diverging") };
const toneAt = (level) => 4 * Math.round(255 * Math.min(1, Math.max(0, level)));
const packed = (r, g, b, bright) => (0xff000000 | (Math.min(255, b * bright) << 16)
  | (Math.min(255, g * bright) << 8) | Math.min(255, r * bright)) >>> 0;

function fill({ width, height, pixels, depth, owner, seen }, sheet, x, shown, camera, look) {
  const { triangles, panel } = sheet;
  const { light } = camera;
  const [, , toward] = camera.basis;
  const [front, back] = [rgb(look.front), rgb(look.back)];
  const map = TONES[look.map ?? "sequential"];
  const levels = shown && (shown.on === "node" || shown.on === "panel") ? shown.levels : null;
  const each = levels && shown.on === "node";
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t];
    const b = 3 * triangles[t + 1];
    const c = 3 * triangles[t + 2];
    const ax = seen[a];
    const ay = seen[a + 1];
    const az = seen[a + 2];
    const bx = seen[b];
    const by = seen[b + 1];
    const cx = seen[c];
    const cy = seen[c + 1];
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (Math.abs(area) < 1e-9) continue;
    const top = Math.max(0, Math.ceil(Math.min(ay, by, cy) - 0.5));
    const bottom = Math.min(height - 1, Math.floor(Math.max(ay, by, cy) - 0.5));
    if (top > bottom || Math.max(ax, bx, cx) < 0 || Math.min(ax, bx, cx) > width) continue;
    // over the triangle, depth and level are planes: their slopes along x and y
    const bz = seen[b + 2] - az;
    const cz = seen[c + 2] - az;
    const zx = (bz * (cy - ay) - cz * (by - ay)) / area;
    const zy = (cz * (bx - ax) - bz * (cx - ax)) / area;
    const bright = brightness(x, a, b, c, light, toward);
    const soft = softened(bright);
    let level = 0;
    let lx = 0;
    let ly = 0;
    let paper = 0;
    if (each) {
      level = levels[a / 3];
      const bl = levels[b / 3] - level;
      const cl = levels[c / 3] - level;
      lx = (bl * (cy - ay) - cl * (by - ay)) / area;
      ly = (cl * (bx - ax) - bl * (cx - ax)) / area;
    } else if (levels) {
      const at = toneAt(levels[panel[t / 3]]);
      paper = packed(map[at], map[at + 1], map[at + 2], soft);
    } else {
      const base = area < 0 ? front : back; // y is down
      paper = packed(base[0], base[1], base[2], bright);
    }
    for (let row = top; row <= bottom; row++) {
      const py = row + 0.5;
      let low = Infinity;
      let high = -Infinity;
      if ((ay <= py) !== (by <= py)) low = high = ax + ((py - ay) / (by - ay)) * (bx - ax);
      if ((by <= py) !== (cy <= py)) {
        const cut = bx + ((py - by) / (cy - by)) * (cx - bx);
        low = Math.min(low, cut);
        high = Math.max(high, cut);
      }
      if ((cy <= py) !== (ay <= py)) {
        const cut = cx + ((py - cy) / (ay - cy)) * (ax - cx);
        low = Math.min(low, cut);
        high = Math.max(high, cut);
      }
      const first = Math.max(0, Math.ceil(low - 0.5));
      const last = Math.min(width - 1, Math.floor(high - 0.5));
      const across = first + 0.5 - ax;
      let z = az + zx * across + zy * (py - ay);
      let own = level + lx * across + ly * (py - ay);
      for (let place = row * width + first, end = row * width + last; place <= end; place++, z += zx, own += lx) {
        if (z <= depth[place]) continue;
        depth[place] = z;
        owner[place] = t;
        if (each) {
          const tone = toneAt(own);
          pixels[place] = packed(map[tone], map[tone + 1], map[tone + 2], soft);
        } else pixels[place] = paper;
      }
    }
  }
}

// Triangles (places of their first corners) of which a raster shows something.
export function owners({ owner }) {
  const found = new Set(owner);
  found.delete(NOBODY);
  return [...found];
}

// Lines of a sheet in pixels of the page, those that look alike together: { ends, color, width, dash,
// opacity }.
export function strokes(sheet, shown, room, look) {
  const groups = new Map();
  const lines = (ends, kindOf, levelOf, first, end, opacity) => {
    for (let k = first; opacity > 0 && k < end; k++) {
      const kind = kindOf(k);
      const style = styled(kind, levelOf ? levelOf(k) : null, look);
      parts(room, 3 * ends[2 * k], 3 * ends[2 * k + 1], (x, y, z, w, hidden) => {
        if (hidden && !look.faint) return;
        const key = `${hidden} ${kind} ${style.color} ${style.width}`;
        if (!groups.has(key)) groups.set(key, { ...style, opacity: opacity * (hidden ? HIDDEN : 1), ends: [] });
        groups.get(key).ends.push(x, y, z, w);
      });
    }
  };
  const { bars, edges, inner } = sheet;
  const kind = (k) => sheet.kind[k];
  if (bars && shown?.on === "bar") lines(bars, () => BAR, (k) => shown.levels[k], 0, bars.length / 2, 1);
  lines(edges, kind, shown?.on === "crease" ? (k) => shown.levels[sheet.crease[k]] : null, 0, inner, look.lines);
  lines(edges, kind, null, inner, edges.length / 2, 1);
  return groups.values();
}

function styled(kind, level, look) {
  const { color, width } = look.kinds[kind];
  if (level === null) return { color, width, dash: look.ghost ? [] : KINDS[kind].dash };
  const map = TONES[look.map ?? "sequential"];
  const at = toneAt(level);
  const tone = `rgb(${map[at]}, ${map[at + 1]}, ${map[at + 2]})`;
  return { color: tone, width: Math.max(width, (1.5 + 4 * Math.abs(level - 0.5) * width) * look.fine), dash: [] };
}

// Parts of the line between two nodes that are hidden or not, in pixels of the page.
function parts({ seen, depth, width, height, density, size }, a, b, take) {
  const [ax, ay, az] = [seen[a], seen[a + 1], seen[a + 2]];
  const [dx, dy, dz] = [seen[b] - ax, seen[b + 1] - ay, seen[b + 2] - az];
  const steps = Math.max(1, Math.min(400, Math.ceil(Math.hypot(dx, dy) / STEP)));
  // Behind all panels around it: steep panels of its own may be nearer on one side.
  const hidden = (t) => {
    const column = Math.floor(ax + t * dx);
    const row = Math.floor(ay + t * dy);
    const behind = az + t * dz + NEARER * size;
    if (column < 1 || row < 1 || column >= width - 1 || row >= height - 1) return false;
    for (let r = row - 1; r <= row + 1; r++) {
      for (let c = column - 1; c <= column + 1; c++) {
        if (depth[r * width + c] <= behind) return false;
      }
    }
    return true;
  };
  const put = (from, to, was) => take(
    (ax + from * dx) / density, (ay + from * dy) / density, (ax + to * dx) / density, (ay + to * dy) / density, was,
  );
  let [start, was] = [0, hidden(0.5 / steps)];
  for (let k = 1; k < steps; k++) {
    const now = hidden((k + 0.5) / steps);
    if (now === was) continue;
    put(start / steps, k / steps, was);
    [start, was] = [k, now];
  }
  put(start / steps, 1, was);
}
