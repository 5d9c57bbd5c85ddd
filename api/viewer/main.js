// The page: ties the parts of the panel to the stage, and opens what the fragment names.

import {Annotations} from "./annotations.js";
import {fromParams} from "./camera.js";
import {Chart} from "./chart.js";
import {Classes} from "./classes.js";
import {Clip} from "./clip.js";
import {Handles} from "./clip_handles.js";
import {Colors} from "./colors.js";
import {showDataset, showFrame} from "./facts.js";
import {Gallery} from "./gallery.js";
import {attach} from "./input.js";
import {copy, curl, parse} from "./link.js";
import {loadTable} from "./methods.js";
import {notices, say} from "./notice.js";
import {choices, Picture} from "./picture.js";
import {named, toWorld} from "./place.js";
import {Points} from "./points.js";
import {showPoints} from "./points_panel.js";
import {attachScaleBar} from "./scale_bar.js";
import {Problem, askJson, query, setToken} from "./service.js";
import {attachSides} from "./sides.js";
import {Soft} from "./soft.js";
import {keptOf, opacityOf} from "./soft_setting.js";
import {Stage} from "./stage.js";
import {Stations} from "./stations.js";
import {Tour} from "./tour.js";
import {editTour} from "./tour_editor.js";
import {renderTours} from "./tour_render.js";
import {Views} from "./views.js";

const $ = (id) => document.getElementById(id);
const CAMERA = ["eye", "target", "up", "fov", "projection", "view_height", "units_per_pixel"];
const cameraOf = (wanted) => Object.fromEntries(CAMERA.filter((name) => wanted[name]).map((name) => [name, wanted[name]]));

const stage = new Stage($("stage"));
const points = new Points(stage, $("marks"));
const annotations = new Annotations(stage, $("names"));
const chart = new Chart($("chart"));
const tour = new Tour(stage);
const gallery = new Gallery($("gallery"));
const clip = new Clip(stage);
const classes = new Classes();
const views = new Views(stage, say);
const stations = new Stations(stage, say);
new Handles(stage, clip, $("handles"), $("box"));
attach(stage);

let dataset = null; // that the controls are set for
let parts = null; // {picture, colors, soft}, once there is a table of methods
let planes = {}; // near and far of the fragment, which have no control

/** What the controls say, as parameters of a view. */
function readSettings(before) {
  stage.coarse = $("moving").value;
  const {picture, colors, soft} = parts;
  return {...picture.read(before), ...colors.read(), ...soft.read(), ...clip.read(), ...classes.read(), ...planes};
}

/** Sets the controls to what a fragment or a view by name says. */
function show(wanted) {
  const {picture, colors, soft} = parts;
  picture.open(dataset, wanted);
  showKept(wanted);
  soft.open(dataset, wanted);
  $("soft").open ||= Boolean(wanted.soft);
  colors.open(dataset, wanted);
}

function showKept(wanted) {
  clip.open(dataset, wanted.clip);
  classes.open(dataset, wanted.class);
  planes = Object.fromEntries(["near", "far"].filter((name) => name in wanted).map((name) => [name, wanted[name]]));
}

function makeParts() {
  if (parts) return;
  parts = {picture: new Picture(), colors: new Colors(), soft: new Soft()};
  for (const part of [parts.colors, parts.soft, classes, clip])
    part.addEventListener("change", () => stage.dataset && stage.set(readSettings(stage.settings)));
  clip.addEventListener("input", () => stage.dataset && stage.slide(readSettings(stage.settings)));
}

function writeLink() {
  const {eye, target, up, fov, projection, view_height, near, far} = stage.params();
  const {budget, ...setting} = {...stage.settings, near, far};
  const camera = {eye, target, up, fov, projection, view_height};
  const drawn = budget ? {budget, ...keptOf(setting)} : setting;
  const fragment = query({dataset: stage.dataset.id, ...camera, layer: setting.layer, ...drawn, ...annotations.read()});
  history.replaceState(null, "", `#${fragment}`);
}

let opening = 0; // counts calls of open(): the last one wins
let opened = 0; // the one whose dataset and camera the stage has

/** The gallery in place of a view, or the other way round. */
function showGallery(datasets, kept) {
  for (const part of [stage.element, $("panel")]) part.hidden = Boolean(datasets);
  if (!datasets) return gallery.hide();
  stage.close();
  stage.report(null);
  document.title = "Datasets – splatd";
  gallery.show(datasets, kept);
  clearTimeout(again);
  if (datasets.some(({state}) => state === "loading")) again = setTimeout(() => gallery.shown && open(), 3000);
}
let again = 0; // the timer of a gallery with datasets that are being loaded

