#!/usr/bin/env python3
"""Soft transparency beside plain splatting on scans: table 1 of the soft-transparency paper, as ratios of frame times.

usage: soft.py [SCAN…] [--device LIST] [--size WxH] [--frames N] [--models LIST] [--quick] [--pictures] [--keep DIR]

SCAN (street, trees, autzen, powerline, courtyard, interior, interior-panels) says what is soft and from where one
looks; the last three are `splatd synth`'s. Prints a table in Markdown, a line for each scan and backend: how many
splats a frame draws where all is solid, how many spheres where some is soft, and which share that is (of panels each
cell is one); the splat frame in ms, by the host's clock and by processor time of all threads; then layer, express and
base, each as a quotient of the splat frame that was drawn in turn with it, by both clocks, and for express what the
soft stage has of its frame. Where others work on the machine read processor time. What is refused, or takes longer
than ten minutes, is –; base has two frames. --quick: 640x360, 3 frames, no base. --pictures: no table; both views of
each scan plain, soft, and without what is soft, as PNG in DIR, and the first two beside each other as JPEG (needs
ffmpeg). --keep: where datasets go, and are found again.

environment: SPLATD_BINARY (splatd), SPLATD_DATA (real scans; those that are not there are left out)
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from datasets import SPLATD, place_of, run

DATA = pathlib.Path(os.environ.get("SPLATD_DATA", "nowhere"))
MODELS = ("layer", "express", "base")
PATIENCE = 600  # seconds


def view(eye, target, fov):
    return {"eye": eye, "target": target, "up": [0, 0, 1], "vfov_deg": fov, "near": 0.05, "far": 5000}


# source, options of pack, what is soft, strength, first and last view
SCANS = {
    "street": ("mls/street.las.zst", [], "uncertainty>q0.8", 0.1, view([406132.26, 7405434.06, 548.5], [406152.2, 7405467.3, 527.3], 45),
               view([406140, 7405446, 530], [406156, 7405478, 526], 50)),
    "trees": ("trees/pine_plot.laz", [], "uncertainty>q0.5", 0.1, view([-3.5, -9.3, 66.2], [5, 5, 57.1], 45),
              view([-1, -6, 52], [5, 5, 57], 50)),
    "autzen": ("als/autzen_trim.las", [], "number_of_returns>1", 0.15, view([636114, 848376, 970], [636601, 849187, 451], 45),
               view([636500, 848800, 600], [636750, 849200, 430], 45)),
    "powerline": ("als/powerline.laz", [], "class:5", 0.15, view([228860, 578230, 35], [228930, 578480, 15], 45),
                  view([228880, 578420, 28], [228940, 578500, 8], 50)),
    "courtyard": ("courtyard", [], "box:-7,0.2,2.2,-1.5,5.4,6.5", 0.1, view([6, -6.5, 5.5], [-3, 2.6, 2.5], 50),
                  view([-0.4, -1, 1.6], [-4, 2.6, 3.1], 60)),
    **{name: ("interior", options, "plane:0,0,2.3,0,0,1>0 or plane:0,0.1,0,0,-1,0>0", 0.1,
              view([3, -4, 6.5], [4, 2.4, 0.8], 50), view([9, -3, 5], [4, 2.4, 0.8], 50))
       for name, options in (("interior", []), ("interior-panels", ["--primitives", "all"]))},
}


def source_of(name, folder):
    """The scan's file, None where there is none."""
    source = SCANS[name][0]
    if "/" not in source:
        scan = folder / f"{source}.ptx"
        if not scan.exists():
            run("synth", source, "--seed", 1, "--points", 1000000, "--format", "ptx", "-o", folder)
        return scan
    scan = DATA / source
    if not scan.exists():
        return None
    if scan.suffix == ".zst":
        plain = folder / scan.stem
        if not plain.exists():
            subprocess.run(["zstd", "-q", "-d", "-f", scan, "-o", plain], check=True)
        return plain
    return scan


def dataset_of(name, folder):
    dataset = folder / f"{name}.spld"
    if not dataset.exists():
        scan = source_of(name, folder)
        if not scan:
            return None
        run("pack", scan, *SCANS[name][1], "-o", dataset)
    return dataset


