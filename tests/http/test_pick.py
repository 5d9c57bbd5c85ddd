"""Picking: what lies under a pixel agrees with the layers and the camera of the image, sub-pixels included."""
import json
import math
import os
import pathlib
import struct
import subprocess
import tempfile

from harness import FAKE, REAL, VIEW, WALL, Daemon, eventually, run

PICK = VIEW.replace("/view", "/pick")
WIDTH, HEIGHT = 160, 120
CAMERAS = ["eye=3,0.2,1&target=0,0,1&fov=50",
           "eye=2,-1.5,2.5&target=0,0.3,0.8&fx=140&fy=150&cx=70.25&cy=66.5&method=points",
           "eye=1.5,0.4,1&target=0,0,1&up=0,1,0.2&lod=0&margin=0.5"]


def project(camera, point):
    ray = [p - e for p, e in zip(point, camera["eye"])]
    c = [sum(camera["rotation"][3 * row + i] * ray[i] for i in range(3)) for row in range(3)]
    return camera["fx"] * c[0] / c[2] + camera["cx"], camera["fy"] * c[1] / c[2] + camera["cy"], c[2]


def layer(d, camera, name, count, kind="f"):
    body = d.ask(f"{VIEW}?{camera}&width={WIDTH}&height={HEIGHT}&layer={name}&format=raw").body
    values = struct.unpack(f"<{WIDTH * HEIGHT * count}{kind}", body)
    return [values[i:i + count] for i in range(0, len(values), count)]


def a_pick_agrees_with_the_layers_and_the_camera(d):
    hits = 0
    for camera in CAMERAS:
        depth, ranges, normal = (layer(d, camera, name, n) for name, n in
                                 (("depth", 1), ("range", 1), ("normal", 3)))
        color, ids = layer(d, camera, "color", 4, "B"), layer(d, camera, "id", 1, "I")
        for row, column in [(r, c) for r in (3, 31, 60, 88) for c in (10, 47, 80, 121, 159)]:
            reply = d.ask(f"{PICK}?{camera}&width={WIDTH}&height={HEIGHT}&x={column + 0.5}&y={row + 0.5}")
            got, at = reply.json(), row * WIDTH + column
            if math.isnan(depth[at][0]):
                assert {got[k] for k in ("depth", "distance", "class", "splat", "color", "attributes")} == {None}, got
                assert got["position"] is None and got["normal"] is None
                continue
            hits += 1
            used = json.loads(reply.headers["Splatd-Camera"])
            assert (used["width"], used["height"]) == (WIDTH, HEIGHT)
            x, y, z = project(used, got["position"])
            assert abs(x - column - 0.5) < 0.01 and abs(y - row - 0.5) < 0.01, (x, y, got)
            assert abs(z - got["depth"]) < 1e-6
            assert abs(got["depth"] - depth[at][0]) < 0.005, (got, depth[at])
            assert abs(got["distance"] - ranges[at][0]) < 0.005
            assert abs(math.dist(got["position"], used["eye"]) - got["distance"]) < 0.001
            assert math.dist(got["normal"], normal[at]) < 0.05 and abs(math.hypot(*got["normal"]) - 1) < 1e-3
            assert max(abs(a - b) for a, b in zip(got["color"], color[at])) <= 2, (got, color[at])
            assert got["splat"] == ids[at][0] and got["class"] == 0
            assert got["attributes"].keys() == {"class", "uncertainty"} and got["attributes"]["class"] == 0, got
            assert got["attributes"]["uncertainty"] >= 0
            assert got["primitive"] == "splat" and got["plane"] is None, got
            # the wall is x = 0.2 sin y, splats have a radius of 5 cm
            assert abs(got["position"][0] - 0.2 * math.sin(got["position"][1])) < 0.05, got
    assert hits > 25, hits


def parts_of_pixels_count(d):
    found = [d.ask(f"{PICK}?eye=3,0,1&target=0,0,1&fov=50&width={WIDTH}&height={HEIGHT}&x={80 + i / 8}&y=60").json()
             for i in range(9)]
    across = [row["position"][1] for row in found]
    assert across == sorted(across) and len(set(across)) == 9, across
    step = 2 * 3 * math.tan(math.radians(25)) / HEIGHT / 8
    assert all(abs(b - a - step) < step / 4 for a, b in zip(across, across[1:])), (across, step)


