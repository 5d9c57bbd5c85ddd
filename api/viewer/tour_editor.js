// The list of keyframes and its buttons.

import {save} from "./service.js";

const $ = (id) => document.getElementById(id);

function button(label, name, action, disabled = false) {
  const element = document.createElement("button");
  element.type = "button";
  element.textContent = label;
  element.ariaLabel = name;
  element.disabled = disabled;
  element.addEventListener("click", action);
  return element;
}

function row(tour, i, say) {
  const {length} = tour.keyframes,
    name = `keyframe ${i + 1}`;
  const item = document.createElement("li");
  const seconds = document.createElement("input");
  Object.assign(seconds, {
    type: "number",
    min: 0.1,
    max: 3600,
    step: "any",
    value: tour.keyframes[i].seconds,
    ariaLabel: `Seconds after ${name}`,
    disabled: i === length - 1,
  });
  seconds.addEventListener("change", () => seconds.checkValidity() && tour.set(i, {seconds: Number(seconds.value)}));
  const act = (focus, action, text) => () => {
    action();
    say(text);
    const rows = $("keyframes").children;
    (rows[Math.min(focus, rows.length - 1)]?.querySelector("button") ?? $("add")).focus(); // the list was made anew
  };
  item.append(
    button(`${i + 1}`, `Go to ${name}`, () => tour.go(i)),
    seconds,
    document.createTextNode("s"),
    button(
      "↑",
      `Move ${name} up`,
      act(i - 1, () => tour.shift(i, -1), `${name} moved up`),
      i === 0,
    ),
    button(
      "↓",
      `Move ${name} down`,
      act(i + 1, () => tour.shift(i, 1), `${name} moved down`),
      i === length - 1,
    ),
    button(
      "×",
      `Remove ${name}`,
      act(i, () => tour.remove(i), `${name} removed`),
    ),
  );
  return item;
}

export function editTour(tour, say) {
  const show = () => {
    $("keyframes").replaceChildren(...tour.keyframes.map((_, i) => row(tour, i, say)));
    $("length").textContent = tour.keyframes.length
      ? `${tour.keyframes.length} keyframes, ${tour.seconds.toFixed(1)} s`
      : "No keyframes yet.";
    $("closed").checked = tour.closed;
    $("play").disabled = !tour.legs.length;
    $("download").disabled = !tour.keyframes.length;
  };
  tour.addEventListener("change", show);
  tour.addEventListener("play", () => ($("play").textContent = tour.playing ? "Stop" : "Play"));
  $("add").addEventListener("click", () => {
    if (!tour.stage.dataset) return;
    tour.add();
    say(`Keyframe ${tour.keyframes.length} added`);
  });
  $("play").addEventListener("click", () => (tour.playing ? tour.stop() : tour.play()));
  $("closed").addEventListener("change", () => tour.setClosed($("closed").checked));
  $("download").addEventListener("click", () => {
    save(JSON.stringify(tour.document(), null, 1), "application/json", `${tour.stage.dataset.id}-tour.json`);
  });
  tour.stage.element.addEventListener("pointerdown", () => tour.stop());
}
