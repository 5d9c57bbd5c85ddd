// The page: fills the controls from what the service says and ties them to the stage.

import {Chart} from "./chart.js";
import {Gallery} from "./gallery.js";
import {attach} from "./input.js";
import {copy, curl, parse} from "./link.js";
import {Controls, choose, counts, findMethod, listed, loadTable, offered} from "./methods.js";
import {notices} from "./notice.js";
import {named, toWorld} from "./place.js";
import {Points, coordinates, lengthText, withUnit} from "./points.js";
import {Problem, askJson, query, setToken} from "./service.js";
import {Soft} from "./soft.js";
import {opacityOf, softOf} from "./soft_setting.js";
import {Stage} from "./stage.js";
import {Tour} from "./tour.js";
import {editTour} from "./tour_editor.js";
import {renderTours} from "./tour_render.js";

const $ = (id) => document.getElementById(id);
const SETTINGS = ["layer", "method", "lod", "supersample", "budget"]; // and the parameters of methods

const stage = new Stage($("stage"));
const points = new Points(stage, document.querySelector(".marks"));
const chart = new Chart($("chart"));
const tour = new Tour(stage);
const gallery = new Gallery($("gallery"));
attach(stage);

function say(text) {
  $("said").textContent = "";
  $("said").getBoundingClientRect(); // so that the same words are shown, and read, again
  $("said").textContent = text;
}

function choices(select, names, value) {
  select.replaceChildren(...names.map((name) => new Option(name, name, false, name === value)));
}

const thousands = (n) => n.toLocaleString("en").replaceAll(",", "\u202f");

let dataset = null; // that the controls are set for
let parameters = null; // their Controls, once there is a table of them
let colors = {}; // what the fragment says of colours that has no control
let soft = null; // the part of the panel for what is soft, as long

/** What the controls say, as parameters of a view; a budget chooses the others. In place of what the browser's own check
 * refuses stands what `before` has. */
function readSettings(before) {
  const all = [...SETTINGS, ...parameters.names],
    control = (name) => parameters.get(name) ?? $(name);
  const read = (name) => (before && !control(name).checkValidity() ? before[name] : control(name).value) ?? "";
  const settings = Object.fromEntries(all.map((name) => [name, read(name)]));
  for (const name of all) control(name).disabled = settings.budget !== "" && !["layer", "budget"].includes(name);
  for (const parameter of listed()) {
    const {name} = parameter,
      shown = counts(parameter, settings.method, dataset);
    parameters.offer(name, shown);
    if (!shown || settings[name] === "") delete settings[name]; // the service chooses
  }
  $("method-help").textContent = findMethod(settings.method).description;
  stage.coarse = $("moving").value;
  for (const name of ["color_by", "shade"]) if ($(name).value) settings[name] = $(name).value;
  return {...settings, ...colors, ...soft.read()};
}

function writeLink() {
  const {eye, target, up, fov} = stage.params();
  const {budget, ...setting} = stage.settings;
  history.replaceState(
    null,
    "",
    `#${query({
      dataset: stage.dataset.id,
      eye,
      target,
      up,
      fov,
      layer: setting.layer,
      ...(budget ? {budget, ...softOf(setting)} : setting),
    })}`,
  );
}

let opening = 0; // counts calls of open(): the last one wins
let opened = 0; // the one whose dataset and camera the stage has

