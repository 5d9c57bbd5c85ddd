// Cameras by longitude and latitude, which the service knows where to find in the dataset's world, in which everything else
// here thinks; and by the names that the dataset's views have.

import {fitted} from "./camera.js";
import {Problem, askJson, query} from "./service.js";

/** `wanted` with eye and target in the world; they are in its coordinate system `crs` where it names one. */
export async function toWorld(dataset, {crs, ...wanted}) {
  if (!crs) return wanted;
  const find = async (name) => {
    const place = await askJson(`${dataset.uri}/place?${query({crs, position: wanted[name]})}`);
    return [name, place.world];
  };
  const named = ["eye", "target"].filter((name) => wanted[name]);
  return {...wanted, ...Object.fromEntries(await Promise.all(named.map(find)))};
}

/** The camera of the view that `wanted` names, in an image of this size; nothing where it names none. */
export function named(dataset, {view: name}, size) {
  if (name === undefined) return {};
  const view = dataset.views.find((one) => one.name === name);
  if (!view) throw new Problem("gone", `${dataset.id} has no view '${name}'`);
  const {eye, target, up, fov} = view;
  return {eye, target, up, fov: fitted([fov, fov], size)};
}
