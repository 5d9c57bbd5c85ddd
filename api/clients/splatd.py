"""Client of splatd. Standard library only, numpy for arrays; one file, to be copied anywhere.

    from splatd import Splatd, ring
    hall = Splatd("http://127.0.0.1:8080").dataset("hall")
    for i, camera in enumerate(ring((0, 0, 1), 36, radius=6, height=3)):
        with open(f"view{i:02}.jpg", "wb") as file:
            file.write(hall.view(**camera, width=1280, height=720, fov=50).bytes)
    hall.cloud(eye=[4, 5, 6], target=[0, 0, 1], clip="z<2.3", class_=[2, 6]).save("cloud.ply")   # needs numpy

On the command line:  python3 splatd.py http://127.0.0.1:8080 hall eye=4,5,6 target=0,0,1 layer=depth > depth.png
"""
import array
import base64
import email
import email.utils
import hmac
import json
import math
import re
import struct
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import zlib

CAMERA = ("eye", "target", "up", "station", "fov", "fx", "fy", "cx", "cy", "projection", "view_height", "units_per_pixel", "azimuth", "elevation")


class SplatdError(Exception):
    """What the service refused: `status`, `field` (the parameter at fault, or ""), and its words. `status` is 0 where it gave
    no answer; the words name its address then."""

    def __init__(self, status, problem):
        self.status, self.field = status, problem.get("field", "")
        said = problem.get("detail") or problem.get("title") or "no reason given"
        super().__init__(f"{status}: {said}" if status else said)


class View:
    """An encoded image: its `bytes`, `type`, and `headers`; `camera` is the one that was used; `complete` is False where
    coarser parts stand in, which wait=0 allows."""

    def __init__(self, body, headers):
        self.bytes, self.type, self.headers = body, headers["Content-Type"], headers
        self.camera = json.loads(headers["Splatd-Camera"]) if headers["Splatd-Camera"] else None
        self.complete = headers["Splatd-Complete"] != "false"

    def array(self):
        """The pixels of a view with format="npy", rows first."""
        return read_npy(self.bytes)


class Cloud:
    """Points of a view: `points` N×3 doubles in world coordinates, `colors` N×3 of uint8, and what else was asked for:
    `normals` N×3, `ids` N (None where not)."""

    def __init__(self, points, colors, normals=None, ids=None):
        self.points, self.colors, self.normals, self.ids = points, colors, normals, ids

    def __len__(self):
        return len(self.points)

    def ply(self):
        """As a binary PLY: bytes."""
        np = numpy()
        fields = [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("red", "u1"), ("green", "u1"), ("blue", "u1")]
        columns = [*self.points.T, *self.colors.T]
        if self.normals is not None:
            fields += [("nx", "<f4"), ("ny", "<f4"), ("nz", "<f4")]
            columns += [*self.normals.T]
        if self.ids is not None:
            fields, columns = [*fields, ("splat", "<u4")], [*columns, self.ids]
        rows = np.zeros(len(self), fields)
        for (name, _), column in zip(fields, columns):
            rows[name] = column
        kinds = {"<f8": "double", "<f4": "float", "u1": "uchar", "<u4": "uint"}
        head = "".join(f"property {kinds[kind]} {name}\n" for name, kind in fields)
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(self)}\n{head}end_header\n"
        return head.encode() + rows.tobytes()

    def save(self, path):
        with open(path, "wb") as file:
            file.write(self.ply())


class Tiles:
    """Map tiles of a dataset, drawn with the parameters that they were asked for with. `info` is their TileJSON; `url` a
    template with {z}/{x}/{y}, for Leaflet, QGIS, Grafana; it carries a signature where the service was opened with one."""

    def __init__(self, service, info):
        self.service, self.info = service, info
        self.url = service.locate(info["tiles"][0])
        self.corner, self.side = info["splatd"]["corner"], info["splatd"]["side"]
        self.is_mercator = info["splatd"]["scheme"] == "mercator"

    def tile(self, z, x, y, scale=1, format="png"):
        """One as a View: 256 pixels a side, 512 with scale=2; png or webp."""
        path = self.info["tiles"][0].replace("{y}.png", "{y}" + ("@2x" if scale == 2 else "") + "." + format)
        return View(*self.service.ask(path.format(z=z, x=x, y=y), granted=True))

    def find(self, x, y, z):
        """(x, y) in tiles of level z of a place: its whole part names the tile, the rest says where in it. x and y are
        longitude and latitude of tiles in Web Mercator, else world coordinates."""
        if self.is_mercator:
            radius = 6378137
            x, y = radius * math.radians(x), radius * math.asinh(math.tan(math.radians(y)))
        size = self.side / 2**z
        return (x - self.corner[0]) / size, (self.corner[1] - y) / size


