"""What the parameters of a view cost: frames with each, as multiples of the same frame without, and what a map's tile takes.

usage: views.py [NAME.spld…]      by default the scan that measure.py takes

All variants of a view are asked by turns, none of them twice the same, so none is in a cache; times are the daemon's own of
drawing (`frame` of Server-Timing). A unit is the calibrator of 'splatd bench' on this machine. Exit 1 beyond a bound, 77
without the data.

environment: as for measure.py, and SPLATD_BENCH_ROUNDS (5)
"""
import contextlib
import http.client
import json
import math
import os
import re
import statistics
import subprocess
import sys
import time
import urllib.parse

from measure import SPLATD, beyond, bound, free_port, packed, scan

ROUNDS = int(os.environ.get("SPLATD_BENCH_ROUNDS", 5))
SIZE = {"width": 1280, "height": 720}


@contextlib.contextmanager
def serving(path):
    port = free_port()
    process = subprocess.Popen([SPLATD, "serve", "--listen", f"127.0.0.1:{port}", "--ops-listen",
                                f"127.0.0.1:{free_port()}", "--quiet", path])
    try:
        for _ in range(600):
            with contextlib.suppress(OSError, StopIteration):
                yield http.client.HTTPConnection("127.0.0.1", port, timeout=120), process
                break
            time.sleep(0.05)
    finally:
        process.terminate()
        process.wait(60)


def ask(connection, path, **query):
    """(headers, body); of a request, waited for."""
    url = path + ("?" + urllib.parse.urlencode(query) if query else "")
    for _ in range(200):
        try:
            connection.request("GET", url)
        except OSError:
            connection.close()
            time.sleep(0.05)
            continue
        reply = connection.getresponse()
        body = reply.read()
        if reply.status == 503:
            time.sleep(0.2)
            continue
        if reply.status != 200:
            sys.exit(f"{url}: {reply.status} {body[:300]!r}")
        return reply.headers, body
    sys.exit(f"{url}: no answer")


def unit_ms(path):
    out = json.loads(subprocess.run([SPLATD, "bench", path, "--frames", "4", "--size", "320x180", "--json"], check=True,
                                    stdout=subprocess.PIPE).stdout)
    return out["calibrator_ms"]["median"]


def variants(info):
    """(name, parameters that change it, its base, most of it)."""
    low, high = info["bounds"]["min"], info["bounds"]["max"]
    wide = [b - a for a, b in zip(low, high)]
    inner = ",".join(f"{v:.3f}" for v in [l + 0.1 * w for l, w in zip(low, wide)] + [h - 0.1 * w for h, w in zip(high, wide)])
    scalars = [a["name"] for a in info.get("attributes", [])]
    yield "clip=box of the middle 80 %", {"clip": f"box:{inner}"}, 1.1
    yield "clip=z below the middle", {"clip": f"z<{(low[2] + high[2]) / 2:.3f}"}, 1.1
    for count in 6, 24:
        turns = [2 * math.pi * i / count for i in range(count)]
        yield f"clip=polygon of {count} corners", {"clip": "polygon:" + ",".join(
            f"{m + 0.45 * w * f(t):.3f}" for t in turns for m, w, f in zip([(l + h) / 2 for l, h in zip(low, high)], wide, (math.cos, math.sin)))}, 1.1
    yield "color_by=height", {"color_by": "height"}, 1.1
    if "class" in scalars:
        yield "class=!5", {"class": "!5"}, 1.1
        yield "color_by=class", {"color_by": "class"}, 1.1
    if "intensity" in scalars:
        yield "color_by=intensity", {"color_by": "intensity"}, 1.1
    yield "shade=edl", {"shade": "edl"}, None
    yield "shade=headlight", {"shade": "headlight"}, None


def frame_ms(headers):
    return float(re.search(r"frame;dur=([\d.]+)", headers["Server-Timing"])[1])


def measure(path):
    unit = unit_ms(path)
    with serving(path) as (connection, process):
        name = json.loads(ask(connection, "/v1/datasets")[1])["datasets"][0]["id"]
        info = json.loads(ask(connection, f"/v1/datasets/{name}")[1])
        at = f"/v1/datasets/{name}"
        camera = json.loads(ask(connection, at + "/view", **SIZE, format="raw")[0]["Splatd-Camera"])
        eye, target = camera["eye"], info["default_view"]["target"]
        fresh = iter(range(1, 10**9))
        rows = [("as it is", {}, None), *variants(info)]
        around = {"projection": "equirectangular", "width": 2048, "height": 1024, "eye": ",".join(map(str, target)),
                  "target": ",".join(map(str, [target[0] + 1, target[1], target[2]]))}
        as_many = {**around, "projection": "perspective", "fov": 60}
        z = max(json.loads(ask(connection, at + "/tiles.json")[1])["maxzoom"] - 3, 0)
        times = {}
        for turn in range(ROUNDS + 1):
            for row, more, _ in rows:
                for step in range(3):  # three eyes: further and nearer
                    moved = [t + (e - t) * (1.2 - 0.3 * step) for e, t in zip(eye, target)]
                    query = {**SIZE, "eye": ",".join(map(str, moved)), "target": ",".join(map(str, target)), "shade": "none",
                             "margin": f"{1 + next(fresh) * 1e-7:.7f}", **more}
                    times.setdefault(row, []).append((turn, frame_ms(ask(connection, at + "/view", **query)[0])))
            for row, query in (("perspective", as_many), ("equirectangular", around)):
                headers, _ = ask(connection, at + "/view", **query, margin=f"{1 + next(fresh) * 1e-7:.7f}")
                times.setdefault(row, []).append((turn, frame_ms(headers)))
            tiles = json.loads(ask(connection, at + "/tiles.json")[1])["splatd"]
            step = tiles["side"] / 2**z
            middle = [(tiles["bounds"][i] + tiles["bounds"][i + 2]) / 2 for i in range(2)]
            x, y = int((middle[0] - tiles["corner"][0]) / step), int((tiles["corner"][1] - middle[1]) / step)
            headers, _ = ask(connection, f"{at}/tiles/{z}/{x}/{y}.png", margin=f"{1 + next(fresh) * 1e-7:.7f}")
            times.setdefault("tile", []).append((turn, frame_ms(headers)))
    median = {row: statistics.median(ms for turn, ms in values if turn) for row, values in times.items()}  # the first compiles
    print(f"{name}: {info['splats']:,} splats; 1 unit = {unit:.1f} ms; medians of {3 * ROUNDS} frames")
    base = median["as it is"]
    for row, _, most in rows:
        print(f"  {row:30} {median[row]:7.1f} ms, {median[row] / unit:5.2f} units, {median[row] / base:5.2f} of as it is")
        if most:
            bound(f"{name}: {row}", median[row] / base, most, "of the frame without")
    # of the same eye in the same turn: frames differ more from turn to turn than it takes
    more = statistics.median(edl - bare for (turn, edl), (_, bare) in zip(times["shade=edl"], times["as it is"]) if turn)
    bound(f"{name}: shade=edl takes", more / unit, 0.5, "units")
    bound(f"{name}: equirectangular 2048x1024", median["equirectangular"] / median["perspective"], 3,
          "of a perspective frame of as many pixels")
    bound(f"{name}: a tile of 256x256", median["tile"] / unit, 1.5, "units")


for dataset in sys.argv[1:] or [packed(scan(), "grenoble")]:
    measure(dataset)
sys.exit(1 if beyond else 0)
