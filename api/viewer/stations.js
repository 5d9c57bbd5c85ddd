// Places where scanners stood: choosing one puts the eye there, ahead and level. What moves it on from there leaves none chosen.

import {choices} from "./picture.js";
import {stationAt} from "./place.js";

const $ = (id) => document.getElementById(id);
const MOST = 1000; // that are offered

export class Stations {
  constructor(stage, say) {
    this.stage = stage;
    $("stations").addEventListener("change", ({target}) =>
      this.stand(target.value).catch((problem) => say(`Station ${target.value} is not shown: ${problem.message}`)),
    );
    stage.addEventListener("camera", () => {
      if (stage.camera !== this.own) $("stations").value = "";
    });
  }

  /** The stage has its camera, from station `stood` where that is given. */
  open(dataset, stood = "") {
    const numbers = Array.from({length: Math.min(dataset.stations?.count ?? 0, MOST)}, (_, i) => String(i));
    choices($("stations"), ["", ...numbers], String(stood));
    this.own = this.stage.camera;
    $("stations").options[0].textContent = "none";
    $("stations-label").hidden = !numbers.length;
  }

  async stand(number) {
    const {dataset} = this.stage;
    if (number === "" || !dataset) return;
    const place = await stationAt(dataset, number);
    if (this.stage.dataset !== dataset) return;
    this.own = {...place, fov: this.stage.home.fov};
    this.stage.setCamera(this.own);
  }
}
