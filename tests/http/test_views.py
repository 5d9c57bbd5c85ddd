"""Views by name, titles and thumbnails: what a dataset was packed with, what clients save beside it, that this lasts, and
who may. Wrong links are pages for browsers."""
import contextlib
import http.client
import json
import math
import os
import pathlib
import signal
import socket
import subprocess
import tempfile
import threading
import time

import openapi
from harness import FAKE, REAL, WALL, Daemon, Reply, eventually, npy, run

ADMIN, VIEWER = "admin-0123456789abcdef", "viewer-0123456789abcdef"
AUTH = {"Authorization": f"Bearer {ADMIN}", "Content-Type": "application/json"}
DOOR = {"eye": [3, 0, 1], "target": [0, 0, 1], "up": [0, 0, 1], "fov": 50.0}
BROWSER = {"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"}


def pack(folder, *options, name="site.spld"):
    """A floor of 20 x 10 m."""
    scan = pathlib.Path(folder, "scan.xyz")
    scan.write_text("".join(f"{x / 4} {y / 4} 0\n" for x in range(81) for y in range(41)))
    return subprocess.run([REAL, "pack", str(scan), "-o", str(pathlib.Path(folder, name)), *options], text=True,
                          capture_output=True)


@contextlib.contextmanager
def serving(*args, binary=FAKE, files=(WALL,), **kw):
    with tempfile.TemporaryDirectory() as top:
        home = pathlib.Path(top, "home")
        home.mkdir()
        for file in files:
            (home / pathlib.Path(file).name).write_bytes(pathlib.Path(file).read_bytes())
        tokens = pathlib.Path(top, "tokens")
        tokens.write_text(f"{ADMIN} view,admin,tour\n{VIEWER} view\n")
        tokens.chmod(0o600)

        @contextlib.contextmanager
        def start(also=(), **more):
            with Daemon(binary, "--watch", "30", "--tokens", str(tokens), *args, datasets=[str(home), *map(str, also)], **kw, **more) as d:
                yield d
        yield home, start


def put(d, name, view, headers=AUTH, dataset="wall"):
    body = view if isinstance(view, (str, bytes)) else json.dumps(view)
    return d.ask(f"/v1/datasets/{dataset}/views/{name}", "PUT", body, headers)


def delete(d, name, headers=AUTH):
    return d.ask(f"/v1/datasets/wall/views/{name}", "DELETE", headers=headers)


def views(d, dataset="wall"):
    return {view["name"]: view for view in d.ask(f"/v1/datasets/{dataset}", headers=AUTH).json()["views"]}


def get(d, query, dataset="wall", route="view", headers={}):
    return d.ask(f"/v1/datasets/{dataset}/{route}?{query}", headers={**AUTH, **headers})


def camera(reply):
    return json.loads(reply.headers["Splatd-Camera"])


def test_what_it_was_packed_with():
    with tempfile.TemporaryDirectory() as folder:
        made = pack(folder, "--title", "Old <site>", "--description", "A floor.\nNo more.", "--default-view",
                    "eye=10,-9,6,target=10,5,0,fov=40", "--view", "top=eye=10,5,20,target=10,5.001,0,up=0,1,0",
                    "--view", "low=target=10,5,0,eye=1e1,-9,2,fov=70")
        assert made.returncode == 0, made.stderr
        info = json.loads(subprocess.run([REAL, "info", "--json", f"{folder}/site.spld"], text=True, capture_output=True,
                                         check=True).stdout)
        assert info["title"] == "Old <site>" and [v["name"] for v in info["views"]] == ["low", "top"], info["views"]
        table = subprocess.run([REAL, "info", f"{folder}/site.spld"], text=True, capture_output=True, check=True).stdout
        assert "Old <site>" in table and "--view low" in table
        with Daemon(REAL, datasets=[f"{folder}/site.spld"]) as d:
            assert d.ask("/v1/datasets").json()["datasets"][0]["title"] == "Old <site>"
            full = d.ask("/v1/datasets/site").json()
            assert full["description"] == "A floor.\nNo more." and full["thumbnail"] == "/v1/datasets/site/thumbnail.jpg"
            assert full["default_view"]["eye"] == [10, -9, 6] and full["default_view"]["fit"] == [40, 40]
            assert [(v["name"], v["from"], v["fov"]) for v in full["views"]] == [("low", "dataset", 70), ("top", "dataset", 60)]
            named, written = d.ask("/v1/datasets/site/view?view=low"), d.ask("/v1/datasets/site/view?eye=10,-9,2&target=10,5,0&fov=70")
            assert named.status == 200 and named.body == written.body and named.headers["ETag"] == written.headers["ETag"]
            tall = d.ask("/v1/datasets/site/view?view=low&width=90&height=160")
            assert abs(camera(tall)["fx"] - 45 / math.tan(math.radians(35))) < 1e-6
            assert d.post({"view": "low"}, "/v1/datasets/site/view").body == named.body
            picked = d.ask("/v1/datasets/site/pick?view=top&x=640.5&y=360.5").json()
            assert math.dist(picked["position"], [10, 5, 0]) < 0.1, picked
            assert d.post({"view": "top", "x": 640.5, "y": 360.5}, "/v1/datasets/site/pick").json()["position"] == picked["position"]
            several = d.post({"view": "low", "views": [{"width": 16, "height": 16}], "container": "zip"}, "/v1/datasets/site/views")
            assert several.status == 200
            for wrong in ("view=door", "view=", "view=a/b", "view=low&view=low"):
                reply = d.ask(f"/v1/datasets/site/view?{wrong}")
                assert reply.status == 400 and reply.json()["field"] == "view", (wrong, reply.body)
            frame = subprocess.run([REAL, "render", f"{folder}/site.spld", "--view", "low", "-o", f"{folder}/a.jpg"])
            assert frame.returncode == 0 and pathlib.Path(folder, "a.jpg").read_bytes() == named.body
            assert subprocess.run([REAL, "render", f"{folder}/site.spld", "--view", "door", "-o", f"{folder}/a.jpg"],
                                  capture_output=True).returncode == 2


