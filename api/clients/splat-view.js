// A view of a dataset that people can move in, for any page on any origin.
//
//   <splat-view src="https://splats.example" dataset="hall" eye="4,5,6" target="0,0,1" fov="40"></splat-view>
//   <script type="module" src="https://splats.example/clients/splat-view.js"></script>
//
// src      the service; by default where this file came from
// dataset  its id
// label    what screen readers call the view
// token    where the service wants one; whoever sees the page sees it, so let it allow no more than view
// signed   in its place, what `splatd sign /embed/ID` puts behind '?': exp=…&sig=…, for this dataset until it expires
// eye, target, up, fov, layer, method, visibility, kernel, threshold, pyramid, lod, supersample, atoms, budget
//          as parameters of a view; changing one moves the view
//
// Event "camera": detail {eye, target, up, fov}, once the view has come to rest; the property `camera` has the last
// one. It is a frame of /embed/{id}, so no CORS is needed. Size it with CSS; by default it is 16:9 and as wide as it
// may be.

const HOME = new URL(import.meta.url).origin;
const CAMERA = ["eye", "target", "up", "fov"];
const FILL = ["visibility", "kernel", "threshold", "pyramid"]; // of method fill
const SETTINGS = [...CAMERA, "layer", "method", ...FILL, "lod", "supersample", "atoms", "budget"];

class SplatView extends HTMLElement {
  static observedAttributes = ["src", "dataset", "label", "signed", ...SETTINGS];
  camera = null;
  #frame = document.createElement("iframe");
  #page = "";
  #heard = (event) => {
    const {splatd, ...camera} = event.data ?? {};
    if (event.source !== this.#frame.contentWindow) return;
    if (splatd === "token" && this.hasAttribute("token"))
      event.source.postMessage({splatd, token: this.getAttribute("token")}, new URL(this.#page).origin);
    if (splatd !== "camera") return;
    this.camera = camera;
    this.dispatchEvent(new CustomEvent("camera", {detail: camera, bubbles: true}));
  };

  constructor() {
    super();
    const style = document.createElement("style");
    style.textContent =
      ":host{display:block;aspect-ratio:16/9}:host([hidden]){display:none}" +
      "iframe{width:100%;height:100%;border:0;display:block}";
    this.attachShadow({mode: "open"}).append(style, this.#frame);
  }

  connectedCallback() {
    addEventListener("message", this.#heard);
    this.#show();
  }

  disconnectedCallback() {
    removeEventListener("message", this.#heard);
    this.#page = "";
  }

  attributeChangedCallback() {
    if (this.isConnected) this.#show();
  }

  #show() {
    const dataset = this.getAttribute("dataset");
    if (!dataset) return;
    const given = SETTINGS.filter((name) => this.hasAttribute(name));
    const fragment = given.map((name) => `${name}=${encodeURIComponent(this.getAttribute(name))}`).join("&");
    const signed = this.hasAttribute("signed") ? `?${this.getAttribute("signed")}` : "";
    const page = new URL(`/embed/${encodeURIComponent(dataset)}${signed}`, this.getAttribute("src") || HOME).href;
    this.#frame.title = this.getAttribute("label") || `View of ${dataset}`;
    // A frame that is there already is told by its fragment alone, without an entry in the history.
    if (page === this.#page) this.#frame.contentWindow.location.replace(`${page}#${fragment}`);
    else this.#frame.src = `${(this.#page = page)}#${fragment}`;
  }
}

customElements.define("splat-view", SplatView);
