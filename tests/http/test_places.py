"""Longitude and latitude: views, picks, tours, bounds and single points in coordinate systems that PROJ knows, held against
Snyder's formulas of the Lambert conic, and what is refused."""
import concurrent.futures
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from harness import FAKE, MAPPED, REAL, VIEW, WALL, Daemon, Hold, eventually, npy, run

if os.environ["SPLATD_PROJ"] != "1":
    print("skipped: built without PROJ")
    sys.exit(77)

DATASET = VIEW.replace("/view", "")
FOOT = 1200 / 3937
SMALL = "width=64&height=48"
STATIONS = f"/v1/datasets/{pathlib.Path(MAPPED).stem}/stations"


def conic(longitude, latitude):
    """EPSG:2263, New York Long Island in US survey feet: degrees of NAD83 to east, north (Snyder, p. 107)."""
    a, flattening = 6378137, 1 / 298.257222101
    e = math.sqrt(2 * flattening - flattening ** 2)
    first, second, origin, meridian = (math.radians(x) for x in (41 + 2 / 60, 40 + 40 / 60, 40 + 10 / 60, -74))
    m = lambda p: math.cos(p) / math.sqrt(1 - (e * math.sin(p)) ** 2)
    t = lambda p: math.tan(math.pi / 4 - p / 2) / ((1 - e * math.sin(p)) / (1 + e * math.sin(p))) ** (e / 2)
    n = (math.log(m(first)) - math.log(m(second))) / (math.log(t(first)) - math.log(t(second)))
    scale = m(first) / (n * t(first) ** n)
    rho, rho0 = (a * scale * t(p) ** n for p in (math.radians(latitude), origin))
    theta = n * (math.radians(longitude) - meridian)
    return (300000 + rho * math.sin(theta)) / FOOT, (rho0 - rho * math.cos(theta)) / FOOT


def place(d, **params):
    return d.ask(f"{DATASET}/place?" + "&".join(f"{k}={v}" for k, v in params.items()))


def text(vector):
    return ",".join(map(repr, vector))


def lonlat(d, world):
    return place(d, crs="EPSG:4326", world=text(world)).json()["position"]


def camera_of(reply):
    assert reply.status == 200, reply.body
    return json.loads(reply.headers["Splatd-Camera"])


def refused(reply, status, field, *words):
    assert reply.status == status, (reply.status, reply.body)
    problem = reply.json()
    assert problem.get("field") == field and all(word in problem["detail"] for word in words), problem


def make(folder, unit, crs, name="wall"):
    path = pathlib.Path(folder) / f"{name}.spld"
    subprocess.run([os.environ["SPLATD_MAKE_WALL"], f"--unit={unit}", f"--crs={crs}", path], check=True)
    return str(path)


def test_a_point_lies_where_the_formulas_say():
    with Daemon(REAL) as d:
        for longitude, latitude in ((-74, 40.7), (-77.5195, 40.1124), (-71.9, 41.3)):
            found = place(d, crs="EPSG:4326", position=f"{longitude},{latitude},10").json()
            east, north = conic(longitude, latitude)
            assert math.dist(found["world"][:2], (east, north)) < 1e-4, (found, east, north)
            assert abs(found["world"][2] - 10 / FOOT) < 1e-9 and found["unit"] == "us-ft"
            assert found["crs"] == "EPSG:4326" and found["position"] == [longitude, latitude, 10]
            back = place(d, crs="OGC:CRS84", world=text(found["world"])).json()
            assert math.dist(back["position"], found["position"]) < 1e-9, back
        own = place(d, crs="epsg:2263", position="3,0.2,1").json()
        assert math.dist(own["world"], (3, 0.2, 1)) < 1e-12 and own["accuracy_m"] == 0, own
        # a projected system in metres: heights are metres too
        assert abs(place(d, crs="EPSG:32618", position="500000,4400000,12").json()["world"][2] - 12 / FOOT) < 1e-9


