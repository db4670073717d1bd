// The interactive part of a page: what is shown, what plays, and what its reader chooses.
import { ANALYSES } from "./analyses.js";
import { CURVES, DASHES, LOOKS } from "./colors.js";
import { Store } from "./data.js";
import { savePicture, saveTable, saveVector } from "./files.js";
import { Legend } from "./legend.js";
import { number } from "./numbers.js";
import { loadedSheet } from "./result.js";
import { Shape } from "./shape.js";
import { View } from "./view.js";

const SHOWN = { ...ANALYSES, shape: Shape };

const MARKUP = `
<div class="stage">
  <canvas class="under"></canvas>
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
  <label class="photographed"><input class="photograph" type="checkbox" checked> photograph</label>
  <fieldset class="which"><legend>Results</legend></fieldset>
  <span class="buttons">
    <button type="button" class="home">Reset view</button>
    <button type="button" class="theme">Dark</button>
    <button type="button" class="save-picture" title="picture of the sheet as shown">PNG</button>
    <button type="button" class="save-vector" title="picture of the sheet as vectors">SVG</button>
    <button type="button" class="save-curves" title="the curves of the charts">CSV</button>
  </span>
</div>
<p class="status" role="status"></p>`;

export class Page {
  constructor(root, about, find) {
    Object.assign(this, { root, about, store: new Store(about.arrays, find) });
    root.innerHTML = MARKUP;
    this.asked = new URLSearchParams(location.search);
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

  async load() {
    const { about, store } = this;
    const sheets = {};
    for (const [key, sheet] of Object.entries(about.sheets)) sheets[key] = await loadedSheet(sheet, store);
    const results = await Promise.all(
      about.results.map((each) => this.analysis.loaded(each, sheets[each.sheet], store)),
    );
    this.pictures = await Promise.all((about.backdrop?.pictures ?? []).map(loadedPicture));
    this.camera.photograph = about.backdrop ?? null;
    const most = this.analysis.most;
    results.forEach((result, index) => {
      const before = this.results?.[index];
      Object.assign(result, { index, chosen: before ? before.chosen : index < most });
    });
    this.results = results;
  }

  // Show other results of the same kind in place of these: view, moment and choices stay.
  async replace(about, find) {
    Object.assign(this, { about, store: new Store(about.arrays, find) });
    await this.load();
    const { moment, analysis: { speed } } = this;
    this.analysis = new ANALYSES[about.kind](this);
    this.analysis.prepare();
    const [low, high] = this.analysis.range;
    this.moment = Math.min(high, Math.max(low, moment));
    this.analysis.speed = speed;
    const { vertices, creases } = this.results[0].sheet;
    if (this.node >= vertices) this.node = null;
    if (this.crease >= creases.length) this.crease = null;
    const box = this.analysis.box(this.results);
    if (!this.camera.holds(...box)) this.camera.fit(...box);
    this.view.forget();
    this.waiting = true; // one picture is enough
    this.list();
    this.restyle();
    this.recolor();
    this.charts();
    this.waiting = false;
    if (this.playing) this.redraw();
    else this.say();
  }

  async start() {
    await this.load();
    this.analysis.prepare();
    this.moment ??= this.analysis.range[0];
    this.camera.fit(...this.analysis.box(this.results));
    this.controls();
    this.restyle();
    this.recolor();
    this.ready = true;
    new ResizeObserver(() => this.ready && this.resize()).observe(this.root);
    this.resize();
    this.charts();
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.say();
    if (!still && this.analysis.moves) this.play(true);
    this.root.dataset.ready = "1";
    this.root.dataset.painter = this.view.kind;
  }

  // Give back what a page holds that is shown no more.
  close() {
    this.play(false);
    this.ready = false;
    this.view.close();
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

  // The last photograph that is not after the moment, or else the first.
  photograph() {
    const before = this.pictures.filter(({ moment }) => moment <= this.moment);
    return (before.at(-1) ?? this.pictures[0]).image;
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
    this.$("save-curves").hidden = !this.analysis.curves;
    this.$("direction").hidden = !this.analysis.nodal;
    this.$("play").hidden = !this.analysis.moves;
    for (const name of ["field", "ghost", "scale"]) this.$(name).parentElement.hidden = !this.analysis.moves;
    this.$("ghost").checked = this.ghost = !this.about.backdrop && this.results[0].sheet.edges.length < 20000;
    this.list();
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
    this.$("photographed").hidden = !this.about.backdrop;
    this.$("hint").hidden = Boolean(this.about.backdrop);
    on("photograph", "change", () => {
      this.camera.photograph = this.$("photograph").checked ? this.about.backdrop : null;
      this.$("hint").hidden = this.$("photograph").checked;
      this.$("home").click();
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
    const saved = { "save-picture": savePicture, "save-vector": saveVector, "save-curves": saveTable };
    for (const [name, save] of Object.entries(saved)) {
      on(name, "click", () => {
        this.draw(); // a picture that is not shown may be gone
        save(this);
      });
    }
    this.root.addEventListener("keydown", (event) => this.key(event));
    const coarse = matchMedia("(pointer: coarse)").matches;
    this.$("hint").textContent = coarse
      ? "drag to turn, pinch to zoom, tap a node or crease"
      : "drag to turn, click and scroll to zoom, click a node or crease";
  }

  // The results with boxes to choose among them.
  list() {
    const labels = this.results.map((result) => {
      const label = document.createElement("label");
      result.key = document.createElement("i");
      label.append(this.check(result), result.key, this.caption(result));
      return label;
    });
    this.$("which").replaceChildren(this.$("which").firstElementChild, ...labels);
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

  // Show those of the results that suit.
  choose(suits) {
    for (const result of this.results) result.chosen = suits(result);
    this.recolor();
    this.charts();
    if (!this.playing) this.say();
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
      c: () => this.pickCrease(((this.crease ?? -1) + 1) % (this.results[0].sheet.creases.length || 1)),
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
    if (!this.results.every(({ fields }) => fields.turn)) return;
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
    this.legend = new Legend({
      about: own[key] ?? field, top: this.top, map: this.map, theme: this.theme, ink: LOOKS[this.theme].ink,
      kinds: [...new Set(this.results.flatMap(({ sheet }) => [...new Set(sheet.kind)]))].sort(),
    });
    this.legend.show(this.$("legend"));
    this.redraw();
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
    const { key } = host.contains(document.activeElement) ? document.activeElement.dataset : {};
    host.replaceChildren();
    this.plots = this.analysis.charts(host);
    if (key) host.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus();
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
        this.analysis.advance(Math.min(0.1, Math.max(0, (now - this.last) / 1000))); // frames may begin before
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
      const moved = this.analysis.move(result, factor);
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
      + "minus zoom, n goes to the next node, c to the next crease.";
    this.view.over.setAttribute("aria-label", label);
  }

  resize() {
    this.view.resize();
    this.plots?.forEach((plot) => plot.resize());
    this.draw();
  }
}

async function loadedPicture([moment, address]) {
  const image = Object.assign(new Image(), { src: address });
  await image.decode();
  return { moment, image };
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
