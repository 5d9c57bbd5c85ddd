"""Rays over HTTP: a list of directions has the ranges that a scan's image of the same has, whatever it is sent as and in
whichever frame; lists that are broken are refused by their place; long bodies are let in by name, and few at a time."""
import io
import json
import math
import select
import struct
import time
import urllib.parse
import zipfile

from harness import REAL, VIEW, Daemon, Skipped, eventually, npy, run

RAYS = VIEW.replace("/view", "/rays")
POSE = {"eye": [3, 0.8, 1], "target": [0, 0.8, 1]}
QUERY = "eye=3,0.8,1&target=0,0.8,1"
NPY = {"Content-Type": "application/x-npy"}
DIRECTIONS = [(math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e))
              for e in (math.radians(-10 + 2 * row) for row in range(11)) for a in (math.radians(column - 20) for column in range(41))]
SCAN = f"{VIEW}?projection=equirectangular&azimuth=-20,20,41&elevation=10,-10,11&{QUERY}&layer=range&format=raw"
RESOLUTION = "resolution=57.3"  # a degree


def floats(body):
    return struct.unpack(f"<{len(body) // 4}f", body)


def same(a, b, most):
    return len(a) == len(b) and all(abs(x - y) <= most if x == x and y == y else x != x and y != y for x, y in zip(a, b))


def post(d, rows, query, **form):
    reply = d.ask(f"{RAYS}?{query}", "POST", npy(rows, **form), NPY)
    assert reply.status == 200, reply.body
    return reply


