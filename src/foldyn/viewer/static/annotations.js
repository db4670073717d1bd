// What is written over a sheet: supports, loads, the chosen node or crease, names, axes and a scale.
// The context is that of a canvas, or of a vector picture.
import { number, readable } from "./numbers.js";

const MOST_MARKS = 60; // supports and arrows in all views, beyond which they are left out
const ROOMY = 320; // pixels of a view, below which marks are smaller
const FONT = "12px system-ui, sans-serif";

// Write over all views of a stage of some size.
export function annotate(context, page, views, { width, height }, tones) {
  const { camera } = page;
  context.font = FONT;
  for (const view of views) {
    const [first] = view.results;
    const size = Math.min(1, Math.max(0.5, view.width / ROOMY)); // of marks
    const pen = { context, camera, tones, size, project: camera.projector(view) };
    const at = (result, node) => pen.project(...result.positions.subarray(3 * node, 3 * node + 3), [0, 0, 0]);
    context.save();
    context.beginPath();
    context.rect(view.x, view.y, view.width, view.height);
    context.clip();
    const few = (marks) => page.marks && marks.length * views.length <= MOST_MARKS;
    const { held, loads, lines, catches } = first.sheet;
    const point = (one) => Array.isArray(one) ? pen.project(...one, [0, 0, 0]) : at(first, one);
    if (few(catches)) catches.forEach((ends) => diamond(pen, ends.map(point)));
    const acts = (from) => from == null || first.sample < from; // until it is released
    if (few(lines)) lines.forEach((line, k) => acts(first.gone?.lines[k]) && polyline(pen, line.map(point)));
    if (few(held)) held.forEach(([node]) => acts(first.gone?.held[node]) && support(pen, at(first, node)));
    if (few(loads)) loads.forEach(([node, force]) => arrow(pen, at(first, node), force));
    if (page.node !== null) {
      for (const result of view.results) dot(pen, at(result, page.node), page.color(result));
      const [x, y] = at(first, page.node);
      words(pen, `node ${page.node}`, x + 10, y - 9, "left");
    }
    if (page.crease !== null) highlight(pen, first, page.crease);
    if (views.length > 1 || view.results.length > 1) {
      const name = view.results.map((result) => page.caption(result)).join(", ");
      words(pen, name, view.x + view.width / 2, view.y + 18, "center");
    }
    context.restore();
  }
  const pen = { context, camera, tones };
  if (views[0].width >= ROOMY) triad(pen, 40, 46, 24);
  else triad(pen, 30, height - 24, 15);
  ruler(pen, views[0], width - 16, height - 14);
}

// An end stop or a latch, at the middle of its crease.
function diamond({ context, tones, size }, [[x0, y0], [x1, y1]]) {
  const [x, y, r] = [0.5 * (x0 + x1), 0.5 * (y0 + y1), 5.5 * size];
  context.beginPath();
  [[r, 0], [0, r], [-r, 0], [0, -r]].forEach(([dx, dy], k) =>
    k ? context.lineTo(x + dx, y + dy) : context.moveTo(x + dx, y + dy));
  context.closePath();
  context.fillStyle = tones.support;
  context.fill();
}

// Springs between nodes, bars and cables.
function polyline(pen, points) {
  pen.context.beginPath();
  points.forEach(([x, y], k) => k ? pen.context.lineTo(x, y) : pen.context.moveTo(x, y));
  cased(pen, pen.tones.support, 1.5);
}

function support({ context, tones, size }, [x, y]) {
  context.beginPath();
  context.moveTo(x, y + 1);
  context.lineTo(x - 5.5 * size, y + 11 * size);
  context.lineTo(x + 5.5 * size, y + 11 * size);
  context.closePath();
  context.fillStyle = tones.support;
  context.fill();
}

function arrow({ context, camera, tones, size }, [x, y], force) {
  const [right, up] = camera.basis;
  const along = (d) => force.reduce((sum, value, k) => sum + value * d[k], 0);
  const [dx, dy] = [34 * size * along(right), -34 * size * along(up)];
  const length = Math.hypot(dx, dy);
  if (length < 3) return;
  const [ux, uy] = [dx / length, dy / length];
  context.strokeStyle = context.fillStyle = tones.load;
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

function dot({ context, tones }, [x, y], color) {
  context.beginPath();
  context.arc(x, y, 5.5, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
  context.lineWidth = 1.5;
  context.strokeStyle = tones.ink;
  context.stroke();
}

function highlight({ context, project, tones }, { sheet, positions }, crease) {
  context.lineWidth = 6;
  context.globalAlpha = 0.55;
  context.strokeStyle = tones.selected;
  for (let k = 0; k < sheet.crease.length; k++) {
    if (sheet.crease[k] !== crease) continue;
    const [from, to] = [sheet.edges[2 * k], sheet.edges[2 * k + 1]].map((node) =>
      project(...positions.subarray(3 * node, 3 * node + 3), [0, 0, 0]));
    context.beginPath();
    context.moveTo(from[0], from[1]);
    context.lineTo(to[0], to[1]);
    context.stroke();
  }
  context.globalAlpha = 1;
}

function words({ context, tones }, text, x, y, align) {
  context.textAlign = align;
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = tones.background;
  context.strokeText(text, x, y);
  context.fillStyle = tones.ink;
  context.fillText(text, x, y);
}

// A line with an edge, to be seen on anything.
function cased({ context, tones }, color, width) {
  for (const [tone, broad] of [[tones.background, width + 2], [color, width]]) {
    context.strokeStyle = tone;
    context.lineWidth = broad;
    context.stroke();
  }
}

function triad(pen, cx, cy, length) {
  const { context, camera } = pen;
  const [right, up] = camera.basis;
  [["x", "#d55e00"], ["y", "#2f8f6f"], ["z", "#2a78b5"]].forEach(([name, color], k) => {
    const [dx, dy] = [length * right[k], -length * up[k]];
    context.beginPath();
    context.moveTo(cx, cy);
    context.lineTo(cx + dx, cy + dy);
    cased(pen, color, 2);
    if (Math.hypot(dx, dy) > 4) words(pen, name, cx + 1.45 * dx, cy + 1.45 * dy + 4, "center");
  });
}

function ruler(pen, view, right, bottom) {
  const { context, camera, tones } = pen;
  const perMeter = camera.perMeter(view);
  const wanted = Math.min(110, 0.3 * view.width) / perMeter;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = [5, 2, 1].find((f) => f * power <= wanted) * power;
  const [factor, unit] = readable(length, "m");
  const left = right - length * perMeter;
  context.beginPath();
  context.moveTo(left, bottom - 5);
  context.lineTo(left, bottom);
  context.lineTo(right, bottom);
  context.lineTo(right, bottom - 5);
  cased(pen, tones.ink, 1.5);
  words(pen, `${number(length * factor)} ${unit}`, (left + right) / 2, bottom - 9, "center");
}
