"""Several layers of one frame, as multipart/mixed and as ZIP; WebP, quality and chroma."""
import io
import json
import os
import shutil
import subprocess
import tempfile
import zipfile

from harness import FAKE, REAL, VIEW, Daemon, parts, run

WEBP = os.environ["SPLATD_WEBP"] == "1"
LOOK = dict(eye="3,0.2,1", target="0,0,1", width=64, height=48)
LAYERS = ["color", "depth", "range", "normal", "id", "coverage", "primitive"]


def each_part_is_the_layer_by_itself(d):
    for extra in ({}, {"format": "npy"}, {"format": "raw"}, {"format": "jpeg", "quality": 70, "chroma": 444}):
        singles = {layer: d.view(**LOOK, layer=layer, **extra) for layer in LAYERS}
        before = d.status()["counters"]["frames"]
        got = list(parts(d.view(**LOOK, layers=",".join(LAYERS), **extra)))
        zipped = zipfile.ZipFile(io.BytesIO(d.view(**LOOK, layers=",".join(LAYERS), container="zip", **extra).body))
        assert d.status()["counters"]["frames"] == before + 2, "one frame for all layers"
        assert zipped.testzip() is None
        index = json.loads(zipped.read("index.json"))
        assert [row["name"] for row in index] == [name for name, _, _ in got] == zipped.namelist()[:-1]
        for (name, headers, body), row, layer in zip(got, index, LAYERS, strict=True):
            single = singles[layer]
            assert body == single.body == zipped.read(name), (layer, extra)
            assert headers["Splatd-Layer"] == row["headers"]["Splatd-Layer"] == layer and name.startswith(layer)
            described = {k: v for k, v in single.headers.items() if k.startswith("Splatd-Depth") or k == "Content-Type"}
            for k, v in described.items():
                assert headers[k] == row["headers"][k] == v, (layer, k)
            assert set(row["headers"]) == set(described) | {"Splatd-Layer"}


def containers_are_cached_like_any_view(d):
    first = d.view(**LOOK, layers="depth,color")
    assert [name for name, _, _ in parts(first)] == ["color.jpg", "depth.png"]
    assert json.loads(first.headers["Splatd-Camera"])["width"] == 64
    same = d.view(**LOOK, layers="color,depth", container="multipart")
    assert same.headers["Splatd-Cache"] == "hit" and same.body == first.body
    posted = d.post({"camera": {"eye": [3, 0.2, 1], "target": [0, 0, 1]}, "width": 64, "height": 48,
                     "layers": ["depth", "color"]})
    assert posted.headers["Splatd-Cache"] == "hit" and posted.body == first.body
    assert d.post({"camera": {"eye": [3, 0.2, 1], "target": [0, 0, 1]}, "width": 64, "height": 48, "chroma": 420,
                   "layers": "color,depth", "container": "zip"}).headers["Content-Type"] == "application/zip"
    tags = {d.view(**LOOK, **more).headers["ETag"] for more in
            ({"layers": "color,depth"}, {"layers": "color"}, {"layer": "color"},
             {"layers": "color", "container": "zip"},
             {"layers": "color,depth", "format": "png"}, {"layers": "color,normal"})}
    assert len(tags) == 6
    again = d.ask(VIEW + "?layers=color,depth&eye=3,0.2,1&target=0,0,1&width=64&height=48",
                  headers={"If-None-Match": first.headers["ETag"]})
    assert again.status == 304


