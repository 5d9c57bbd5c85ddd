#!/usr/bin/env python3
"""Colours from stations' maps beside the splats' own: accuracy, splats, bytes and time, whole and pruned.

usage: panoramas.py [SCENE…] [--points N] [--width W] [--size WxH] [--repeats N] [--quick] [--only NAME] [--keep DIR]
       panoramas.py --scan FILE --views FILE [--panoramas PATH] [--repeats N] [--quick] [--only NAME] [--keep DIR]

SCENE (courtyard) is one of `splatd synth`'s that is scanned from tripods; its truth is exact. FILE is a scan of which no
truth is known: the reference is the render of all its points with their own colours and 16 samples a pixel. Each dataset
is drawn with every splat (lod 0), at lod 1, and, where it is whole, at 4 and 10; maps come from panoramas, or from the
scan's own colours alone. Prints a table in Markdown for each scan; its first line of a dataset says how large it is, in MB
and as a share of the dataset without maps and with all splats. Maps are compared twice: with the colours of the same
splats, or panels, and, with every splat drawn, with as many points of the scan, each 10th or 100th, packed without maps.
--quick draws lod 0 once and leaves time out of account. --only: rows whose dataset's name has it. --keep: where scans and
datasets go, and are found again.

environment: SPLATD_BINARY (splatd)
"""
import argparse
import json
import math
import pathlib
import tempfile

from datasets import bench, make_reference, make_scene, run

# name, options of pack: PICTURES stands for where panoramas lie, SHARE for as many points as the name says
PACKED = (("no maps", ["--no-panoramas"]), ("every 10th point, 1/10", ["--no-panoramas", "--max-points", "SHARE"]),
          ("every 100th point, 1/100", ["--no-panoramas", "--max-points", "SHARE"]),
          ("panoramas", ["--panoramas", "PICTURES"]),
          ("panoramas, primitives", ["--panoramas", "PICTURES", "--primitives", "all"]),
          ("panoramas, primitives, 1/10", ["--panoramas", "PICTURES", "--primitives", "all", "--prune", "10"]),
          ("panoramas, 1/10", ["--panoramas", "PICTURES", "--prune", "10"]),
          ("panoramas, 1/100", ["--panoramas", "PICTURES", "--prune", "100"]),
          ("scan alone", ["--panoramas", "scan"]), ("scan alone, 1/10", ["--panoramas", "scan", "--prune", "10"]),
          ("scan alone, 1/100", ["--panoramas", "scan", "--prune", "100"]))
SHOWN = ("wall", "plaque")  # views whose figures stand beside those of all


def pooled(point, names):
    """dB over all pixels of these views together."""
    errors = [10 ** (-v["accuracy"]["psnr"] / 10) if v["accuracy"]["psnr"] != "equal" else 0
              for v in point["views"] if v["view"] in names]
    return -10 * math.log10(sum(errors) / len(errors)) if errors and sum(errors) else math.inf


def pair(without, with_maps, value, decimals):
    """`value` of the point without maps and of the one with them; either may be missing."""
    shown = [f"{value(p):.{decimals}f}" if p and value(p) is not None else "–" for p in (without, with_maps)]
    return " → ".join(shown) if with_maps else shown[0]


def share_of(name):
    """N of a name that ends in 1/N, else 1."""
    return int(name.partition("1/")[2] or 1)


def rows(name, dataset, report, plain_bytes, as_many):
    """Markdown, a line a level; as_many: dB of as many points of the scan with their own colours."""
    points = {}
    for p in report["points"]:
        points.setdefault(p["lod"], {})[p.get("maps", "off")] = p
    size = dataset.stat().st_size
    named = {v["view"] for v in report["points"][0]["views"]}
    for i, (lod, by_maps) in enumerate(sorted(points.items())):
        off, on = by_maps.get("off"), by_maps.get("on")
        gain = f"{on['psnr_overall'] - off['psnr_overall']:+.2f}" if on and off else ""
        over = f"{on['psnr_overall'] - as_many:+.2f}" if on and not lod else ""
        cells = [name if not i else "", f"{size / 1e6:.1f}, {100 * size / plain_bytes:.0f} %" if not i else "", f"{lod:g}",
                 f"{(on or off)['splats']:,.0f}", pair(off, on, lambda p: p["psnr_overall"], 2), gain, over]
        cells += [pair(off, on, lambda p, v=view: pooled(p, {v}), 1) for view in SHOWN if view in named]
        cells += [pair(off, on, lambda p, k=key: None if p[k] is None else 100 * p[k], 2)
                  for key in ("halo", "see_through", "depth_beyond")]
        cells += [pair(off, on, lambda p: p["depth_rmse"], 3), pair(off, on, lambda p: p["ms"], 0)]
        print("| " + " | ".join(cells) + " |", flush=True)


def measure(title, scan, pictures, views, truth, o, folder):
    """One table."""
    names = {v["name"] for v in json.loads(views.read_text(encoding="utf-8"))["views"]}
    heads = ["dataset", "MB, of no maps", "lod", "splats drawn", "PSNR, dB: colours → maps", "gain", "over as many points"]
    heads += [view for view in SHOWN if view in names] + ["halo %", "see-through %", "beyond %", "depth rmse", "ms"]
    plain, drawn = folder / "no-maps.spld", {}  # drawn: dB of points' colours, by their share of the scan
    print(f"\n{title}\n\n| " + " | ".join(heads) + " |\n|" + "---|" * len(heads), flush=True)
    for name, options in PACKED:
        if ("PICTURES" in options and not pictures) or ("--no-panoramas" not in options and o.only not in name):
            continue
        share, dataset = share_of(name), folder / (name.replace(", 1/", "-").replace(", ", "-").replace(" ", "-") + ".spld")
        if not dataset.exists():
            words = {"PICTURES": pictures}
            if "SHARE" in options:
                words["SHARE"] = json.loads(run("info", plain, "--json"))["points"] // share
            run("pack", scan, *[words.get(word, word) for word in options], "-o", dataset)
        if o.scan:
            make_reference(plain, views, truth)
        lods = "0" if o.quick else "0,1" if "1/" in name else "0,1,4,10"
        report = bench(dataset, views, truth, lods, 1 if o.quick else o.repeats)
        if "--no-panoramas" in options:
            drawn[share] = next(p["psnr_overall"] for p in report["points"] if not p["lod"])
        rows(name, dataset, report, plain.stat().st_size, drawn[share])


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--points", default="1000000")
    parser.add_argument("--width", default="4096")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--repeats", default=3, type=int)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="")
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
            scan, views, truth = make_scene(scene, folder, o.size, "--points", o.points, "--panoramas", o.width)
            pictures = folder / "panoramas"
            measure(f"{scene}, {int(float(o.points)):,} points, panoramas {o.width} wide, {o.size}, exact truth", scan,
                    pictures, views, truth, o, folder)


main()
