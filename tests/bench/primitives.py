#!/usr/bin/env python3
"""Panels and lines beside splats alone: bytes, accuracy, depth of what is drawn as panels, time.

usage: primitives.py [SCENE…] [--points N] [--noise SIGMA] [--size WxH] [--repeats N] [--lods LIST] [--keep DIR]
       primitives.py --scan FILE --views FILE [--repeats N] [--lods LIST] [--keep DIR]
       either with --levels

SCENE (courtyard, interior, steps, thin-walls) is one of `splatd synth`'s; its truth is exact. FILE is a scan of which no
truth is known: the reference is the render of all its points as splats with 16 samples a pixel. Each is packed without
primitives, with all, and with all and a bound of 10 mm. Prints two tables in Markdown for each scan: bytes, then
accuracy by lod (0, 1) and method. Sizes are MB and shares of those of splats alone; geometry is all but colour and
optional attributes, and panels stand by themselves, since their bytes are both. Depths are of pixels of layer primitive
that are panels, along the axis against the truth's; pixels where the truth has nothing, or something else (beyond 0.5 m)
behind an edge, are not in median and 99 %, but count as outside of the bound. --keep: where scans and datasets go, and
are found again. --levels prints other tables instead, of what is packed with all: how many of each kind each level has,
with bytes by the mean of their kind, and accuracy by lod (0, 1, 2, 4, 8, 16) of it and of splats alone, method splat,
with how many of each kind all views draw of it and their share of those of the finest.

environment: SPLATD_BINARY (splatd)
"""
import argparse
import array
import ast
import json
import pathlib
import re
import subprocess
import tempfile

from datasets import SPLATD, bench, make_reference, make_scene, place_of, run

PACKED = (("splats", ["--primitives", "off"]), ("all", ["--primitives", "all"]),
          ("all, 10 mm", ["--primitives", "all", "--error", "10mm"]))
METHODS = ("splat", "nearest")
DRAWN = ("splats", "panels", "meshes", "lines")  # as render counts them
GEOMETRY = ("position", "radius", "normal", "linear", "clip", "lines", "chunk")
PANEL = 3   # of layer primitive
EDGE = 0.5  # metres: what is farther off is another surface


def read_npy(path):
    """Its numbers, row by row; 32 bit."""
    data = path.read_bytes()
    start = 10 + int.from_bytes(data[8:10], "little")
    kind = {"<f4": "f", "<u4": "I"}[ast.literal_eval(data[10:start].decode("latin-1"))["descr"]]
    numbers = array.array(kind)
    numbers.frombytes(data[start:])
    return numbers


def sizes(info):
    """MB: geometry, colour, panels with meshes, all."""
    primitives = any(info["primitives"][kind]["count"] for kind in ("panels", "meshes"))
    splats = info["leaf_splats"] if primitives else info["splats"]
    bits = info["bytes_per_splat"]
    mb = lambda names: sum(bits.get(name, 0) for name in names) * splats / 1e6
    return {"geometry": mb(GEOMETRY), "colour": mb(["color"]), "panels": mb(["panels", "meshes"]), "file": info["file_bytes"] / 1e6}


def share(value, whole):
    return f"{value:.2f}, {100 * value / whole:.0f} %" if whole else f"{value:.2f}"


def size_row(name, info, plain):
    own, panels, meshes = sizes(info), info["primitives"]["panels"], info["primitives"]["meshes"]
    cells = [name, share(own["file"], plain["file"]), share(own["geometry"], plain["geometry"]), f"{own['colour']:.2f}",
             f"{own['panels']:.2f}", share(own["geometry"] + own["colour"] + own["panels"], plain["geometry"] + plain["colour"]),
             f"{100 * (panels['points'] + meshes['points']) / info['leaf_splats']:.1f}",
             f"{panels['count'] + meshes['count']:,}",
             f"{info['primitives']['lines']['count']:,}", f"{info['splats']:,}"]
    print("| " + " | ".join(cells) + " |", flush=True)