def test_a_plan_is_packed():
    with tempfile.TemporaryDirectory() as folder:
        made = pack(folder, "--view", "plan=eye=10,5,20,target=10,5,0,up=0,1,0,view_height=12")
        assert made.returncode == 0, made.stderr
        seen = [subprocess.run([REAL, "render", f"{folder}/site.spld", "--size", "64x48", "--format", "png", "-o", "-", *options], capture_output=True).stdout
                for options in (["--view", "plan"], ["--view", "plan", "--view-height", "12"], ["--view", "plan", "--fov", "60"],
                                ["--view", "plan", "--projection", "orthographic", "--view-height", "9"])]
        assert seen[0] == seen[1] and seen[0] and len(set(seen)) == 3
        made = pack(folder, "--default-view", "eye=10,5,20,target=10,5,0,up=0,1,0,view_height=12")
        assert made.returncode == 2 and "--default-view" in made.stderr, made.stderr


def test_what_is_said_wrongly():
    with tempfile.TemporaryDirectory() as folder:
        for options, word in [
            (("--default-view", "eye=1,2,3"), "target"), (("--default-view", "eye=1,2,target=0,0,0"), "--default-view"),
            (("--default-view", "eye=1,2,3,target=1,2,3"), "target"), (("--default-view", "eye=1,2,3,target=0,0,0,fov=200"), "179"),
            (("--default-view", "eye=1,2,3,target=0,0,0,eye=2,2,2"), "once"), (("--default-view", "from=1,2,3"), "eye=X,Y,Z"),
            (("--view", "eye=1,2,3,target=0,0,0"), "--view"), (("--view", "=eye=1,2,3,target=0,0,0"), "NAME"),
            (("--view", "a b=eye=1,2,3,target=0,0,0"), "name"), (("--title", "a\nb"), "title"), (("--title", "x" * 201), "200"),
        ]:
            made = pack(folder, *options)
            assert made.returncode == 2 and word in made.stderr, (options, made.stderr)
            assert not pathlib.Path(folder, "site.spld").exists()


