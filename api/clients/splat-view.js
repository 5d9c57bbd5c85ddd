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
// crs      what eye and target are in, as EPSG:4326; without it the dataset's own coordinates
// eye, target, up, fov (or projection="orthographic" view_height), layer, lod, supersample, budget, method and whatever
//          GET /v1/methods says that it takes
//          as parameters of a view; changing one moves the view
//
// Event "camera": detail {eye, target, up, fov}, once the view has come to rest; the property `camera` has the last
// one. It is a frame of /embed/{id}, so no CORS is needed. Size it with CSS; by default it is 16:9 and as wide as it
// may be.

const HOME = new URL(import.meta.url).origin;
// Every other attribute goes into the page's fragment, but for HTML's own: the page says which it does not know.
const OWN = ["src", "dataset", "label", "token", "signed", "class", "tabindex"];

class SplatView extends HTMLElement {
  camera = null;
  #frame = document.createElement("iframe");
  #page = "";
  #address = "";
  #changes = new MutationObserver(() => this.#show());
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
    this.#changes.observe(this, {attributes: true});
    this.#show();
  }

  disconnectedCallback() {
    removeEventListener("message", this.#heard);
    this.#changes.disconnect();
    this.#page = this.#address = "";
  }

  #show() {
    const dataset = this.getAttribute("dataset");
    if (!dataset) return;
    const given = [...this.attributes].filter(({name}) => !OWN.includes(name) && !name.includes("-") && !(name in HTMLElement.prototype));
    const fragment = given.map(({name, value}) => `${name}=${encodeURIComponent(value)}`).join("&");
    const signed = this.hasAttribute("signed") ? `?${this.getAttribute("signed")}` : "";
    const page = new URL(`/embed/${encodeURIComponent(dataset)}${signed}`, this.getAttribute("src") || HOME).href;
    this.#frame.title = this.getAttribute("label") || `View of ${dataset}`;
    const address = `${page}#${fragment}`;
    if (address === this.#address) return;
    this.#address = address;
    // A frame that is there already is told by its fragment alone, without an entry in the history.
    if (page === this.#page) this.#frame.contentWindow.location.replace(address);
    else this.#frame.src = address;
    this.#page = page;
  }
}

customElements.define("splat-view", SplatView);
