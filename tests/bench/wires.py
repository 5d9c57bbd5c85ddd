"""Thin things beside the truth: how many of a scene's wire pixels a method draws, and what it spans between them.

usage: wires.py SCENE DATASET.spld VIEWS.json TRUTH FINE METHOD[,METHOD...] [PICTURES]

VIEWS.json is what `splatd synth SCENE --print-views` wrote, TRUTH the folder truth/ that `splatd synth SCENE --views` made of
it, FINE the same of the views at a whole multiple of that size: a wire thinner than a pixel is seen by some of its samples, and
the truth's one a pixel says in one pixel of several that it is there. A wire pixel is one whose object is a wire: it is found where the method's depth in it or a pixel beside it lies within
5 % of the wire's (a scan's noise and a pixel's rounding move a wire by less). Film is counted in pixels 2 to 8 off a wire
that see something else or the sky and are 2 off any wire of FINE: those whose depth lies within 5 % of that wire's. Holes are covered pixels of the truth without
depth; false ones those of the sky with depth. PICTURES: a folder for truth beside image, of each view and method.
Needs NumPy and Pillow. SPLATD_BINARY names the program (splatd)."""
import json
import os
import pathlib
import subprocess
import sys

import numpy as np
from PIL import Image

SPLATD = os.environ.get("SPLATD_BINARY", "splatd")
WIRES = {"railway": (6, 7, 8), "powerline": (11, 12)}  # messenger and contact wires, droppers; conductors, ground wire
CLOSE = 0.05


def numbers(values):
    return ",".join(repr(v) for v in values)


def render(dataset, view, method, layer, path):
    camera = view["camera"]
    subprocess.run([SPLATD, "render", dataset, "--eye", numbers(camera["eye"]), "--target", numbers(camera["target"]), "--fov",
                    repr(camera["fov"]), "--size", f"{view['width']}x{view['height']}", "--method", method, "--layer", layer,
                    "-o", path], check=True, capture_output=True)


def shifted(image, x, y, fill):
    out = np.full_like(image, fill)
    h, w = image.shape
    out[max(y, 0):h + min(y, 0), max(x, 0):w + min(x, 0)] = image[max(-y, 0):h + min(-y, 0), max(-x, 0):w + min(-x, 0)]
    return out


def nearest_wire(depth, reach):
    """Depth of a wire pixel within `reach`, NaN where none is."""
    out = np.full_like(depth, np.nan)
    for y in range(-reach, reach + 1):
        for x in range(-reach, reach + 1):
            out = np.where(np.isnan(out), shifted(depth, x, y, np.nan), out)
    return out


def near_fine(fine, wires, shape):
    """Pixels that a wire crosses, as FINE's samples see it, and those beside them."""
    n = fine.shape[0] // shape[0]
    crossed = np.isin(fine, wires).reshape(shape[0], n, shape[1], n).any(axis=(1, 3))
    return np.any([shifted(crossed, x, y, False) for x in (-1, 0, 1) for y in (-1, 0, 1)], axis=0)


def measure(truth, ids, fine, wires, depth):
    wire = np.where(np.isin(ids, wires), truth, np.nan)
    is_wire = ~np.isnan(wire)
    found = np.zeros_like(is_wire)
    for y in (-1, 0, 1):
        for x in (-1, 0, 1):
            found |= np.abs(shifted(depth, x, y, np.nan) - wire) < CLOSE * wire
    beside = nearest_wire(wire, 8)
    band = ~np.isnan(beside) & ~near_fine(fine, wires, ids.shape) & ~(np.abs(truth - beside) < 2 * CLOSE * beside)
    film = band & (np.abs(depth - beside) < CLOSE * beside)
    seen = ~np.isnan(truth)
    return np.array([is_wire.sum(), (found & is_wire).sum(), band.sum(), film.sum(), seen.sum(), (seen & np.isnan(depth)).sum(),
                     (~seen).sum(), (~seen & ~np.isnan(depth)).sum()], float)


def percent(part, of):
    return f"{100 * part / of:6.2f}" if of else "     -"


def main(scene, dataset, views, truth, fine, methods, pictures=None):
    truth, fine = pathlib.Path(truth), pathlib.Path(fine)
    wires = WIRES[scene]
    print("method  view                wires  found %  film %  holes %  false %")
    for method in methods.split(","):
        total = 0
        for view in json.loads(pathlib.Path(views).read_text())["views"]:
            name = view["name"]
            render(dataset, view, method, "depth", "wires.npy")
            row = measure(np.load(truth / f"{name}.depth.npy"), np.load(truth / f"{name}.id.npy"),
                          np.load(fine / f"{name}.id.npy"), wires, np.load("wires.npy"))
            total = total + row
            print_row(method, name, row)
            if pictures:
                path = pathlib.Path(pictures) / f"{scene}-{name}-{method}.png"
                render(dataset, view, method, "color", path)
                pair = [Image.open(p).convert("RGB") for p in (truth / f"{name}.color.png", path)]
                both = Image.new("RGB", (2 * pair[0].width + 4, pair[0].height), "white")
                both.paste(pair[0], (0, 0))
                both.paste(pair[1], (pair[0].width + 4, 0))
                both.save(path)
        print_row(method, "all", total)


def print_row(method, name, row):
    print(f"{method:8}{name:18}{int(row[0]):7}  {percent(row[1], row[0])}  {percent(row[3], row[2])}   {percent(row[5], row[4])}"
          f"   {percent(row[7], row[6])}", flush=True)


main(*sys.argv[1:])
