// <splat-map>: a map of a dataset, orthophoto and surface model, with Leaflet 1.x, which the page brings along.
//
//   <link rel="stylesheet" href="leaflet.css"><script src="leaflet.js"></script>
//   <script type="module" src="http://127.0.0.1:8080/clients/splat-map.js"></script>
//   <splat-map dataset="hall" photo="clip=z<2.3" surface="color_by=height&ramp=turbo"></splat-map>
//
// Attributes: dataset; src (the service; by default where this file came from); photo and surface, how each layer's tiles are
// drawn: parameters of api/maps.md, or all that stands behind the '?' of a URL of `splatd sign …/tiles/{z}/{x}/{y}.png?…`.
// `surface=""` leaves that one out. legend: parameters of …/legend.svg, by default what the surface says of its colours; beside a
// signed surface all that stands behind the '?' of a signed legend, since a signature for tiles is none for legends. The element's `map` is Leaflet's, there from its event `ready` on.
//
// For maps of your own: `await openTiles(L, service, "hall", "class=!3-5")` gives {layer, crs, bounds, toLatLng, info}.

/* A browser does not say why a script got no answer. */
function unread(service) {
  const origin = location.origin === "null" ? "'*'" : location.origin; // a file has none
  return `No answer from ${service} that this page may read: either it cannot be reached, or it was started without --cors ${origin}`;
}

/** One way to draw a dataset from above: a layer of Leaflet's, and the coordinate system that its map must have. */
export async function openTiles(L, service, dataset, query = "") {
  const address = new URL(`/v1/datasets/${encodeURIComponent(dataset)}/tiles.json`, service);
  address.search = query;
  const reply = await fetch(address).catch(() => {
    throw new Error(unread(service));
  });
  const info = await reply.json();
  if (!reply.ok) throw new Error(info.detail ?? `${reply.status} of ${address}`);
  const {scheme, corner: [west, north], side, bounds: [x0, y0, x1, y1]} = info.splatd;
  const earth = scheme === "mercator", s = 256 / side;
  const crs = earth ? L.CRS.EPSG3857 // else the dataset's own plane, in which a place is [y, x]
    : L.Util.extend({}, L.CRS.Simple, {transformation: new L.Transformation(s, -west * s, -s, north * s)});
  const bounds = earth ? L.latLngBounds([info.bounds[1], info.bounds[0]], [info.bounds[3], info.bounds[2]])
    : L.latLngBounds([y0, x0], [y1, x1]);
  // TileJSON's template is a path; put together as text, since a URL would encode its braces
  const template = new URL(service).origin + info.tiles[0].replace("{y}.png", "{y}{r}.png");
  const maxZoom = Math.min(info.maxzoom + 3, 30);
  // a hair less than all, or rounding would ask for tiles that lie beside and are none
  const layer = L.tileLayer(template, {bounds: bounds.pad(-1e-9), maxZoom, noWrap: true});
  return {layer, crs, bounds, info, maxZoom, toLatLng: (x, y) => L.latLng(y, x)};
}

/* What a query says of colours, as parameters of a legend; "" where it says none. */
function colorsOf(given) {
  const names = ["color_by", "ramp", "range"].filter((name) => given.has(name));
  return given.has("color_by") ? names.map((name) => `${name}=${encodeURIComponent(given.get(name))}`).join("&") : "";
}

const named = (name, value, unit) => `${name} ${value.toFixed(unit === "°" ? 7 : 2)}${unit}`;

class SplatMap extends HTMLElement {
  connectedCallback() {
    if (!this.map && !this.opening) this.opening = this.#open().catch((error) => this.#say(error.message));
  }

  disconnectedCallback() {
    this.map?.remove();
    this.map = this.opening = undefined;
  }

  #say(text) {
    this.textContent = text;
    this.setAttribute("role", "alert");
  }

  async #open() {
    const service = this.getAttribute("src") || new URL(import.meta.url).origin, dataset = this.getAttribute("dataset");
    if (!window.L) throw new Error("<splat-map> needs Leaflet: load leaflet.js before");
    const ways = [["Orthophoto", this.getAttribute("photo") ?? ""], ["Surface", this.getAttribute("surface") ?? "color_by=height&shade=edl"]];
    const wanted = ways.filter(([name, query]) => name === "Orthophoto" || query);
    const replies = await Promise.allSettled(wanted.map(([, query]) => openTiles(L, service, dataset, query)));
    const refused = replies.find(({status}) => status === "rejected"); // the first layer's, not the first to come
    if (refused) throw refused.reason;
    const opened = replies.map(({value}) => value);
    if (!this.isConnected) return;
    const {crs, bounds, info, maxZoom} = opened[0], frame = document.createElement("div");
    if (getComputedStyle(this).display === "inline") this.style.display = "block"; // a page's own style stands
    frame.style.height = "100%";
    this.replaceChildren(frame);
    this.map = L.map(frame, {crs, maxZoom, zoomSnap: 1}).fitBounds(bounds);
    this.map.setMinZoom(Math.max(this.map.getZoom() - 3, 0));
    opened[0].layer.addTo(this.map);
    if (opened.length > 1) {
      const legend = this.#legend(service, dataset, wanted[1][1]);
      L.control.layers(Object.fromEntries(opened.map((one, i) => [wanted[i][0], one.layer])), {}, {collapsed: false}).addTo(this.map);
      this.map.on("baselayerchange", ({name}) => legend && (name === "Surface" ? legend.addTo(this.map) : legend.remove()));
    }
    this.#coordinates(info);
    this.layers = opened.map((one) => one.layer);
    this.dispatchEvent(new Event("ready"));
  }

  /* What the surface's colours mean, or nothing where it has none or `legend` is empty. */
  #legend(service, dataset, query) {
    const given = new URLSearchParams(query), asked = this.getAttribute("legend") ?? colorsOf(given);
    const of = new URLSearchParams(asked).get("color_by") ?? given.get("color_by");
    if (!asked || !of) return undefined;
    if (given.has("sig") && !this.hasAttribute("legend")) {
      console.warn(`<splat-map>: no legend: a signature for tiles is none for legends. Sign …/legend.svg?${asked} and say legend="${asked}&exp=…&sig=…"`);
      return undefined;
    }
    const control = L.control({position: "bottomright"});
    control.onAdd = () => {
      const image = document.createElement("img");
      const address = new URL(`/v1/datasets/${encodeURIComponent(dataset)}/legend.svg`, service);
      image.src = `${address}?${asked}`; // as it was signed, sign by sign
      image.alt = `Legend: ${of}`;
      return image;
    };
    return control;
  }

  /* Where the pointer is, in degrees or in the dataset's coordinates. */
  #coordinates(info) {
    const earth = info.splatd.scheme === "mercator", unit = earth ? "°" : ` ${info.splatd.unit}`;
    const control = L.control({position: "bottomleft"}), text = document.createElement("output");
    text.style.cssText = "background:#fffc;padding:2px 6px;font:12px monospace;color:#000";
    text.hidden = true; // until there is something to say
    control.onAdd = () => text;
    control.addTo(this.map);
    this.map.on("mousemove", ({latlng: {lat, lng}}) => {
      text.hidden = false;
      text.textContent = `${named(earth ? "lon" : "x", lng, unit)}  ${named(earth ? "lat" : "y", lat, unit)}`;
    });
  }
}

customElements.define("splat-map", SplatMap);
