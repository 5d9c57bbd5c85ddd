"""What soft transparency is for: how well one sees what lies behind a crown, against the exact image of the scene without it.

usage: behind.py OUT [SCENE[:VIEW]...]

Scans, packs and renders courtyard and tree (others are refused) from places that look at a wall through a crown, with class 5 as
`splat` draws it, left out, as one transparent layer (`layer`), and soft (`express`, `base`). The strength of each is the one at
which the crown is as visible as with the others, found by false position, in one of two meanings:
  contrast  mean |image - image without the crown| over the crown's pixels, as a share of what splatting has there;
  opacity   mean opacity of the crown over them, from a dataset that has nothing but its points.
The crown's pixels: at least half of each is covered by it, it is in front of what else is there, and behind it is no sky.
PSNR and SSIM (api/measures.md) over those alone; `behind` against the scene without crown, `crown` against the scene as it is.
OUT keeps scans, truth, datasets and pictures; what is there is not made again. Needs NumPy and Pillow.
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

from datasets import SPLATD, run

POINTS = os.environ.get("BEHIND_POINTS", "1e6")
SIZE = [int(n) for n in os.environ.get("BEHIND_SIZE", "400x300").split("x")]
SHARES = [float(s) for s in os.environ.get("BEHIND_SHARES", "0.5").split(",")]
SKY = (135, 170, 200)
MODELS = ("layer", "express", "base")
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


def crown_alone(scan, out):
    """The points of class 5 as a file of their own."""
    head, _, body = scan.read_bytes().partition(b"end_header\n")
    points = np.frombuffer(body, [("xyz", "<f4", 3), ("rgb", "u1", 3), ("class", "u1")])
    kept = points[points["class"] == 5]
    lines = [b"element vertex %d" % len(kept) if line.startswith(b"element") else line for line in head.splitlines()]
    out.write_bytes(b"\n".join(lines) + b"\nend_header\n" + kept.tobytes())


def make(scene, out):
    """Datasets of the scene and of its crown, and three folders of truth."""
    out.mkdir(parents=True, exist_ok=True)
    scan, crown, views = out / f"{scene}.ply", out / f"{scene}-crown.ply", views_file(scene, out)
    if not scan.exists():
        run("synth", scene, "--points", POINTS, "--classes", "--format", "ply", "-o", out)
        crown_alone(scan, crown)
    for path in (scan, crown):
        if not path.with_suffix(".spld").exists():
            run("pack", path, "-o", path.with_suffix(".spld"))
    for folder, options in (("whole", ()), ("bare", ("--without", "class:5")), ("crown", ("--only", "class:5"))):
        if not (out / folder).exists():
            run("synth", scene, "--views", views, "--samples", 8, *options, "-o", out / folder)
    return scan.with_suffix(".spld"), crown.with_suffix(".spld")


@contextlib.contextmanager
def service(*datasets):
    """A function that renders: dataset, parameters -> array of RGB or RGBA."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with subprocess.Popen([SPLATD, "serve", "--listen", f"127.0.0.1:{port}", "--quiet", *map(str, datasets)]) as daemon:
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


