// What is drawn as soft spheres: a term of the parameter soft as controls, or as text where it is more than they can say.
//
// An attribute whose values the dataset describes has their histogram and a slider over it, a class a box for each; a
// height is a plane. The term always stands as text under "More", and what is written there holds.

import {choose, makeControl, table} from "./methods.js";

const SVG = "http://www.w3.org/2000/svg",
  BINS = 40,
  STEPS = 200;
const $ = (id) => document.getElementById(id);

/** From where to where an attribute's slider goes: uncertainty is asked for as a share of its 99th percentile. */
function spanOf({name, values}) {
  const unit = name === "uncertainty" && values.p99 > 0 ? values.p99 : 1;
  const [low, most] = [values.quantiles[0], values.quantiles.at(-1)].map((x) => x / unit);
  const high = values.p99 > values.quantiles[0] ? values.p99 / unit : most > low ? most : low + 1;
  return {unit, low, high};
}

/** How many of the values lie in each of BINS parts of the span; quantiles are an equal share of them apart. */
function histogram(attribute) {
  const {unit, low, high} = spanOf(attribute),
    width = (high - low) / BINS,
    bins = new Array(BINS).fill(0);
  const {quantiles} = attribute.values;
  for (let i = 0; i + 1 < quantiles.length; i++) {
    const [a, b] = [quantiles[i] / unit, quantiles[i + 1] / unit];
    for (let part = 0.5; part < 8; part++) {
      const bin = Math.floor((a + ((b - a) * part) / 8 - low) / width);
      bins[Math.min(BINS - 1, Math.max(0, bin))]++;
    }
  }
  return bins;
}

/** The share of an attribute's values that are less; at a place of the slider. */
function shareBelow(attribute, at) {
  const {quantiles} = attribute.values,
    value = at * spanOf(attribute).unit,
    above = quantiles.findIndex((x) => x > value);
  if (above <= 0) return above < 0 ? 1 : 0;
  const [a, b] = [quantiles[above - 1], quantiles[above]];
  return (above - 1 + (value - a) / (b - a)) / (quantiles.length - 1);
}

/** Where on the slider a share of them is less. */
function quantile(attribute, share) {
  const {quantiles} = attribute.values,
    place = Math.min(1, Math.max(0, share)) * (quantiles.length - 1),
    low = Math.floor(place),
    [a, b] = [quantiles[low], quantiles[Math.min(low + 1, quantiles.length - 1)]];
  return (a + (b - a) * (place - low)) / spanOf(attribute).unit;
}

/** The values that `3-5,9` names; null where it names one that is not among `kinds`. */
function namedKinds(text, kinds) {
  const named = text.split(",").flatMap((part) => {
    const [low, high = low] = part.split(/-|\.\./).map(Number);
    const within = kinds.map(({value}) => value).filter((value) => value >= low && value <= high);
    return within.length && high >= low ? within : [null];
  });
  return named.includes(null) ? null : named;
}

/** A class has the name that the service has for it. */
const nameOf = ({name}, value) => (name ? `${value} ${name}` : `${value}`);

/** As a share is read: 0.4 %, 12 %. */
const percent = (share) => `${(100 * share).toFixed(share > 0 && share < 0.1 ? 1 : 0)} %`;

const short = (x) => `${Number(x.toPrecision(4))}`;

/** What has a slider, and its label. */
const SLIDERS = {soft_opacity: ["soft-opacity-label", "Strength"], soft_cover: ["soft-cover-label", "Cover"]};

export class Soft extends EventTarget {
  /** Fires "change" when what is read() has changed. The table of methods must be there. */
  constructor() {
    super();
    this.dataset = null;
    this.params = table.parameters.filter(({soft}) => soft);
    this.of = []; // what speaks of coordinates and layers, where something is soft
    for (const parameter of this.params) {
      if (SLIDERS[parameter.name]) continue;
      const [label, help, control] = [
        document.createElement("label"),
        document.createElement("small"),
        makeControl(parameter),
      ];
      control.id = label.htmlFor = `control-${parameter.name}`;
      help.id = `${control.id}-help`;
      control.setAttribute("aria-describedby", help.id);
      const name = parameter.name === "of" ? "picks and layers of" : parameter.name.replace("soft_", "");
      label.textContent = name.replace(/^./, (c) => c.toUpperCase());
      help.textContent = parameter.description;
      if (parameter.name === "of") this.of = [label, control, help];
      $("soft-more").append(label, control, help);
    }
    const tell = () => this.dispatchEvent(new Event("change"));
    $("soft").addEventListener("input", ({target}) => {
      if (target.type !== "range") return;
      this.write();
      tell();
    });
    $("soft").addEventListener("change", ({target}) => {
      if (target.type === "range") return; // it was heard as it moved
      if (target.id === "soft-terms") this.recognise(target.value.trim());
      else if (target.id === "soft-what") this.choose();
      if (!target.id.startsWith("control-") && target.id !== "soft-terms") this.write();
      tell();
    });
  }

