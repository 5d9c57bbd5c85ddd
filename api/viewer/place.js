// Cameras by longitude and latitude, which the service knows where to find in the dataset's world, in which everything else
// here thinks; by the names that the dataset's views have; and by the numbers of its stations.

import {add, distance, fitted, times, upOf} from "./camera.js";
import {Problem, ask, askJson, query} from "./service.js";

/** Eye, target and up of a station: ahead by a tenth of the dataset's size. */
export async function stationAt(dataset, number) {
  if (!(number < (dataset.stations?.count ?? 0))) throw new Problem("gone", `${dataset.id} has no station ${number}`);
  const {min, max} = dataset.bounds,
    ahead = distance({eye: min, target: max}) / 10 || 1;
  const {stations} = await askJson(`${dataset.stations.uri}?${query({first: number, count: 1})}`),
    [{world: eye, forward, up}] = stations;
  return {eye, target: add(eye, times(forward, ahead)), up};
}

/** `wanted` with eye and target in the world; they are in its coordinate system `crs` where it names one, and at its station. */
export async function toWorld(dataset, {crs, station, ...wanted}) {
  if (station !== undefined) return {...(await stationAt(dataset, station)), ...(await toWorld(dataset, {crs, ...wanted}))};
  if (!crs) return wanted;
  const clip = wanted.clip && (await clipToWorld(dataset, crs, wanted));
  const find = async (name) => {
    const place = await askJson(`${dataset.uri}/place?${query({crs, position: wanted[name]})}`);
    return [name, place.world];
  };
  const named = ["eye", "target"].filter((name) => wanted[name]);
  return {...wanted, ...(clip && {clip}), ...Object.fromEntries(await Promise.all(named.map(find)))};
}

/** What is cut away as the service says that it has understood it. */
async function clipToWorld(dataset, crs, {eye, target, clip}) {
  const reply = await ask(`${dataset.view}?${query({crs, eye, target, clip})}`, {method: "HEAD"}),
    said = reply.headers.get("Splatd-Clip");
  if (!said) throw new Problem("refused", "What is cut away is too long to be turned into the dataset's coordinates");
  return JSON.parse(said).clip.join(" and ");
}

/** Camera, as a view's parameters, and settings of the view that `wanted`, in the world, names, in an image of this size; nothing
 * where it names none. */
export function named(dataset, {view: name, fov: own, ...wanted}, size) {
  if (name === undefined) return {};
  const view = dataset.views.find((one) => one.name === name);
  if (!view) throw new Problem("gone", `${dataset.id} has no view '${name}'`);
  const {eye, target, up, fov, projection, view_height, settings} = view;
  const kind = wanted.projection ?? (own === undefined ? projection : undefined),
    isFlat = kind === "orthographic" || (wanted.view_height ?? wanted.units_per_pixel) !== undefined;
  const text = (value, joint) => [value].flat().join(joint);
  return {
    ...settings,
    ...(settings?.clip && {clip: text(settings.clip, " and ")}),
    ...(settings?.soft && {soft: text(settings.soft, " or ")}),
    ...(settings && "class" in settings && {class: text(settings.class, ",")}),
    eye,
    target,
    up: isFlat ? upOf({up}, {eye, target, ...wanted}) : up,
    ...(projection && own === undefined ? {projection, view_height} : {fov: fitted([fov, fov], size)}),
  };
}
