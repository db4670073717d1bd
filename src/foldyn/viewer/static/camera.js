// An orthographic camera that turns around z, and what fingers, mouse and keys do to it.

const RADIANS = Math.PI / 180;
const MARGIN = 1.12;
const DEEP = 0.25; // of the depth of clip space, for the size of the sheet

export class Camera {
  constructor([elevation, azimuth] = [28, -60]) {
    this.home = { elevation, azimuth };
    this.center = [0, 0, 0];
    this.half = [1, 1, 1];
    this.photograph = null; // or { size, matrix }: the camera of a photograph, see backdrop.py
    this.reset();
  }

  reset() {
    Object.assign(this, this.home, { zoom: 1, pan: [0, 0] });
  }

  // Unit vectors to the right, up and towards the viewer.
  get basis() {
    if (this.photograph) return this.standing();
    const e = this.elevation * RADIANS;
    const a = this.azimuth * RADIANS;
    const toward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return [right, cross(toward, right), toward];
  }

  // Direction to the lamp, which stands with the viewer.
  get light() {
    const [right, up, toward] = this.basis;
    return [0, 1, 2].map((k) => -0.35 * right[k] + 0.62 * up[k] + 0.7 * toward[k]);
  }

  standing() {
    const { rows, forward } = this.seen();
    const toward = forward.map((value) => -value);
    const right = unit(cross(rows[1], forward));
    return [right, cross(toward, right), toward];
  }

  get size() {
    return 2 * Math.hypot(...this.half);
  }

  // Frame a box.
  fit(low, high) {
    this.center = low.map((value, k) => (value + high[k]) / 2);
    this.half = low.map((value, k) => (high[k] - value) / 2);
    const least = 0.02 * Math.max(...this.half, 1e-12);
    this.half = this.half.map((value) => Math.max(value, least));
  }

  // Pixels for a meter at the center of a view.
  perMeter(view) {
    if (!this.photograph) return view.height / 2 / this.extent(view.width / view.height);
    const [right] = this.basis;
    const along = right.reduce((sum, value, k) => sum + value * this.matrix(view)[k], 0);
    return (along * view.width) / 2;
  }

  // Whether a box lies in the frame and fills much of it.
  holds(low, high) {
    const inside = this.center.every((c, k) => c - low[k] <= 1.05 * this.half[k] && high[k] - c <= 1.05 * this.half[k]);
    return inside && Math.hypot(...low.map((value, k) => high[k] - value)) > 0.7 * this.size;
  }

  // Half the height (m) that a view of width / height = aspect shows.
  extent(aspect) {
    const [right, up] = this.basis;
    const reach = (d) => d.reduce((sum, value, k) => sum + Math.abs(value) * this.half[k], 0);
    return (MARGIN * Math.max(reach(up), reach(right) / aspect)) / this.zoom;
  }

  // Rows (4 x 4) from a position relative to the center (m, 1) to clip coordinates times their last:
  // x to the right, y up, and depth.
  matrix(view) {
    return this.photograph ? this.matched(view) : this.orthographic(view);
  }

  orthographic({ width, height }) {
    const [r, u, t] = this.basis;
    const half = this.extent(width / height);
    const row = (d, factor, shift) => [...d.map((value) => factor * value), -factor * shift];
    return [
      ...row(r, height / width / half, this.pan[0]), ...row(u, 1 / half, this.pan[1]),
      ...row(t, -DEEP / this.size, 0), 0, 0, 0, 1,
    ];
  }

  // As in the photograph, whose pixels have their centers at whole numbers.
  matched({ width, height }) {
    const { rows, forward } = this.seen();
    const { factor, left, top } = this.framed({ width, height });
    const mix = (row, by, shift) => row.map((value, k) => by * value + shift * rows[2][k]);
    return [
      ...mix(rows[0], (2 * factor) / width, (2 * left + factor) / width - 1),
      ...mix(rows[1], (-2 * factor) / height, 1 - (2 * top + factor) / height),
      ...forward.map((value) => (DEEP / this.size) * value), 0, ...rows[2],
    ];
  }

