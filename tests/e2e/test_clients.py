"""The clients of api/clients/ against real daemons, and the examples of their README as they are printed there."""
import contextlib
import http.server
import json
import math
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import threading
import urllib.request

HERE = pathlib.Path(__file__)
CLIENTS = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"]).resolve() / "api" / "clients"
sys.path[:0] = [str(HERE.parents[1] / "http"), str(CLIENTS)]
from harness import FAKE, MAPPED, REAL, WALL, Daemon, eventually, run, together
from splatd import Dataset, Splatd, SplatdError, ring, sign

POSE = dict(eye=[3, 0, 1], target=[0, 0, 1], up=[0, 0, 1], fov=60)
SMALL = dict(width=65, height=49)
JPEG = b"\xff\xd8\xff"


def url(daemon):
    return f"http://127.0.0.1:{daemon.port}"


def shell(daemon, *arguments, code=0, folder=None, **environment):
    done = subprocess.run(
        [CLIENTS / "splatd.sh", *arguments],
        capture_output=True,
        timeout=600,
        cwd=folder,
        env={**os.environ, "SPLATD_URL": url(daemon) + "/", **environment},
    )
    assert done.returncode == code, (arguments, done)
    return done.stdout, done.stderr.decode()


def test_python_views():
    with Daemon(REAL) as d:
        service = Splatd(url(d) + "/")
        assert service.datasets() == ["wall"]
        wall = service.dataset("wall")
        assert wall.title is None and wall.description is None and wall.views == {}
        thumbnail = wall.thumbnail(width=64)
        assert thumbnail.bytes.startswith(JPEG) and thumbnail.camera["width"] == 64 and thumbnail.camera["height"] == 36
        view = wall.view(**POSE, **SMALL, transparent=False)
        assert view.bytes.startswith(JPEG) and view.type == "image/jpeg"
        assert view.camera["eye"] == [3, 0, 1] and view.camera["width"] == 65
        matrix = [0, 0, 1, 3, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1]
        assert wall.view(camera={"matrix": matrix, "convention": "opengl", "fov": 60}, **SMALL).bytes == view.bytes
        width, height, metres = wall.depth(**POSE, **SMALL)
        assert (width, height, len(metres)) == (65, 49, 65 * 49)
        assert abs(metres[24 * 65 + 32] - 3) < 0.01 and math.isnan(metres[0])
        found = wall.pick(32.5, 24.5, **POSE, **SMALL)
        assert math.dist(found["position"], [0, 0, 1]) < 0.01 and abs(found["distance"] - 3) < 0.01, found
        assert wall.pick(0, 0, **POSE, **SMALL)["position"] is None
        opengl = {"matrix": matrix, "convention": "opengl", "fov": 60}
        assert wall.pick(32.5, 24.5, camera=opengl, **SMALL) == found  # every call takes what view() takes
        assert wall.depth(camera=opengl, **SMALL)[:2] == (65, 49)
        rays = wall.rays([[0, 0, 1], [0, 0, -1]], eye=POSE["eye"], target=POSE["target"])
        assert abs(rays[0] - metres[24 * 65 + 32]) < 0.05 and rays[1] != rays[1] and len(rays) == 2
        assert len(wall.rays([[1, 0, 0]], layer="color", frame="sensor", camera={"matrix": matrix, "convention": "opengl"})) == 4
        assert wall.view(camera=opengl, **SMALL, lod=None).bytes == view.bytes  # None is left out, whatever the method
        assert wall.view(camera=None, **POSE, **SMALL).bytes == view.bytes
        terms = ["axis:0,0,0,0,0,1<0.5", "box:-1,-1,-1,1,1,1"]
        for soft in terms, " or ".join(terms):
            for camera in POSE, {"camera": {**POSE, "fov": 60}}:
                told = json.loads(wall.view(**camera, **SMALL, soft=soft, soft_opacity=0.5).headers["Splatd-Soft"])
                assert told["soft"] == terms and told["soft_opacity"] == 0.5, told
        whole = {**POSE, **SMALL, "soft": "box:-9,-9,-9,9,9,9", "soft_opacity": 0.9}  # nothing is solid
        assert wall.pick(32.5, 24.5, **whole)["splat"] is None and wall.pick(32.5, 24.5, **whole, of="median")["splat"] is not None
        assert wall.depth(**whole, of="first")[2][24 * 65 + 32] > 2.5
        assert wall.view(**POSE, **SMALL, soft=[]).headers["Splatd-Soft"] is None
        # What it looks at by itself, wherever a few points have put the bounds.
        strayed = Dataset(service, {**wall.info, "bounds": {"min": [-9999] * 3, "max": [1, 1, 1]}})
        assert wall.center == strayed.center == wall.info["default_view"]["target"], strayed.center
        assert wall.pick(480, 270, **next(ring(wall.center, 4, 2, 1)), width=960, height=540)["position"], "nothing is there"
        eyes = [camera["eye"] for camera in ring(wall.center, 4, 2, 1)]
        assert (
            all(abs(math.dist(eye, wall.center) - math.sqrt(5)) < 1e-9 for eye in eyes)
            and len(set(map(tuple, eyes))) == 4
        )


