// What is cut away: a box, a section, and other conditions as text, as controls of the panel. The handles in the picture
// (clip_handles.js) change the same box.

import {axes, distance, sub, unit} from "./camera.js";
import {AXES, along, boxAxes, formatClip, parseClip, span} from "./clip_terms.js";
import {withUnit} from "./measure.js";

const $ = (id) => document.getElementById(id);
const STEPS = 500,
  LEAST = 1e-3; // of a side, as a share of the dataset's size

/** 1, 2 or 5 times a power of ten, not above x. */
export function roundDown(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return [5, 2, 1].find((n) => n * power <= x * 1.001) * power;
}

/** The faces: of which axis, at which end. */
export const FACES = [0, 1, 2].flatMap((axis) => [-1, 1].map((side) => ({axis, side, name: `${side < 0 ? "Low" : "High"} ${"xyz"[axis]}`})));

export class Clip extends EventTarget {
  /** Fires "input" while a control moves, "change" when one has been set, and "section" when one has been chosen; detail: the
   * section, or null for none. */
  constructor(stage) {
    super();
    this.stage = stage;
    this.text = "";
    this.box = this.section = null; // as parseClip() has them
    this.rows = FACES.map((face) => this.makeSlider(face));
    $("box-sides").append(...this.rows.map(([, , cell]) => cell));
    $("box-on").addEventListener("change", () => this.set({box: $("box-on").checked ? this.around() : null}));
    $("box-keep").addEventListener("change", () => this.setBox({outside: $("box-keep").value === "outside"}));
    $("box-turn").addEventListener("input", () => this.setBox({turn: Number($("box-turn").value)}, true));
    $("section-axis").addEventListener("change", () => this.choose($("section-axis").value));
    $("section-here").addEventListener("click", () => this.choose("view"));
    $("section-at").addEventListener("input", () => this.setSection({at: Number($("section-at").value)}, true));
    $("section-thick").addEventListener("change", ({target}) => {
      if (target.checkValidity() && Number(target.value) > 0) this.setSection({thick: Number(target.value)});
    });
    $("clip-rest").addEventListener("change", ({target}) => this.write({...this.state, rest: target.value}));
    $("clip-clear").addEventListener("click", () => {
      this.set({box: null, section: null, rest: ""});
      this.tellSection();
    });
  }

  get state() {
    const {box, section, rest} = this;
    return {box, section, rest};
  }

  get middle() {
    const {min, max} = this.dataset.bounds;
    return min.map((x, i) => (x + max[i]) / 2);
  }

  makeSlider({axis, side, name}) {
    const [label, slider] = [document.createElement("label"), document.createElement("input")];
    slider.type = "range";
    slider.id = `box-${"xyz"[axis]}${side < 0 ? 0 : 1}`;
    label.htmlFor = slider.id;
    label.textContent = name;
    slider.addEventListener("input", () => this.moveFace({axis, side}, Number(slider.value)));
    const cell = document.createElement("div");
    cell.append(label, slider);
    return [label, slider, cell];
  }

  /** Another dataset, and what of it is cut away by now. */
  open(dataset, text = "") {
    this.dataset = dataset;
    const {min, max} = dataset.bounds;
    this.size = Math.hypot(...sub(max, min)) || 1;
    this.digits = Math.min(9, Math.max(0, 5 - Math.floor(Math.log10(this.size))));
    this.text = text;
    Object.assign(this, parseClip(text));
    this.show();
  }

  /** What of a view it says. */
  read() {
    return this.text ? {clip: this.text} : {};
  }

  /** A box around what one looks at, so that its faces are in the picture. */
  around() {
    const {camera} = this.stage,
      {min, max} = this.dataset.bounds,
      reach = 0.5 * distance(camera) * Math.tan((camera.fov * Math.PI) / 360);
    const ends = camera.target.map((x, i) => {
      const half = Math.max(reach, LEAST * this.size);
      const [low, high] = [Math.max(min[i], x - half), Math.min(max[i], x + half)];
      return high - low > LEAST * this.size ? [low, high] : [x - half, x + half];
    });
    return {outside: false, center: ends.map(([a, b]) => (a + b) / 2), half: ends.map(([a, b]) => (b - a) / 2), turn: 0};
  }

