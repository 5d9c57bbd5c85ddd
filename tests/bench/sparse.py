"""Methods where a scan has less than a point a pixel: PSNR over the seen pixels that `splatd bench` does not call dense.

usage: sparse.py DATASET.spld VIEWS.json TRUTH METHOD[,METHOD...]

VIEWS.json is what `splatd synth SCENE --print-views` wrote, TRUTH the folder truth/ that `splatd synth SCENE --views` made of
it. Dense as in api/measures.md: of the seen pixels of the 9x9 around it 1 - 1/e show the true surface, within 2 % of its depth,
in an image of every point. Square errors are summed over all views; holes are pixels that the truth covers whole.
Needs NumPy and Pillow. SPLATD_BINARY names the program (splatd)."""
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

SPLATD = os.environ.get("SPLATD_BINARY", "splatd")


def numbers(values):
    return ",".join(repr(v) for v in values)


def render(dataset, view, path, *options):
    camera = view["camera"]
    subprocess.run([SPLATD, "render", dataset, "--eye", numbers(camera["eye"]), "--target", numbers(camera["target"]), "--fov",
                    repr(camera["fov"]), "--size", f"{view['width']}x{view['height']}", *options, "-o", path], check=True,
                   capture_output=True)
    return path


def over_grey(path):
    image = np.array(Image.open(path).convert("RGBA")).astype(int)
    alpha = image[..., 3:]
    return (alpha * image[..., :3] + (255 - alpha) * 128 + 127) // 255


def around(mask):
    """How many of the 9x9 are set; the image ends at its edge."""
    sums = np.pad(mask.astype(int), ((5, 4), (5, 4))).cumsum(0).cumsum(1)
    return sums[9:, 9:] - sums[:-9, 9:] - sums[9:, :-9] + sums[:-9, :-9]


def measure(dataset, view, truth, methods, folder):
    """Rows of seen pixels, sparse ones, their square errors, whole ones among them, holes of those."""
    depth = np.load(truth / f"{view['name']}.depth.npy")
    whole = np.load(truth / f"{view['name']}.coverage.npy") >= 1 - 1 / 8192
    seen = np.isfinite(depth) & (depth > 0)
    points = np.load(render(dataset, view, folder + "/p.npy", "--method", "points", "--layer", "depth", "--lod", "0"))
    hit = seen & (np.abs(points - depth) <= 0.02 * depth)
    sparse = seen & (around(hit) < (1 - 1 / math.e) * around(seen))
    want = over_grey(truth / f"{view['name']}.color.png")
    for method in methods:
        image = over_grey(render(dataset, view, folder + "/c.png", "--method", method, "--background", "transparent"))
        own = np.load(render(dataset, view, folder + "/d.npy", "--method", method, "--layer", "depth"))
        error = ((image - want)**2).mean(2)
        yield np.array([seen.sum(), sparse.sum(), error[sparse].sum(), (sparse & whole).sum(),
                        (sparse & whole & np.isnan(own)).sum()], float)


def main(dataset, views, truth, methods):
    methods = methods.split(",")
    total = np.zeros((len(methods), 5))
    with tempfile.TemporaryDirectory() as folder:
        for view in json.loads(pathlib.Path(views).read_text())["views"]:
            total += np.array(list(measure(dataset, view, pathlib.Path(truth), methods, folder)))
    print("method  sparse %  PSNR, dB  holes %")
    for method, (seen, sparse, error, whole, holes) in zip(methods, total):
        print(f"{method:8}{100 * sparse / seen:8.1f}{10 * math.log10(255**2 * sparse / error):10.2f}{100 * holes / whole:9.2f}")


main(*sys.argv[1:])
