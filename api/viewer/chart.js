// The dataset's chart of accuracy against time, as the service draws it, with the frame on screen as a point on it.

import {table} from "./methods.js";
import {ask, askJson} from "./service.js";

export class Chart {
  /** `figure` holds an img, a .here and a figcaption. */
  constructor(figure) {
    this.figure = figure;
    this.image = figure.querySelector("img");
    this.here = figure.querySelector(".here");
    this.caption = figure.querySelector("figcaption");
    this.axes = null; // {box: [left, top, right, bottom] as shares, ms: [low, high], psnr: [low, high]}
    this.profile = null;
    this.last = null; // what show() was called with
  }

  async open(dataset) {
    this.axes = this.profile = this.last = null;
    URL.revokeObjectURL(this.image.src);
    this.image.hidden = this.here.hidden = true;
    this.caption.textContent = "Not measured yet: splatd bench does.";
    if (!dataset.profile) return;
    try {
      await this.load(dataset);
    } catch (problem) {
      this.caption.textContent = problem.message;
    }
  }

  async load(dataset) {
    const [profile, svg] = await Promise.all([
      askJson(dataset.profile),
      ask(`${dataset.profile}?format=svg`).then((r) => r.text()),
    ]);
    const numbers = (name) =>
      svg
        .match(new RegExp(`<svg[^>]* ${name}="([^"]*)"`))[1]
        .split(" ")
        .map(Number);
    const [, , width, height] = numbers("viewBox");
    const [left, top, right, bottom] = numbers("data-plot");
    this.profile = profile;
    this.axes = {
      box: [left / width, top / height, right / width, bottom / height],
      ms: numbers("data-ms"),
      psnr: numbers("data-psnr"),
    };
    this.image.src = URL.createObjectURL(new Blob([svg], {type: "image/svg+xml"}));
    this.image.hidden = false;
    this.caption.textContent = "";
    if (this.last) this.show(...this.last);
  }

  /** `frame` as the stage reports it, `setting` what was asked for. */
  show(frame, setting) {
    this.last = [frame, setting];
    if (!this.axes || frame.stages.frame === undefined) return;
    const used = frame.chosen ?? {method: table.default, lod: 1, supersample: 1, ...setting};
    const known = this.profile.points.find(
      (p) =>
        p.method === used.method &&
        p.lod === Number(used.lod) &&
        p.supersample === Number(used.supersample) &&
        table.parameters.every(({name, default: usual}) => String(used[name] ?? usual) === String(p[name] ?? usual)),
    );
    const psnr = known?.psnr ?? null,
      ms = frame.stages.frame;
    const {
      box,
      ms: [first, last],
      psnr: [low, high],
    } = this.axes;
    const share = (x) => Math.min(1, Math.max(0, x));
    const x = share(Math.log(ms / first) / Math.log(last / first));
    const y = psnr === null ? 1 : share((high - psnr) / (high - low));
    this.here.hidden = false;
    this.here.style.left = `${100 * (box[0] + x * (box[2] - box[0]))}%`;
    this.here.style.top = `${100 * (box[1] + y * (box[3] - box[1]))}%`;
    this.caption.textContent =
      `This view: ${ms.toFixed(0)} ms, ${frame.width} × ${frame.height}; ` +
      (psnr === null ? "this setting was not measured" : `this setting reaches ${psnr.toFixed(1)} dB`) +
      ` (measured at ${this.profile.width} × ${this.profile.height}).`;
  }
}
