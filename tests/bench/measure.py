"""The figures of RESULTS.md, one subcommand each, on the scan of a vault (11.6 M points) that lies beside the checkout.

usage: measure.py frames|scaling|http|pack|size

Prints what was measured and, where a figure has a bound, how it stands to it; exit 1 beyond a bound, 77 without the data.
Frame times are bounded in units of the calibrator that 'splatd bench' runs beside each frame, so a slow or busy machine
shifts nothing. Datasets are packed once into ~/.cache/splatd-bench and again when splatd is newer than they are.

environment: SPLATD_BINARY, SPLATD_DATA (folder with tls/grenoble.ply or .ply.zst and cameras.json),
             SPLATD_BENCH_LARGE=1 lets 'scaling' make and pack 100 M points, which takes 10 GB of disk and memory
"""
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import statistics
import subprocess
import sys
import time

SPLATD = os.environ["SPLATD_BINARY"]
DATA = pathlib.Path(os.environ["SPLATD_DATA"])
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "splatd-bench"
VIEWS = ["--views", str(DATA / "cameras.json"), "--set", "grenoble"]
TYPE_BYTES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8}
beyond = []


def bound(what, value, limit, unit):
    verdict = "within" if value <= limit else "BEYOND"
    print(f"{what}: {value:.2f} {unit}, {verdict} {limit:g}")
    if value > limit:
        beyond.append(what)


def scan():
    """The scan as a plain file; unpacked once."""
    plain = DATA / "tls" / "grenoble.ply"
    if plain.exists():
        return plain
    packed = plain.with_suffix(".ply.zst")
    if not packed.exists():
        print(f"no {plain} and no {packed}")
        sys.exit(77)
    plain = CACHE / "grenoble.ply"
    if not plain.exists():
        part = CACHE / "grenoble.ply.part"
        subprocess.run(["zstd", "-q", "-d", "-f", packed, "-o", part], check=True)
        part.rename(plain)
    return plain


def subset(points):
    """Every n-th point of the scan, about `points` of them."""
    out = CACHE / f"grenoble-{points}.ply"
    if not out.exists():
        content = scan().read_bytes()
        end = content.index(b"end_header\n") + len(b"end_header\n")
        header = content[:end].decode()
        total = int(re.search(r"element vertex (\d+)", header)[1])
        record = sum(TYPE_BYTES[t] for t in re.findall(r"property (\w+) ", header))
        step = total // points
        kept = [content[end + i * record:end + (i + 1) * record] for i in range(0, total, step)]
        header = header.replace(f"element vertex {total}", f"element vertex {len(kept)}")
        out.write_bytes(header.encode() + b"".join(kept))
    return out


def packed(source, name):
    """`source` as a dataset of the present build."""
    out = CACHE / f"{name}.spld"
    if not out.exists() or out.stat().st_mtime < pathlib.Path(SPLATD).stat().st_mtime:
        subprocess.run([SPLATD, "pack", source, "-o", out], check=True, stdout=subprocess.DEVNULL)
    return str(out)


def courtyard(points):
    name = f"courtyard-{points}"
    folder = CACHE / name
    if not (folder / "courtyard.ply").exists():
        subprocess.run([SPLATD, "synth", "courtyard", "--points", str(points), "--seed", "1", "--format", "ply",
                        "-o", folder], check=True, stdout=subprocess.DEVNULL)
    return packed(folder / "courtyard.ply", name)


