"""What splatd.py makes of a view with numpy: arrays, points of every projection against picks, clouds, scans, batches, tours,
tiles, signed URLs; and the notebook, cell by cell."""
import contextlib
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest.mock
import xml.etree.ElementTree

HERE = pathlib.Path(__file__)
CLIENTS = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"]).resolve() / "api" / "clients"
sys.path[:0] = [str(HERE.parents[1] / "http"), str(CLIENTS)]
import numpy as np
from harness import FAKE, REAL, Daemon, run
from splatd import Splatd, SplatdError, png, seconds_of, sign, unproject

TREE = os.environ["SPLATD_TREE"]
POSE = dict(eye=[3, 0, 1], target=[0, 0, 1], up=[0, 0, 1])
SIZE = dict(width=65, height=49)
JPEG, KEY = b"\xff\xd8\xff", "0123456789abcdef0123456789abcdef"


@contextlib.contextmanager
def wall(*args, binary=REAL, **environment):
    with Daemon(binary, *args, **environment) as d:
        yield Splatd(f"http://127.0.0.1:{d.port}").dataset("wall")


def refused(kind, work, *words):
    try:
        work()
    except kind as error:
        assert all(word in str(error) for word in words), error
        return error
    raise AssertionError("nothing was refused")


def test_layers_are_arrays():
    with wall() as w:
        for layer, kind, more in (("color", "u1", (4,)), ("depth", "f4", ()), ("range", "f4", ()), ("normal", "f4", (3,)),
                                  ("id", "u4", ()), ("coverage", "f4", ()), ("primitive", "u4", ())):
            found = w.array(layer, **POSE, fov=60, **SIZE)
            assert found.shape == (49, 65, *more) and found.dtype == np.dtype(kind), (layer, found.shape, found.dtype)
        together, camera = w.arrays("color", "depth", "normal", "id", **POSE, fov=60, **SIZE)
        assert set(together) == {"color", "depth", "normal", "id"} and camera["width"] == 65
        for layer in together:  # one frame, the same pixels
            assert np.array_equal(together[layer], w.array(layer, **POSE, fov=60, **SIZE), equal_nan=layer != "id" and layer != "color"), layer
        assert abs(together["depth"][24, 32] - 3) < 0.01 and np.isnan(together["depth"][0, 0])
        picked = w.pick(32.5, 24.5, **POSE, fov=60, **SIZE)
        assert np.allclose(together["normal"][24, 32], picked["normal"], atol=1e-5) and together["id"][24, 32] == picked["splat"]
        width, height, plain = w.depth(**POSE, fov=60, **SIZE)
        assert np.array_equal(np.array(plain, "f4").reshape(height, width), together["depth"], equal_nan=True)
        image = png(together["color"])
        assert image.startswith(b"\x89PNG") and png(together["color"][..., 0])[25] == 0 and png(together["color"][..., :3])[25] == 2


def test_parameters_are_python_values():
    with wall() as w:
        base = dict(fov=60, **SIZE, format="png")
        as_numpy = {name: np.array(value) for name, value in POSE.items()}
        for mine, theirs in [
            (dict(**as_numpy, lod=np.float64(1.5), transparent=np.bool_(True)), "lod=1.5&transparent=true"),
            (dict(**POSE, clip=["z<1.2", "y>-0.5"]), "clip=z<1.2&clip=y>-0.5"), (dict(**POSE, clip="z<1.2"), "clip=z%3C1.2"),
            (dict(**POSE, color_by="height", range=(0, 2.5), ramp="turbo"), "color_by=height&range=0..2.5&ramp=turbo"),
            (dict(**POSE, shade=["edl", "sun:135,45"]), "shade=edl%2Bsun:135,45"), (dict(**POSE, class_=7), "class=7"),
            (dict(**POSE, class_="!7"), "class=!7"), (dict(**POSE, class_=[2, 6], soft=["class:2"]), "class=2,6&soft=class:2"),
        ]:
            for way in mine, {**{k: v for k, v in mine.items() if k not in POSE}, "camera": {k: mine[k] for k in POSE}}:  # GET, POST
                def ask(**params):
                    return w.view(**base, **params).bytes
                wanted = ask_plain(w, "eye=3,0,1&target=0,0,1&up=0,0,1&fov=60&width=65&height=49&format=png&" + theirs)
                try:
                    got = ask(**way)
                except SplatdError as error:  # the wall has no classes: both are refused alike
                    got = error.field
                assert got == wanted, (way, theirs)
        refused(TypeError, lambda: w.view(clip=5), "clip is a term like 'z<2.3'", "5")
        refused(TypeError, lambda: w.view(clip=["z<1", 5]), "['z<1', 5]")