def test_a_view_by_longitude_and_latitude_is_the_one_by_coordinates():
    with Daemon(REAL) as d:
        eye, target = lonlat(d, (3, 0.2, 1)), lonlat(d, (0, 0, 1))
        asked = f"{VIEW}?{SMALL}&fov=50&crs=EPSG:4326&eye={text(eye)}&target={text(target)}"
        first = d.ask(asked)
        used = camera_of(first)
        assert math.dist(used["eye"], (3, 0.2, 1)) < 1e-6, used
        world = place(d, crs="EPSG:4326", position=text(eye)).json()["world"]
        middle = place(d, crs="EPSG:4326", position=text(target)).json()["world"]
        same = d.ask(f"{VIEW}?{SMALL}&fov=50&eye={text(world)}&target={text(middle)}")
        assert same.headers["ETag"] == first.headers["ETag"] and same.headers["Splatd-Cache"] == "hit"
        assert same.body == first.body
        for posted in ({"camera": {"eye": eye, "target": target, "fov": 50, "crs": "EPSG:4326"}},
                       {"camera": {"eye": eye, "target": target, "fov": 50}, "crs": "EPSG:4326"}):
            reply = d.ask(VIEW, "POST", json.dumps({**posted, "width": 64, "height": 48}),
                          {"Content-Type": "application/json"})
            assert reply.body == first.body and camera_of(reply) == used
        rays = [d.ask(f"{DATASET}/rays?{where}", "POST", json.dumps({"directions": [[0, 0, 1], [0.1, 0, 1]], "format": "json", **body}), kind)
                for where, body, kind in (("", {"camera": {"eye": world, "target": middle}}, {"Content-Type": "application/json"}),
                                          ("", {"camera": {"eye": eye, "target": target}, "crs": "EPSG:4326"}, {"Content-Type": "application/json"}),
                                          ("", {"camera": {"eye": eye, "target": target, "crs": "EPSG:4326"}}, {"Content-Type": "application/json"}))]
        rays.append(d.ask(f"{DATASET}/rays?crs=EPSG:4326&eye={text(eye)}&target={text(target)}&format=json", "POST", npy([(0, 0, 1), (0.1, 0, 1)]),
                          {"Content-Type": "application/x-npy"}))
        assert rays[0].json()[0] and all(camera_of(one) == camera_of(rays[0]) for one in rays[1:])
        assert len({one.body for one in rays[:3]}) == 1 and abs(rays[3].json()[0] - rays[0].json()[0]) < 1e-6
        # what is left out is the default view's, in the world
        only = camera_of(d.ask(f"{VIEW}?{SMALL}&crs=EPSG:4326&target={text(target)}"))
        assert only["eye"] == d.ask(DATASET).json()["default_view"]["eye"]
        views = d.ask(f"{DATASET}/views", "POST", json.dumps(
            {"crs": "EPSG:4326", "width": 64, "height": 48,
             "views": [{"camera": {"eye": eye, "target": target, "fov": 50}},
                       {"camera": {"eye": [3, 0.2, 1], "target": [0, 0, 1], "crs": "EPSG:2263"}}]}),
            {"Content-Type": "application/json"})
        assert views.status == 200 and first.body in views.body and views.headers["Splatd-Failed"] == "0"


def test_a_pick_answers_in_what_it_was_asked_in():
    with Daemon(REAL) as d:
        eye, target = lonlat(d, (3, 0.2, 1)), lonlat(d, (0, 0, 1))
        camera = f"{SMALL}&x=32.5&y=24.5&eye={text(eye)}&target={text(target)}"
        found = d.ask(f"{DATASET}/pick?{camera}&crs=EPSG:4326")
        plain = d.ask(f"{DATASET}/pick?{SMALL}&x=32.5&y=24.5&eye=3,0.2,1&target=0,0,1").json()
        got = found.json()
        assert got["crs"] == "EPSG:4326" and "crs" not in plain and "world" not in plain
        assert math.dist(got["world"], plain["position"]) < 1e-5, (got, plain)
        assert math.dist(got["position"], lonlat(d, got["world"])) < 1e-12
        assert abs(got["depth"] - plain["depth"]) < 1e-5 and got["unit"] == "us-ft"
        posted = d.ask(f"{DATASET}/pick", "POST", json.dumps(
            {"x": 32.5, "y": 24.5, "width": 64, "height": 48, "crs": "EPSG:4326", "camera": {"eye": eye, "target": target}}),
            {"Content-Type": "application/json"})
        assert posted.json() == got
        inside = d.ask(f"{DATASET}/pick", "POST", json.dumps(
            {"x": 32.5, "y": 24.5, "width": 64, "height": 48,
             "camera": {"eye": eye, "target": target, "crs": "EPSG:4326"}}), {"Content-Type": "application/json"})
        assert inside.json() == got
        # one image, two answers: neither is kept for the other
        other = d.ask(f"{DATASET}/pick?{SMALL}&x=32.5&y=24.5&crs=EPSG:32618")
        default = d.ask(f"{DATASET}/pick?{SMALL}&x=32.5&y=24.5")
        assert other.headers["ETag"] != default.headers["ETag"]
        assert other.json()["world"] == default.json()["position"] != other.json()["position"]
        nothing = d.ask(f"{DATASET}/pick?{SMALL}&x=0&y=0&crs=EPSG:4326&target={text(target)}&fov=170").json()
        assert nothing["position"] is None and nothing["world"] is None