class Tour:
    """Many frames along a path, which the service makes while no view waits. `info` is its status when last asked."""

    def __init__(self, service, info):
        self.service, self.info, self.name = service, info, info["name"]

    def refresh(self):
        self.info = self.service.json(self.info["uri"])
        return self.info

    def wait(self, seconds=3600, every=0.5, told=None):
        """Until it has ended; `told(info)` is called every time. RuntimeError where it failed, TimeoutError."""
        until = time.monotonic() + seconds
        while self.refresh()["state"] not in ("done", "failed"):
            if told:
                told(self.info)
            if time.monotonic() > until:
                raise TimeoutError(f"tour {self.name} has {self.info['frames_done']} of {self.info['frames']} frames after {seconds} s")
            time.sleep(every)
        if self.info["state"] == "failed":
            raise RuntimeError(f"tour {self.name}: {self.info['error']}")
        return self

    def frame(self, n):
        """Frame n, encoded: bytes."""
        return self.service.ask(self.info["frame"].format(n=n))[0]

    def zip(self):
        """All frames as a ZIP file: bytes."""
        return self.service.ask(self.info["zip"])[0]

    def video(self):
        """The MP4 of a tour that was made with video=True: bytes."""
        if not self.info["video"]:
            raise ValueError(f"tour {self.name} was made without video=True")
        return self.service.ask(self.info["video"])[0]

    def remove(self):
        self.service.ask(self.info["uri"], method="DELETE")


