// The page inside a frame: the picture and navigation, nothing else. The path names the dataset, the fragment camera
// and settings. Tells the page around it {splatd: "camera", eye, target, up, fov} when the camera has come to rest, and
// asks it for {splatd: "token", token} where the service wants one: tokens do not belong in addresses. What `splatd
// sign` has added to its own address lets it look at its dataset without one; it passes that on to what it asks.

import {Annotations} from "./annotations.js";
import {attach} from "./input.js";
import {parse} from "./link.js";
import {loadTable} from "./methods.js";
import {notices, say} from "./notice.js";
import {named, toWorld} from "./place.js";
import {Problem, askJson, setPass, setToken} from "./service.js";
import {keptOf} from "./soft_setting.js";
import {Stage} from "./stage.js";

const id = decodeURIComponent(location.pathname.split("/").pop());
const stage = new Stage(document.getElementById("stage"));
const annotations = new Annotations(stage, document.querySelector(".marks"));
stage.drag = "orbit";
attach(stage);

const signature = location.search.match(/^\?(exp=\d+)&sig=([\w-]+)$/);
if (signature) setPass(`${signature[1]}&embed=${signature[2]}`);

let asked = false;

async function open() {
  try {
    const [dataset] = await Promise.all([askJson(`/v1/datasets/${encodeURIComponent(id)}`), loadTable()]);
    const wrong = [],
      unknown = [],
      wanted = parse(location.hash, wrong, unknown);
    if (wrong.length) throw new Problem("refused", wrong.join(". "));
    const own = await toWorld(dataset, wanted);
    const {dataset: _, view: __, eye, target, up, fov, projection, view_height, units_per_pixel, layer = "color", budget, mark, ...setting} = {
      ...named(dataset, own, stage.size),
      ...own,
    };
    const given = Object.entries({eye, target, up, fov, projection, view_height, units_per_pixel}).filter(([, value]) => value !== undefined);
    document.title = dataset.title ?? id;
    stage.element.ariaLabel = `View of ${id}`;
    stage.settings = budget ? {layer, budget, ...keptOf(setting)} : {layer, ...setting};
    stage.report(null);
    stage.open(dataset, Object.fromEntries(given));
    annotations.open(mark);
    if (unknown.length) say(unknown.join(". "));
  } catch (problem) {
    stage.report(problem);
    if (problem.kind === "token" && !asked) parent.postMessage({splatd: "token"}, "*");
    asked = true;
  }
}

const where = "ask whoever embedded this for a signed URL";
notices(stage, document.getElementById("notice"), document.getElementById("again"), open, where);
stage.addEventListener("frame", ({detail}) => {
  if (detail.full && parent !== window) parent.postMessage({splatd: "camera", ...detail.camera}, "*");
});
addEventListener("message", ({source, data}) => {
  if (source !== parent || data?.splatd !== "token" || typeof data.token !== "string") return;
  setToken(data.token);
  open();
});
addEventListener("hashchange", open);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => stage.refresh());
open();