def bench(name, dataset, model, o):
    """Rows of bench by what is soft, solid and `model`; None where it is refused."""
    _, _, term, strength, first, last = SCANS[name]
    path = []
    if first:
        views = dataset.with_suffix(".views.json")
        views.write_text(json.dumps({name: {"overview": first, "close": last}}))
        path = ["--views", views, "--set", name]
    command = [SPLATD, "bench", dataset, *path, "--device", o.backend, "--size", o.size, "--frames",
               2 if model == "base" else o.frames, "--soft", term,
               "--soft-opacity", strength, "--soft-model", model, "--json"]
    print("$ " + " ".join(map(str, command)), file=sys.stderr)
    try:
        done = subprocess.run([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        print(done.stderr, file=sys.stderr)
        if "soft_model" in done.stderr:
            return None
        sys.exit(f"{name}: bench failed")
    return {row["soft"]: row for row in json.loads(done.stdout)["rows"]}


def quotient(rows, model):
    if not rows:
        return "–"
    solid, soft = rows["solid"], rows[model]
    clock, processor = (f"{a / b:.2f}" for a, b in ((soft["frame_ms"]["median"], solid["frame_ms"]["median"]),
                                                    (soft["processor_ms"], solid["processor_ms"])))
    return f"{clock}, {processor}"


def measure(name, dataset, o):
    found = {model: bench(name, dataset, model, o) for model in o.models}
    rows = found["express"]
    solid, soft = rows["solid"], rows["express"]
    info = json.loads(run("info", dataset, "--json"))
    spheres, splats = soft["spheres_drawn"], soft["splats_drawn"]
    cells = [name, o.backend, f"{info['points']:,}", f"{solid['splats_drawn']:,.0f}", f"{spheres:,.0f}",
             "cells" if solid["panels_drawn"] else f"{100 * spheres / max(splats, 1):.0f} %",
             f"{solid['frame_ms']['median']:.0f}, {solid['processor_ms']:.0f}", quotient(found.get("layer"), "layer"),
             quotient(rows, "express"), f"{100 * soft['passes_ms']['soft'] / soft['frame_ms']['median']:.0f} %",
             quotient(found.get("base"), "base")]
    print("| " + " | ".join(cells) + " |", flush=True)


def picture(name, dataset, o):
    _, _, term, strength, first, last = SCANS[name]
    for number, place in enumerate((first, last)):
        where = ["--size", o.size]
        if place:
            where = place_of({"camera": {k: place[k] for k in ("eye", "target", "up")} | {"fov": place["vfov_deg"]},
                              "width": o.size.split("x")[0], "height": o.size.split("x")[1]})
        for model, soft in (("plain", []), ("soft", ["--soft", term, "--soft-opacity", strength]),
                            ("without", ["--soft", term, "--soft-opacity", 0])):
            run("render", dataset, *where, *soft, "--device", o.backend, "-o", o.folder / f"{name}-{number}-{model}.png")
        parts = [part for model in ("plain", "soft") for part in ("-i", o.folder / f"{name}-{number}-{model}.png")]
        subprocess.run(["ffmpeg", "-v", "error", "-y", *parts, "-filter_complex", "hstack", "-q:v", "4",
                        o.folder / f"{name}-{number}.jpg"], check=True)


def main():
    parser = argparse.ArgumentParser(usage=__doc__.replace("%", "%%"))
    parser.add_argument("scans", nargs="*")
    parser.add_argument("--device", default="vulkan,egl")
    parser.add_argument("--size")
    parser.add_argument("--frames", type=int)
    parser.add_argument("--models")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--pictures", action="store_true")
    parser.add_argument("--keep", type=pathlib.Path)
    o = parser.parse_args()
    for name in o.scans:
        if name not in SCANS:
            parser.error(f"'{name}' is none of {', '.join(SCANS)}")
    o.models = o.models.split(",") if o.models else [m for m in MODELS if not (o.quick and m == "base")]
    if "express" not in o.models or set(o.models) - set(MODELS):
        parser.error("--models is express and any of layer, base")
    o.size = o.size or ("640x360" if o.quick else "1280x720")
    o.frames = o.frames or (3 if o.quick else 8)
    with tempfile.TemporaryDirectory() as temporary:
        o.folder = o.keep or pathlib.Path(temporary)
        o.folder.mkdir(parents=True, exist_ok=True)
        if not o.pictures:
            print(f"{o.size}, {o.frames} frames; quotients by the clock, by processor time\n")
            print("| scan | backend | points | splats | spheres | soft | splat ms: clock, processor | layer | express | "
                  "soft stage of it | base |\n|" + "---|" * 11, flush=True)
        for name in o.scans or SCANS:
            dataset = dataset_of(name, o.folder)
            if not dataset:
                print(f"{name}: no {DATA / SCANS[name][0]}", file=sys.stderr)
                continue
            for o.backend in o.device.split(","):
                (picture if o.pictures else measure)(name, dataset, o)


main()
