"""Maps as people show them: api/examples/map.html with <splat-map> and Leaflet in Chromium, on another origin than the service,
under a policy, with and without a coordinate system, and with signed tiles; and GeoTIFFs as libgeotiff reads them. The scene
is ground of 40 × 40 m, its east half 3 m higher, with a red square whose middle is known."""
import base64
import contextlib
import functools
import http.server
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading

HERE = pathlib.Path(__file__)
ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"]).resolve()
sys.path[:0] = [str(HERE.parents[1] / "http"), str(ROOT / "api" / "clients")]
import browser
import numpy as np
from browser import Browser, Page
from harness import REAL, Daemon, Skipped, run
from splatd import Splatd, sign

LEAFLET = pathlib.Path("/usr/share/javascript/leaflet")
WEST, SOUTH, SIDE = 500010.0, 5400010.0, 40.0
RED, FLAT, MIDDLE = (500018.0, 5400038.0), (500020.0, 5400024.0), (500030.0, 5400030.0)
KEY = "0123456789abcdef0123456789abcdef"
PROJ, TIFF = (os.environ[f"SPLATD_{name}"] == "1" for name in ("PROJ", "TIFF"))


def make_scene(folder):
    """{name: dataset}: town in EPSG:25832, and yard, the same without a coordinate system."""
    x, y = (a.ravel() for a in np.meshgrid(WEST + 0.1 + 0.2 * np.arange(200), SOUTH + 0.1 + 0.2 * np.arange(200)))
    rows = np.zeros(len(x), "<f8,<f8,<f8,u1,u1,u1")
    rows["f0"], rows["f1"], rows["f2"] = x, y, np.where(x > MIDDLE[0], 3, 0)
    red = np.maximum(abs(x - RED[0]), abs(y - RED[1])) < 2
    for name, ground, mark in (("f3", 40 + 2 * (x - WEST), 250), ("f4", 100 + 2 * (y - SOUTH), 10), ("f5", 90 + 0 * x, 20)):
        rows[name] = np.where(red, mark, ground)
    scan = pathlib.Path(folder, "scan.ply")
    scan.write_bytes(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(x)}\nproperty double x\nproperty double y\nproperty double z\n"
                     "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n".encode() + rows.tobytes())
    made = {}
    for name, crs in (("town", "EPSG:25832"), ("yard", "none")):
        made[name] = str(pathlib.Path(folder, f"{name}.spld"))
        subprocess.run([REAL, "pack", scan, "--crs", crs, "--unit", "m", "-o", made[name]], check=True, capture_output=True, timeout=600)
    return made


@functools.lru_cache(maxsize=None)
def scene():
    folder = tempfile.mkdtemp(prefix="splatd-map-")
    import atexit
    atexit.register(shutil.rmtree, folder, True)
    return make_scene(folder)


@contextlib.contextmanager
def site(service, dataset, **attributes):
    """The example's page as its own web site, which allows no inline script, nothing but itself and the service."""
    page = (ROOT / "api/examples/map.html").read_text()
    assert page.count("http://127.0.0.1:8080/clients/splat-map.js") == 1 and page.count('dataset="hall"') == 1
    own = " ".join(f'{name}="{value.replace("&", "&amp;")}"' for name, value in attributes.items())
    page = page.replace("http://127.0.0.1:8080", service)
    page = re.sub(r'dataset="hall" surface="[^"]*"', lambda found: found[0].replace("hall", dataset) if not own else f'dataset="{dataset}" {own}', page)
    policy = f"default-src 'none'; script-src 'self' {service}; style-src 'self'; img-src 'self' data: {service}; connect-src {service}"

    class Site(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            name = self.path.lstrip("/") or "map.html"
            files = {"map.html": page.encode(), "map.css": (ROOT / "api/examples/map.css").read_bytes()}
            body = files.get(name)
            if body is None and (LEAFLET / name).is_file():
                body = (LEAFLET / name).read_bytes()
            kind = {"html": "text/html", "css": "text/css", "js": "text/javascript", "png": "image/png"}.get(name.rpartition(".")[2], "text/plain")
            self.send_response(200 if body is not None else 204)  # 204: a favicon that nobody needs
            self.send_header("Content-Type", kind)
            self.send_header("Content-Security-Policy", policy)
            self.end_headers()
            self.wfile.write(body or b"")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Site)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


