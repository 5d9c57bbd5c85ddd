"""Collections that lie on a server, their tiles beside them: pictures and picks have the bytes that they have from disk, a
tile is asked for when a view needs it and not before, and whatever befalls one is told by its name, stops nothing else and
is over once it is mended."""
import base64
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import threading
import time

from harness import PATIENT, REAL, SANITIZED, Daemon, eventually, fresh, patiently, run, together
from range_server import File, Server
from tiles import SIDE, VIEW, make, splatd, write_tile

if os.environ.get("SPLATD_REMOTE") == "0":
    print("skipped: built without servers")
    raise SystemExit(77)

for name in list(os.environ):  # of whoever runs this; nothing leaves this machine
    if name.lower().endswith("_proxy") or name.startswith("AWS_"):
        del os.environ[name]

SECRET = "hush-5e3c7"
ACCOUNT = ("AKIDEXAMPLE", SECRET, "eu-central-1")
TILES = 3
ALL = "eye=40,-30,60&target=40,40,0"
IN = [f"eye={x},{y},12&target={x},{y + 1},0" for x, y in ((20, 20), (60, 20), (20, 60))]  # of a tile each
AFAR = "eye=40,-900,600&target=40,40,0&lod=30"  # coarse levels do


def make_once():
    """A collection of three tiles, the second of them of some megabytes, and the same under another name."""
    top = pathlib.Path(tempfile.mkdtemp())
    make(top, (0.5, 0.08, 0.5), whole=False)
    shutil.copy(top / "city/city.spld", top / "city/town.spld")
    return top


TOP = make_once()
NAMES = ["city", *(f"tile-{k}" for k in range(TILES))]
DATA = {name: (TOP / f"city/{name}.spld").read_bytes() for name in NAMES}
assert len(DATA["tile-1"]) > 1.2 * 2**20 > 2**20 > len(DATA["tile-0"])


def files(folder="", **more):
    """Server's files; `more`: a File for a name with _ for -."""
    return {f"/{folder}{name}.spld": more.get(name.replace("-", "_")) or File(data) for name, data in DATA.items()}


def slots(daemon):
    return {slot["id"]: slot for slot in daemon.ask("/v1/datasets").json()["datasets"]}


def opened(daemon):
    eventually(lambda: all(slot["state"] != "loading" for slot in slots(daemon).values()))
    return slots(daemon)


def view(daemon, where, dataset="city"):
    return daemon.ask(fresh(f"/v1/datasets/{dataset}/view?{VIEW if 'format' not in where else VIEW[:-11]}&{where}"))


def good(daemon, where, dataset="city"):
    reply = view(daemon, where, dataset)
    assert reply.status == 200 and reply.headers["Splatd-Complete"] == "true", reply.body
    return reply.body


def on_disk():
    """What views and picks are from disk."""
    with Daemon(REAL, datasets=[TOP / "city/town.spld"]) as d:
        picks = [pick(d, "town", where, x, y) for where in IN for x, y in ((80, 60), (30, 100))]
        return [good(d, where, "town") for where in (*IN, ALL, AFAR)], picks, good(d, ALL + "&layer=id&format=npy", "town")


def pick(daemon, dataset, where, x, y):
    reply = daemon.ask(f"/v1/datasets/{dataset}/pick?{VIEW.replace('&format=png', '')}&{where}&lod=0&x={x}&y={y}")
    assert reply.status == 200, reply.body
    return reply.json()


TRUTH, PICKS, IDS = on_disk()
assert {p["tile"] for p in PICKS} == {f"tile-{k}.spld" for k in range(TILES)}


