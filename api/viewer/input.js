// Mouse, touch and keyboard to cameras.
//
//   drag, one finger     orbit (or look round, when `stage.drag` is "look")
//   right or shift-drag, two fingers   pan; two fingers also pinch
//   wheel, + and -       nearer, farther
//   arrows               orbit or look; W A S D Q E  fly; shift: faster; Home: the dataset's view
//
// A press that does not move is a "click" event of the stage, two of them a "dblclick"; detail is the pixel. Enter
// clicks in the middle.

import {distance, dolly, look, move, orbit, pan} from "./camera.js";

const DRAG_PX = 4,
  DOUBLE_MS = 350;
const TURN = 1.2,
  FLY = 0.7,
  NEARER = 0.55; // a second: radians, distances to the target, share of that distance

export function attach(stage) {
  const element = stage.element;
  const pointers = new Map(); // id -> [x, y]
  let travel = 0,
    button = 0,
    lastClick = null,
    many = false;
  const at = (event) => {
    const box = element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const turn = (yaw, pitch) => stage.setCamera((stage.drag === "look" ? look : orbit)(stage.camera, yaw, pitch));
  const near = (factor, pixel) => stage.setCamera(dolly(stage.camera, factor, stage.size, pixel, stage.least));
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return {middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], apart: Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]))};
  };

  element.addEventListener("pointerdown", (event) => {
    if (event.target.closest("button, a, input, select")) return;
    element.setPointerCapture(event.pointerId);
    if (!pointers.size) [travel, button, many] = [0, event.button || (event.shiftKey ? 2 : 0), false];
    pointers.set(event.pointerId, at(event));
    many ||= pointers.size > 1;
  });

  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before || !stage.dataset) return;
    const now = at(event),
      [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    const old = pointers.size === 2 ? spread() : null;
    pointers.set(event.pointerId, now);
    travel += Math.abs(dx) + Math.abs(dy);
    if (travel < DRAG_PX) return;
    const height = stage.size[1];
    if (old) {
      const {middle, apart} = spread();
      stage.setCamera(pan(stage.camera, middle[0] - old.middle[0], middle[1] - old.middle[1], height));
      near(old.apart / apart, middle);
    } else if (button) stage.setCamera(pan(stage.camera, dx, dy, height));
    else if (stage.drag === "look") {
      const scale = (stage.camera.fov * Math.PI) / 180 / height; // what is under the pointer stays there
      turn(dx * scale, dy * scale);
    } else turn((-dx * Math.PI) / height, (-dy * Math.PI) / height);
  });

  const release = (event) => {
    const pixel = pointers.get(event.pointerId);
    if (!pixel) return;
    pointers.delete(event.pointerId);
    if (event.type === "pointercancel" || pointers.size || many || button || travel >= DRAG_PX || !stage.dataset) return;
    const twice =
      lastClick &&
      event.timeStamp - lastClick.time < DOUBLE_MS &&
      Math.hypot(pixel[0] - lastClick.pixel[0], pixel[1] - lastClick.pixel[1]) < 2 * DRAG_PX;
    lastClick = twice ? null : {time: event.timeStamp, pixel};
    stage.dispatchEvent(new CustomEvent(twice ? "dblclick" : "click", {detail: pixel}));
  };
  element.addEventListener("pointerup", release);
  element.addEventListener("pointercancel", release);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      if (!stage.dataset) return;
      const pixels = event.deltaY * (event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : 1);
      near(Math.exp(Math.min(1, Math.max(-1, pixels * 0.0015))), at(event));
    },
    {passive: false},
  );

  // Keys act as long as they are held: by time, not by repeats.
  const actions = {
    arrowleft: (s) => go(s, 0),
    arrowright: (s) => go(-s, 0),
    arrowup: (s) => go(0, s),
    arrowdown: (s) => go(0, -s),
    w: (s) => fly(0, 0, s),
    s: (s) => fly(0, 0, -s),
    a: (s) => fly(-s, 0, 0),
    d: (s) => fly(s, 0, 0),
    e: (s) => fly(0, s, 0),
    q: (s) => fly(0, -s, 0),
    "+": (s) => near(NEARER ** s, middle()),
    "-": (s) => near(NEARER ** -s, middle()),
  };
  actions["="] = actions["+"]; // the same key without shift
  actions._ = actions["-"];
  const go = (left, up) => {
    // the camera itself goes, or turns, that way
    const angle = stage.drag === "look" ? TURN : -TURN;
    turn(left * angle, up * angle);
  };
  const middle = () => stage.size.map((x) => x / 2);
  const fly = (x, y, z) => {
    const d = distance(stage.camera) * FLY;
    stage.setCamera(move(stage.camera, x * d, y * d, z * d));
  };
  const held = new Set();
  let fast = false,
    last = 0;
  const step = (now) => {
    const seconds = Math.min(0.1, (now - last) / 1000) * (fast ? 3 : 1);
    last = now;
    for (const key of held) actions[key](seconds);
    if (held.size) requestAnimationFrame(step);
  };
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !stage.dataset || event.target !== element) return;
    const key = event.key.toLowerCase();
    fast = event.shiftKey;
    if (key === "home") stage.setCamera(stage.home);
    else if (key === "enter") stage.dispatchEvent(new CustomEvent("click", {detail: middle()}));
    else if (!actions[key]) return;
    else if (!held.has(key)) {
      actions[key](0.05); // a short press moves too
      held.add(key);
      if (held.size === 1) requestAnimationFrame((now) => step((last = now)));
    }
    event.preventDefault();
  });
  element.addEventListener("keyup", (event) => {
    fast = event.shiftKey;
    held.delete(event.key.toLowerCase());
    if (event.key === "Shift") held.clear(); // the key that comes up now has another name
  });
  element.addEventListener("blur", () => held.clear());
}
