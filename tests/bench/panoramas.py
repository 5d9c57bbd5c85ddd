#!/usr/bin/env python3
"""Colours from stations' maps beside the splats' own: accuracy, splats, bytes and time, whole and pruned.

usage: panoramas.py [SCENE…] [--points N] [--width W] [--size WxH] [--repeats N] [--quick] [--keep DIR]
       panoramas.py --scan FILE --views FILE [--panoramas PATH] [--repeats N] [--quick] [--keep DIR]

SCENE (courtyard) is one of `splatd synth`'s that is scanned from tripods; its truth is exact. FILE is a scan of which no
truth is known: the reference is the render of all its points with their own colours and 16 samples a pixel. Each dataset
is drawn with every splat (lod 0), at lod 1, and, where it is whole, at 4 and 10; maps come from panoramas, or from the
scan's own colours alone. Prints a table in Markdown for each scan;
its first line of a dataset says how large it is, in MB and as a share of the dataset without maps and with all splats.
--quick draws lod 0 once and leaves time out of account. --keep: where scans and datasets go, and are found again.

environment: SPLATD_BINARY (splatd)
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

SPLATD = os.environ.get("SPLATD_BINARY", "splatd")
# name, options of pack: PICTURES stands for where panoramas lie
PACKED = (("no maps", ["--no-panoramas"]), ("panoramas", ["--panoramas", "PICTURES"]),
          ("panoramas, 1/10", ["--panoramas", "PICTURES", "--prune", "10"]),
          ("panoramas, 1/100", ["--panoramas", "PICTURES", "--prune", "100"]),
          ("scan alone", ["--panoramas", "scan"]), ("scan alone, 1/10", ["--panoramas", "scan", "--prune", "10"]),
          ("scan alone, 1/100", ["--panoramas", "scan", "--prune", "100"]))
SHOWN = ("wall", "plaque")  # views whose figures stand beside those of all
REFERENCE = (("color", "png"), ("depth", "npy"), ("normal", "npy"), ("coverage", "npy"))


def run(*arguments):
    print("$ splatd " + " ".join(str(a) for a in arguments), file=sys.stderr)
    return subprocess.run([SPLATD, *map(str, arguments)], check=True, stdout=subprocess.PIPE).stdout


def make_scene(scene, o, folder):
    """Scan, panoramas, views and truth of a scene; what is there already is kept."""
    views, scan = folder / "views.json", folder / f"{scene}.ptx"
    if not scan.exists():
        run("synth", scene, "--points", o.points, "--seed", 1, "--format", "ptx", "--panoramas", o.width, "-o", folder)
    if not (folder / "truth").exists():
        views.write_bytes(run("synth", scene, "--print-views", "--size", o.size))
        run("synth", scene, "--views", views, "-o", folder)
    return scan, folder / "panoramas", views, folder / "truth"


def make_reference(dataset, views, folder):
    """What all points show with their own colours: images as `splatd synth --views` writes them."""
    folder.mkdir(parents=True, exist_ok=True)
    for view in json.loads(views.read_text(encoding="utf-8"))["views"]:
        camera = view["camera"]
        place = [f"--{key}={','.join(repr(x) for x in camera[key])}" for key in ("eye", "target", "up") if key in camera]
        for layer, ending in REFERENCE:
            run("render", dataset, *place, "--fov", camera["fov"], "--size", f"{view['width']}x{view['height']}", "--layer",
                layer, "--lod", 0, "--supersample", 4, "--background", "transparent", "-o",
                folder / f"{view['name']}.{layer}.{ending}")
    return folder


def bench(dataset, views, truth, lods, repeats):
    """bench.json of method splat, with maps and without where the dataset has them."""
    out = dataset.with_name(dataset.stem + "-bench")
    run("bench", dataset, "--views", views, "--reference", truth, "--method", "splat", "--lod", lods, "--supersample", 1,
        "--repeats", repeats, "--no-profile", "--restart", "-o", out)
    return json.loads((out / "bench.json").read_text(encoding="utf-8"))


def pooled(point, names):
    """dB over all pixels of these views together."""
    errors = [10 ** (-v["accuracy"]["psnr"] / 10) if v["accuracy"]["psnr"] != "equal" else 0
              for v in point["views"] if v["view"] in names]
    return -10 * math.log10(sum(errors) / len(errors)) if errors and sum(errors) else math.inf


def pair(without, with_maps, value, decimals):
    """`value` of the point without maps and of the one with them; either may be missing."""
    shown = [f"{value(p):.{decimals}f}" if p and value(p) is not None else "–" for p in (without, with_maps)]
    return " → ".join(shown) if with_maps else shown[0]


def rows(name, dataset, report, plain_bytes):
    """Markdown, a line a level."""
    points = {}
    for p in report["points"]:
        points.setdefault(p["lod"], {})[p.get("maps", "off")] = p
    size = dataset.stat().st_size
    named = {v["view"] for v in report["points"][0]["views"]}
    for i, (lod, by_maps) in enumerate(sorted(points.items())):
        off, on = by_maps.get("off"), by_maps.get("on")
        gain = f"{on['psnr_overall'] - off['psnr_overall']:+.2f}" if on and off else ""
        cells = [name if not i else "", f"{size / 1e6:.1f}, {100 * size / plain_bytes:.0f} %" if not i else "", f"{lod:g}",
                 f"{(on or off)['splats']:,.0f}", pair(off, on, lambda p: p["psnr_overall"], 2), gain]
        cells += [pair(off, on, lambda p, v=view: pooled(p, {v}), 1) for view in SHOWN if view in named]
        cells += [pair(off, on, lambda p, k=key: None if p[k] is None else 100 * p[k], 2)
                  for key in ("halo", "see_through", "depth_beyond")]
        cells += [pair(off, on, lambda p: p["depth_rmse"], 3), pair(off, on, lambda p: p["ms"], 0)]
        print("| " + " | ".join(cells) + " |", flush=True)


def measure(title, scan, pictures, views, truth, o, folder):
    """One table."""
    names = {v["name"] for v in json.loads(views.read_text(encoding="utf-8"))["views"]}
    heads = ["dataset", "MB, of no maps", "lod", "splats drawn", "PSNR, dB: colours → maps", "gain"]
    heads += [view for view in SHOWN if view in names] + ["halo %", "see-through %", "beyond %", "depth rmse", "ms"]
    plain = folder / "no-maps.spld"
    print(f"\n{title}\n\n| " + " | ".join(heads) + " |\n|" + "---|" * len(heads), flush=True)
    for name, options in PACKED:
        if "PICTURES" in options and not pictures:
            continue
        dataset = folder / (name.replace(", 1/", "-").replace(" ", "-") + ".spld")
        if not dataset.exists():
            run("pack", scan, *[pictures if word == "PICTURES" else word for word in options], "-o", dataset)
        if not truth.exists():
            make_reference(plain, views, truth)
        lods = "0" if o.quick else "0,1" if "1/" in name else "0,1,4,10"
        report = bench(dataset, views, truth, lods, 1 if o.quick else o.repeats)
        rows(name, dataset, report, plain.stat().st_size)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--points", default="1000000")
    parser.add_argument("--width", default="4096")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--repeats", default=3, type=int)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--keep", type=pathlib.Path)
    for path in ("scan", "panoramas", "views"):
        parser.add_argument(f"--{path}", type=pathlib.Path)
    o = parser.parse_args()
    if bool(o.scan) != bool(o.views) or (o.scan and o.scenes) or (o.panoramas and not o.scan):
        parser.error("--scan and --views go together, without a SCENE; --panoramas goes with them")
    with tempfile.TemporaryDirectory() as temporary:
        root = o.keep or pathlib.Path(temporary)
        if o.scan:
            folder = root / o.scan.stem
            folder.mkdir(parents=True, exist_ok=True)
            measure(f"{o.scan.name}, against all its points with their own colours", o.scan, o.panoramas, o.views,
                    folder / "truth", o, folder)
        for scene in [] if o.scan else o.scenes or ["courtyard"]:
            folder = root / scene
            folder.mkdir(parents=True, exist_ok=True)
            scan, pictures, views, truth = make_scene(scene, o, folder)
            measure(f"{scene}, {int(float(o.points)):,} points, panoramas {o.width} wide, {o.size}, exact truth", scan,
                    pictures, views, truth, o, folder)


main()