def test_where_a_server_sends_on_to():
    """Within its own origin, or where it has sent the collection itself; credentials go to no other host."""
    login = f"me:{SECRET}"
    with Server(files()) as other, Server(files("deep/")) as server:
        server.files.update(files())
        away = {f"/{name}.spld": other.url(f"{name}.spld") for name in NAMES}
        server.moved["/tile-1.spld"] = "/deep/tile-1.spld"
        with Daemon(REAL, "--watch", "0", datasets=[server.url("city.spld", user=login)]) as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3]
            assert {authorization is not None for _, _, authorization in server.asked} == {True}
        for elsewhere in (away["/tile-1.spld"], away["/tile-1.spld"].replace("http:", ""), away["/tile-1.spld"].replace("127.0.0.1", "localhost"),
                          f"http://127.0.0.1:{server.port}@127.0.0.1:{other.port}/tile-1.spld"):
            server.moved["/tile-1.spld"] = elsewhere
            with Daemon(REAL, "--watch", "0", datasets=[server.url("city.spld", user=login)]) as d:
                opened(d)
                expect_coarse(d, elsewhere, "its server sends it on to another host")
                assert good(d, IN[0]) == TRUTH[0] and not other.asked and not other.connections, other.asked
        server.moved.update(away)
        with Daemon(REAL, "--watch", "0", datasets=[server.url("city.spld", user=login)]) as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3]
            assert len(other.asked) >= 4 and not any(authorization for _, _, authorization in other.asked), other.asked


def other_tile():
    """Another dataset of the tile's name."""
    with tempfile.TemporaryDirectory() as folder:
        splatd("pack", write_tile(pathlib.Path(folder, "a.ply"), SIDE, 0, 77), "-o", pathlib.Path(folder, "tile-1.spld"))
        return pathlib.Path(folder, "tile-1.spld").read_bytes()


OTHER = other_tile()


def counts(server):
    return [len(server.files[f"/{name}.spld"].requests) for name in NAMES[1:]]


def test_tiles_come_when_they_are_seen():
    with Server(files()) as server, tempfile.TemporaryDirectory() as pages:
        with Daemon(REAL, "--page-cache", pages, datasets=[server.url("city.spld")]) as d:
            now = opened(d)["city"]
            assert now["state"] == "ready" and d.ask("/v1/datasets/city").json()["tiles"] == TILES, now
            assert good(d, AFAR) == TRUTH[4] and counts(server) == [0, 0, 0]
            assert good(d, IN[0]) == TRUTH[0] and counts(server)[0] > 0 and counts(server)[1:] == [0, 0]
            assert good(d, IN[2]) == TRUTH[2] and not counts(server)[1]
            assert len(server.connections) <= 2 < len(server.asked), server.connections  # they share them
            asked = counts(server)
            part = view(d, IN[1] + "&wait=0")  # coarse, at once, and said to be so
            assert part.status == 200 and part.headers["Splatd-Complete"] == "false" and part.body != TRUTH[1], part.headers
            eventually(lambda: view(d, IN[1] + "&wait=0").headers["Splatd-Complete"] == "true")
            assert [view(d, IN[1] + more).body for more in ("&wait=0", "")] == [TRUTH[1]] * 2
            assert counts(server)[::2] == asked[::2] and 2 <= counts(server)[1] <= 4, counts(server)
            assert good(d, ALL) == TRUTH[3] and good(d, ALL + "&layer=id&format=npy") == IDS
            assert [pick(d, "city", where, x, y) for where in IN for x, y in ((80, 60), (30, 100))] == PICKS
            now = d.status()["counters"]
            assert now["page_cache_misses"] >= 1 and not now["remote_failures"], now
            assert now["remote_bytes"] < 1.2 * sum(map(len, DATA.values())), now
        before = counts(server)
        with Daemon(REAL, "--page-cache", pages, datasets=[server.url("city.spld")]) as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3]
            # whether the collection is still the same, in a few bytes; which says what its tiles are
            assert d.status()["counters"]["remote_bytes"] == 4096, d.status()["counters"]
            assert before == counts(server) and d.status()["counters"]["page_cache_hits"] >= 1


def forget(pages, blocks):
    """Drops these blocks of all files from a page cache."""
    dropped = [path for path in pathlib.Path(pages).rglob("*") if path.is_file() and path.name in {f"{block:010x}" for block in blocks}]
    assert dropped
    for path in dropped:
        path.unlink()