def test_views_are_saved_and_last():
    with serving(files=(WALL,)) as (home, start):
        with start() as d:
            assert views(d) == {}
            reply = put(d, "door", DOOR)
            assert reply.status == 201 and reply.json() == {"name": "door", **DOOR, "from": "service"}, reply.body
            left = home / ".wall.views.json.4194305-7"  # by a writer that was killed; no process has such a number
            left.write_text("{")
            assert put(d, "door", {**DOOR, "fov": 55}).status == 200 and not left.exists()
            assert put(d, "door", {**DOOR, "fov": 55}).status == 200 and views(d)["door"]["fov"] == 55
            assert put(d, "a.b_c-1", {"eye": [1, 2, 3], "target": [0, 0, 0]}).status == 201
            assert list(views(d)) == ["a.b_c-1", "door"] and views(d)["a.b_c-1"]["fov"] == 60
            file = home / "wall.views.json"
            assert [v["name"] for v in json.loads(file.read_text())["views"]] == ["a.b_c-1", "door"]
            assert sorted(p.name for p in home.iterdir()) == ["wall.spld", "wall.views.json"]
            before = get(d, "view=door&width=64&height=64")
            version = d.ask("/v1/datasets/wall", headers=AUTH).json()["version"]
            kept, named = get(d, f"width=64&height=64&v={version}"), get(d, f"view=door&width=64&height=64&v={version}")
            assert "immutable" in kept.headers["Cache-Control"] and "immutable" not in named.headers["Cache-Control"]
            assert get(d, "view=door&width=64&height=64", headers={"If-None-Match": before.headers["ETag"]}).status == 304
        with start() as d:  # another process
            assert list(views(d)) == ["a.b_c-1", "door"]
            after = get(d, "view=door&width=64&height=64")
            assert after.headers["ETag"] == before.headers["ETag"]
            other = pathlib.Path(os.environ["SPLATD_WALL_2"]).read_bytes()
            (home / "new").write_bytes(other)
            (home / "new").rename(home / "wall.spld")
            eventually(lambda: d.ask("/v1/datasets/wall", headers=AUTH).json()["version"] != version)
            assert list(views(d)) == ["a.b_c-1", "door"]  # and another version
            assert delete(d, "a.b_c-1").status == 204 and list(views(d)) == ["door"]
            assert delete(d, "a.b_c-1").status == 404
            assert d.ask("/v1/datasets/wall", "DELETE", headers=AUTH).status == 204
            assert list(home.iterdir()) == []


def test_a_dataset_goes_with_its_views_or_not_at_all():
    with serving(files=(WALL,)) as (home, start):
        in_the_way = home / "wall.profile.json" / "in the way"
        with start() as d:
            assert put(d, "door", DOOR).status == 201
            in_the_way.mkdir(parents=True)
            refused = d.ask("/v1/datasets/wall", "DELETE", headers=AUTH)
            assert refused.status == 500 and str(home) not in refused.json()["detail"], refused.body
            assert list(views(d)) == ["door"] and get(d, "view=door&width=16&height=16").status == 200
            assert sorted(p.name for p in home.iterdir()) == ["wall.profile.json", "wall.spld", "wall.views.json"]
            (home / "folder.spld").mkdir()
            (home / "folder.views.json").write_text("{}")
            eventually(lambda: any(slot["id"] == "folder" for slot in d.ask("/v1/datasets", headers=AUTH).json()["datasets"]))
            assert d.ask("/v1/datasets/folder", "DELETE", headers=AUTH).status == 500
            (home / "folder.spld").rmdir()
            (home / "folder.views.json").unlink()
        with start() as d:  # another process
            assert list(views(d)) == ["door"]
            in_the_way.rmdir()
            in_the_way.parent.rmdir()
            assert d.ask("/v1/datasets/wall", "DELETE", headers=AUTH).status == 204 and list(home.iterdir()) == []


def test_a_removal_that_is_killed_is_finished():
    """What lay beside the dataset does not become the next one's."""
    def remove(d):
        with contextlib.suppress(OSError, http.client.HTTPException):
            d.ask("/v1/datasets/wall", "DELETE", headers=AUTH)
    wall = pathlib.Path(WALL).read_bytes()
    for again in "PUT", "by its operator":
        with serving(files=(WALL,)) as (home, start):
            gate = home.parent / "gate"
            slow = {"LD_PRELOAD": os.environ["SPLATD_SLOW_DISK"], "SLOW_DISK_GATE": str(gate), "SLOW_DISK_NAME": "wall.views.json"}
            with start() as d:
                assert put(d, "door", DOOR).status == 201
            gate.touch()
            with start(**slow) as d:
                gate.unlink()
                removing = threading.Thread(target=remove, args=(d,))
                removing.start()
                eventually(lambda: (home / ".removed-wall.spld").exists())
                assert sorted(p.name for p in home.iterdir()) == [".removed-wall.spld", "wall.views.json"]
                d.stop(signal.SIGKILL)
                removing.join()
            if again != "PUT":
                (home / "wall.spld").write_bytes(wall)
            with start() as d:
                if again == "PUT":
                    assert list(home.iterdir()) == []
                    assert d.ask("/v1/datasets/wall", "PUT", wall, {**AUTH, "Content-Type": "application/octet-stream"}).status == 201
                assert views(d) == {} and [p.name for p in home.iterdir()] == ["wall.spld"]