def depth_errors(dataset, views, truth, folder, method, lod):
    """Sorted distances of panels' pixels to the truth, and how many pixels have no such truth."""
    errors, without = array.array("d"), 0
    for view in json.loads(views.read_text(encoding="utf-8"))["views"]:
        layers = {}
        for layer in ("primitive", "depth"):
            layers[layer] = folder / f"seen.{layer}.npy"
            run("render", dataset, *place_of(view), "--method", method, "--lod", lod, "--supersample", 1, "--layer", layer,
                "-o", layers[layer])
        seen, depths = (read_npy(layers[layer]) for layer in ("primitive", "depth"))
        for shape, depth, wanted in zip(seen, depths, read_npy(truth / f"{view['name']}.depth.npy")):
            if shape != PANEL:
                continue
            off = abs(depth - wanted)
            if off <= EDGE:  # false where there is none
                errors.append(off)
            else:
                without += 1
    return sorted(errors), without


def depth_cells(info, found):
    errors, without = found
    if not errors:
        return ["–", "–", "–"]
    bound = info["primitives"]["panels"]["packed"]["error_bound"]
    within = sum(error <= bound for error in errors) / (len(errors) + without)
    at = lambda part: errors[min(int(part * len(errors)), len(errors) - 1)]
    return [f"{1e3 * at(0.5):.1f}", f"{1e3 * at(0.99):.0f}", f"{100 * within:.1f} of {1e3 * bound:.0f} mm"]


def ratio(value, usual):
    return f"{value:.0f}, {value / usual:.2f} ×" if usual else f"{value:.0f}"


def accuracy_rows(name, dataset, info, views, truth, o, folder, plain):
    """A line for each lod and method; plain: ms of splats alone by these, which they fill."""
    report = bench(dataset, views, truth, o.lods, o.repeats, ",".join(METHODS))
    for p in sorted(report["points"], key=lambda p: (p["lod"], METHODS.index(p["method"]))):
        key = p["lod"], p["method"]
        found = depth_errors(dataset, views, truth, folder, p["method"], p["lod"]) if info["panels"] else ([], 0)
        cells = [name, f"{p['lod']:g}", p["method"], f"{p['psnr_overall']:.2f}", f"{p['ssim']:.4f}",
                 "–" if p["halo"] is None else f"{100 * p['halo']:.2f}", *depth_cells(info, found),
                 ratio(p["ms"], plain.get(key))]
        plain.setdefault(key, p["ms"])
        print("| " + " | ".join(cells) + " |", flush=True)


def table(heads):
    print("\n| " + " | ".join(heads) + " |\n|" + "---|" * len(heads), flush=True)


def measure(title, scan, views, truth, o, folder):
    """Both tables of a scan."""
    packed = []
    for name, options in PACKED:
        dataset = folder / (name.replace(", ", "-").replace(" ", "") + ".spld")
        if not dataset.exists():
            run("pack", scan, "--no-panoramas", *options, "-o", dataset)
        info = json.loads(run("info", dataset, "--json"))
        info["panels"] = info["primitives"]["panels"]["count"]
        packed.append((name, dataset, info))
    if o.scan:
        make_reference(packed[0][1], views, truth)
    print(f"\n{title}")
    table(["packed", "MB, of splats'", "geometry", "colour", "panels", "these three", "points on panels %", "panels",
           "pieces of lines", "splats"])
    for name, _, info in packed:
        size_row(name, info, sizes(packed[0][2]))
    table(["packed", "lod", "method", "PSNR, dB", "SSIM", "halo %", "panels' depth: median mm", "99 % mm", "within %", "ms"])
    plain = {}
    for name, dataset, info in packed:
        accuracy_rows(name, dataset, info, views, truth, o, folder, plain)


def level_rows(info):
    """A line for each level: counts and MB of each kind, and both as shares of the level with most of it."""
    kinds, levels = ("splats", "panels", "meshes", "pieces"), info["by_level"]
    known = info["primitives"]
    size = {kind: known[kind]["bytes"] / max(known[kind]["count"], 1) for kind in ("panels", "meshes")}
    size["pieces"] = known["lines"]["bytes"] / max(known["lines"]["count"], 1)
    size["splats"] = (info["file_bytes"] - sum(part["bytes"] for part in known.values())) / max(info["splats"], 1)
    most = {kind: max(level[kind] for level in levels) for kind in kinds}
    for i, level in enumerate(levels):
        cells = [f"{level[k]:,}, {level[k] * size[k] / 1e6:.3f}, {100 * level[k] / max(most[k], 1):.0f} %" for k in kinds]
        print("| " + " | ".join([str(i), str(level["nodes"]), f"{1000 * level['spacing']:.0f}", *cells]) + " |", flush=True)