@contextlib.contextmanager
def serving(*args, cors=True):
    """A daemon whose replies pages of any port of this machine may read."""
    with Daemon(REAL, *(["--cors", "*"] if cors else []), *args, datasets=list(scene().values())) as d:
        yield d, f"http://127.0.0.1:{d.port}"


def pixels_of(tab):
    """The tab as H×W×3; the browser itself decodes its screenshot."""
    shot = tab.send("Page.captureScreenshot", format="png")["data"]
    if keep := os.environ.get("SPLATD_PICTURES"):
        pathlib.Path(keep, f"map-{len(os.listdir(keep))}.png").write_bytes(base64.b64decode(shot))
    width, height, raw = tab.run(f"""(async () => {{
        const image = await createImageBitmap(new Blob([Uint8Array.from(atob('{shot}'), c => c.charCodeAt(0))]));
        const canvas = new OffscreenCanvas(image.width, image.height).getContext('2d');
        canvas.drawImage(image, 0, 0);
        const bytes = canvas.getImageData(0, 0, image.width, image.height).data;
        let text = '';
        for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
        return [image.width, image.height, btoa(text)]; }})()""")
    return np.frombuffer(base64.b64decode(raw), np.uint8).reshape(height, width, 4)[..., :3].astype(np.int32)


chromium = None


@contextlib.contextmanager
def page(url, complaints=r"(?!)", ready=True, size=(800, 800)):
    global chromium
    if not browser.BINARY or not (LEAFLET / "leaflet.js").is_file():
        raise Skipped("there is no chromium, or no Leaflet (libjs-leaflet)")
    chromium = chromium or Browser()
    tab = Page(chromium, url, size=size)
    try:
        if ready:
            tab.until("!!document.querySelector('splat-map').map")
            still(tab)
        yield tab
        wrong = [c for c in tab.complaints if not re.search(complaints, c)]
        assert not wrong, wrong
    finally:
        tab.close()


def still(tab):
    """All tiles are there, and nothing fades any more."""
    tab.until("""(e => !!e.map && !e.map._animatingZoom && [...e.querySelectorAll('img.leaflet-tile')].length &&
        [...e.querySelectorAll('img.leaflet-tile')].every(i => i.complete && i.naturalWidth && getComputedStyle(i).opacity == 1) &&
        e.layers.filter(l => e.map.hasLayer(l)).every(l => !l.isLoading()))(document.querySelector('splat-map'))""")


def look(tab, lat, lng, zoom, background="#ff00ff"):
    """Goes there, shows nothing but tiles, on a ground that no scene has, and gives the pixels."""
    tab.run(f"""(e => {{ e.map.options.zoomAnimation = e.map.options.fadeAnimation = false; e.map.setView([{lat!r}, {lng!r}], {zoom}, {{animate: false}});
        e.map.getContainer().style.background = '{background}';
        for (const c of e.querySelectorAll('.leaflet-control-container')) c.style.display = 'none'; }})(document.querySelector('splat-map'))""")
    still(tab)
    return pixels_of(tab)


def is_red(pixels):
    return (pixels[..., 0] > 180) & (pixels[..., 1] < 70) & (pixels[..., 2] < 70)


def check_map(tab, red, flat, zoom):
    """`red` and `flat` are [lat, lng] of the map."""
    pixels = look(tab, *red, zoom)
    rows, columns = np.nonzero(is_red(pixels))
    where = tab.run(f"(p => [p.x, p.y])(document.querySelector('splat-map').map.latLngToContainerPoint([{red[0]!r}, {red[1]!r}]))")
    assert len(rows) > 400, len(rows)
    assert np.hypot(columns.mean() + 0.5 - where[0], rows.mean() + 0.5 - where[1]) < 1.5, (columns.mean(), rows.mean(), where)
    # the whole page is ground: what is missing at tiles' borders would show the page's own colour, magenta
    pixels = look(tab, *flat, zoom)
    borders = tab.run("""[...document.querySelectorAll('splat-map img.leaflet-tile')].map(i => i.getBoundingClientRect()).map(r => [r.left, r.top])""")
    inner = sorted({round(x) for x, y in borders if 50 < x < 750}), sorted({round(y) for x, y in borders if 50 < y < 750})
    assert inner[0] and inner[1], borders  # there are borders to look at
    magenta = (pixels[..., 0] > 200) & (pixels[..., 1] < 60) & (pixels[..., 2] > 200)
    assert not magenta.any(), np.argwhere(magenta)[:5]
    # colours run on over each border: the step there is no larger than elsewhere
    plain = pixels[:, :, 1].astype(int)
    across = np.abs(np.diff(plain, axis=0)).mean(1)
    for y in inner[1]:
        assert across[y - 1] < across.mean() + 3 * across.std() + 1, (y, across[y - 1], across.mean())
    return pixels