def test_what_kills_left_is_swept_at_start():
    with serving(files=(WALL,)) as (home, start):
        other = home.parent / "other"
        other.mkdir()
        for folder in home, other:
            (folder / ".wall.views.json.4194305-7").write_text("{")  # no process has such a number
            (folder / ".wall.views.json.2026-01").write_text("of somebody")
            (folder / "gone.views.json").write_text("{}")
            (folder / "gone.profile.json").write_text("{}")
            (folder / "gone.spld").write_text("no dataset")
            (folder / "gone.spld").rename(folder / ".removed-gone.spld")
            (folder / "moved.views.json").write_text("{}")  # its dataset is elsewhere for now
        if not os.geteuid():  # nobody says to us what to remove by putting a file there
            for name in "theirs.views.json", ".removed-theirs.spld":
                (other / name).write_text("")
            os.chown(other / name, 65534, 65534)
            other.chmod(0o1777)
        with start(also=[other]) as d:
            assert sorted(p.name for p in home.iterdir()) == [".wall.views.json.2026-01", "moved.views.json", "wall.spld"]
            assert {p.name for p in other.iterdir()} - {"theirs.views.json"} == {".wall.views.json.2026-01", "moved.views.json"} | (
                set() if os.geteuid() else {".removed-theirs.spld"})
            assert os.geteuid() or (other / "theirs.views.json").exists()
            (home / "gone.spld").write_text("no dataset")
            (home / "gone.spld").rename(home / ".removed-gone.spld")
            time.sleep(0.1)  # what came after it is not its own
            (home / "gone.views.json").write_text("{}")
            assert d.ask("/v1/datasets/more", "PUT", b"none", {**AUTH, "Content-Type": "application/octet-stream"}).status == 422
            assert sorted(p.name for p in home.iterdir()) == [".wall.views.json.2026-01", "gone.views.json", "moved.views.json", "wall.spld"]


