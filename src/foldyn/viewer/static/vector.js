// The picture of the sheets as vectors (SVG), for papers: what can be seen of the panels from back to
// front, lines, and what is written over them.
import { annotate } from "./annotations.js";
import { LOOKS, STOPS, ramp, rgb } from "./colors.js";
import { brightness, owners, raster, softened, strokes } from "./painter.js";

const DENSITY = 2; // pixels for one of the page's, by which it is decided what is hidden

const text = (words) => String(words).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
const place = (value) => String(Math.round(100 * value) / 100);
const hex = (color) => `#${color.map((value) => Math.min(255, Math.round(value)).toString(16).padStart(2, "0")).join("")}`;

// `legend` is drawn below: { height, draw(context, width, top) }.
export function vector(view, page, legend) {
  const { width, height } = view.size;
  const tones = LOOKS[page.theme];
  const pen = new VectorContext();
  const defs = [gradient("sequential"), gradient("diverging")];
  const views = view.views();
  const body = views.map((each, k) => {
    const clip = `v${k}`;
    defs.push(`<clipPath id="${clip}"><rect width="${each.width}" height="${each.height}"/></clipPath>`);
    const layers = view.layers(each).map((layer) => drawn(layer, each, page.camera, defs));
    return `<g transform="translate(${each.x} ${each.y})"><g clip-path="url(#${clip})">${under(page, each)}${layers.join("")}</g></g>`;
  });
  annotate(pen, page, views, view.size, tones);
  legend.draw(pen, width, height);
  const whole = height + legend.height;
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${whole}" viewBox="0 0 ${width} ${whole}">`
    + `<title>${text(page.about.title)}</title><defs>${defs.join("")}</defs>`
    + `<rect width="${width}" height="${whole}" fill="${tones.background}"/>${body.join("")}${pen.done()}</svg>\n`;
}

function under(page, view) {
  const { camera } = page;
  if (!camera.photograph) return "";
  const { factor, left, top } = camera.framed(view);
  const [width, height] = camera.photograph.size.map((pixels) => place(factor * pixels));
  return `<image href="${page.photograph().src}" x="${place(left)}" y="${place(top)}" width="${width}" height="${height}"/>`;
}

function gradient(name) {
  const stops = STOPS[name].map((color, k) => `<stop offset="${k / (STOPS[name].length - 1)}" stop-color="${color}"/>`);
  return `<linearGradient id="${name}">${stops.join("")}</linearGradient>`;
}

function drawn({ sheet, positions, shown, look }, view, camera, defs) {
  const room = raster(sheet, positions, shown, view, camera, look, DENSITY);
  const faces = panels(sheet, positions, shown, room, camera, look, defs);
  const lines = [...strokes(sheet, shown, room, look)].map(({ ends, color, width, dash, opacity }) => {
    const parts = [];
    for (let k = 0; k < ends.length; k += 4) parts.push(`M${place(ends[k])} ${place(ends[k + 1])}L${place(ends[k + 2])} ${place(ends[k + 3])}`);
    return `<path d="${parts.join("")}" stroke="${color}" stroke-width="${place(width)}" stroke-opacity="${opacity}"`
      + `${dash.length ? ` stroke-dasharray="${dash.join(" ")}"` : ""}/>`;
  });
  return `<g opacity="${look.alpha}" stroke-linejoin="round">${faces.join("")}</g><g fill="none">${lines.join("")}</g>`;
}