  get attribute() {
    return this.dataset?.attributes.find(({name}) => name === $("soft-what").value);
  }

  /** Another dataset, and what of it is soft by now. */
  open(dataset, wanted) {
    this.dataset = dataset;
    const what = $("soft-what");
    what.replaceChildren(
      new Option("nothing", ""),
      ...dataset.attributes.map(({name}) => new Option(name.replaceAll("_", " "), name)),
      new Option("above a height", ":height"),
      new Option("as written below", ":text"),
    );
    for (const parameter of this.params) {
      const {name, default: usual} = parameter,
        control = $(`control-${name}`),
        text = wanted[name] === undefined || wanted[name] === usual ? "" : wanted[name];
      if (control instanceof HTMLSelectElement) choose(control, text);
      else control.value = SLIDERS[name] ? (wanted[name] ?? usual) : text;
    }
    this.recognise(wanted.soft ?? "");
  }

  /** What of a view it says. */
  read() {
    const soft = $("soft-terms").value.trim();
    if (!soft) return {};
    const given = this.params
      .map(({name, default: usual}) => [name, $(`control-${name}`), usual])
      .filter(([, control, usual]) => control.value !== "" && control.checkValidity() && control.value !== String(usual));
    return {soft, ...Object.fromEntries(given.map(([name, control]) => [name, control.value]))};
  }

  /** The strength as a tour goes on. */
  showOpacity(value) {
    $("control-soft_opacity").value = value;
    this.label();
  }

  /** Sets the controls to what a text says, where they can say it. */
  recognise(text) {
    const compare = text.match(/^(\w+)([<>])(q?)([-+.\de]+)$/i),
      height = text.match(/^plane:0,0,([-+.\de]+),0,0,1>0$/i),
      list = text.match(/^(\w+):(\d+(?:(?:-|\.\.)\d+)?(?:,\d+(?:(?:-|\.\.)\d+)?)*)$/);
    const named = (name) => this.dataset.attributes.find((attribute) => attribute.name === name);
    const what = $("soft-what");
    const known = list && named(list[1])?.values?.kinds,
      kinds = known && namedKinds(list[2], known);
    what.value = !text
      ? ""
      : height
        ? ":height"
        : compare && named(compare[1])?.values && !named(compare[1]).values.kinds
          ? compare[1]
          : kinds
            ? list[1]
            : ":text";
    $("soft-terms").value = text;
    this.choose();
    if (height) $("soft-threshold").value = height[1];
    if (compare && what.value === compare[1]) {
      $("soft-side").value = compare[2];
      $("soft-threshold").value = compare[3] ? quantile(this.attribute, Number(compare[4])) : compare[4];
    }
    if (kinds)
      for (const box of $("soft-kinds").querySelectorAll("input")) box.checked = kinds.includes(Number(box.value));
    this.label();
  }

