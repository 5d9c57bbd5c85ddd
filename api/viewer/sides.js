// Top, Front, Side: an orthographic view from there of all that there is, and back; a section is looked at likewise.

import {add, axes, distance, dot, fromSide, same, sub, times, unit, upIndex} from "./camera.js";
import {span} from "./clip_terms.js";

const SIDES = ["top", "front", "side"],
  MARGIN = 1.04,
  FAR = 30; // times the default view's distance: heights beyond are strays

const towards = ({eye, target}) => unit(sub(target, eye)).map((x) => Number(x.toFixed(6)) + 0);

/** Which side it looks from, or null. */
function seenFrom({camera, home}) {
  const from = (name) => same(towards(camera), towards(fromSide(camera, name, home)));
  return (camera.flat && SIDES.find(from)) || null;
}

/** The bounds without heights that mean none (-9999) and put the scan beyond what a picture resolves: of where all but a few
 * points lie, the default view alone knows: it holds them from so far. Only heights, for streets and tunnels are as long as that. */
export function withoutStrays({min, max}, home) {
  const up = upIndex(home),
    at = home.target[up],
    far = distance(home);
  const cut = (x) => (Math.abs(x - at) > FAR * far ? at + Math.sign(x - at) * far : x);
  return {min: min.with(up, cut(min[up])), max: max.with(up, cut(max[up]))};
}

/** The camera from that side that shows all of the bounds in a picture of this size; its target stays as deep as it is, if that
 * is within them. */
export function framed(camera, side, home, bounds, [width, height]) {
  const from = fromSide(camera, side, home),
    {right, down, forward} = axes(from),
    middle = bounds.min.map((x, i) => (x + bounds.max[i]) / 2),
    [near, far] = span(bounds, forward),
    depth = Math.min(far, Math.max(near, dot(camera.target, forward))),
    target = add(middle, times(forward, depth - dot(middle, forward)));
  const [across, upright] = [right, down].map((axis) => span(bounds, axis)).map(([low, high]) => high - low);
  const shown = MARGIN * Math.max(upright, (across * height) / width) || distance(camera);
  const back = shown / 2 / Math.tan((camera.fov * Math.PI) / 360);
  return {...from, target, eye: sub(target, times(forward, back))};
}

/** Ties the buttons, by the names of their sides, to the stage; gives what is to be called with the section that has been
 * chosen, or null for none. */
export function attachSides(stage, button) {
  let round = null, // the camera before it looked from a side
    put = null, // the one that was put in its place
    bySection = false; // it was a section that did
  const go = (camera, section) => {
    if (!stage.camera.flat) round = stage.camera;
    [put, bySection] = [camera, section];
    stage.setCamera(camera);
  };
  const frame = (name, section) => {
    const {camera, home, dataset, size} = stage;
    go(framed(camera, name, home, withoutStrays(dataset.bounds, home), size), section);
  };
  const back = () => {
    const now = stage.camera,
      {eye, target, up, fov} = round ?? stage.home;
    bySection = false;
    if (round && now === put) return stage.setCamera(round);
    const scale = distance(now) / distance({eye, target}); // what it has come to look at stays, as large as it is
    stage.setCamera({eye: add(now.target, sub(eye, target).map((x) => x * scale)), target: now.target, up, fov});
  };
  for (const name of SIDES)
    button(name).addEventListener("click", () => {
      if (!stage.dataset) return;
      if (seenFrom(stage) !== name) frame(name, false);
      else back();
    });
  stage.addEventListener("camera", () => {
    const seen = seenFrom(stage);
    for (const name of SIDES) button(name).ariaPressed = String(name === seen);
  });
  return (section) => {
    const {camera, home} = stage;
    if (!section) return bySection && camera.flat && back();
    const along = (one) => Math.abs(dot(towards(one), section.normal)) > 1 - 1e-5;
    if (camera.flat && along(camera)) return undefined;
    const side = SIDES.find((name) => along(fromSide(camera, name, home)));
    if (section.axis !== "view" && side) return frame(side, bySection || !camera.flat);
    return go({...camera, flat: true}, bySection || !camera.flat);
  };
}