def test_a_saved_view_keeps_what_it_shows():
    size = "width=64&height=48"
    shows = {"clip": ["z<1.2", "!box:0,0,0,1,1,1"], "class": "!7", "color_by": "height", "ramp": "turbo", "range": "0..2",
             "shade": "edl", "background": "white"}
    with serving(binary=REAL, files=(WALL,)) as (home, start):
        with start() as d:
            plain = get(d, f"view=door&{size}&eye=3,0,1&target=0,0,1&fov=50")
            assert plain.status == 400 and plain.json()["field"] == "view"
            put(d, "plain", DOOR)
            reply = put(d, "door", {**DOOR, "settings": shows})
            assert reply.status == 201 and reply.json() == {"name": "door", **DOOR, "settings": shows, "from": "service"}, reply.body
            assert "settings" not in views(d)["plain"] and views(d)["door"]["settings"] == shows
        with start() as d:  # another process reads the file
            named = get(d, f"view=door&{size}")
            said = "clip=z%3C1.2&clip=!box:0,0,0,1,1,1&class=!7&color_by=height&ramp=turbo&range=0..2&shade=edl&background=white"
            spelt = get(d, f"eye=3,0,1&target=0,0,1&fov=50&up=0,0,1&{size}&{said}")
            assert named.body == spelt.body and named.headers["ETag"] == spelt.headers["ETag"], (named.headers, spelt.headers)
            plain = get(d, f"view=plain&{size}")
            assert plain.body != named.body and plain.headers["Splatd-Clip"] is None
            other = get(d, f"view=door&{size}&clip=z%3C1&color_by=rgb")  # a request may say otherwise
            assert json.loads(other.headers["Splatd-Clip"])["clip"] == ["z<1", "!class:7"], other.headers
            body = {"view": "door", "width": 64, "height": 48, "clip": [], "class": []}
            assert d.ask("/v1/datasets/wall/view", "POST", json.dumps(body), AUTH).headers["Splatd-Clip"] is None
            pick = "/v1/datasets/wall/pick?x=32&y=16&width=64&height=48&view="
            assert d.ask(pick + "plain", headers=AUTH).json()["position"][2] > 1.2
            assert d.ask(pick + "door", headers=AUTH).json()["position"] is None
            rays = [d.ask("/v1/datasets/wall/rays" + where, "POST", body, {**AUTH, "Content-Type": kind}) for where, body, kind in (
                ("", '{"view": "door", "directions": [[0, 0, 1], [0, 0.5, 1]], "format": "json"}', "application/json"),
                ("?view=door&format=json", npy([(0, 0, 1), (0, 0.5, 1)]), "application/x-npy"),
                ("?view=plain&format=json", npy([(0, 0, 1)]), "application/x-npy"))]
            assert rays[0].body == rays[1].body and camera(rays[0])["eye"] == DOOR["eye"] == camera(rays[2])["eye"]
            assert json.loads(rays[1].headers["Splatd-Clip"]) == json.loads(named.headers["Splatd-Clip"])
            assert rays[0].json()[0] and rays[2].headers["Splatd-Clip"] is None
            if os.environ["SPLATD_PROJ"] == "1":  # they are of the world whatever crs says
                eye = d.ask("/v1/datasets/wall/place?crs=EPSG:4326&world=3,0,1", headers=AUTH).json()["position"]
                far = get(d, f"view=door&{size}&crs=EPSG:4326&eye={','.join(map(repr, eye))}")
                assert far.status == 200 and far.headers["Splatd-Clip"] == named.headers["Splatd-Clip"], far.body
            soft = {"soft": ["z>1", "x>9"], "soft_model": "base", "soft_opacity": 0.7, "soft_cover": 0.9, "soft_blend": 0.1, "of": "first",
                    "edl_strength": 0.25, "edl_radius": 3}
            assert put(d, "soft", {**DOOR, "settings": soft}).json()["settings"] == soft
            said = "&".join(["soft=z%3E1+or+x%3E9", *(f"{k}={v}" for k, v in soft.items() if k != "soft")])
            assert get(d, f"view=soft&{size}", headers={"If-None-Match": get(d, f"view=plain&{size}&{said}").headers["ETag"]}).status == 304
            assert delete(d, "soft").status == 204
            for settings, field in [
                ({"clip": "nonsense"}, "settings.clip"), ({"clip": "q0.5<intensity"}, "settings.clip"), ({"class": "a"}, "settings.class"),
                ({"clip": "unheard_of:2"}, "settings.clip"), ({"color_by": "unheard_of"}, "settings.color_by"), ({"width": 9}, "settings.width"),
                ({"lod": 2}, "settings.lod"), ({"nothing": 2}, "settings.nothing"), ("z<1", "settings"), ({"shade": "x"}, "settings.shade"),
                ({"clip": "z<1 or " * 200 + "z<1"}, "settings"),
            ]:
                reply = put(d, "wrong", {**DOOR, "settings": settings})
                assert reply.status == 400 and reply.json()["field"] == field, (settings, reply.body)
            assert list(views(d)) == ["door", "plain"]
        file = home / "wall.views.json"
        saved = json.loads(file.read_text())
        saved["views"][0]["settings"] = {"clip": "nonsense"}  # by hand
        file.write_text(json.dumps(saved))
        with start() as d:
            wrong = get(d, f"view=door&{size}")
            assert wrong.status == 400 and wrong.json()["field"] == "view" and "nonsense" in wrong.json()["detail"], wrong.body


def test_thumbnails_show_what_is_kept():
    with serving(binary=REAL, files=(WALL,)) as (home, start), start() as d:
        def thumbnail(query):
            return d.ask(f"/v1/datasets/wall/thumbnail.jpg?width=64{query}", headers=AUTH)
        whole, part = thumbnail(""), thumbnail("&clip=z%3C1&class=!7")
        assert whole.body != part.body and json.loads(part.headers["Splatd-Clip"])["clip"] == ["z<1", "!class:7"]
        for wrong, field in (("&clip=nonsense", "clip"), ("&class=x", "class"), ("&color_by=height", "color_by")):
            assert thumbnail(wrong).json()["field"] == field


