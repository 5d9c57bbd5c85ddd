"""How many bytes the JPEGs of views have, for `splatd plan`: of each dataset its default view and the same place from
the other three sides, at three sizes, `splatd render`'s defaults (quality 90, method splat, lod 1).

usage: SPLATD_BINARY=build/src/splatd jpeg_bytes.py NAME.spld…"""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

SPLATD = os.environ["SPLATD_BINARY"]
SIZES = ("640x360", "1280x720", "1920x1080")


def views(dataset):
    """Eyes around the default view's target, a quarter turn apart."""
    told = subprocess.run([SPLATD, "info", "--json", dataset], capture_output=True, check=True, text=True).stdout
    view = json.loads(told)["default_view"]
    (x, y, z), target = view["eye"], view["target"]
    dx, dy = x - target[0], y - target[1]
    for _ in range(4):
        yield [target[0] + dx, target[1] + dy, z], target
        dx, dy = -dy, dx


def measure(dataset, size, eye, target, folder):
    out = pathlib.Path(folder, "view.jpg")
    said = [",".join(map(repr, where)) for where in (eye, target)]
    subprocess.run([SPLATD, "render", dataset, "--size", size, f"--eye={said[0]}", f"--target={said[1]}", "-o", out],
                   check=True, capture_output=True)
    return out.stat().st_size


means = {size: [] for size in SIZES}
print("| dataset | " + " | ".join(SIZES) + " |\n|---|" + "---|" * len(SIZES))
with tempfile.TemporaryDirectory() as folder:
    for dataset in sys.argv[1:]:
        cells = []
        for size in SIZES:
            found = [measure(dataset, size, eye, target, folder) for eye, target in views(dataset)]
            means[size].append(statistics.fmean(found))
            cells.append(f"{means[size][-1] / 1e3:.0f} ({min(found) / 1e3:.0f} to {max(found) / 1e3:.0f})")
        print(f"| {pathlib.Path(dataset).stem} | " + " | ".join(cells) + " |", flush=True)
print("| mean | " + " | ".join(f"{statistics.fmean(found) / 1e3:.0f}" for found in means.values()) + " |")
