// Cameras by longitude and latitude: the service knows where they lie in the dataset's world, in which everything else here
// thinks.

import {askJson, query} from "./service.js";

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