def test_python_stations():
    with Daemon(FAKE, datasets=[WALL, MAPPED]) as d:
        service = Splatd(url(d))
        mapped = service.dataset("wall-mapped")
        assert service.dataset("wall").stations() == []
        [station] = mapped.stations()
        assert station["station"] == 0 and station["world"] == [2, 0, 1]
        views = [mapped.view(station=0, **SMALL), mapped.view(camera={"station": 0}, **SMALL), mapped.batch([{"station": 0}], **SMALL)[0]]
        assert all(view.camera["eye"] == [2, 0, 1] for view in views), [view.camera for view in views]
        around = mapped.panorama(station=0, width=64)
        assert around.camera["projection"] == "equirectangular" and around.camera["eye"] == [2, 0, 1]
        try:
            mapped.view(station=1)
            raise RuntimeError("nothing was refused")
        except SplatdError as error:
            assert error.status == 400 and error.field == "station"


def test_python_refusals():
    with Daemon(REAL) as d:
        service = Splatd(url(d))
        for status, field, ask in [
            (400, "lod", lambda: service.dataset("wall").view(lod=-1)),
            (404, "id", lambda: service.dataset("no such/thing")),
            (400, "target", lambda: service.dataset("wall").view(eye=[0, 0, 1], target=[0, 0, 1])),
            (400, "shade", lambda: service.dataset("wall").view(camera=dict(shade=1))),
        ]:
            try:
                ask()
                raise RuntimeError("nothing was refused")
            except SplatdError as error:
                assert (error.status, error.field) == (status, field) and str(error).startswith(f"{status}: "), error
        for soft in {"class": 5}, ["class:5", 5], 5:
            try:
                service.dataset("wall").view(soft=soft)
                raise RuntimeError("nothing was refused")
            except TypeError as error:
                assert "'class:3-5'" in str(error) and repr(soft) in str(error), error


def test_python_names_a_service_that_is_not_there():
    with socket.socket() as nobody:  # bound, but it does not listen
        nobody.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{nobody.getsockname()[1]}"
        try:
            Splatd(address).dataset("wall")
            raise RuntimeError("nobody answered")
        except SplatdError as error:
            assert error.status == 0 and str(error).startswith(f"no answer from {address}: "), error


def test_a_busy_service_is_asked_again():
    with Daemon(FAKE, "--queue", "1", FAKE_FRAME_MS=150) as d:

        def views(patience):
            return together(4, lambda i: Splatd(url(d), patience=patience).dataset("wall").view(lod=i, **SMALL))

        refused = []

        def is_refused():  # not where threads begin one after the other, each when the frame before it is done
            refused.extend(view for view in views(0) if isinstance(view, Exception))
            return refused
        eventually(is_refused, 120)
        assert all(isinstance(error, SplatdError) and error.status == 503 for error in refused), refused
        found = views(120)
        assert all(not isinstance(view, Exception) and view.bytes for view in found), found
        assert d.status()["counters"]["refused_full"] > 0


def test_python_on_the_command_line():
    with Daemon(REAL) as d:
        command = [sys.executable, CLIENTS / "splatd.py", url(d), "wall"]
        done = subprocess.run(
            [*command, "eye=3,0,1", "target=0,0,1", "width=64", "height=48"], capture_output=True, timeout=600
        )
        assert done.returncode == 0 and done.stdout.startswith(JPEG), done
        for arguments, code, said in [
            ([*command, "lod=-1"], 1, "400: "),
            ([*command[:3], "none"], 1, "there is no dataset 'none'"),
            ([*command[:2], "http://127.0.0.1:1", "wall"], 1, "http://127.0.0.1:1: "),
            ([*command[:2], "http://[", "wall"], 1, "http://[: "),
            (command[:2], 2, "URL is missing\nusage: splatd.py URL DATASET"),
            (command[:3], 2, "DATASET is missing\nusage: "),
            ([*command, "lod=1", "layer"], 2, "'layer' is not NAME=VALUE\nusage: "),
        ]:
            done = subprocess.run(arguments, capture_output=True, timeout=600)
            assert done.returncode == code and not done.stdout, done
            assert done.stderr.decode().startswith("splatd.py: ") and said in done.stderr.decode(), done
        done = subprocess.run([*command[:2], "--help"], capture_output=True, text=True, timeout=600)
        assert done.returncode == 0 and "usage: " in done.stdout and "eye=" in done.stdout, done
        terminal, end = os.openpty()
        done = subprocess.run(command, stdout=end, stderr=subprocess.PIPE, timeout=600)
        os.set_blocking(terminal, False)
        try:
            shown = os.read(terminal, 1000)
        except OSError:  # nothing
            shown = b""
        os.close(end)
        os.close(terminal)
        assert done.returncode == 2 and b"> FILE" in done.stderr and not shown, (done, shown)
        done = subprocess.run([*command[:2], url(d).removeprefix("http://"), "wall", "width=64"], capture_output=True, timeout=600)
        assert done.returncode == 0 and done.stdout.startswith(JPEG), done


