"""The figures of RESULTS.md, one subcommand each, on the scan of a vault (11.6 M points) that lies beside the checkout.

usage: measure.py frames|scaling|http|pack|size|planner|fill; service.py has those of the service under load

Prints what was measured and, where a figure has a bound, how it stands to it; exit 1 beyond a bound, 77 without the data.
Frame times are bounded in units of the calibrator that 'splatd bench' runs beside each frame, so a slow or busy machine
shifts nothing. Datasets are packed once into ~/.cache/splatd-bench and again when splatd is newer than they are.

environment: SPLATD_BINARY, SPLATD_DATA (folder with tls/grenoble.ply or .ply.zst and cameras.json),
             SPLATD_BENCH_FILL (the program of that figure),
             SPLATD_BENCH_LARGE=1 lets 'scaling' make and pack 100 M points, which takes 10 GB of disk and memory
"""
import concurrent.futures
import contextlib
import http.client
import json
import os
import pathlib
import random
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time


def setting(name):
    """What the environment says; without it, and for --help, what the program says of itself."""
    if name not in os.environ or {"-h", "--help"} & set(sys.argv[1:]):
        print(sys.modules["__main__"].__doc__)
        sys.exit(0 if {"-h", "--help"} & set(sys.argv[1:]) else f"{name} is not set: see 'environment' above")
    return os.environ[name]


SPLATD = setting("SPLATD_BINARY")
DATA = pathlib.Path(setting("SPLATD_DATA"))
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "splatd-bench"
CACHE.mkdir(parents=True, exist_ok=True)
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


def scan_of(scene, points):
    """A simulated scan of one of `splatd synth`'s scenes, packed."""
    name = f"{scene}-{points}"
    folder = CACHE / name
    if not (folder / f"{scene}.ply").exists():
        subprocess.run([SPLATD, "synth", scene, "--points", str(points), "--seed", "1", "--format", "ply",
                        "-o", folder], check=True, stdout=subprocess.DEVNULL)
    return packed(folder / f"{scene}.ply", name)


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
        report = bench(scan_of("courtyard", 1000000), scan_of("courtyard", 100000000), "--method", "splat,points")
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
    daemon = subprocess.Popen([SPLATD, "serve", "--listen", f"127.0.0.1:{port}", "--ops-listen", "", "--cache", "0",
                               dataset], stderr=subprocess.DEVNULL)
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
    bound("pack, seconds for 1,000,000 points", 1e6 * seconds / points, 1, "s")
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


def court_views(count, seed):
    """Views from inside the courtyard that no profile has seen: anywhere a person may stand, looking anywhere."""
    chance = random.Random(seed)
    views = []
    for i in range(count):
        eye = [round(chance.uniform(low, high), 3) for low, high in ((-8.5, 8.5), (-6.5, 6.5), (1.2, 2.2))]
        target = [round(chance.uniform(low, high), 3) for low, high in ((-10, 10), (-8, 8), (0, 4))]
        views.append({"name": f"new{i:03}", "width": 1280, "height": 720,
                      "camera": {"eye": eye, "target": target, "fov": round(chance.uniform(45, 70), 1)}})
    return views


def exact(folder, views):
    """Exact images of `views`; the folder that holds them."""
    folder.mkdir(parents=True, exist_ok=True)
    listed = folder / "views.json"
    if not listed.exists() or json.loads(listed.read_text()) != {"views": views}:
        listed.unlink(missing_ok=True)
        (folder / "part.json").write_text(json.dumps({"views": views}))
        subprocess.run([SPLATD, "synth", "courtyard", "--views", folder / "part.json", "-o", folder], check=True,
                       stdout=subprocess.DEVNULL)
        (folder / "part.json").rename(listed)
    return folder / "truth"


def profiled():
    """The courtyard of 5 M points with a profile of its sample views beside it; and that profile."""
    dataset = pathlib.Path(scan_of("courtyard", 5000000))
    profile = dataset.with_suffix(".profile.json")
    if not profile.exists() or profile.stat().st_mtime < dataset.stat().st_mtime:
        views = json.loads(subprocess.run([SPLATD, "synth", "courtyard", "--print-views"], check=True,
                                          stdout=subprocess.PIPE).stdout)["views"]
        truth = exact(CACHE / "planner-sample", views)
        subprocess.run([SPLATD, "bench", dataset, "--views", truth.parent / "views.json", "--reference", truth, "-o",
                        CACHE / "planner-bench", "--lod", "0.5,1,2,4", "--supersample", "0.25,0.5,1", "--repeats", "3",
                        "--restart"],  # the dataset was packed anew
                       check=True, stdout=subprocess.DEVNULL)
    return str(dataset), json.loads(profile.read_text())


def ask_view(port, name, view, **params):
    """Headers, bytes and the client's ms of a view."""
    camera = view["camera"]
    query = {"eye": ",".join(map(str, camera["eye"])), "target": ",".join(map(str, camera["target"])),
             "fov": camera["fov"], "width": view["width"], "height": view["height"], **params}
    path = f"/v1/datasets/{name}/view?" + "&".join(f"{k}={v}" for k, v in query.items())
    status, headers, body, ms = get(port, path)
    if status != 200:
        sys.exit(f"{path}: status {status}: {body[:200]}")
    return headers, body, ms


def planned(port, name, view, **params):
    """A planned view: chosen setting, promises, what it took, whether the demand can be met; bytes; the client's ms."""
    headers, body, ms = ask_view(port, name, view, **params)
    plan = {k: dict(part.split("=") for part in headers["Splatd-" + k].split("; ")) for k in
            ("Chosen", "Promised", "Took")}
    return plan, headers["Splatd-Demand"], body, ms


