"""What soft transparency is for: how well one sees what lies behind a crown, against the exact image of the scene without it.

usage: behind.py OUT [SCENE[:VIEW]...]

Scans, packs and renders courtyard and tree (others are refused) from places that look at a wall through a crown, with class 5 as
`splat` draws it, left out, as one transparent layer in two readings, and soft (`express`, `base`). `layer` drops what lies behind the
first layer; `first` has it opaque, which is what the paper's text says of its own: the splats' image over that of the points that lie
more than MARGIN behind the crown's first surface. The strength of each is the one at which the crown is half as visible (BEHIND_SHARES) as
with splats, found by false position, in one of two meanings:
  contrast   mean |image - image without the crown| over the crown's pixels;
  detail     how much of the crown's own detail there is: of what the crown adds to the exact image, and of what it adds to the image
             (luma, each less its blurred self), the second's regression on the first. An even veil has none.
`base` has the strength that was found for `express`. `capped` is express with soft_opacity DENSE, of which the strength is soft_cover: the
share that spheres hold back together at most.
The crown's pixels: at least half of each is covered by it, it is in front of what else is there, and behind it is no sky.
PSNR and SSIM (api/measures.md) over those alone; `behind` against the scene without crown, `crown` against the scene as it is.
OUT keeps scans, truth, datasets and pictures (PNG: exact, each way, left out, exact without; JPEG: splat, layer, express, left out);
scans, truth and datasets that are there are not made again. Needs NumPy and Pillow.
environment: SPLATD_BINARY (splatd), BEHIND_POINTS (1e6), BEHIND_SIZE (400x300), BEHIND_SHARES (0.5)
"""
import contextlib
import io
import json
import os
import pathlib
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request

import numpy as np
from PIL import Image

from datasets import SPLATD, place_of, run

POINTS = os.environ.get("BEHIND_POINTS", "1e6")
SIZE = [int(n) for n in os.environ.get("BEHIND_SIZE", "400x300").split("x")]
SHARES = [float(s) for s in os.environ.get("BEHIND_SHARES", "0.5").split(",")]
SKY = (135, 170, 200)
MODELS = ("layer", "first", "express", "base", "capped")
DENSE = 0.6
MEANINGS = ("contrast", "detail")
LUMA = np.array((0.299, 0.587, 0.114))
MARGIN = 0.06  # metres
VIEWS = {  # eye, target, vertical field of view
    "courtyard": {"north": ([-4, -2.4, 1.7], [-4, 8, 4.6], 32), "north-east": ([-6.4, -1.6, 1.7], [-2.2, 8, 4.8], 34),
                  "north-west": ([-1.2, -1.4, 1.7], [-6.2, 8, 4.6], 34), "west": ([1.2, 1.4, 1.7], [-10, 3.4, 4.6], 32),
                  "west-high": ([0.8, 3.6, 4.2], [-10, 2.1, 3.2], 34), "south": ([-4.6, 7.2, 1.7], [-3.2, -8, 6.2], 40),
                  "from-above": ([-3.4, -2.2, 6.4], [-4.2, 8, 1.6], 34)},
    "tree": {"oak": ([0, -5.6, 6.2], [0, 6, 2.6], 40), "oak-left": ([2.6, -5.2, 6.4], [-2.4, 6, 2.4], 40),
             "oak-right": ([-2.8, -5, 6.4], [2.4, 6, 2.4], 40), "birch": ([4.2, -4.2, 4.6], [4.2, 6, 2.2], 36),
             "birch-right": ([2.2, -3.8, 4.4], [5.4, 6, 2.2], 36), "sapling": ([-4.4, -3, 3.2], [-4.4, 6, 2], 34),
             "sapling-left": ([-2.6, -3, 3.3], [-5.8, 6, 1.9], 34)},
}


def views_file(scene, out):
    path = out / "views.json"
    path.write_text(json.dumps({"views": [
        {"name": name, "width": SIZE[0], "height": SIZE[1], "camera": {"eye": eye, "target": target, "fov": fov}}
        for name, (eye, target, fov) in VIEWS[scene].items()]}), encoding="utf-8")
    return path


def points_of(scan):
    """Its header and its points."""
    head, _, body = scan.read_bytes().partition(b"end_header\n")
    return head, np.frombuffer(body, [("xyz", "<f4", 3), ("rgb", "u1", 3), ("class", "u1")])