def test_shell():
    with Daemon(REAL) as d, tempfile.TemporaryDirectory() as folder:
        assert shell(d, "datasets")[0] == b"wall\n"
        assert json.loads(shell(d, "info", "wall")[0])["id"] == "wall"
        shell(d, "view", "wall", "a.jpg", "eye=3,0,1", "target=0,0,1", "width=64", "height=48", folder=folder)
        assert (
            pathlib.Path(folder, "a.jpg").read_bytes() == d.view(eye="3,0,1", target="0,0,1", width=64, height=48).body
        )
        for name, more, begin in [
            ("a.png", ["layer=depth"], b"\x89PNG"),
            ("c.png", [], b"\x89PNG"),
            ("d.jpg", ["layer=depth"], JPEG),
            ("d.jpeg", ["format=jpg"], JPEG),
            ("d.npy", [], b"\x93NUMPY"),
            ("plain", ["format=png"], b"\x89PNG"),
            ("all.zip", ["layers=color,depth"], b"PK"),
        ]:
            shell(d, "view", "wall", name, *more, "width=64", "height=48", folder=folder)
            assert pathlib.Path(folder, name).read_bytes().startswith(begin), name
        found = json.loads(
            shell(d, "pick", "wall", "32", "24", "eye=3,0,1", "target=0,0,1", "width=64", "height=48")[0]
        )
        assert math.dist(found["position"], [0, 0, 1]) < 0.01
        shell(d, "ring", "wall", "views", "3", "2", "1", "target=0,0,1", "width=32", "height=24", folder=folder)
        views = [file.read_bytes() for file in sorted(pathlib.Path(folder, "views").iterdir())]
        assert len(views) == len(set(views)) == 3 and all(view.startswith(JPEG) for view in views)
        for arguments, code, said in [
            ((), 2, "a command is missing; as in\nsplatd.sh datasets\n"),
            (("paint",), 2, "there is no command 'paint'"),
            (("datasets", "wall"), 2, "datasets takes nothing, not 'wall'"),
            (("info",), 2, "info needs DATASET, and DATASET is missing"),
            (("info", "wall", "lod=1"), 2, "one DATASET, not 'lod=1' as well"),
            (("view",), 2, "DATASET is missing"),
            (("view", "wall"), 2, "view needs DATASET FILE, and FILE is missing"),
            (("view", "wall", "b.jpg", "lod"), 2, "view: 'lod' is not NAME=VALUE"),
            (("view", "wall", "b.jpg", "format=png"), 2, "'b.jpg' is no name of a png: give one that ends in .png"),
            (("view", "wall", "b.jpg", "layers=color,depth"), 2, "give FILE.zip in the place of 'b.jpg'"),
            (("view", "wall", "b.zip", "layers=color", "container=multipart"), 2, "'b.zip' is no name of 'container=multipart'"),
            (("view", "wall", "b.zip", "container=multipart", "layers=color"), 2, "'b.zip' is no name of 'container=multipart'"),
            (("view", "wall", "b"), 2, "'b' does not say which format"),
            (("pick", "wall"), 2, "X is missing"),
            (("pick", "wall", "32"), 2, "Y is missing; as in\nsplatd.sh datasets\n"),
            (("ring",), 2, "DATASET is missing"),
            (("ring", "wall"), 2, "DIR is missing"),
            (("ring", "wall", "x"), 2, "COUNT is missing"),
            (("ring", "wall", "x", "3"), 2, "RADIUS is missing"),
            (("ring", "wall", "x", "3", "2"), 2, "HEIGHT is missing"),
            (("ring", "wall", "x", "3", "2", "1"), 2, "target=X,Y,Z is missing"),
            (("ring", "wall", "x", "3", "2", "1", "eye=0,0,1"), 2, "target=X,Y,Z in the place of 'eye=0,0,1'"),
            (("ring", "wall", "x", "0", "2", "1", "target=0,0,1"), 2, "COUNT '0'"),
            (("ring", "wall", "x", "three", "2", "1", "target=0,0,1"), 2, "COUNT 'three'"),
            (("ring", "wall", "x", "3", "2m", "1", "target=0,0,1"), 2, "RADIUS '2m' is no number"),
            (("ring", "wall", "x", "3", "2", "", "target=0,0,1"), 2, "HEIGHT '' is no number"),
            (("info", "none"), 1, "404: there is no dataset 'none'"),
            (("view", "wall", "b.jpg", "lod=-1"), 1, "400: "),
            (("view", "wall", "b.jpg", "background=#12&lod=0"), 1, "background"),
            (("ring", "none", "y", "3", "2", "1", "target=0,0,1"), 1, "404"),
        ]:
            out, err = shell(d, *arguments, code=code, folder=folder)
            assert not out and said in err and (code == 1 or "splatd.sh ring hall" in err), (arguments, err)
        assert shell(d, "--help")[0].startswith(b"splatd.sh datasets\n") and not pathlib.Path(folder, "x").exists()
        assert not pathlib.Path(folder, "b.jpg").exists() and not list(pathlib.Path(folder).glob("*.part"))


