// The picture: asks for frames of the newest camera, one at a time, and shows them.
//
// While the camera moves, frames are coarse and the last one is bent to where the camera is by now, so that motion is
// as smooth as the screen; once it rests, one full frame replaces them. A full frame that is overtaken by motion is
// cancelled, which lets the service drop it. Events: "camera" (it changed), "frame" (detail: what the reply said),
// "state" (detail: a Problem, or null when all is well).

import {distance, fitted, fromParams, params, rounded, same, warp} from "./camera.js";
import {taken} from "./methods.js";
import {Problem, ask, query} from "./service.js";
import {keptOf} from "./soft_setting.js";

const REST_MS = 160;
const COARSE = {auto: {budget: "60ms"}, half: {supersample: 0.5}, quarter: {supersample: 0.25}, full: {}};
const PARTIAL_MS = 400; // until a frame with missing parts is asked for again

/** What the headers of a view say, as numbers. */
function readHeaders(headers) {
  const list = (text) => Object.fromEntries((text ?? "").split(";").map((part) => part.trim().split("=")));
  const stages = {};
  for (const [, name, ms] of (headers.get("Server-Timing") ?? "").matchAll(/(\w+);dur=([\d.]+)/g))
    stages[name] = Number(ms);
  const number = (name) => (headers.has(name) ? Number(headers.get(name)) : null);
  return {
    stages,
    chosen: headers.has("Splatd-Chosen") ? list(headers.get("Splatd-Chosen")) : null,
    promised: list(headers.get("Splatd-Promised")),
    demand: headers.get("Splatd-Demand"),
    near: number("Splatd-Depth-Near"),
    far: number("Splatd-Depth-Far"),
    pending: headers.get("Splatd-Pending") === "true",
    whole: headers.get("Splatd-Complete") !== "false",
  };
}

export class Stage extends EventTarget {
  /** `element` holds a canvas; `pixels` is the most that the service renders. */
  constructor(element) {
    super();
    this.element = element;
    this.canvas = element.querySelector("canvas");
    this.dataset = null; // as /v1/datasets/{id} describes it
    this.camera = null;
    this.settings = {}; // method and its own, lod, supersample, atoms, budget, layer: as parameters of a view
    this.coarse = "auto";
    this.pixels = 2 ** 23;
    this.shown = null; // {camera, size, full, …headers} of the frame on screen
    this.flight = null; // {abort, full, version}
    this.version = 0; // of settings and size
    this.restAt = 0;
    this.ahead = 0; // by how much the eye of an orthographic camera was put back when it was opened
    this.timer = 0;
    this.failures = 0;
    this.blocked = false; // nothing is asked before the timer
    new ResizeObserver(() => this.resize()).observe(element);
    addEventListener("online", () => this.retry());
    document.addEventListener("visibilitychange", () => this.pump());
  }

  /** CSS pixels. */
  get size() {
    return [Math.max(1, this.element.clientWidth), Math.max(1, this.element.clientHeight)];
  }

  /** The default view, which shows as much in an image of any shape. */
  get home() {
    const {eye, target, up, fov, fit} = this.dataset.default_view;
    return rounded({eye, target, up, fov: fit ? fitted(fit, this.size) : fov});
  }

  /** Who has not moved yet sees the default view of the new size. */
  resize() {
    if (this.dataset && same(rounded(this.camera), this.first)) this.camera = this.first = this.home;
    this.refresh();
  }

  /** Shows another dataset, from `camera`, a view's parameters, or its default view. */
  open(dataset, camera) {
    if (this.dataset?.id !== dataset.id) this.close();
    this.dataset = dataset;
    this.first = this.home;
    this.least = Math.hypot(...dataset.bounds.max.map((x, i) => x - dataset.bounds.min[i])) * 1e-3 || 1e-3;
    this.camera = fromParams(camera ?? {}, this.first, this.size[1]);
    this.ahead = this.camera.flat && camera.eye && camera.target ? distance(this.camera) - distance(camera) : 0;
    this.dispatchEvent(new Event("camera"));
    this.refresh();
  }

  /** Shows nothing. */
  close() {
    if (this.flight) this.flight.abort.abort();
    this.dataset = this.shown = null;
    this.canvas.hidden = true;
    this.element.classList.remove("rest");
  }

  /** Puts the camera elsewhere as part of a motion. */
  setCamera(camera) {
    if (!this.dataset || !camera.eye.every(Number.isFinite) || !camera.target.every(Number.isFinite)) return;
    this.camera = camera;
    if (!camera.flat) this.ahead = 0;
    this.restAt = performance.now() + REST_MS;
    this.unblock();
    if (this.flight?.full) this.flight.abort.abort();
    this.bend();
    this.dispatchEvent(new Event("camera"));
    this.pump();
  }

  set(settings) {
    this.settings = settings;
    this.refresh();
  }

  /** Changes them as part of a motion: setCamera() follows. */
  drift(settings) {
    this.settings = settings;
  }

  /** Asks for a full frame of what is there now. */
  refresh() {
    this.paint();
    this.version++;
    this.unblock();
    if (this.shown) this.shown.full = false;
    if (this.flight) this.flight.abort.abort();
    this.bend();
    this.pump();
  }

