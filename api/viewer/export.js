// Points, annotations and what they measure as files: CSV, and GeoJSON, which is in longitude, latitude and height where
// the service can turn the dataset's coordinates into these, and says so where it cannot.

import {letter} from "./measure.js";
import {askJson, query} from "./service.js";

const AT_ONCE = 8; // places asked for

/** [{kind, name, position, …}] of everything that has been taken. */
const places = (points, annotations) => [
  ...points.list.map((point, i) => ({...point, kind: "point", name: letter(i)})),
  ...annotations.list.map((mark) => ({...mark, kind: "annotation"})),
];

/** A cell of CSV. Of texts that people wrote none is a formula to a spreadsheet. */
function cell(value, written = false) {
  const text = value === null || value === undefined ? "" : `${value}`,
    safe = written && /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

/** A coordinate system's own name: of WKT the first text in it. */
const nameOf = (crs) => crs?.match(/^\s*\w+\["([^"]*)"/)?.[1] ?? crs;

export function toCsv(points, annotations, dataset) {
  const all = places(points, annotations),
    attributes = dataset.attributes.map(({name}) => name);
  const head = ["kind", "name", "x", "y", "z", "value", "unit", "crs", "nx", "ny", "nz", "red", "green", "blue", ...attributes];
  const three = (list) => list ?? [null, null, null];
  const rows = all.map(({kind, name, position, normal, color, attributes: had}) => [
    kind, cell(name, true), ...position, null, dataset.unit, nameOf(dataset.crs), ...three(normal), ...three(color),
    ...attributes.map((attribute) => had?.[attribute]),
  ].map((value, i) => (i === 1 ? value : cell(value, typeof value === "string"))));
  const measured = points.measures.map(({name, value, unit}) => {
    const row = new Array(head.length).fill("");
    [row[0], row[1], row[5], row[6]] = ["measure", cell(name, true), cell(value), cell(unit)];
    return row;
  });
  return [head.map((name) => cell(name)), ...rows, ...measured].map((row) => row.join(",")).join("\r\n") + "\r\n";
}

/** Positions as longitude, latitude and height; null where the service cannot tell. */
async function toDegrees(positions, dataset) {
  if (!dataset.crs) return null;
  const found = [];
  try {
    for (let i = 0; i < positions.length; i += AT_ONCE)
      found.push(
        ...(await Promise.all(
          positions.slice(i, i + AT_ONCE).map((world) => askJson(`${dataset.uri}/place?${query({crs: "EPSG:4326", world})}`)),
        )),
      );
  } catch {
    return null;
  }
  return found.map(({position}) => position);
}

/** A closed ring, counter-clockwise from above, as RFC 7946 wants it. */
function ring(corners) {
  const closed = [...corners, corners[0]],
    twice = closed.slice(1).reduce((sum, [x, y], i) => sum + (closed[i][0] - corners[0][0]) * (y - corners[0][1]) - (x - corners[0][0]) * (closed[i][1] - corners[0][1]), 0);
  return twice < 0 ? closed.reverse() : closed;
}

export async function toGeoJson(points, annotations, dataset) {
  const all = places(points, annotations),
    degrees = await toDegrees(all.map(({position}) => position), dataset),
    coordinates = degrees ?? all.map(({position}) => position);
  const feature = (geometry, properties) => ({type: "Feature", geometry, properties});
  const features = all.map(({kind, name, position, normal, color, class: kindOf, attributes}, i) =>
    feature(
      {type: "Point", coordinates: coordinates[i]},
      {...attributes, kind, name, world: position, normal: normal ?? null, color: color ?? null, class: kindOf ?? null},
    ),
  );
  const taken = coordinates.slice(0, points.list.length),
    measures = points.measures;
  if (taken.length > 1) {
    const closed = points.what === "area" && taken.length > 2;
    features.push(
      feature(closed ? {type: "Polygon", coordinates: [ring(taken)]} : {type: "LineString", coordinates: taken}, {
        kind: "measure",
        measures: measures.map(({name, value, unit}) => ({name, value, unit})),
      }),
    );
  }
  const about = degrees
    ? {}
    : {note: "Coordinates are the dataset's own x, y, z, not longitude and latitude."};
  return {type: "FeatureCollection", ...about, dataset: dataset.id, unit: dataset.unit, coordinate_system: dataset.crs, features};
}
