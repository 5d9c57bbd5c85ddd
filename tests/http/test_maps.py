"""Maps of stations over HTTP: what a dataset says of them, maps=on|off in views, picks, batches and tours, what is kept under
which ETag; where stations are, and standing there; and a memory limit that has no room for them. The wall's map has other colours than its splats, and its station saw
through it from y = 0.5 on (make_wall.c)."""
import contextlib
import json
import math
import pathlib
import struct
import subprocess
import tempfile

from harness import FAKE, MAPPED, REAL, WALL, Daemon, eventually, run

NAME = pathlib.Path(MAPPED).stem
VIEW = f"/v1/datasets/{NAME}/view"
LOOK = "eye=3,0.2,1&target=0,0.2,1&up=0,0,1&fov=60&width=64&height=48"
BODY = {"camera": {"eye": [3, 0.2, 1], "target": [0, 0.2, 1], "up": [0, 0, 1], "fov": 60}}
SEEN, THROUGH = (24, 24), (42, 24)  # pixels on the wall: y < 0.5, y > 0.5


def pixels(reply):
    """Rows of (r, g, b, a)."""
    assert reply.status == 200, reply.body
    flat = list(struct.iter_unpack("4B", reply.body))
    return [flat[64 * y:64 * y + 64] for y in range(48)]


def at(rows, place):
    return rows[place[1]][place[0]]


def test_a_dataset_says_what_maps_it_has():
    with Daemon(FAKE, datasets=[MAPPED, WALL]) as d:
        maps = d.ask(f"/v1/datasets/{NAME}").json()["maps"]
        assert maps["stations"] == 1 and maps["texels"] == 6 * 256 * 256 and maps["methods"] == ["splat", "nearest"], maps
        assert maps["bytes"] / maps["texels"] < 3, maps  # ranges as many as colours: 2 bytes a texel and 0.68
        assert maps["at_once"] == 1 and maps["limit_bytes"] > maps["bytes"], maps
        assert d.ask("/v1/datasets/wall").json()["maps"] is None
        table = {p["name"]: p for p in d.ask("/v1/methods").json()["parameters"]}
        assert [name for name, p in table.items() if p["maps"]] == ["maps"]
        assert table["maps"]["enum"] == ["on", "off"] and table["maps"]["default"] == "on"


def test_maps_are_drawn_where_there_are_any():
    with Daemon(REAL, datasets=[MAPPED]) as d:
        usual, on, off = (d.ask(f"{VIEW}?{LOOK}&format=raw{more}") for more in ("", "&maps=on", "&maps=off"))
        assert usual.body == on.body and usual.headers["ETag"] == on.headers["ETag"] != off.headers["ETag"]
        drawn, plain = pixels(on), pixels(off)
        red, green, blue, _ = at(drawn, SEEN)
        assert (red > 180 and blue > 140 and green < 90) or (green > 150 and red < 80 and blue < 80), at(drawn, SEEN)
        assert 70 < at(plain, SEEN)[2] < 110, at(plain, SEEN)  # the splats' own
        assert at(drawn, THROUGH)[:3] == (0, 0, 0) != at(plain, THROUGH)[:3], (at(drawn, THROUGH), at(plain, THROUGH))
        for layer in "depth", "range", "normal", "id", "coverage", "primitive":
            one, other = (d.ask(f"{VIEW}?{LOOK}&layer={layer}&format=raw&maps={maps}") for maps in ("on", "off"))
            assert one.body != other.body and one.headers["ETag"] != other.headers["ETag"], layer
        body = {**BODY, "width": 64, "height": 48, "format": "raw", "maps": "off"}
        assert d.post(body, VIEW).body == off.body
        batch = d.post({**body, "views": [{}, {"maps": "on"}], "container": "multipart"}, VIEW + "s")
        assert batch.status == 200 and off.body in batch.body and on.body in batch.body
        nearest = [d.ask(f"{VIEW}?{LOOK}&method=nearest&format=raw&maps={maps}").body for maps in ("on", "off")]
        assert nearest[0] != nearest[1]


def test_picks_see_what_views_show():
    with Daemon(REAL, datasets=[MAPPED]) as d:
        def pick(place, maps):
            return d.ask(f"/v1/datasets/{NAME}/pick?x={place[0] + 0.5}&y={place[1] + 0.5}&{LOOK}{maps}").json()
        assert pick(SEEN, "")["splat"] == pick(SEEN, "&maps=off")["splat"] is not None
        assert pick(SEEN, "&maps=on")["color"] != pick(SEEN, "&maps=off")["color"]
        assert pick(THROUGH, "")["splat"] is None and pick(THROUGH, "&maps=off")["splat"] is not None
        body = {"x": SEEN[0] + 0.5, "y": SEEN[1] + 0.5, **BODY, "width": 64, "height": 48, "maps": "off"}
        assert d.post(body, f"/v1/datasets/{NAME}/pick").json() == pick(SEEN, "&maps=off")