  /** What lies around a picture has its background. */
  paint() {
    const {background = ""} = this.settings,
      hex = background.match(/^(?:#|0x)?([\da-f]{6}|[\da-f]{8})$/i);
    this.element.style.setProperty("--ground", hex ? `#${hex[1]}` : background);
  }

  /** Changes them as part of a motion of something else than the camera. */
  slide(settings) {
    this.drift(settings);
    if (this.dataset) this.setCamera(this.camera);
  }

  /** What was refused for good may be asked again once something is different. */
  unblock() {
    if (!this.problem?.seconds) this.blocked = false;
  }

  /** After an error: now, not later. */
  retry() {
    if (!this.blocked) return;
    this.blocked = false;
    this.pump();
  }

  get moving() {
    return performance.now() < this.restAt;
  }

  /** By how much the eye of an orthographic camera is farther away in what the service is asked for. */
  get back() {
    return 1000 * this.least;
  }

  /** near and far of them, which count from the eye: that of an orthographic camera is asked for from elsewhere. */
  planes(setting, back) {
    const given = ["near", "far"].filter((name) => this.camera.flat && setting[name] !== undefined);
    return Object.fromEntries(given.map((name) => [name, Math.max(0, Number((setting[name] + this.ahead + back).toFixed(6)))]));
  }

  /** The parameters of a view of this camera: `full` as at rest, else as in motion. */
  params(full = true) {
    const [width, height] = this.size;
    const ratio = Math.min(devicePixelRatio, 2, Math.sqrt(this.pixels / (width * height)));
    const {layer, budget, ...given} = this.settings,
      setting = taken(given, layer);
    const coarse = COARSE[this.coarse];
    // A budget chooses the rest, but in motion not the method nor how it fills: what changes from frame to frame flickers.
    const {lod, supersample, atoms, ...kept} = setting;
    let quality = {...setting, ...(full ? {} : coarse)};
    if (full && budget) quality = {budget, ...keptOf(setting)};
    else if (!full && coarse.budget) quality = {...kept, ...coarse};
    const {back} = this;
    return {
      ...params(rounded(this.camera), back),
      width: Math.max(1, Math.floor(width * ratio)),
      height: Math.max(1, Math.floor(height * ratio)),
      layer,
      ...quality,
      ...this.planes(setting, back),
      ...taken({background: this.settings.background ?? getComputedStyle(this.element).getPropertyValue("--ground").trim().replace("#", "")}, layer),
      format: "jpeg",
    };
  }

  url(full = true, changed = {}) {
    return `${this.dataset.view}?${query({...this.params(full), ...changed})}`;
  }

  later(ms) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.blocked = false;
      this.pump();
    }, ms);
  }

  /** Asks for the frame that is missing, if one is and none is on its way. The element has the class "rest" while the
   * picture is all that was asked for. */
  async pump() {
    this.element.classList.toggle(
      "rest",
      !this.moving && Boolean(this.shown?.full) && same(this.shown.camera, rounded(this.camera)),
    );
    if (!this.dataset || this.flight || this.blocked || document.hidden) return;
    const full = !this.moving;
    if (!full) this.later(this.restAt - performance.now() + 1);
    const still = this.shown?.settings === this.settings && same(this.shown.camera, rounded(this.camera));
    if (still && (this.shown.full || !full)) return;
    const flight = (this.flight = {abort: new AbortController(), full, version: this.version});
    const [dataset, camera, size, settings] = [this.dataset, rounded(this.camera), this.size, this.settings];
    try {
      const reply = await ask(this.url(full), {signal: flight.abort.signal});
      const bitmap = await createImageBitmap(await reply.blob());
      const current = full && flight.version === this.version;
      if (dataset === this.dataset) {
        this.show(bitmap, {camera, size, settings, full: current, ...readHeaders(reply.headers)});
        this.failures = 0;
        this.report(null);
      }
      bitmap.close();
    } catch (error) {
      if (!full && error.kind === "refused" && this.coarse === "auto")
        this.coarse = "quarter"; // a profile without this method
      else if (error.name !== "AbortError") this.fail(error);
    }
    this.flight = null;
    this.pump();
  }

  show(bitmap, shown) {
    this.shown = shown;
    this.canvas.width = bitmap.width;
    this.canvas.height = bitmap.height;
    this.canvas.getContext("2d").drawImage(bitmap, 0, 0);
    this.canvas.hidden = false;
    this.bend();
    this.dispatchEvent(new CustomEvent("frame", {detail: {...shown, width: bitmap.width, height: bitmap.height}}));
    if (shown.full && shown.pending) {
      shown.full = false;
      this.blocked = true;
      this.later(PARTIAL_MS);
    }
  }

  /** Bends the frame on screen to the newest camera. */
  bend() {
    if (!this.shown) return;
    const {camera, size} = this.shown;
    const here = same(size, this.size) && same(camera, rounded(this.camera));
    this.canvas.style.transform = here ? "" : warp(camera, this.camera, this.size);
  }

  fail(error) {
    const problem =
      error instanceof Problem ? error : new Problem("refused", `The image cannot be shown: ${error.message}`);
    this.blocked = true;
    if (problem.kind === "offline") problem.seconds = Math.min(15, 2 ** this.failures);
    this.failures++;
    if (problem.seconds) this.later(problem.seconds * 1000);
    this.report(problem);
  }

  report(problem) {
    if (problem || this.problem) this.dispatchEvent(new CustomEvent("state", {detail: problem}));
    this.problem = problem;
  }
}
