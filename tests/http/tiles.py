"""Neighbouring tiles of a simulated survey, packed each on its own, and their collection."""
import random
import struct
import subprocess

from harness import REAL

SIDE, STEP = 40, 0.5  # metres of a tile, points apart
VIEW = "width=160&height=120&up=0,0,1&fov=60&format=png"
WHOLE = "eye=40,-30,60&target=40,40,0"  # all four tiles
NEAR = "eye=15,10,6&target=20,20,0"  # in the first


def height(x, y):
    return 3 * (x % 20 > 10) + 0.02 * y


def write_tile(path, x0, y0, seed, step=STEP):
    points = []
    noise = random.Random(seed)
    for i in range(round(SIDE / step)):
        for j in range(round(SIDE / step)):
            x, y = x0 + (i + 0.5) * step, y0 + (j + 0.5) * step
            points.append(struct.pack("<dddBBB", x, y, height(x, y) + noise.gauss(0, 0.005), int(3 * x) % 256, int(3 * y) % 256, 90))
    path.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(points) + b"".join(
        b"property double %c\n" % c for c in b"xyz") + b"".join(b"property uchar %s\n" % c for c in (b"red", b"green", b"blue")) +
        b"end_header\n" + b"".join(points))
    return path


def splatd(*words):
    done = subprocess.run([REAL, *map(str, words)], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout
    return done.stdout


def make(folder, steps=(STEP,) * 4, whole=True):
    """Tiles, the collection of them, and all of their points in one dataset."""
    scans = [write_tile(folder / f"{k}.ply", SIDE * (k % 2), SIDE * (k // 2), k, step) for k, step in enumerate(steps)]
    (folder / "city").mkdir()
    for k, scan in enumerate(scans):
        splatd("pack", scan, "-o", folder / f"city/tile-{k}.spld")
    splatd("collect", folder / "city", "-o", folder / "city/city.spld")
    if whole:
        splatd("pack", *scans, "-o", folder / "whole.spld")
    return scans