def test_bounds_and_the_default_view():
    with Daemon(REAL) as d:
        world, told = d.ask(DATASET).json(), d.ask(f"{DATASET}?crs=EPSG:4326").json()
        assert world["crs"] == told["crs"] == "EPSG:2263" and told["bounds_crs"] == "EPSG:4326"
        assert "bounds_crs" not in world and "crs" not in world["default_view"]
        low, high = told["bounds"]["min"], told["bounds"]["max"]
        for corner in ((x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)):
            at = lonlat(d, [world["bounds"][("min", "max")[c]][i] for i, c in enumerate(corner)])
            assert all(a - 1e-12 <= x <= b + 1e-12 for a, x, b in zip(low, at, high)), (low, at, high)
        assert high[0] - low[0] < 3e-5 and high[1] - low[1] < 3e-5
        view = told["default_view"]
        used = camera_of(d.ask(f"{VIEW}?{SMALL}&crs=EPSG:4326&eye={text(view['eye'])}&target={text(view['target'])}"))
        assert view["crs"] == "EPSG:4326" and math.dist(used["eye"], world["default_view"]["eye"]) < 1e-6
        assert "crs" in d.ask("/v1/datasets").json()["datasets"][0]


def test_stations_in_another_system():
    with Daemon(FAKE, datasets=[MAPPED]) as d:
        told = d.ask(f"{STATIONS}?crs=EPSG:4326").json()
        [station] = told["stations"]
        assert told["crs"] == "EPSG:4326" and station["world"] == [2, 0, 1], told
        assert math.dist(conic(*station["position"][:2]), station["world"][:2]) < 1e-4, station
        refused(d.ask(f"{STATIONS}?crs=EPSG:999999"), 400, "crs", "EPSG:999999")


def test_what_is_wrong_is_said():
    with Daemon(REAL) as d:
        position = f"{DATASET}/place?position=-74,40.7,0"
        for crs in ("4326", "EPSG:", "EPSG:0", "EPSG:04326", "EPSG:4326+5703", "EPSG:4326%0A", "EPSG:1234567", "+proj=utm",
                    "urn:ogc:def:crs:EPSG::4326", "/etc/passwd", "@/etc/passwd", "+init=epsg:4326", "EPSG:4326,", "",
                    "GEOGCS[%22x%22]", "EPSG:-4326", "%F0%9F%8C%8D"):
            refused(d.ask(f"{position}&crs={crs}"), 400, "crs")
        refused(d.ask(f"{position}&crs=EPSG:999999"), 400, "crs", "EPSG:999999", "PROJ knows")
        refused(d.ask(f"{position}&crs=EPSG:5703"), 400, "crs", "no geographic or projected")  # heights
        refused(d.ask(f"{position}&crs=EPSG:4978"), 400, "crs", "no geographic or projected")  # from the earth's middle
        refused(d.ask(position), 400, "crs", "missing")
        refused(d.ask(f"{DATASET}/place?crs=EPSG:4326"), 400, "position")
        refused(d.ask(f"{position}&world=1,2,3&crs=EPSG:4326"), 400, "position")
        refused(d.ask(f"{DATASET}?crs=EPSG:4326&world=1,2,3"), 400, "world")
        refused(d.ask(f"{DATASET}/place?crs=EPSG:4326&world=1e9,2,3"), 400, "world", "from the dataset")
        refused(d.ask(f"{DATASET}?eye=1,2,3"), 400, "eye")
        refused(d.ask(f"{VIEW}?world=1,2,3"), 400, "world")
        refused(d.ask(f"{DATASET}/place", "POST", "{}", {"Content-Type": "application/json"}), 405, None)
        # latitude first, the other side of the earth, beyond a pole
        refused(d.ask(f"{VIEW}?crs=EPSG:4326&eye=40.7,-74,10&target=40.7,-74.1,0"), 400, "eye", "40.7,-74,10", "longitude")
        refused(d.ask(f"{VIEW}?crs=EPSG:4326&eye=-74,40.7,10&target=10,50,0"), 400, "target", "10,50,0", "km")
        refused(d.ask(f"{VIEW}?crs=EPSG:4326&eye=-74,140.7,10&target=-74,40,0"), 400, "eye", "140.7")
        refused(d.ask(f"{VIEW}?crs=EPSG:4326&eye=-74,40.7,1e300&target=-74,40,0"), 400, "eye")
        pose = {"camera": {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "convention": "opencv",
                           "crs": "EPSG:4326"}}
        refused(d.ask(VIEW, "POST", json.dumps(pose), {"Content-Type": "application/json"}), 400, "crs", "matrix")
        two = {"crs": "EPSG:4326", "camera": {"crs": "EPSG:4326"}}
        refused(d.ask(VIEW, "POST", json.dumps(two), {"Content-Type": "application/json"}), 400, "crs", "twice")
        batch = {"views": [{}, {"camera": {"eye": [1, 2, 3], "crs": "EPSG:999999"}}]}
        refused(d.ask(f"{DATASET}/views", "POST", json.dumps(batch), {"Content-Type": "application/json"}), 400, "views[1].camera.crs")
        # a request that names very many gets as many as one may make, and the service goes on
        many = {"views": [{"camera": {"eye": [500000, 4.4e6, 3]}, "crs": f"EPSG:{32601 + i}"} for i in range(50)]}
        assert d.ask(f"{DATASET}/views", "POST", json.dumps(many), {"Content-Type": "application/json"}).status in (400, 503)
        assert d.ask(f"{VIEW}?{SMALL}").status == 200