def test_a_list_has_a_scans_ranges():
    with Daemon(REAL) as d:
        scan = floats(d.ask(SCAN).body)
        assert sum(x == x for x in scan) > 150
        first = post(d, DIRECTIONS, f"{QUERY}&{RESOLUTION}&format=raw", kind="d")
        assert same(floats(first.body), scan, 1e-6) and first.headers["Splatd-Depth-Invalid"] == "NaN"
        assert "ETag" not in first.headers and first.headers["Splatd-Cache"] == "miss"
        again = post(d, DIRECTIONS, f"{QUERY}&{RESOLUTION}&format=raw", kind="d", order="True")
        assert again.body == first.body and again.headers["Splatd-Cache"] == "hit"
        body = {"camera": POSE, "directions": [[3 * x for x in row] for row in DIRECTIONS], "resolution": 57.3, "format": "json", "layer": "range", "frame": "camera"}
        listed = d.post(body, RAYS)
        assert listed.headers["Content-Type"] == "application/json" and listed.headers["Splatd-Depth-Invalid"] == "null"
        assert same([math.nan if x is None else x for x in listed.json()], scan, 1e-6)
        # x forward, y left, z up; and the world's axes, for an eye that looks along -x with its right along +y
        for frame, turned in ("sensor", [(z, -x, -y) for x, y, z in DIRECTIONS]), ("world", [(-z, x, -y) for x, y, z in DIRECTIONS]):
            other = post(d, turned, f"{QUERY}&{RESOLUTION}&frame={frame}&format=raw", kind="d")
            # other faces, other pixels: beside an edge of the wall, one sees it and the other does not
            off = sorted(abs(x - y) for x, y in zip(floats(other.body), scan) if x == x and y == y)
            assert len(off) > 150 and off[len(off) * 9 // 10] < 0.01, (frame, off[-5:])
        fine = post(d, DIRECTIONS, QUERY)
        assert b"'shape': (451,)" in fine.body[:128] and fine.headers["Content-Type"] == "application/x-npy"
        off = sorted(abs(x - y) for x, y in zip(floats(fine.body[128:]), scan) if x == x and y == y)
        assert off[len(off) * 9 // 10] < 0.01
        camera = json.loads(fine.headers["Splatd-Camera"])
        assert camera["projection"] == "rays" and camera["fx"] == 256 and camera["height"] == 451


def test_what_views_take_rays_take():
    with Daemon(REAL) as d:
        rows = DIRECTIONS[:5] * 2 + [(0, 0, -1)]
        reply = post(d, rows, QUERY + "&layers=range,color,normal,id&container=zip")
        with zipfile.ZipFile(io.BytesIO(reply.body)) as parts:
            assert [b"(11, 4)" in parts.read("color.npy")[:128], b"(11, 3)" in parts.read("normal.npy")[:128],
                    b"(11,)" in parts.read("id.npy")[:128]] == [True] * 3
            ids = struct.unpack("<11I", parts.read("id.npy")[128:])
            assert ids[:5] == ids[5:10] and ids[10] == 2 ** 32 - 1
        version = d.ask("/v1/datasets/wall").json()["version"]
        d.ask(VIEW + "s", "POST", json.dumps({"views": [{"width": 8, "height": 8}]}))
        cut = post(d, DIRECTIONS, QUERY + f"&up=0,0,1&near=0.1&far=90&method=nearest&lod=0&maps=off&primitives=off&clip=z%3C1&class=!9&supersample=2&wait=0&v={version}&format=raw")
        seen = [x == x for x in floats(cut.body)]
        assert not any(seen[:100]) and any(seen[300:]) and cut.headers["Splatd-Clip"]
        soft = post(d, DIRECTIONS, QUERY + "&soft=z%3C9&soft_opacity=0&layer=coverage&format=raw")
        assert set(floats(soft.body)) == {0.0}
        posed = d.post({"camera": {"matrix": [1, 0, 0, 3, 0, 1, 0, 0.8, 0, 0, 1, 1, 0, 0, 0, 1], "convention": "opencv"}, "directions": [[-1, 0, 0]],
                        "format": "json"}, RAYS)
        assert 2.5 < posed.json()[0] < 3.2


def in_url(value):
    return urllib.parse.quote(str(value).lower() if isinstance(value, bool) else str(value), safe=",:")


def test_settings_of_a_view_mean_the_same_in_url_and_json():
    """Each parameter that rays take, in one of a few requests; a query's numbers are its JSON's."""
    splats = {"margin": 2, "atoms": 0, "maps": "off", "primitives": "off", "up": [0, 0, 1], "near": 0.1, "far": 90, "lod": 1,
              "supersample": 1, "quality": 50, "chroma": 444, "depth_scale": 100}
    fill = {"method": "fill", "visibility": "none", "kernel": 5, "threshold": 0.3, "pyramid": 4, "clip": "z<1.8", "class": "!9"}
    soft = {"soft": "plane:0,0,1,0,0,1>0", "soft_model": "base", "soft_opacity": 0.9, "soft_cover": 0.8, "soft_blend": 0.1, "of": "first"}
    colors = {"layers": "range,color", "container": "zip", "color_by": "height", "ramp": "terrain", "range": "0..2",
              "shade": "edl", "edl_strength": 0.3, "edl_radius": 1, "background": "red", "transparent": True}
    with Daemon(REAL) as d:
        version, seen = d.ask("/v1/datasets/wall").json()["version"], []
        for settings in splats, fill, soft, colors:
            wait = settings is not fill
            query = "&".join(f"{name}={in_url(','.join(map(str, value)) if isinstance(value, list) else value)}" for name, value in settings.items())
            asked = post(d, DIRECTIONS, f"{QUERY}&{query}&v={version}&wait={int(wait)}", kind="d")
            camera = {**POSE, **{name: settings[name] for name in ("up", "near", "far") if name in settings}}
            beside = {name: value for name, value in settings.items() if name not in camera}
            posted = d.post({"camera": camera, "directions": DIRECTIONS, "v": version, "wait": wait, **beside}, RAYS)
            assert posted.body == asked.body and posted.headers["Splatd-Camera"] == asked.headers["Splatd-Camera"], settings
            seen.append(asked.body)
        assert len(set(seen)) == 4
        with zipfile.ZipFile(io.BytesIO(seen[3])) as parts:
            ranges = floats(parts.read("range.npy")[128:])
            colors = struct.iter_unpack("<4B", parts.read("color.npy")[128:])
        assert all((r != r) == (c[3] == 0) for r, c in zip(ranges, colors)) and any(r != r for r in ranges)
        for body, query in ({"near": 0.1, "far": 90}, "&near=0.1&far=90"), ({"layer": "id"}, "&layer=id"):
            assert d.post({"camera": POSE, "directions": DIRECTIONS, **body}, RAYS).body == post(d, DIRECTIONS, QUERY + query, kind="d").body


def test_poses_in_every_form_that_says_no_lens():
    forms = ({"matrix": [0, 0, -1, 3, 1, 0, 0, 0.8, 0, -1, 0, 1, 0, 0, 0, 1], "convention": "opencv"},
             {"q": [0.5, 0.5, 0.5, -0.5], "t": [-0.8, 1, 3]},
             {"gltf": {"type": "perspective", "matrix": [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 3, 0.8, 1, 1]}})
    with Daemon(REAL) as d:
        wanted = floats(post(d, DIRECTIONS, f"{QUERY}&format=raw", kind="d").body)
        for form in forms:
            got = d.post({"camera": form, "directions": DIRECTIONS, "format": "raw"}, RAYS)
            assert got.status == 200 and same(floats(got.body), wanted, 1e-5), (form, got.body[:200])
        for form, field in (({"fov": 50}, "fov"), ({"gltf": {"perspective": {"yfov": 1, "znear": 0.1}}}, "gltf.perspective.yfov"),
                            ({"ros": {"k": [50, 0, 32, 0, 50, 24, 0, 0, 1], "width": 64, "height": 48}}, "ros.k")):
            reply = d.post({"camera": {**POSE, **form}, "directions": [[0, 0, 1]]}, RAYS)
            assert reply.status == 400 and reply.json()["field"] == field, reply.body


def test_bad_ones_are_named():
    with Daemon(REAL) as d:
        def refused(body, field, words, query="", headers=NPY, status=400):
            reply = d.ask(RAYS + (f"?{query}" if query else ""), "POST", body, headers)
            assert reply.status == status and reply.json()["field"] == field and words in reply.json()["detail"], (body[:80], reply.body)
        good, plain = npy(DIRECTIONS[:3]), {"Content-Type": "application/json"}
        refused(b"", "directions", "empty")
        refused(b"NUMPY!" + good[6:], "directions", "")
        refused(npy([(0, 0, 1)] * 32769), "format", "32769", "format=json")
        refused(json.dumps({"directions": [[0, 0, 1]], "eye": [1] * 5000}), "body", "beside", headers=plain)
        for cut in 5, 20, 127, 128, 130, len(good) - 1:
            refused(good[:cut], "directions", "")
        refused(good + b"0", "directions", "need")
        for row, words in ((0, 0, 0), "directions[1] is 0, 0, 0"), ((0, math.nan, 1), "finite"), ((math.inf, 0, 1), "finite"):
            refused(npy([(0, 0, 1), row]), "directions", words)
        for rows, words in ([], "0 directions"), ([[0, 0, 1], [0, 0]], "directions[1]"), ([[0, 0, "1"]], "directions[0]"), ({}, "array"), ([[0, 0, 0]], "nowhere"):
            refused(json.dumps({"directions": rows}), "directions", words, headers=plain)
        refused("{}", "directions", "missing", headers=plain)
        refused("[]", "body", "object", headers=plain)
        refused('{"directions": [[0,0,1]], "directions": []}', "body", "", headers=plain)
        refused(json.dumps({"directions": [[0, 0, 1]], "rays": 1}), "rays", "unknown", headers=plain)
        refused(json.dumps({"directions": [[0, 0, 1]]}), "body", "beside", query="lod=1", headers=plain)
        refused(json.dumps({"directions": [[0, 0, 1]] * 32769}), "directions", "32769", headers=plain)
        refused(json.dumps({"directions": [[0.25, 0.125, 1.0625]] * 60000}), "body", "x-npy", headers=plain)
        for query, field in (("fov=50", "fov"), ("width=5", "width"), ("projection=cube", "projection"), ("azimuth=0,1,2", "azimuth"), ("frame=left", "frame"),
                             ("resolution=0.5", "resolution"), ("format=png", "format"), ("layer=depth", "layer"),
                             ("supersample=0.5", "supersample"), ("budget=50ms", "budget"), ("x=1", "x"), ("clip=q%3C", "clip"), ("directions=1", "directions")):
            refused(npy([(0, 0, 1), (1, 1, 0)]), field, "", query)
        refused(npy([(-1, -1, 1), (1, 1, 1)]), "resolution", "", "resolution=16000")
        for query, field in ("projection=rays", "projection"), ("format=json", "format"), ("frame=world", "frame"), ("resolution=9", "resolution"):
            reply = d.ask(f"{VIEW}?{query}")
            assert reply.status == 400 and reply.json()["field"] == field, reply.body
        assert d.ask(RAYS).status == 405 and d.ask(RAYS.replace("wall", "hall"), "POST", good, NPY).status == 404


def test_each_list_is_charged_once():
    with Daemon(REAL, "--rate-limit", "1") as d:
        statuses = [d.ask(f"{RAYS}?{QUERY}", "POST", npy(DIRECTIONS[:3]), NPY).status for _ in range(2)]
        assert statuses == [200, 200], statuses  # a second's and as many again, whatever a burst is


def begin(d, length, headers=""):
    connection = d.connect()
    connection.connect()
    connection.sock.sendall(f"POST {RAYS}?{QUERY} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-npy\r\n{headers}Content-Length: {length}\r\n\r\n".encode())
    return connection.sock


def test_long_lists_are_let_in():
    """More than the MiB that other bodies have, and up to a million directions; at most eight such bodies are held at a time."""
    with Daemon(REAL) as d:
        many = [DIRECTIONS[i % len(DIRECTIONS)] for i in range(100000)]
        reply = post(d, many, QUERY + "&format=raw&resolution=57.3")
        values = floats(reply.body)
        assert len(values) == len(many) and same(values[:451], values[451:902], 0)
        for length, more in ((1 << 20) * 24 + 8193, ""), ((1 << 20) * 26, "Expect: 100-continue\r\n"):
            sock = begin(d, length, more)
            if not more:
                sock.sendall(bytes(1 << 16))
            assert b" 413 " in sock.recv(4096).split(b"\r\n")[0]
            sock.close()
        held = [begin(d, 3 << 20) for _ in range(8)]
        for sock in held:
            sock.sendall(bytes(2 << 20))
        eventually(lambda: d.ask(f"{RAYS}?{QUERY}", "POST", npy(many[:1]) + bytes(2 << 20), NPY).status == 503)
        assert d.ask(f"{RAYS}?{QUERY}", "POST", npy(many[:3]), NPY).status == 200
        for sock in held:
            sock.close()
        eventually(lambda: d.ask(f"{RAYS}?{QUERY}&resolution=57.3", "POST", npy(many), NPY).status == 200)
        unread = []  # who does not read a reply holds nobody's place
        for _ in range(9):
            sock = begin(d, len(npy(many)))
            sock.sendall(npy(many))
            unread.append(sock)
            eventually(lambda: d.ask(f"{RAYS}?{QUERY}&resolution=57.3", "POST", npy(many), NPY).status == 200)
        for sock in unread:
            sock.close()
        eventually(lambda: d.ask(f"{RAYS}?{QUERY}&resolution=57.3", "POST", npy(many), NPY).status == 200)


def test_who_dawdles_keeps_no_place_of_long_lists():
    """Seven clients that send two of three MiB and fall silent or send a byte now and then, and one that goes on."""
    for _ in range(10):  # where all is not sent within 5 s, we are such clients ourselves
        if dawdle():
            return
    raise Skipped("it takes longer than 5 s to send 15 MiB")


def dawdle():
    def send(piece):
        for sock in silent[:3]:
            sock.sendall(b"\0")
        steady.sendall(piece)
    with Daemon(REAL) as d:
        one = npy(DIRECTIONS[:1])
        body, ask = npy([DIRECTIONS[0]] * 120000, "d"), lambda: d.ask(f"{RAYS}?{QUERY}", "POST", one + bytes(2 << 20), NPY)
        silent, steady = [begin(d, 3 << 20) for _ in range(7)], begin(d, len(body))
        began = time.monotonic()
        for sock in silent:
            sock.sendall(bytes(2 << 20))
        send(body[:1200000])
        eventually(lambda: ask().status == 503)
        if time.monotonic() - began > 4:
            return False
        for i in range(1200000, len(body), 100000):
            send(body[i:i + 100000])
            if ask().status == 400:  # let in, read and not liked
                break
            time.sleep(0.45)
        else:
            raise AssertionError("nobody's place was given up")
        steady.sendall(body[i + 100000:])
        assert b" 200 " in steady.recv(4096).split(b"\r\n")[0]
        told = select.select(silent, [], [], 150)[0]
        assert len(told) == 1 and b" 408 " in told[0].recv(4096).split(b"\r\n")[0], told
        for sock in silent:
            sock.close()
        assert d.status()["counters"]["slow_closed"] == 1
        return True


run(globals())