class Dataset:
    """`info` is what /v1/datasets/{id} says. Parameters of a view are those of api/openapi.yaml, as Python has them:

    vectors are lists, tuples or arrays; clip and soft are a term or a list of them; class_=2, [2, 6], "3-5" or "!7";
    range=(0, 200) or ("q0.02", "q0.98"); shade=["edl", "sun:135,45"]; what is None is left out. A `camera` is a dict, in
    any convention that api/cameras.md has."""

    def __init__(self, service, info):
        self.service, self.info, self.id = service, info, info["id"]
        self.center = info["default_view"]["target"]  # bounds have a middle, too, but strays move that anywhere
        self.title, self.description = info.get("title"), info.get("description")  # None where nobody has said any
        self.views = {view["name"]: view for view in info.get("views", [])}

    def view(self, **params):
        """One view, a View."""
        return View(*self.ask(self.info["view"], params))

    def thumbnail(self, width=320):
        """The default view, small: a View with a JPEG at 16:9."""
        return View(*self.ask(f"{self.info['uri']}/thumbnail.jpg", {"width": width}))

    def depth(self, layer="depth", **params):
        """(width, height, array of floats row by row): in the dataset's unit, NaN where nothing is."""
        view = self.view(**params, layer=layer, format="raw")
        values = array.array("f", view.bytes)
        if sys.byteorder == "big":
            values.byteswap()
        return view.camera["width"], view.camera["height"], values

    def array(self, layer="color", **params):
        """One layer as a numpy array, H×W×…: color 4 × uint8 (RGBA), depth, range and coverage float32, normal 3 × float32,
        id and primitive uint32."""
        return self.view(**params, layer=layer, format="npy").array()

    def arrays(self, *layers, **params):
        """({layer: array}, camera) of one frame, so that all show the same: arrays("color", "depth", "normal", "id", eye=…)."""
        body, headers = self.ask(self.info["view"], {**params, "layers": list(layers), "format": "npy"})
        parts = {part.get_filename().rpartition(".")[0]: read_npy(part.get_payload(decode=True)) for part in parts_of(body, headers)}
        return parts, json.loads(headers["Splatd-Camera"])

    def cloud(self, normals=False, ids=False, **params):
        """What a view shows as a point cloud, a Cloud: a point for every pixel where something is, all cameras but lenses."""
        layers = ["color", "range", *(["normal"] if normals else []), *(["id"] if ids else [])]
        found, camera = self.arrays(*layers, **params)
        seen = numpy().isfinite(found["range"])
        points = unproject(camera, found["range"], "range")[seen]
        return Cloud(points, found["color"][seen][:, :3], found["normal"][seen] if normals else None, found["id"][seen] if ids else None)

    def panorama(self, eye=None, forward=(0, 1, 0), **params):
        """All around from `eye`, equirectangular, upright; `forward` is the direction in its middle. Or with station=K, from where
        a scanner stood, what it had before it in the middle. A View."""
        if params.get("station") is not None:
            return self.view(**{"projection": "equirectangular", "eye": eye, **params})
        target = [a + b for a, b in zip(plain(eye), plain(forward))]
        return self.view(**{"projection": "equirectangular", "eye": eye, "target": target, **params})

    def scan(self, eye, azimuth=(180, -180, 1800), elevation=(-15, 15, 16), forward=(1, 0, 0), **params):
        """(ranges, points) of a scanner's rays: rings × columns, and those × 3 in world coordinates; NaN where nothing is.
        azimuth and elevation are (from, to, how many), in degrees to the right of `forward` and upwards."""
        view = self.panorama(eye, forward, azimuth=azimuth, elevation=elevation, layer="range", format="npy", **params)
        ranges = view.array()
        return ranges, ranges[..., None] * scan_rays(view.camera, azimuth, elevation) + numpy().array(view.camera["eye"])

    def batch(self, views, **common):
        """Many views in one request: a View each, in order, or the SplatdError in place of one that failed. `views` are dicts
        of parameters; `common` is what goes for all of them."""
        document = {**posted(common), "views": [posted(view) for view in views]}
        body, headers = self.ask_json(f"{self.info['uri']}/views", document)
        return [SplatdError(json.loads(p.get_payload(decode=True))["status"], json.loads(p.get_payload(decode=True)))
                if p.get_content_type() == "application/problem+json" else View(p.get_payload(decode=True), p)
                for p in parts_of(body, headers)]

    def rays(self, directions, layer="range", **params):
        """How far it is along each direction, an array of floats, NaN where nothing is: a simulated lidar. `directions` is a
        list of [x, y, z], or numpy's array of them, up to 2**20; frame="sensor" has x forward, y left, z up, "world" the
        dataset's axes, "camera" x right, y down, z forward. eye, target and up stand upright: how steeply target is looked at
        does not count. camera={"matrix": …} is taken as it is, with up to 32,768 directions; more of a tilted robot: turn them
        and say frame="world", as in rays(directions @ R.T, frame="world", eye=…). Layer "coverage" likewise, others as raw
        bytes."""
        flat = array.array("d", [float(x) for row in directions for x in row])
        count = len(flat) // 3
        if sys.byteorder == "big":
            flat.byteswap()
        header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({count}, 3), }}".ljust(117) + "\n"
        params = body_of({"layer": layer, "format": "raw", **params})
        path = f"{self.info['uri']}/rays"
        if "camera" in params:
            body, kind = json.dumps({**posted(params), "directions": [list(map(float, row)) for row in directions]}).encode(), "application/json"
        else:
            body, kind = b"\x93NUMPY\x01\x00" + bytes((118, 0)) + header.encode() + flat.tobytes(), "application/x-npy"
            path += f"?{query(params)}"
        reply = self.service.ask(path, body, kind=kind)[0]
        if layer not in ("range", "coverage"):
            return reply
        values = array.array("f", reply)
        if sys.byteorder == "big":
            values.byteswap()
        return values

    def stations(self, crs=None):
        """Places where scanners stood, a list of dicts: view(station=K) looks ahead from "world" of the K-th; with crs
        ("EPSG:4326") each has "position" in that, too. "matrix" is the scanner's pose, row-major, station to world."""
        found = []
        while True:
            page = json.loads(self.ask(f"{self.info['uri']}/stations", {"crs": crs, "first": len(found)})[0])
            found += page["stations"]
            if len(found) >= page["count"] or not page["stations"]:
                return found

    def pick(self, x, y, **params):
        """What lies at a pixel of the view with these parameters; its "position" is None where nothing is."""
        return json.loads(self.ask(f"{self.info['uri']}/pick", {"x": x, "y": y, **params})[0])

    def legend(self, color_by, ramp=None, range=None):
        """What colours of a view with these parameters mean: an SVG, as bytes."""
        return self.ask(f"{self.info['uri']}/legend.svg", {"color_by": color_by, "ramp": ramp, "range": range})[0]

    def place(self, crs, **point):
        """A point both ways: give position=[longitude, latitude, height], in crs ("EPSG:4326"), or world=[x, y, z]."""
        return json.loads(self.ask(f"{self.info['uri']}/place", {"crs": crs, **point})[0])

    def tiles(self, **params):
        """Its map tiles, a Tiles, drawn with these parameters."""
        return Tiles(self.service, json.loads(self.ask(f"{self.info['uri']}/tiles.json", params)[0]))

    def tour(self, path, settings=None, **options):
        """Begins a tour, a Tour. `path` as api/tours.md has them; `settings` is what each frame is drawn with, as of a view;
        options: frames, or fps and seconds; interpolation; video=True."""
        document = {"path": path, **plain(options), **({"settings": body_of(settings)} if settings else {})}
        return Tour(self.service, json.loads(self.ask_json(f"{self.info['uri']}/tours", document)[0]))

    def ask(self, path, params):
        """(bytes, headers): a `camera` only goes as JSON. What is None is left out."""
        given = body_of(params)
        if "camera" in given:
            return self.ask_json(path, posted(given))
        return self.service.ask(f"{path}?{query(given)}")

    def ask_json(self, path, document):
        return self.service.ask(path, json.dumps(document).encode())