DERIVED = ('PROJCRS["site",BASEGEOGCRS["WGS 84",DATUM["WGS 84",ELLIPSOID["WGS 84",6378137,298.257223563]]],CONVERSION["c",'
           'METHOD["{}"],PARAMETER["{}",{}]],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]]')


def test_what_a_dataset_does_not_say_is_not_guessed():
    bad = ["PROJCS[\"x\",EXTENSION[\"PROJ4\",\"+proj=utm +zone=1\"]]", "+proj=utm +zone=18", "/etc/passwd", "EPSG:2263+x",
           "GEOGCS[\"@/etc/passwd\"]", "BOUNDCRS[x,PARAMETERFILE[\"a\",\"/etc/passwd\"]]", "GEOGCS[\"x\",GRIDS]",
           "CONVERSION[METHOD[\"PROJ-based operation method: utm\"]]", "LOCAL_CS[\"site\",UNIT[\"metre\",1]]",
           "PROJCS[" * 5000, "EPSG:999999", "nonsense[",
           # methods that are PROJ's own texts: they name files, which may be a pipe that never ends
           *(DERIVED.format(method, "x", "1") for method in ("PROJ defmodel model=PIPE", "proj utm zone=10", "PROJ")),
           DERIVED.format("Proj defmodel", "model=PIPE +x", "1"), DERIVED.format("utm", "zone=10", "1")]
    with tempfile.TemporaryDirectory() as folder:
        pipe = os.path.join(folder, "pipe")
        os.mkfifo(pipe)
        bad = [crs.replace("PIPE", pipe) for crs in bad]
        paths = [make(folder, "m", crs, f"bad{i}") for i, crs in enumerate(bad)]
        paths.append(make(folder, "", "", "none"))
        with Daemon(REAL, datasets=paths) as d:
            for i in range(len(bad)):
                files = "[" in bad[i] and re.search(r"(?i)EXTENSION|@|grids|PARAMETERFILE|PROJ(?![A-Z])|=", bad[i])
                why = "extensions" if files else "own" if "[" in bad[i] else "--crs"
                refused(d.ask(f"/v1/datasets/bad{i}/view?crs=EPSG:4326"), 400, "crs", "--crs", why)
                assert d.ask(f"/v1/datasets/bad{i}").json()["crs"] == bad[i]
            refused(d.ask("/v1/datasets/none/place?crs=EPSG:4326&world=1,2,3"), 400, "crs", "--crs")
            refused(d.ask("/v1/datasets/none/view?crs=EPSG:4326&eye=1,2,3"), 400, "crs", "--crs")
            refused(d.ask("/v1/datasets/none?crs=EPSG:4326"), 400, "crs", "--crs")
            assert d.ask("/v1/datasets/none").json()["crs"] is None