@contextlib.contextmanager
def folder_of(daemon, folder):
    """A proxy that has the daemon below /folder/, and nothing elsewhere."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def forward(self):
            if not self.path.startswith(f"/{folder}/"):
                return self.send_error(404)
            body = self.rfile.read(int(self.headers["Content-Length"] or 0))
            kept = {name: value for name, value in self.headers.items() if name in ("Content-Type", "Authorization")}
            connection = daemon.connect()
            connection.request(self.command, self.path[len(folder) + 1:], body or None, kept)
            reply = connection.getresponse()
            content = reply.read()
            self.send_response(reply.status)
            for name in ("Content-Type", "Splatd-Camera", "Splatd-Unit"):
                if reply.headers[name]:
                    self.send_header(name, reply.headers[name])
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        do_GET = do_POST = forward
        log_message = lambda *_: None

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/{folder}"
        server.shutdown()


def test_a_service_in_a_folder_of_a_proxy():
    with tempfile.TemporaryDirectory() as home:
        key = pathlib.Path(home, "key")
        key.write_text("0123456789abcdef0123456789abcdef0123456789abcdef")
        key.chmod(0o600)
        tokens = pathlib.Path(home, "tokens")
        tokens.write_text("a-token-of-the-tests view\n")
        tokens.chmod(0o600)
        with Daemon(REAL, "--url-key", str(key), "--tokens", str(tokens)) as d, folder_of(d, "our/scans") as where:
            for base in where, where + "/":
                service = Splatd(base, "a-token-of-the-tests")
                assert service.datasets() == ["wall"] and service.status()
                wall = service.dataset("wall")
                assert wall.view(**POSE, **SMALL).bytes.startswith(JPEG) and wall.view(camera=POSE, **SMALL).bytes.startswith(JPEG)
                assert wall.pick(32.5, 24.5, **POSE, **SMALL)["position"] and wall.thumbnail(width=64).bytes.startswith(JPEG)
                tiles = wall.tiles()
                assert tiles.url.startswith(where + "/v1/datasets/wall/tiles/{z}/") and tiles.tile(0, 0, 0).type == "image/png"
            signed = sign(f"{where}/v1/datasets/wall/thumbnail.jpg?width=64", key.read_text())
            assert signed.startswith(where) and urllib.request.urlopen(signed).read().startswith(JPEG)
            odd = [sign(f"{base}/v1/datasets/embed/view?x=1", key.read_text()).partition("?")[2] for base in (where, "http://127.0.0.1", "")]
            assert len(set(odd)) <= 2, odd  # but for a second that began between
            page = sign(f"{where}/embed/wall", key.read_text())
            assert Splatd(page).dataset().view(**POSE, **SMALL).bytes.startswith(JPEG)


def test_tokens():
    token = "a-token/of+the~tests"
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "tokens")
        file.write_text(f"{token} view\n")
        file.chmod(0o600)
        with Daemon(REAL, "--tokens", str(file)) as d:
            assert Splatd(url(d), token).dataset("wall").view(**POSE, **SMALL).bytes.startswith(JPEG)
            assert shell(d, "datasets", SPLATD_TOKEN=token)[0] == b"wall\n"
            assert "401" in shell(d, "datasets", code=1)[1]
            try:
                Splatd(url(d), token + "x").datasets()
                raise RuntimeError("nothing was refused")
            except SplatdError as error:
                assert error.status == 401


def test_the_examples_of_the_readmes():
    with Daemon(REAL) as d, tempfile.TemporaryDirectory() as client:
        served = d.ask("/clients/splatd.py")
        (pathlib.Path(client) / "splatd.py").write_bytes(served.body)
        for readme in (CLIENTS / "README.md", CLIENTS.parents[1] / "README.md"):
            text = readme.read_text()
            [program] = re.findall(r"```python\n(.*?)```", text, re.S)
            assert program.count("\n") < 15
            for there, here in ("http://127.0.0.1:8080", url(d)), ('"hall"', '"wall"'), ("1280", "64"), ("720", "48"):
                assert there in program, (readme, there)
                program = program.replace(there, here)
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run(
                    [sys.executable, "-c", program],
                    check=True,
                    cwd=folder,
                    timeout=600,
                    env={**os.environ, "PYTHONPATH": client},
                )
                views = {file.read_bytes() for file in pathlib.Path(folder).glob("view*.jpg")}
            assert len(views) == 36 and all(view.startswith(JPEG) for view in views), readme
            images = re.findall(r'src="http://127\.0\.0\.1:8080(/[^"#]*)', text)
            assert images
            for address in images:
                assert d.ask(address.replace("hall", "wall")).status == 200, address


def test_pictures_need_no_display():
    """Without a window system, and with variables of one that is not there."""
    pictures = set()
    with tempfile.TemporaryDirectory() as folder:
        for more in {}, {"DISPLAY": ":97", "WAYLAND_DISPLAY": "wayland-97", "XDG_SESSION_TYPE": "x11"}:
            kept = {name: os.environ[name] for name in os.environ if not re.match("DISPLAY|WAYLAND|XDG_|XAUTH", name)}
            file = pathlib.Path(folder, "view.png")
            done = subprocess.run([REAL, "render", WALL, "--size", "64x48", "-o", file], env={**kept, **more}, capture_output=True, timeout=600)
            assert done.returncode == 0, done.stderr
            pictures.add(file.read_bytes())
    assert len(pictures) == 1


def test_the_dashboard():
    """Fields that Grafana's panels have (schema 39), addresses that a daemon answers, queries of variables that there are."""
    dashboard = json.loads((CLIENTS / "grafana-dashboard.json").read_text())
    assert set(dashboard) <= {"title", "uid", "tags", "schemaVersion", "templating", "panels", "time", "refresh", "editable"}, set(dashboard)
    variables = {v["name"]: v["query"] for v in dashboard["templating"]["list"]}
    assert all(v["type"] == "textbox" and v["current"] == {"text": v["query"], "value": v["query"]} for v in dashboard["templating"]["list"])
    options = {"text": {"mode", "content"}, "geomap": {"view", "controls", "basemap", "layers", "tooltip"}}
    seen, corners = [], set()
    with Daemon(REAL) as d:
        variables.update(service="", dataset="wall", view="eye=3,0,1&target=0,0,1", tiles="color_by=height")

        def ask(address):
            named = re.sub(r"\$\{(\w+)\}|\$(\w+)", lambda found: variables[found[1] or found[2]], address)
            assert d.ask(named.format(z=0, x=0, y=0)).status == 200, address
            seen.append(address)
        for panel in dashboard["panels"]:
            assert set(panel) == {"id", "type", "title", "gridPos", "options"} and set(panel["options"]) <= options[panel["type"]], panel
            assert set(panel["gridPos"]) == set("xywh") and panel["gridPos"]["x"] + panel["gridPos"]["w"] <= 24
            corners.add((panel["gridPos"]["x"], panel["gridPos"]["y"], panel["id"]))
            if panel["type"] == "text":
                [source] = re.findall(r'src="\$\{service\}([^"]*)"', panel["options"]["content"])
                ask(source)
                continue
            assert set(panel["options"]["view"]) == {"id", "lat", "lon", "zoom"}
            for layer in panel["options"]["layers"]:
                assert set(layer) == {"type", "name", "config", "opacity", "tooltip"} and layer["type"] == "xyz", layer
                assert set(layer["config"]) == {"url", "attribution", "minZoom", "maxZoom"} and 0 <= layer["config"]["minZoom"] <= layer["config"]["maxZoom"]
                ask(layer["config"]["url"].removeprefix("${service}"))
    assert len(corners) == len(dashboard["panels"]) >= 3 and any("/tiles/" in address for address in seen), seen


run(globals())
