"""What is drawn, over HTTP: it comes back in a header, from every route that takes it, counts in ETags only where something
is said, goes on to views of a batch and to tours, and is refused by name where it is wrong."""
import json
import math
import os
import struct

from harness import FAKE, REAL, VIEW, Daemon, run

PICK = VIEW.replace("/view", "/pick")
NEAR = {"eye": "3,0.8,1", "target": "0,0.8,1", "fov": 40, "width": 64, "height": 48}


def clip(reply):
    return json.loads(reply.headers["Splatd-Clip"])["clip"]


def test_what_is_drawn_comes_back():
    with Daemon(REAL) as d:
        query = "width=16&height=16&clip=z%3C1.5+or+x%3E0&clip=!box:0,0,0,1,1,1,30&class=!5,7"
        first = d.ask(f"{VIEW}?{query}")
        assert first.status == 200, first.body
        assert clip(first) == ["z<1.5 or x>0", "!box:0,0,0,1,1,1,30", "!class:5,7"], first.headers
        assert clip(d.ask(f"{VIEW}?{query}", "HEAD")) == clip(first)
        again = d.post({"width": 16, "height": 16, "clip": clip(first)})
        assert again.headers["Splatd-Cache"] == "hit" and clip(again) == clip(first)
        parts = d.post({"width": 16, "height": 16, "clip": clip(first)[:2], "class": "!5,7"})
        assert parts.headers["Splatd-Cache"] == "hit" and clip(parts) == clip(first)
        pick = d.ask(f"{PICK}?x=8&y=8&{query}")
        assert pick.status == 200 and clip(pick) == clip(first)
        plain = d.ask(f"{VIEW}?width=16&height=16")
        assert plain.headers["Splatd-Clip"] is None and plain.headers["ETag"] != first.headers["ETag"]
        assert d.post({"width": 16, "height": 16, "clip": [], "class": []}).headers["Splatd-Cache"] == "hit"
        for given, shown in ((2, "class:2"), ([2, 6], "class:2 or class:6"), ("3-5", "class:3..5")):
            assert clip(d.post({"width": 8, "height": 8, "class": given})) == [shown]
        batch = d.ask(VIEW + "s", "POST", json.dumps({"width": 8, "height": 8, "clip": "z<1", "class": [0],
                                                      "views": [{}, {"clip": []}, {"clip": [], "class": []}]}))
        assert batch.status == 200 and batch.body.count(b"Splatd-Clip: ") == 2, batch.body[:2000]


def test_what_is_long_is_drawn_all_the_same():
    """Replies' headers have to fit beside the request's: what does not is left out."""
    corners = ",".join(f"{3 * math.cos(a)!r},{3 * math.sin(a)!r}" for a in (i * math.pi / 32 for i in range(64)))
    boxes = " or ".join(f"box:{-1 - math.pi / n!r},{-math.e / n!r},{-math.sqrt(n)!r},{math.pi + n!r},{math.e + n!r},{math.pi / 2 + n!r}"
                        for n in range(1, 15))
    terms = f"polygon:{corners} or {boxes}"
    with Daemon(REAL) as d:
        for body in ({"clip": terms}, {"clip": terms, "soft": terms}, {"clip": terms, "class": "!7"}):
            reply = d.post({"width": 16, "height": 16, **body})
            assert reply.status == 200 and reply.headers["Splatd-Clip"] is None, reply.headers
        lines = d.view(width=16, height=16, clip="polygon:" + corners)
        assert lines.status == 200, lines.body
        near = d.view(**NEAR, clip="polygon:-9,-9,9,-9,9,9,-9,9@1..1e9", layer="depth", format="raw")
        assert near.body == d.view(**NEAR, clip="polygon:-9,-9,9,-9,9,9,-9,9@1..9", layer="depth", format="raw").body
        for end in "1e9", "1e30":
            far = d.view(**NEAR, clip=f"box:-{end},-{end},1,{end},{end},{end}", layer="depth", format="raw")
            assert far.body == near.body, end