  /** Shows the controls of what is chosen, at their first setting. */
  choose() {
    const what = $("soft-what").value,
      {attribute, dataset} = this,
      kinds = attribute?.values?.kinds,
      slider = what === ":height" || (attribute?.values && !kinds);
    if (attribute && !attribute.values && !new RegExp(`^${what}\\b`).test($("soft-terms").value))
      $("soft-terms").value = `${what}>0`;
    for (const name of ["soft-side", "soft-side-label"]) $(name).hidden = !(slider && attribute);
    for (const name of ["soft-threshold", "soft-threshold-label"]) $(name).hidden = !slider;
    $("soft-histogram").toggleAttribute("hidden", !(slider && attribute)); // SVG has no property of that name
    $("soft-kinds").hidden = !kinds;
    for (const [name, [label]] of Object.entries(SLIDERS)) $(`control-${name}`).hidden = $(label).hidden = !what;
    for (const element of this.of) element.hidden = !what;
    if (slider) {
      const {low, high} = attribute
        ? spanOf(attribute)
        : {low: dataset.bounds.min[2], high: dataset.bounds.max[2]};
      Object.assign($("soft-threshold"), {min: low, max: high, step: (high - low) / STEPS});
      const far = low + 0.75 * (high - low); // a tenth is soft at least, so that one sees what it does
      $("soft-threshold").value = attribute ? Math.min(far, quantile(attribute, 0.9)) : far;
      $("soft-side").value = ">";
    }
    if (kinds) this.list(attribute);
    if (kinds && !new RegExp(`^${what}\\b`).test($("soft-terms").value)) this.begin(kinds);
    if (slider && attribute) this.draw(attribute);
    this.label();
  }

  /** Ticks what the dataset suggests of an attribute's values: class:3-5, number_of_returns>1. */
  begin(kinds) {
    const {name} = this.attribute,
      term = this.dataset.soft.find((text) => text.match(/^\w+/)[0] === name),
      above = term?.match(/>(\d+)$/),
      ticked = above
        ? kinds.map(({value}) => value).filter((value) => value > Number(above[1]))
        : (term && namedKinds(term.slice(name.length + 1), kinds)) || [];
    for (const box of $("soft-kinds").querySelectorAll("input")) box.checked = ticked.includes(Number(box.value));
  }

  /** A box for each value. */
  list(attribute) {
    const {values} = attribute;
    $("soft-kinds").replaceChildren(
      ...values.kinds.map((kind) => {
        const {value, count} = kind;
        const [label, box] = [document.createElement("label"), document.createElement("input")];
        Object.assign(box, {type: "checkbox", value});
        label.append(box, ` ${nameOf(kind, value)} `, Object.assign(document.createElement("small"), {
          textContent: percent(count / values.count),
        }));
        return label;
      }),
    );
  }

  draw(attribute) {
    const bins = histogram(attribute),
      most = Math.max(...bins);
    $("soft-histogram").setAttribute("viewBox", `0 0 ${BINS} 12`);
    $("soft-histogram").replaceChildren(
      ...bins.map((count, i) => {
        const bar = document.createElementNS(SVG, "rect"),
          height = count ? Math.max(0.4, (12 * count) / most) : 0;
        for (const [name, value] of Object.entries({x: i, y: 12 - height, width: 0.85, height})) bar.setAttribute(name, value);
        return bar;
      }),
    );
  }

  /** The controls as a term, but where it is written. */
  write() {
    const what = $("soft-what").value,
      at = short($("soft-threshold").valueAsNumber),
      kinds = [...$("soft-kinds").querySelectorAll(":checked")].map(({value}) => value);
    if (!what) $("soft-terms").value = "";
    else if (what === ":height") $("soft-terms").value = `plane:0,0,${at},0,0,1>0`;
    else if (this.attribute?.values?.kinds) $("soft-terms").value = kinds.length ? `${what}:${kinds.join(",")}` : "";
    else if (this.attribute?.values) $("soft-terms").value = `${what}${$("soft-side").value}${at}`;
    this.label();
  }

  label() {
    const above = $("soft-side").value === ">",
      slider = $("soft-threshold"),
      {attribute} = this,
      below = attribute?.values && !attribute.values.kinds ? shareBelow(attribute, slider.valueAsNumber) : null;
    $("soft-threshold-label").textContent =
      `${$("soft-what").value === ":height" ? "Height" : "Threshold"} ${short(slider.valueAsNumber)}` +
      (below === null ? "" : `: ${percent(above ? 1 - below : below)} soft`);
    slider.setAttribute("aria-valuetext", $("soft-threshold-label").textContent);
    for (const [name, [label, text]] of Object.entries(SLIDERS))
      $(label).textContent = `${text} ${Number($(`control-${name}`).value)}`;
    const [low, high] = [Number(slider.min), Number(slider.max)];
    $("soft-histogram")
      .querySelectorAll("rect")
      .forEach((bar, i) => {
        const value = low + ((i + 0.5) / BINS) * (high - low);
        bar.classList.toggle("on", above ? value > slider.valueAsNumber : value < slider.valueAsNumber);
      });
  }
}
