// The clip box in the picture: its edges, and a handle on each face, which is dragged along the face's axis by mouse or
// finger and moved by arrow keys.

import {along, boxAxes, span} from "./clip_terms.js";
import {FACES} from "./clip.js";
import {add, beam, distance, dot, focal, project, segment, sub, times} from "./camera.js";
import {shape} from "./points.js";

const STEP = 0.01,
  PAGE = 10; // of the dataset's size a key; steps of a page
const EDGE_PX = 14;

export class Handles {
  /** `holder` takes the handles, `marks`, an SVG element, the edges. */
  constructor(stage, clip, holder, marks) {
    Object.assign(this, {stage, clip, holder, marks});
    this.handles = FACES.map((face) => this.make(face));
    holder.append(...this.handles);
    clip.addEventListener("shown", () => this.draw());
    stage.addEventListener("camera", () => this.draw());
    for (const name of ["frame", "state"]) stage.addEventListener(name, () => this.draw());
  }

  make(face) {
    const handle = document.createElement("button");
    handle.type = "button";
    handle.className = "handle";
    handle.setAttribute("role", "slider");
    handle.setAttribute("aria-label", `${face.name} face of the clip box`);
    let drag = null; // {at: of the face, from: along its axis, y}
    handle.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      handle.setPointerCapture(event.pointerId);
      drag = {at: this.clip.faceAt(face), from: this.find(face, event), y: event.clientY};
    });
    handle.addEventListener("pointermove", (event) => {
      if (!drag) return;
      const {camera, size} = this.stage,
        to = drag.from === null ? null : this.find(face, event);
      const by = to === null ? ((drag.y - event.clientY) * distance(camera)) / focal(camera, size[1]) : to - drag.from;
      if (Number.isFinite(by)) this.clip.moveFace(face, drag.at + by);
    });
    for (const name of ["pointerup", "pointercancel"]) handle.addEventListener(name, () => (drag = null));
    handle.addEventListener("keydown", (event) => {
      const steps = {ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: PAGE, PageDown: -PAGE}[event.key];
      if (!steps || event.ctrlKey || event.altKey || event.metaKey) return;
      const fast = event.shiftKey && Math.abs(steps) === 1 ? PAGE : 1;
      this.clip.moveFace(face, this.clip.faceAt(face) + steps * fast * STEP * this.clip.size * 0.5);
      event.preventDefault();
    });
    return handle;
  }

  /** Where the axis through the middle of a face comes nearest to what lies under the pointer, along that axis; null where
   * one looks along it. */
  find(face, event) {
    const {camera, size, element} = this.stage,
      box = element.getBoundingClientRect(),
      {origin, direction} = beam(camera, size, [event.clientX - box.left, event.clientY - box.top]);
    const u = boxAxes(this.clip.box.turn)[face.axis],
      w = sub(this.clip.box.center, origin),
      [b, d] = [dot(u, direction), dot(direction, direction)],
      det = d - b * b;
    if (det < 0.01 * d) return null;
    const t = (b * dot(w, direction) - d * dot(w, u)) / det;
    return along(u, this.clip.box.center) + t;
  }

  draw() {
    const {box} = this.clip,
      {camera, size} = this.stage;
    this.holder.hidden = !box || !camera || !this.stage.dataset;
    if (this.holder.hidden) return this.marks.replaceChildren();
    const axes = boxAxes(box.turn);
    const corner = (signs) => signs.reduce((p, sign, i) => add(p, times(axes[i], sign * box.half[i])), box.center);
    const lines = [];
    for (let axis = 0; axis < 3; axis++)
      for (const a of [-1, 1])
        for (const b of [-1, 1]) {
          const ends = [-1, 1].map((side) => {
            const signs = [a, a, a];
            signs[(axis + 1) % 3] = b;
            signs[axis] = side;
            return corner(signs);
          });
          const line = segment(camera, size, ...ends);
          if (line) lines.push(shape("line", {x1: line[0][0], y1: line[0][1], x2: line[1][0], y2: line[1][1]}));
        }
    this.marks.replaceChildren(...lines);
    FACES.forEach((face, i) => {
      const handle = this.handles[i],
        middle = add(box.center, times(axes[face.axis], face.side * box.half[face.axis])),
        at = project(camera, size, middle),
        value = this.clip.faceAt(face);
      handle.hidden = !at;
      const [low, high] = span(this.stage.dataset.bounds, axes[face.axis]);
      handle.setAttribute("aria-valuemin", Math.min(low, value).toFixed(this.clip.digits));
      handle.setAttribute("aria-valuemax", Math.max(high, value).toFixed(this.clip.digits));
      handle.setAttribute("aria-valuenow", value.toFixed(this.clip.digits));
      handle.setAttribute("aria-valuetext", this.clip.lengthText(value));
      if (!at) return;
      // One whose face lies outside the picture waits at its border.
      const [x, y] = [0, 1].map((k) => Math.min(size[k] - EDGE_PX, Math.max(EDGE_PX, at[k])));
      handle.style.transform = `translate(${x}px, ${y}px)`;
      handle.style.zIndex = String(Math.round(1e4 / Math.max(1e-3, 1 + at[2] / distance(camera))));
    });
  }
}