def test_what_the_page_cache_has_of_tiles():
    """It is theirs by the version that the collection names, whatever their server calls it."""
    with Server(files()) as server, tempfile.TemporaryDirectory() as pages:
        def daemon():
            return Daemon(REAL, "--page-cache", pages, "--watch", "0", datasets=[server.url("city.spld")])
        with daemon() as d:
            opened(d)
            server.files["/tile-1.spld"] = File(OTHER)  # nothing of it stays
            expect_coarse(d, "another", "is another one now")
            server.files["/tile-1.spld"] = File(DATA["tile-1"])
        with daemon() as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3] and good(d, IN[1]) == TRUTH[1]
        forget(pages, [1])  # of tile-1, which alone has two
        server.files["/tile-1.spld"] = File(DATA["tile-1"], etag='"2"')  # uploaded once more
        with daemon() as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3] and good(d, IN[1]) == TRUTH[1] and not reason(d)
        forget(pages, [0])
        server.files["/tile-1.spld"] = File(DATA["tile-1"], etag='"3"')
        with daemon() as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3] and not reason(d)
        del server.files["/tile-1.spld"]
        with daemon() as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3] and good(d, IN[1]) == TRUTH[1]  # all of it is here
        forget(pages, [1])
        server.files["/tile-1.spld"] = File(OTHER, etag='"4"')
        with daemon() as d:
            opened(d)
            assert good(d, IN[0]) == TRUTH[0]
            expect_coarse(d, "another that was kept", "is another one now")