// Triangles that are seen, the farthest first. A value that changes over a triangle is a gradient.
function panels(sheet, x, shown, { seen, ...room }, camera, look, defs) {
  const { triangles, panel } = sheet;
  const [light, [, , toward]] = [camera.light, camera.basis];
  const corners = (t) => [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
  const far = (t) => corners(t).reduce((sum, a) => sum + seen[a + 2], 0);
  return owners(room).sort((s, t) => far(s) - far(t)).map((t) => {
    const [a, b, c] = corners(t);
    const bright = brightness(x, a, b, c, light, toward);
    const points = [a, b, c].map((k) => [seen[k] / DENSITY, seen[k + 1] / DENSITY]);
    const path = `M${points.map((p) => p.map(place).join(" ")).join("L")}Z`;
    const face = (fill, more = "") => `<path d="${path}" fill="${fill}" stroke="${fill}" stroke-width="0.6"${more}/>`;
    if (shown?.on === "node") {
      const id = `t${defs.length}`;
      defs.push(along(id, points, [a, b, c].map((k) => shown.levels[k / 3]), look.map));
      const dim = 1 - Math.min(1, softened(bright));
      return face(`url(#${id})`) + (dim > 0.004 ? face("#000000", ` opacity="${dim.toFixed(3)}"`) : "");
    }
    const [[px, py], [qx, qy], [rx, ry]] = points;
    const front = (qx - px) * (ry - py) - (qy - py) * (rx - px) < 0; // y is down
    if (shown?.on !== "panel") return face(hex(rgb(front ? look.front : look.back).map((value) => value * bright)));
    const at = 4 * Math.round(255 * Math.min(1, Math.max(0, shown.levels[panel[t / 3]])));
    return face(hex([...RAMPS[look.map].slice(at, at + 3)].map((value) => value * softened(bright))));
  });
}

const RAMPS = { sequential: ramp("sequential"), diverging: ramp("diverging") };

// A gradient over a triangle with levels at its corners, from where they are 0 to where they are 1.
function along(id, [[ax, ay], [bx, by], [cx, cy]], [a, b, c], map) {
  const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) || 1e-9;
  const gx = ((b - a) * (cy - ay) - (c - a) * (by - ay)) / area;
  const gy = ((c - a) * (bx - ax) - (b - a) * (cx - ax)) / area;
  const size = gx * gx + gy * gy;
  const steep = size > 1e-12;
  const [ux, uy] = steep ? [gx / size, gy / size] : [1e4, 0];
  const ends = { x1: ax - a * ux, y1: ay - a * uy, x2: ax + (1 - a) * ux, y2: ay + (1 - a) * uy };
  const places = Object.entries(ends).map(([key, value]) => `${key}="${place(value)}"`);
  return `<linearGradient id="${id}" href="#${map}" gradientUnits="userSpaceOnUse" ${places.join(" ")}/>`;
}

// What `annotate` and the legend use of a canvas' context.
class VectorContext {
  constructor() {
    Object.assign(this, { parts: [], path: "", clips: 0, open: [], globalAlpha: 1, textAlign: "left" });
  }

  save() {
    this.open.push(0);
  }

  restore() {
    this.parts.push("</g>".repeat(this.open.pop()));
  }

  rect(x, y, width, height) {
    this.path += `M${place(x)} ${place(y)}h${place(width)}v${place(height)}h${place(-width)}Z`;
  }

  clip() {
    const id = `c${this.clips++}`;
    this.parts.push(`<clipPath id="${id}"><path d="${this.path}"/></clipPath><g clip-path="url(#${id})">`);
    this.open[this.open.length - 1]++;
  }

  beginPath() {
    this.path = "";
  }

  moveTo(x, y) {
    this.path += `M${place(x)} ${place(y)}`;
  }

  lineTo(x, y) {
    this.path += `L${place(x)} ${place(y)}`;
  }

  closePath() {
    this.path += "Z";
  }

  // A whole circle.
  arc(x, y, radius) {
    const r = place(radius);
    this.path += `M${place(x - radius)} ${place(y)}a${r} ${r} 0 1 0 ${place(2 * radius)} 0a${r} ${r} 0 1 0 ${place(-2 * radius)} 0Z`;
  }

  fill() {
    this.parts.push(`<path d="${this.path}" fill="${this.fillStyle}"/>`);
  }

  stroke() {
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" opacity="${this.globalAlpha}"/>`);
  }

  line(x, y, z, w, color, width, dash) {
    const ends = `x1="${place(x)}" y1="${place(y)}" x2="${place(z)}" y2="${place(w)}"`;
    this.parts.push(`<line ${ends} stroke="${color}" stroke-width="${width}" stroke-dasharray="${dash.join(" ")}"/>`);
  }

  // The colors of values, from the lowest to the highest.
  ramp(map, x, y, width, height) {
    this.parts.push(`<rect x="${x}" y="${y}" width="${width}" height="${height}" fill="url(#${map})"/>`);
  }

  strokeText(words, x, y) {
    this.write(words, x, y, `fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" stroke-linejoin="round"`);
  }

  fillText(words, x, y) {
    this.write(words, x, y, `fill="${this.fillStyle}"`);
  }

  write(words, x, y, look) {
    const anchor = { left: "start", center: "middle", right: "end" }[this.textAlign];
    this.parts.push(`<text x="${place(x)}" y="${place(y)}" text-anchor="${anchor}" font-family="sans-serif" font-size="${parseFloat(this.font.match(/(\d+)px/)[1])}" ${look}>${text(words)}</text>`);
  }

  done() {
    return this.parts.join("");
  }
}
