// Points in the picture: a click asks where in the world a pixel lies; together they have lengths, an area or an angle.
//
// Points are kept in world coordinates and drawn where the newest camera sees them. An angle has three: the fourth begins
// anew.

import {project, segment} from "./camera.js";
import {angleText, angle, letter, lengthText, measure, segments} from "./measure.js";
import {pickable} from "./methods.js";
import {askJson, query} from "./service.js";
import {keptOf} from "./soft_setting.js";

const SVG = "http://www.w3.org/2000/svg",
  POINTS_MOST = 64,
  LABELS_MOST = 16;

export function shape(name, attributes, text = "") {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
}

export class Points extends EventTarget {
  /** Fires "change" when `list` has changed; detail: what was just found, or a text that says why nothing was. */
  constructor(stage, marks) {
    super();
    this.stage = stage;
    this.marks = marks;
    this.list = []; // {position, normal, color, …} as the service describes a pixel
    this.what = "length"; // what they are taken for: "length", "area", "angle"
    this.asked = 0;
    this.before = []; // what `list` was before the last click
    stage.addEventListener("camera", () => this.draw());
    stage.addEventListener("frame", () => this.draw());
  }

  get positions() {
    return this.list.map(({position}) => position);
  }

  /** What they say together, as measure() has it. */
  get measures() {
    return measure(this.positions, this.what, this.stage.dataset?.unit ?? "");
  }

  /** Takes them for something else. */
  choose(what) {
    this.what = what;
    if (what === "angle") this.list = this.list.slice(-3);
    this.changed("");
  }

  /** Where a pixel of the stage lies, or null. */
  async find([x, y]) {
    const {
      dataset,
      size: [width, height],
    } = this.stage;
    const {eye, target, up, fov, projection, view_height, near, far} = this.stage.params();
    const {settings, shown} = this.stage,
      drawn = pickable(shown?.chosen ? {...keptOf(settings), ...shown.chosen} : settings);
    const camera = {eye, target, up, fov, projection, view_height, near, far, width, height};
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
        const full = this.list.length === (this.what === "angle" ? 3 : POINTS_MOST);
        this.list = full ? [found] : [...this.list, found];
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

  removeLast() {
    this.asked++;
    this.list = this.list.slice(0, -1);
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

  /** Lines between them with what they measure. */
  drawLines(at) {
    const {camera, size, dataset} = this.stage,
      {positions, what} = this,
      {length: n} = positions,
      shapes = [];
    const closed = what === "area" && n > 2;
    if (closed && at.every(Boolean))
      shapes.push(shape("polygon", {points: at.map(([x, y]) => `${x},${y}`).join(" ")}));
    const lengths = segments(positions);
    for (let i = 0; i < (closed ? n : n - 1); i++) {
      const line = segment(camera, size, positions[i], positions[(i + 1) % n]);
      if (!line) continue;
      const [[x1, y1], [x2, y2]] = line;
      shapes.push(shape("line", {x1, y1, x2, y2}));
      if (what === "length" && n <= LABELS_MOST) {
        const place = {x: (x1 + x2) / 2, y: (y1 + y2) / 2 - 8, "text-anchor": "middle"};
        shapes.push(shape("text", place, lengthText(lengths[i], dataset.unit, lengths.reduce((a, b) => a + b))));
      }
    }
    const [first] = this.measures,
      seen = at.filter(Boolean);
    if (closed && seen.length) {
      const mean = (k) => seen.reduce((sum, p) => sum + p[k], 0) / seen.length;
      shapes.push(shape("text", {x: mean(0), y: mean(1), "text-anchor": "middle"}, first.text));
    }
    if (what === "angle" && n === 3 && at[1])
      shapes.push(shape("text", {x: at[1][0] + 9, y: at[1][1] + 18}, angleText(angle(...positions))));
    return shapes;
  }

  draw() {
    const {camera, size, dataset} = this.stage;
    if (!camera || !dataset) return;
    const at = this.positions.map((position) => project(camera, size, position));
    const shapes = this.drawLines(at);
    at.forEach((p, i) => {
      if (!p) return;
      shapes.push(shape("circle", {cx: p[0], cy: p[1], r: 5}), shape("text", {x: p[0] + 9, y: p[1] - 7}, letter(i)));
    });
    this.marks.replaceChildren(...shapes);
  }
}