def test_a_plan_stays_a_plan():
    """An orthographic view comes back as one, from the file too; a request that says a lens of its own has that."""
    size, above = "width=64&height=48", {"eye": [3, 0, 9], "target": [0, 0, 1], "up": [0, 0, 1]}
    with serving() as (home, start):
        with start() as d:
            plan = {**above, "projection": "orthographic", "view_height": 12.5}
            assert put(d, "plan", plan).json() == {"name": "plan", **plan, "fov": 60, "from": "service"}
            reply = put(d, "as-high", {**above, "fov": 90, "projection": "orthographic"})
            assert abs(reply.json()["view_height"] - 2 * math.dist(above["eye"], above["target"])) < 1e-9, reply.body
            assert put(d, "implied", {**above, "view_height": 2}).json()["projection"] == "orthographic"
            assert "projection" not in put(d, "pinhole", {**above, "projection": "perspective"}).json()
            down = {"eye": [3, 0, 9], "target": [3, 0, 1]}  # up as in a view that is asked for
            for height in ({"view_height": 4}, {"projection": "orthographic"}):
                assert put(d, "down", {**down, **height}).json()["up"] == [0, 1, 0]
            for wrong in (down, {**down, "view_height": 4, "up": [0, 0, 1]}):
                reply = put(d, "wrong", wrong)
                assert reply.status == 400 and reply.json()["field"] == "up", reply.body
            for wrong, field in (({"view_height": 0}, "view_height"), ({"view_height": 1e13}, "view_height"), ({"view_height": "5"}, "view_height"),
                                 ({"view_height": 5, "projection": "perspective"}, "view_height"), ({"projection": "cube"}, "projection"),
                                 ({"projection": 1}, "projection")):
                reply = put(d, "wrong", {**above, **wrong})
                assert reply.status == 400 and reply.json()["field"] == field, (wrong, reply.body)
        with start() as d:  # another process reads the file
            assert views(d)["plan"]["view_height"] == 12.5 and views(d)["plan"]["projection"] == "orthographic"
            one, other = (get(d, f"{query}&{size}").headers["ETag"] for query in ("view=down&view_height=4", "eye=3,0,9&target=3,0,1&view_height=4"))
            assert one == other
            pose = "eye=3,0,9&target=0,0,1&up=0,0,1"
            for said, spelt in (("", "view_height=12.5"), ("&view_height=3", "view_height=3"), ("&units_per_pixel=0.5", "units_per_pixel=0.5"),
                                ("&projection=orthographic", "view_height=12.5"), ("&fov=50", "fov=50"), ("&fx=50", "fx=50"),
                                ("&projection=equirectangular", "projection=equirectangular"), ("&projection=perspective", "fov=60")):
                one, other = (get(d, f"{query}&{size}").headers for query in (f"view=plan{said}", f"{pose}&{spelt}"))
                assert one["ETag"] == other["ETag"] and one["Splatd-Camera"] == other["Splatd-Camera"], (said, one["Splatd-Camera"], other["Splatd-Camera"])
            body = d.ask("/v1/datasets/wall/view", "POST", json.dumps({"view": "plan", "width": 64, "height": 48}), AUTH)
            assert camera(body)["projection"] == "orthographic" and camera(body)["fx"] == 48 / 12.5


def test_a_saved_view_hides_one_of_the_pack():
    with tempfile.TemporaryDirectory() as folder:
        assert pack(folder, "--view", "low=eye=10,-9,2,target=10,5,0").returncode == 0
        with serving(files=(f"{folder}/site.spld",)) as (home, start), start() as d:
            def low():
                return d.ask("/v1/datasets/site/views/low", "DELETE", headers=AUTH)
            refused = low()
            assert refused.status == 409 and refused.json()["field"] == "name"
            assert put(d, "low", DOOR, dataset="site").status == 200
            assert views(d, "site")["low"]["from"] == "service" and camera(get(d, "view=low", "site"))["eye"] == DOOR["eye"]
            assert low().status == 204
            assert views(d, "site")["low"]["from"] == "dataset" and camera(get(d, "view=low", "site"))["eye"] == [10, -9, 2]


def test_who_would_overwrite_no_view_does_not():
    with serving() as (home, start), start() as d:
        none = {**AUTH, "If-None-Match": "*"}
        assert put(d, "door", DOOR, {**AUTH, "If-Match": "*"}).status == 412 and views(d) == {}
        assert put(d, "door", DOOR, none).status == 201
        again = put(d, "door", {**DOOR, "fov": 20}, none)
        assert again.status == 412 and again.json()["field"] == "If-None-Match" and views(d)["door"]["fov"] == 50, again.body
        assert put(d, "door", DOOR, {**AUTH, "If-Match": '"a"'}).status == delete(d, "door", {**AUTH, "If-Match": '"a"'}).status == 412
        part = put(d, "door", DOOR, {**AUTH, "Content-Range": "bytes 0-9/10"})
        assert part.status == 400 and part.json()["field"] == "Content-Range", part.body
        assert put(d, "door", DOOR, {**AUTH, "If-Match": "*"}).status == 200 and delete(d, "door", {**AUTH, "If-Match": "*"}).status == 204


