// What the page says of a dataset and of the frame on screen: size and time, the ends of distances, what a budget chose.

import {withUnit} from "./measure.js";

const $ = (id) => document.getElementById(id);

const thousands = (n) => n.toLocaleString("en").replaceAll(",", "\u202f");

/** "10 651 of 998 728 points, maps of 4 stations, of 2 at a time" */
function describeContents({points, leaf_splats: left, pruned, maps}) {
  const some = maps && maps.at_once < maps.stations ? `, of ${maps.at_once} at a time` : "";
  return (
    (pruned ? `${thousands(left)} of ${thousands(pruned.of)} points` : `${thousands(points)} points`) +
    (maps ? `, maps of ${thousands(maps.stations)} station${maps.stations === 1 ? "" : "s"}${some}` : "")
  );
}

export function showDataset(dataset, device) {
  const size = dataset.bounds.max.map((x, i) => (x - dataset.bounds.min[i]).toFixed(1)).join(" × ");
  $("about").textContent =
    `${describeContents(dataset)}, ${withUnit(size, dataset.unit)}, ` + `drawn by ${device.name.replace(/ \(.*/, "")}`;
  $("description").textContent = dataset.description ?? "";
  $("description").hidden = !dataset.description;
}

export function showFrame(frame, {layer}, dataset) {
  const distances = ["depth", "range"].includes(layer) && frame.near !== null;
  $("legend").hidden = !distances;
  $("primitives").hidden = layer !== "primitive";
  const [near, far] = $("legend").querySelectorAll("span");
  if (distances)
    [near.textContent, far.textContent] = [frame.near, frame.far].map((x) =>
      withUnit(x.toFixed(x < 10 ? 2 : 1), dataset.unit),
    );
  const {frame: rendering, encode = 0} = frame.stages; // nothing was rendered for what comes from a cache
  const took = rendering === undefined ? "kept from before" : `${(rendering + encode).toFixed(0)} ms`;
  const lacks = frame.whole || frame.pending ? "" : dataset.tiles ? ", tiles missing" : ", parts missing";
  $("facts").textContent = `${frame.width} × ${frame.height}, ${took}${frame.full ? lacks : ", coarse"}`;
  if (!frame.full) return;
  const {chosen, promised, demand} = frame;
  $("chosen").textContent = chosen
    ? `Chosen: ${chosen.method}, level ${chosen.lod}, samples a side ${chosen.supersample}` +
      (chosen.maps ? `, maps ${chosen.maps}` : "") +
      (dataset.textures?.methods.includes(chosen.method) ? `, ${chosen.atoms} atoms` : "") +
      `${promised.psnr ? `; ${promised.psnr} dB promised` : ""}${demand === "met" ? "" : `; ${demand}`}`
    : "";
}
