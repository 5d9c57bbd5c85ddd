// The dataset's views by name: what one shows is set as if it had been chosen by hand, and what is on screen is saved under
// a name, where the service lets who asks.

import {choose} from "./methods.js";
import {params, rounded} from "./camera.js";
import {choices} from "./picture.js";
import {ask, askJson} from "./service.js";
import {keptOf} from "./soft_setting.js";

const $ = (id) => document.getElementById(id);
const FOV_MOST = 179;

export class Views extends EventTarget {
  /** Fires "choose"; detail: the view, or null for the first one. */
  constructor(stage, say) {
    super();
    this.stage = stage;
    $("views").addEventListener("change", ({target}) => {
      const view = stage.dataset?.views.find(({name}) => name === target.value) ?? null;
      if (stage.dataset) this.dispatchEvent(new CustomEvent("choose", {detail: view}));
    });
    $("saving").addEventListener("submit", async (event) => {
      event.preventDefault();
      if (!stage.dataset) return;
      try {
        const name = $("view-name").value;
        await this.save(name);
        say(`Saved as ${name}`);
      } catch (problem) {
        say(`Not saved: ${problem.message}`);
      }
    });
  }

  open(dataset, name = "") {
    choices($("views"), ["", ...dataset.views.map((view) => view.name)], "");
    $("views").options[0].textContent = "the first";
    choose($("views"), name);
    $("views-label").hidden = !dataset.views.length;
  }

  async save(name) {
    const {dataset, camera, settings} = this.stage,
      {eye, target, up, fov} = camera,
      number = (text) => (typeof text === "string" && text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : text);
    const {near: _, far: __, ...shown} = keptOf(settings); // planes are a camera's
    const kept = Object.entries(shown)
      .filter(([, value]) => value !== "")
      .map(([key, value]) => [key, /^(soft_(opacity|cover|blend)|edl_.*)$/.test(key) ? number(value) : `${value}`]);
    const pose = camera.flat // as the picture on screen is asked for
      ? params(rounded(camera), this.stage.back)
      : {eye, target, up, fov: Math.min(FOV_MOST, this.across(fov))};
    const body = {...pose, ...(kept.length ? {settings: Object.fromEntries(kept)} : {})};
    await ask(`${dataset.uri}/views/${encodeURIComponent(name)}`, {
      method: "PUT",
      body: JSON.stringify(body),
      headers: {"Content-Type": "application/json"},
    });
    const {views} = await askJson(dataset.uri);
    dataset.views = views;
    this.open(dataset, name);
  }

  /** Of an image that is narrower than high a saved view says how much it shows across. */
  across(fov) {
    const [width, height] = this.stage.size,
      half = Math.tan((fov * Math.PI) / 360);
    return width >= height ? fov : (Math.atan((half * width) / height) * 360) / Math.PI;
  }
}
