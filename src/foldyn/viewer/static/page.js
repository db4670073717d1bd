// The interactive part of a page: what is shown, what plays, and what its reader chooses.
import { CURVES, DASHES, KINDS, gradient } from "./colors.js";
import { line } from "./charts.js";
import { Store } from "./data.js";
import { ANALYSES } from "./analyses.js";
import { number, readable, titled } from "./numbers.js";
import { Result, loadedSheet } from "./result.js";
import { View } from "./view.js";

const MARKUP = `
<div class="stage">
  <canvas class="sheet"></canvas>
  <canvas class="over" tabindex="0" role="img"></canvas>
  <p class="hint" aria-hidden="true"></p>
</div>
<div class="side"><div class="legend"></div><div class="charts"></div></div>
<div class="play" role="group" aria-label="Playback">
  <button type="button" class="toggle" aria-label="Play">▶</button>
  <input class="scrub" type="range" min="0" max="1000" step="1" value="0" aria-label="Moment">
  <output class="clock"></output>
  <label class="pace">Speed <select class="speed"></select></label>
</div>
<div class="options">
  <label>Color <select class="field"></select></label>
  <label class="layouts">Show <select class="layout">
    <option value="side">side by side</option><option value="over">overlaid</option>
  </select></label>
  <label>Displacement × <input class="scale" type="range" min="-20" max="80" step="1"><output class="scaled"></output></label>
  <label class="direction">Direction <select class="axis">
    <option value="0">x</option><option value="1">y</option><option value="2">z</option>
  </select></label>
  <label><input class="ghost" type="checkbox" checked> rest shape</label>
  <label><input class="marks" type="checkbox" checked> supports and loads</label>
  <fieldset class="which"><legend>Results</legend></fieldset>
  <span class="buttons">
    <button type="button" class="home">Reset view</button>
    <button type="button" class="theme">Dark</button>
    <button type="button" class="save-picture">Picture (PNG)</button>
    <button type="button" class="save-curves">Curves (CSV)</button>
  </span>
</div>
<p class="status" role="status"></p>`;

export class Page {
  constructor(root, about, find) {
    Object.assign(this, { root, about, store: new Store(about.arrays, find) });
    root.innerHTML = MARKUP;
    this.plain = about.plain || new URLSearchParams(location.search).has("plain");
    this.analysis = new ANALYSES[about.kind](this);
    this.node = about.node ?? null;
    this.crease = null;
    this.axis = about.axis ?? 0;
    this.scale = about.scale ?? 1;
    this.field = about.field ?? "";
    this.layout = "side";
    this.ghost = this.marks = true;
    this.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
    this.view = new View(this.$("stage"), this);
    this.camera = this.view.camera;
    this.playing = false;
    this.phase = Math.PI / 2;
  }

  $(name) {
    return this.root.querySelector(`.${name}`);
  }

  async start() {
    const { about, store } = this;
    const sheets = {};
    for (const [key, sheet] of Object.entries(about.sheets)) sheets[key] = await loadedSheet(sheet, store);
    this.results = await Promise.all(
      about.results.map((each) => Result.load(each, sheets[each.sheet], store)),
    );
    const most = this.analysis.most;
    this.results.forEach((result, index) => Object.assign(result, { index, chosen: index < most }));
    this.analysis.prepare();
    this.moment ??= this.analysis.range[0];
    this.camera.fit(...this.analysis.box(this.results));
    this.controls();
    this.restyle();
    this.recolor();
    this.ready = true;
    new ResizeObserver(() => this.resize()).observe(this.root);
    this.resize();
    this.charts();
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.say();
    if (!still) this.play(true);
    this.root.dataset.ready = "1";
    this.root.dataset.painter = this.view.kind;
  }

  get shown() {
    const chosen = this.results.filter((result) => result.chosen);
    return chosen.length ? chosen : this.results.slice(0, 1);
  }

  color(result) {
    return CURVES[this.theme][result.index % 8];
  }

  caption(result) {
    return this.analysis.caption(result);
  }