@contextlib.contextmanager
def asked_beside(port, name, clients):
    """So many clients that ask for one new view after another, without a budget."""
    over = threading.Event()

    def ask(client):
        for i in range(100000):
            if over.is_set():
                return
            ask_view(port, name, court_views(1, 100000 * (client + 1) + i)[0])

    with concurrent.futures.ThreadPoolExecutor(max(clients, 1)) as pool:
        asking = [pool.submit(ask, i) for i in range(clients)]
        try:
            yield
        finally:
            over.set()
        for client in asking:
            client.result()


def keep_budgets(port, name, clients=1, beside=0):
    """200 mixed requests after 20, from so many clients at once: how many end within 1.1 times the budget."""
    print(f"budgets, {clients} clients at once, {beside} beside them that ask without a budget")
    chance, sizes, demands = random.Random(2), [(1280, 720), (960, 540), (640, 360)], []
    for view in court_views(220, 3):
        budget = chance.uniform(20, 200)
        view["width"], view["height"] = chance.choice(sizes)
        demands.append((view, budget))

    def ask(demand):
        view, budget = demand
        plan, met, _, ms = planned(port, name, view, budget=f"{budget:.1f}ms")
        chosen = "{method} lod={lod} ss={supersample}".format(**plan["Chosen"])
        return budget, float(plan["Promised"]["ms"]), float(plan["Took"]["ms"]), ms, met, chosen

    with asked_beside(port, name, beside), concurrent.futures.ThreadPoolExecutor(clients) as pool:
        rows = list(pool.map(ask, demands))[20:]
    counted = [r for r in rows if r[4] != "best-effort"]
    for setting in sorted({r[5] for r in counted}, key=lambda s: -sum(r[5] == s for r in counted)):
        print(f"  {setting}: {sum(r[5] == setting for r in counted)} times")
    unmet = [r for r in rows if r[4] == "best-effort"]
    print(f"{len(rows)} requests after 20; {len(unmet)} that no setting was expected to meet, of which "
          f"{sum(r[2] <= 1.1 * r[0] for r in unmet)} ended in time all the same")
    if not counted:
        return
    print(f"time used of the budget: median {statistics.median(r[2] / r[0] for r in counted):.2f}; measured / promised: "
          f"median {statistics.median(r[2] / r[1] for r in counted):.2f}")
    for most in (1.1, 1.2):
        print(f"within {most} times the budget: {100 * sum(r[2] <= most * r[0] for r in counted) / len(counted):.1f} %, as the "
              f"client sees it, waiting included, {100 * sum(r[3] <= most * r[0] for r in counted) / len(counted):.1f} %")
    bound("budgets missed by more than a tenth", 100 * sum(r[2] > 1.1 * r[0] for r in counted) / len(counted), 2, "%")


def keep_psnr(port, name, profile, folder):
    """PSNR demanded of views that are not in the profile, against exact images."""
    views = court_views(24, 5)
    truth = exact(CACHE / "planner-new", views)
    chance, met, counted, unmet = random.Random(4), 0, 0, 0
    best = max(p["psnr"] for p in profile["points"] if p["psnr"] is not None)
    picture = folder / "view.png"
    for view in views:
        for _ in range(4):
            wanted = chance.uniform(best - 14, best)
            plan, demand, body, _ = planned(port, name, view, psnr=f"{wanted:.2f}", format="png", transparent="true")
            if demand == "best-effort":
                unmet += 1
                continue
            picture.write_bytes(body)
            figures = json.loads(subprocess.run([SPLATD, "compare", picture, truth / (view["name"] + ".color.png"),
                                                 "--json"], check=True, stdout=subprocess.PIPE).stdout)
            reached = figures["psnr"] if figures["psnr"] is not None else 100
            counted += 1
            met += reached >= wanted
    print(f"{counted} demands of PSNR in {len(views)} new views; {unmet} more that no setting promises")
    bound("demands of PSNR missed", 100 * (1 - met / counted), 5, "%")


def planner():
    dataset, profile = profiled()
    port, name = free_port(), pathlib.Path(dataset).stem
    daemon = subprocess.Popen([SPLATD, "serve", "--quiet", "--cache", "0", "--listen", f"127.0.0.1:{port}", dataset])
    try:
        begin = time.monotonic()
        while True:
            try:
                if get(port, f"/v1/datasets/{name}/profile")[0] == 200:
                    break
                sys.exit("the daemon does not trust the profile")
            except OSError:
                if daemon.poll() is not None or time.monotonic() - begin > 60:
                    sys.exit("the daemon does not answer")
                time.sleep(0.05)
        keep_budgets(port, name)
        keep_budgets(port, name, clients=4)
        keep_budgets(port, name, clients=2, beside=2)
        with tempfile.TemporaryDirectory() as folder:
            keep_psnr(port, name, profile, pathlib.Path(folder))
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(30)


def fill():
    """Table 1 of the screen-space-filling paper: from the bridge, from the cab, close to the ground."""
    places = ["36.9,4,9.6", "18,2,1.5", "-34,0.97,2.2", "2,0,1.6", "-3,2.1,0.5", "9,1.4,-0.6"]
    if subprocess.run([os.environ["SPLATD_BENCH_FILL"], scan_of("railway", 300000), *places]).returncode:
        beyond.append("fill")


if __name__ == "__main__":
    figures = {"frames": frames, "scaling": scaling, "http": serve, "pack": pack, "size": size, "planner": planner,
               "fill": fill}
    if len(sys.argv) != 2 or sys.argv[1] not in figures:
        sys.exit(__doc__)
    CACHE.mkdir(parents=True, exist_ok=True)
    if sys.argv[1] not in ("planner", "fill"):  # which make their own
        scan()
    figures[sys.argv[1]]()
    if beyond:
        sys.exit("beyond its bound: " + "; ".join(beyond))
