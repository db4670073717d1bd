// What colors and lines mean, beside the charts and below a vector picture.
import { line } from "./charts.js";
import { KINDS, gradient } from "./colors.js";
import { number, readable, titled } from "./numbers.js";

export class Legend {
  // about: "label", "unit" and "signed" of what colors the sheet, or null; `top` its largest value.
  constructor({ about, top, map, theme, kinds, ink }) {
    Object.assign(this, { about, map, ink });
    this.kinds = kinds.map((kind) => ({ ...KINDS[kind], color: KINDS[kind][theme] }));
    if (!about) return;
    const [factor, unit] = readable(top, about.unit);
    const low = about.signed ? -top : 0;
    this.title = titled(about.label, unit);
    this.ticks = [low, (low + top) / 2, top].map((value) => number(value * factor));
  }

  // As elements of the page.
  show(host) {
    host.replaceChildren();
    if (this.about) {
      const scale = document.createElement("div");
      scale.className = "ramp";
      const bar = document.createElement("i");
      bar.style.background = gradient(this.map);
      const title = document.createElement("b");
      title.textContent = this.title;
      const ticks = this.ticks.map((text) => Object.assign(document.createElement("span"), { textContent: text }));
      scale.append(title, bar, ...ticks);
      host.append(scale);
    }
    const row = document.createElement("p");
    row.className = "keys";
    for (const { color, dash, name } of this.kinds) {
      const item = document.createElement("span");
      item.append(line(color, dash), name);
      row.append(item);
    }
    host.append(row);
  }

  get height() {
    return this.about ? 62 : 26;
  }

  // In a vector picture, from `top` on.
  draw(pen, width, top) {
    const y = top + this.height - 10;
    let x = 16;
    pen.globalAlpha = 1;
    pen.textAlign = "left";
    pen.fillStyle = this.ink;
    for (const { color, dash, name, width: broad } of this.kinds) {
      pen.line(x, y - 4, x + 28, y - 4, color, broad, dash);
      pen.fillStyle = this.ink;
      pen.fillText(name, x + 34, y);
      x += 54 + 6.6 * name.length;
    }
    if (!this.about) return;
    const [left, wide] = [16, Math.min(320, width - 32)];
    pen.fillText(this.title, left, top + 10);
    pen.ramp(this.map, left, top + 15, wide, 9);
    this.ticks.forEach((text, k) => {
      pen.textAlign = ["left", "center", "right"][k];
      pen.fillText(text, left + (k * wide) / 2, top + 36);
    });
    pen.textAlign = "left";
  }
}