def test_who_may_and_what():
    with serving() as (home, start), start() as d:
        for headers, status in (({}, 401), ({"Authorization": f"Bearer {VIEWER}"}, 403)):
            assert put(d, "door", DOOR, headers).status == status and delete(d, "door", headers).status == status
        for name in (".a", "a%2Fb", "a%20b", "x" * 64):
            reply = put(d, name, DOOR)
            assert reply.status == 400 and reply.json()["field"] == "name", (name, reply.body)
        for view, field in [
            ({"eye": [1, 2, 3]}, "target"), ({**DOOR, "eye": [1, 2]}, "eye"), ({**DOOR, "up": [0, 0, "1"]}, "up"),
            ({**DOOR, "fov": 180}, "fov"), ({**DOOR, "fov": "50"}, "fov"), ({**DOOR, "fov": 0}, "fov"), ({**DOOR, "fov": 5e-324}, "fov"), ({**DOOR, "lod": 1}, "lod"),
            ({**DOOR, "name": "a"}, "name"), ({**DOOR, "target": DOOR["eye"]}, "target"), ({**DOOR, "up": [1, 0, 0]}, "up"),
            ({**DOOR, "eye": [1e13, 0, 0]}, "eye"), ("{", "body"), ("", "body"), ("[]", "body"),
            ('{"eye": [1,2,3], "eye": [1,2,3]}', "body"), (json.dumps([[1]] * 100), "body"),
        ]:
            reply = put(d, "door", view)
            assert reply.status == 400 and reply.json()["field"] == field, (view, reply.body)
        assert put(d, "door", b"{" + b" " * (2 << 20)).status == 413
        assert put(d, "door", DOOR, dataset="nothing").status == 404
        assert d.ask("/v1/datasets/wall/views/door", headers=AUTH).status == 405
        assert views(d) == {} and [p.name for p in home.iterdir()] == ["wall.spld"]
        for i in range(64):
            assert put(d, f"v{i}", DOOR).status == 201
        full = put(d, "v64", DOOR)
        assert full.status == 400 and full.json()["field"] == "name" and put(d, "v63", DOOR).status == 200
        (home / "wall.views.json").rename(home / "before")
        (home / "wall.views.json" / "in the way").mkdir(parents=True)
        for reply in (put(d, "v0", {**DOOR, "fov": 20}), delete(d, "v0")):
            assert reply.status == 500 and str(home) not in reply.json()["detail"], reply.body
        assert views(d)["v0"]["fov"] == 50 and not [p for p in home.iterdir() if p.name.startswith(".")]
        with socket.create_connection(("127.0.0.1", d.port), 150) as s:  # a new version is on its way
            s.sendall(f"PUT /v1/datasets/wall HTTP/1.1\r\nHost: a\r\nAuthorization: {AUTH['Authorization']}\r\n"
                      "Content-Length: 5000\r\n\r\n".encode())
            eventually(lambda: put(d, "v0", DOOR).status == 503)
            assert delete(d, "v0").status == 503
    with Daemon(FAKE) as d:  # nobody is an admin without --tokens
        assert put(d, "door", DOOR, {}).status == 403


def test_a_file_named_itself_and_a_broken_list_are_left_alone():
    with tempfile.TemporaryDirectory() as top:
        tokens = pathlib.Path(top, "tokens")
        tokens.write_text(f"{ADMIN} view,admin\n")
        tokens.chmod(0o600)
        copy = pathlib.Path(top, "wall.spld")
        copy.write_bytes(pathlib.Path(WALL).read_bytes())
        with Daemon(FAKE, "--tokens", str(tokens), datasets=[str(copy)]) as d:
            assert put(d, "door", DOOR).status == 409
    for text in ("{", '{"views": 5}', '{"views": [{"name": "a"}]}', '{"views": [' + ",".join(['{}'] * 70) + "]}"):
        with serving() as (home, start):
            (home / "wall.views.json").write_text(text)
            with start() as d:
                assert views(d) == {} and put(d, "door", DOOR).status == 409
                assert get(d, "width=16&height=16").status == 200
                d.log("wall.views.json")
            assert (home / "wall.views.json").read_text() == text
    for target in "wall.views.json", "nowhere.json":  # to itself
        with serving() as (home, start):
            (home / "wall.views.json").symlink_to(target)
            with start() as d:
                assert views(d) == {} and put(d, "door", DOOR).status == 409
                d.log("wall.views.json")
            assert (home / "wall.views.json").is_symlink() and not (home / "nowhere.json").exists()