def bench(*arguments):
    """Runs splatd bench and prints its rows; returns the report."""
    command = [SPLATD, "bench", *arguments, "--json"]
    report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    unit = report["calibrator_ms"]
    print(f"{report['width']}x{report['height']}, {report['frames']} frames a row; "
          f"1 unit = {unit['median']:.1f} ms ({unit['q1']:.1f} to {unit['q3']:.1f})")
    print("| dataset | device | method | lod | frame ms | quartiles | units | floor | splats drawn | device passes ms |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for r in report["rows"]:
        frame, passes = r["frame_ms"], r["passes_ms"]
        shown = ", ".join(f"{k} {v:.1f}" for k, v in passes.items())
        print(f"| {r['dataset']} | {r['backend']} | {r['method']} | {r['lod']:g} | {frame['median']:.1f} "
              f"| {frame['q1']:.1f} to {frame['q3']:.1f} | {r['units']['median']:.2f} "
              f"| {r['floor_ms'] / unit['median']:.2f} | {r['splats_drawn']:.0f} | {shown} |")
    return report


def row(report, **wanted):
    return next(r for r in report["rows"] if all(r[k] == v for k, v in wanted.items()))


def frames():
    report = bench(packed(scan(), "grenoble"), *VIEWS, "--device", "vulkan,egl", "--method", "splat,points", "--lod",
                   "1,2")
    for method, lod, limit in (("splat", 1, 6), ("splat", 2, 3), ("points", 1, 4)):
        vulkan = row(report, backend="vulkan", method=method, lod=lod)
        egl = row(report, backend="egl", method=method, lod=lod)
        bound(f"{method} lod={lod}", vulkan["units"]["median"], limit, "units")
        bound(f"{method} lod={lod}, EGL to Vulkan", egl["units"]["median"] / vulkan["units"]["median"], 1.3, "times")


def compare_sizes(report, small, large, limit):
    for r in report["rows"]:
        if r["dataset"] == small:
            other = row(report, dataset=large, backend=r["backend"], method=r["method"], lod=r["lod"])
            a, b = r["units"]["median"], other["units"]["median"]
            bound(f"{r['method']} lod={r['lod']:g}, {small} against {large}", max(a / b, b / a), limit, "times")


def scaling():
    report = bench(packed(subset(1000000), "grenoble-1m"), packed(scan(), "grenoble"), *VIEWS, "--method",
                   "splat,points")
    compare_sizes(report, "grenoble-1m", "grenoble", 1.5)
    if os.environ.get("SPLATD_BENCH_LARGE"):
        report = bench(courtyard(1000000), courtyard(100000000), "--method", "splat,points")
        compare_sizes(report, "courtyard-1000000", "courtyard-100000000", 2)
    else:
        print("100 M points: not measured, set SPLATD_BENCH_LARGE=1")


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def get(port, path):
    """One request on a connection of its own: status, headers, body, milliseconds to the last byte."""
    begin = time.monotonic()
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("GET", path)
    reply = connection.getresponse()
    body = reply.read()
    ms = (time.monotonic() - begin) * 1e3
    connection.close()
    return reply.status, reply.headers, body, ms


def view_query(share):
    """The same path that splatd bench takes."""
    views = json.loads((DATA / "cameras.json").read_text())["grenoble"]

    def mix(key):
        a, b = views["overview"][key], views["close"][key]
        if isinstance(a, list):
            return ",".join(repr(x + (y - x) * share) for x, y in zip(a, b))
        return repr(a + (b - a) * share)

    return (f"/v1/datasets/grenoble/view?width=1280&height=720&eye={mix('eye')}&target={mix('target')}&up=0,0,1"
            f"&fov={mix('vfov_deg')}&near={mix('near')}&far={mix('far')}")


def serve():
    dataset, port, count = packed(scan(), "grenoble"), free_port(), 20
    begin = time.monotonic()
    daemon = subprocess.Popen([SPLATD, "serve", "--listen", f"127.0.0.1:{port}", dataset], stderr=subprocess.DEVNULL)
    try:
        while True:
            try:
                if get(port, view_query(0))[0] == 200:
                    break
            except OSError:
                pass
            if daemon.poll() is not None or time.monotonic() - begin > 60:
                sys.exit("the daemon served no frame")
            time.sleep(0.01)
        bound("start to first frame", time.monotonic() - begin, 2, "s")
        total, rendered, above, stages = [], [], [], {}
        for i in range(count):
            status, headers, body, ms = get(port, view_query(i / (count - 1)))
            if status != 200 or body[:2] != b"\xff\xd8":
                sys.exit(f"view {i}: status {status}: {body[:200]}")
            timing = {k: float(v) for k, v in re.findall(r"([\w-]+);dur=([\d.]+)", headers["Server-Timing"])}
            for stage, value in timing.items():
                stages.setdefault(stage, []).append(value)
            total.append(ms)
            rendered.append(timing["frame"])
            above.append(ms - timing["frame"])
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(30)
    print(f"GET to last byte {statistics.median(total):.1f} ms, frame {statistics.median(rendered):.1f} ms; "
          + ", ".join(f"{k} {statistics.median(v):.1f}" for k, v in stages.items()))
    bound("GET above the frame, median", statistics.median(above), 15, "ms")


def pack():
    source, out = scan(), CACHE / "pack-bench.spld"
    points = int(re.search(rb"element vertex (\d+)", source.open("rb").read(2000))[1])
    begin = time.monotonic()
    process = subprocess.Popen([SPLATD, "pack", source, "-o", out], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True)
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.monotonic() - begin
    out.unlink(missing_ok=True)
    if status:
        sys.exit("pack failed: " + said)
    peak = usage.ru_maxrss * 1024
    print(f"{points} points in {seconds:.1f} s = {points / seconds:.0f} points/s "
          f"({usage.ru_utime + usage.ru_stime:.1f} s of CPU)")
    bound("pack, seconds for 700,000 points", 7e5 * seconds / points, 1, "s")
    bound("pack, peak memory", peak / 2**20, (80 * points + 512e6) / 2**20, "MiB")
    errors = re.search(r"mean errors: position ([\d.]+) % of the radius, normal ([\d.]+) degrees", said)
    bound("mean position error", float(errors[1]), 1.6, "% of the splat radius")
    bound("mean normal error", float(errors[2]), 1, "degrees")


def size():
    info = json.loads(subprocess.run([SPLATD, "info", "--json", packed(scan(), "grenoble")], check=True,
                                     stdout=subprocess.PIPE).stdout)
    per_splat = info["bytes_per_splat"]
    print(json.dumps(per_splat))
    bound("position, normal, radius, colour", sum(per_splat[a] for a in ("position", "normal", "radius", "color")), 8,
          "bytes a splat")
    bound("levels of detail add", 100 * (info["splats"] / info["leaf_splats"] - 1), 40, "%")


if __name__ == "__main__":
    figures = {"frames": frames, "scaling": scaling, "http": serve, "pack": pack, "size": size}
    if len(sys.argv) != 2 or sys.argv[1] not in figures:
        sys.exit(__doc__)
    CACHE.mkdir(parents=True, exist_ok=True)
    scan()
    figures[sys.argv[1]]()
    if beyond:
        sys.exit("beyond its bound: " + "; ".join(beyond))