class Splatd:
    def __init__(self, url="http://127.0.0.1:8080", token=None, timeout=60, patience=30):
        """A `url` may end in a path, https://HOST/scans, that a proxy takes off. `patience`: seconds that a busy service is asked again, when it says when. A `url` may be a page that `splatd sign`
        has signed, https://HOST/embed/ID?exp=…&sig=…: dataset() is then the one that it is good for."""
        parts = urllib.parse.urlsplit(url if "://" in url else f"http://{url}")
        page, signature = re.search(r"/embed/([^/]+)$", parts.path), re.fullmatch(r"(exp=\d+)&sig=([\w-]+)", parts.query)
        self.signed_for = urllib.parse.unquote(page[1]) if page and signature else None
        self.grant = f"{signature[1]}&embed={signature[2]}" if self.signed_for else ""
        self.url = f"{parts.scheme}://{parts.netloc}" + (parts.path[:page.start()] if self.signed_for else parts.path).rstrip("/")
        self.timeout, self.patience = timeout, patience
        self.headers = {"Authorization": f"Bearer {token}"} if token else {}

    def ask(self, path, body=None, method=None, granted=False, kind="application/json"):
        """(bytes, headers) of a GET, of a POST of JSON, or of what `kind` says, or of another method. `granted`: the path has
        its signature."""
        headers = {**self.headers, **({"Content-Type": kind} if body else {})}
        if self.grant and not granted and not body:
            path = f"{path}{'' if path.endswith('?') else '&' if '?' in path else '?'}{self.grant}"
        until = time.monotonic() + self.patience
        while True:
            try:
                request = urllib.request.Request(self.locate(path), body, headers, method=method)
                with urllib.request.urlopen(request, timeout=self.timeout) as reply:
                    return reply.read(), reply.headers
            except urllib.error.HTTPError as error:
                wait, text = seconds_of(error.headers["Retry-After"]), error.read()
                if wait is None or time.monotonic() + wait > until:
                    try:
                        problem = json.loads(text)
                    except ValueError:
                        problem = {"title": error.reason}
                    raise SplatdError(error.code, problem) from None
            except OSError as error:  # URLError is one, a connection that ends in the middle another
                reason = getattr(error, "reason", error)
                raise SplatdError(0, {"detail": f"no answer from {self.url}: {reason}"}) from error
            time.sleep(wait)

    def locate(self, path):
        """The URL of a path as the service says it, which knows of no folder that a proxy has put it into."""
        return path if re.match(r"\w+://", path) else f"{self.url}/{path.lstrip('/')}"

    def json(self, path):
        return json.loads(self.ask(path)[0])

    def datasets(self):
        """Their ids."""
        return [info["id"] for info in self.json("/v1/datasets")["datasets"]]

    def dataset(self, name=None):
        name = name or self.signed_for
        if not name:
            raise ValueError("dataset() takes a name; datasets() lists them")
        return Dataset(self, self.json(f"/v1/datasets/{urllib.parse.quote(name, safe='')}"))

    def status(self):
        return self.json("/v1/status")

    def methods(self):
        """How splats can be drawn, and with which parameters: a dict by name."""
        return {method["name"]: method for method in self.json("/v1/methods")["methods"]}

    def tours(self):
        return [Tour(self, info) for info in self.json("/v1/tours")["tours"]]

    def tour(self, name):
        return Tour(self, self.json(f"/v1/tours/{urllib.parse.quote(name, safe='')}"))


