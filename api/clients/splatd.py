"""Client of splatd. Standard library only; one file, to be copied anywhere.

    from splatd import Splatd, ring
    hall = Splatd("http://127.0.0.1:8080").dataset("hall")
    for i, camera in enumerate(ring(hall.center, 36, radius=6, height=3)):
        with open(f"view{i:02}.jpg", "wb") as file:
            file.write(hall.view(**camera, width=1280, height=720, fov=50).bytes)

On the command line:  python3 splatd.py http://127.0.0.1:8080 hall eye=4,5,6 target=0,0,1 layer=depth > depth.png
"""
import array
import json
import math
import sys
import time
import urllib.error
import urllib.parse
import urllib.request


class SplatdError(Exception):
    """What the service refused: `status`, `field` (the parameter at fault, or ""), and its words."""

    def __init__(self, status, problem):
        self.status, self.field = status, problem.get("field", "")
        super().__init__(f"{status}: {problem.get('detail') or problem.get('title') or 'no reason given'}")


class View:
    """An encoded image: its `bytes`, `type`, and `headers`; `camera` is the one that was used."""

    def __init__(self, body, headers):
        self.bytes, self.type, self.headers = body, headers["Content-Type"], headers
        self.camera = json.loads(headers["Splatd-Camera"]) if headers["Splatd-Camera"] else None


class Dataset:
    """`info` is what /v1/datasets/{id} says."""

    def __init__(self, service, info):
        self.service, self.info, self.id = service, info, info["id"]
        low, high = info["bounds"]["min"], info["bounds"]["max"]
        self.center = [(a + b) / 2 for a, b in zip(low, high)]
        self.title, self.description = info.get("title"), info.get("description")  # None where nobody has said any
        self.views = {view["name"]: view for view in info.get("views", [])}

    def view(self, **params):
        """One view. Parameters as in api/openapi.yaml; vectors, and several terms of soft and clip, are lists; class as text: "2,6". A `camera` is a dict, in any convention."""
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

    def pick(self, x, y, **params):
        """What lies at a pixel of the view with these parameters; its "position" is None where nothing is."""
        return json.loads(self.ask(f"{self.info['uri']}/pick", {"x": x, "y": y, **params})[0])

    def legend(self, color_by, ramp=None, range=None):
        """What colours of a view with these parameters mean: an SVG, as bytes."""
        return self.ask(f"{self.info['uri']}/legend.svg", {"color_by": color_by, "ramp": ramp, "range": range})[0]

    def place(self, crs, **point):
        """A point both ways: give position=[longitude, latitude, height], in crs ("EPSG:4326"), or world=[x, y, z]."""
        return json.loads(self.ask(f"{self.info['uri']}/place", {"crs": crs, **point})[0])

    def ask(self, path, params):
        """(bytes, headers): a `camera` only goes as JSON. What is None is left out."""
        given = {name: value for name, value in params.items() if value is not None}
        soft = given.get("soft", "")
        if not isinstance(soft, str) and not (isinstance(soft, (list, tuple)) and all(isinstance(term, str) for term in soft)):
            raise TypeError(f"soft is a term like 'class:3-5' or a list of them, not {soft!r}")
        if "camera" in given:
            return self.service.ask(path, json.dumps(given).encode())
        return self.service.ask(f"{path}?{query(given)}")


class Splatd:
    def __init__(self, url="http://127.0.0.1:8080", token=None, timeout=60, patience=30):
        """`patience`: seconds that a busy service is asked again, when it says when."""
        self.url = (url if "://" in url else f"http://{url}").rstrip("/")
        self.timeout, self.patience = timeout, patience
        self.headers = {"Authorization": f"Bearer {token}"} if token else {}

    def ask(self, path, body=None):
        """(bytes, headers) of a GET, or of a POST of JSON."""
        headers = {**self.headers, **({"Content-Type": "application/json"} if body else {})}
        until = time.monotonic() + self.patience
        while True:
            try:
                request = urllib.request.Request(urllib.parse.urljoin(self.url + "/", path), body, headers)
                with urllib.request.urlopen(request, timeout=self.timeout) as reply:
                    return reply.read(), reply.headers
            except urllib.error.HTTPError as error:
                wait, text = error.headers["Retry-After"], error.read()
                if not wait or time.monotonic() + int(wait) > until:
                    try:
                        problem = json.loads(text)
                    except ValueError:
                        problem = {"title": error.reason}
                    raise SplatdError(error.code, problem) from None
            time.sleep(int(wait))

    def json(self, path):
        return json.loads(self.ask(path)[0])

    def datasets(self):
        return [info["id"] for info in self.json("/v1/datasets")["datasets"]]

    def dataset(self, name):
        return Dataset(self, self.json(f"/v1/datasets/{urllib.parse.quote(name, safe='')}"))


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