  // ---------------------------------------------------------------- controls
  controls() {
    const on = (name, type, act) => this.$(name).addEventListener(type, act);
    const options = (name, pairs, value) => {
      this.$(name).replaceChildren(...pairs.map(([key, text]) => new Option(text, key)));
      this.$(name).value = value;
    };
    const fields = new Map(this.results.flatMap((r) => Object.entries(r.fields).map(([k, f]) => [k, f.label])));
    options("field", [["", "paper"], ...this.analysis.fields, ...fields], this.field);
    options("speed", this.analysis.speeds.map((v) => [v, this.analysis.pace(v)]), this.analysis.speed);
    this.$("axis").value = this.axis;
    this.$("scale").value = Math.round(20 * Math.log10(this.scale));
    this.$("scaled").textContent = number(this.scale, 2);
    this.$("layouts").hidden = this.results.length < 2 || !this.analysis.overlays;
    this.$("which").hidden = this.results.length < 2 || !this.analysis.curves;
    this.$("direction").hidden = this.$("save-curves").hidden = !this.analysis.histories;
    this.$("ghost").checked = this.ghost = this.results[0].sheet.edges.length < 20000;
    for (const result of this.results) {
      const label = document.createElement("label");
      result.key = document.createElement("i");
      label.append(this.check(result), result.key, this.caption(result));
      this.$("which").append(label);
    }
    on("toggle", "click", () => this.play());
    on("scrub", "input", () => this.seek(this.analysis.at(this.$("scrub").value / 1000)));
    on("speed", "change", () => (this.analysis.speed = Number(this.$("speed").value)));
    on("field", "change", () => {
      this.field = this.$("field").value;
      this.recolor();
    });
    on("layout", "change", () => {
      this.layout = this.$("layout").value;
      this.redraw();
    });
    on("scale", "input", () => {
      const power = Number(this.$("scale").value);
      this.scale = Number((10 ** (power / 20)).toPrecision(2));
      this.$("scaled").textContent = number(this.scale, 2);
      this.redraw();
    });
    on("axis", "change", () => {
      this.axis = Number(this.$("axis").value);
      this.charts();
    });
    for (const name of ["ghost", "marks"]) {
      on(name, "change", () => {
        this[name] = this.$(name).checked;
        this.redraw();
      });
    }
    on("home", "click", () => {
      this.camera.reset();
      this.redraw();
    });
    on("theme", "click", () => {
      this.theme = this.theme === "dark" ? "light" : "dark";
      this.restyle();
      this.recolor();
      this.charts();
    });
    on("save-picture", "click", () => this.savePicture());
    on("save-curves", "click", () => this.saveTable());
    this.root.addEventListener("keydown", (event) => this.key(event));
    const coarse = matchMedia("(pointer: coarse)").matches;
    this.$("hint").textContent = coarse
      ? "drag to turn, pinch to zoom, tap a node or crease"
      : "drag to turn, click and scroll to zoom, click a node or crease";
  }

  // A box to show a result or not.
  check(result) {
    const check = Object.assign(document.createElement("input"), { type: "checkbox", checked: result.chosen });
    check.addEventListener("change", () => {
      result.chosen = check.checked;
      this.recolor();
      this.charts();
    });
    return check;
  }

