"""Collections over HTTP: one id, whose views are those of the same points in one dataset, to what packing them apart changes;
picks say which tile; a tile that is missing, damaged or replaced is drawn as it is from afar and told by name until it is put back
or the collection is made anew."""
import pathlib
import struct
import subprocess
import tempfile
import zlib

from harness import REAL, Daemon, eventually, run
from tiles import NEAR, SIDE, STEP, VIEW, WHOLE, make, splatd, write_tile


def pixels(png):
    """Rows of RGB of a PNG of 8 bits without interlacing."""
    at, data = 8, b""
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        if kind == b"IHDR":
            width, rows, _, color = struct.unpack(">IIBB", png[at + 8:at + 18])
        data += png[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += length + 12
    size, data = {2: 3, 6: 4}[color], zlib.decompress(data)
    before, out = bytearray(width * size), []
    for row in range(rows):
        start = row * (width * size + 1)
        how, line = data[start], bytearray(data[start + 1:start + 1 + width * size])
        for i, value in enumerate(line):
            a, b = line[i - size] if i >= size else 0, before[i]
            c = before[i - size] if i >= size else 0
            near = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            line[i] = (value + (0, a, b, (a + b) // 2, near)[how]) & 255
        before = line
        out += [line[i * size:i * size + 3] for i in range(width)]
    return out


def difference(a, b):
    """Mean over the pixels, of 255."""
    a, b = pixels(a), pixels(b)
    return sum(abs(x - y) for p, q in zip(a, b) for x, y in zip(p, q)) / (3 * len(a))


def test_a_collection_is_one_dataset():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder)
        with Daemon(REAL, datasets=[folder / "city/city.spld", folder / "whole.spld"]) as d:
            about = d.ask("/v1/datasets/city").json()
            whole = d.ask("/v1/datasets/whole").json()
            assert about["tiles"] == 4 and whole["tiles"] is None
            tiles = sum(path.stat().st_size for path in folder.glob("city/tile-*"))
            assert about["bytes"] == (folder / "city/city.spld").stat().st_size and "tile_bytes" not in whole
            assert about["tile_bytes"] == tiles == next(x["tile_bytes"] for x in d.ask("/v1/datasets").json()["datasets"] if x["id"] == "city")
            assert about["leaf_splats"] == whole["leaf_splats"] == 4 * int(SIDE / STEP)**2
            assert all(abs(a - b) < 0.1 for end in ("min", "max") for a, b in zip(about["bounds"][end], whole["bounds"][end]))
            for place in WHOLE, NEAR:
                for more in "", "&lod=3", "&method=nearest", "&supersample=2":
                    a, b = (d.ask(f"/v1/datasets/{name}/view?{VIEW}&{place}{more}") for name in ("city", "whole"))
                    assert a.status == b.status == 200 and a.headers["Splatd-Complete"] == "true"
                    assert difference(a.body, b.body) < 4, (place, more, difference(a.body, b.body))
            for x, y in ((40, 60), (120, 60), (60, 20), (110, 25)):
                a, b = (d.ask(f"/v1/datasets/{name}/pick?{VIEW.replace('&format=png', '')}&{WHOLE}&lod=0&x={x}&y={y}").json()
                        for name in ("city", "whole"))
                assert (a["position"] is None) == (b["position"] is None)
                if a["position"]:
                    assert all(abs(p - q) < 0.3 for p, q in zip(a["position"], b["position"])), (a, b)
                    tile = (a["position"][0] > SIDE) + 2 * (a["position"][1] > SIDE)
                    assert a["tile"] == f"tile-{tile}.spld" and "tile" not in b, a


def test_pages_come_and_go():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder)
        with Daemon(REAL, datasets=[folder / "city/city.spld"]) as d:
            whole = d.ask(f"/v1/datasets/city/view?{VIEW}&{WHOLE}").body
        with Daemon(REAL, "--tables", "30000", datasets=[folder / "city/city.spld"]) as d:
            for _ in range(2):
                again = d.ask(f"/v1/datasets/city/view?{VIEW}&{WHOLE}&near=0.0501")
                near = d.ask(f"/v1/datasets/city/view?{VIEW}&{NEAR}&near=0.0501")
                assert again.status == near.status == 200
            reply = d.ask(f"/v1/datasets/city/view?{VIEW}&{WHOLE}")
            assert reply.headers["Splatd-Complete"] == "false" or reply.body == whole


def faults(daemon):
    """As one dataset and the listing say it, and the metrics."""
    faulty = daemon.ask("/v1/datasets/city").json()["faulty_tiles"]
    listed = next(d for d in daemon.ask("/v1/datasets").json()["datasets"] if d["id"] == "city")
    assert listed["state"] == "ready" and listed["faulty_tiles"] == faulty
    assert f'splatd_dataset_faulty_tiles{{dataset="city"}} {faulty["count"]}\n' in daemon.ops("/metrics").body.decode()
    return {tile["file"]: tile["reason"] for tile in faulty["first"]}


def test_a_missing_tile_is_seen_from_afar():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder, whole=False)
        places = ("eye=55,10,6&target=60,20,0", "eye=25,10,6&target=10,10,0", "eye=30,30,2&target=10,10,1")
        near, *others = (f"/v1/datasets/city/view?{VIEW}&{place}" for place in places)
        with Daemon(REAL, datasets=[folder / "city/city.spld"]) as d:
            whole = {place: d.ask(place) for place in (near, *others)}
        (folder / "city/tile-1.spld").rename(folder / "aside")
        with Daemon(REAL, datasets=[folder / "city"]) as d:
            assert d.ask(f"/v1/datasets/tile-2/view?{VIEW}&{WHOLE}").status == 200
            for away in others:
                good = d.ask(away)
                assert good.headers["Splatd-Complete"] == "true" and good.body == whole[away].body, away
            assert list(faults(d)) == ["tile-1.spld"] and "there is no such file" in faults(d)["tile-1.spld"]  # found at opening
            for more in "", "&wait=0", "&lod=0", "&layer=depth&format=npy":
                bad = d.ask((near.replace("&format=png", "") if "format" in more else near) + more)
                assert bad.status == 200 and [bad.headers[f"Splatd-{h}"] for h in ("Complete", "Pending")] == ["false"] * 2, bad.headers
                assert int(bad.headers["Splatd-Splats"]) > 0 and "ETag" not in bad.headers and bad.headers["Cache-Control"] == "no-store"
            assert 0.1 < difference(d.ask(near).body, whole[near].body) < 20  # coarse, and no hole
            reason = faults(d)["tile-1.spld"]
            assert "tile-1.spld cannot be read: there is no such file" in reason and top not in reason, reason
            assert d.ask(f"/v1/datasets/city/pick?{VIEW.replace('&format=png', '')}&eye=60,10,12&target=60,11,0&x=80&y=60").json()["tile"] is None
            assert len(d.log("tile-1.spld cannot be read")) == 1 and d.status()["counters"]["tile_faults"] == 1
            (folder / "aside").rename(folder / "city/tile-1.spld")
            eventually(lambda: d.ask(near).headers["Splatd-Complete"] == "true")
            assert d.ask(near).body == whole[near].body and faults(d) == {}
            d.log("tile-1.spld can be read again")