def drawn(dataset, views, lod):
    """How many of each kind all views draw together."""
    counts = dict.fromkeys(DRAWN, 0)
    with tempfile.TemporaryDirectory() as folder:
        for view in json.loads(views.read_text(encoding="utf-8"))["views"]:
            said = subprocess.run([SPLATD, "render", dataset, *map(str, place_of(view)), "--lod", str(lod), "-o",
                                   f"{folder}/view.png"], check=True, capture_output=True, text=True).stderr
            for count, kind in re.findall(r"(\d+) (" + "|".join(DRAWN) + r")\b", said):
                counts[kind] += int(count)
    return counts


def measure_levels(title, scan, views, truth, o, folder):
    """What each level has, and what coarser ones lose."""
    packed = {}
    for name, options in PACKED[:2]:
        packed[name] = folder / f"{name}.spld"
        if not packed[name].exists():
            run("pack", scan, "--no-panoramas", *options, "-o", packed[name])
    if o.scan:
        make_reference(packed["splats"], views, truth)
    print(f"\n{title}")
    table(["level", "nodes", "spacing mm"] + [f"{k}, MB, of the most" for k in ("splats", "panels", "meshes", "pieces")])
    level_rows(json.loads(run("info", packed["all"], "--json")))
    table(["lod", "splats alone, dB", "off the finest", "all, dB", "off the finest"] + [f"{k} drawn" for k in DRAWN])
    found = {name: {p["lod"]: p["psnr_overall"] for p in bench(dataset, views, truth, o.lods, o.repeats)["points"]}
             for name, dataset in packed.items()}
    seen = {lod: drawn(packed["all"], views, lod) for lod in found["all"]}
    for lod in sorted(found["all"]):
        cells = [f"{lod:g}"]
        for name in ("splats", "all"):
            cells += [f"{found[name][lod]:.2f}", f"{found[name][lod] - found[name][min(found[name])]:+.2f}"]
        cells += [f"{seen[lod][k]:,}, {100 * seen[lod][k] / max(seen[min(seen)][k], 1):.0f} %" for k in DRAWN]
        print("| " + " | ".join(cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(usage=__doc__.replace("%", "%%"))
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--points", default="1000000")
    parser.add_argument("--noise")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--repeats", default=3, type=int)
    parser.add_argument("--lods")
    parser.add_argument("--levels", action="store_true")
    parser.add_argument("--keep", type=pathlib.Path)
    for path in ("scan", "views"):
        parser.add_argument(f"--{path}", type=pathlib.Path)
    o = parser.parse_args()
    o.lods = o.lods or ("0,1,2,4,8,16" if o.levels else "0,1")
    say = measure_levels if o.levels else measure
    if bool(o.scan) != bool(o.views) or (o.scan and o.scenes):
        parser.error("--scan and --views go together, without a SCENE")
    with tempfile.TemporaryDirectory() as temporary:
        root = o.keep or pathlib.Path(temporary)
        for scene in [o.scan.stem] if o.scan else o.scenes or ["courtyard", "interior", "steps", "thin-walls"]:
            folder = root / scene
            folder.mkdir(parents=True, exist_ok=True)
            if o.scan:
                say(f"{o.scan.name}, against all its points as splats", o.scan, o.views, folder / "truth", o, folder)
                continue
            noise = ["--noise", o.noise] if o.noise else []
            scan, views, truth = make_scene(scene, folder, o.size, "--points", o.points, *noise)
            say(f"{scene}, {int(float(o.points)):,} points, noise {o.noise or 'of the scene'}, {o.size}, exact truth",
                scan, views, truth, o, folder)


main()
