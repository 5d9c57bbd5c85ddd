// The panel's part about points: coordinates, what they measure, what was found there, names on them, files of them.

import {toCsv, toGeoJson} from "./export.js";
import {coordinates, letter, lengthText} from "./measure.js";
import {save} from "./service.js";

const $ = (id) => document.getElementById(id);

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
function describePrimitive({primitive, plane}, unit) {
  if (!primitive) return [];
  const off = plane && [plane.error_mean, plane.error_most].map((x) => lengthText(x, unit, plane.error_most));
  return [["drawn as", primitive], ...(plane ? [["points off it", `${off[0]}, at most ${off[1]}`]] : [])];
}

/** Where the surface faces, and its colour. */
const describeSurface = ({normal, color}) => [
  ...(normal ? [["normal", coordinates(normal)]] : []),
  ...(color ? [["colour", color.join(", ")]] : []),
];

function nameClass(dataset, name, value) {
  const kind = name === "class" && dataset.attributes.find((one) => one.name === name)?.values?.kinds?.find((one) => one.value === value);
  return `${+value.toPrecision(9)}${kind?.name ? ` ${kind.name}` : ""}`;
}

function makeMark(annotations, mark, i, say) {
  const [item, name, at, button] = ["li", "strong", "small", "button"].map((tag) => document.createElement(tag));
  name.textContent = mark.name;
  at.textContent = coordinates(mark.position);
  Object.assign(button, {type: "button", textContent: "×", ariaLabel: `Remove ${mark.name}`});
  button.addEventListener("click", () => {
    annotations.remove(i);
    say(`${mark.name} removed`);
    ($("annotations").children[i] ?? $("annotations").lastElementChild)?.querySelector("button").focus();
  });
  item.append(name, button, at);
  return item;
}

export function showPoints(points, annotations, say) {
  const last = () => points.list.at(-1);

  points.addEventListener("change", ({detail}) => {
    const {dataset} = points.stage,
      {measures} = points;
    fill($("points"), points.positions.map((position, i) => [letter(i), coordinates(position)]));
    fill($("measures"), measures.map(({name, text}) => [name, text]));
    fill($("primitive"), last() ? describePrimitive(last(), dataset.unit) : []);
    fill($("surface"), last() ? describeSurface(last()) : []);
    const had = Object.entries(last()?.attributes ?? {}).filter(([, value]) => value !== null);
    fill($("attributes"), had.map(([name, value]) => [name.replaceAll("_", " "), nameClass(dataset, name, value)]));
    offer();
    if (typeof detail === "string") return say(detail);
    const [first] = measures,
      what = points.list.length === 2 && points.what === "length" ? "distance" : first?.name.toLowerCase();
    say(`Point at ${coordinates(detail.position)}${first ? `; ${what} ${first.text}` : ""}`);
  });

  function offer() {
    const none = !points.list.length;
    for (const id of ["clear", "remove-last", "mark-name", "mark-add"]) $(id).disabled = none;
    for (const id of ["csv", "geojson"]) $(id).disabled = none && !annotations.list.length;
  }

  annotations.addEventListener("change", () => {
    $("annotations").replaceChildren(...annotations.list.map((mark, i) => makeMark(annotations, mark, i, say)));
    offer();
  });

  $("measure").addEventListener("change", () => points.choose($("measure").value));
  $("clear").addEventListener("click", () => points.clear());
  $("remove-last").addEventListener("click", () => points.removeLast());
  $("marking").addEventListener("submit", (event) => {
    event.preventDefault();
    const name = $("mark-name").value;
    if (!last()) return;
    if (!annotations.add(last(), name)) return say(name.trim() ? "There is no room for more annotations" : "A name is needed");
    $("mark-name").value = "";
    say(`${annotations.list.at(-1).name} is on point ${letter(points.list.length - 1)}, and in the link`);
  });
  $("csv").addEventListener("click", () => {
    const {dataset} = points.stage;
    save(toCsv(points, annotations, dataset), "text/csv", `${dataset.id}-points.csv`);
  });
  $("geojson").addEventListener("click", async () => {
    const {dataset} = points.stage,
      json = await toGeoJson(points, annotations, dataset);
    save(JSON.stringify(json, null, 1), "application/geo+json", `${dataset.id}-points.geojson`);
    say(json.note ? `Saved. ${json.note}` : "Saved, in longitude, latitude and height");
  });
}
