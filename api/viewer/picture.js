// The renderer's own controls, for those who know it: layer, method and its parameters, level, samples, budget.

import {Controls, choose, counts, draws, findMethod, listed, offered} from "./methods.js";

const $ = (id) => document.getElementById(id);
const SETTINGS = ["layer", "method", "lod", "supersample", "budget"]; // and the parameters of methods

export function choices(select, names, value) {
  select.replaceChildren(...names.map((name) => new Option(name, name, false, name === value)));
}

export class Picture {
  /** The table of methods must be there. */
  constructor() {
    this.parameters = new Controls($("method-help"));
  }

  /** Another dataset, and how it is drawn by now. */
  open(dataset, wanted) {
    this.dataset = dataset;
    choices($("layer"), dataset.layers, wanted.layer ?? "color");
    choices($("method"), dataset.methods, offered(wanted.method, dataset));
    $("lod").value = wanted.lod ?? 1;
    choose($("supersample"), wanted.supersample ?? 1);
    for (const parameter of listed()) this.parameters.set(parameter, wanted[parameter.name]);
    choose($("budget"), wanted.budget ?? "");
  }

  /** What the controls say, as parameters of a view; a budget chooses the others. In place of what the browser's own check
   * refuses stands what `before` has. */
  read(before) {
    const all = [...SETTINGS, ...this.parameters.names],
      control = (name) => this.parameters.get(name) ?? $(name);
    const read = (name) => (before && !control(name).checkValidity() ? before[name] : control(name).value) ?? "";
    const settings = Object.fromEntries(all.map((name) => [name, read(name)]));
    for (const option of $("method").options) option.disabled = !draws(option.value, settings.layer, this.dataset);
    $("method").value = settings.method = offered(settings.method, this.dataset, settings.layer);
    for (const name of all) control(name).disabled = settings.budget !== "" && !["layer", "budget"].includes(name);
    for (const parameter of listed()) {
      const {name} = parameter,
        shown = counts(parameter, settings.method, this.dataset);
      this.parameters.offer(name, shown);
      if (!shown || settings[name] === "") delete settings[name]; // the service chooses
    }
    $("method-help").textContent = findMethod(settings.method).description;
    return settings;
  }
}
