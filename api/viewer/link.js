// What is on screen as text: the URL's fragment, and a command that fetches the same picture.

import {findParameter} from "./methods.js";

const VECTORS = ["eye", "target", "up"],
  TEXTS = ["dataset", "view", "layer", "method", "budget", "crs", "soft", "color_by", "range", "shade", "projection", "clip", "class",
    "background"],
  HEIGHTS = ["view_height", "units_per_pixel"],
  NUMBERS = [...HEIGHTS, "fov", "station", "near", "far", "lod", "supersample"];
// How a picture is sent, which a view's URL may say as well: the page sees to that itself.
const SENT = ["width", "height", "format", "quality", "chroma", "depth_scale", "transparent", "wait", "v"];
const JOINTS = {soft: " or ", clip: " and "}; // of what may be given several times
const isText = (name) => TEXTS.includes(name) || findParameter(name)?.type === "string";

/** Is it a number, as a parameter of a view? */
export const isNumber = (name) => NUMBERS.includes(name) || (Boolean(findParameter(name)) && !isText(name));

/** {eye: […], fov: …, layer: …} of a fragment; what is malformed or unknown is left out, and `wrong` and `unknown` get a sentence
 * about each. Attributes of HTML that <splat-view> may have passed on (data-…) are no parameters. Needs the table of methods. */
export function parse(fragment, wrong = [], unknown = wrong) {
  const found = {};
  for (const [name, text] of new URLSearchParams(fragment.replace(/^#/, "").replaceAll("+", "%2B"))) {
    const numbers = text.split(",").map((part) => (part.trim() ? Number(part) : NaN));
    if (HEIGHTS.includes(name) && numbers[0] <= 0) wrong.push(`${name} of the link is left out: it has to be above 0, not '${text}'`);
    else if (VECTORS.includes(name) && numbers.length === 3 && numbers.every(Number.isFinite)) found[name] = numbers;
    else if (isNumber(name) && numbers.length === 1 && Number.isFinite(numbers[0])) found[name] = numbers[0];
    else if (Object.hasOwn(JOINTS, name)) found[name] = found[name] ? found[name] + JOINTS[name] + text : text;
    else if (name === "mark") (found.mark ??= []).push(text);
    else if (isText(name)) found[name] = text;
    else if (VECTORS.includes(name)) wrong.push(`${name} of the link is left out: it has to be three numbers, not '${text}'`);
    else if (isNumber(name)) wrong.push(`${name} of the link is left out: it has to be a number, not '${text}'`);
    else if (!SENT.includes(name) && !name.includes("-")) unknown.push(`${name} of the link is left out: the page knows no such parameter`);
  }
  if (HEIGHTS.every((name) => name in found)) {
    wrong.push("units_per_pixel of the link is left out: view_height says it already");
    delete found.units_per_pixel;
  }
  return found;
}

/** The same command on every shell that knows single quotes. */
export function curl(url, layer) {
  const absolute = new URL(url, location.href).href.replaceAll("%2C", ",").replaceAll("'", "%27");
  return `curl -o ${layer === "color" ? "view" : layer}.jpg '${absolute}'`;
}

/** Without a secure context there is no clipboard API; the old command still works there. */
export async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    return done;
  }
}
