// Modes: a table to choose them from, and how alike they are.
import { Analysis, SWING, TURNS } from "./analysis.js";
import { ramp } from "./colors.js";
import { number } from "./numbers.js";
import { boxAround } from "./result.js";

export class Modes extends Analysis {
  most = 6;
  overlays = false;
  curves = false;
  nodal = false;

  prepare() {
    this.range = [0, 1];
  }

  box(results) {
    return boxAround(results, SWING);
  }

  caption(result) {
    return `${result.name}: ${number(result.frequency, 4)} Hz`;
  }

  moment() {
    return 0; // a mode has one sample
  }

  // Shapes are as large as their greatest motion lets them be seen.
  swing(result) {
    return (SWING * result.sheet.size * Math.sin(this.page.phase)) / (result.largest || 1);
  }

  get part() {
    return (this.page.phase / (2 * Math.PI)) % 1;
  }

  at(part) {
    this.page.phase = 2 * Math.PI * part;
    return 0;
  }

  advance(seconds) {
    this.page.phase += 2 * Math.PI * TURNS * this.speed * seconds;
  }

  clock() {
    return "in step, not at their own speeds";
  }

  words() {
    const names = this.page.shown.map((result) => `${this.caption(result)}, ${result.what}`);
    return `Modes ${names.join("; ")}.`;
  }

  // The modes as a table with a box to show each, and how alike they are.
  draw(host) {
    const { page } = this;
    const table = document.createElement("table");
    heads(table.createTHead().insertRow(), ["", "mode", "Hz", "damping", "what it does"]);
    const body = table.createTBody();
    for (const result of page.results) {
      const check = page.check(result);
      check.setAttribute("aria-label", `show mode ${result.name}`);
      check.dataset.key = `mode ${result.index}`;
      const damping = result.damping === null ? "" : `${number(100 * result.damping)} %`;
      const row = body.insertRow();
      for (const cell of [check, result.name, number(result.frequency, 4), damping, result.what]) row.insertCell().append(cell);
    }
    host.append(table);
    if (page.about.mac && page.results.length > 1) this.compare(host);
  }

  // Modal assurance criteria of the modes of two results, or of one with itself: a press on a number
  // shows its two shapes.
  compare(host) {
    const { page } = this;
    const sets = [...new Set(page.results.map(({ of }) => of))];
    this.pair ??= [sets[0], sets[1] ?? sets[0]];
    const title = document.createElement("p");
    title.className = "told";
    if (sets.length > 1) title.append("MAC of ", this.choice(sets, 0), " with ", this.choice(sets, 1));
    else title.append("MAC of the modes with each other");
    const [down, across] = this.pair.map((name) => page.results.filter(({ of }) => of === name));
    const table = document.createElement("table");
    table.className = "mac";
    heads(table.createTHead().insertRow(), ["", ...across.map((mode) => mode.number)]);
    const body = table.createTBody();
    for (const one of down) {
      const row = body.insertRow();
      heads(row, [one.number], "row");
      for (const other of across) row.insertCell().append(this.cell(one, other));
    }
    table.addEventListener("keydown", (event) => walk(table, event));
    const wide = document.createElement("div");
    wide.className = "wide";
    wide.append(table);
    host.append(title, wide);
    const focused = table.querySelector(`[data-key="${this.cursor}"]`) ?? table.querySelector("button");
    focused.tabIndex = 0;
  }

  choice(sets, place) {
    const select = document.createElement("select");
    select.append(...sets.map((name) => new Option(name, name, false, name === this.pair[place])));
    select.setAttribute("aria-label", place ? "columns" : "rows");
    select.dataset.key = `set ${place}`;
    select.addEventListener("change", () => {
      this.pair[place] = select.value;
      this.page.charts();
    });
    return select;
  }

  cell(one, other) {
    const { page } = this;
    const value = page.about.mac[one.index][other.index];
    const button = Object.assign(document.createElement("button"), { type: "button", tabIndex: -1 });
    button.dataset.key = `mac ${one.index} ${other.index}`;
    button.textContent = value === null ? "–" : value.toFixed(2);
    button.setAttribute("aria-label", `MAC ${button.textContent} of mode ${one.name} with mode ${other.name}`);
    const at = 4 * Math.round(255 * (value ?? 0));
    const tone = [...TONES.slice(at, at + 3)];
    button.style.background = `rgb(${tone.join(", ")})`;
    button.style.color = light(tone) ? "#000000" : "#ffffff";
    button.setAttribute("aria-pressed", page.shown.every((mode) => mode === one || mode === other)
      && one.chosen && other.chosen);
    button.addEventListener("click", () => {
      this.cursor = button.dataset.key;
      page.choose((mode) => mode === one || mode === other);
    });
    return button;
  }
}

const TONES = ramp("sequential");

// Whether black is read better on a color than white (relative luminance as in WCAG 2).
function light(color) {
  const [r, g, b] = color.map((value) => (value / 255) ** 2.2);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.18;
}

function heads(row, texts, scope = "col") {
  for (const text of texts) {
    const head = document.createElement(text === "" ? "td" : "th");
    head.textContent = text;
    if (text !== "") head.scope = scope;
    row.append(head);
  }
}

// Arrow keys go from number to number.
function walk(table, event) {
  const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
  const cell = event.target.closest("td");
  if (!step || !cell) return;
  const row = table.rows[cell.parentNode.rowIndex + step[0]];
  const next = row?.cells[cell.cellIndex + step[1]]?.querySelector("button");
  event.preventDefault();
  event.stopPropagation();
  if (!next) return;
  event.target.tabIndex = -1;
  next.tabIndex = 0;
  next.focus();
}
