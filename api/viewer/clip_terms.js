// What is cut away, as text of the parameter `clip` and as the values of controls. Pure.
//
// Conditions are joined by " and "; all of them hold. One box and one slab have controls, all other conditions stay text.

const NUMBER = "[-+]?(?:\\d+(?:\\.\\d*)?|\\.\\d+)(?:e[-+]?\\d+)?", // one way to read each: no backtracking
  BOX = new RegExp(`^(!?)box:(${NUMBER}(?:,${NUMBER}){5,6})$`, "i"),
  SLAB = new RegExp(`^([xyz]):(${NUMBER})\\.\\.(${NUMBER})$`, "i"),
  PLANE = new RegExp(`^(${NUMBER})<plane:(${NUMBER}(?:,${NUMBER}){5})<(${NUMBER})$`, "i");
const TEXT_MOST = 8192; // a service takes no longer URL
const numbers = (text) => text.split(",").map(Number);

export const AXES = {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1]};

/** How far along an axis a point lies. */
export const along = (axis, p) => axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];

/** The axes of a box that is turned by so many degrees, counter-clockwise seen from above. */
export function boxAxes(degrees) {
  const [c, s] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  return [
    [c, s, 0],
    [-s, c, 0],
    [0, 0, 1],
  ];
}

/** From where to where the bounds reach along an axis of length 1. */
export function span({min, max}, axis) {
  const ends = axis.map((a, i) => [a * min[i], a * max[i]].sort((p, q) => p - q));
  return [0, 1].map((end) => ends.reduce((sum, pair) => sum + pair[end], 0));
}

function parseBox(condition) {
  const found = condition.match(BOX);
  if (!found) return null;
  const [x0, y0, z0, x1, y1, z1, turn = 0] = numbers(found[2]),
    half = [(x1 - x0) / 2, (y1 - y0) / 2, (z1 - z0) / 2];
  if (!half.every((h) => h > 0)) return null;
  return {outside: found[1] === "!", center: [x0 + half[0], y0 + half[1], z0 + half[2]], half, turn};
}

function parseSection(condition) {
  const slab = condition.match(SLAB),
    plane = condition.match(PLANE);
  if (slab) {
    const [a, b] = [Number(slab[2]), Number(slab[3])];
    return b > a ? {axis: slab[1].toLowerCase(), normal: AXES[slab[1].toLowerCase()], at: (a + b) / 2, thick: b - a} : null;
  }
  if (!plane) return null;
  const [low, high, n] = [Number(plane[1]), Number(plane[3]), numbers(plane[2])],
    length = Math.hypot(n[3], n[4], n[5]);
  if (!(high > low && length > 0)) return null;
  const normal = n.slice(3).map((x) => x / length);
  return {axis: "view", normal, at: along(normal, n) + (low + high) / 2, thick: high - low};
}

/** {box, section, rest} of a text; what is null is not there. Blanks may be written as +, as in a query. */
export function parseClip(text = "") {
  const found = {box: null, section: null, rest: []};
  if (text.length > TEXT_MOST) return {...found, rest: text};
  const blanks = text.replace(/\+/g, (plus, i) => (/[\d.]e$/i.test(text.slice(Math.max(i - 2, 0), i)) && /\d/.test(text[i + 1]) ? plus : " "));
  for (const condition of blanks.split(/ and /).map((part) => part.trim())) {
    const [box, section] = [found.box ? null : parseBox(condition), found.section ? null : parseSection(condition)];
    if (box) found.box = box;
    else if (section) found.section = section;
    else if (condition) found.rest.push(condition);
  }
  return {...found, rest: found.rest.join(" and ")};
}

/** The text of them; `digits` behind the point. Planes are said to go through a place near `middle`, where rounding matters
 * least. */
export function formatClip({box, section, rest}, digits, middle) {
  const short = (x) => `${Number(x.toFixed(digits)) + 0}`,
    exact = (x) => `${Number(x.toFixed(9)) + 0}`,
    conditions = [];
  if (box) {
    const corners = [-1, 1].flatMap((side) => box.center.map((c, i) => short(c + side * box.half[i])));
    conditions.push(`${box.outside ? "!" : ""}box:${corners.join(",")}${box.turn ? `,${exact(box.turn)}` : ""}`);
  }
  if (section) {
    const {axis, normal, at, thick} = section;
    if (axis !== "view") conditions.push(`${axis}:${short(at - thick / 2)}..${short(at + thick / 2)}`);
    else {
      const point = normal.map((x, i) => short(middle[i] + x * (at - along(normal, middle))));
      conditions.push(`${short(-thick / 2)}<plane:${[...point, ...normal.map(exact)].join(",")}<${short(thick / 2)}`);
    }
  }
  if (rest.trim()) conditions.push(rest.trim());
  return conditions.join(" and ");
}
