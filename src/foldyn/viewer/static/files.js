// What a reader takes away: pictures and curves as files.
import { LOOKS } from "./colors.js";
import { vector } from "./vector.js";

export function savePicture({ view, theme }) {
  const layers = [view.under.canvas, view.canvas, view.over];
  const { width, height } = view.canvas;
  const whole = Object.assign(document.createElement("canvas"), { width, height });
  const context = whole.getContext("2d");
  context.fillStyle = LOOKS[theme].background;
  context.fillRect(0, 0, width, height);
  for (const layer of layers) context.drawImage(layer, 0, 0);
  whole.toBlob((blob) => download(blob, "foldyn.png"));
}

export function saveVector(page) {
  download(new Blob([vector(page.view, page, page.legend)], { type: "image/svg+xml" }), "foldyn.svg");
}

export function saveTable({ analysis }) {
  const rows = analysis.table().map((row) => row.join(","));
  download(new Blob([`${rows.join("\n")}\n`], { type: "text/csv" }), "foldyn.csv");
}

export function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
