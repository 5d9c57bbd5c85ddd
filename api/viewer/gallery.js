// The datasets as pictures with their titles, where the service has several: a link each.

import {ask, query} from "./service.js";

const AT_ONCE = 2; // pictures on their way: the service has other clients
const TRIES = 3;

export class Gallery {
  /** `element` holds a list. */
  constructor(element) {
    this.element = element;
    this.list = element.querySelector("ul");
    this.waiting = []; // {img, dataset, tries} in view, to be asked for
    this.busy = 0;
    this.turn = 0; // of show(): what belongs to an older one is dropped
    this.urls = [];
    this.kept = {};
    this.seen = new IntersectionObserver((entries) => {
      for (const {target, isIntersecting} of entries)
        if (isIntersecting) {
          this.seen.unobserve(target);
          this.waiting.push({img: target, dataset: target.dataset_, tries: 0});
        }
      this.pump();
    });
  }

  get shown() {
    return !this.element.hidden;
  }

  hide() {
    this.element.hidden = true;
    this.clear();
  }

  clear() {
    this.turn++;
    this.waiting = [];
    this.busy = 0;
    this.seen.disconnect();
    this.list.replaceChildren();
    for (const url of this.urls) URL.revokeObjectURL(url);
    this.urls = [];
  }

  /** In other colours. */
  redraw() {
    this.show(this.datasets);
  }

  /** As GET /v1/datasets lists them; `kept`: what the fragment says of what is drawn, for pictures and links. */
  show(datasets, kept = this.kept) {
    this.clear();
    this.kept = kept;
    this.datasets = datasets;
    this.element.hidden = false;
    this.list.append(...datasets.map((dataset) => this.card(dataset)));
  }

  card(dataset) {
    const {id, title, state, points, reason, faulty_tiles} = dataset;
    const item = document.createElement("li"),
      link = document.createElement("a"),
      shot = document.createElement("span"),
      name = document.createElement("strong"),
      about = document.createElement("small");
    link.href = `#${query({dataset: id, ...this.kept})}`;
    shot.className = "shot";
    name.textContent = title ?? id;
    about.textContent =
      state === "ready"
        ? [
            title ? id : "",
            `${points.toLocaleString("en").replaceAll(",", "\u202f")} points`,
            faulty_tiles?.count ? `${faulty_tiles.count} tiles cannot be read` : "",
          ]
            .filter(Boolean)
            .join(", ")
        : state === "loading"
          ? "being loaded"
          : `cannot be shown: ${reason}`;
    if (state === "ready") {
      const img = document.createElement("img");
      img.alt = "";
      img.dataset_ = dataset;
      shot.append(img);
      this.seen.observe(img);
    }
    link.append(shot, name, about);
    item.append(link);
    return item;
  }

  pump() {
    while (this.busy < AT_ONCE && this.waiting.length) this.load(this.waiting.shift());
  }

  async load(wish) {
    const {img, dataset} = wish,
      turn = this.turn;
    this.busy++;
    try {
      const width = devicePixelRatio > 1 ? 640 : 320;
      const {clip, class: classes, background: own} = this.kept;
      const background = own ?? getComputedStyle(this.element).getPropertyValue("--ground").trim().replace("#", "");
      const drawn = wish.whole ? {} : {clip, class: classes};
      const reply = await ask(`${dataset.thumbnail}?${query({width, background, ...drawn, v: dataset.version})}`);
      const url = URL.createObjectURL(await reply.blob());
      if (turn !== this.turn) return URL.revokeObjectURL(url);
      this.urls.push(url);
      img.src = url;
    } catch (problem) {
      if (turn !== this.turn) return;
      if (problem.kind === "refused" && !wish.whole) this.waiting.push({...wish, whole: true}); // it has no such attribute
      else if (problem.seconds && ++wish.tries < TRIES)
        setTimeout(() => {
          if (turn !== this.turn) return;
          this.waiting.push(wish);
          this.pump();
        }, problem.seconds * 1000);
    }
    this.busy--;
    this.pump();
  }
}