def sign(url, key, seconds=3600):
    """`url` with a signature that lets anybody GET it for so long, as `splatd sign` makes it: of a view, pick, thumbnail, …,
    of a page /embed/ID, of all tiles with {z}/{x}/{y} or tiles.json. `key` is the text of the service's url-key file."""
    url, mark, fragment = url.partition("#")
    base, _, given = url.partition("?")
    given = urllib.parse.quote(given, safe="!$%&()*+,-./:;=?@[\\]^_`{|}~")  # as browsers write it
    given += f"{'&' if given else ''}exp={int(time.time()) + int(seconds)}"
    path = re.sub(r"^[^:/?]+://[^/]*", "", base)
    path = re.sub(r"^.*?(?=/(v1/datasets|embed)/)", "", path, count=1)  # a folder that a proxy takes off
    path = re.sub(r"(/v1/datasets/[^/]+/tiles)(/\{z\}/\{x\}/\{y\}(\{r\}|@2x)?\.(png|webp)|\.json)$", r"\1/", path)
    path = re.sub(r"^/embed/.*", lambda page: urllib.parse.unquote(page[0]), path)
    digest = hmac.digest(key.rstrip("\r\n").encode(), f"{path}?{given}".encode(), "sha256")
    return f"{base}?{given}&sig={base64.urlsafe_b64encode(digest).decode().rstrip('=')}{mark}{fragment}"


def numpy():
    import numpy
    return numpy


def unproject(camera, distance, layer="depth"):
    """World points, H×W×3, of an image of depth or range (`layer`); NaN where it is. `camera` is View.camera, or what
    arrays() gives: perspective, orthographic, equirectangular, cube, fisheye. (Of scans, scan() has the points.)"""
    np = numpy()
    distance = np.asarray(distance, dtype=float)
    height, width = distance.shape
    if (height, width) != (camera["height"], camera["width"]):
        raise ValueError(f"an image of {width}×{height} is not of a camera of {camera['width']}×{camera['height']}")
    if camera.get("model"):
        raise ValueError(f"a lens ({camera['model']}) has no closed form: ask for the same view without it")
    eye, rotation = np.array(camera["eye"]), np.array(camera["rotation"]).reshape(3, 3)  # rotation: world to camera
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    projection = camera.get("projection", "perspective")
    if layer not in ("depth", "range"):
        raise ValueError(f"points follow from layer depth or range, not '{layer}'")
    if layer == "depth" and projection in ("equirectangular", "cube", "fisheye"):
        raise ValueError(f"{projection} images have no depth: ask for layer range")
    x, y = (u - camera["cx"]) / camera["fx"], (v - camera["cy"]) / camera["fy"]
    if projection == "orthographic":
        return np.stack([x, y, distance], -1) @ rotation + eye + 0 * distance[..., None]
    rays = np.stack([x, y, np.ones_like(x)], -1)
    if projection == "equirectangular":
        rays = around(2 * np.pi * (u / width - 0.5), np.pi * (v / height - 0.5))
    elif projection == "fisheye":
        angle = np.hypot(x, y)
        rays = np.stack([np.sinc(angle / np.pi) * x, np.sinc(angle / np.pi) * y, np.cos(angle)], -1)
    elif projection == "cube":
        a, b, one = 2 * (u % height) / height - 1, 2 * v / height - 1, np.ones_like(u)
        sides = [(one, b, -a), (-one, b, a), (a, -one, b), (a, one, -b), (a, b, one), (-a, b, -one)]  # px nx py ny pz nz
        rays = np.choose((u // height).astype(int)[..., None], [np.stack(side, -1) for side in sides])
    if layer == "range":
        rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return rays * distance[..., None] @ rotation + eye


def around(azimuth, down):
    """Unit rays in the camera's frame, of angles in radians to the right and downwards."""
    np = numpy()
    return np.stack([np.sin(azimuth) * np.cos(down), np.sin(down), np.cos(azimuth) * np.cos(down)], -1)


def scan_rays(camera, azimuth, elevation):
    """Unit rays in the world of a scan, rings × columns × 3."""
    np = numpy()

    def angles(first, last, count):
        turn = abs(abs(last - first) - 360) < 1e-9
        return np.radians(first + (last - first) * np.arange(count) / max(count if turn else count - 1, 1))

    a, e = np.meshgrid(angles(*azimuth), angles(*elevation))
    return around(a, -e) @ np.array(camera["rotation"]).reshape(3, 3)


def read_npy(data):
    np = numpy()
    import io
    return np.load(io.BytesIO(data), allow_pickle=False)


def png(pixels):
    """A PNG of an array, H×W (grey), H×W×3 or ×4, of uint8: bytes. For notebooks without an imaging library."""
    np = numpy()
    pixels = np.ascontiguousarray(pixels, dtype=np.uint8)
    height, width, *depth = pixels.shape
    kind = {(): 0, (3,): 2, (4,): 6}[tuple(depth)]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], 1).tobytes()

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def parts_of(body, headers):
    """The parts of a multipart reply, as messages of email."""
    whole = f"Content-Type: {headers['Content-Type']}\r\n\r\n".encode() + body
    return [part for part in email.message_from_bytes(whole).walk() if part.get_filename()]