def test_what_is_left_out_is_not_there():
    """The wall is x = 0.2 sin y, seen from +x."""
    with Daemon(REAL) as d:
        def depths(**more):
            return struct.unpack(f"<{64 * 48}f", d.view(**NEAR, layer="depth", format="raw", **more).body)
        def count(**more):
            return sum(z == z for z in depths(**more))
        whole, half = count(), count(clip="z<1")
        assert whole > 1000 and 0.3 < half / whole < 0.7, (whole, half)
        assert abs(whole - half - count(clip="z>=1")) <= 64
        assert count(clip="!z<1") == count(clip="z>=1") and count(clip="z<1 and z>1") == 0
        assert count(**{"class": 9}) == 0 and count(**{"class": "!9"}) == whole
        assert count(clip="polygon:-1,0,1,0,1,0.8,-1,0.8") > 0
        for method in "points", "fill", "nearest":
            assert count(method=method, clip="z<-100") == 0, method
        body = {"x": 32, "y": 12, "camera": {"eye": [3, 0.8, 1], "target": [0, 0.8, 1], "fov": 40}, "width": 64, "height": 48}
        assert d.post(body, PICK).json()["position"] and d.post({**body, "clip": "z<1"}, PICK).json()["position"] is None
        assert d.post({**body, "class": "!77"}, PICK).json()["position"] and d.post({**body, "class": 77}, PICK).json()["position"] is None
        assert d.post({**body, "soft": "z<1", "soft_opacity": 0, "clip": "z<1"}, PICK).json()["position"] is None


def test_bad_ones_are_named():
    with Daemon(REAL) as d:
        for field, value, words in (
                ("clip", "polygon:0,0,1,0", "corners"), ("clip", "polygon:0,0,4,4,4,0,0,4", "meet"), ("clip", "box:0,0,0,1,0,1", "empty"),
                ("clip", "plane:0,0,0,0,0,0>0", "length"), ("clip", "colour>3", "colour"), ("clip", "z<", "number"), ("clip", "", "empty"),
                ("class", "ground", "number"), ("class", "2,,3", "number"), ("class", "2.5", "whole"), ("class", "-1", "whole"), ("class", "", "empty")):
            reply = d.ask(f"{VIEW}?width=8&height=8&{field}={value}")
            assert reply.status == 400, (value, reply.body)
            assert words in reply.json()["detail"] and reply.json()["field"] == field, (value, reply.body)
            if value:
                reply = d.post({"x": 4, "y": 4, "width": 8, "height": 8, field: value}, PICK)
                assert reply.status == 400 and words in reply.json()["detail"], (value, reply.body)
        for body in {"clip": 3}, {"clip": [3]}, {"class": ["2"]}, {"class": -1}, {"class": [-1]}, {"class": {}}:
            field = next(iter(body))
            reply = d.post({"width": 8, "height": 8, **body})
            assert reply.status == 400 and reply.json()["field"] == field, (body, reply.body)
        reply = d.ask(f"{VIEW}?width=8&height=8&class=2&class=3")
        assert reply.status == 400 and "one list" in reply.json()["detail"], reply.body
        many = "&".join(f"clip=z%3C{i}" for i in range(16))
        assert d.ask(f"{VIEW}?width=8&height=8&{many}").status == 200
        for more in "&clip=z%3C17", "&class=2":
            assert d.ask(f"{VIEW}?width=8&height=8&{many}{more}").status == 400, more


def test_what_a_dataset_lacks_is_asked_of_its_own_parameter():
    """The tree has no classes; only what asked for them is to blame."""
    tree = os.environ["SPLATD_TREE"]
    with Daemon(REAL, datasets=[tree]) as d:
        def field_of(query, path="view"):
            reply = d.ask(f"/v1/datasets/tree/{path}?width=8&height=8&{query}")
            assert reply.status == 400, (query, reply.body)
            return reply.json()["field"]
        assert field_of("class=2") == field_of("class=2&clip=z%3C1") == field_of("class=!2&x=1&y=1", "pick") == "class"
        assert field_of("clip=class:2") == field_of("clip=class:2&class=2") == field_of("clip=tint%3E2") == "clip"
        assert field_of("class=2&soft=tint%3E2") == "soft"


def test_a_pick_is_refused_like_its_image():
    """Where the cube's faces would be too large to be drawn."""
    with Daemon(REAL) as d:
        lens = "projection=equirectangular&azimuth=0,0.1,8000&elevation=0,90,8"
        for path in f"{VIEW}?{lens}&layer=range", f"{PICK}?x=1&y=1&{lens}":
            reply = d.ask(path)
            assert reply.status == 400 and reply.json()["field"] == "width", (path, reply.body)


def test_a_budget_leaves_it_alone():
    with Daemon(FAKE) as d:
        reply = d.ask(f"{VIEW}?width=16&height=16&budget=500ms&clip=z%3C1&class=0-3")
        assert reply.status == 200 and reply.headers["Splatd-Chosen"], reply.headers
        assert clip(reply) == ["z<1", "class:0..3"]


run(globals())
