"""Parts of photographs beside what a dataset shows from the same place: photograph | mean colours | textures.

usage: close_views.py DATASET.spld MODEL IMAGES OUT.{png,jpg} NAME:X,Y,WxH[*SCALE]...

A row for each part: W x H pixels of photograph NAME (its file's name) from (X, Y) on, SCALE times as large (1): frames are
drawn at that size, the photograph is enlarged. MODEL is COLMAP's text model with cameras SIMPLE_PINHOLE or PINHOLE.
Needs Pillow. SPLATD_BINARY names the program (splatd)."""
import io
import os
import pathlib
import re
import subprocess
import sys

from PIL import Image

SPLATD = os.environ.get("SPLATD_BINARY", "splatd")
GAP = 4


def lines(path):
    """Without comments; empty ones stay, since a photograph without points has one."""
    return [line.split() for line in pathlib.Path(path).read_text().splitlines() if not line.startswith("#")]


def read_lens(model, camera):
    for fields in lines(f"{model}/cameras.txt"):
        if fields and fields[0] == camera:
            numbers = [float(x) for x in fields[4:]]
            if fields[1] == "SIMPLE_PINHOLE":
                numbers.insert(0, numbers[0])
            elif fields[1] != "PINHOLE":
                sys.exit(f"camera {camera} is {fields[1]}: a pinhole is needed")
            return numbers
    sys.exit(f"{model}/cameras.txt has no camera {camera}")


def read_pose(model, name):
    """Rows of the world-to-camera rotation, the eye, the lens."""
    for fields in lines(f"{model}/images.txt"):
        if len(fields) != 10 or fields[9] != name:
            continue
        w, x, y, z, *t = (float(v) for v in fields[1:8])
        rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
        eye = [-sum(rows[k][i] * t[k] for k in range(3)) for i in range(3)]
        return rows, eye, read_lens(model, fields[8])
    sys.exit(f"{model}/images.txt has no photograph {name}")


def vector(values):
    return ",".join(repr(v) for v in values)


def render(dataset, pose, part, scale, atoms):
    rows, eye, (fx, fy, cx, cy) = pose
    left, top, width, height = part
    png = subprocess.run(
        [SPLATD, "render", dataset, "--eye", vector(eye), "--target", vector(e + r for e, r in zip(eye, rows[2])),
         "--up", vector(-v for v in rows[1]), "--fx", repr(fx * scale), "--fy", repr(fy * scale),
         "--cx", repr((cx - left) * scale), "--cy", repr((cy - top) * scale),
         "--size", f"{width * scale}x{height * scale}", "--atoms", str(atoms), "--format", "png", "-o", "-"],
        stdout=subprocess.PIPE, check=True).stdout
    return Image.open(io.BytesIO(png)).convert("RGB")


def row(dataset, model, images, text):
    found = re.fullmatch(r"(.+):(\d+),(\d+),(\d+)x(\d+)(?:\*(\d+))?", text)
    if not found:
        sys.exit(f"'{text}' is not NAME:X,Y,WxH or NAME:X,Y,WxH*SCALE")
    left, top, width, height, scale = (int(v or 1) for v in found.groups()[1:])
    pose = read_pose(model, found[1])
    photograph = Image.open(f"{images}/{found[1]}").convert("RGB").crop((left, top, left + width, top + height))
    parts = [photograph.resize((width * scale, height * scale), Image.BICUBIC)]
    parts += [render(dataset, pose, (left, top, width, height), scale, atoms) for atoms in (0, 8)]
    out = Image.new("RGB", (sum(p.width for p in parts) + GAP * (len(parts) - 1), parts[0].height), "white")
    for i, part in enumerate(parts):
        out.paste(part, (i * (part.width + GAP), 0))
    return out


def main():
    if len(sys.argv) < 6:
        sys.exit(__doc__)
    dataset, model, images, path = sys.argv[1:5]
    rows = [row(dataset, model, images, text) for text in sys.argv[5:]]
    out = Image.new("RGB", (max(r.width for r in rows), sum(r.height + GAP for r in rows) - GAP), "white")
    top = 0
    for r in rows:
        out.paste(r, (0, top))
        top += r.height + GAP
    out.save(path)


main()
