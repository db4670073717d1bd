// Charts beside the view, drawn by uPlot: the moment shown is a line or a point in them.
/* global uPlot */
import { number } from "./numbers.js";

const css = (element, name) => getComputedStyle(element).getPropertyValue(name).trim();

const MARK = 4.5; // radius of marks, pixels

const power = (value) => 10 ** Math.floor(Math.log10(value));

export class Chart {
  // curves: { name, color, dash, x, y, stable?, marks? }, marks being [[point, sides, turn], ...]; options: `seek` is told the place that a reader
  // points at, `free` says that curves may turn back, `log` that the vertical axis is logarithmic,
  // `decades` how many of it are shown at most, `words` what 0, 1, 2, ... along the horizontal axis
  // stand for. Of curves that may turn back: `ticks` are places with names along an axis ([[x, name],
  // ...]), `ranges` the ends of both axes, `shaded` stretches of the vertical one, and `all` says
  // that a reader points at any curve, whose number `seek` is told too.
  constructor(host, {
    label, xlabel, ylabel, curves, seek, free = false, log = false, decades = null, words = [],
    ticks = {}, ranges = {}, shaded = [], all = false, height = null,
  }) {
    Object.assign(this, { host, curves, free, xlabel, ylabel, shaded, all });
    host.setAttribute("role", "img");
    host.setAttribute("aria-label", label);
    const axis = (text, size) => ({
      label: text, size, labelSize: 20, labelGap: 0, gap: 4,
      stroke: () => css(host, "--ink"),
      grid: { stroke: () => css(host, "--grid"), width: 1 },
      ticks: { stroke: () => css(host, "--grid"), size: 4 },
      font: "11px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif",
      values: (_, ticks) => ticks.map((value) => (value === null ? "" : number(value, 4))),
    });
    const series = curves.map((curve, k) => ({
      label: curve.name, stroke: curve.color, dash: curve.dash, width: 1.6, points: { show: false },
      ...(free ? {
        facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }],
        paths: (plot) => this.walk(plot, this.curves[k]),
      } : {}),
    }));
    this.plot = new uPlot({
      mode: free ? 2 : 1,
      width: Math.max(200, host.clientWidth), height: height ?? Math.max(190, 60 + 6.5 * ylabel.length), padding: [10, 12, 0, 0],
      cursor: { show: !free, drag: { x: false, y: false }, points: { size: 6 } },
      legend: { show: false },
      scales: {
        x: { time: false, ...(words.length && { range: [-0.5, words.length - 0.5] }), ...(ranges.x && { range: ranges.x }) },
        y: ranges.y ? { range: ranges.y } : log ? { distr: 3, ...(decades && { range: (_, low, high) => [power(Math.max(low, high * 10 ** -decades)), high * 1.5] }) } : {},
      },
      axes: [
        { ...axis(xlabel, 30), ...(words.length && named(words.map((word, k) => [k, word]))), ...(ticks.x && named(ticks.x)) },
        { ...axis(ylabel, 54), ...(ticks.y && named(ticks.y)) },
      ],
      series: [free ? {} : { label: xlabel }, ...series],
      hooks: { drawClear: [() => this.shade()], draw: [() => this.marks(), () => this.mark()] },
    }, this.data(), host);
    if (seek) this.point(seek);
  }

  data() {
    return this.free ? [null, ...this.curves.map(({ x, y }) => [x, y])] : aligned(this.curves);
  }

  // Other values of the same curves.
  put(curves) {
    this.curves = curves;
    this.plot.setData(this.data());
  }

  point(seek) {
    const { over } = this.plot;
    over.classList.add("seek");
    const point = (event) => {
      if (!event.buttons) return;
      const box = over.getBoundingClientRect();
      seek(...this.nearest(event.clientX - box.left, event.clientY - box.top));
    };
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      point(event);
    });
    over.addEventListener("pointermove", point);
  }

  // Value at a place of the chart, or the number of the nearest point and of its curve: of the
  // first one, or of `all` that are shown.
  nearest(px, py) {
    if (!this.free) return [this.plot.posToVal(px, "x")];
    let [best, curve, least] = [0, 0, Infinity];
    (this.all ? this.curves : this.curves.slice(0, 1)).forEach(({ x, y }, j) => {
      if (this.all && !this.plot.series[j + 1].show) return;
      for (let k = 0; k < x.length; k++) {
        const apart = Math.hypot(this.plot.valToPos(x[k], "x") - px, this.plot.valToPos(y[k], "y") - py);
        if (apart < least) [best, curve, least] = [k, j, apart];
      }
    });
    return [best, curve];
  }

  shade() {
    const { ctx, bbox } = this.plot;
    ctx.save();
    ctx.fillStyle = css(this.host, "--grid");
    for (const [low, high] of this.shaded) {
      const [top, bottom] = [high, low].map((y) => this.plot.valToPos(y, "y", true));
      ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    }
    ctx.restore();
  }

  // A curve that turns back, dashed where it is unstable.
  walk(plot, { x, y, stable, color }) {
    const { ctx } = plot;
    const at = (k) => [plot.valToPos(x[k], "x", true), plot.valToPos(y[k], "y", true)];
    ctx.save();
    ctx.lineWidth = 1.8 * devicePixelRatio;
    ctx.strokeStyle = color;
    ctx.beginPath();
    ctx.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
    ctx.clip();
    for (let k = 1, start = 0; k <= x.length; k++) {
      const kind = (j) => !stable || (stable[j - 1] && stable[j]);
      if (k < x.length && k > start + 1 && kind(k) === kind(k - 1)) continue;
      if (k - 1 > start) {
        ctx.setLineDash(kind(start + 1) ? [] : [5 * devicePixelRatio, 4 * devicePixelRatio]);
        ctx.beginPath();
        for (let j = start, down = false; j < k; j++) {
          const [across, up] = at(j);
          const there = Number.isFinite(across) && Number.isFinite(up); // else there is a break
          if (there) ctx[down ? "lineTo" : "moveTo"](across, up);
          down = there;
        }
        ctx.stroke();
        start = k - 1;
      }
    }
    ctx.restore();
    return null;
  }

  // Rings and polygons at points of curves.
  marks() {
    const { ctx } = this.plot;
    ctx.save();
    ctx.setLineDash([]);
    ctx.lineWidth = 1.5 * devicePixelRatio;
    this.curves.forEach(({ x, y, color, marks = [] }, j) => {
      if (!this.plot.series[j + 1].show) return;
      ctx.strokeStyle = color;
      for (const [k, sides, turn] of marks) {
        const [across, up] = [this.plot.valToPos(x[k], "x", true), this.plot.valToPos(y[k], "y", true)];
        ctx.beginPath();
        for (let side = 0; side < sides; side++) {
          const angle = turn + (2 * Math.PI * side) / sides;
          ctx.lineTo(across + MARK * devicePixelRatio * Math.cos(angle), up + MARK * devicePixelRatio * Math.sin(angle));
        }
        ctx.closePath();
        ctx.stroke();
      }
    });
    ctx.restore();
  }

  // Curves that are not switched off.
  get shown() {
    return this.curves.filter((_, k) => this.plot.series[k + 1].show);
  }

  // Where the moment is: a value along the curves, and a point (x, y) of each of them.
  show(x, points = []) {
    if (x === undefined) return;
    this.now = { x, points };
    this.plot.redraw(false, false);
  }

  mark() {
    if (!this.now) return;
    const { ctx, bbox } = this.plot;
    ctx.save();
    ctx.setLineDash([]);
    ctx.lineWidth = devicePixelRatio;
    ctx.strokeStyle = css(this.host, "--ink");
    if (!this.free) {
      const across = this.plot.valToPos(this.now.x, "x", true);
      ctx.beginPath();
      ctx.moveTo(across, bbox.top);
      ctx.lineTo(across, bbox.top + bbox.height);
      ctx.stroke();
    }
    this.now.points.forEach(([x, y], k) => {
      if (!Number.isFinite(y) || !this.plot.series[k + 1].show) return;
      ctx.fillStyle = this.curves[k].color;
      ctx.beginPath();
      ctx.arc(this.plot.valToPos(x, "x", true), this.plot.valToPos(y, "y", true), 4.5 * devicePixelRatio, 0, 7);
      ctx.fill();
    });
    ctx.restore();
  }

  resize() {
    const width = Math.max(200, this.host.clientWidth);
    if (width !== this.plot.width) this.plot.setSize({ width, height: this.plot.height });
  }

  remove() {
    this.plot.destroy();
  }
}

