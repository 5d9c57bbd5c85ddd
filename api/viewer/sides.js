// Top, Front, Side: an orthographic view from there, and back.

import {add, distance, fromSide, same, sub, unit} from "./camera.js";

const SIDES = ["top", "front", "side"];

/** Which side it looks from, or null. */
function seenFrom({camera, home}) {
  const towards = ({eye, target}) => unit(sub(target, eye)).map((x) => Number(x.toFixed(6)) + 0);
  const from = (name) => same(towards(camera), towards(fromSide(camera, name, home)));
  return (camera.flat && SIDES.find(from)) || null;
}

/** Ties the buttons, by the names of their sides, to the stage. */
export function attachSides(stage, button) {
  let round = null; // the camera before it looked from a side
  for (const name of SIDES)
    button(name).addEventListener("click", () => {
      if (!stage.dataset) return;
      const now = stage.camera;
      if (!now.flat) round = now;
      const {eye, target, up, fov} = round ?? stage.home; // whence it is left again
      const scale = distance(now) / distance({eye, target});
      if (seenFrom(stage) !== name) stage.setCamera(fromSide(now, name, stage.home));
      else stage.setCamera({eye: add(now.target, sub(eye, target).map((x) => x * scale)), target: now.target, up, fov});
    });
  stage.addEventListener("camera", () => {
    const seen = seenFrom(stage);
    for (const name of SIDES) button(name).ariaPressed = String(name === seen);
  });
}