def test_compound_systems_and_wkt():
    wkt = subprocess.run(["projinfo", "-q", "-o", "WKT1:GDAL", "EPSG:2263"], capture_output=True, text=True).stdout \
        if subprocess.run(["which", "projinfo"], capture_output=True).returncode == 0 else WKT
    one = " ".join(wkt.split())
    with tempfile.TemporaryDirectory() as folder:
        paths = [make(folder, unit, crs, name) for unit, crs, name in (
            ("us-ft", "EPSG:2263+EPSG:6360", "compound"), ("us-ft", "EPSG:2263+6360", "short"), ("us-ft", one, "wkt"),
            ("us-ft", f"COMPD_CS[\"both\",{one},VERT_CS[\"h\",VERT_DATUM[\"d\",2005],UNIT[\"metre\",1]]]", "both"),
            ("", "EPSG:2263", "unsaid"), ("m", "EPSG:2263", "metres"))]
        with Daemon(REAL, datasets=paths) as d:
            for name in ("compound", "short", "wkt", "both", "unsaid", "metres"):
                world = d.ask(f"/v1/datasets/{name}/place?crs=EPSG:4326&position=-74,40.7,10").json()["world"]
                assert math.dist(world[:2], conic(-74, 40.7)) < 0.002, (name, world)
                # who does not say the unit of heights has that of the system; who says one, means it
                assert abs(world[2] - (10 if name == "metres" else 10 / FOOT)) < 1e-9, (name, world)


WKT = """PROJCS["NAD83 / New York Long Island (ftUS)",GEOGCS["NAD83",DATUM["North_American_Datum_1983",
SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],
PROJECTION["Lambert_Conformal_Conic_2SP"],PARAMETER["latitude_of_origin",40.1666666666667],PARAMETER["central_meridian",-74],
PARAMETER["standard_parallel_1",41.0333333333333],PARAMETER["standard_parallel_2",40.6666666666667],
PARAMETER["false_easting",984250],PARAMETER["false_northing",0],UNIT["US survey foot",0.304800609601219],
AXIS["X",EAST],AXIS["Y",NORTH]]"""


def test_a_tour_by_longitude_and_latitude():
    with tempfile.TemporaryDirectory() as folder, Daemon(REAL, "--tours", folder) as d:
        eyes = [lonlat(d, eye) for eye in ((3, 0.2, 1), (3, 0.5, 1.2))]
        target = lonlat(d, (0, 0, 1))
        keys = [{"camera": {"eye": eye, "target": target, "fov": 50}} for eye in eyes]
        same = [{"camera": {**key["camera"], "crs": "EPSG:4326"}} for key in keys]
        settings = {"width": 64, "height": 48}
        frames = []
        for path in ({"crs": "EPSG:4326", "keyframes": keys}, {"keyframes": same}):
            made = d.ask(f"{DATASET}/tours", "POST", json.dumps({"path": path, "frames": 2, "settings": settings}),
                         {"Content-Type": "application/json"})
            assert made.status == 202, made.body
            uri = made.json()["uri"]
            eventually(lambda: d.ask(uri).json()["state"] == "done")
            frames.append([d.ask(f"{uri}/frames/{i}").body for i in range(2)])
        still = d.ask(f"{VIEW}?{SMALL}&fov=50&crs=EPSG:4326&eye={text(eyes[0])}&target={text(target)}")
        assert frames[0] == frames[1] and frames[0][0] == still.body
        for path, extra, field in (({"crs": "EPSG:999999", "keyframes": keys}, {}, "keyframes[0].crs"),
                                   ({"crs": 5, "keyframes": keys}, {}, "keyframes[0].crs"),
                                   ({"keyframes": keys}, {"crs": "EPSG:4326"}, "settings.crs"),
                                   ({"crs": "EPSG:4326", "keyframes": [{"camera": {**keys[0]["camera"], "eye": [10, 50, 1]}}]},
                                    {}, "keyframes[0].camera.eye")):
            body = json.dumps({"path": path, "frames": 2, "settings": {**settings, **extra}})
            refused(d.ask(f"{DATASET}/tours", "POST", body, {"Content-Type": "application/json"}), 400, field)


