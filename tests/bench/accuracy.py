"""What each level of detail costs and how far it is from the truth of the same dataset: the chart in the README.

usage: accuracy.py NAME.spld OUT.svg [--views FILE --set NAME]

Times are medians of 'splatd bench' in units of its calibrator. The reference is the same view with 16 samples a pixel
(--supersample 4); PSNR is over the pixels that both cover fully, holes are covered pixels of the reference left empty.
Without --views the dataset's default view alone is compared.

environment: SPLATD_BINARY
"""
import argparse
import array
import json
import math
import os
import pathlib
import subprocess
import tempfile

SPLATD = os.environ["SPLATD_BINARY"]
SETTINGS = [("splat", lod) for lod in (0.5, 0.75, 1, 1.5, 2, 3, 4)] + [("points", lod) for lod in (0.5, 1)]
DEFAULT = ("splat", 1)


def cameras(views):
    """Command line arguments of each view to compare."""
    if not views:
        return [[]]
    result = []
    for name in ("overview", "close"):
        v = views[name]
        result.append([f"--{key}={','.join(map(str, v[key]))}" for key in ("eye", "target", "up")] +
                      [f"--fov={v['vfov_deg']}", f"--near={v['near']}", f"--far={v['far']}"])
    return result


def render(dataset, camera, folder, *options):
    out = pathlib.Path(folder) / "view.npy"
    subprocess.run([SPLATD, "render", dataset, *camera, "--size=1280x720", "--background=transparent", *options,
                    "-o", out], check=True, stderr=subprocess.DEVNULL)
    content = out.read_bytes()
    return array.array("B", content[10 + content[8] + 256 * content[9]:])


def compare(image, reference):
    """PSNR and the share of holes."""
    squares = count = holes = covered = 0
    for i in range(0, len(reference), 4):
        if reference[i + 3] != 255:
            continue
        covered += 1
        if image[i + 3] != 255:
            holes += 1
            continue
        count += 3
        squares += sum((image[i + c] - reference[i + c]) ** 2 for c in range(3))
    return 10 * math.log10(255 ** 2 * count / max(squares, 1)), holes / covered


def times(dataset, arguments):
    """Median units by (method, lod)."""
    units = {}
    for method in ("splat", "points"):
        lods = ",".join(f"{lod:g}" for m, lod in SETTINGS if m == method)
        report = subprocess.run([SPLATD, "bench", dataset, *arguments, "--method", method, "--lod", lods, "--json"],
                                check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
        for row in json.loads(report)["rows"]:
            units[method, row["lod"]] = row["units"]["median"]
    return units


def chart(points, title, out):
    """Error against time: left is faster, up is more accurate. Both axes linear, time from 0."""
    width, height, left, right, top, bottom = 640, 400, 60, 20, 40, 50
    most = max(p["units"] for p in points) * 1.08
    low = math.floor(min(p["psnr"] for p in points)) - 1
    high = math.ceil(max(p["psnr"] for p in points)) + 1

    def at(p):
        return (left + (width - left - right) * p["units"] / most,
                top + (height - top - bottom) * (high - p["psnr"]) / (high - low))

    front = [p for p in points
             if not any(q["units"] <= p["units"] and q["psnr"] >= p["psnr"] and q is not p for q in points)]
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
             'font-size="12">', f'<rect width="{width}" height="{height}" fill="white"/>',
             f'<text x="{left}" y="22" font-size="14">{title}</text>']
    for value in range(low, high + 1):
        y = at({"units": 0, "psnr": value})[1]
        lines.append(f'<path d="M{left} {y:.1f}H{width - right}" stroke="#ddd"/>'
                     f'<text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end">{value}</text>')
    step = max(1, math.ceil(most / 8))
    for value in range(0, math.ceil(most), step):
        x = at({"units": value, "psnr": low})[0]
        lines.append(f'<text x="{x:.1f}" y="{height - bottom + 18}" text-anchor="middle">{value}</text>')
    lines.append(f'<text x="{width - right}" y="{height - 12}" text-anchor="end">frame, calibrator units</text>')
    lines.append(f'<text x="16" y="{top + 120}" transform="rotate(-90 16 {top + 120})">PSNR, dB</text>')
    for method, color in (("splat", "#c0392b"), ("points", "#2471a3")):
        curve = sorted((p for p in points if p["method"] == method), key=lambda p: p["units"])
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, curve))
        lines.append(f'<polyline points="{path}" fill="none" stroke="{color}"/>')
        for p in curve:
            x, y = at(p)
            fill = color if p in front else "white"
            lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{fill}" stroke="{color}"/>'
                         f'<text x="{x + 7:.1f}" y="{y + 15:.1f}" fill="{color}">{method} {p["lod"]:g}'
                         f'{" (default)" if (method, p["lod"]) == DEFAULT else ""}</text>')
    lines.append("</svg>\n")
    pathlib.Path(out).write_text("\n".join(lines))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("dataset")
    parser.add_argument("out")
    parser.add_argument("--views")
    parser.add_argument("--set")
    given = parser.parse_args()
    views = json.loads(pathlib.Path(given.views).read_text())[given.set] if given.views else None
    units = times(given.dataset, ["--views", given.views, "--set", given.set] if given.views else [])
    points = []
    with tempfile.TemporaryDirectory() as folder:
        references = [render(given.dataset, camera, folder, "--supersample=4") for camera in cameras(views)]
        print("| method | lod | units | PSNR, dB | holes |\n|---|---|---|---|---|")
        for method, lod in SETTINGS:
            results = [compare(render(given.dataset, camera, folder, f"--method={method}", f"--lod={lod}"), reference)
                       for camera, reference in zip(cameras(views), references)]
            psnr, holes = (sum(r[i] for r in results) / len(results) for i in range(2))
            points.append({"method": method, "lod": lod, "units": units[method, lod], "psnr": psnr})
            print(f"| {method} | {lod:g} | {units[method, lod]:.2f} | {psnr:.2f} | {100 * holes:.3f} % |", flush=True)
    chart(points, f"{pathlib.Path(given.dataset).stem}, 1280x720: accuracy against time", given.out)


main()