def behind_first(scan, camera, depth, out):
    """The crown's points that are not of its first surface, whose depth is known by pixel, as a dataset."""
    head, points = points_of(scan)
    points = points[points["class"] == 5]
    eye, target, fov = camera
    ahead = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(ahead, (0, 0, 1))
    right /= np.linalg.norm(right)
    at = points["xyz"] - eye
    z, focal = at @ ahead, SIZE[1] / 2 / np.tan(np.radians(fov / 2))
    x = np.floor(SIZE[0] / 2 + focal * (at @ right) / z).astype(int)
    y = np.floor(SIZE[1] / 2 + focal * (at @ np.cross(ahead, right)) / z).astype(int)
    seen = (z > 0) & (x >= 0) & (x < SIZE[0]) & (y >= 0) & (y < SIZE[1])
    first = np.where(seen, depth[np.clip(y, 0, SIZE[1] - 1), np.clip(x, 0, SIZE[0] - 1)], -np.inf)
    kept = points[~(z < first + MARGIN)]
    lines = [b"element vertex %d" % len(kept) if line.startswith(b"element") else line for line in head.splitlines()]
    scan = out.with_suffix(".ply")
    scan.write_bytes(b"\n".join(lines) + b"\nend_header\n" + kept.tobytes())
    run("pack", scan, "-o", out)


def make(scene, out):
    """The dataset of the scene, and three folders of truth."""
    out.mkdir(parents=True, exist_ok=True)
    scan, views = out / f"{scene}.ply", views_file(scene, out)
    if not scan.exists():
        run("synth", scene, "--points", POINTS, "--classes", "--format", "ply", "-o", out)
    if not scan.with_suffix(".spld").exists():
        run("pack", scan, "-o", scan.with_suffix(".spld"))
    for folder, options in (("whole", ()), ("bare", ("--without", "class:5")), ("crown", ("--only", "class:5"))):
        if not (out / folder).exists():
            run("synth", scene, "--views", views, "--samples", 8, *options, "-o", out / folder)
    return [scan.with_suffix(".spld")]


