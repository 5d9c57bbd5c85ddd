"""What each route answers when all is well: listings, every format of every layer, every form of a camera."""
import io
import json
import math
import os
import pathlib
import re
import struct
import subprocess
import tempfile
import zipfile
import zlib

import openapi
from harness import DEADLINE_MS, REAL, VIEW, WALL, Daemon, run

PICK = VIEW.replace("/view", "/pick")
ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"])
WEBP, TIFF = (os.environ[f"SPLATD_{name}"] == "1" for name in ("WEBP", "TIFF"))
COMPONENTS = {"color": ("|u1", 4, 1), "depth": ("<f4", 1, 4), "range": ("<f4", 1, 4), "normal": ("<f4", 3, 4),
              "id": ("<u4", 1, 4), "coverage": ("<f4", 1, 4), "primitive": ("<u4", 1, 4)}
LOOK = dict(eye="3,0.2,1", target="0,0,1", up="0,0,1")


def jpeg_size(data):
    assert data[:2] == b"\xff\xd8" and data[-2:] == b"\xff\xd9"
    at = 2
    while not 0xC0 <= data[at + 1] <= 0xC2:
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    height, width = struct.unpack(">HH", data[at + 5:at + 9])
    return width, height


def png_pixels(data):
    """(width, height, bit depth, colour type, unfiltered bytes per row)"""
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[-12:] == b"\0\0\0\0IEND\xaeB`\x82"
    at, idat = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + length]
        assert zlib.crc32(kind + chunk) == struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", chunk[:10])
        idat += chunk if kind == b"IDAT" else b""
        at += 12 + length
    return width, height, depth, color, len(zlib.decompress(idat)) // height - 1


def test_index_lists_what_there_is():
    with Daemon(REAL) as d:
        index = d.ask("/").json()
        assert index["name"] == "splatd" and VIEW in index["views"]
        assert all(d.ask(index[what]).status == 200 for what in ("datasets", "methods", "status"))


def test_datasets_are_described():
    with Daemon(REAL) as d:
        [short] = d.ask("/v1/datasets").json()["datasets"]
        full = d.ask("/v1/datasets/wall").json()
        assert {k: full[k] for k in short} == short
        assert full["id"] == "wall" and full["view"] == VIEW and full["unit"] == "us-ft"
        assert full["splats"] > 1600 and full["leaf_splats"] == 1600 and full["levels"] == 2
        assert full["bytes"] == os.path.getsize(WALL)
        assert re.fullmatch("[0-9a-f]{16}", full["version"])
        low, high = full["bounds"]["min"], full["bounds"]["max"]
        assert all(abs(a - b) < 0.02 for a, b in zip(low + high, [-0.17, -1, 0, 0.17, 0.95, 1.95])), (low, high)
        assert full["layers"] == list(COMPONENTS) and full["methods"] == ["splat", "points", "fill", "nearest"]
        assert full["formats"] == ["jpeg", "png", "npy", "raw"] + ["webp"] * WEBP + ["tiff"] * TIFF
        assert full["default_view"]["fov"] > 0 and len(full["default_view"]["eye"]) == 3


SOFT = ["soft_model", "soft_opacity", "soft_cover", "soft_blend", "of"]
COLORS = ["edl_strength", "edl_radius", "ramp"]


def test_methods_are_those_of_the_document():
    """Names, ranges and defaults, as OpenAPI has them of a view."""
    with Daemon(REAL) as d:
        table = d.ask("/v1/methods").json()
        view = openapi.resolve(openapi.DOCUMENT["components"]["schemas"]["ViewRequest"])["properties"]
        document = {name: openapi.resolve(schema) for name, schema in view.items()}
        names = [method["name"] for method in table["methods"]]
        assert names == document["method"]["enum"] and table["default"] == document["method"]["default"] == names[0]
        assert names == d.ask("/v1/datasets/wall").json()["methods"]
        methods = {method["name"]: method for method in table["methods"]}
        assert methods["splat"]["textures"] and not methods["points"]["textures"]
        assert methods["splat"]["stand_in"] == "fill" and methods["fill"]["stand_in"] is None
        assert [name for name, method in methods.items() if method["normals"]] == ["fill"]
        assert methods["splat"]["parameters"] == ["margin", "atoms", "maps", "primitives"] + SOFT + COLORS
        assert methods["points"]["parameters"] == SOFT + COLORS
        assert "not measured" in methods["fill"]["description"]
        for parameter in table["parameters"]:
            name, schema = parameter["name"], document[parameter["name"]]
            assert {k: parameter.get(k) for k in ("default", "maximum", "enum")} == \
                {k: schema.get(k) for k in ("default", "maximum", "enum")}, parameter
            assert parameter["type"] == schema.get("type", "string") and len(parameter["description"]) > 20, parameter
            assert min(parameter.get("minimum", 0), parameter["default"]) == schema["minimum"] \
                if "minimum" in schema else "enum" in parameter, parameter
            assert any(name in method["parameters"] for method in table["methods"]), f"nothing takes {name}"
            for value in parameter.get("enum", [parameter.get("minimum"), parameter.get("maximum"), parameter["default"]]):
                assert d.view(method="points", width=8, height=8, **{name: value}).status == 200, (name, value)
            beyond = "nothing" if "enum" in parameter else parameter["maximum"] + 1
            assert d.view(width=8, height=8, **{name: beyond}).status == 400, (name, beyond)
        assert {p["name"] for p in table["parameters"]} == {n for m in table["methods"] for n in m["parameters"]}
        assert [p["name"] for p in table["parameters"] if p["textures"]] == ["atoms"]
        assert [p["name"] for p in table["parameters"] if p["maps"]] == ["maps"]
        assert [p["name"] for p in table["parameters"] if p["primitives"]] == ["primitives"]
        assert [p["name"] for p in table["parameters"] if p["soft"]] == SOFT
        assert [p["name"] for p in table["parameters"] if p["colors"]] == COLORS
        assert d.ask("/v1/datasets/wall").json()["primitives"] is None