def test_a_map_of_the_earth():
    if not PROJ:
        raise Skipped("built without PROJ")
    with serving() as (d, service), site(service, "town") as url:
        town = Splatd(service).dataset("town")
        red, flat = ([*reversed(town.place("EPSG:4326", world=[*at, 0])["position"][:2])] for at in (RED, FLAT))
        with page(url) as tab:
            assert tab.run("document.querySelector('splat-map').map.options.crs === L.CRS.EPSG3857")
            check_map(tab, red, flat, 22)
            tab.mouse("mouseMoved", 400, 400)
            tab.run("for (const c of document.querySelectorAll('.leaflet-control-container')) c.style.display = ''")
            told = tab.text("splat-map output")
            lon, lat = map(float, re.findall(r"-?\d+\.\d+", told))
            assert abs(lat - flat[0]) < 1e-6 and abs(lon - flat[1]) < 1e-6 and "°" in told, (told, flat)
            tab.run("document.querySelector('splat-map').map.fitBounds([[40, 0], [60, 20]], {animate: false}), 0")  # far out: it stops


def test_a_map_of_a_plane_and_its_surface():
    with serving() as (d, service), site(service, "yard") as url:
        yard = Splatd(service).dataset("yard")
        with page(url) as tab:
            pixels = check_map(tab, RED[::-1], FLAT[::-1], 3)  # places are [y, x]; a tile is 5 m
            scale = tab.run(f"(m => m.project([{SOUTH}, {WEST + 1}], 3).x - m.project([{SOUTH}, {WEST}], 3).x)(document.querySelector('splat-map').map)")
            assert abs(scale - 256 * 2**3 / yard.tiles().side) < 1e-6, scale
            # as one view of the same place
            half = 400 / scale
            seen = yard.array("color", eye=[*FLAT, 20], target=[*FLAT, 0], view_height=2 * half, width=800, height=800)[..., :3].astype(int)
            off = np.abs(seen - pixels).max(2) > 24
            assert off.mean() < 0.02, off.mean()
            # the surface model: the same place in the colours of heights, low in the west, high in the east, with its legend
            tab.run("for (const c of document.querySelectorAll('.leaflet-control-container')) c.style.display = ''")
            assert tab.run("[...document.querySelectorAll('.leaflet-control-layers-base label')].map(l => l.textContent.trim())") == ["Orthophoto", "Surface"]
            tab.run("document.querySelectorAll('.leaflet-control-layers-base input')[1].click()")
            tab.until("(i => i && i.complete && i.naturalWidth > 20)(document.querySelector('splat-map img[src*=legend]'))")
            assert tab.run("document.querySelector('splat-map img[src*=legend]').alt") == "Legend: height"
            still(tab)
            surface = look(tab, MIDDLE[1], MIDDLE[0], 3)
            wanted = yard.array("color", eye=[*MIDDLE, 20], target=[*MIDDLE, 0], view_height=2 * half, width=800, height=800, color_by="height", shade="edl")
            for x in (150, 650):
                flat = np.median(surface[300:500, x - 20:x + 20].reshape(-1, 3), 0)
                assert np.abs(flat - np.median(wanted[300:500, x - 20:x + 20, :3].reshape(-1, 3), 0)).max() <= 3, (x, flat)
            assert np.abs(surface[400, 150] - surface[400, 650]).max() > 60
            edge = np.argmax(np.abs(np.diff(surface[400].astype(int), axis=0)).max(1)) + 1  # where the ground steps up
            assert abs(edge - 400) <= 4, edge
            assert not is_red(surface).any()


def test_what_goes_wrong_is_said():
    with serving(cors=False) as (d, service), site(service, "yard") as url:
        with page(url, "CORS|Failed to load", ready=False) as tab:
            told = tab.until("document.querySelector('splat-map[role=alert]')?.textContent")
            assert f"No answer from {service} " in told and told.endswith(f" --cors {url}"), told
    with serving() as (d, service):
        for dataset, more, said in (("none", {}, "there is no dataset 'none'"), ("yard", {"photo": "lod=-1"}, "lod"),
                                    ("yard", {"surface": "color_by=nothing"}, "nothing")):
            with site(service, dataset, **more) as url, page(url, "Failed to load", ready=False) as tab:
                assert said in tab.until("document.querySelector('splat-map[role=alert]')?.textContent"), said