def test_bad_lists_are_refused_by_name():
    with Daemon(FAKE) as d:
        for query, field in [("layers=", "layers"), ("layers=color,", "layers"), ("layers=color,color", "layers"),
                             ("layers=color,smell", "layers"), ("layers=color&layer=depth", "layers"),
                             ("container=zip", "container"), ("layers=color&container=tar", "container"),
                             ("layers=color&budget=50ms", "layers"), ("layers=color&psnr=30", "layers"),
                             ("layers=color%20,depth", "layers"), ("layers=" + "color," * 100, "layers"),
                             ("chroma=422", "chroma"), ("chroma=", "chroma"), ("chroma=nan", "chroma"),
                             ("format=webp&chroma=444", "chroma" if WEBP else "format")]:
            reply = d.ask(f"{VIEW}?{query}")
            assert reply.status == 400 and reply.json()["field"] == field, (query, reply.body)
        for body, field in [({"layers": []}, "layers"), ({"layers": [1]}, "layers"),
                            ({"layers": ["color", "color"]}, "layers"),
                            ({"layers": {"color": 1}}, "layers"), ({"layers": ["color"], "container": 1}, "container"),
                            ({"camera": {"layers": ["color"]}}, "layers"), ({"chroma": "444"}, "chroma"),
                            ({"x": 1}, "x")]:
            reply = d.post(body)
            assert reply.status == 400 and reply.json()["field"] == field, (body, reply.body)
        assert d.status()["counters"]["frames"] == 0


def sampling(jpeg):
    """Samples of the first component in each direction."""
    at = 2
    while not 0xC0 <= jpeg[at + 1] <= 0xC2:
        at += 2 + int.from_bytes(jpeg[at + 2:at + 4], "big")
    return jpeg[at + 11]


def quality_and_chroma_of_jpeg(d):
    for quality, chroma, wanted in [(90, None, 0x22), (95, None, 0x11), (90, 444, 0x11), (95, 420, 0x22),
                                    (20, 420, 0x22)]:
        more = {"chroma": chroma} if chroma else {}
        assert sampling(d.view(**LOOK, quality=quality, **more).body) == wanted, (quality, chroma)
    assert len(d.view(**LOOK, quality=20).body) < len(d.view(**LOOK, quality=90).body)
    tag = d.view(**LOOK).headers["ETag"]
    assert d.view(**LOOK, chroma=420).headers["ETag"] == tag != d.view(**LOOK, chroma=444).headers["ETag"]
    assert d.view(**LOOK, chroma=444, format="png").headers["ETag"] == d.view(**LOOK, format="png").headers["ETag"]


def webp(d):
    if not WEBP:
        reply = d.view(**LOOK, format="webp")
        assert reply.status == 400 and "this build makes no webp" in reply.json()["detail"]
        return
    for layer in LAYERS:
        reply = d.view(**LOOK, layer=layer, format="webp")
        assert reply.headers["Content-Type"] == "image/webp"
        assert reply.body[:4] == b"RIFF" and reply.body[8:12] == b"WEBP"
        assert int.from_bytes(reply.body[4:8], "little") + 8 == len(reply.body)
    assert len(d.view(**LOOK, format="webp", quality=10).body) < len(d.view(**LOOK, format="webp").body)
    solid, clear = (d.view(**LOOK, format="webp", transparent=t).body for t in ("false", "true"))
    assert b"VP8 " in solid[:20] and b"VP8X" in clear[:20], "the alpha of color is kept"
    if not shutil.which("dwebp"):
        return
    with tempfile.TemporaryDirectory() as folder:
        at = os.path.join(folder, "a.webp")
        open(at, "wb").write(solid)
        subprocess.run(["dwebp", at, "-ppm", "-o", at + ".ppm"], check=True, capture_output=True)
        pixels = open(at + ".ppm", "rb").read()[-64 * 48 * 3:]
    raw = d.view(**LOOK, format="raw").body
    off = sum(abs(pixels[3 * i + c] - raw[4 * i + c]) for i in range(64 * 48) for c in range(3)) / (64 * 48 * 3)
    assert off < 12, off


def test_on_a_real_device():
    with Daemon(REAL) as d:
        for check in (each_part_is_the_layer_by_itself,
                      containers_are_cached_like_any_view,
                      quality_and_chroma_of_jpeg,
                      webp):
            check(d)


run(globals())
