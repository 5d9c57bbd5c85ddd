// Names on points, in the picture at their places and in the link: mark=x,y,z,NAME of the fragment, once for each.

import {project} from "./camera.js";
import {shape} from "./points.js";

const NAME_MOST = 80,
  MARKS_MOST = 50;

/** A name as it is kept: one line, not too long. */
export const cleaned = (text) => [...text.replace(/[\p{Cc}\p{Zl}\p{Zp}]+/gu, " ").trim()].slice(0, NAME_MOST).join("");

/** {position, name} of "x,y,z,NAME"; null of anything else. */
export function parseMark(text) {
  const [x, y, z, ...name] = text.split(","),
    position = [x, y, z].map((part) => (part?.trim() ? Number(part) : NaN)),
    said = cleaned(name.join(","));
  return said && position.every(Number.isFinite) ? {position, name: said} : null;
}

export class Annotations extends EventTarget {
  /** `marks`: an SVG element of their own. Fires "change". */
  constructor(stage, marks) {
    super();
    this.stage = stage;
    this.marks = marks;
    this.list = []; // {position, name, and what else the service said of the pixel}
    stage.addEventListener("camera", () => this.draw());
    stage.addEventListener("frame", () => this.draw());
  }

  /** Those of a fragment. */
  open(marks = []) {
    this.list = [marks].flat().map((mark) => parseMark(`${mark}`)).filter(Boolean).slice(0, MARKS_MOST);
    this.changed();
  }

  /** What the fragment says of them. */
  read() {
    const {length} = this.list;
    return length ? {mark: this.list.map(({position, name}) => [...position.map((x) => Number(x.toFixed(4)) + 0), name].join(","))} : {};
  }

  /** False where there are too many, or the name is empty. */
  add(point, name) {
    const said = cleaned(name);
    if (!said || this.list.length >= MARKS_MOST) return false;
    this.list = [...this.list, {...point, name: said}];
    this.changed();
    return true;
  }

  remove(i) {
    this.list = this.list.toSpliced(i, 1);
    this.changed();
  }

  changed() {
    this.draw();
    this.dispatchEvent(new Event("change"));
  }

  draw() {
    const {camera, size, dataset} = this.stage;
    if (!camera || !dataset) return this.marks.replaceChildren();
    this.marks.replaceChildren(
      ...this.list.flatMap(({position, name}) => {
        const at = project(camera, size, position);
        if (!at) return [];
        const [x, y] = at;
        return [shape("circle", {cx: x, cy: y, r: 4}), shape("text", {x: x + 8, y: y + 14}, name)];
      }),
    );
  }
}