def test_a_public_map_needs_no_token():
    with tempfile.TemporaryDirectory() as folder:
        tokens, key = pathlib.Path(folder, "tokens"), pathlib.Path(folder, "key")
        tokens.write_text("viewer-0123456789abcdef view\n")
        key.write_text(KEY)
        tokens.chmod(0o600)
        key.chmod(0o600)
        with serving("--tokens", str(tokens), "--url-key", str(key)) as (d, service):
            tiles = "tiles/{z}/{x}/{y}.png"
            signed = {name: sign(f"/v1/datasets/yard/{path}", KEY).partition("?")[2] for name, path in (
                ("photo", tiles), ("surface", f"{tiles}?color_by=height&shade=edl"), ("legend", "legend.svg?color_by=height&ramp=viridis"))}
            with site(service, "yard", photo=signed["photo"], surface=signed["surface"]) as url, page(url, "no legend") as tab:
                tab.run("document.querySelectorAll('.leaflet-control-layers-base input')[1].click()")
                said = [c for c in tab.complaints if "legend.svg?color_by=height and say legend=" in c]
                assert len(said) == 1 and not tab.run("document.querySelector('splat-map img[src*=legend]')"), tab.complaints
            with site(service, "yard", **signed) as url, page(url) as tab:
                pixels = look(tab, RED[1], RED[0], 3)
                assert is_red(pixels).sum() > 400
                addresses = tab.run("[...document.querySelectorAll('img.leaflet-tile')].map(i => i.src)")
                assert addresses and all("sig=" in a and "token" not in a for a in addresses), addresses
                tab.run("document.querySelectorAll('.leaflet-control-layers-base input')[1].click()")
                tab.until("(i => i && i.complete && i.naturalWidth > 20)(document.querySelector('splat-map img[src*=legend]'))")
                still(tab)
                assert not is_red(pixels_of(tab)[200:600, 200:600]).any()
            with site(service, "yard", photo=signed["photo"][:-1] + ("A" if signed["photo"][-1] != "A" else "B")) as url, page(url, "Failed to load", ready=False) as tab:
                assert "not signed with this service's key" in tab.until("document.querySelector('splat-map[role=alert]')?.textContent")


def test_geotiffs_as_libgeotiff_reads_them():
    """Corners to a millimetre, photograph and surface on the same pixels, the coordinate system by number."""
    if not TIFF or not shutil.which("listgeo"):
        raise Skipped("built without libtiff, or there is no listgeo (geotiff-bin)")
    plan = dict(projection="orthographic", eye=[500030.125, 5400029.875, 30], target=[500030.125, 5400029.875, 0], units_per_pixel=0.125, width=240, height=160)
    west, north = 500030.125 - 120 * 0.125, 5400029.875 + 80 * 0.125
    wanted = {"Upper Left": (west, north), "Lower Left": (west, north - 20), "Upper Right": (west + 30, north), "Lower Right": (west + 30, north - 20),
              "Center": (west + 15, north - 10)}
    with serving() as (d, service), tempfile.TemporaryDirectory() as folder:
        town, said = Splatd(service).dataset("town"), {}
        for layer in "color", "depth":
            file = pathlib.Path(folder, f"{layer}.tif")
            file.write_bytes(town.view(**plan, layer=layer, format="tiff").bytes)
            said[layer] = subprocess.run(["listgeo", "-proj4", file], check=True, capture_output=True, text=True).stdout
            for corner, place in wanted.items():
                found = re.search(rf"{corner}\s+\(\s*(-?[\d.]+),\s*(-?[\d.]+)\)", said[layer])
                assert found and max(abs(float(a) - b) for a, b in zip(found.groups(), place)) < 1e-3, (layer, corner, said[layer])
            assert "ProjectedCSTypeGeoKey (Short,1): Code-25832" in said[layer] or "PCS_ETRS89_UTM_zone_32N" in said[layer] or "25832" in said[layer], said[layer]
            assert "RasterPixelIsArea" in said[layer]
        corners = [re.findall(r"\([\s\d.,-]+\)", text) for text in said.values()]
        assert corners[0] == corners[1] and len(corners[0]) >= 5, corners


try:
    run(globals())
finally:
    if chromium:
        chromium.close()