/** The gallery in place of a view, or the other way round. */
function showGallery(datasets) {
  for (const part of [stage.element, $("panel")]) part.hidden = Boolean(datasets);
  if (!datasets) return gallery.hide();
  stage.close();
  stage.report(null);
  document.title = "Datasets – splatd";
  gallery.show(datasets);
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
    const wanted = parse(fragment);
    const ids = datasets.map(({id}) => id);
    if (turn !== opening) return;
    if (!wanted.dataset && datasets.length > 1) return showGallery(datasets);
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
    Object.assign(wanted, named(found, wanted, stage.size), await toWorld(found, wanted));
    if (turn !== opening) return;
    dataset = found;
    parameters ??= new Controls($("method-help"));
    if (!soft) {
      soft = new Soft();
      soft.addEventListener("change", () => stage.dataset && stage.set(readSettings(stage.settings)));
    }
    stage.pixels = limits.pixels;
    $("making-of").hidden = !tours;
    choices($("layer"), dataset.layers, wanted.layer ?? "color");
    const shown = ["height", "normal", ...dataset.attributes.map(({name}) => name)];
    $("color_by").replaceChildren(new Option("its own", ""), ...shown.map((name) => new Option(name)));
    choose($("color_by"), wanted.color_by ?? "");
    choose($("shade"), wanted.shade ?? "");
    colors = Object.fromEntries(["ramp", "range", "edl_strength", "edl_radius"].filter((name) => name in wanted).map((name) => [name, wanted[name]]));
    choices($("method"), dataset.methods, offered(wanted.method, dataset));
    $("lod").value = wanted.lod ?? 1;
    choose($("supersample"), wanted.supersample ?? 1);
    for (const parameter of listed()) parameters.set(parameter, wanted[parameter.name]);
    soft.open(dataset, wanted);
    $("soft").open ||= Boolean(wanted.soft);
    choose($("budget"), wanted.budget ?? "");
    stage.settings = readSettings();
    const size = dataset.bounds.max.map((x, i) => (x - dataset.bounds.min[i]).toFixed(1)).join(" × ");
    $("about").textContent =
      `${describeContents(dataset)}, ${withUnit(size, dataset.unit)}, ` +
      `drawn by ${device.name.replace(/ \(.*/, "")}`;
    $("description").textContent = dataset.description ?? "";
    $("description").hidden = !dataset.description;
    choices($("views"), ["", ...dataset.views.map(({name}) => name)], "");
    $("views").options[0].textContent = "the first";
    choose($("views"), wanted.view ?? "");
    $("views-label").hidden = !dataset.views.length;
    document.title = `${dataset.title ?? id} – splatd`;
    stage.element.ariaLabel = `View of ${id}`;
    stage.report(null);
    const camera = Object.fromEntries(
      ["eye", "target", "up", "fov"].filter((n) => wanted[n]).map((n) => [n, wanted[n]]),
    );
    opened = turn;
    stage.open(dataset, camera);
    points.clear();
    tour.open(id);
    chart.open(dataset);
  } catch (problem) {
    if (turn !== opening) return;
    stage.close();
    stage.report(problem);
  }
}

/** "10 651 of 998 728 points, maps of 4 stations, of 2 at a time" */
function describeContents({points, leaf_splats: left, pruned, maps}) {
  const some = maps && maps.at_once < maps.stations ? `, of ${maps.at_once} at a time` : "";
  return (
    (pruned ? `${thousands(left)} of ${thousands(pruned.of)} points` : `${thousands(points)} points`) +
    (maps ? `, maps of ${thousands(maps.stations)} station${maps.stations === 1 ? "" : "s"}${some}` : "")
  );
}

function showFrame({detail: frame}) {
  const distances = ["depth", "range"].includes(stage.settings.layer) && frame.near !== null;
  $("legend").hidden = !distances;
  $("primitives").hidden = stage.settings.layer !== "primitive";
  const [near, far] = $("legend").querySelectorAll("span");
  if (distances)
    [near.textContent, far.textContent] = [frame.near, frame.far].map((x) =>
      withUnit(x.toFixed(x < 10 ? 2 : 1), dataset.unit),
    );
  const {frame: rendering, encode = 0} = frame.stages; // nothing was rendered for what comes from a cache
  const took = rendering === undefined ? "kept from before" : `${(rendering + encode).toFixed(0)} ms`;
  $("facts").textContent = `${frame.width} × ${frame.height}, ${took}${frame.full ? "" : ", coarse"}`;
  chart.show(frame, frame.full ? stage.settings : {});
  if (!frame.full) return;
  const {chosen, promised, demand} = frame;
  $("chosen").textContent = chosen
    ? `Chosen: ${chosen.method}, level ${chosen.lod}, samples a side ${chosen.supersample}` +
      (chosen.maps ? `, maps ${chosen.maps}` : "") +
      (dataset.textures?.methods.includes(chosen.method) ? `, ${chosen.atoms} atoms` : "") +
      `${promised.psnr ? `; ${promised.psnr} dB promised` : ""}${demand === "met" ? "" : `; ${demand}`}`
    : "";
  if (opened === opening) writeLink(); // else it names what comes next
}