  // Rows from positions relative to the center to pixels of the photograph, and its direction.
  seen() {
    const { matrix } = this.photograph;
    const at = matrix.map((row) => row[3] + row.slice(0, 3).reduce((sum, value, k) => sum + value * this.center[k], 0));
    const rows = matrix.map((row, k) => [...row.slice(0, 3), at[k]].map((value) => value / at[2]));
    const far = rows[2].slice(0, 3);
    const forward = unit(Math.hypot(...far) * this.size > 1e-9 ? far : cross(rows[0], rows[1]));
    return { rows, forward };
  }

  // Where the photograph lies in a view: pixels of the view for one of its own, and its corner's place.
  framed({ width, height }) {
    const [across, down] = this.photograph.size;
    const factor = Math.min(width / across, height / down) * this.zoom;
    const left = (width - factor * across) / 2 - (this.pan[0] * height) / this.size;
    const top = (height - factor * down) / 2 + (this.pan[1] * height) / this.size;
    return { factor, left, top };
  }

  // From a position (m) to pixels of a view { x, y, width, height }, y down, and its nearness (m).
  projector(view) {
    const m = this.matrix(view);
    const { x, y, width, height } = view;
    const [cx, cy, cz] = this.center;
    const deep = -this.size / DEEP;
    return (a, b, c, out) => {
      const X = a - cx;
      const Y = b - cy;
      const Z = c - cz;
      const w = 1 / (m[12] * X + m[13] * Y + m[14] * Z + m[15]);
      out[0] = x + (width / 2) * (1 + w * (m[0] * X + m[1] * Y + m[2] * Z + m[3]));
      out[1] = y + (height / 2) * (1 - w * (m[4] * X + m[5] * Y + m[6] * Z + m[7]));
      out[2] = deep * w * (m[8] * X + m[9] * Y + m[10] * Z + m[11]);
      return out;
    };
  }

  turn(azimuth, elevation) {
    if (this.photograph) return; // it was taken from one side
    this.azimuth += azimuth;
    this.elevation = Math.min(90, Math.max(-90, this.elevation + elevation));
  }

  magnify(factor) {
    this.zoom = Math.min(200, Math.max(0.2, this.zoom * factor));
  }

  // Move the picture by pixels of a view of some height.
  shift(dx, dy, view) {
    const scale = this.photograph ? this.size / view.height : 1 / this.perMeter(view);
    this.pan = [this.pan[0] - dx * scale, this.pan[1] + dy * scale];
  }
}

const unit = (d) => d.map((value) => value / Math.hypot(...d));

export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// Let a canvas move the camera. `view` gives the part of the canvas at a place, `changed` draws,
// `tapped` gets the place of a click.
export function steer(canvas, camera, { view, changed, tapped }) {
  const fingers = new Map();
  let traveled = 0;
  let apart = 0;
  const place = (event) => [event.offsetX, event.offsetY];

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (!fingers.size) traveled = 0;
    fingers.set(event.pointerId, place(event));
    apart = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const now = place(event);
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    traveled += Math.abs(dx) + Math.abs(dy);
    fingers.set(event.pointerId, now);
    if (fingers.size === 2) {
      const [p, q] = [...fingers.values()];
      const gap = Math.hypot(p[0] - q[0], p[1] - q[1]);
      if (apart) camera.magnify(gap / apart);
      apart = gap;
      camera.shift(dx / 2, dy / 2, view(...now));
    } else if (event.shiftKey || event.buttons & 6 || camera.photograph) camera.shift(dx, dy, view(...now));
    else camera.turn(-0.4 * dx, 0.4 * dy);
    changed();
  });
  const release = (event) => {
    const own = fingers.delete(event.pointerId);
    if (own && event.type === "pointerup" && traveled < 6) tapped(...place(event));
    apart = 0;
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { // the page scrolls unless the view has the focus
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    camera.magnify(Math.exp(-0.0015 * event.deltaY));
    changed();
  }, { passive: false });
  canvas.addEventListener("dblclick", () => {
    camera.reset();
    changed();
  });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (turns[event.key]) camera.turn(...turns[event.key]);
    else if (event.key === "+" || event.key === "=") camera.magnify(1.15);
    else if (event.key === "-") camera.magnify(1 / 1.15);
    else return;
    event.preventDefault();
    event.stopPropagation();
    changed();
  });
}
