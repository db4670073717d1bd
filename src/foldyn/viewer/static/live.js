// A case file with sliders: what a reader wishes goes to the server that gave the page, and what
// comes back takes the place of what is shown. The newest wish wins; there is no queue.
import { download } from "./files.js";
import { Page } from "./page.js";

const PATIENCE = 250; // ms that a newer wish waits for the answer to an older one
const SLIDER_STEPS = 1000; // of a slider
const SLIDER_DIGITS = 4;
const GROUP_NAMES = { pattern: "Pattern", sheet: "Sheet", damping: "Damping" };
const SLOW_AFTER = 700; // ms after which the page says that it waits

const FORM = `
<form class="wishes" autocomplete="off">
  <label class="what">Compute <select class="kind"></select></label>
  <p class="doing" role="status"></p>
  <div class="groups"></div>
  <span class="buttons">
    <button type="button" class="back">As in the file</button>
    <button type="button" class="save">Save as case file</button>
  </span>
</form>
<div class="result">
  <p class="problem" role="alert"></p>
  <p class="notes"></p>
  <div class="foldyn"></div>
</div>`;

class Live {
  constructor(host, about) {
    Object.assign(this, { host, about, sent: 0, since: null, due: false });
    host.innerHTML = FORM;
    const kind = this.$("kind");
    kind.append(...Object.entries(about.offers).map(([key, text]) => new Option(text, key)));
    kind.addEventListener("change", () => this.wish());
    this.numbers = about.controls.map((control) => new NumberInput(control, () => this.wish()));
    for (const group of new Set(about.controls.map((control) => control.group))) {
      const box = document.createElement("fieldset");
      const legend = document.createElement("legend");
      legend.textContent = GROUP_NAMES[group];
      box.append(legend, ...this.numbers.filter((each) => each.group === group).map((each) => each.row));
      this.$("groups").append(box);
    }
    this.$("wishes").addEventListener("submit", (event) => event.preventDefault());
    this.$("back").addEventListener("click", () => {
      this.numbers.forEach((each) => each.put(each.start));
      this.wish();
    });
    this.$("save").addEventListener("click", () => this.save());
    this.wish();
  }

  $(name) {
    return this.host.querySelector(`.${name}`);
  }

  get wanted() {
    const changed = this.numbers.filter((each) => each.value !== each.start);
    return {
      numbers: Object.fromEntries(changed.map((each) => [each.name, each.value])),
      compute: this.$("kind").value,
    };
  }

  // Ask for what is wanted now, or soon: while an answer is on its way it may come first.
  wish() {
    this.due = true;
    this.wished = performance.now();
    clearTimeout(this.later);
    const waited = this.since === null ? PATIENCE : performance.now() - this.since;
    if (waited >= PATIENCE) this.ask();
    else this.later = setTimeout(() => this.due && this.ask(), PATIENCE - waited);
  }

  async ask() {
    const number = ++this.sent;
    this.due = false;
    const asked = (this.since = performance.now());
    clearTimeout(this.slow);
    this.slow = setTimeout(() => {
      this.$("doing").textContent = "computing … (what is used first is compiled first)";
      this.$("result").classList.add("outdated");
    }, SLOW_AFTER);
    const answer = await this.post("/compute");
    if (number !== this.sent) return; // a newer wish is on its way
    clearTimeout(this.slow);
    this.since = null;
    try {
      if (answer.about) await this.show(answer);
    } catch (error) {
      answer.error = `this could not be drawn: ${error.message}`;
      console.error(error);
    }
    this.$("result").classList.remove("outdated");
    this.$("problem").textContent = answer.error ? `${answer.error}${this.page ? "\nThe picture is the last good one." : ""}` : "";
    this.$("notes").textContent = (answer.notes ?? []).join("\n");
    const seconds = ((performance.now() - asked) / 1000).toFixed(2);
    this.$("doing").textContent = answer.error ? "" : `computed and drawn in ${seconds} s`;
    this.host.dataset.shown = number;
    this.host.dispatchEvent(new CustomEvent("shown", { detail: answer }));
    if (this.due) this.ask();
  }

  async post(path) {
    try {
      const response = await fetch(path, {
        method: "POST", body: JSON.stringify(this.wanted),
        headers: { "Content-Type": "application/json", "X-Foldyn-Key": this.about.key },
      });
      return response.ok ? await response.json() : { error: await response.text() };
    } catch {
      return { error: "the viewer has ended: start foldyn view again and open the address that it prints" };
    }
  }

  async show({ about, arrays }) {
    const find = (name) => arrays[name];
    if (this.page?.about.kind === about.kind) return this.page.replace(about, find);
    const before = this.page;
    const root = document.createElement("div");
    root.className = "foldyn";
    this.$("foldyn").replaceWith(root);
    const page = new Page(root, about, find);
    if (before) {
      before.close();
      const { azimuth, elevation } = before.camera;
      Object.assign(page.camera, { azimuth, elevation });
      page.theme = before.theme;
    }
    await page.start();
    root.page = this.page = page;
  }

  async save() {
    const answer = await this.post("/case-file");
    this.$("problem").textContent = answer.error ?? "";
    if (answer.text) download(new Blob([answer.text], { type: "text/plain" }), this.about.name);
  }
}

// A number with a slider and a field for those that it does not reach.
class NumberInput {
  constructor(control, changed) {
    Object.assign(this, control, { start: control.value, changed });
    this.row = document.createElement("div");
    this.row.className = "number";
    const label = document.createElement("label");
    label.textContent = this.label.replaceAll("_", " ").replace("youngs", "Young’s").replace("poissons", "Poisson’s");
    this.field = Object.assign(document.createElement("input"), { type: "number", step: this.counts ? 1 : "any" });
    this.field.id = `live-${this.name}`;
    label.htmlFor = this.field.id;
    const unit = document.createElement("span");
    unit.className = "unit";
    unit.textContent = this.unit;
    this.slider = Object.assign(document.createElement("input"), {
      type: "range", step: 1, ...(this.counts ? { min: this.low, max: this.high } : { min: 0, max: SLIDER_STEPS }),
    });
    this.slider.setAttribute("aria-label", label.textContent);
    this.row.append(label, this.field, unit, this.slider);
    this.put(this.value);
    this.slider.addEventListener("input", () => {
      this.put(this.at(Number(this.slider.value)), true);
      this.changed();
    });
    this.field.addEventListener("change", () => {
      const value = this.field.valueAsNumber;
      this.put(Number.isFinite(value) ? value : this.start);
      this.changed();
    });
  }

  // The value at a place of the slider; its start where the slider began.
  at(place) {
    if (this.counts) return place;
    if (place === this.place(this.start)) return this.start;
    const part = place / SLIDER_STEPS;
    const value = this.relative
      ? this.low * (this.high / this.low) ** part : this.low + part * (this.high - this.low);
    return Number(value.toPrecision(SLIDER_DIGITS));
  }

  place(value) {
    if (this.counts) return value;
    const part = this.relative
      ? Math.log(Math.max(value, this.low) / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    return Math.round(SLIDER_STEPS * Math.min(1, Math.max(0, part)));
  }

  put(value, slid = false) {
    this.value = value;
    this.field.value = value;
    if (!slid) this.slider.value = this.place(value);
    this.slider.setAttribute("aria-valuetext", `${value} ${this.unit}`.trim());
    this.row.classList.toggle("changed", value !== this.start);
  }
}

// Start the live page.
export function openLive() {
  const host = document.getElementById("live");
  host.live = new Live(host, JSON.parse(document.getElementById("live.about").textContent));
}