def test_status_says_how_it_is():
    with Daemon(REAL) as d:
        assert d.view(width=64, height=48).status == 200
        status = d.status()
        assert status["state"] == "ready" and status["datasets"] == ["wall"]
        device = status["device"]
        assert device["backend"] in ("vulkan", "egl") and device["name"] and device["driver"]
        assert status["counters"]["frames"] == 1 and status["counters"]["replies_2xx"] == 1
        assert status["memory"]["device_bytes"] > 0 and status["memory"]["resident_bytes"] > 0
        assert status["queues"]["render"] == {"length": 0, "capacity": 32}
        assert status["limits"]["deadline_ms"] == DEADLINE_MS


def test_default_view_is_a_jpeg():
    with Daemon(REAL) as d:
        reply = d.ask(VIEW)
        assert reply.headers["Content-Type"] == "image/jpeg" and jpeg_size(reply.body) == (1280, 720)
        assert len(set(reply.body)) > 50, "an empty picture"
        head = d.ask(VIEW, "HEAD")
        assert head.body == b"" and int(head.headers["Content-Length"]) == len(reply.body)
        assert d.post("").body == reply.body and d.post({}).body == reply.body


def test_every_format_of_every_layer():
    with Daemon(REAL) as d:
        for layer, (dtype, components, size) in COMPONENTS.items():
            raw = d.view(**LOOK, width=64, height=48, layer=layer, format="raw").body
            assert len(raw) == 64 * 48 * components * size
            assert len(set(raw)) > 1, f"{layer} is empty"
            npy = d.view(**LOOK, width=64, height=48, layer=layer, format="npy").body
            header = npy[10:10 + struct.unpack("<H", npy[8:10])[0]].decode()
            shape = "(48, 64)" if components == 1 else f"(48, 64, {components})"
            assert npy[:8] == b"\x93NUMPY\1\0" and f"'{dtype}'" in header and shape in header, header
            assert npy[10 + len(header):] == raw
            jpeg = d.view(**LOOK, width=64, height=48, layer=layer, format="jpg")
            assert jpeg.headers["Content-Type"] == "image/jpeg" and jpeg_size(jpeg.body) == (64, 48)
            png = d.view(**LOOK, width=64, height=48, layer=layer, format="png").body
            width, height, depth, color, row = png_pixels(png)
            wanted = {"depth": (16, 0), "range": (16, 0), "coverage": (8, 0), "normal": (8, 2),
                      "primitive": (8, 2)}.get(layer, (8, 6))
            assert (width, height, (depth, color)) == (64, 48, wanted)
            assert row == 64 * depth // 8 * {0: 1, 2: 3, 6: 4}[color]


def test_depth_headers_say_what_pixels_mean():
    with Daemon(REAL) as d:
        png = d.view(**LOOK, layer="depth", width=64, height=48).headers
        assert (png["Content-Type"], png["Splatd-Depth-Unit"], png["Splatd-Depth-Scale"], png["Splatd-Depth-Invalid"],
                png["Splatd-Depth-Saturated"]) == ("image/png", "us-ft", "1000", "0", "0")
        fine = d.view(**LOOK, layer="range", width=64, height=48, depth_scale=50000).headers
        assert fine["Splatd-Depth-Scale"] == "50000" and int(fine["Splatd-Depth-Saturated"]) > 100
        npy = d.view(**LOOK, layer="depth", width=64, height=48, format="npy").headers
        assert (npy["Splatd-Depth-Unit"], npy["Splatd-Depth-Scale"], npy["Splatd-Depth-Invalid"]) == ("us-ft", "1", "NaN")
        jpeg = d.view(**LOOK, layer="depth", width=64, height=48, format="jpeg").headers
        assert 2 < float(jpeg["Splatd-Depth-Near"]) < float(jpeg["Splatd-Depth-Far"]) < 4
        color = d.view(width=64, height=48)
        assert color.headers["Splatd-Depth-Unit"] is None and color.headers["Splatd-Unit"] == "us-ft"
        body = d.view(**LOOK, layer="depth", width=64, height=48).body
        assert b"1000 steps per us-ft, 0 = nothing" in body
        parts = d.view(**LOOK, layers="color,depth", width=64, height=48)
        assert parts.headers["Splatd-Unit"] == "us-ft" and b"Splatd-Depth-Unit: us-ft" in parts.body
        assert d.ask(f"{VIEW.replace('/view', '/pick')}?x=2&y=2").json()["unit"] == "us-ft"