def test_tours_are_drawn_with_maps_or_without():
    with tempfile.TemporaryDirectory() as folder, Daemon(REAL, "--tours", folder, datasets=[MAPPED]) as d:
        def frame(maps):
            tour = d.post({"path": {"keyframes": [BODY, BODY]}, "frames": 2,
                           "settings": {"width": 64, "height": 48, "format": "png", **maps}}, f"/v1/datasets/{NAME}/tours")
            assert tour.status == 202, tour.body
            uri = tour.json()["uri"]
            eventually(lambda: d.ask(uri).json()["state"] in ("done", "failed"), 120)
            return d.ask(f"{uri}/frames/0").body
        on, off = (d.ask(f"{VIEW}?{LOOK}&format=png&maps={maps}").body for maps in ("on", "off"))
        assert frame({}) == frame({"maps": "on"}) == on != off == frame({"maps": "off"})


def test_what_changes_nothing_makes_no_other_etag():
    with Daemon(FAKE, datasets=[MAPPED, WALL]) as d:
        def tag(name, query):
            return d.ask(f"/v1/datasets/{name}/view?{query}", "HEAD").headers["ETag"]
        for query in "", "layer=depth", "layers=color,id", "method=nearest":
            assert tag("wall", query + "&maps=off") == tag("wall", query) == tag("wall", query + "&maps=on"), query
            assert tag(NAME, query + "&maps=off") != tag(NAME, query) == tag(NAME, query + "&maps=on"), query
        assert tag(NAME, "method=points&maps=off") == tag(NAME, "method=points")


def test_what_maps_may_be():
    with Daemon(FAKE) as d:
        for value in "yes", "ON", "1", "", "true":
            reply = d.view(maps=value)
            assert reply.status == 400 and reply.json()["field"] == "maps" and "on, off" in reply.json()["detail"], value
        for value in True, 1, None, "none":
            reply = d.post({"maps": value})
            assert reply.status == 400 and reply.json()["field"] == "maps", reply.body
        assert d.ask("/v1/datasets/wall/pick?x=1&y=1&maps=no").json()["field"] == "maps"


@contextlib.contextmanager
def without_room_for_maps():
    with Daemon(REAL, datasets=[MAPPED]) as d:
        maps = d.ask(f"/v1/datasets/{NAME}").json()["maps"]["bytes"]
        d.ask(f"{VIEW}?{LOOK}")
        limit = d.status()["memory"]["device_bytes"] - maps // 2
    with Daemon(REAL, "--memory-limit", str(limit), datasets=[MAPPED]) as d:
        yield d


def test_maps_without_room_are_left_out_and_that_is_said():
    with without_room_for_maps() as d:
        for _ in range(2):
            reply = d.ask(f"{VIEW}?{LOOK}&format=raw")
            assert reply.status == 200 and reply.headers["Splatd-Complete"] == "false", reply.headers
            assert reply.headers["Splatd-Pending"] == "false" and reply.headers["Cache-Control"] == "no-store"
            assert "ETag" not in reply.headers and reply.headers["Splatd-Cache"] == "miss"
        plain = d.ask(f"{VIEW}?{LOOK}&format=raw&maps=off")
        assert plain.headers["Splatd-Complete"] == "true" and "ETag" in plain.headers
        assert 70 < at(pixels(reply), SEEN)[2] < 110, "the splats' own colours"
        assert plain.body == reply.body


def test_what_never_has_room_is_said_once_with_the_limit_that_holds_it():
    with without_room_for_maps() as d:
        eventually(lambda: any("maps of 0 of its 1 stations" in line for line in d.lines))
        d.ask(f"{VIEW}?{LOOK}&format=raw")
        maps = d.ask(f"/v1/datasets/{NAME}").json()["maps"]
        told = [line for line in d.lines if "maps of" in line]
        assert len(told) == 1 and "memory-limit" in told[0] and NAME in told[0], d.lines
        assert maps["at_once"] == 0 and f"--memory-limit {maps['limit_bytes'] >> 20}M" in told[0], (maps, told)
    with Daemon(REAL, "--memory-limit", str(maps["limit_bytes"]), datasets=[MAPPED]) as d:
        reply = d.ask(f"{VIEW}?{LOOK}&format=raw")
        assert reply.headers["Splatd-Complete"] == "true" and d.ask(f"/v1/datasets/{NAME}").json()["maps"]["at_once"] == 1
        assert not any("maps of" in line for line in d.lines), d.lines