def ask_plain(w, query):
    try:
        return w.service.ask(f"/v1/datasets/wall/view?{query}")[0]
    except SplatdError as error:
        return error.field


FRAMES = {
    "perspective": dict(fov=60, **SIZE), "principal point": dict(fx=50, fy=55, cx=20.25, cy=30.75, **SIZE),
    "orthographic": dict(view_height=2.5, **SIZE), "equirectangular": dict(projection="equirectangular", width=96),
    "fisheye": dict(projection="fisheye", fov=150, height=64), "cube": dict(projection="cube", height=32)}


def test_points_of_every_projection_are_where_picks_say():
    with wall() as w:
        for name, frame in FRAMES.items():
            for pose in POSE, dict(eye=[2, -0.6, 1.4], target=[0.1, 0.2, 0.9], up=[0, 0.3, 1]):
                layers = ["range"] if name in ("equirectangular", "fisheye", "cube") else ["depth", "range"]
                found, camera = w.arrays(*layers, **pose, **frame)
                for layer in layers:
                    points = unproject(camera, found[layer], layer)
                    assert points.shape == (*found[layer].shape, 3) and np.array_equal(np.isnan(points[..., 0]), np.isnan(found[layer]))
                    rows, columns = np.nonzero(np.isfinite(found[layer]))
                    assert len(rows) > 30, (name, len(rows))
                    inner = [i for i, at in enumerate(zip(rows, columns)) if np.isfinite(found[layer][tuple(np.s_[max(k - 1, 0):k + 2] for k in at)]).all()]
                    hits = 0
                    for i in inner[::max(len(inner) // 6, 1)]:
                        picked = w.pick(columns[i] + 0.5, rows[i] + 0.5, **pose, **frame)["position"]
                        # a pick is a pixel of its own: from others' edges it may differ by what lies between
                        if picked is None:
                            continue  # a hole of a pixel, which images close from beside it
                        off = math.dist(picked, points[rows[i], columns[i]])
                        hits += 1
                        assert off < (2e-6 if name in ("perspective", "principal point", "orthographic") else 0.02), (name, layer, off)
                    assert hits >= 3, (name, hits)
                    seen = points[rows, columns]  # the wall: x = 0.2 sin y, y from -1, z from 0 to 2
                    assert np.abs(seen[:, 0] - 0.2 * np.sin(seen[:, 1])).max() < 0.03, (name, layer)
                    assert seen[:, 1:].min() > -1.3 and seen[:, 1:].max() < 2.3, (name, layer, seen.min(0), seen.max(0))
        # every face of a cube, and both halves of a panorama, look their own way: a point is where it is from wherever one looks
        for name in ("cube", "equirectangular", "fisheye"):
            for target in ([4, 0, 1], [3, 1, 1], [3, -1, 1], [3.001, 0, 2], [3.001, 0, 0], [2, 0.1, 1]):
                frame = dict(FRAMES[name], **({"fov": 360, "height": 128} if name == "fisheye" else {}))
                found, camera = w.arrays("range", eye=[3, 0, 1], target=target, up=[0, 0, 1], **frame)
                points = unproject(camera, found["range"], "range")
                seen = points[np.isfinite(found["range"])]
                assert len(seen) and np.abs(seen[:, 0] - 0.2 * np.sin(seen[:, 1])).max() < 0.05, (name, target)
        found, camera = w.arrays("range", **POSE, **FRAMES["cube"])
        refused(ValueError, lambda: unproject(camera, found["range"]), "cube images have no depth")
        refused(ValueError, lambda: unproject(camera, found["range"][1:], "range"), "192×31")
        refused(ValueError, lambda: unproject(camera, found["range"], "normal"), "not 'normal'")
        refused(ValueError, lambda: unproject({**camera, "model": "FULL_OPENCV"}, found["range"], "range"), "FULL_OPENCV")


def test_clouds_are_scans_again():
    """A view's points, written as PLY, are what splatd itself reads from it."""
    with wall() as w, tempfile.TemporaryDirectory() as folder:
        cloud = w.cloud(**POSE, fov=60, **SIZE, normals=True, ids=True)
        assert cloud.points.shape == cloud.colors.shape == cloud.normals.shape == (len(cloud), 3) and len(cloud.ids) == len(cloud) > 500
        assert cloud.points.dtype == np.float64 and cloud.colors.dtype == np.uint8
        color = w.array("color", **POSE, fov=60, **SIZE)
        assert np.array_equal(cloud.colors, color[np.isfinite(w.array("depth", **POSE, fov=60, **SIZE))][:, :3])
        file = pathlib.Path(folder, "cloud.ply")
        cloud.save(file)
        info = json.loads(subprocess.run([REAL, "info", "--json", file], check=True, capture_output=True, timeout=600).stdout)
        scan = info[0] if isinstance(info, list) else info.get("scans", [info])[0]
        assert scan["points"] == len(cloud), scan
        head, _, rows = file.read_bytes().partition(b"end_header\n")
        assert head.startswith(b"ply\n") and len(rows) == len(cloud) * (24 + 3 + 12 + 4)
        assert np.array_equal(np.frombuffer(rows, "<f8,<f8,<f8,u1,u1,u1,<f4,<f4,<f4,<u4")["f1"], cloud.points[:, 1])
        lower = w.cloud(**POSE, fov=60, **SIZE, clip="z<1")
        assert 0 < len(lower) < len(cloud) and lower.points[:, 2].max() < 1.1 and lower.normals is None
        assert len(w.cloud(eye=[3, 0, 1], target=[0, 0, 1], projection="equirectangular", width=96)) > 30
        empty = w.cloud(eye=[3, 0, 1], target=[9, 0, 1], width=16, height=16)
        assert len(empty) == 0 and b"element vertex 0\n" in empty.ply()


def test_scans_and_panoramas():
    with wall() as w:
        assert w.panorama([3, 0, 1], width=64).camera["projection"] == "equirectangular"
        for azimuth, elevation in (((180, -180, 360), (-15, 15, 16)), ((-20, 20, 41), (10, -10, 5)), ((0, 0, 1), (3.2, 3.2, 1))):
            ranges, points = w.scan([3, 0, 1], azimuth, elevation, forward=[-1, 0, 0])
            assert ranges.shape == (elevation[2], azimuth[2]) and points.shape == (*ranges.shape, 3)
            seen = points[np.isfinite(ranges)]
            assert len(seen) and np.abs(seen[:, 0] - 0.2 * np.sin(seen[:, 1])).max() < 0.03, (azimuth, elevation)
            assert np.allclose(np.linalg.norm(seen - [3, 0, 1], axis=1), ranges[np.isfinite(ranges)], rtol=1e-6)
        ranges, points = w.scan([3, 0, 1], (-20, 20, 41), (10, -10, 5), forward=[-1, 0, 0])
        assert abs(ranges[2, 20] - 3) < 0.02 and points[0, 20, 2] > points[4, 20, 2]  # the first ring is the upper one
        assert points[2, 21, 1] > points[2, 19, 1]  # to the right, as one looks along -x, is +y


def test_batches():
    with wall() as w:
        views = [dict(eye=[3, y, 1], target=[0, 0, 1]) for y in (-0.5, 0, 0.5)]
        found = w.batch([*views, dict(views[1], layer="range", format="npy")], **SIZE, clip=["z<1.5"])
        assert len(found) == 4 and all(view.bytes.startswith(JPEG) for view in found[:3])
        assert [view.camera["eye"][1] for view in found[:3]] == [-0.5, 0, 0.5]
        assert found[1].bytes == w.view(**views[1], **SIZE, clip="z<1.5").bytes
        assert np.array_equal(found[3].array(), w.array("range", **views[1], **SIZE, clip="z<1.5"), equal_nan=True)
        error = refused(SplatdError, lambda: w.batch([views[0], {"eye": [0, 0, 1], "target": [0, 0, 1]}]))
        assert error.status == 400 and error.field.startswith("views[1]"), error.field
    with wall("--deadline", "60000", binary=FAKE) as w:
        assert len(w.batch([dict(eye=[3, 0, 1], target=[0, 0, 1])] * 2, width=16, height=16)) == 2


def test_tours():
    with tempfile.TemporaryDirectory() as folder, wall("--tours", folder) as w:
        keys = {"keyframes": [{"camera": {"eye": [x, 0, 1], "target": [0, 0, 1], "fov": 60}} for x in (3, 2)]}
        heard = []
        tour = w.tour(keys, frames=3, settings=dict(width=32, height=24, clip="z<1.5", color_by="height", range=(0, 2)))
        tour.wait(60, every=0.05, told=heard.append)
        assert tour.info["state"] == "done" and tour.info["frames_done"] == 3
        assert tour.frame(0).startswith(JPEG) and tour.zip().startswith(b"PK") and tour.frame(0) != tour.frame(2)
        assert [t.name for t in w.service.tours()] == [tour.name] and w.service.tour(tour.name).info["frames"] == 3
        refused(ValueError, tour.video, "video=True")
        tour.remove()
        assert w.service.tours() == []
        assert refused(SplatdError, lambda: w.tour({"keyframes": []})).status == 400
    with tempfile.TemporaryDirectory() as folder, wall("--tours", folder, binary=FAKE, FAKE_FRAME_MS=1000) as w:
        late = w.tour(keys, frames=5000, settings=dict(width=32, height=24))  # more than an hour
        refused(TimeoutError, lambda: late.wait(0.01, every=0.01), late.name)
        late.remove()


def test_tiles():
    with Daemon(REAL, datasets=[TREE]) as d:
        tree = Splatd(f"http://127.0.0.1:{d.port}").dataset("tree")
        tiles = tree.tiles(color_by="height", class_=None)
        assert not tiles.is_mercator and "color_by=height&v=" in tiles.url and tiles.url.startswith(f"http://127.0.0.1:{d.port}/v1/")
        top = tiles.tile(0, 0, 0)
        assert top.type == "image/png" and top.camera["width"] == 256 and tiles.tile(0, 0, 0, scale=2).camera["width"] == 512
        # where find() says a place is, the tile shows it
        x, y = tree.center[0] + 1.5, tree.center[1] - 2.25
        at = tiles.find(x, y, 3)
        camera = tiles.tile(3, *map(int, at)).camera
        offset = np.array([x, y, 0]) - camera["eye"]
        pixel = camera["fx"] * np.array(camera["rotation"]).reshape(3, 3)[:2] @ offset + 128
        assert np.allclose(pixel, [256 * (v - int(v)) for v in at], atol=1e-6), (pixel, at)
        assert refused(SplatdError, lambda: tree.tiles(lod=-1)).field == "lod"
    with wall() as w:  # it has a coordinate system
        tiles = w.tiles()
        if not tiles.is_mercator:
            return
        place = w.place("EPSG:4326", world=[0, 0, 1])["position"]
        at = tiles.find(*place[:2], 22)
        camera = tiles.tile(22, *map(int, at)).camera
        offset = np.array([0, 0, 1]) - camera["eye"]
        pixel = [camera[f] * np.dot(row, offset) + 128 for f, row in zip(("fx", "fy"), np.array(camera["rotation"]).reshape(3, 3))]
        assert np.allclose(pixel, [256 * (v - int(v)) for v in at], atol=0.01), (pixel, at)


def test_signed_urls():
    with tempfile.TemporaryDirectory() as folder:
        tokens, key = pathlib.Path(folder, "tokens"), pathlib.Path(folder, "key")
        tokens.write_text("viewer-0123456789abcdef view\n")
        key.write_text(KEY + "\n")
        tokens.chmod(0o600)
        key.chmod(0o600)
        with Daemon(REAL, "--tokens", str(tokens), "--url-key", str(key)) as d:
            base = f"http://127.0.0.1:{d.port}"
            owner = Splatd(base, "viewer-0123456789abcdef").dataset("wall")
            for path in ("/v1/datasets/wall/view?width=16&clip=z<1.2&title='\u00e4'", "/v1/datasets/wall/tiles/{z}/{x}/{y}{r}.png?class=2",
                         "/v1/datasets/wall/tiles.json", "/embed/w%61ll#eye=1,2,3", "/v1/datasets/wall"):
                for url in path, "https://scans.example" + path:  # as splatd sign does it
                    wanted = subprocess.run([REAL, "sign", url, "--key", key, "--expires", "1h"], capture_output=True, text=True, check=True).stdout.strip()
                    exp = re.search(r"exp=(\d+)", wanted)[1]
                    with unittest.mock.patch("time.time", return_value=int(exp) - 3600):  # in the same second
                        made = sign(url, KEY + "\n", 3600)
                    assert made == wanted, (url, made, wanted)
            refused(SplatdError, lambda: Splatd(base).datasets(), "401")
            guest = Splatd(sign(f"{base}/embed/wall", KEY))
            w = guest.dataset()
            assert w.id == "wall" and w.view(**POSE, **SIZE).bytes == owner.view(**POSE, **SIZE).bytes
            assert len(w.cloud(**POSE, **SIZE)) and w.pick(8, 8, width=16, height=16) and w.thumbnail(64).bytes.startswith(JPEG)
            tiles = w.tiles(color_by="height")
            assert "&embed=" in tiles.url and tiles.tile(0, 0, 0).type == "image/png"
            assert refused(SplatdError, guest.datasets).status == 401 and refused(SplatdError, lambda: guest.dataset("other")).status == 403
            refused(ValueError, lambda: Splatd(base).dataset(), "takes a name")
            owner_tiles = owner.tiles()
            assert owner_tiles.tile(0, 0, 0).type == "image/png"


def test_retry_after_may_be_a_date():
    assert seconds_of(None) is None and seconds_of("3") == 3
    assert 0 <= seconds_of("Fri, 31 Dec 2100 23:59:59 GMT") and seconds_of("Fri, 31 Dec 1999 23:59:59 GMT") == 0


def shown():
    """IPython.display as far as the notebook uses it; each checks what it is given."""
    def image(data, width=None):
        assert data[:3] == JPEG or data[:8] == b"\x89PNG\r\n\x1a\n", data[:8]
        return "image", data

    def svg(data):
        xml.etree.ElementTree.fromstring(data)
        return "svg", data

    def frame(src, width, height):
        return "frame", src
    module = types.ModuleType("IPython.display")
    module.Image, module.SVG, module.IFrame = image, svg, frame
    return {"IPython": types.ModuleType("IPython"), "IPython.display": module}


def test_the_notebook_runs():
    notebook = json.loads((CLIENTS / "splatd.ipynb").read_text())
    assert notebook["nbformat"] == 4 and len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])
    assert all(not cell.get("outputs") and cell.get("execution_count") is None for cell in notebook["cells"])
    here = os.getcwd()
    with Daemon(REAL) as d, tempfile.TemporaryDirectory() as folder:
        sys.modules.update(shown())
        os.chdir(folder)
        names, results = {}, []
        try:
            for cell in notebook["cells"]:
                if cell["cell_type"] != "code":
                    continue
                source = "".join(cell["source"]).replace("http://127.0.0.1:8080", f"http://127.0.0.1:{d.port}")
                *lines, last = re.split(r"\n(?=\S)", source)  # the last statement is shown, as Jupyter does
                exec("\n".join(lines), names)
                results.append(eval(last, names))
        finally:
            os.chdir(here)
        kinds = [result[0] for result in results if isinstance(result, tuple) and isinstance(result[0], str)]
        assert kinds.count("image") >= 4 and kinds.count("svg") >= 1 and kinds[-1] == "frame", kinds
        assert len({result[1] for result in results if isinstance(result, tuple) and result[0] == "image"}) == kinds.count("image")
        assert pathlib.Path(folder, "cloud.ply").read_bytes().startswith(b"ply\n")
        [address] = [result[1] for result in results if isinstance(result, tuple) and result[0] == "frame"]
        assert d.ask(address.partition(str(d.port))[2]).status == 200


run(globals())
