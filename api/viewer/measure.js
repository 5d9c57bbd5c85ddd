// What points say together: length, height, area, angle. Pure; positions are world coordinates of one unit.

import {cross, dot, length, sub} from "./camera.js";

/** Units without a name are numbers of metres: "0.201168 m". */
export const withUnit = (text, unit) => `${text} ${/^\d/.test(unit) ? "× " : ""}${unit}`;
/** A length in the dataset's unit, as people read it; beside others, of which the longest is `most`, in the unit that suits that. */
export const lengthText = (x, unit, most = x) =>
  unit === "m" && Math.abs(most) < 1
    ? `${(x * 1000).toFixed(1)} mm`
    : withUnit(unit !== "m" && Math.abs(x) < 1 ? Number(x.toPrecision(4)) + 0 : (Math.round(x * 1000) / 1000 + 0).toFixed(3), unit);
const areaText = (x, unit) => withUnit(x < 1 ? x.toPrecision(4) : x.toFixed(3), /^\d/.test(unit) ? `(${unit})²` : `${unit}²`);
export const angleText = (x) => `${x.toFixed(2)}°`;
export const coordinates = (p) => p.map((x) => (Math.round(x * 1000) / 1000 + 0).toFixed(3)).join(", ");
export const letter = (i) => (i < 26 ? String.fromCharCode(65 + i) : `A${i - 25}`);

/** Of a closed polygon that need not be flat: half of the length of the sum of its corners' products; in plan that of z. */
export function area(corners) {
  const [first] = corners,
    sum = [0, 0, 0];
  for (let i = 1; i + 1 < corners.length; i++)
    cross(sub(corners[i], first), sub(corners[i + 1], first)).forEach((x, k) => (sum[k] += x / 2));
  return {whole: length(sum), plan: Math.abs(sum[2])};
}

/** Degrees at b. */
export function angle(a, b, c) {
  const [p, q] = [sub(a, b), sub(c, b)];
  return (Math.atan2(length(cross(p, q)), dot(p, q)) * 180) / Math.PI;
}

export const segments = (points) => points.slice(1).map((p, i) => length(sub(p, points[i])));
const sum = (list) => list.reduce((a, b) => a + b, 0);

/** [{name, value, unit, text}] of positions, the first being what was asked for. `what`: "length", "area" or "angle". */
export function measure(points, what, unit) {
  const n = points.length;
  if (n < 2) return [];
  const lengths = segments(points),
    of = (name, value, text = lengthText(value, unit, sum(lengths)), in_ = unit) => ({name, value, unit: in_, text});
  const [from, to] = [points[0], points[n - 1]],
    way = `${letter(0)} – ${letter(n - 1)}`;
  const steps = lengths.map((x, i) => of(`${letter(i)} – ${letter(i + 1)}`, x));
  if (what === "angle") return n < 3 ? steps : [of("Angle at B", angle(...points), angleText(angle(...points)), "°"), ...steps];
  if (what === "area") {
    if (n < 3) return steps;
    const {whole, plan} = area(points),
      squared = `${unit}²`;
    const around = sum(lengths) + length(sub(to, from));
    return [
      of("Area", whole, areaText(whole, unit), squared),
      of("In plan", plan, areaText(plan, unit), squared),
      of("Perimeter", around),
    ];
  }
  return [
    ...(n > 2 ? [of("Length", sum(lengths))] : []),
    ...(n > 2 ? steps.slice(-1) : steps),
    of(n > 2 ? `Height, ${way}` : "Height difference", to[2] - from[2]),
    of(n > 2 ? `In plan, ${way}` : "In plan", Math.hypot(to[0] - from[0], to[1] - from[1])),
  ];
}