def test_files_of_tiles_are_looked_for():
    """At opening and with each look at the folder, so that no view has to meet one that is gone."""
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder, whole=False)
        with Daemon(REAL, datasets=[folder / "city"]) as d:
            assert faults(d) == {}
            (folder / "city/tile-2.spld").rename(folder / "aside")
            count = lambda: d.ask("/v1/datasets/city").json()["faulty_tiles"]["count"]
            eventually(lambda: count() == 1)
            assert list(faults(d)) == ["tile-2.spld"]
            assert "tile-2.spld cannot be read: there is no such file" in faults(d)["tile-2.spld"] and top not in faults(d)["tile-2.spld"]
            (folder / "aside").rename(folder / "city/tile-2.spld")
            eventually(lambda: count() == 0)
            assert d.status()["counters"]["tile_faults"] == 1


def test_more_missing_tiles_than_may_be_read():
    """Of a dataset 256 reads are under way: those that failed stand in the way of no others."""
    wide = 17
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        for k in range(wide * wide):
            splatd("pack", write_tile(folder / "scan.ply", SIDE * (k % wide), SIDE * (k // wide), k, 8), "-o", folder / f"tile-{k}.spld", "--threads", 1)
        splatd("collect", folder, "-o", folder / "city.spld")
        for k in range(1, wide * wide):
            (folder / f"tile-{k}.spld").unlink()
        with Daemon(REAL, datasets=[folder / "city.spld"]) as d:
            middle = wide * SIDE / 2
            for more in "", "&wait=0":
                bad = d.ask(f"/v1/datasets/city/view?{VIEW}&eye={middle},{middle},{2 * wide * SIDE}&target={middle},{middle + 1},0&lod=0{more}")
                assert bad.status == 200 and bad.headers["Splatd-Complete"] == "false", bad.body
            faulty = d.ask("/v1/datasets/city").json()["faulty_tiles"]
            assert faulty["count"] == wide * wide - 1 and len(faulty["first"]) == 10


def test_what_can_be_wrong_with_a_tile():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder, whole=False)
        tile = folder / "city/tile-1.spld"
        data, near = tile.read_bytes(), f"/v1/datasets/city/view?{VIEW}&eye=55,10,6&target=60,20,0"
        page = struct.unpack_from("<Q", data, data.index(b"PAGE", struct.unpack_from("<Q", data, 24)[0]) + 8)[0] + 40
        wrong = {"cut": (data[:-1000], "truncated"), "empty": (b"", "is empty"), "a scan": (b"ply\n" * 30, "a PLY scan"),
                 "its neighbour": ((folder / "city/tile-0.spld").read_bytes(), "is another one now"),
                 "a page": (data[:page] + bytes([data[page] ^ 1]) + data[page + 1:], "page 0 fails its checksum")}
        for what, (bytes_, said) in wrong.items():
            tile.unlink()
            tile.write_bytes(bytes_)
            with Daemon(REAL, datasets=[folder / "city/city.spld"]) as d:
                bad = d.ask(near)
                assert bad.status == 200 and bad.headers["Splatd-Complete"] == "false", what
                assert list(faults(d)) == ["tile-1.spld"] and said in faults(d)["tile-1.spld"], (what, faults(d))
                out = folder / "out.png"
                done = subprocess.run([REAL, "render", folder / "city/city.spld", "--eye", "55,10,6", "--target", "60,20,0", "-o", out],
                                      text=True, capture_output=True)
                assert done.returncode == 0 and "1 of its tiles are missing, damaged or other ones than were collected" in done.stderr and said in done.stderr, (what, done.stderr)


def test_values_are_those_of_the_tiles():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder)
        with Daemon(REAL, datasets=[folder / "city/city.spld", folder / "whole.spld"]) as d:
            a, b = (next(x for x in d.ask(f"/v1/datasets/{name}").json()["attributes"] if x["name"] == "uncertainty")["values"]
                    for name in ("city", "whole"))
            assert a["count"] == b["count"], (a, b)
            assert 0.7 < a["p99"] / b["p99"] < 1.4, (a["p99"], b["p99"])


def test_a_collection_is_not_uploaded():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder)
        tokens = folder / "tokens"
        tokens.write_text("0123456789abcdef0123456789abcdef view,admin\n")
        tokens.chmod(0o400)
        body = (folder / "city/city.spld").read_bytes()
        with Daemon(REAL, "--tokens", str(tokens), datasets=[folder / "city"]) as d:
            reply = d.ask("/v1/datasets/town", "PUT", body, {"Authorization": "Bearer 0123456789abcdef0123456789abcdef"})
            assert reply.status == 422 and "files beside it" in reply.json()["detail"], reply.body
            assert "pack the scan" not in reply.json()["detail"], reply.body
            assert not (folder / "city/town.spld").exists()


def test_a_tile_that_is_replaced():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        scans = make(folder)
        write_tile(scans[3], SIDE, SIDE, 77)
        splatd("pack", scans[3], "-o", folder / "city/tile-3.spld")
        with Daemon(REAL, datasets=[folder / "city"]) as d:
            assert d.ask(f"/v1/datasets/city/view?{VIEW}&{NEAR}&far=20").status == 200
            above = f"/v1/datasets/city/view?{VIEW.replace('up=0,0,1', 'up=1,0,0')}&eye=60,60,20&target=60,60,0.5"
            bad = d.ask(above)
            assert bad.status == 200 and bad.headers["Splatd-Complete"] == "false"
            assert "tile-3.spld is another one now" in faults(d)["tile-3.spld"], faults(d)
            assert d.ask(f"/v1/datasets/tile-3/view?{VIEW}&{WHOLE}").status == 200
            splatd("collect", folder / "city", "-o", folder / "city/city.spld")
            eventually(lambda: d.ask(above).headers["Splatd-Complete"] == "true")  # once the new collection is served


run(globals())