@contextlib.contextmanager
def service(*datasets):
    """A function that renders: dataset, parameters -> array of RGB or RGBA."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with subprocess.Popen([SPLATD, "serve", "--listen", f"127.0.0.1:{port}", "--ops-listen", "", "--quiet",
                           *map(str, datasets)]) as daemon:
        def render(dataset, **parameters):
            url = f"http://127.0.0.1:{port}/v1/datasets/{dataset}/view?" + urllib.parse.urlencode(parameters)
            with urllib.request.urlopen(url, timeout=600) as reply:
                return np.asarray(Image.open(io.BytesIO(reply.read()))).astype(float)
        while True:
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/v1/status", timeout=5).close()
                break
            except (OSError, urllib.error.URLError):
                if daemon.poll() is not None:
                    sys.exit("the daemon has ended")
                time.sleep(0.1)
        try:
            yield render
        finally:
            daemon.terminate()
            daemon.wait(60)


def over_sky(path):
    pixels = np.asarray(Image.open(path)).astype(float)
    alpha = pixels[..., 3:] / 255
    return np.round(pixels[..., :3] * alpha + np.array(SKY) * (1 - alpha))


def smooth(image):
    weights = np.exp(-np.arange(-5, 6) ** 2 / (2 * 1.5 ** 2))
    for axis in (0, 1):
        image = np.apply_along_axis(np.convolve, axis, image, weights / weights.sum(), "same")
    return image


def detail(image):
    luma = image @ LUMA
    return luma - smooth(luma)


def measures(image, truth, mask):
    """PSNR, SSIM over the pixels of the mask, whose windows lie within the image."""
    error = np.mean((image - truth)[mask] ** 2)
    a, b = (x @ LUMA for x in (image, truth))
    ma, mb = smooth(a), smooth(b)
    va, vb, ab = smooth(a * a) - ma * ma, smooth(b * b) - mb * mb, smooth(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    ssim = (2 * ma * mb + c1) * (2 * ab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
    return 10 * np.log10(255 ** 2 / max(error, 1e-9)), ssim[mask].mean()


def first_depth(depth):
    """Depth of the nearest of a pixel and those beside it: its centre may lie in a gap."""
    nearest = np.where(np.isnan(depth), np.inf, depth)
    for axis in (0, 1):
        nearest = np.minimum(nearest, np.minimum(np.roll(nearest, 1, axis), np.roll(nearest, -1, axis)))
    return nearest


def crown_pixels(out, name):
    depth = [np.load(out / folder / f"truth/{name}.depth.npy") for folder in ("crown", "bare")]
    cover = [np.load(out / folder / f"truth/{name}.coverage.npy") for folder in ("crown", "bare")]
    mask = (cover[0] >= 0.5) & (cover[1] > 0.999) & (first_depth(depth[0]) < depth[1])
    mask[:5], mask[-5:], mask[:, :5], mask[:, -5:] = False, False, False, False
    return mask


def find(wanted, measure):
    """Where a function first comes to that value from 0 on, and the value there: steps, then false position (Illinois). 0 or 1
    where it is always above or below."""
    low, below, side = 0.0, measure(0.0) - wanted, 0
    for high in (0.03, 0.06, 0.12, 0.25, 0.5, 1.0):
        above = measure(high) - wanted
        if above > 0 or below >= 0:
            break
        low, below = high, above
    if below >= 0 or above <= 0:
        return (0.0, below + wanted) if below >= 0 else (1.0, above + wanted)
    for _ in range(12):
        x = (low * above - high * below) / (above - below)
        f = measure(x) - wanted
        if abs(f) < 0.002:
            break
        if f < 0:
            low, below, above, side = x, f, above / 2 if side < 0 else above, -1
        else:
            high, above, below, side = x, f, below / 2 if side > 0 else below, 1
    return x, f + wanted


class Place:
    """A view of a scene, with everything it is held against."""

    def __init__(self, scene, name, out, render):
        self.scene, self.name, self.out, self.send = scene, name, out, render
        eye, target, fov = VIEWS[scene][name]
        self.camera = {"eye": ",".join(map(str, eye)), "target": ",".join(map(str, target)), "fov": fov,
                       "width": SIZE[0], "height": SIZE[1], "format": "png"}
        self.mask = crown_pixels(out, name)
        self.truth = {kind: over_sky(out / kind / f"truth/{name}.color.png") for kind in ("bare", "whole")}
        self.kept = {}
        self.solid, self.bare = self.draw(None, 0), self.draw("express", 0)
        self.second = self.behind_first()
        self.ends = {meaning: [self.raw(meaning, image) for image in (self.bare, self.solid)] for meaning in MEANINGS}

    def behind_first(self):
        """What would be seen without the crown's first surface."""
        path = self.out / f"{self.name}-second.spld"
        depth = np.load(self.out / f"crown/truth/{self.name}.depth.npy")
        if not path.exists():
            behind_first(self.out / f"{self.scene}.ply", VIEWS[self.scene][self.name], first_depth(depth), path)
        view = json.loads((self.out / "views.json").read_text(encoding="utf-8"))["views"][list(VIEWS[self.scene]).index(self.name)]
        color, npy = path.with_suffix(".png"), path.with_suffix(".npy")
        run("render", path, *place_of(view), "--background", "transparent", "-o", color)
        run("render", path, *place_of(view), "--layer", "depth", "-o", npy)
        pixels = np.asarray(Image.open(color)).astype(float)
        there = np.load(npy) < np.nan_to_num(np.load(self.out / f"bare/truth/{self.name}.depth.npy"), nan=np.inf)
        alpha = pixels[..., 3:] / 255 * there[..., None]
        return self.bare * (1 - alpha) + pixels[..., :3] * alpha

    def draw(self, model, opacity):
        if model == "first":
            return np.round(opacity * self.solid + (1 - opacity) * self.second)
        key = (model, opacity)
        if key not in self.kept:
            how = ({"soft_opacity": DENSE, "soft_cover": repr(opacity)} if model == "capped" else
                   {"soft_model": model, "soft_opacity": repr(opacity)})
            soft = {"soft": "class:5", **how} if model else {}
            self.kept[key] = self.send(self.scene, **self.camera, background="%02x%02x%02x" % SKY, **soft)[..., :3]
        return self.kept[key]

    def raw(self, meaning, image):
        if meaning == "contrast":
            return np.abs(image - self.bare)[self.mask].mean()
        own, added = (detail(a - b)[self.mask] for a, b in ((self.truth["whole"], self.truth["bare"]), (image, self.bare)))
        return (own * added).sum() / (own * own).sum()

    def visible(self, meaning, image):
        none, most = self.ends[meaning]
        return (self.raw(meaning, image) - none) / (most - none)

    def row(self, meaning, label, image, opacity, share, wanted=None):
        behind, crown = (measures(image, self.truth[kind], self.mask) for kind in ("bare", "whole"))
        print(f"| {self.scene} {self.name} | {meaning} | {label} | {opacity:.3f} | {share:.3f} | {behind[0]:.2f} | {behind[1]:.3f} "
              f"| {crown[0]:.2f} | {crown[1]:.3f} |", file=sys.stderr, flush=True)
        return {"view": f"{self.scene} {self.name}", "meaning": meaning, "of": label, "opacity": opacity, "visible": share,
                "wanted": wanted, "behind": behind, "crown": crown}

    def rows(self):
        yield self.row("-", "splat", self.solid, 1, 1)
        yield self.row("-", "left out", self.bare, 0, 0)
        for meaning in MEANINGS:
            for share in SHARES:
                shown = {"exact": self.truth["whole"], "splat": self.solid}
                for model in MODELS:
                    if model != "base":
                        opacity, got = find(share, lambda x, m=model: self.visible(meaning, self.draw(m, x)))
                    image = self.draw(model, opacity)
                    shown[model] = image
                    yield self.row(meaning, model, image, opacity, got, share)
                shown |= {"left out": self.bare, "bare": self.truth["bare"]}
                for ending, parts in (("png", list(shown)), ("jpg", ["splat", "layer", "express", "left out"])):
                    strip = Image.fromarray(np.concatenate([shown[p] for p in parts], 1).astype(np.uint8))
                    strip.save(self.out / f"{self.name}-{meaning}-{share}.{ending}", quality=85)