def test_who_does_not_know_the_unit_says_so():
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "wall.spld"
        subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--unit=", "--crs=", path], check=True)
        with Daemon(REAL, datasets=[str(path)]) as d:
            assert d.ask("/v1/datasets/wall").json()["unit"] == "unit"
            view = d.view(**LOOK, layer="depth", width=64, height=48)
            assert view.headers["Splatd-Unit"] == view.headers["Splatd-Depth-Unit"] == "unit"
            assert b"1000 steps per unit," in view.body


def test_depth_is_metres_along_the_axis():
    with Daemon(REAL) as d:
        pose = dict(eye="3,0,1", target="0,0,1", up="0,0,1", fov=60)
        raw = d.view(**pose, width=65, height=49, layer="depth", format="raw").body
        middle = struct.unpack("<f", raw[4 * (24 * 65 + 32):][:4])[0]
        assert abs(middle - 3) < 0.01, middle


def test_view_headers():
    with Daemon(REAL) as d:
        wanted = dict(fx=100, fy=101, cx=30, cy=20, width=64, height=48, near=0.5, far=9)
        headers = d.view(eye="3,0.5,1", target="0,0,1", **wanted).headers
        stages = dict(re.findall(r"(\w+);dur=([\d.]+)", headers["Server-Timing"]))
        assert list(stages) == ["queue", "pages", "frame", "select", "depth", "shade", "soft", "resolve", "readback", "encode",
                                "total"], headers["Server-Timing"]
        assert float(stages["total"]) >= float(stages["encode"]) > 0
        camera = json.loads(headers["Splatd-Camera"])
        assert camera["eye"] == [3, 0.5, 1] and len(camera["rotation"]) == 9
        assert {k: camera[k] for k in wanted} == wanted
        assert headers["Splatd-Complete"] == "true" and int(headers["Splatd-Splats"]) > 0
        away = d.view(eye="3,0.5,1", target="6,0.5,1", width=64, height=48)
        assert away.status == 200 and away.headers["Splatd-Splats"] == "0", away.headers
        assert headers["Splatd-Device"].startswith(d.status()["device"]["backend"])


def test_camera_forms_give_the_same_bytes():
    size = dict(width=64, height=48, format="raw")
    pinhole = dict(fx=50, fy=50, cx=32, cy=24)
    forms = [
        dict(eye=[3, 0, 1], target=[0, 0, 1], up=[0, 0, 1], **pinhole),
        dict(matrix=[0, 0, -1, 3, 1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0, 1], convention="opencv", **pinhole),
        dict(matrix=[0, 0, 1, 3, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1], convention="opengl", **pinhole),
        dict(q=[0.5, 0.5, 0.5, -0.5], t=[0, 1, 3], model="PINHOLE", params=[50, 50, 32, 24]),
    ]
    with Daemon(REAL) as d:
        first = d.view(eye="3,0,1", target="0,0,1", up="0,0,1", **pinhole, **size)
        assert d.view(POC="3,0,1", POI="0,0,1", UP="0,0,1", **pinhole, **size).body == first.body
        for form in forms:
            reply = d.post({"camera": form, **size})
            assert reply.status == 200, reply.body
            assert reply.body == first.body, (form, reply.headers["Splatd-Camera"], first.headers["Splatd-Camera"])