def test_the_commands_do_the_same():
    with Daemon(REAL) as d, tempfile.TemporaryDirectory() as folder:
        eye, target = text(lonlat(d, (3, 0.2, 1))), text(lonlat(d, (0, 0, 1)))
        served = d.ask(f"{VIEW}?{SMALL}&format=png&crs=EPSG:4326&eye={eye}&target={target}").body
        camera = ["--crs", "EPSG:4326", f"--eye={eye}", f"--target={target}"]
        render = [REAL, "render", WALL, "--size", "64x48", "--format", "png", "-o"]
        drawn = subprocess.run([*render, "-", *camera], capture_output=True)
        assert drawn.stdout == served, drawn.stderr
        keys = [{"camera": {"eye": [float(x) for x in eye.split(",")], "target": [float(x) for x in target.split(",")]}}]
        path = pathlib.Path(folder) / "path.json"
        path.write_text(json.dumps({"crs": "EPSG:4326", "frames": keys}))
        subprocess.run([REAL, "tour", WALL, "--path", path, "--size", "64x48", "--format", "png", "-o", f"{folder}/tour"],
                       check=True, capture_output=True)
        assert (pathlib.Path(folder) / "tour" / "000000.png").read_bytes() == served
        for wrong, said in ((["--crs", "EPSG:4326", "--eye=40,-74,1"], b"--eye 40,-74,1"), (["--crs", "+proj=utm"], b"--crs"),
                            (["--crs", "EPSG:999999"], b"EPSG:999999")):
            failed = subprocess.run([*render, f"{folder}/none.png", *wrong], capture_output=True)
            assert failed.returncode == 2 and said in failed.stderr, failed
        depth = subprocess.run([*render, "-", *camera, "--layer", "depth"], capture_output=True)
        assert b"1000 steps per us-ft," in depth.stdout


def test_looking_up_ends_with_the_deadline():
    preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
    hold = Hold("SLOW_DISK_READS", allowed=None)  # of the list of systems
    with Daemon(REAL, "--deadline", "300", datasets=[WALL, MAPPED], LD_PRELOAD=preload, **hold.environment) as d, \
            concurrent.futures.ThreadPoolExecutor(24) as many:
        hold.allow(0)
        asked = [f"{DATASET}{'/place' if i % 2 else ''}?crs=EPSG:{32601 + i}{'&world=1,2,3' if i % 2 else ''}" for i in range(48)]
        replies = list(many.map(d.ask, asked))
        statuses = [reply.status for reply in replies]
        assert set(statuses) <= {200, 400, 503} and 503 in statuses[::2] and 503 in statuses[1::2], statuses
        listed = [reply.status for reply in many.map(d.ask, [f"{STATIONS}?crs=EPSG:{32701 + i}" for i in range(24)])]
        assert set(listed) <= {200, 400, 503} and 503 in listed, listed
        tiles = [reply.status for reply in many.map(d.ask, 8 * [f"{DATASET}/tiles.json"])]
        assert set(tiles) <= {200, 503} and 503 in tiles, tiles
        assert d.ask(f"{DATASET}").status == 200
        hold.allow_all()
        eventually(lambda: place(d, crs="EPSG:32618", world="1,2,3").status == 200)


def test_without_the_list_of_systems():
    with tempfile.TemporaryDirectory() as folder, Daemon(REAL, datasets=[WALL, MAPPED], PROJ_DATA=folder, PROJ_LIB=folder) as d:
        json_type = {"Content-Type": "application/json"}
        refused(place(d, crs="EPSG:4326", world="1,2,3"), 501, "crs", "proj-data")
        refused(d.ask(f"{DATASET}?crs=EPSG:4326"), 501, "crs")
        refused(d.ask(f"{STATIONS}?crs=EPSG:4326"), 501, "crs")
        refused(d.ask(f"{VIEW}?crs=EPSG:4326"), 501, "crs")
        refused(d.ask(VIEW, "POST", '{"crs": "EPSG:4326"}', json_type), 501, "crs")
        refused(d.ask(f"{DATASET}/pick?x=1&y=1&crs=EPSG:4326"), 501, "crs")
        refused(d.ask(f"{DATASET}/pick", "POST", '{"x": 1, "y": 1, "crs": "EPSG:4326"}', json_type), 501, "crs")
        refused(d.ask(f"{DATASET}/views", "POST", '{"views": [{"crs": "EPSG:4326"}]}', json_type), 501, "views[0].crs")
        refused(d.ask(f"{DATASET}/rays", "POST", '{"directions": [[0, 0, 1]], "crs": "EPSG:4326"}', json_type), 501, "crs")
        assert d.ask(f"{VIEW}?{SMALL}").status == 200


run(globals())
