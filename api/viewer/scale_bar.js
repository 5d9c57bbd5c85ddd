// A bar of a round length over an orthographic picture, where one length is as long everywhere.

import {distance, focal} from "./camera.js";
import {roundDown} from "./clip.js";
import {withUnit} from "./measure.js";

const LONGEST = 130; // CSS pixels

/** Ties an element, whose first child is the bar and whose second says how long that is, to the stage. */
export function attachScaleBar(stage, element) {
  const [bar, text] = element.children;
  const draw = () => {
    const {camera, dataset} = stage;
    element.hidden = !dataset || !camera?.flat;
    if (element.hidden) return;
    const pixel = distance(camera) / focal(camera, stage.size[1]),
      long = roundDown(LONGEST * pixel);
    bar.style.width = `${long / pixel}px`;
    text.textContent = withUnit(Number(long.toPrecision(1)), dataset.unit);
  };
  stage.addEventListener("camera", draw);
  stage.addEventListener("frame", draw); // of another size
}