  /** Where a face is along its own axis. */
  faceAt({axis, side}) {
    const {center, half, turn} = this.box;
    return along(boxAxes(turn)[axis], center) + side * half[axis];
  }

  /** Puts it there; the face opposite stays. */
  moveFace({axis, side}, at) {
    const {center, half, turn} = this.box,
      direction = boxAxes(turn)[axis],
      opposite = this.faceAt({axis, side: -side}),
      width = Math.max((at - opposite) * side, LEAST * this.size),
      shift = side * (width / 2 - half[axis]);
    this.setBox({center: center.map((x, i) => x + direction[i] * shift), half: half.map((x, i) => (i === axis ? width / 2 : x))}, true);
  }

  setBox(values, moving = false) {
    if (this.box) this.set({box: {...this.box, ...values}}, moving);
  }

  setSection(values, moving = false) {
    if (this.section) this.set({section: {...this.section, ...values}}, moving);
  }

  /** A section along an axis, through what one looks at; "view": straight ahead. */
  choose(name) {
    const {camera} = this.stage,
      normal = AXES[name] ?? unit(axes(camera).forward);
    const [low, high] = span(this.dataset.bounds, normal);
    const thick = this.section?.thick ?? roundDown((high - low || this.size) / 20);
    this.set({section: name ? {axis: name, normal, at: along(normal, camera.target), thick} : null});
    this.tellSection();
  }

  tellSection() {
    this.dispatchEvent(new CustomEvent("section", {detail: this.section}));
  }

  set(values, moving = false) {
    Object.assign(this, values);
    this.write(this.state, moving);
  }

  write(state, moving = false) {
    this.text = formatClip(state, this.digits, this.middle);
    if (!moving) Object.assign(this, parseClip(this.text)); // text may have become controls
    this.show();
    this.dispatchEvent(new Event(moving ? "input" : "change"));
  }

  lengthText(x) {
    const digits = Math.min(3, this.digits);
    return withUnit((Number(x.toFixed(digits)) + 0).toFixed(digits), this.dataset.unit);
  }

  /** A slider with what it says, from where to where it goes. */
  showSlider(slider, label, text, [low, high], value, said = this.lengthText(value)) {
    const [least, most] = [Math.min(low, value), Math.max(high, value)];
    Object.assign(slider, {min: least, max: most, step: (most - least) / STEPS || 1e-6});
    if (document.activeElement !== slider || Math.abs(slider.valueAsNumber - value) > slider.step) slider.value = value;
    label.textContent = `${text}\n${said}`;
    slider.setAttribute("aria-valuetext", said);
  }

  show() {
    const {box, section, dataset} = this;
    $("box-on").checked = Boolean(box);
    $("box-controls").hidden = !box;
    if (box) {
      $("box-keep").value = box.outside ? "outside" : "inside";
      $("box-turn").value = box.turn;
      $("box-turn-label").textContent = `Turned by ${Number(box.turn.toFixed(1))}°`;
      FACES.forEach((face, i) => {
        const [label, slider] = this.rows[i];
        this.showSlider(slider, label, face.name, span(dataset.bounds, boxAxes(box.turn)[face.axis]), this.faceAt(face));
      });
    }
    $("section-axis").value = section?.axis ?? "";
    $("section-controls").hidden = !section;
    $("section-here").hidden = section?.axis !== "view";
    if (section) {
      const {normal, axis, at} = section, // of a direction nobody knows how far along it lies
        said = axis === "view" ? `${this.lengthText(at - along(normal, this.middle))} behind the middle` : this.lengthText(at);
      this.showSlider($("section-at"), $("section-at-label"), "At", span(dataset.bounds, normal), at, said);
      if (document.activeElement !== $("section-thick")) $("section-thick").value = Number(section.thick.toPrecision(6));
      $("section-unit").textContent = dataset.unit;
    }
    $("clip-rest").value = this.rest;
    $("clip-clear").disabled = !this.text;
    $("clip").open ||= Boolean(this.text);
    this.dispatchEvent(new Event("shown"));
  }
}