def test_cameras_of_other_programs_are_the_same_camera():
    rotation = [0, 0, -1, 1, 0, 0, 0, -1, 0]  # rows are the world's axes; columns right, down, forward
    size = dict(width=64, height=48)
    node = [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 3, 0, 1, 1]  # right, up, backward, place
    extrinsic = [0, 0, -1, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 1, 3, 1]
    pose = dict(matrix=[0, 0, -1, 3, 1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0, 1], convention="opencv")
    zeros = dict(d=[0] * 5, distortion_model="plumb_bob", **size)
    fov = math.degrees(2 * math.atan(24 / 50))
    lens = dict(yfov=math.radians(fov), aspectRatio=4 / 3, znear=0.25, zfar=50)
    around = dict(near=0.25, far=50)
    forms = [
        {"gltf": {"type": "perspective", "perspective": lens, "matrix": node}, **size},
        {"gltf": {"perspective": lens}, "eye": [3, 0, 1], "target": [0, 0, 1], "up": [0, 0, 1], "height": 48},
        {"gltf": {"matrix": node}, "fx": 50, **around, **size},
        {"open3d": {"class_name": "PinholeCameraParameters", "version_major": 1, "version_minor": 0, "extrinsic": extrinsic,
                    "intrinsic": {"intrinsic_matrix": [50, 0, 0, 0, 50, 0, 31.5, 23.5, 1], **size}}, **around},
        {"ros": {"k": [50, 0, 31.5, 0, 50, 23.5, 0, 0, 1], **zeros}, **pose, **around},
        {"ros": {"p": [50, 0, 31.5, 0, 0, 50, 23.5, 0, 0, 0, 1, 0], **zeros}, **pose, **around},
        {"nerfstudio": {"camera_model": "OPENCV", "file_path": "images/1.jpg", "w": 64, "h": 48, "fl_x": 50, "fl_y": 50, "cx": 32,
                        "cy": 24, **{name: 0 for name in ("k1", "k2", "k3", "k4", "p1", "p2")},
                        "transform_matrix": [node[i::4] for i in range(4)]}, **around},
    ]
    with Daemon(REAL) as d:
        first = json.loads(d.view(eye="3,0,1", target="0,0,1", up="0,0,1", fx=50, **around, **size).headers["Splatd-Camera"])
        assert first["rotation"] == [rotation[3 * j + i] for i in range(3) for j in range(3)]
        for form in forms:
            for path, rest in ((VIEW, {"format": "raw"}), (PICK, {"x": 32, "y": 24})):
                reply = d.post({"camera": form, **rest}, path)
                assert reply.status == 200, (form, reply.body)
                used = json.loads(reply.headers["Splatd-Camera"])
                for name, wanted in first.items():
                    wanted, got = (v if isinstance(v, list) else [v] for v in (wanted, used[name]))
                    assert len(wanted) == len(got) and max(abs(a - b) for a, b in zip(wanted, got)) < 1e-12, (form, name, got)
        views = d.post({"views": [{"camera": form} for form in forms], "format": "raw"}, VIEW + "s")
        assert views.status == 200 and views.headers["Splatd-Failed"] == "0", views.body[:500]


