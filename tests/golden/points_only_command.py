"""splatd pack --points-only and --no-linear over the real binary: what they say, what info and render make of it, what is
refused. The cloud is a field with a wire over it."""
import json
import os
import pathlib
import random
import struct
import subprocess
import sys
import tempfile

SPLATD = os.environ["SPLATD_BINARY"]
WIRE = 300


def run(*arguments, code=0):
    done = subprocess.run([SPLATD, *map(str, arguments)], capture_output=True, text=True, timeout=600)
    if done.returncode != code:
        sys.exit(f"{arguments}: exit code {done.returncode}, not {code}: {done.stderr}")
    return done


def expect(text, part):
    if part not in text:
        sys.exit(f"'{part}' is not in: {text}")


def write_cloud(path):
    rng = random.Random(7)
    points = [(0.1 * (i % 100) + 0.05 * rng.random(), 0.1 * (i // 100), 0.001 * rng.random()) for i in range(10000)]
    points += [(10 * i / WIRE, 5, 3 + 0.001 * rng.random()) for i in range(WIRE)]
    path.write_text("".join(f"{x} {y} {z} 200 120 80\n" for x, y, z in points))


def describe(dataset):
    return json.loads(run("info", "--json", dataset).stdout)


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        cloud, bare, whole = folder / "cloud.txt", folder / "bare.spld", folder / "whole.spld"
        columns = ("--columns", "x,y,z,r,g,b")
        write_cloud(cloud)
        expect(run("pack", cloud, *columns, "--points-only", "-o", bare).stderr, f"{WIRE} points on wires")
        run("pack", cloud, *columns, "-o", whole)
        said = run("pack", cloud, *columns, "--points-only", "--max-points", "100", "-o", folder / "Gro\u00dfe Fichte.spld").stderr
        expect(said, "Fichte.spld' is opened by no command under this name; rename it: an id has at most 127 letters a-z")
        about = describe(bare)
        assert about["linear"] == WIRE and about["attributes"]["surface"] is False, about
        assert about["bytes_per_splat"]["normal"] == about["bytes_per_splat"]["radius"] == 0, about
        assert describe(whole)["attributes"]["surface"] is True and describe(whole)["linear"] == WIRE
        expect(run("info", bare).stdout, "packed with --points-only")
        run("pack", cloud, *columns, "--no-linear", "-o", whole)
        assert describe(whole)["linear"] == 0

        view = ("render", bare, "--size", "160x120", "-o")
        for method in "splat", "fill", "points":
            run(*view, folder / f"{method}.png", "--method", method)
        run(*view, folder / "default.png")
        image = {name: (folder / f"{name}.png").read_bytes() for name in ("splat", "fill", "points", "default")}
        assert image["splat"] == image["fill"] == image["default"] != image["points"]
        refused = run(*view, folder / "normal.png", "--layer", "normal", "--method", "points", code=2)
        expect(refused.stderr, "'bare' has no normals, as it was packed with --points-only")

        run(*view, folder / "normal.npy", "--layer", "normal", "--eye", "5,-3,3", "--target", "5,5,0")
        normals = (folder / "normal.npy").read_bytes()
        normals = [n for n in struct.iter_unpack("<3f", normals[len(normals) - 160 * 120 * 12:]) if any(n)]
        upright = sum(n[2] > 0.97 for n in normals)
        assert len(normals) > 5000 and upright > 0.97 * len(normals), (len(normals), upright)

        run("bench", bare, "-o", folder / "measured", "--lod", "8", "--supersample", "1", "--frames", "2", "--repeats", "1",
            "--size", "64x48")
        slow = run(*view, folder / "slow.png", "--method", "fill", "--visibility", "constant", "--kernel", "129", "--size",
                   "1280x720", code=2)
        expect(slow.stderr, "smaller kernel")

        before = bare.read_bytes()
        refused = run("pack", cloud, *columns, "--points-only", "--cameras", folder, "-o", bare, code=2)
        expect(refused.stderr, "pack without --points-only")
        expect(run("pack", cloud, *columns, "--points-onyl", "-o", bare, code=2).stderr, "splatd pack --help")
        for without in (("--neighbours", "9"), ("--normal-error", "2"), ("--no-clip-lines",)):
            refused = run("pack", cloud, *columns, "--points-only", *without, "-o", bare, code=2)
            expect(refused.stderr, "--points-only makes no normals")
        assert bare.read_bytes() == before


main()