def test_many_small_tiles():
    """One request each, however many there are, and many at a time."""
    side, n = 4, 72
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for k in range(n):
            splatd("pack", write_tile(folder / f"{k}.ply", SIDE * (k % 9), SIDE * (k // 9), k, side), "-o", folder / f"t-{k}.spld")
        splatd("collect", folder, "-o", folder / "city.spld")
        gate = threading.Event()
        data = {f"/{path.name}": File(path.read_bytes(), gate=gate if path.name != "city.spld" else None) for path in folder.glob("*.spld")}
        with Server(data) as server:
            with Daemon(REAL, datasets=[server.url("city.spld")]) as d:
                opened(d)
                def go_on():
                    eventually(lambda: len(server.connections) > 16)
                    gate.set()
                where = f"eye={4.5 * SIDE},{4 * SIDE},{9 * SIDE}&target={4.5 * SIDE},{4.01 * SIDE},0&lod=0"
                assert all(together(2, lambda i: go_on() or True if i else good(d, where)))
                assert [len(file.requests) for path, file in data.items() if path != "/city.spld"] == [1] * n
                assert 16 < len(server.connections) <= 33, len(server.connections)


def test_views_at_once():
    with Server(files(city=File(DATA["city"], delay_s=0.1), tile_0=File(DATA["tile-0"], delay_s=0.5))) as server:
        with Daemon(REAL, datasets=[server.url("city.spld")]) as d:
            opened(d)
            places = [0, 1, 2, 3] * 4
            for i, picture in zip(places, together(len(places), lambda i: good(d, [*IN, ALL][places[i]]))):
                assert picture == TRUTH[i]
            assert [len([r for r in server.files[f"/{name}.spld"].requests if r and r[0] == 0]) for name in NAMES[1:]] == [1, 1, 1]


def test_credentials_and_names_go_along():
    login = base64.b64encode(f"me:{SECRET}".encode()).decode()
    with Server(files("a%20b/".replace("%20", " "))) as server:
        with Daemon(REAL, "--watch", "0", datasets=[server.url("a%20b/city.spld", user=f"me:{SECRET}")]) as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3]
            asked = {path: authorization for _, path, authorization in server.asked}
            assert asked == {f"/a%20b/{name}.spld": f"Basic {login}" for name in NAMES}, asked
            assert {host for host, _, _ in server.asked} == {f"127.0.0.1:{server.port}"}
        with Daemon(REAL, "--watch", "0", datasets=[server.url(f"a%20b/city.spld?sig={SECRET}")]) as d:
            now = opened(d)["city"]
            assert now["state"] == "failed" and "behind '?'" in now["reason"] and "s3://" in now["reason"], now
            assert not [line for line in d.lines if SECRET in line] and SECRET not in json.dumps(now)
    keys = {"AWS_ACCESS_KEY_ID": ACCOUNT[0], "AWS_SECRET_ACCESS_KEY": SECRET, "AWS_REGION": ACCOUNT[2]}
    with Server({path: File(file.data, account=ACCOUNT) for path, file in files("bucket/a b/").items()}) as server:
        keys["AWS_ENDPOINT_URL"] = f"http://127.0.0.1:{server.port}"
        with Daemon(REAL, datasets=["s3://bucket/a b/city.spld"], **keys) as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3]
        out = TOP / "render.png"
        said, pictures = [], []
        for where in ("s3://bucket/a b/city.spld", TOP / "city/city.spld"):
            for command in (["info", where], ["render", where, "--eye", "40,-30,60", "--target", "40,40,0", "-o", out]):
                done = subprocess.run([REAL, *map(str, command)], capture_output=True, text=True, env={**os.environ, **keys})
                assert done.returncode == 0, done.stderr
                said.append(done.stdout)
            pictures.append(out.read_bytes())
        assert said[:2] == said[2:] and pictures[0] == pictures[1], said


class Later(File):
    """Becomes another file after so many requests."""

    def __init__(self, before, after, **then):
        self.then, self.after = {}, after
        super().__init__(before)
        self.then = then

    def __getattribute__(self, name):
        then = object.__getattribute__(self, "then")
        if name in then and len(object.__getattribute__(self, "requests")) > object.__getattribute__(self, "after"):
            return then[name]
        return object.__getattribute__(self, name)


def spoilt(data, kind):
    """Bytes of its first section of a kind are others (api/format.md, 1)."""
    row = data.index(kind, struct.unpack_from("<Q", data, 24)[0])
    at = struct.unpack_from("<Q", data, row + 8)[0] + 8
    return data[:at] + bytes(b ^ 1 for b in data[at:at + 16]) + data[at + 16:]


def reason(daemon):
    """Why tile-1 is drawn as it is from afar; nobody else has a fault."""
    faulty = slots(daemon)["city"]["faulty_tiles"]
    assert faulty["count"] == len(faulty["first"]) <= 1 and all(tile["file"] == "tile-1.spld" for tile in faulty["first"]), faulty
    return faulty["first"][0]["reason"] if faulty["count"] else ""


def expect_coarse(daemon, what, said):
    bad = view(daemon, IN[1])
    assert bad.status == 200 and bad.headers["Splatd-Complete"] == "false" and bad.headers["Splatd-Pending"] == "false", (what, bad.status, bad.body)
    assert "city: its tile tile-1.spld " in reason(daemon) and said in reason(daemon), (what, reason(daemon))
    assert "127.0.0.1" not in reason(daemon) and "http" not in reason(daemon), (what, reason(daemon))


def expect_late(daemon, what, said):
    coarse = view(daemon, IN[1])
    assert coarse.status == 200 and coarse.headers["Splatd-Complete"] == "false" and "ETag" not in coarse.headers, (what, coarse.status, coarse.body)
    assert "city: its tile tile-1.spld " in reason(daemon) and said in reason(daemon), (what, reason(daemon))
    bad = view(daemon, IN[1] + "&wait=1")  # nothing but the whole picture will do
    assert bad.status == 503 and bad.headers["Retry-After"], (what, bad.status)
    detail = bad.json()["detail"]
    assert "city: its tile tile-1.spld " in detail and said in detail, (what, detail)
    assert "127.0.0.1" not in detail and "http" not in detail, (what, detail)


def expect_fault(daemon, what, late, said):
    for _ in range(2):
        (expect_late if late else expect_coarse)(daemon, what, said)
        assert [good(daemon, IN[i]) for i in (0, 2)] == [TRUTH[0], TRUTH[2]], what


def expect_end_of_fault(server, daemon):
    server.files["/tile-1.spld"] = File(DATA["tile-1"])
    eventually(lambda: view(daemon, IN[1]).headers.get("Splatd-Complete") == "true")
    assert good(daemon, IN[1]) == TRUTH[1] and good(daemon, ALL) == TRUTH[3] and slots(daemon)["city"]["state"] == "ready"
    assert not reason(daemon)


def test_a_tile_that_is_not_what_it_should_be():
    data = DATA["tile-1"]
    faults = {  # what lies there, whether that may pass soon, and what is said
        "missing": (None, False, "answers 404 (NoSuchKey)"), "forbidden": (File(data, always=403), False, "answers 403"),
        "gone": (File(data, always=410), False, "answers 410"), "another": (File(OTHER), False, "is another one now"),
        "its neighbour": (File(DATA["tile-0"]), False, "is another one now"), "the collection": (File(DATA["city"]), False, "is another one now"),
        "cut": (File(data[:-1000]), False, "truncated"), "longer": (File(data + b"0" * 64), False, "follow the end"),
        "empty": (File(b""), False, "empty"), "text": (File(b"no dataset at all" * 9), False, "not a packed dataset"),
        "header": (File(data[:40] + b"x" + data[41:]), False, "header fails its checksum"),
        "META": (File(spoilt(data, b"META")), False, "META fails its checksum"),
        "HEAD": (File(spoilt(data, b"HEAD")), False, "HEAD 0 fails its checksum"),
        "whole": (File(data, ranges=False), False, "answers no byte ranges"), "packed": (File(data, gzip=True), False, "packs what it sends"),
        "busy": (File(data, always=503), True, "given up a"), "resets": (File(data, always="reset"), True, "given up a"),
        "PAGE": (File(spoilt(data, b"PAGE")), False, "page 0 fails its checksum, fetched twice")}
    with Server(files()) as server:
        for what, (file, late, said) in faults.items():
            server.files.pop("/tile-1.spld", None)
            if file:
                server.files["/tile-1.spld"] = file
            with Daemon(REAL, "--remote-deadline", "4000", "--watch", "0", "--cache", "0", datasets=[server.url("city.spld")]) as d:
                opened(d)
                expect_fault(d, what, late, said)
                if what in ("missing", "HEAD", "busy", "PAGE"):
                    expect_end_of_fault(server, d)


def test_a_tile_that_goes_while_it_is_read():
    data = DATA["tile-1"]
    faults = {"vanishes": (Later(data, 0, always=404), False, "answers 404"), "changes": (Later(data, 1, etag='"2"'), False, "changed while it was served"),
              "shrinks": (Later(data, 1, data=data[:1 << 20]), False, "changed while it was served"),
              "is shut": (Later(data, 0, always=403), False, "answers 403"), "is down": (Later(data, 0, always="reset"), True, "given up a")}
    with Server(files()) as server:
        for what, (file, late, said) in faults.items():
            server.files["/tile-1.spld"] = file
            with Daemon(REAL, "--remote-deadline", "4000", "--watch", "0", "--cache", "0", datasets=[server.url("city.spld")]) as d:
                opened(d)
                (expect_late if late else expect_coarse)(d, what, said)
                assert [good(d, IN[i]) for i in (0, 2)] == [TRUTH[0], TRUTH[2]], what
                expect_end_of_fault(server, d)


def test_what_passes():
    """Faults that end by themselves are in no picture."""
    data = DATA["tile-1"]
    shaky = {"tile_0": File(DATA["tile-0"], faults=[503, "reset", "cut"]), "tile_2": File(DATA["tile-2"], faults=["cut", (429, 1)]),
             "tile_1": File(data, faults=["flip", None, "cut", "reset", 500])}
    with Server(files(**shaky)) as server:
        with Daemon(REAL, "--remote-deadline", "20000", datasets=[server.url("city.spld")]) as d:
            opened(d)
            assert good(d, ALL) == TRUTH[3] and [good(d, where) for where in IN] == TRUTH[:3]
            assert not shaky["tile_0"].faults and not shaky["tile_2"].faults and not shaky["tile_1"].faults
            now = d.status()["counters"]
            assert now["remote_retries"] >= 5 and not now["remote_failures"], now


def test_a_tile_that_is_slow():
    """Whoever does not look at it is answered, what has not been read before too, and so is who takes what is there."""
    slow = File(DATA["tile-1"], gate=threading.Event())
    with Server(files(tile_1=slow)) as server:
        with Daemon(REAL, "--watch", "0", *PATIENT, "--remote-deadline", "600000", datasets=[server.url("city.spld")]) as d:
            opened(d)
            assert good(d, IN[0]) == TRUTH[0]
            part = view(d, IN[1] + "&wait=0")
            assert part.headers["Splatd-Complete"] == "false"
            time.sleep(1.5)  # by now it hangs
            assert good(d, IN[2]) == TRUTH[2] and good(d, IN[0]) == TRUTH[0] and good(d, AFAR) == TRUTH[4] and d.ops("/readyz").status == 200
            assert view(d, IN[1] + "&wait=0").headers["Splatd-Complete"] == "false"
            assert not slots(d)["city"].get("reason")
            slow.gate.set()
            eventually(lambda: view(d, IN[1] + "&wait=0").headers["Splatd-Complete"] == "true")
            assert good(d, IN[1]) == TRUTH[1]


def test_a_server_that_says_nothing_costs_a_view_no_more_than_its_tile():
    """With the deadline near a view takes the tile as it is from afar; whoever comes then does not wait for it."""
    patiently(silent_server, 6 + 20 * SANITIZED, 40, 120)


def silent_server(deadline_s):
    slow = File(DATA["tile-1"], gate=threading.Event())
    with Server(files(tile_1=slow)) as server:
        with Daemon(REAL, "--watch", "0", "--remote-deadline", "600000", "--deadline", str(1000 * deadline_s), datasets=[server.url("city.spld")]) as d:
            opened(d)
            assert good(d, IN[0]) == TRUTH[0] and good(d, IN[2]) == TRUTH[2]
            for where, least_s, most_s in ((IN[1], deadline_s / 2, deadline_s), (ALL, 0, deadline_s / 2), (IN[1], 0, deadline_s / 2)):
                began = time.monotonic()
                part = view(d, where)
                took_s = time.monotonic() - began
                assert part.status == 200 and part.headers["Splatd-Complete"] == "false", (where, part.status, part.body)
                assert part.headers["Cache-Control"] == "no-store" and "ETag" not in part.headers, part.headers
                assert least_s <= took_s < most_s, (where, took_s)
                assert "nothing of it came" in reason(d)
            whole = view(d, IN[1] + "&wait=1")
            assert whole.status == 503 and "its tile tile-1.spld cannot be read" in whole.json()["detail"], whole.body
            assert good(d, IN[0]) == TRUTH[0]
            slow.gate.set()
            eventually(lambda: view(d, IN[1]).headers.get("Splatd-Complete") == "true")
            assert good(d, IN[1]) == TRUTH[1] and good(d, ALL) == TRUTH[3] and good(d, IN[1] + "&wait=1") and not reason(d)
        slow.gate = threading.Event()
        with Daemon(REAL, "--watch", "0", "--remote-deadline", "600000", "--deadline", str(1000 * deadline_s), datasets=[server.url("city.spld")]) as d:
            opened(d)
            whole = view(d, IN[1] + "&wait=1")  # the first that needs it
            assert whole.status == 503 and "its tile tile-1.spld cannot be read" in whole.json()["detail"], whole.body
            assert good(d, IN[0] + "&wait=1") == TRUTH[0] and "nothing of it came" in reason(d)
            command = [REAL, "render", server.url("city.spld"), *(word for part in IN[1].split("&") for word in ("--" + part).split("=", 1)),
                       "-o", "-", "--format", "png"]
            done = subprocess.run(command, text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            assert done.returncode == 1 and "tile-1.spld" in done.stderr, done.stderr


def test_a_tile_that_drips_is_named():
    """Four bytes a second are not nothing, so nobody finds the tile to be late; who waited for it is told all the same."""
    patiently(dripping_server, 6 + 20 * SANITIZED, 40, 120)


def dripping_server(deadline_s):
    drips = File(DATA["tile-1"], always="drip")
    with Server(files(tile_1=drips)) as server:
        with Daemon(REAL, "--watch", "0", "--remote-deadline", "120000", "--deadline", str(1000 * deadline_s), datasets=[server.url("city.spld")]) as d:
            opened(d)
            for where in (IN[1], ALL):
                whole = view(d, where + "&wait=1")
                assert whole.status == 503 and "its tile tile-1.spld was still being read" in whole.json()["detail"], whole.body
            assert good(d, IN[0] + "&wait=1") == TRUTH[0] and not reason(d)
            coarse = view(d, IN[1])
            assert coarse.status == 200 and coarse.headers["Splatd-Complete"] == "false", (coarse.status, coarse.body)
            drips.always = None
            eventually(lambda: view(d, IN[1]).headers.get("Splatd-Complete") == "true")
            assert good(d, IN[1] + "&wait=1") == TRUTH[1]


def test_a_tour_goes_on_without_a_tile_that_does_not_come():
    """It waits, longer than a view, and then counts the frames that are not complete."""
    silent = File(DATA["tile-1"], gate=threading.Event())
    eyes = [IN[0], IN[1], IN[1], IN[2]]
    cameras = [dict(word.split("=") for word in where.split("&")) for where in eyes]
    path = {"frames": [{"camera": {name: [float(x) for x in camera[name].split(",")] for name in ("eye", "target")}} for camera in cameras]}
    body = json.dumps({"path": path, "settings": {"width": 64, "height": 48, "format": "png"}})
    with Server(files(tile_1=silent)) as server, tempfile.TemporaryDirectory() as folder:
        with Daemon(REAL, "--watch", "0", "--tours", folder, "--remote-deadline", "8000", datasets=[server.url("city.spld")]) as d:
            opened(d)
            tour = d.ask("/v1/datasets/city/tours", "POST", body).json()
            eventually(lambda: d.ask(tour["uri"]).json()["state"] in ("done", "failed"))
            tour = d.ask(tour["uri"]).json()
            assert tour["state"] == "done" and tour["incomplete_frames"] == {"count": 2, "first": [1, 2]}, tour
            silent.gate.set()
            eventually(lambda: view(d, IN[1]).headers.get("Splatd-Complete") == "true")
            again = d.ask("/v1/datasets/city/tours", "POST", body).json()
            eventually(lambda: d.ask(again["uri"]).json()["state"] in ("done", "failed"))
            again = d.ask(again["uri"]).json()
            assert again["state"] == "done" and not again["incomplete_frames"]["count"], again
            frames = [[d.ask(t["frame"].replace("{n}", str(n))).body for n in range(len(eyes))] for t in (tour, again)]
            assert [a == b for a, b in zip(*frames)] == [True, False, False, True]


def test_a_collection_of_one_tile_is_drawn_without_it():
    patiently(without_its_tile, 4, 20, 80)


def without_its_tile(deadline_s):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "tile-0.spld").write_bytes(DATA["tile-0"])
        splatd("collect", folder, "-o", folder / "city.spld")
        one = (folder / "city.spld").read_bytes()
        down = File(DATA["tile-0"], always=503)
        with Server({"/city.spld": File(one), "/tile-0.spld": down}) as server:
            with Daemon(REAL, "--watch", "0", "--deadline", str(1000 * deadline_s), datasets=[server.url("city.spld")]) as d:
                opened(d)
                coarse = view(d, IN[0])
                assert coarse.status == 200 and coarse.headers["Splatd-Complete"] == "false", (coarse.status, coarse.body)
                assert int(coarse.headers["Splatd-Splats"]) > 0  # what it is from afar
                pick = d.ask(f"/v1/datasets/city/pick?{VIEW.replace('&format=png', '')}&{IN[0]}&x=80&y=60")
                assert pick.status == 200, pick.body
                down.always = None
                eventually(lambda: view(d, IN[0]).headers.get("Splatd-Complete") == "true")


def test_a_collection_that_is_made_anew():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name in NAMES[1:]:
            (folder / f"{name}.spld").write_bytes(OTHER if name == "tile-1" else DATA[name])
        splatd("collect", folder, "-o", folder / "city.spld")
        with Server(files()) as server, Daemon(REAL, datasets=[folder / "city.spld"]) as disk:
            with Daemon(REAL, "--watch", "200", datasets=[server.url("city.spld")]) as d:
                version = opened(d)["city"]["version"]
                server.files["/tile-1.spld"] = File(OTHER, etag='"2"')
                expect_coarse(d, "another", "is another one now: make the collection anew")
                server.files["/city.spld"] = File((folder / "city.spld").read_bytes(), etag='"2"')
                eventually(lambda: view(d, IN[1]).headers.get("Splatd-Complete") == "true")  # views that meet the other tile see it
                assert slots(d)["city"]["version"] != version
                asked = server.files["/city.spld"].requests
                assert len(asked) < 6, asked
                assert good(d, IN[1]) == good(disk, IN[1]) and good(d, ALL) == good(disk, ALL)


try:
    run(globals())
finally:
    shutil.rmtree(TOP)