  key(event) {
    const { target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (target.tagName === "SELECT" || target.type === "range") return;
    const step = (event.shiftKey ? 0.1 : 0.01) * (target === this.view.over ? 0 : 1);
    const act = {
      " ": () => ["BUTTON", "INPUT"].includes(target.tagName) || this.play(),
      ArrowRight: () => this.nudge(step), ArrowLeft: () => this.nudge(-step),
      Home: () => this.nudge(-1), End: () => this.nudge(1),
      n: () => this.pickNode(((this.node ?? -1) + 1) % this.results[0].sheet.vertices),
      r: () => this.$("home").click(),
    }[event.key];
    if (!act || act() === true) return;
    event.preventDefault();
  }

  // ---------------------------------------------------------------- what is shown
  pickNode(node) {
    Object.assign(this, { node, crease: null });
    this.charts();
    if (!this.playing) this.say();
  }

  pickCrease(crease) {
    Object.assign(this, { crease, node: null });
    this.charts();
    if (!this.playing) this.say();
  }

  recolor() {
    const key = this.field;
    this.top = Math.max(0, ...this.shown.map((result) => result.top(key))) || 1;
    const field = this.shown.map((result) => result.fields[key]).find(Boolean);
    this.map = field?.signed ? "diverging" : "sequential";
    const own = { displacement: { label: "displacement", unit: "m" }, speed: { label: "speed", unit: "m/s" } };
    const about = own[key] ?? field;
    this.legend(about);
    this.redraw();
  }

  legend(about) {
    const host = this.$("legend");
    host.replaceChildren();
    if (about) {
      const [factor, unit] = readable(this.top, about.unit);
      const low = about.signed ? -this.top : 0;
      const ramp = document.createElement("div");
      ramp.className = "ramp";
      const bar = document.createElement("i");
      bar.style.background = gradient(this.map);
      const title = document.createElement("b");
      title.textContent = titled(about.label, unit);
      const ticks = [low, (low + this.top) / 2, this.top].map((value) => {
        const tick = document.createElement("span");
        tick.textContent = number(value * factor);
        return tick;
      });
      ramp.append(title, bar, ...ticks);
      host.append(ramp);
    }
    const row = document.createElement("p");
    row.className = "keys";
    const kinds = new Set(this.results.flatMap((result) => [...new Set(result.sheet.kind)]));
    for (const kind of [...kinds].sort()) {
      const item = document.createElement("span");
      item.append(line(KINDS[kind][this.theme], KINDS[kind].dash), KINDS[kind].name);
      row.append(item);
    }
    host.append(row);
  }

  restyle() {
    this.root.classList.toggle("dark", this.theme === "dark");
    document.documentElement.classList.toggle("dark", this.theme === "dark");
    this.$("theme").textContent = this.theme === "dark" ? "Light" : "Dark";
    for (const result of this.results) {
      result.key.style.background = this.color(result);
    }
  }

  curve(result, x, y) {
    return { name: this.caption(result), color: this.color(result), dash: DASHES[result.index % 5], x, y };
  }

  charts() {
    if (!this.ready) return;
    (this.plots ?? []).forEach((plot) => plot.remove());
    const host = this.$("charts");
    host.replaceChildren();
    this.plots = this.analysis.charts(host) ?? [];
    this.redraw();
  }

  // ---------------------------------------------------------------- time
  play(on = !this.playing) {
    this.playing = on;
    const button = this.$("toggle");
    button.textContent = on ? "❚❚" : "▶";
    button.setAttribute("aria-label", on ? "Pause" : "Play");
    this.last = performance.now();
    if (!on) return this.say();
    this.$("status").textContent = "";
    this.redraw();
  }

  nudge(part) {
    const [low, high] = this.analysis.range;
    this.seek(Math.min(high, Math.max(low, this.moment + part * (high - low))));
  }

  seek(moment) {
    this.play(false);
    this.moment = moment;
    this.redraw();
    this.say();
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      if (this.playing) {
        this.analysis.advance(Math.min(0.1, (now - this.last) / 1000));
        this.last = now;
      }
      this.draw();
      if (this.playing) this.redraw();
    });
  }

  draw() {
    if (!this.ready) return;
    for (const result of this.shown) {
      const factor = this.scale * this.analysis.swing(result);
      const moved = result.move(this.analysis.moment(result), this.phase, factor);
      result.shown = this.field
        ? result.levels(this.field, this.analysis.moment(result), moved, this.top) : null;
    }
    this.view.draw();
    const text = this.analysis.clock();
    this.$("clock").textContent = text;
    const scrub = this.$("scrub");
    scrub.setAttribute("aria-valuetext", text);
    if (document.activeElement !== scrub || this.playing) scrub.value = Math.round(1000 * this.analysis.part);
    const now = performance.now(); // charts need no more than some pictures a second
    if (!this.playing || now - (this.marked ?? 0) > 60) {
      this.marked = now;
      this.plots?.forEach((plot) => plot.follow?.());
    }
  }

  say() {
    if (!this.ready) return;
    this.draw();
    const words = this.analysis.words();
    this.$("status").textContent = words;
    const label = `${this.about.title}: three-dimensional view. ${words} Arrow keys turn it, plus and `
      + "minus zoom, n goes to the next node.";
    this.view.over.setAttribute("aria-label", label);
  }

  resize() {
    this.view.resize();
    this.plots?.forEach((plot) => plot.resize());
    this.draw();
  }

  // ---------------------------------------------------------------- files
  savePicture() {
    this.draw();
    const { canvas, over } = this.view;
    const both = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    const context = both.getContext("2d");
    context.drawImage(canvas, 0, 0);
    context.drawImage(over, 0, 0);
    both.toBlob((blob) => download(blob, "foldyn.png"));
  }

  saveTable() {
    const rows = this.analysis.table().map((row) => row.join(","));
    download(new Blob([`${rows.join("\n")}\n`], { type: "text/csv" }), "foldyn.csv");
  }
}

function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// Start all interactive parts of the document.
export function openPages() {
  for (const root of document.querySelectorAll("[data-foldyn]")) {
    const { foldyn } = root.dataset;
    const find = (name) => document.querySelector(`script[data-array="${foldyn}.${name}"]`)?.textContent;
    const about = JSON.parse(document.getElementById(`${foldyn}.about`).textContent);
    root.page = new Page(root, about, find);
    root.page.start().catch((error) => {
      root.textContent = `This part of the page could not be drawn: ${error.message}`;
      root.dataset.ready = "failed";
      console.error(error);
    });
  }
}
