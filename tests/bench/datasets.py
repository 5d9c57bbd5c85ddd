"""What the benchmarks of packed datasets share: scenes with their truth, references of scans without one, bench.json.

environment: SPLATD_BINARY (splatd)
"""
import json
import os
import subprocess
import sys

SPLATD = os.environ.get("SPLATD_BINARY", "splatd")
REFERENCE = (("color", "png"), ("depth", "npy"), ("normal", "npy"), ("coverage", "npy"))


def run(*arguments):
    print("$ splatd " + " ".join(str(a) for a in arguments), file=sys.stderr)
    return subprocess.run([SPLATD, *map(str, arguments)], check=True, stdout=subprocess.PIPE).stdout


def make_scene(scene, folder, size, *scan_options):
    """Scan, views and truth of a scene; what is there already is kept."""
    views, scan = folder / "views.json", folder / f"{scene}.ptx"
    if not scan.exists():
        run("synth", scene, "--seed", 1, "--format", "ptx", *scan_options, "-o", folder)
    if not (folder / "truth").exists():
        views.write_bytes(run("synth", scene, "--print-views", "--size", size))
        run("synth", scene, "--views", views, "-o", folder)
    return scan, views, folder / "truth"


def place_of(view):
    """Options of `render` for a view of a list of views."""
    camera = view["camera"]
    place = [f"--{key}={','.join(repr(x) for x in camera[key])}" for key in ("eye", "target", "up") if key in camera]
    return place + ["--fov", camera["fov"], "--size", f"{view['width']}x{view['height']}"]


def make_reference(dataset, views, folder):
    """What all points show with their own colours: images as `splatd synth --views` writes them. Those there are stay."""
    folder.mkdir(parents=True, exist_ok=True)
    for view in json.loads(views.read_text(encoding="utf-8"))["views"]:
        for layer, ending in REFERENCE:
            image = folder / f"{view['name']}.{layer}.{ending}"
            if not image.exists():
                run("render", dataset, *place_of(view), "--layer", layer, "--lod", 0, "--supersample", 4, "--background",
                    "transparent", "-o", image)


def bench(dataset, views, truth, lods, repeats, methods="splat"):
    """bench.json of `methods`."""
    out = dataset.with_name(dataset.stem + "-bench")
    run("bench", dataset, "--views", views, "--reference", truth, "--method", methods, "--lod", lods, "--supersample", 1,
        "--repeats", repeats, "--no-profile", "--restart", "-o", out)
    return json.loads((out / "bench.json").read_text(encoding="utf-8"))
