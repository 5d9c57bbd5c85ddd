"""Collections over HTTP: one id, whose views are those of the same points in one dataset, to what packing them apart changes;
picks say which tile; a tile that is replaced is told by name until the collection is made anew, and the others are served."""
import pathlib
import struct
import tempfile
import time
import zlib

from harness import REAL, Daemon, run
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


def test_what_is_missing_stops_nothing_else():
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        make(folder)
        (folder / "city/tile-1.spld").rename(folder / "aside")
        with Daemon(REAL, datasets=[folder / "city"]) as d:
            assert d.ask(f"/v1/datasets/tile-2/view?{VIEW}&{WHOLE}").status == 200
            near = f"/v1/datasets/city/view?{VIEW}&eye=55,10,6&target=60,20,0"
            bad = d.ask(near)
            assert bad.status == 500 and "tile-1.spld cannot be read" in bad.json()["detail"], bad.body
            assert top not in bad.json()["detail"], bad.body
            good = d.ask(f"/v1/datasets/city/view?{VIEW}&eye=25,10,6&target=10,10,0")  # away from it
            assert good.status == 200, good.body
            (folder / "aside").rename(folder / "city/tile-1.spld")
            assert d.ask(near).status == 200


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
            assert bad.status == 500 and "tile-3.spld is another one now" in bad.json()["detail"], bad.body
            assert d.ask(f"/v1/datasets/tile-3/view?{VIEW}&{WHOLE}").status == 200
            splatd("collect", folder / "city", "-o", folder / "city/city.spld")
            for _ in range(100):
                if d.ask(above).status == 200:
                    break
                time.sleep(0.1)
            else:
                raise AssertionError("the new collection is not served")


run(globals())