/** Opens what the fragment names, else the one dataset that there is, else shows all. */
async function open() {
  const turn = ++opening,
    fragment = location.hash;
  try {
    const [{datasets}, {limits, device, tours}] = await Promise.all([
      askJson("/v1/datasets"),
      askJson("/v1/status"),
      loadTable(),
    ]);
    const wrong = [],
      wanted = parse(fragment, wrong);
    const ids = datasets.map(({id}) => id);
    if (turn !== opening) return;
    const complain = () => wrong.length && say(wrong.join(". "));
    if (!wanted.dataset && datasets.length > 1) return complain(), showGallery(datasets, keptOf(wanted));
    if (gallery.shown) showGallery(null);
    const id = wanted.dataset ?? datasets[0]?.id;
    if (!id) throw new Problem("gone", "No dataset is served yet", 5);
    const found = await askJson(`/v1/datasets/${encodeURIComponent(id)}`).catch((problem) => problem);
    if (turn !== opening) return;
    choices($("dataset"), ids.includes(id) ? ids : [...ids, id], id);
    for (const {id: other, title} of datasets)
      if (title) [...$("dataset").options].find(({value}) => value === other).textContent = title;
    $("all").hidden = ids.length < 2;
    if (found instanceof Error) throw found;
    const given = await toWorld(found, wanted);
    Object.assign(wanted, named(found, given, stage.size), given);
    if (turn !== opening) return;
    dataset = found;
    $("panel").classList.remove("idle");
    makeParts();
    stage.pixels = limits.pixels;
    $("making-of").hidden = !tours;
    show(wanted);
    stage.settings = readSettings();
    showDataset(dataset, device);
    views.open(dataset, wanted.view);
    document.title = `${dataset.title ?? id} – splatd`;
    stage.element.ariaLabel = `View of ${id}`;
    stage.report(null);
    const camera = cameraOf(wanted);
    opened = turn;
    stage.open(dataset, camera);
    stations.open(dataset, wanted.station);
    clip.show(); // what it cuts depends on where one looks
    points.clear();
    annotations.open(wanted.mark);
    tour.open(id);
    chart.open(dataset);
    complain();
  } catch (problem) {
    if (turn !== opening) return;
    stage.close();
    stage.report(problem);
  }
}

/** Double click: turns towards what is there, which is then what one orbits. */
async function lookAt({detail: pixel}) {
  points.undo();
  const found = await points.find(pixel).catch(() => null);
  if (!found) return say("Nothing there");
  const {eye, target} = stage.camera;
  let own = stage.camera; // until a link or a hand puts another in its place
  const began = performance.now(),
    span = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 300; // ms
  const step = (now) => {
    if (stage.camera !== own) return;
    const t = Math.min(1, Math.max(0, (now - began) / span));
    const s = t * t * (3 - 2 * t);
    stage.setCamera((own = {...own, eye, target: target.map((x, i) => x + s * (found.position[i] - x))}));
    if (t < 1) requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}

async function copied(text, what) {
  say((await copy(text)) ? `${what} copied` : text);
}

stage.addEventListener("frame", ({detail: frame}) => {
  showFrame(frame, stage.settings, dataset);
  chart.show(frame, frame.full ? stage.settings : {});
  if (frame.full && opened === opening) writeLink(); // else it names what comes next
});
stage.addEventListener("click", ({detail}) => points.add(detail));
stage.addEventListener("dblclick", lookAt);
showPoints(points, annotations, say);
annotations.addEventListener("change", () => stage.shown?.full && opened === opening && writeLink());
notices(stage, $("notice"), $("again"), open, "enter it in the panel, under Token");
stage.addEventListener("state", ({detail: problem}) => {
  $("token").hidden = problem?.kind !== "token";
  if (!$("token").hidden) fold($("toggle"), $("panel"), true); // the field lies there
});
tour.addEventListener("fade", () => parts?.soft.showOpacity(opacityOf(stage.settings)));
editTour(tour, say);
renderTours(tour, say);

$("picture").addEventListener("change", ({target}) => {
  if (!target.checkValidity()) say(target.validationMessage);
  else if (stage.dataset) stage.set(readSettings(stage.settings));
});
for (const radio of document.querySelectorAll("[name=drag]"))
  radio.addEventListener("change", () => (stage.drag = radio.value));
stage.drag = document.querySelector("[name=drag]:checked").value; // browsers keep it over a reload
$("dataset").addEventListener("change", () => {
  location.hash = query({dataset: $("dataset").value, layer: $("layer").value});
});
views.addEventListener("choose", ({detail: view}) => {
  const wanted = view ? named(dataset, {view: view.name}, stage.size) : {};
  show({...parts.picture.read(), ...wanted});
  stage.set(readSettings());
  stage.setCamera(view ? fromParams(cameraOf(wanted), stage.home) : stage.home);
});
$("home").addEventListener("click", () => stage.dataset && stage.setCamera(stage.home));
const faceSection = attachSides(stage, $);
clip.addEventListener("section", ({detail}) => stage.dataset && faceSection(detail));
attachScaleBar(stage, $("scale"));
$("link").addEventListener("click", () => copied(location.href, "Link"));
$("curl").addEventListener("click", () => stage.dataset && copied(curl(stage.url(), stage.settings.layer), "Command"));
$("token").addEventListener("submit", (event) => {
  event.preventDefault();
  setToken($("token").querySelector("input").value);
  $("token").hidden = true;
  open();
});
function fold(button, target, shown) {
  target.hidden = !shown;
  button.ariaExpanded = String(shown);
}
$("toggle").addEventListener("click", () => fold($("toggle"), $("panel"), $("panel").hidden));
$("accuracy").addEventListener("click", () => fold($("accuracy"), $("chart"), $("chart").hidden));
addEventListener("keydown", (event) => event.key === "Escape" && points.list.length && points.clear());
addEventListener("hashchange", open);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  if (gallery.shown) gallery.redraw();
  else stage.refresh();
});
open();