def seconds_of(retry_after):
    """Of a Retry-After: seconds, or a date. None where there is none."""
    if not retry_after or retry_after.isdigit():
        return int(retry_after) if retry_after else None
    date = email.utils.parsedate_to_datetime(retry_after)
    return max(0, date.timestamp() - time.time())


def plain(value):
    """Without numpy: its arrays as lists, its numbers as Python's."""
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {name: plain(inner) for name, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, (list, tuple)) else value


def body_of(params):
    """Parameters as JSON has them; what Python writes otherwise (class_, a pair for range, a list of shades) as the service does."""
    given = {name.rstrip("_"): plain(value) for name, value in params.items() if value is not None}
    for name, example in ("soft", "class:3-5"), ("clip", "z<2.3"):
        terms = given.get(name, "")
        if not isinstance(terms, str) and not (isinstance(terms, list) and all(isinstance(term, str) for term in terms)):
            raise TypeError(f"{name} is a term like '{example}' or a list of them, not {params[name]!r}")
    if isinstance(given.get("range"), list):
        low, high = given["range"]
        given["range"] = f"{low}..{high}"
    if isinstance(given.get("shade"), list):
        given["shade"] = "+".join(given["shade"])
    return given


def posted(params):
    """The body of a POST: what is of the camera stands in it."""
    given = body_of(params)
    inside = {name: given.pop(name) for name in CAMERA if name in given}
    return {**given, "camera": {**inside, **given.get("camera", {})}} if inside or "camera" in given else given


def query(params):
    """Vectors are joined by commas; of soft and clip, which are lists of terms, each is given by itself."""
    def text(value):
        if isinstance(value, bool):
            return str(value).lower()
        return ",".join(map(text, value)) if isinstance(value, (list, tuple)) else str(value)

    def each(name, value):
        several = name in ("soft", "clip") and isinstance(value, (list, tuple))
        return [(name, term) for term in value] if several else [(name, text(value))]

    return urllib.parse.urlencode([pair for name in params for pair in each(name, params[name])], safe=",:")


def ring(target, count, radius, height, up=(0, 0, 1)):
    """`count` cameras {eye, target, up} on a level circle round `target`, looking at it; z is up."""
    for i in range(count):
        angle = 2 * math.pi * i / count
        eye = [target[0] + radius * math.cos(angle), target[1] + radius * math.sin(angle), target[2] + height]
        yield {"eye": eye, "target": list(target), "up": list(up)}


def main(arguments):
    usage = "usage: splatd.py URL DATASET [NAME=VALUE…] > IMAGE\n  " + __doc__.rpartition("line:  ")[2].strip()
    if arguments[:1] in (["--help"], ["-h"]):
        print(usage)
        return 0
    wrong = [f"{name} is missing" for name in ("URL", "DATASET")[len(arguments):]]
    wrong += [f"'{pair}' is not NAME=VALUE" for pair in arguments[2:] if not pair.partition("=")[1]]
    if not wrong and sys.stdout.isatty():
        wrong = ["an image does not belong on a terminal; add > FILE"]
    if wrong:
        print(f"splatd.py: {wrong[0]}\n{usage}", file=sys.stderr)
        return 2
    try:
        found = Splatd(arguments[0]).dataset(arguments[1]).view(**dict(pair.split("=", 1) for pair in arguments[2:]))
    except (SplatdError, OSError, ValueError) as error:
        print(f"splatd.py: {arguments[0]}: {error}", file=sys.stderr)
        return 1
    sys.stdout.buffer.write(found.bytes)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
