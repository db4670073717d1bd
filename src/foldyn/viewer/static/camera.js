// An orthographic camera that turns around z, and what fingers, mouse and keys do to it.

const RADIANS = Math.PI / 180;
const MARGIN = 1.12;

export class Camera {
  constructor([elevation, azimuth] = [28, -60]) {
    this.home = { elevation, azimuth };
    this.center = [0, 0, 0];
    this.half = [1, 1, 1];
    this.reset();
  }

  reset() {
    Object.assign(this, this.home, { zoom: 1, pan: [0, 0] });
  }

  // Unit vectors to the right, up and towards the viewer.
  get basis() {
    const e = this.elevation * RADIANS;
    const a = this.azimuth * RADIANS;
    const toward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
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

  // Half the height (m) that a view of width / height = aspect shows.
  extent(aspect) {
    const [right, up] = this.basis;
    const reach = (d) => d.reduce((sum, value, k) => sum + Math.abs(value) * this.half[k], 0);
    return (MARGIN * Math.max(reach(up), reach(right) / aspect)) / this.zoom;
  }

  // From a position (m) to pixels of a view { x, y, width, height }, y down, and its depth (m).
  projector({ x, y, width, height }) {
    const [r, u, t] = this.basis;
    const scale = height / 2 / this.extent(width / height);
    const [cx, cy, cz] = this.center;
    const [px, py] = this.pan;
    return (a, b, c, out) => {
      const X = a - cx;
      const Y = b - cy;
      const Z = c - cz;
      out[0] = x + width / 2 + scale * (X * r[0] + Y * r[1] + Z * r[2] - px);
      out[1] = y + height / 2 - scale * (X * u[0] + Y * u[1] + Z * u[2] - py);
      out[2] = X * t[0] + Y * t[1] + Z * t[2];
      return out;
    };
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(90, Math.max(-90, this.elevation + elevation));
  }

  magnify(factor) {
    this.zoom = Math.min(200, Math.max(0.2, this.zoom * factor));
  }

  // Move the picture by pixels of a view of some height.
  shift(dx, dy, view) {
    const scale = (2 * this.extent(view.width / view.height)) / view.height;
    this.pan = [this.pan[0] - dx * scale, this.pan[1] + dy * scale];
  }
}

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
    } else if (event.shiftKey || event.buttons & 6) camera.shift(dx, dy, view(...now));
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
