// A tour: keyframes in order, each with the seconds until the next, and the curve through them.
//
// The curve is a Catmull-Rom spline over those times through eyes, targets, ups and fields of view.

import {rounded} from "./camera.js";
import {opacityOf} from "./soft_setting.js";

export class Tour extends EventTarget {
  /** Fires "change" when the keyframes have changed, "play" when it begins or ends to play. */
  constructor(stage) {
    super();
    this.stage = stage;
    this.keyframes = []; // {eye, target, up, fov, seconds}, and soft_opacity where something was soft
    this.closed = false;
    this.playing = 0; // the animation frame, 0 = still
  }

  /** Seconds of each leg; the way back of a closed tour takes the mean of the others. */
  get legs() {
    const legs = this.keyframes.slice(0, -1).map((key) => key.seconds);
    const sum = legs.reduce((a, b) => a + b, 0);
    return this.closed && legs.length ? [...legs, sum / legs.length] : legs;
  }

  get seconds() {
    return this.legs.reduce((a, b) => a + b, 0);
  }

  /** Keyframes are kept by dataset until the browser forgets them. */
  open(id) {
    this.stop();
    this.key = `splatd-tour ${id}`;
    const {keyframes = [], closed = false} = JSON.parse(localStorage.getItem(this.key) ?? "{}");
    Object.assign(this, {keyframes, closed});
    this.dispatchEvent(new Event("change"));
  }

  changed() {
    this.stop();
    localStorage.setItem(this.key, JSON.stringify({keyframes: this.keyframes, closed: this.closed}));
    this.dispatchEvent(new Event("change"));
  }

  add() {
    const opacity = opacityOf(this.stage.settings);
    this.keyframes.push({
      ...rounded(this.stage.camera),
      seconds: 3,
      ...(opacity === null ? {} : {soft_opacity: opacity}),
    });
    this.changed();
  }

  remove(i) {
    this.keyframes.splice(i, 1);
    this.changed();
  }

  /** Keyframe i takes the place of its neighbour at i + by. */
  shift(i, by) {
    const [key] = this.keyframes.splice(i, 1);
    this.keyframes.splice(i + by, 0, key);
    this.changed();
  }

  set(i, values) {
    Object.assign(this.keyframes[i], values);
    this.changed();
  }

  setClosed(closed) {
    this.closed = closed;
    this.changed();
  }

  /** Shows a keyframe. */
  go(i) {
    this.stop();
    const {eye, target, up, fov, soft_opacity: opacity} = this.keyframes[i];
    this.fade(opacity);
    this.stage.setCamera({eye, target, up, fov});
  }

  /** Shows what is soft at another strength, where something is. Fires "fade". */
  fade(opacity) {
    const {settings} = this.stage;
    if (opacity === undefined || [null, opacity].includes(opacityOf(settings))) return;
    this.stage.drift({...settings, soft_opacity: String(opacity)});
    this.dispatchEvent(new Event("fade"));
  }

  /** The strength `time` seconds into the tour: straight between the keyframes that say one, as the service has it. */
  opacityAt(time) {
    let at = 0;
    const legs = this.legs,
      said = [...this.keyframes, ...(this.closed ? this.keyframes.slice(0, 1) : [])]
        .map(({soft_opacity: value}, i) => [(at += i ? legs[i - 1] : 0), value])
        .filter(([, value]) => value !== undefined);
    const after = said.findIndex(([begin]) => begin > time);
    if (!said.length || after <= 0) return said.at(after)?.[1];
    const [[a, from], [b, to]] = said.slice(after - 1, after + 1);
    return Number((from + ((to - from) * (time - a)) / (b - a)).toFixed(3));
  }

  /** The camera `time` seconds into the tour. */
  at(time) {
    const keys = this.keyframes.map((key) => [...key.eye, ...key.target, ...key.up, Math.log(key.fov)]);
    const n = keys.length,
      legs = this.legs;
    let leg = 0;
    while (leg < legs.length - 1 && time > legs[leg]) time -= legs[leg++];
    const h = legs[leg],
      t = Math.min(1, Math.max(0, time / h));
    const rate = (i, name) => (keys[(i + 1) % n][name] - keys[i][name]) / legs[i];
    const slope = (i, name) => {
      // at keyframe i: of the parabola through it and its neighbours
      const before = i ? i - 1 : this.closed ? n - 1 : -1;
      if (before < 0) return rate(0, name);
      if (i >= legs.length) return rate(before, name);
      return (rate(before, name) * legs[i] + rate(i, name) * legs[before]) / (legs[before] + legs[i]);
    };
    const values = keys[0].map((_, name) => {
      const [p, q] = [keys[leg][name], keys[(leg + 1) % n][name]];
      const [a, b] = [slope(leg, name) * h, slope((leg + 1) % n, name) * h];
      return p + t * (a + t * (3 * (q - p) - 2 * a - b + t * (2 * (p - q) + a + b)));
    });
    return {eye: values.slice(0, 3), target: values.slice(3, 6), up: values.slice(6, 9), fov: Math.exp(values[9])};
  }

  /** As POST /v1/datasets/{id}/tours takes it for a path. */
  document() {
    const starts = this.keyframes.map((_, i) => this.keyframes.slice(0, i).reduce((sum, key) => sum + key.seconds, 0));
    const {soft} = this.stage.settings; // without it nothing fades, and a tour is refused that says so
    const keyframes = this.keyframes.map(({seconds, soft_opacity, ...camera}, i) => ({camera, time: starts[i],
      ...(soft ? {soft_opacity} : {})}));
    return {keyframes, closed: this.closed};
  }

  play() {
    const began = performance.now();
    const step = (now) => {
      const time = (now - began) / 1000;
      this.fade(this.opacityAt(Math.min(time, this.seconds)));
      this.stage.setCamera(this.at(Math.min(time, this.seconds)));
      if (time >= this.seconds) this.stop();
      else this.playing = requestAnimationFrame(step);
    };
    this.playing = requestAnimationFrame(step);
    this.dispatchEvent(new Event("play"));
  }

  stop() {
    if (!this.playing) return;
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    this.dispatchEvent(new Event("play"));
  }
}
