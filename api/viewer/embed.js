// The page inside a frame: the picture and navigation, nothing else. The path names the dataset, the fragment camera and
// settings. Tells the page around it {splatd: "camera", eye, target, up, fov} when the camera has come to rest.

import {attach} from "./input.js";
import {parse} from "./link.js";
import {notices} from "./notice.js";
import {askJson} from "./service.js";
import {Stage} from "./stage.js";

const id = decodeURIComponent(location.pathname.split("/").pop());
const stage = new Stage(document.getElementById("stage"));
stage.drag = "orbit";
attach(stage);

async function open() {
  const {eye, target, up, fov, layer = "color", method, lod, supersample, budget} = parse(location.hash);
  const given = Object.entries({eye, target, up, fov}).filter(([, value]) => value !== undefined);
  try {
    const dataset = await askJson(`/v1/datasets/${encodeURIComponent(id)}`);
    document.title = id;
    stage.element.ariaLabel = `View of ${id}`;
    stage.settings = budget ? {layer, budget} : {layer, method, lod, supersample};
    stage.report(null);
    stage.open(dataset, Object.fromEntries(given));
  } catch (problem) {
    stage.report(problem);
  }
}

notices(stage, document.getElementById("notice"), document.getElementById("again"), open);
stage.addEventListener("frame", ({detail}) => {
  if (detail.full && parent !== window) parent.postMessage({splatd: "camera", ...detail.camera}, "*");
});
addEventListener("hashchange", open);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => stage.refresh());
open();
