// Points in the picture: a click asks where in the world a pixel lies, two of them have a distance.
//
// Points are kept in world coordinates and drawn where the newest camera sees them. The third click begins anew.

import {length, project, sub} from "./camera.js";
import {pickable} from "./methods.js";
import {askJson, query} from "./service.js";

const SVG = "http://www.w3.org/2000/svg";

function shape(name, attributes, text = "") {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
}

/** A length in the dataset's unit, as people read it. */
export const lengthText = (x, unit) =>
  unit === "m" && x < 1 ? `${(x * 1000).toFixed(1)} mm` : withUnit(x < 1 ? x.toPrecision(4) : x.toFixed(3), unit);
/** Units without a name are numbers of metres: "0.201168 m". */
export const withUnit = (text, unit) => `${text} ${/^\d/.test(unit) ? "× " : ""}${unit}`;
export const coordinates = (p) => p.map((x) => (Math.round(x * 1000) / 1000 + 0).toFixed(3)).join(", ");

export class Points extends EventTarget {
  /** Fires "change" when `list` has changed; detail: what was just found, or a text that says why nothing was. */
  constructor(stage, marks) {
    super();
    this.stage = stage;
    this.marks = marks;
    this.list = []; // {position, normal, color, …} as the service describes a pixel
    this.asked = 0;
    this.before = []; // what `list` was before the last click
    stage.addEventListener("camera", () => this.draw());
    stage.addEventListener("frame", () => this.draw());
  }

  get distance() {
    return this.list.length === 2 ? length(sub(this.list[1].position, this.list[0].position)) : null;
  }

  /** The same for people; null without two points. */
  get distanceText() {
    return this.distance === null ? null : lengthText(this.distance, this.stage.dataset.unit);
  }

  /** Where a pixel of the stage lies, or null. */
  async find([x, y]) {
    const {
      dataset,
      size: [width, height],
    } = this.stage;
    const {eye, target, up, fov, projection, view_height} = this.stage.params();
    const drawn = pickable(this.stage.shown?.chosen ?? this.stage.settings);
    const camera = {eye, target, up, fov, projection, view_height, width, height};
    const found = await askJson(`${dataset.uri}/pick?${query({x, y, ...camera, ...drawn})}`);
    return found.position ? found : null;
  }

  async add(pixel) {
    const turn = ++this.asked;
    this.before = this.list;
    let said = "Nothing there";
    try {
      const found = await this.find(pixel);
      if (turn !== this.asked) return;
      if (found) {
        this.list = this.list.length === 2 ? [found] : [...this.list, found];
        said = found;
      }
    } catch (problem) {
      said = problem.message;
    }
    this.changed(said);
  }

  /** The last click was something else. */
  undo() {
    this.asked++;
    this.list = this.before;
    this.changed("");
  }

  clear() {
    this.asked++;
    this.list = [];
    this.changed("");
  }

  changed(detail) {
    this.draw();
    this.dispatchEvent(new CustomEvent("change", {detail}));
  }

  draw() {
    const {camera, size} = this.stage;
    if (!camera) return;
    const at = this.list.map(({position}) => project(camera, size, position));
    const shapes = [];
    if (at.length === 2 && at[0] && at[1]) {
      const [[x1, y1], [x2, y2]] = at;
      const [x, y] = [(x1 + x2) / 2, (y1 + y2) / 2 - 8];
      shapes.push(
        shape("line", {x1, y1, x2, y2}),
        shape("text", {x, y, "text-anchor": "middle"}, this.distanceText),
      );
    }
    at.forEach((p, i) => {
      if (!p) return;
      shapes.push(shape("circle", {cx: p[0], cy: p[1], r: 5}), shape("text", {x: p[0] + 9, y: p[1] - 7}, "AB"[i]));
    });
    this.marks.replaceChildren(...shapes);
  }
}
