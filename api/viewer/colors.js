// What colours show: by which value, along which ramp, from where to where, how they are shaded, and the service's legend
// of it over the picture. What the fragment says and no control does (edl_strength) is kept.

import {choose, findParameter} from "./methods.js";
import {ask, query} from "./service.js";

const $ = (id) => document.getElementById(id);
const PLAIN = ["", "rgb", "normal"]; // without ramp and range

export class Colors extends EventTarget {
  /** Fires "change". The table of methods must be there. */
  constructor() {
    super();
    this.turn = 0; // of legends: the last one wins
    this.kept = {};
    const {enum: ramps} = findParameter("ramp");
    $("ramp").replaceChildren(...ramps.map((name) => new Option(name === "auto" ? "automatic" : name, name === "auto" ? "" : name)));
    $("colors").addEventListener("change", ({target}) => {
      if (!target.checkValidity()) return;
      this.show();
      this.dispatchEvent(new Event("change"));
    });
  }

  /** Another dataset, and what its colours show by now. */
  open(dataset, wanted) {
    this.dataset = dataset;
    const names = ["height", "normal", ...dataset.attributes.map(({name}) => name)];
    $("color_by").replaceChildren(new Option("its own", ""), ...names.map((name) => new Option(name.replaceAll("_", " "), name)));
    for (const name of ["color_by", "shade", "ramp", "background"]) choose($(name), wanted[name] ?? "");
    const [low, high] = `${wanted.range ?? ""}`.split("..");
    $("range-low").value = low;
    $("range-high").value = high ?? "";
    this.kept = Object.fromEntries(["edl_strength", "edl_radius"].filter((name) => name in wanted).map((name) => [name, wanted[name]]));
    this.show();
  }

  /** What of a view it says. */
  read() {
    const value = (name) => $(name).value.trim(),
      by = value("color_by"),
      [low, high] = [value("range-low"), value("range-high")];
    const said = {
      color_by: by,
      ramp: this.ramps ? value("ramp") : "",
      range: this.ramps && low && high ? `${low}..${high}` : "",
      shade: value("shade"),
      background: value("background"),
    };
    return {...Object.fromEntries(Object.entries(said).filter(([, text]) => text)), ...this.kept};
  }

  get ramps() {
    const by = $("color_by").value;
    return !PLAIN.includes(by) && !by.startsWith("flat:");
  }

  show() {
    for (const element of document.querySelectorAll("#colors .of-ramp")) element.hidden = !this.ramps;
    this.showLegend();
  }

  async showLegend() {
    const turn = ++this.turn,
      image = $("colors-legend"),
      {color_by, ramp, range} = this.read();
    if (!color_by || color_by === "rgb") return (image.hidden = true);
    try {
      const reply = await ask(`${this.dataset.uri}/legend.svg?${query({color_by, ramp, range})}`),
        url = URL.createObjectURL(await reply.blob());
      if (turn !== this.turn) return URL.revokeObjectURL(url);
      URL.revokeObjectURL(image.src);
      image.src = url;
      image.alt = `Legend: colours show ${color_by.replaceAll("_", " ")}`;
      image.hidden = false;
    } catch {
      if (turn === this.turn) image.hidden = true; // the picture says why
    }
  }
}