/** [term, text] rows into a <dl>. */
function fill(list, rows) {
  list.replaceChildren(
    ...rows.flat().map((text, i) => {
      const cell = document.createElement(i % 2 ? "dd" : "dt");
      cell.textContent = text;
      return cell;
    }),
  );
}

/** As what a point is drawn, and how far off the points are that its panel stands for. */
function describePrimitive({primitive, plane}) {
  if (!primitive) return [];
  const off = plane && [plane.error_mean, plane.error_most].map((x) => lengthText(x, dataset.unit));
  return [
    ["drawn as", primitive],
    ...(plane
      ? [
          ["normal", coordinates(plane.normal)],
          ["points off it", `${off[0]}, at most ${off[1]}`],
        ]
      : []),
  ];
}

function showPoints({detail}) {
  const rows = points.list.map(({position}, i) => ["AB"[i], coordinates(position)]);
  if (points.distance !== null) rows.push(["A – B", points.distanceText]);
  fill($("points"), rows);
  fill($("primitive"), describePrimitive(points.list.at(-1) ?? {}));
  const had = Object.entries(points.list.at(-1)?.attributes ?? {}).filter(([, value]) => value !== null);
  fill(
    $("attributes"),
    had.map(([name, value]) => [name.replaceAll("_", " "), `${+value.toPrecision(9)}`]),
  );
  $("clear").disabled = !points.list.length;
  if (typeof detail === "string") say(detail);
  else
    say(
      points.distance === null
        ? `Point at ${coordinates(detail.position)}`
        : `Point at ${coordinates(detail.position)}; distance ${points.distanceText}`,
    );
}

/** Double click: turns towards what is there, which is then what one orbits. */
async function lookAt({detail: pixel}) {
  points.undo();
  const found = await points.find(pixel).catch(() => null);
  if (!found) return say("Nothing there");
  const {eye, target} = stage.camera;
  const began = performance.now(),
    span = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 300; // ms
  const step = (now) => {
    const t = Math.min(1, Math.max(0, (now - began) / span));
    const s = t * t * (3 - 2 * t);
    stage.setCamera({...stage.camera, eye, target: target.map((x, i) => x + s * (found.position[i] - x))});
    if (t < 1) requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}

async function copied(text, what) {
  say((await copy(text)) ? `${what} copied` : text);
}

stage.addEventListener("frame", showFrame);
stage.addEventListener("click", ({detail}) => points.add(detail));
stage.addEventListener("dblclick", lookAt);
points.addEventListener("change", showPoints);
notices(stage, $("notice"), $("again"), open, "enter it in the panel, under Token");
stage.addEventListener("state", ({detail: problem}) => {
  $("token").hidden = problem?.kind !== "token";
  if (!$("token").hidden) fold($("toggle"), $("panel"), true); // the field lies there
});
tour.addEventListener("fade", () => soft?.showOpacity(opacityOf(stage.settings)));
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
$("views").addEventListener("change", () => {
  const view = $("views").value;
  if (stage.dataset) stage.setCamera(view ? named(stage.dataset, {view}, stage.size) : stage.home);
});
$("home").addEventListener("click", () => stage.dataset && stage.setCamera(stage.home));
$("link").addEventListener("click", () => copied(location.href, "Link"));
$("curl").addEventListener("click", () => stage.dataset && copied(curl(stage.url(), stage.settings.layer), "Command"));
$("clear").addEventListener("click", () => points.clear());
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
