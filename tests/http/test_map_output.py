"""Maps: GeoTIFFs and world files of plans, and tiles. Corners, steps and heights are those of the views and picks that ask for
the same place; tiles are pieces of one picture, whoever asks for them."""
import io
import json
import math
import os
import struct
import subprocess
import tempfile
import zipfile
import zlib

import openapi
from harness import FAKE, REAL, VIEW, Daemon, run

TREE = os.environ["SPLATD_TREE"]
PLAN = "/v1/datasets/tree/view?projection=orthographic&eye=10.125,9.25,30&target=10.125,9.25,0&units_per_pixel=0.25&width=96&height=64"
PICK = PLAN.replace("/view", "/pick")
WEBP, TIFF, PROJ = (os.environ[f"SPLATD_{name}"] == "1" for name in ("WEBP", "TIFF", "PROJ"))
SCALE, TIEPOINT, MATRIX, KEYS, NODATA = 33550, 33922, 34264, 34735, 42113


def undo_floats(row, count, stride):
    """Of predictor 3."""
    row = bytearray(row)
    for i in range(stride, len(row)):
        row[i] = (row[i] + row[i - stride]) & 255
    return b"".join(bytes(row[k * count + i] for k in (3, 2, 1, 0)) for i in range(count))


def undo_differences(row, stride, form):
    values = list(struct.unpack(form, row))
    for i in range(stride, len(values)):
        values[i] = (values[i] + values[i - stride]) & (255 if "B" in form else 0xffffffff)
    return struct.pack(form, *values)


def read_tiff(data):
    """({tag: values}, bytes of the pixels)"""
    assert data[:4] == b"II*\0", data[:8]
    at, = struct.unpack("<I", data[4:8])
    count, = struct.unpack("<H", data[at:at + 2])
    sizes, tags = {2: "c", 3: "H", 4: "I", 12: "d"}, {}
    for i in range(count):
        tag, kind, n = struct.unpack("<HHI", data[at + 2 + 12 * i:at + 10 + 12 * i])
        form = f"<{n}{sizes[kind]}"
        where = at + 10 + 12 * i
        if struct.calcsize(form) > 4:
            where, = struct.unpack("<I", data[where:where + 4])
        values = struct.unpack(form, data[where:where + struct.calcsize(form)])
        tags[tag] = b"".join(values).rstrip(b"\0").decode() if kind == 2 else values
    width, samples, bits = tags[256][0], tags[277][0], tags[258][0]
    assert tags[259] == (8,) and tags[274] == (1,), tags
    pixels = b""
    for start, length in zip(tags[273], tags[279]):
        strip = zlib.decompress(data[start:start + length])
        size = width * samples * bits // 8
        for y in range(0, len(strip), size):
            row, values = strip[y:y + size], width * samples
            pixels += (undo_floats(row, values, samples) if tags[317] == (3,) else
                       undo_differences(row, samples, f"<{values}{'B' if bits == 8 else 'I'}"))
    return tags, pixels