def measures(image, truth, mask):
    """PSNR, SSIM over the pixels of the mask, whose windows lie within the image."""
    error = np.mean((image - truth)[mask] ** 2)
    a, b = (x @ (0.299, 0.587, 0.114) for x in (image, truth))
    ma, mb = smooth(a), smooth(b)
    va, vb, ab = smooth(a * a) - ma * ma, smooth(b * b) - mb * mb, smooth(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    ssim = (2 * ma * mb + c1) * (2 * ab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
    return 10 * np.log10(255 ** 2 / max(error, 1e-9)), ssim[mask].mean()


def crown_pixels(out, name):
    depth = [np.load(out / folder / f"truth/{name}.depth.npy") for folder in ("crown", "bare")]
    cover = [np.load(out / folder / f"truth/{name}.coverage.npy") for folder in ("crown", "bare")]
    nearest = np.where(np.isnan(depth[0]), np.inf, depth[0])
    for axis in (0, 1):  # the centre may lie in a gap
        nearest = np.minimum(nearest, np.minimum(np.roll(nearest, 1, axis), np.roll(nearest, -1, axis)))
    mask = (cover[0] >= 0.5) & (cover[1] > 0.999) & (nearest < depth[1])
    mask[:5], mask[-5:], mask[:, :5], mask[:, -5:] = False, False, False, False
    return mask


def find(wanted, measure, low=0.0, high=1.0):
    """Where a rising function has that value, by false position (Illinois), and the value there; from 0 to 1 where it has not
    between these; the end nearest to it where it never has."""
    below, above, side = measure(low) - wanted, measure(high) - wanted, 0
    if below >= 0 or above <= 0:
        if (low, high) != (0, 1):
            return find(wanted, measure)
        return (low, below + wanted) if below >= 0 else (high, above + wanted)
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
        self.most = self.contrast(self.solid)

    def draw(self, model, opacity):
        key = (model, opacity)
        if key not in self.kept:
            soft = {"soft": "class:5", "soft_model": model, "soft_opacity": repr(opacity)} if model else {}
            self.kept[key] = self.send(self.scene, **self.camera, background="%02x%02x%02x" % SKY, **soft)[..., :3]
        return self.kept[key]

    def contrast(self, image):
        return np.abs(image - self.bare)[self.mask].mean()

    def visible(self, meaning, model, opacity):
        if meaning == "contrast":
            return self.contrast(self.draw(model, opacity)) / self.most
        rgba = self.send(f"{self.scene}-crown", **self.camera, soft="class:5", soft_model=model, soft_opacity=repr(opacity),
                         background="transparent")
        return rgba[..., 3][self.mask].mean() / 255

    def row(self, meaning, label, image, opacity, share):
        behind, crown = (measures(image, self.truth[kind], self.mask) for kind in ("bare", "whole"))
        print(f"| {self.scene} {self.name} | {meaning} | {label} | {opacity:.3f} | {share:.3f} | {behind[0]:.2f} | {behind[1]:.3f} "
              f"| {crown[0]:.2f} | {crown[1]:.3f} |", flush=True)
        return {"view": f"{self.scene} {self.name}", "meaning": meaning, "of": label, "opacity": opacity, "visible": share,
                "behind": behind, "crown": crown}

    def rows(self, meanings=("contrast", "opacity")):
        yield self.row("-", "splat", self.solid, 1, 1)
        yield self.row("-", "left out", self.bare, 0, 0)
        for meaning in meanings:
            for share in SHARES:
                shown, near = [self.truth["whole"], self.solid], None
                for model in MODELS:
                    low, high = (0.8 * near, min(1.25 * near, 1)) if near and model != "layer" else (0.0, 1.0)
                    opacity, got = find(share, lambda x, m=model: self.visible(meaning, m, x), low, high)
                    near = opacity if model == "express" else near
                    image = self.draw(model, opacity)
                    shown.append(image)
                    yield self.row(meaning, model, image, opacity, got)
                shown += [self.bare, self.truth["bare"]]
                path = self.out / f"{self.name}-{meaning}-{share}.png"
                Image.fromarray(np.concatenate(shown, 1).astype(np.uint8)).save(path)


def judge(rows):
    """How many views have each soft model above splat and above layer."""
    for meaning in ("contrast", "opacity"):
        for model in MODELS[1:]:
            better = {"PSNR": [], "SSIM": []}
            for row in (r for r in rows if r["of"] == model and r["meaning"] == meaning):
                rivals = [r for r in rows if r["view"] == row["view"] and (r["of"] == "splat" or r["of"] == "layer"
                          and r["meaning"] == meaning and abs(r["visible"] - row["visible"]) < 0.05)]
                for i, figure in enumerate(better):
                    better[figure].append(len(rivals) == 2 and all(row["behind"][i] > r["behind"][i] for r in rivals))
            print(f"{model} at equal {meaning}: better than splat and layer by " +
                  ", ".join(f"{figure} in {sum(b)} of {len(b)}" for figure, b in better.items()))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    rows = []
    print("| view | equal | crown as | soft_opacity | visible | behind: PSNR | SSIM | crown: PSNR | SSIM |\n|---" + "|---" * 8 + "|")
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
