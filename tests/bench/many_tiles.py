#!/usr/bin/env python3
"""many_tiles.py [MS]: a view of 300 small tiles of a collection on a server that is MS (30) away a request: seconds until it is
complete, requests and connections; without a page cache, with an empty one and with the one that it left. The daemon is SPLATD_BINARY. Fails
where the pictures differ."""
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "http"))
from range_server import File, Server  # noqa: E402

SPLATD, WIDE, HIGH, SIDE, POINTS = os.environ["SPLATD_BINARY"], 20, 15, 10, 4000
VIEW = f"width=640&height=480&up=0,1,0&fov=60&eye={WIDE * SIDE / 2},{HIGH * SIDE / 2},170&target={WIDE * SIDE / 2},{HIGH * SIDE / 2},0&lod=0&format=png"


def make(folder):
    heads = [b"property double %c\n" % c for c in b"xyz"] + [b"property uchar %s\n" % c for c in (b"red", b"green", b"blue")]
    for k in range(WIDE * HIGH):
        noise, scan = random.Random(k), folder / "scan.ply"
        points = (struct.pack("<dddBBB", SIDE * (k % WIDE + noise.random()), SIDE * (k // WIDE + noise.random()), noise.gauss(0, 0.01), k % 256, 90, 40)
                  for _ in range(POINTS))
        scan.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % POINTS + b"".join(heads) + b"end_header\n" + b"".join(points))
        subprocess.run([SPLATD, "pack", scan, "-o", folder / f"t{k:03}.spld"], check=True, capture_output=True)
        scan.unlink()
    subprocess.run([SPLATD, "collect", folder, "-o", folder / "city.spld"], check=True, capture_output=True)
    return {f"/{path.name}": path.read_bytes() for path in folder.glob("*.spld")}


def measure(what, data, delay_s, port, more):
    files = {path: File(bytes_, delay_s=delay_s) for path, bytes_ in data.items()}
    with Server(files, port=port) as server:
        daemon = subprocess.Popen([SPLATD, "serve", "--listen", "127.0.0.1:0", "--deadline", "120000", *more, server.url("city.spld")],
                                  stderr=subprocess.PIPE, text=True)
        try:
            url = next(found[1] for line in daemon.stderr if (found := re.search(r"listening on (http://127\.0\.0\.1:\d+)", line)))
            next(line for line in daemon.stderr if " ready" in line)
            while b'"ready"' not in urllib.request.urlopen(f"{url}/v1/datasets").read():
                time.sleep(0.05)
            asked, began = len(server.asked), time.monotonic()
            with urllib.request.urlopen(f"{url}/v1/datasets/city/view?{VIEW}") as reply:
                picture, complete = reply.read(), reply.headers["Splatd-Complete"]
            took = time.monotonic() - began
        finally:
            daemon.terminate()
            daemon.communicate()
        assert complete == "true"
        print(f"| {what} | {took:.2f} | {(len(server.asked) - asked) / WIDE / HIGH:.2f} | {len(server.connections)} |", flush=True)
        return picture, server.port


def main():
    delay_s = float(sys.argv[1] if len(sys.argv) > 1 else 30) / 1000
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as pages:
        data = make(pathlib.Path(folder))
        print("| page cache | complete, s | requests a tile | connections |\n|---|---|---|---|")
        first, port = measure("none", data, delay_s, 0, [])
        for what in "empty", "as left":
            assert measure(what, data, delay_s, port, ["--page-cache", pages])[0] == first


main()
