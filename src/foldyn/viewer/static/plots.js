// Charts of a page that stand apart from its stage: laws, loads, what was measured.
import { Chart, keys } from "./charts.js";
import { CURVES } from "./colors.js";
import { readable } from "./numbers.js";

class Plot extends Chart {
  walk(plot, curve) {
    const { ctx, bbox } = plot;
    ctx.save();
    if (curve.dots) {
      this.dot(plot, curve);
    } else {
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      super.walk(plot, curve);
    }
    ctx.restore();
    return null;
  }

  dot(plot, { x, y, color }) {
    const { ctx } = plot;
    ctx.fillStyle = color;
    for (let k = 0; k < x.length; k++) {
      ctx.beginPath();
      ctx.arc(plot.valToPos(x[k], "x", true), plot.valToPos(y[k], "y", true), 2.8 * devicePixelRatio, 0, 7);
      ctx.fill();
    }
  }
}

// A title of an axis in a unit that is easily read, and the factor to it: "force (mN)", 1000.
function scaled(label, values, reach = 0) {
  const [, name, unit] = /^(.*) \(([^()]*)\)$/.exec(label) ?? [null, label, ""];
  if (!unit || unit === "-") return [label, 1];
  const top = reach || values.flat().reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const [factor, better] = readable(top, unit);
  return [`${name} (${better})`, factor];
}

function drawPlot(host, theme) {
  const about = JSON.parse(host.dataset.plot);
  const { title, words, curves: given } = about;
  const [xlabel, across] = scaled(about.xlabel, given.map(({ x }) => x));
  const [ylabel, up] = scaled(about.ylabel, given.map(({ y }) => y), about.reach);
  const reach = up * about.reach;
  const curves = given.map((curve, k) => ({
    ...curve, color: CURVES[theme][k % 8], dash: curve.dots ? [3, 4] : [],
    x: curve.x.map((value) => across * value), y: curve.y.map((value) => up * value),
  }));
  host.chart?.remove();
  host.replaceChildren();
  const place = host.appendChild(document.createElement("div"));
  const label = `${title || ylabel} over ${xlabel}: ${curves.map(({ name }) => name).filter(Boolean).join("; ")}`;
  host.chart = new Plot(place, { label, xlabel, ylabel, curves, words, free: true });
  host.append(keys(host.chart, (host.off ??= new Set()), 0));
  if (reach) host.chart.plot.setScale("y", { min: -reach, max: reach });
}

export function openPlots() {
  const hosts = [...document.querySelectorAll("[data-plot]")];
  if (!hosts.length) return;
  const root = document.documentElement;
  const theme = () => (root.classList.contains("dark") ? "dark" : "light");
  let drawn = "";
  const draw = () => {
    if (theme() === drawn) return;
    drawn = theme();
    hosts.forEach((host) => drawPlot(host, drawn));
  };
  draw();
  new MutationObserver(draw).observe(root, { attributes: true, attributeFilter: ["class"] });
  addEventListener("resize", () => hosts.forEach((host) => host.chart.resize()));
}