def test_what_others_call_otherwise_is_told():
    with Daemon(FAKE) as d:
        for camera, field, ours in (({"position": [3, 0, 1], "target": [0, 0, 1]}, "position", "eye"),
                                    ({"eye": [3, 0, 1], "lookAt": [0, 0, 1]}, "lookAt", "target")):
            problem = d.post({"camera": camera}).json()
            assert problem["field"] == field and f"it is called '{ours}'" in problem["detail"], problem
        problem = d.view(eye="3,0,1", lookat="0,0,1").json()
        assert problem["field"] == "lookat" and "'target'" in problem["detail"], problem


def test_thumbnails():
    with Daemon(REAL) as d:
        path = "/v1/datasets/wall/thumbnail.jpg"
        small = d.ask(path)
        assert small.status == 200 and small.headers["Content-Type"] == "image/jpeg"
        assert camera(small)["width"] == 320 and camera(small)["height"] == 180
        assert camera(small)["eye"] == d.ask("/v1/datasets/wall").json()["default_view"]["eye"]
        tag = small.headers["ETag"]
        assert d.ask(path, headers={"If-None-Match": tag}).status == 304
        assert d.ask(path, "HEAD").headers["ETag"] == tag and d.ask(path).headers["Splatd-Cache"] == "hit"
        version = d.ask("/v1/datasets/wall").json()["version"]
        assert d.ask(f"{path}?background=ff0000").body != small.body
        large = d.ask(f"{path}?width=640&v={version}")
        assert camera(large)["width"] == 640 and "immutable" in large.headers["Cache-Control"]
        for query, field in (("width=15", "width"), ("width=1281", "width"), ("height=9", "height"), ("eye=1,2,3", "eye"),
                             ("v=5", "v")):
            reply = d.ask(f"{path}?{query}")
            assert reply.status == 400 and reply.json()["field"] == field, reply.body
        assert d.ask(f"{path}?v=0123456789abcdef").status == 404
        assert d.ask("/v1/datasets/nothing/thumbnail.jpg").status == 404
    for setting, arguments, status in (({"FAKE_ROOM_PX": "0"}, (), 507), ({"FAKE_FRAME_MS": "500000"}, ("--deadline", "100"), 503)):
        with Daemon(FAKE, *arguments, **setting) as d:
            assert d.ask(path).status == d.ask("/v1/datasets/wall/tiles/0/0/0.png").status == status


def test_the_default_view_fits_narrow_images():
    with tempfile.TemporaryDirectory() as folder:
        assert pack(folder).returncode == 0
        with Daemon(REAL, datasets=[f"{folder}/site.spld"]) as d:
            fit = d.ask("/v1/datasets/site").json()["default_view"]["fit"]
            for width, height in ((640, 360), (195, 422), (200, 200)):
                seen = camera(d.ask(f"/v1/datasets/site/view?width={width}&height={height}"))
                angles = [2 * math.degrees(math.atan(size / 2 / seen[f])) for size, f in ((width, "fx"), (height, "fy"))]
                assert all(a > b - 1e-6 for a, b in zip(angles, fit)), (angles, fit)
                assert any(abs(a - b) < 1e-6 for a, b in zip(angles, fit)), (angles, fit)


def test_wrong_links_are_pages_for_browsers():
    with Daemon(FAKE) as d:
        def browse(path, method="GET"):
            connection = d.connect()
            connection.request(method, path, headers=BROWSER)
            answer = connection.getresponse()
            reply = Reply(answer.status, answer.headers, answer.read())
            connection.close()
            openapi.check(method, path, BROWSER, None, reply)
            return reply
        for path, status, word in [
            ("/?dataset=wall", 400, b'href="/#dataset=wall"'), ("/nowhere", 404, b"nothing here"),
            ("/embed/wall?eye=1,2,3", 400, b"behind"), ("/viewer/none.js", 404, b"no such file"),
            ('/?a="<b>', 400, b"&#60;b&#62;"),
        ]:
            reply = browse(path)
            assert reply.status == status and reply.headers["Content-Type"].startswith("text/html"), (path, reply.body)
            assert word in reply.body and reply.headers["Vary"] == "Accept", reply.body
            assert reply.headers["Content-Security-Policy"].startswith("default-src 'none'")
            assert b"<b>" not in reply.body
            assert browse(path, "HEAD").status == status
            assert d.ask(path).headers["Content-Type"] == "application/problem+json"
        assert browse("/v1/datasets/none").headers["Content-Type"] == "application/problem+json"
        assert browse("/embed/none").status == 200  # the page asks for its dataset itself, and says so


run(globals())
