// The methods and their parameters, as the service's own table has them, and a control for each parameter. The page knows
// none by name (but atoms, which a budget chooses too), so a method that the service learns is there with all it takes.

import {askJson} from "./service.js";

/** What /v1/methods says, once loadTable() has it. */
export const table = {default: "", methods: [], parameters: []};

let asked = null;

export async function loadTable() {
  asked ??= askJson("/v1/methods");
  try {
    Object.assign(table, await asked);
  } catch (problem) {
    asked = null; // the next one asks anew
    throw problem;
  }
}

export const findMethod = (name) => table.methods.find((method) => method.name === name);
export const findParameter = (name) => table.parameters.find((parameter) => parameter.name === name);

/** Those that have a control beside their method; what is about soft spheres has its own part of the panel. */
export const listed = () => table.parameters.filter(({soft, colors}) => !soft && !colors);

/** Does the parameter change what `method` draws of `dataset`? */
export const counts = ({name, textures, maps, primitives}, method, dataset) =>
  Boolean(
    findMethod(method)?.parameters.includes(name) &&
      (dataset.textures || !textures) &&
      (dataset.maps || !maps) &&
      (dataset.primitives || !primitives),
  );

const OF_COLORS = ["color_by", "range", "shade", "background"]; // and what the table says of others

/** What of a view's setting its layer takes: what colours show, their shading and textures are of none but color. */
export function taken(setting, layer = "color") {
  if (layer === "color") return setting;
  const isColors = (name) => OF_COLORS.includes(name) || findParameter(name)?.textures || findParameter(name)?.colors;
  return Object.fromEntries(Object.entries(setting).filter(([name]) => !isColors(name)));
}

/** Does `method` draw the layer of `dataset`? Of points alone not every one has normals. */
export const draws = (method, layer, dataset) =>
  layer !== "normal" || Boolean(findMethod(method)?.normals) || dataset.methods.some((name) => findMethod(name)?.stand_in);

/** What of a view's setting picks take, so that they find what the picture shows: its method, and what changes what is
 * seen where. */
export function pickable(setting) {
  const names = ["method", "clip", "class", "soft", ...table.parameters.filter(({textures, colors}) => !textures && !colors).map(({name}) => name)];
  return Object.fromEntries(names.filter((name) => name in setting).map((name) => [name, setting[name]]));
}

/** What draws the layer of `dataset` where `method` is asked for. */
export function offered(method = table.default, dataset, layer) {
  const names = [method, findMethod(method)?.stand_in, table.default, ...dataset.methods];
  return names.find((name) => dataset.methods.includes(name) && draws(name, layer, dataset));
}

/** Sets a select, to a value that it may not offer yet. */
export function choose(select, value) {
  if (![...select.options].some((option) => option.value === String(value))) select.append(new Option(value));
  select.value = value;
}

/** A control of a parameter, empty where the value is the default. */
export function makeControl({type, minimum, maximum, default: usual, enum: names}) {
  if (names) {
    const select = document.createElement("select");
    select.append(...names.map((name) => new Option(name, name === usual ? "" : name)));
    return select;
  }
  const outside = usual < minimum || usual > maximum; // such as 0 for one that the picture itself decides
  return Object.assign(document.createElement("input"), {
    type: "number",
    min: minimum,
    max: maximum,
    step: type === "integer" ? 1 : "any",
    placeholder: outside ? "automatic" : usual,
  });
}

/** The controls of all parameters, put behind `element` in its grid. */
export class Controls {
  constructor(element) {
    this.rows = new Map(); // name → [label, control, help]
    for (const parameter of listed()) {
      const {name, description} = parameter;
      const [label, help] = [document.createElement("label"), document.createElement("small")];
      const control = makeControl(parameter);
      control.id = label.htmlFor = `parameter-${name}`;
      help.id = `${control.id}-help`;
      label.textContent = name[0].toUpperCase() + name.slice(1).replaceAll("_", " ");
      help.textContent = description;
      control.setAttribute("aria-describedby", help.id);
      this.rows.set(name, [label, control, help]);
    }
    element.after(...[...this.rows.values()].flat());
  }

  get names() {
    return [...this.rows.keys()];
  }

  get(name) {
    return this.rows.get(name)?.[1];
  }

  /** Shows a value, undefined for the default. */
  set({name, default: usual}, value = usual) {
    const control = this.get(name),
      text = value === usual ? "" : value;
    if (control instanceof HTMLSelectElement) choose(control, text);
    else control.value = text;
  }

  /** Is it there, for who might change it? */
  offer(name, offered) {
    for (const element of this.rows.get(name)) element.hidden = !offered;
  }
}