def test_a_limit_that_is_too_little_says_what_maps_take():
    process = subprocess.run([REAL, "serve", MAPPED, "--listen", "127.0.0.1:0", "--ops-listen", "127.0.0.1:0", "--memory-limit",
                              "1M"], capture_output=True, text=True, timeout=60)
    assert process.returncode and "with the maps of all stations 2M more" in process.stderr, process.stderr


def refused(reply, field, *words):
    assert reply.status == 400 and reply.json()["field"] == field, reply.body
    assert all(word in reply.json()["detail"] for word in words), reply.body


def test_stations_are_listed_and_stood_at():
    """Of the mapped wall it is the place of its panorama; its default view looks from elsewhere."""
    here, wall = f"/v1/datasets/{NAME}", "/v1/datasets/wall"
    with tempfile.TemporaryDirectory() as folder, Daemon(FAKE, "--tours", folder, datasets=[MAPPED, WALL]) as d:
        assert d.ask(here).json()["stations"] == {"count": 1, "from": "panoramas", "uri": f"{here}/stations"}
        listed = d.ask(f"{here}/stations").json()
        [only] = listed["stations"]
        assert (listed["count"], listed["first"]) == (1, 0) and only["station"] == 0 and only["world"] == [2, 0, 1], listed
        assert only["matrix"][3::4] == [2, 0, 1, 1] and only["up"] == [0, 0, 1] and "position" not in only, only
        assert d.ask(f"{here}/stations?first=1&count=256").json()["stations"] == []
        assert d.ask(wall).json()["stations"] is None
        assert d.ask(f"{wall}/stations").json() == {"count": 0, "first": 0, "stations": []}
        for query, field in (("first=2", "first"), ("first=-1", "first"), ("count=0", "count"), ("count=257", "count"),
                             ("count=a", "count"), ("eye=1,2,3", "eye"), ("station=0", "station"), ("crs=EPSG:0", "crs")):
            refused(d.ask(f"{here}/stations?{query}"), field)
        assert d.ask("/v1/datasets/none/stations").status == 404 and d.post({}, f"{here}/stations").status == 405
        refused(d.ask(f"{here}?first=0"), "first", "crs")

        def camera(query):
            reply = d.ask(f"{VIEW}?width=64&height=48&{query}", "HEAD")
            assert reply.status == 200, reply.headers
            return json.loads(reply.headers["Splatd-Camera"]), reply.headers["ETag"]
        at, tag = camera("station=0")
        ahead = ",".join(repr(a + b) for a, b in zip(only["world"], only["forward"]))
        assert at["eye"] == [2, 0, 1] and tag == camera(f"eye=2,0,1&target={ahead}&up=0,0,1")[1]
        around, _ = camera("station=0&projection=equirectangular")
        assert around["projection"] == "equirectangular" and around["eye"] == at["eye"] and around["rotation"] == at["rotation"]
        assert camera("station=0&target=0,0,1")[1] == camera("eye=2,0,1&target=0,0,1")[1]
        small = {"width": 64, "height": 48}
        posted = d.post({"camera": {"station": 0}, **small}, VIEW)
        assert posted.status == 200 and json.loads(posted.headers["Splatd-Camera"]) == at, posted.headers
        batch = d.post({"views": [{"camera": {"station": 0}}, {"camera": {"station": 1}}], **small}, VIEW + "s")
        refused(batch, "views[1].camera.station", "has 0 to 0")
        assert d.ask(f"{here}/pick?x=32&y=24&station=0&width=64&height=48").status == 200
        assert d.post({"x": 32, "y": 24, "camera": {"station": 0}, **small}, f"{here}/pick").status == 200
        for path, field in ((f"{VIEW}?station=1", "station"), (f"{wall}/view?station=0", "station"), (f"{VIEW}?station=x", "station"),
                            (f"{VIEW}?station=0&eye=1,2,3", "station"), (f"{here}/pick?x=1&y=1&station=9", "station"),
                            (f"{here}/thumbnail.jpg?station=0", "station"), (f"{here}/tiles.json?station=0", "station")):
            refused(d.ask(path), field)
        stay, away = {"camera": {"station": 0}}, {"camera": {"station": 2}}
        tour = d.post({"path": {"keyframes": [stay, BODY]}, "frames": 2, "settings": small}, f"{here}/tours")
        assert tour.status == 202, tour.body
        refused(d.post({"path": {"keyframes": [stay, away]}, "frames": 2}, f"{here}/tours"), "keyframes[1].camera.station")