def picks_are_views_of_one_pixel(d):
    path = f"{PICK}?x=640.5&y=360.5"
    first = d.ask(path)
    assert first.status == 200 and first.headers["Content-Type"] == "application/json"
    assert first.headers["Splatd-Cache"] == "miss" and d.ask(path).headers["Splatd-Cache"] == "hit"
    assert d.ask(path, headers={"If-None-Match": first.headers["ETag"]}).status == 304
    head = d.ask(path, "HEAD")
    assert head.status == 200 and head.headers["ETag"] == first.headers["ETag"]
    version = d.ask("/v1/datasets/wall").json()["version"]
    assert "immutable" in d.ask(f"{path}&v={version}").headers["Cache-Control"]
    assert d.ask(f"{path}&v={'0' * 16}").status == 404
    assert d.ask(f"{path}&near=0.01").headers["ETag"] != first.headers["ETag"]
    for other in ("x=640.25&y=360.5", "x=640.5&y=360.25", "x=640.5&y=360.5&width=1281", "x=640.5&y=360.5&far=90"):
        assert d.ask(f"{PICK}?{other}", "HEAD").headers["ETag"] != first.headers["ETag"], other
    # a pick and the view of one pixel that it renders are no one reply
    assert d.ask(VIEW + "?width=1&height=1", "HEAD").headers["ETag"] != d.ask(
        f"{PICK}?x=0.5&y=0.5&width=1&height=1", "HEAD").headers["ETag"]
    for x, y in ((0, 0), (1280, 720)):  # edges belong to the image
        assert d.ask(f"{PICK}?x={x}&y={y}").status == 200