WAYS = ("splat", "layer", "first", "express", "base", "capped", "left out")


def judge(rows):
    """A table for each meaning, and in how many views the soft models show what lies behind better than each other way."""
    for meaning, share in [(m, s) for m in MEANINGS for s in SHARES]:
        of = {(r["view"], r["of"]): r for r in rows if r["meaning"] == "-" or (r["meaning"], r["wanted"]) == (meaning, share)}
        views = list(dict.fromkeys(view for view, _ in of))
        print(f"\nequal {meaning}, {share}\n\n| view | " + " | ".join(WAYS) + " |\n|---" + "|---" * len(WAYS) + "|")
        for view in views:
            cells = []
            for row in (of[view, way] for way in WAYS):
                missed = "" if row["meaning"] == "-" or abs(row["visible"] - share) < 0.02 else f" at {row['visible']:.2f}"
                cells.append(f"{row['behind'][0]:.1f}, {row['behind'][1]:.2f}{missed}")
            print(f"| {view} | " + " | ".join(cells) + " |")
        for model in ("express", "base", "capped"):
            print(f"\n{model} is better than " + "; ".join(
                f"{rival}: PSNR in {sum(of[v, model]['behind'][0] > of[v, rival]['behind'][0] for v in views)}, "
                f"SSIM in {sum(of[v, model]['behind'][1] > of[v, rival]['behind'][1] for v in views)} of {len(views)}"
                for rival in WAYS[:3]))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    rows = []
    print("| view | equal | crown as | soft_opacity | visible | behind: PSNR | SSIM | crown: PSNR | SSIM |", file=sys.stderr)
    for wanted in sys.argv[2:] or list(VIEWS):
        scene, _, only = wanted.partition(":")
        if scene not in VIEWS or only and only not in VIEWS[scene]:
            sys.exit(f"there is no view {wanted}; there are {', '.join(f'{s}:{v}' for s in VIEWS for v in VIEWS[s])}")
        out = pathlib.Path(sys.argv[1]) / scene
        with service(*make(scene, out)) as render:
            for name in [only] if only else VIEWS[scene]:
                rows += Place(scene, name, out, render).rows()
    judge(rows)
    (pathlib.Path(sys.argv[1]) / "behind.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