def read_png(data):
    """(width, height, rows of RGBA)"""
    at, idat, rows = 8, b"", []
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", data[at + 8:at + 18])
            assert (depth, color) == (8, 6)
        idat += data[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    bytes_, before = zlib.decompress(idat), bytearray(4 * width)
    for y in range(height):
        start = y * (4 * width + 1)
        kind, row = bytes_[start], bytearray(bytes_[start + 1:start + 1 + 4 * width])
        for i in range(4 * width if kind else 0):
            a, b, c = (row[i - 4], before[i], before[i - 4]) if i >= 4 else (0, before[i], 0)
            if kind == 4:
                p, q, r = abs(b - c), abs(a - c), abs(a + b - 2 * c)
                guess = a if p <= q and p <= r else b if q <= r else c
            else:
                guess = (0, a, b, (a + b) // 2)[kind]
            row[i] = (row[i] + guess) & 255
        rows.append(bytes(row))
        before = row
    return width, height, rows


def floats(data):
    return struct.unpack(f"<{len(data) // 4}f", data)


def test_geotiffs_are_where_they_say():
    if not TIFF:
        with Daemon(REAL, datasets=[TREE]) as d:
            assert d.ask(f"{PLAN}&format=tiff").json()["field"] == "format"
        return
    with Daemon(REAL, datasets=[TREE]) as d:
        tags, color = read_tiff(d.ask(f"{PLAN}&format=tiff").body)
        assert tags[SCALE] == (0.25, 0.25, 0) and tags[TIEPOINT] == (0, 0, 0, 10.125 - 12, 9.25 + 8, 0), tags
        assert tags[KEYS] == (1, 1, 1, 1, 1025, 0, 1, 1) and tags[338] == (2,) and NODATA not in tags, tags
        assert d.ask(f"{PLAN}&transparent=true&format=raw").body == color and 0 in color[3::4]
        for opaque in ("background=black", "transparent=false"):
            assert read_tiff(d.ask(f"{PLAN}&{opaque}&format=tiff").body)[1] == d.ask(f"{PLAN}&format=raw").body, opaque
        assert read_tiff(d.ask(f"{PLAN}&background=red&transparent=true&format=tiff").body)[1][3::4] == color[3::4]
        reply = d.ask(f"{PLAN}&layer=depth&format=tiff")
        assert reply.headers["Content-Type"] == "image/tiff" and reply.headers["Splatd-Height-Unit"]
        assert "Splatd-Depth-Unit" not in reply.headers
        tags, heights = read_tiff(reply.body)
        heights = floats(heights)
        assert tags[NODATA] == "nan" and tags[339] == (3,), tags
        depths = floats(d.ask(f"{PLAN}&layer=depth&format=raw").body)
        seen = [i for i, z in enumerate(depths) if not math.isnan(z)]
        assert 200 < len(seen) < 96 * 64 and all(math.isnan(h) == math.isnan(z) for h, z in zip(heights, depths))
        assert all(abs(heights[i] - (30 - depths[i])) < 2e-6 for i in seen)
        for i in seen[::len(seen) // 7]:  # the photograph's pixel, the surface's, and the point that is picked are one
            x, y = i % 96 + 0.5, i // 96 + 0.5
            picked = d.ask(f"{PICK}&x={x}&y={y}").json()["position"]
            wanted = (10.125 - 12 + 0.25 * x, 9.25 + 8 - 0.25 * y, heights[i])
            assert all(abs(a - b) < 1e-5 for a, b in zip(picked, wanted)), (picked, wanted)
        for layer, form in (("normal", 3), ("id", 1), ("coverage", 1), ("primitive", 1), ("range", 1)):
            tags, pixels = read_tiff(d.ask(f"{PLAN}&layer={layer}&format=tiff").body)
            assert tags[277] == (form,) and len(pixels) == 96 * 64 * 4 * form, layer
            if layer != "range":
                assert pixels == d.ask(f"{PLAN}&layer={layer}&format=raw").body, layer
        tags, _ = read_tiff(d.ask(f"{PLAN}&up=1,1,0&format=tiff").body)
        assert SCALE not in tags and len(tags[MATRIX]) == 16
        picked = d.ask(f"{PICK}&up=1,1,0&x=40.5&y=30.5").json()["position"]
        m = tags[MATRIX]
        assert all(abs(picked[i] - (m[4 * i] * 40.5 + m[4 * i + 1] * 30.5 + m[4 * i + 3])) < 1e-5 for i in (0, 1)), (m, picked)
        for wrong in ("eye=10,9,30&target=10,8,0&up=0,1,0&units_per_pixel=1", "eye=10,9,30&target=10,9,0&up=0,1,0",
                      "eye=10,9,-30&target=10,9,0&units_per_pixel=1"):
            refused = d.ask(f"/v1/datasets/tree/view?{wrong}&width=16&height=16&format=tiff")
            assert refused.status == 400 and refused.json()["field"] == "format", (wrong, refused.body)
    with Daemon(REAL) as d:  # its coordinates are those of EPSG:2263
        reply = d.view(eye="0.25,0.5,9", target="0.25,0.5,0", view_height=3, width=24, height=24, format="tiff")
        assert read_tiff(reply.body)[0][KEYS] == (1, 1, 1, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 2263)
        views = d.post({"format": "tiff", "width": 8, "height": 8, "views": [
            {"camera": {"eye": [x, 0, 9], "target": [x, 0, 0], "view_height": 2}} for x in (0, 5)]}, VIEW + "s")
        assert views.headers["Splatd-Failed"] == "0" and views.body.count(b"image/tiff") == 2


def test_geotiffs_say_the_unit_of_a_plane():
    """Of a dataset whose coordinate system has no number."""
    if not TIFF:
        return
    user, area = (1024, 0, 1, 32767), (1025, 0, 1, 1)
    with tempfile.TemporaryDirectory() as top:
        scan, made, out = (os.path.join(top, name) for name in ("scan.xyz", "made.spld", "map.tif"))
        with open(scan, "w") as file:
            file.writelines(f"{x / 4} {y / 4} 2\n" for x in range(20) for y in range(20))
        for unit, keys, numbers in (("us-ft", (3076, 0, 1, 9003), None), ("cm", (3076, 0, 1, 32767, 3077, 34736, 1, 0), (0.01,)), ("unknown", (), None)):
            subprocess.run([REAL, "pack", scan, "--unit", unit, "-o", made], check=True, capture_output=True)
            for layer in ("depth", "color"):
                subprocess.run([REAL, "render", made, "--projection", "orthographic", "--eye", "2,2,9", "--target", "2,2,0", "--units-per-pixel",
                                "0.5", "--size", "16x16", "--layer", layer, "-o", out], check=True, capture_output=True)
                with open(out, "rb") as file:
                    tags, pixels = read_tiff(file.read())
                text = f"no EPSG number; units are {unit}|"
                said = (*user, *area, 1026, 34737, len(text), 0, *keys) if keys else area
                assert tags[KEYS] == (1, 1, 1, len(said) // 4, *said) and tags.get(34736) == numbers, (unit, tags)
                assert tags.get(34737) == (text if keys else None), (unit, tags)
                assert (f">{unit}</Item>" in tags.get(42112, "")) == bool(keys and layer == "depth"), (unit, layer, tags)
                if layer == "color":  # as over HTTP
                    assert {pixels[3], pixels[-1]} == {0} and 255 in pixels[3::4]


def test_geotiffs_keep_a_system_without_a_number():
    """Its name, and its text where GDAL reads one."""
    if not TIFF:
        return
    utm = ('PROJCS["Site|grid ""A""",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
           'UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["central_meridian",9],%sUNIT["metre",1]]')
    with tempfile.TemporaryDirectory() as top:
        scan, made, out, prj = (os.path.join(top, name) for name in ("scan.xyz", "made.spld", "map.tif", "a.prj"))
        with open(scan, "w") as file:
            file.writelines(f"{x / 4} {y / 4} 2\n" for x in range(20) for y in range(20))
        for wkt, kept in ((utm % "", True), (utm % 'PARAMETER["scale_factor",1],' * 1, True), (utm % ('PARAMETER["x",1],' * 130), False)):
            with open(prj, "w") as file:
                file.write(wkt)
            subprocess.run([REAL, "pack", scan, "--crs", prj, "-o", made], check=True, capture_output=True)
            subprocess.run([REAL, "render", made, "--projection", "orthographic", "--eye", "2,2,9", "--target", "2,2,0", "--units-per-pixel",
                            "0.5", "--size", "16x16", "-o", out], check=True, capture_output=True)
            with open(out, "rb") as file:
                rendered = file.read()
            with Daemon(REAL, datasets=[made]) as d:
                served = d.ask("/v1/datasets/made/view?eye=2,2,9&target=2,2,0&units_per_pixel=0.5&width=16&height=16&projection=orthographic&format=tiff")
            for body in (rendered, served.body):
                tags = read_tiff(body)[0]
                name, text = 'Site grid "A"|', f"ESRI PE String = {wkt}|".replace("Site|", "Site ")
                full = (3072, 0, 1, 32767, 3073, 34737, len(text), len(name)) if kept else ()
                said = (1024, 0, 1, 32767, 1025, 0, 1, 1, 1026, 34737, len(name), 0, *full, 3076, 0, 1, 9001)
                assert tags[KEYS] == (1, 1, 1, len(said) // 4, *said), tags
                assert tags[34737] == name + (text if kept else ""), tags


def test_world_files_lie_beside_pictures():
    with Daemon(REAL, datasets=[TREE]) as d:
        zipped = zipfile.ZipFile(io.BytesIO(d.ask(f"{PLAN}&layers=color,depth&container=zip").body))
        assert zipped.namelist() == ["color.jpg", "color.jgw", "depth.png", "depth.pgw", "index.json"]
        lines = [float(line) for line in zipped.read("depth.pgw").split()]
        assert lines == [0.25, 0, 0, -0.25, 10.125 - 12 + 0.125, 9.25 + 8 - 0.125] and zipped.read("color.jgw") == zipped.read("depth.pgw")
        assert len(json.loads(zipped.read("index.json"))) == 4
        other = d.ask("/v1/datasets/tree/view?layers=color,depth&container=zip&format=png&width=32")
        assert zipfile.ZipFile(io.BytesIO(other.body)).namelist() == ["color.png", "depth.png", "index.json"]


def tile_pixels(reply):
    assert reply.status == 200, reply.body
    width, height, rows = read_png(reply.body)
    assert (width, height) == (256, 256)
    return rows


def test_tiles_of_a_plane():
    """tree has no coordinate system: its own square, of which level 0 is one tile."""
    with Daemon(REAL, datasets=[TREE]) as d:
        tiles = d.ask("/v1/datasets/tree/tiles.json").json()
        own = tiles["splatd"]
        assert tiles["tilejson"] == "3.0.0" and own["scheme"] == "plane" and "bounds" not in tiles, tiles
        west, north, side = *own["corner"], own["side"]
        low, high = own["bounds"][:2], own["bounds"][2:]
        wide = [b - a for a, b in zip(low, high)]
        assert abs(side - max(wide)) < 1e-9, own
        assert all(abs(c - w) < 1e-9 for c, w in zip((west + side / 2, north - side / 2), (low[0] + wide[0] / 2, low[1] + wide[1] / 2))), own
        first = tiles["tiles"][0].format(z=0, x=0, y=0)
        top = d.ask(first)
        assert "immutable" in top.headers["Cache-Control"] and json.loads(top.headers["Splatd-Camera"])["projection"]
        again = d.ask(first, headers={"If-None-Match": top.headers["ETag"]})
        assert again.status == 304
        # As the view of the same place, and level 1 as one picture of 512 pixels.
        look = f"eye={west + side / 2},{north - side / 2},50&target={west + side / 2},{north - side / 2},0&transparent=true&format=raw"
        tall = d.ask("/v1/datasets/tree/tiles/0/0/0@2x.png")
        assert struct.unpack(">II", tall.body[16:24]) == (512, 512)
        for how in ["shade=none", "shade=edl&edl_radius=5&method=nearest", "supersample=0.5", "supersample=0.25", "supersample=0.25&method=nearest",
                    "supersample=0.5&method=points", "supersample=1.25"]:
            view = d.ask(f"/v1/datasets/tree/view?{look}&units_per_pixel={side / 512}&width=512&height=512&{how}")
            off = [0, 0]  # in the middle of tiles, and within 8 pixels of where they meet
            for y in range(2):
                for x in range(2):
                    rows = tile_pixels(d.ask(f"/v1/datasets/tree/tiles/1/{x}/{y}.png?{how}"))
                    for j, row in enumerate(rows):
                        start = 2048 * (256 * y + j) + 1024 * x
                        part = view.body[start:start + 1024]
                        for i in range(256) if row != part else ():
                            if row[4 * i:4 * i + 4] != part[4 * i:4 * i + 4] and 4 <= min(at := (256 * x + i, 256 * y + j)) and max(at) < 508:
                                off[248 <= at[0] < 264 or 248 <= at[1] < 264] += 1
            # An eye elsewhere rounds elsewhere: a fragment at a border here and there, which edl looks at from around it, and
            # which is in several pixels of what is enlarged. What that has beyond the picture's own border the view does not know.
            near = 512**2 - 496**2
            most = 0.01 if "edl" in how else 0.008 if "=0." in how else 0.002
            assert off[0] <= most * 496**2 and off[1] <= 2 * most * near, (how, off)
        opaque = tile_pixels(d.ask("/v1/datasets/tree/tiles/1/0/0.png?background=ff0000"))
        assert all(row[3::4] == b"\xff" * 256 for row in opaque)
        for name in ("0/0/1.png", "1/2/0.png", "31/0/0.png", "0/0/0.jpg", "0/0/0", "00/0/0.png", "0/0/0@3x.png", "-1/0/0.png",
                     "0/0/0.png.png", "a/b/c.png"):
            wrong = d.ask(f"/v1/datasets/tree/tiles/{name}")
            assert wrong.status == 404 and wrong.json()["field"] == "tile", (name, wrong.body)
        assert d.ask("/v1/datasets/tree/tiles/0/0/0.png?eye=1,2,3").json()["field"] == "eye"
        assert d.ask("/v1/datasets/tree/tiles/0/0/0.png?lod=-1").json()["field"] == "lod"
        webp = d.ask("/v1/datasets/tree/tiles/0/0/0.webp?quality=50")
        assert webp.headers.get("Content-Type") == "image/webp" if WEBP else webp.status == 404


def test_a_system_that_proj_cannot_use_is_a_plane():
    """A site's own system, one that no list has, and what is no system at all; asked for first, and again."""
    with tempfile.TemporaryDirectory() as folder:
        systems = ['LOCAL_CS["site",UNIT["metre",1],AXIS["X",EAST],AXIS["Y",NORTH]]', "EPSG:999999", "nonsense["]
        paths = [os.path.join(folder, f"site{i}.spld") for i in range(len(systems))]
        for path, crs in zip(paths, systems):
            subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--unit=m", f"--crs={crs}", path], check=True)
        with Daemon(REAL, datasets=paths) as d:
            for i in range(len(systems)):
                assert any(any(row[3::4]) for row in tile_pixels(d.ask(f"/v1/datasets/site{i}/tiles/0/0/0.png")))
                for _ in range(2):
                    assert d.ask(f"/v1/datasets/site{i}/tiles.json").json()["splatd"]["scheme"] == "plane"
                    refused = d.ask(f"/v1/datasets/site{i}/place?crs=EPSG:3857&world=0,0,0")
                    assert refused.status in (400, 501) and refused.json()["field"] == "crs", refused.body


def test_tiles_of_the_earth():
    """What a tile shows of the world is where PROJ says that its pixels are."""
    with Daemon(REAL) as d:
        tiles = d.ask("/v1/datasets/wall/tiles.json").json()
        if not PROJ:
            assert tiles["splatd"]["scheme"] == "plane"
            return
        west, south, east, north = tiles["bounds"]
        assert tiles["splatd"]["scheme"] == "mercator" and west < east and south < north and -90 < west < -70 and 38 < south < 42, tiles
        turn, z = 2 * math.pi * 6378137, tiles["maxzoom"]
        for z, most in ((z, 0.01), (z - 4, 0.01), (14, 0.02), (9, 0.5), (0, 0.5)):
            for point in ((0, 0, 1), (0.3, 0.9, 0)):
                place = d.ask(f"/v1/datasets/wall/place?crs=EPSG:3857&world={','.join(map(str, point))}").json()["position"]
                at = [(place[0] / turn + 0.5) * 2 ** z, (0.5 - place[1] / turn) * 2 ** z]
                name = f"{z}/{int(at[0])}/{int(at[1])}"
                camera = json.loads(d.ask(f"/v1/datasets/wall/tiles/{name}.png").headers["Splatd-Camera"])
                offset = [p - e for p, e in zip(point, camera["eye"])]
                seen = [camera["fx" if i == 0 else "fy"] * sum(a * b for a, b in zip(camera["rotation"][3 * i:], offset)) + 128 for i in (0, 1)]
                wanted = [256 * (v - int(v)) for v in at]
                assert max(abs(a - b) for a, b in zip(seen, wanted)) < most, (z, point, seen, wanted)
        empty = d.ask("/v1/datasets/wall/tiles/5/30/2.png")  # Siberia's
        assert not any(any(row[3::4]) for row in tile_pixels(empty)) and empty.headers["Splatd-Splats"] == "0"
        rotated = abs(camera["rotation"][1])
        assert 0.01 < rotated < 0.1, camera  # of the grid's north and the map's


def test_every_parameter_of_a_tile():
    query = {p["name"]: p for _, _, operation, parameters in openapi.operations() if operation["operationId"] == "getTile"
             for p in parameters if p["in"] == "query"}
    values = {"method": "points", "lod": 2, "margin": 1, "atoms": 1, "maps": "off", "primitives": "off", "visibility": "none", "kernel": 5,
              "threshold": 0.5, "pyramid": 3, "clip": "z<3", "class": "!7", "soft": "uncertainty>1", "soft_model": "base", "soft_opacity": 0.5, "soft_cover": 0.5,
              "soft_blend": 0.1, "of": "first", "supersample": 2, "background": "white", "quality": 80, "wait": 0, "color_by": "height",
              "ramp": "turbo", "range": "0..2", "shade": "edl", "edl_strength": 0.7, "edl_radius": 3}
    with Daemon(FAKE) as d:
        values["v"] = d.ask("/v1/datasets/wall").json()["version"]
        assert set(query) == set(values), set(query) ^ set(values)
        for name, value in values.items():
            reply = d.ask(f"/v1/datasets/wall/tiles/0/0/0.png?{name}={value}")
            assert reply.status == 200, (name, reply.body)
            said = d.ask(f"/v1/datasets/wall/tiles.json?{name}={value}")  # hands it on
            assert said.status == 200, (name, said.body)
            tile = d.ask(said.json()["tiles"][0].format(z=0, x=0, y=0))
            assert tile.status == 200 and tile.headers["ETag"] == reply.headers["ETag"], (name, said.body)
            assert "immutable" in tile.headers["Cache-Control"]
        for wrong, field in (("eye=1,2,3", "eye"), ("lod=-1", "lod"), ("v=0123456789abcdef", "v"), ("{x}=1", "{x}")):
            refused = d.ask(f"/v1/datasets/wall/tiles.json?{wrong}")
            assert refused.status in (400, 404, 409, 410) and refused.json()["field"] == field, (wrong, refused.body)


run(globals())