def every_pixel_of_primitives(d, where, view, count):
    """Layer primitive, with the picks at `count` places of it."""
    camera = f"eye={','.join(map(str, view['eye']))}&target={','.join(map(str, view['target']))}&fov={view['fov']}"
    look = f"{camera}&width={WIDTH}&height={HEIGHT}"
    seen = struct.unpack(f"<{WIDTH * HEIGHT}I", d.ask(f"{where}/view?{look}&layer=primitive&format=raw").body)
    names, picked = ["none", "splat", "line", "panel", "mesh"], []
    for at in range(37, WIDTH * HEIGHT, WIDTH * HEIGHT // count):
        pick = d.ask(f"{where}/pick?{look}&x={at % WIDTH + 0.5}&y={at // WIDTH + 0.5}").json()
        assert (pick["primitive"] or "none") == names[seen[at]], (pick, seen[at])
        assert (pick["plane"] is not None) == (pick["primitive"] == "panel"), pick
        picked.append(pick)
    return seen, picked


def test_picks_say_which_primitive_and_plane():
    """A courtyard as panels and splats: what a pick says is what the layer shows, and it lies on the plane that it names."""
    splatd = os.environ["SPLATD_BINARY"]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([splatd, "synth", "courtyard", "--points", "40000", "--format", "ptx", "-o", folder], check=True,
                       stdout=subprocess.DEVNULL)
        subprocess.run([splatd, "pack", f"{folder}/courtyard.ptx", "--primitives", "all", "--no-panoramas", "-o",
                        f"{folder}/yard.spld"], check=True, stdout=subprocess.DEVNULL)
        with Daemon(REAL, datasets=[f"{folder}/yard.spld", WALL]) as d:
            where = "/v1/datasets/yard"
            view = d.ask(where).json()["default_view"]
            seen, picked = every_pixel_of_primitives(d, where, view, 60)
            assert seen.count(3) > len(seen) // 4 and seen.count(1) > 20, [seen.count(i) for i in range(5)]
            planes = [p for p in picked if p["plane"]]
            assert len(planes) > 10
            offs = []
            for pick in planes:
                plane = pick["plane"]
                assert abs(math.hypot(*plane["normal"]) - 1) < 1e-5
                assert pick["normal"] in (plane["normal"], [-n for n in plane["normal"]]), pick
                assert 0 <= plane["error_mean"] <= plane["error_most"] < 0.1 and plane["points"] > 0, plane
                offs.append(abs(sum((a - b) * n for a, b, n in zip(pick["position"], plane["point"], plane["normal"]))))
            # beside splats depths blend
            assert sorted(offs)[len(offs) // 2] < 0.001 and max(offs) < 0.2, sorted(offs)
            headers = d.ask(f"{where}/view?width=32&height=24").headers
            drawn = {kind: int(headers[f"Splatd-{kind}"]) for kind in ("Splats", "Panels", "Meshes", "Lines")}
            assert drawn["Panels"] > 20 and drawn["Splats"] > 0, drawn
            asked = f"{where}/view?width=32&height=24&layer=primitive"
            assert d.ask(f"{asked}&primitives=off").headers["ETag"] != d.ask(asked).headers["ETag"]
            told = d.ask(where).json()["primitives"]
            assert told["panels"] > 0 and told["panel_points"] > 20000 and told["methods"] == ["splat", "nearest"], told
            plain = "/v1/datasets/wall/view?width=8&height=8"  # where there are none, it makes no other reply
            assert d.ask(f"{plain}&primitives=off").headers["ETag"] == d.ask(plain).headers["ETag"]
            # a pick looks at the splats alone, asked in either way
            alone = d.ask(f"{where}/pick?x=640&y=360&primitives=off").json()
            posted = d.post({"x": 640, "y": 360, "primitives": "off"}, f"{where}/pick").json()
            assert alone == posted and alone["primitive"] != "panel" and alone["plane"] is None, (alone, posted)


def test_a_views_url_is_one_of_a_pick():
    with Daemon(FAKE) as d:
        sent = {"background": "white", "transparent": False, "format": "png", "quality": 80, "chroma": 444, "depth_scale": 100}
        plain = d.ask(f"{PICK}?x=1&y=1")
        same = d.ask(f"{PICK}?x=1&y=1&" + "&".join(f"{name}={value}".lower() for name, value in sent.items()))
        assert same.status == 200 and same.body == plain.body and same.headers["ETag"] == plain.headers["ETag"], same.body
        assert d.ask(f"{PICK}?x=1&y=1&BackgroundColor=red&TransparentBackground=true").body == plain.body
        assert d.post({"x": 1, "y": 1, **sent}, PICK).json() == plain.json()
        assert d.post({"x": 1, "y": 1, "quality": 0}, PICK).json()["field"] == "quality"


def test_bad_picks_are_refused_by_name():
    with Daemon(FAKE) as d:
        for query, field in [("", "x"), ("x=1", "y"), ("y=1", "x"), ("x=-0.1&y=1", "x"), ("x=1&y=721", "y"),
                             ("x=nan&y=1", "x"),
                             ("x=1&y=inf", "y"), ("x=1,2&y=1", "x"), ("x=&y=1", "x"), ("x=1&x=1&y=1", "x"),
                             ("x=1&y=1&width=0", "width"), ("x=65&y=1&width=64", "x"), ("x=1&y=1&format=gif", "format"), ("x=1&y=1&quality=0", "quality"),
                             ("x=1&y=1&layer=depth", "layer"), ("x=1&y=1&supersample=2", "supersample"),
                             ("x=1&y=1&budget=5ms", "budget"), ("x=1&y=1&colour=5", "colour"), ("x=1&y=1&v=1", "v"),
                             ("x=1&y=1&margin=-1", "margin"), ("x=1&y=1&lod=nan", "lod"),
                             ("x=1&y=1&matrix=1", "matrix")]:
            reply = d.ask(f"{PICK}?{query}")
            assert reply.status == 400 and reply.json()["field"] == field, (query, reply.body)
        assert d.ask(VIEW + "?x=1").json()["field"] == "x"
        assert d.ask(PICK, "DELETE").status == 405
        for body, field in [("", "x"), ("{", "body"), ("[1]", "body"), ({}, "x"), ({"x": 1}, "y"), ({"x": "1", "y": 1}, "x"),
                            ({"x": 1, "y": 721}, "y"), ({"x": 1, "y": 1, "eye": [1, 2, 3]}, "eye"),
                            ({"x": 1, "y": 1, "camera": {"eye": [1, 2]}}, "eye"), ({"x": 1, "y": 1, "layer": "depth"}, "layer"),
                            ({"x": 1, "y": 1, "camera": {"x": 1}}, "x"), ({"x": 1, "y": 1, "camera": 5}, "camera"),
                            ({"x": 1, "y": 1, "budget": 5}, "budget"), ('{"x": 1, "x": 2, "y": 1}', "body"),
                            ({"x": 9, "y": 1, "camera": {"width": 8}}, "x")]:
            reply = d.post(body, PICK)
            assert reply.status == 400 and reply.json()["field"] == field, (body, reply.body)
        assert d.post({"x": 1, "y": 1}, PICK + "?x=1").status == 400
        assert d.status()["counters"]["frames"] == 0


def test_a_pick_waits_in_the_queue_like_a_view():
    with Daemon(FAKE, SPLATD_INJECT_LOSS_AFTER="1x2") as d:
        assert d.ask(f"{PICK}?x=1&y=1").json()["depth"] == d.ask(f"{PICK}?x=1&y=1").json()["depth"] > 100
        lost = d.ask(f"{PICK}?x=2&y=1")
        assert lost.status == 503 and lost.json()["type"] == "urn:splatd:error:device-lost"
        eventually(lambda: d.ops("/readyz").status == 200)
        assert d.post({"x": 3, "y": 1}, PICK).status == 200
        assert d.post({"x": 4, "y": 1}, PICK).status == 503


def every_parameter_of_a_pick(d):
    reply = d.ask(f"{PICK}?x=32&y=24&eye=3,0,1&target=0,0,1&up=0,0,1&fx=60&fy=60&cx=32&cy=24&width=64&height=48&"
                  "near=0.1&far=50&method=splat&lod=1&margin=1")
    assert abs(reply.json()["depth"] - 3) < 0.02, reply.body
    assert abs(d.ask(f"{PICK}?x=32&y=24&eye=3,0,1&target=0,0,1&fov=60&width=64&height=48").json()["depth"] - 3) < 0.02


def a_body_means_what_a_query_means(d):
    assert d.post({"x": 640.5, "y": 360.5}, PICK).json() == d.ask(f"{PICK}?x=640.5&y=360.5").json()
    asked = d.ask(f"{PICK}?x=32&y=24&eye=3,0,1&target=0,0,1&up=0,0,1&fx=60&width=64&height=48&near=0.1&far=50&lod=2&margin=0.5&"
                  "method=points")
    version = d.ask("/v1/datasets/wall").json()["version"]
    rest = {"x": 32, "y": 24, "method": "points", "lod": 2, "margin": 0.5, "near": 0.1, "far": 50, "v": version}
    fill = {"method": "fill", "visibility": "none", "kernel": 9, "threshold": 0.3, "pyramid": 4}
    query = "&".join(f"{name}={value}" for name, value in fill.items())
    filled = d.ask(f"{PICK}?x=32&y=24&eye=3,0,1&target=0,0,1&fov=60&width=64&height=48&{query}")
    assert abs(filled.json()["depth"] - 3) < 0.05, filled.body
    assert d.post({"x": 32, "y": 24, "width": 64, "height": 48, **fill, "camera": {
        "eye": [3, 0, 1], "target": [0, 0, 1], "fov": 60}}, PICK).json() == filled.json()
    posted = d.post({**rest, "width": 64, "height": 48, "camera": {"eye": [3, 0, 1], "target": [0, 0, 1], "up": [0, 0, 1],
                                                                  "fx": 60}}, PICK)
    assert posted.json() == asked.json() and asked.json()["depth"], (asked.body, posted.body)
    assert posted.headers["Splatd-Camera"] == asked.headers["Splatd-Camera"] and posted.headers["Splatd-Cache"] == "hit"
    assert posted.headers["ETag"] is None
    axes = [0, 0, -1, 3, 1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0, 1]  # the same camera as a matrix, and as COLMAP writes it
    camera = {"matrix": axes, "convention": "opencv", "fx": 60, "fy": 60, "cx": 32, "cy": 24, "width": 64, "height": 48}
    for form in (camera, {"q": [0.5, 0.5, 0.5, -0.5], "t": [0, 1, 3], "model": "PINHOLE", "params": [60, 60, 32, 24],
                          "width": 64, "height": 48}):
        found = d.post({**rest, "camera": form}, PICK)
        assert found.status == 200, found.body
        assert math.dist(found.json()["position"], asked.json()["position"]) < 1e-6, (form, found.body, asked.body)
    inside = {"eye": [3, 0, 1], "target": [0, 0, 1], "fov": 50, "near": 0.1, "far": 50}  # of the camera, not beside it
    assert d.post({"x": 9, "y": 9, "camera": inside}, PICK).json() == d.ask(
        f"{PICK}?x=9&y=9&eye=3,0,1&target=0,0,1&fov=50&near=0.1&far=50").json()
    assert d.post({**rest, "v": "0" * 16}, PICK).status == 404


def test_on_a_real_device():
    with Daemon(REAL) as d:
        for check in (a_pick_agrees_with_the_layers_and_the_camera,
                      parts_of_pixels_count,
                      picks_are_views_of_one_pixel,
                      every_parameter_of_a_pick,
                      a_body_means_what_a_query_means):
            check(d)


def test_bare_points():
    """Method points has no normals of them: a pick says null, a view says why; a budget takes what has them."""
    with tempfile.TemporaryDirectory() as folder:
        cloud, bare = pathlib.Path(folder, "cloud.xyz"), pathlib.Path(folder, "bare.spld")
        cloud.write_text("".join(f"0 {0.02 * (i % 100) - 1} {0.02 * (i // 100)}\n" for i in range(10000)))
        subprocess.run([REAL, "pack", cloud, "--points-only", "-o", bare], check=True, stderr=subprocess.DEVNULL)
        with Daemon(REAL, datasets=(bare,)) as d:
            at = "/v1/datasets/bare"
            assert d.ask(at).json()["methods"] == ["points", "fill"]
            assert d.ask(at).json()["color"] == [{"source": "cloud.xyz", "from": "constant", "points": 10000}]
            camera = "eye=3,0,1&target=0,0,1&fov=30&width=64&height=48"
            points = d.ask(f"{at}/pick?{camera}&x=32&y=24&method=points").json()
            assert points["normal"] is None, points
            fill = d.ask(f"{at}/pick?{camera}&x=32&y=24").json()
            assert abs(fill["depth"] - 3) < 0.05, fill
            assert d.ask(f"{at}/view?{camera}&layer=normal&method=points").json()["field"] == "layer"
            assert d.ask(f"{at}/view?{camera}&layer=normal&method=points", method="HEAD").status == 400  # nothing is rendered for it
            assert d.ask(f"{at}/view?{camera}&layer=normal&budget=1ms").status == 200
            tags = {d.ask(f"{at}/view?{camera}&{extra}").headers["ETag"] for extra in ("", "kernel=9", "visibility=none")}
            assert len(tags) == 3, tags
            for what in ("view?", "view?layer=depth&", "view?clip=z<1&", "pick?x=32&y=24&", "tiles/0/0/0.png?"):  # one picture, one tag
                own = "" if "tiles" in what else camera
                replies = [d.ask(f"{at}/{what}{own}&method={method}{more}") for method, more in (
                    ("splat", ""), ("nearest", ""), ("fill", ""), ("splat", "&margin=1.5"))]
                assert len({reply.headers["ETag"] for reply in replies}) == len({reply.body for reply in replies}) == 1, what
                assert all(reply.headers["Splatd-Cache"] == "hit" for reply in replies[1:]), what
            for demand in ("budget=1s", "psnr=90", "budget=1s&method=splat", "budget=1s&method=nearest&lod=2", "budget=1s&supersample=2"):
                reply = d.ask(f"{at}/view?{camera}&{demand}&format=raw")
                chosen = dict(part.split("=") for part in reply.headers["Splatd-Chosen"].split("; "))
                assert chosen["method"] in ("fill", "points"), (demand, chosen)
                assert ("method=" not in demand) or chosen["method"] == "fill", (demand, chosen)
                drawn = d.ask(f"{at}/view?{camera}&format=raw&method={chosen['method']}&lod={chosen['lod']}&supersample={chosen['supersample']}")
                assert drawn.body == reply.body, (demand, chosen)


run(globals())