def test_orthographic_views():
    """A plan by every way to ask for it is one image; picks, batches and layers speak of the same place."""
    eye, down = {"eye": "0.3,0.2,9", "target": "0.3,0.2,0"}, {"eye": [0.3, 0.2, 9], "target": [0.3, 0.2, 0]}
    size, npy = {"width": 64, "height": 48}, {"layer": "depth", "format": "npy"}
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.3, 0.2, 9, 1]  # looks down, +y is up in the image
    with Daemon(REAL) as d:
        first = d.view(**eye, projection="orthographic", view_height=6, **size, **npy)
        assert first.status == 200, first.body
        used = json.loads(first.headers["Splatd-Camera"])
        assert used["projection"] == "orthographic" and abs(used["fx"] - 8) < 1e-12
        assert max(abs(a - b) for a, b in zip(used["rotation"], [1, 0, 0, 0, -1, 0, 0, 0, -1])) < 1e-12
        for same in (d.view(**eye, units_per_pixel=0.125, **size, **npy), d.view(**eye, projection="orthographic", fx=8, **size, **npy),
                     d.post({"camera": {**down, "projection": "orthographic", "view_height": 6}, **size, **npy}),
                     d.post({"camera": {**down, "units_per_pixel": 0.125}, **size, **npy})):
            assert same.body == first.body and same.headers["ETag"] in (None, first.headers["ETag"]), same.headers  # a POST has none
        lens = {"orthographic": {"xmag": 4, "ymag": 3, "znear": used["near"], "zfar": 1e12}, "matrix": matrix}
        gltf = d.post({"camera": {"gltf": lens}, "height": 48, **npy})
        assert gltf.status == 200 and gltf.body == first.body, gltf.headers
        assert "projection" not in json.loads(d.view(**eye, up="0,1,0", **size).headers["Splatd-Camera"])
        ranges = d.view(**eye, view_height=6, layer="range", format="npy", **size)
        assert ranges.body == first.body
        floats = struct.unpack("<3072f", first.body[-4 * 3072:])
        at = next(i for i, z in enumerate(floats) if z == z)
        point = {"x": at % 64 + 0.5, "y": at // 64 + 0.5}
        query = "&".join(f"{k}={v}" for k, v in {**eye, "view_height": 6, **size, **point}.items())
        pick = d.ask(f"{PICK}?{query}").json()
        wanted = [0.3 + (point["x"] - 32) / 8, 0.2 - (point["y"] - 24) / 8, 9 - floats[at]]
        assert max(abs(a - b) for a, b in zip(pick["position"], wanted)) < 1e-5, (pick, wanted)
        assert pick["distance"] == pick["depth"]
        for camera, rest in (({**down, "projection": "orthographic", "view_height": 6}, size), ({**down, "units_per_pixel": 0.125}, size),
                             ({"gltf": lens}, {"height": 48})):
            assert d.post({"camera": camera, **rest, **point}, PICK).json()["position"] == pick["position"], camera
        views = d.post({"views": [{"camera": {**down, "view_height": h}} for h in (6, 2)], **size, **npy}, VIEW + "s")
        assert views.status == 200 and first.body in views.body
        assert d.view(**eye, view_height=6, near=0, **size).status == 200
        wrong = d.view(**eye, projection="perspective", near=0, up="0,1,0", **size)
        assert wrong.status == 400 and wrong.json()["field"] == "near", wrong.body
        views_all_around(d)


def views_all_around(d):
    """Sizes follow from the projection, what a lens saw can be asked for again, picks and batches speak of the same place, and
    what there is not of them is refused by name."""
    at, npy = {"eye": "3,0.2,1", "target": "0,0,0.4"}, {"layer": "range", "format": "npy"}
    for projection, size, fov in (("equirectangular", (128, 64), None), ("cube", (96, 16), None), ("fisheye", (64, 64), 200)):
        first = d.view(**at, projection=projection, width=size[0], **npy, **({"fov": fov} if fov else {}))
        assert first.status == 200, first.body
        used = json.loads(first.headers["Splatd-Camera"])
        assert (used["width"], used["height"], used["projection"], used.get("fov")) == (*size, projection, fov), used
        if not fov:  # upright, however steeply the target lies
            assert abs(used["rotation"][5] + 1) < 1e-12 and abs(used["rotation"][8]) < 1e-12, used
        floats = struct.unpack(f"<{size[0] * size[1]}f", first.body[-4 * size[0] * size[1]:])
        seen = next(i for i, r in enumerate(floats) if r == r)
        x, y = seen % size[0] + 0.5, seen // size[0] + 0.5
        query = "&".join(f"{k}={v}" for k, v in {**at, "projection": projection, "width": size[0], "x": x, "y": y,
                                                 **({"fov": fov} if fov else {})}.items())
        pick = d.ask(f"{PICK}?{query}").json()
        assert pick["distance"] == pick["depth"] and abs(pick["distance"] - floats[seen]) < 0.05, (pick, floats[seen])
        assert d.view(**at, projection=projection, width=size[0]).headers["ETag"] != first.headers["ETag"]
        view = {"camera": {"eye": [3, 0.2, 1], "target": [0, 0, 0.4], "projection": projection, **({"fov": fov} if fov else {})}, "width": size[0]}
        views = d.post({"views": [view], **npy}, VIEW + "s")
        assert views.status == 200 and first.body in views.body
        for extra, field in (({"layer": "depth"}, "layer"), ({"budget": "50ms"}, "budget"), ({"psnr": 20}, "psnr"),
                             ({"format": "tiff"}, "format"), ({"view_height": 3}, "view_height"),
                             ({"units_per_pixel": 3}, "units_per_pixel")):
            wrong = d.view(**at, projection=projection, width=size[0], **extra)
            assert wrong.status == 400 and wrong.json()["field"] == field, (projection, extra, wrong.body)
    assert d.view(**at, projection="equirectangular", fov=50).json()["field"] == "fov"
    assert d.view(**at, projection="cube", width=97, height=16).json()["field"] == "width"
    assert d.view(**at, projection="fisheye", fov=361).json()["field"] == "fov"
    assert d.view(**at, fov=200).json()["field"] == "fov"
    for field in ("fx", "fy", "cx", "cy"):  # beyond what faces have pixels for
        wrong = d.view(**at, projection="fisheye", **{"fx": 30, "fy": 30, field: 1e20})
        assert wrong.status == 400 and wrong.json()["field"] == field, wrong.body
    assert d.view(**at, projection="orthographic", fx="1e-320").json()["field"] == "fx"
    none = d.view(**at, projection="fisheye", fov=180, cx=-1e6, width=64, **npy)
    assert none.status == 200 and set(none.body[-64 * 64 * 4:]) == set(struct.pack("<f", float("nan"))), none.body[:200]
    tilted = [d.view(eye="3,0.2,1", target="0,0,0.4", up=up, projection="equirectangular", width=64).headers["Splatd-Camera"]
              for up in ("0,0,1", "0,0,1e-170", "0,0,1e200")]
    assert len(set(tilted)) == 1, tilted
    whole = d.view(**at, projection="equirectangular", azimuth="-180,180,64", elevation="88,-88,45", **npy)
    rings = d.view(**at, projection="equirectangular", azimuth="180,-180,64", elevation="-88,88,45", **npy)
    assert whole.status == rings.status == 200, (whole.body, rings.body)
    down, up = ([struct.unpack("<64f", r.body[-4 * 64 * 45:][256 * i:256 * (i + 1)]) for i in range(45)] for r in (whole, rings))
    pairs = [(down[i][j], up[44 - i][(64 - j) % 64]) for i in range(45) for j in range(64)]
    assert all((a != a and b != b) or abs(a - b) < 1e-5 for a, b in pairs) and any(a == a for a, _ in pairs)
    assert d.view(**at, projection="fisheye", azimuth="0,9,4", elevation="0,9,4").json()["field"] == "azimuth"
    pose = {"eye": [3, 0.2, 1], "target": [0, 0, 0.4]}
    scan = {**pose, "projection": "equirectangular", "azimuth": [-180, 180, 64], "elevation": [88, -88, 45]}
    assert d.post({"camera": scan, **npy}).body == whole.body
    hit = next((i, j) for i in range(45) for j in range(64) if down[i][j] == down[i][j])
    point = {"x": hit[1] + 0.5, "y": hit[0] + 0.5}
    picks = (d.post({"camera": scan, **point}, PICK), d.ask(f"{PICK}?eye=3,0.2,1&target=0,0,0.4&projection=equirectangular&"
                                                            f"azimuth=-180,180,64&elevation=88,-88,45&x={point['x']}&y={point['y']}"))
    assert picks[0].json() == picks[1].json() and abs(picks[0].json()["distance"] - down[hit[0]][hit[1]]) < 0.1, picks[0].body
    lens = {"model": "OPENCV", "params": [50, 51, 32.5, 24, -0.2, 0.05, 0.002, -0.001]}
    saw = d.post({"camera": {**pose, **lens}, "width": 64, "height": 48, **npy})
    assert saw.status == 200, saw.body
    used = json.loads(saw.headers["Splatd-Camera"])
    assert used["model"] == "FULL_OPENCV" and "projection" not in used
    again = d.post({"camera": {**pose, "model": used["model"], "params": used["params"]}, "width": 64, "height": 48, **npy})
    assert again.body == saw.body
    straight = d.post({"camera": {**pose, "fx": 50, "fy": 51, "cx": 32.5, "cy": 24}, "width": 64, "height": 48, **npy})
    assert straight.status == 200 and straight.body != saw.body
    wrong = d.post({"camera": {**pose, **lens}, "width": 64, "height": 48, "layer": "depth"})
    assert wrong.status == 400 and wrong.json()["field"] == "layer", wrong.body


def test_a_body_says_all_that_a_query_does():
    look = {"eye": [3, 0.2, 1], "target": [0, 0, 1], "up": [0, 0, 1], "fov": 50}
    size, rest = {"width": 64, "height": 48, "near": 0.5, "far": 9}, dict(
        method="points", layer="depth", supersample=2, margin=0.5, background="102030", transparent=True, format="png",
        lod=2, depth_scale=500, atoms=2)
    fill = dict(method="fill", visibility="constant", kernel=7, threshold=0.25, pyramid=3)
    with Daemon(REAL) as d:
        by_query = d.view(eye="3,0.2,1", target="0,0,1", up="0,0,1", fov=50, **size, **{**rest, "transparent": "true"})
        assert by_query.status == 200
        assert d.post({"camera": {**look, **size}, **rest}).body == by_query.body
        assert d.post({"camera": look, **size, **rest}).body == by_query.body
        by_query = d.view(eye="3,0.2,1", target="0,0,1", up="0,0,1", fov=50, **size, **fill)
        assert by_query.status == 200 and d.post({"camera": look, **size, **fill}).body == by_query.body
        for name, other in dict(visibility="adaptive", kernel=3, threshold=1, pyramid=1).items():
            changed = d.post({"camera": look, **size, **fill, name: other})
            assert changed.status == 200 and changed.headers["ETag"] != by_query.headers["ETag"], name
        coarse, fine = (d.view(**LOOK, quality=quality, width=64, height=48).body for quality in (10, 95))
        assert len(coarse) < len(fine)
        same = {"camera": {k: v for k, v in look.items() if k != "fov"}, "width": 64, "height": 48, "quality": 10}
        assert d.post(same).body == coarse


def test_a_side_that_is_left_out_follows_from_the_other():
    with Daemon(REAL) as d:
        assert jpeg_size(d.view(width=320).body) == jpeg_size(d.view(height=180).body) == (320, 180)
        gltf = {"camera": {"gltf": {"perspective": {"yfov": 1, "znear": 0.1, "aspectRatio": 1.5}}}, "width": 90}
        assert jpeg_size(d.post(gltf).body) == (90, 60)
        batch = d.post({"width": 160, "container": "zip", "views": [{}, gltf]}, VIEW + "s")
        with zipfile.ZipFile(io.BytesIO(batch.body)) as views:
            assert [jpeg_size(views.read(f"00{i}.jpg")) for i in range(2)] == [(160, 90), (90, 60)]
        assert d.ask(f"{PICK}?x=160.5&y=90.5&width=320").json() == d.ask(f"{PICK}?x=160.5&y=90.5&width=320&height=180").json()
        assert d.ask(f"{PICK}?x=160.5&y=200&width=320").json()["field"] == "y"
        assert d.view(height=8192).json()["field"] == "height"


def test_a_matrix_may_be_rows():
    flat = [1, 0, 0, 0, 0, 0, -1, -3, 0, 1, 0, 1, 0, 0, 0, 1]
    rows = [flat[at:at + 4] for at in range(0, 16, 4)]
    size = dict(width=64, height=48)
    with Daemon(REAL) as d:
        def ask(matrix):
            reply = d.post({"camera": {"matrix": matrix, "convention": "opengl", "fov": 60}, **size})
            assert reply.status == 200, reply.body
            return reply.body
        assert ask(flat) == ask(rows) == ask(rows[:3])
        pick = {"x": 32.5, "y": 24.5, "camera": {"matrix": rows, "convention": "opengl", "fov": 60}, **size}
        assert d.post(pick, PICK).json()["position"]
        flat_open3d = [1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 5, 1]
        rows_open3d = [flat_open3d[column::4] for column in range(4)]
        views = [d.post({"camera": {"open3d": {"extrinsic": extrinsic, "intrinsic": {**size, "intrinsic_matrix": k}}}}).body
                 for extrinsic, k in [(flat_open3d, [50, 0, 0, 0, 50, 0, 31.5, 23.5, 1]),
                                      (rows_open3d, [[50, 0, 31.5], [0, 50, 23.5], [0, 0, 1]])]]
        assert views[0] == views[1] and views[0][:2] == b"\xff\xd8", views[0][:300]
        gltf = d.post({"camera": {"gltf": {"matrix": rows}, "fov": 60}}).json()
        assert gltf["field"] == "gltf.matrix" and "by columns" in gltf["detail"], gltf


def test_a_wrong_path_is_told_what_there_is():
    with Daemon(REAL) as d:
        for path, known in (("/v1/datasets/wall/veiw", "below /v1/datasets/{id}/ there are profile, "), ("/v1/tours/a/b/c", "below /v1/tours/{name}/ "
                            "there are events, "), ("/v1/dataset", "below /v1/ there are "), ("/v2", "/ lists what there is")):
            reply = d.ask(path)
            assert reply.status == 404 and known in reply.json()["detail"], reply.body
        below = d.ask("/v1/datasets/wall/").json()["detail"]
        assert below.count(" view,") == below.count("tiles/{z}/{x}/{y}") == 1 and below.endswith("rays"), below
        assert "datasets, " in d.ask("/v1/").json()["detail"]


def test_what_is_refused_points_to_what_is_served():
    with Daemon(REAL) as d:
        for reply in [d.view(zoom=1), d.post({"zoom": 1}), d.post({"camera": {"zoom": 1}}), d.post({"views": [{"zoom": 1}]}, VIEW + "s")]:
            words = reply.json()["detail"]
            assert reply.status == 400 and "zoom" in words and not re.search(r"\bapi/", words), words
            [link] = re.findall(r"/v1/\S+", words)
            assert d.ask(link).status == 200


def test_the_clients_are_listed():
    with Daemon(REAL) as d:
        clients = d.ask("/clients/")
        assert clients.headers["Content-Type"] == "application/json" and "Accept" in clients.headers["Vary"]
        for entry in clients.json()["clients"]:
            file = d.ask(entry["uri"])
            assert file.status == 200 and len(file.body) == entry["bytes"] and entry["about"], entry
        assert {entry["name"] for entry in clients.json()["clients"]} == {"splat-map.js", "splat-view.js", "splatd.py", "splatd.sh"}
        page = d.ask("/clients/", headers={"Accept": "text/html,*/*;q=0.8"})
        assert page.headers["Content-Type"].startswith("text/html") and "script" not in page.body.decode()
        assert sorted(re.findall('href="([^"]+)"', page.body.decode())) == sorted(e["uri"] for e in clients.json()["clients"])
        for accept in ("text/html", "application/json"):
            got, head = (d.ask("/clients/", method, headers={"Accept": accept}) for method in ("GET", "HEAD"))
            assert head.status == 200 and not head.body and head.headers["Content-Type"] == got.headers["Content-Type"]
            assert head.headers["Content-Length"] == str(len(got.body))
        assert d.ask("/clients/none").json()["detail"].endswith("/clients/ lists them")
        assert d.ask("/").json()["clients"] == "/clients/"
        assert d.ask("/clients/", "POST").json()["detail"].endswith("GET, HEAD are")
        assert d.ask(VIEW + "s").json()["detail"].endswith("POST is")


def test_the_same_request_gives_the_same_bytes():
    with Daemon(REAL, "--cache", "0") as d:
        for form in ("jpeg", "png"):
            connection = d.connect()
            path = f"{VIEW}?width=320&height=180&format={form}"
            bodies = {d.ask(path, connection=connection).body for _ in range(50)}
            assert len(bodies) == 1


def test_background_and_methods_change_the_picture():
    with Daemon(REAL) as d:
        away = dict(eye="3,0,1", target="9,0,1", up="0,0,1", width=8, height=4, format="raw")
        assert d.view(**away).body == b"\0\0\0\xff" * 32
        assert d.view(**away, background="#ff8000").body == b"\xff\x80\x00\xff" * 32
        assert d.view(**away, background="White").body == b"\xff" * 128
        assert d.post({"camera": {"eye": [3, 0, 1], "target": [9, 0, 1]}, "width": 8, "height": 4, "format": "raw",
                       "background": "orange"}).body == b"\xff\xa5\x00\xff" * 32
        assert d.view(**away, transparent="true").body[3::4] == b"\0" * 32
        near = dict(**LOOK, width=160, height=120, format="raw")
        assert d.view(**near).body != d.view(**near, method="points").body


def test_alpha_is_the_share_of_the_pixel_that_is_covered():
    with Daemon(REAL) as d:
        view = dict(**LOOK, width=160, height=120, supersample=4, format="raw")
        alpha = d.view(**view, transparent="true").body[3::4]
        coverage = struct.unpack("<19200f", d.view(**view, layer="coverage").body)
        assert all(abs(a - 255 * c) <= 0.51 for a, c in zip(alpha, coverage))
        assert {0, 255} < set(alpha) and any(0 < a < 255 for a in alpha), sorted(set(alpha))


def test_keep_alive_serves_one_after_the_other():
    with Daemon(REAL) as d:
        connection = d.connect()
        for path in [VIEW + "?width=16&height=16", "/v1/datasets", VIEW + "?width=0", "/v1/status", "/nowhere"] * 4:
            d.ask(path, connection=connection)
        assert d.status()["counters"]["requests"] == 21


def test_openapi_knows_every_parameter_and_route():
    text = (ROOT / "api" / "openapi.yaml").read_text()
    listed = {operation["operationId"]: {p["name"] for p in parameters if p["in"] == "query"}
              for _, _, operation, parameters in openapi.operations()}
    schemas = {name: set(re.findall(r"^        (\w+):", body, re.M)) for name, body in
               re.findall(r"^    (ViewRequest|Camera):\n(.*?)(?=^    \w|\Z)", text, re.M | re.S)}
    table = "".join((ROOT / name).read_text() for name in ("src/geom/camera_params.def", "src/service/request/view_params.def"))
    rows = re.findall(r'^PARAM\((\w+), "(\w*)", \w+, ([A-Z_| ]+),', table, re.M)
    methods = (ROOT / "include/splatd/method.h").read_text()
    params = [[cell.strip() for cell in row.replace("\\\n", " ").split(",")] for row in
              re.findall(r"^    (?:REAL|COUNT|CHOICE)\(([^\"]+?),[\s\\\\]*\"", methods, re.M)]
    assert len(params) >= 6
    colors = ("SPL_CHANGES_TEXTURES", "SPL_CHANGES_SHADE", "SPL_CHANGES_COLORS")  # of which a pick knows nothing
    rows += [(row[0], "", "SPL_QUERY | SPL_BODY | SPL_TILE" + (" | SPL_PICK" if row[-1] not in colors else "")) for row in params]
    assert len(rows) > 20
    assert listed["getView"] == {name for name, _, places in rows if "QUERY" in places}
    camera = {name for name, _, places in rows if "QUERY" in places and f"PARAM({name}," in
              (ROOT / "src/geom/camera_params.def").read_text()}
    assert listed["pick"] == {name for name, _, places in rows if "PICK" in places} | camera
    assert listed["getTile"] == {name for name, _, places in rows if "TILE" in places}
    assert schemas["ViewRequest"] == {name for name, _, places in rows if "BODY" in places} | {"camera"}
    assert listed["getThumbnail"] == {name for name, _, places in rows if "THUMBNAIL" in places}
    saved = re.search(r"^    SavedSettings:\n(.*?)(?=^    \w)", text, re.M | re.S)[1]
    kept = {row[0] for row in params if row[-1] in (*colors[1:], "SPL_CHANGES_SOFT")}
    assert set(re.findall(r"^        (\w+):", saved, re.M)) == {name for name, _, places in rows if "SAVED" in places} | kept
    assert listed["showPlace"] == {name for name, _, places in rows if "PLACE" in places}
    assert schemas["Camera"] == {name for name, _, places in rows if "CAMERA" in places}
    assert all(f"Alias {alias}." in text for _, alias, _ in rows if alias)
    routes = re.findall(r'^    \{"(/[^"]*)", ', (ROOT / "src/service/routes.c").read_text(), re.M)
    assert sorted(set(routes)) == sorted(re.findall(r"^  (/\S*):$", text, re.M))


run(globals())