def test_rays_and_commands_begin_at_a_station():
    with Daemon(REAL, datasets=[MAPPED]) as d:
        told = d.post({"directions": [[-1, 0, 0], [0, 0, 1]], "frame": "world", "format": "json", "layer": "range", "maps": "off",
                       "camera": {"station": 0}}, f"/v1/datasets/{NAME}/rays")
        assert told.status == 200 and abs(told.json()[0] - 2) < 0.02 and told.json()[1] is None, told.body
        list_ = b"\x93NUMPY\x01\x00\x3c\x00" + b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3)}".ljust(59) + b"\n"
        plain = d.ask(f"/v1/datasets/{NAME}/rays?station=0&frame=world&maps=off&format=raw", "POST",
                      list_ + struct.pack("<3f", -1, 0, 0), {"Content-Type": "application/x-npy"})
        assert plain.status == 200 and abs(struct.unpack("<f", plain.body)[0] - 2) < 0.02, plain.body
        drawn = d.ask(f"{VIEW}?station=0&target=0,0,1&width=64&height=48&format=png").body
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "out.png")

        def render(*more):
            return subprocess.run([REAL, "render", MAPPED, "--size", "64x48", "-o", out, *more], capture_output=True, text=True,
                                  timeout=120)
        assert render("--station", "0", "--target", "0,0,1").returncode == 0 and out.read_bytes() == drawn
        for more, word in ((("--station", "1"), "has 0 to 0"), (("--station", "-1"), "--station"), (("--station", "1.5"), "--station"),
                           (("--station", "0", "--eye", "1,2,3"), "exclude")):
            done = render(*more)
            assert done.returncode == 2 and word in done.stderr, done


def write_wall(path):
    """A PTX of one station 3 m before a wall of waves, to the side of which nothing came back."""
    lines = ["120", "90", "0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1"]
    for column in range(120):
        for row in range(90):
            turn, rise = (column - 60) / 120, (row - 45) / 120
            y, z = 3 * math.tan(turn), 3 * math.tan(rise) / math.cos(turn)
            wave = int(128 + 100 * math.sin(7 * y))
            lines.append(f"3 {y:.5f} {z:.5f} 0.5 {wave} {255 - wave} 90" if y < 1 else "0 0 0 0 0 0 0")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_maps_go_with_primitives():
    with tempfile.TemporaryDirectory() as folder:
        scan, packed = (pathlib.Path(folder) / name for name in ("flat.ptx", "flat.spld"))
        write_wall(scan)
        subprocess.run([REAL, "pack", scan, "--primitives", "all", "--panoramas", "scan", "-o", packed], check=True,
                       capture_output=True, timeout=120)
        look = "eye=0,0.4,0&target=3,0.4,0&up=0,0,1&fov=60&width=64&height=48&format=raw"
        with Daemon(REAL, datasets=[packed]) as d:
            about = d.ask("/v1/datasets/flat").json()
            assert about["maps"]["stations"] == 1 and about["stations"]["from"] == "scan", about
            [station] = d.ask(about["stations"]["uri"]).json()["stations"]
            assert station["world"] == [0, 0, 0] and station["forward"] == [1, 0, 0], station
            seen = {}
            for primitives in "all", "off":
                for method in "splat", "nearest":
                    views = [d.ask(f"/v1/datasets/flat/view?{look}&method={method}&primitives={primitives}&maps={maps}")
                             for maps in ("on", "off")]
                    assert all(v.status == 200 and v.headers["Splatd-Complete"] == "true" for v in views), views[0].body
                    assert views[0].body != views[1].body and views[0].headers["ETag"] != views[1].headers["ETag"]
                    seen[method, primitives] = pixels(views[0])
            shapes = d.ask(f"/v1/datasets/flat/view?{look}&layer=primitive").body
            assert 3 in shapes, "panels are drawn"
            for method in "splat", "nearest":  # the map's colours, whatever the wall is drawn as
                one, other = seen[method, "all"], seen[method, "off"]
                off = [max(abs(a - b) for a, b in zip(one[y][x], other[y][x])) for y in range(8, 40) for x in range(8, 40)]
                assert sum(o > 12 for o in off) < len(off) / 20, (method, sorted(off)[-60:])


run(globals())