// Ticks that are words, each at its place.
const named = (ticks) => ({ splits: () => ticks.map(([at]) => at), values: () => ticks.map(([, word]) => word) });

// Columns of curves over one horizontal axis.
function aligned(curves) {
  const same = curves.every(({ x }) => x.length === curves[0].x.length
    && x.every((value, k) => value === curves[0].x[k]));
  if (same) return [curves[0].x, ...curves.map(({ y }) => y)];
  return uPlot.join(curves.map(({ x, y }) => [x, y]), curves.map(() => [2]));
}

// The names of a chart's curves with their lines: buttons that switch them off and on. `hidden` has
// the keys of those that are off, `number` is the chart's own.
export function keys({ plot, curves }, hidden, number) {
  const row = document.createElement("p");
  row.className = "keys";
  curves.forEach(({ name, color, dash }, k) => {
    if (!name) return;
    const key = Object.assign(document.createElement("button"), { type: "button" });
    const own = (key.dataset.key = `${number} ${name}`);
    const set = (show) => {
      key.setAttribute("aria-pressed", show);
      hidden[show ? "delete" : "add"](own);
      plot.setSeries(k + 1, { show });
    };
    key.append(line(color, dash), name);
    key.addEventListener("click", () => set(hidden.has(own)));
    set(!hidden.has(own));
    row.append(key);
  });
  return row;
}

export function line(color, dash = [], width = 2.5) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("width", "30");
  svg.setAttribute("height", "8");
  svg.setAttribute("aria-hidden", "true");
  const stroke = document.createElementNS("http://www.w3.org/2000/svg", "line");
  const attributes = {
    x1: 0, y1: 4, x2: 30, y2: 4, stroke: color, "stroke-width": width,
    "stroke-dasharray": dash.join(" "),
  };
  for (const [name, value] of Object.entries(attributes)) stroke.setAttribute(name, value);
  svg.append(stroke);
  return svg;
}
