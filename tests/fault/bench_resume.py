"""splatd bench -o on a small scene: what it writes, that a run ended with SIGKILL goes on to the same report, and what it
refuses. Times differ from run to run and are taken out before reports are compared.

usage: bench_resume.py resume|others     the test that takes as long as all others, or those
environment: SPLATD_BINARY, SPLATD_WALL_TEXTURED
"""
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

SPLATD = os.environ["SPLATD_BINARY"]
SETTINGS = ["--method", "splat,points", "--lod", "1,2", "--supersample", "1,2", "--repeats", "2"]
POINTS = 2 * 2 * 2
EYES = {"south": (-9, -7, 1.7), "north": (6.3, 7.4, 5.6), "low": (0.4, -4.6, 1.2)}


def splatd(*arguments, code=0):
    done = subprocess.run([SPLATD, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=300)
    if done.returncode == 1 and "no usable" in done.stderr:
        print("no device: " + done.stderr.strip())
        sys.exit(77)
    assert done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done


def views(path, **more):
    path.write_text(json.dumps({"views": [{"name": name, "width": 160, "height": 90, "camera": {
        "eye": eye, "target": [0, 0, 1.5], "fov": 60}} | more for name, eye in EYES.items()]}))
    return path


def timeless(report):
    """The report without what a clock gave, and without the front, which follows from it."""
    if isinstance(report, dict):
        gone = {"ms", "ms_q90", "fixed_ms", "ms_per_mpx", "spread", "device_ms", "stages_ms", "calibrator_ms", "front"}
        return {k: timeless(v) for k, v in report.items() if k not in gone}
    return [timeless(v) for v in report] if isinstance(report, list) else report


def bench(dataset, cams, out, *more, code=0):
    return splatd("bench", dataset, "--views", cams, *SETTINGS, "--no-profile", "-o", out, *more, code=code)


def all_methods():
    """As the program names them where it does not know one."""
    said = splatd("bench", "--method", "nosuch", "x.spld", code=2).stderr
    return re.search(r"--method takes ([\w, ]+), not", said)[1].split(", ")


def killed(command, state, lines):
    """Runs `command` and kills it once the state has `lines` lines."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120
    while not (state.exists() and state.read_bytes().count(b"\n") >= lines):
        assert process.poll() is None, f"it ended before {lines} results"
        assert time.monotonic() < end
        time.sleep(0.005)
    process.kill()
    process.wait()


def test_outputs_and_resume(folder, dataset):
    cams, whole, broken = views(folder / "v.json"), folder / "whole", folder / "broken"
    (folder / "peers.csv").write_text("name,ms,psnr\n<other>,20,31\n")
    said = bench(dataset, cams, whole, "--peers", folder / "peers.csv")
    report = json.loads((whole / "bench.json").read_text())
    assert len(report["points"]) == POINTS and all(len(p["views"]) == 3 for p in report["points"])
    assert report["reference"] == "self" and report["peers"][0]["name"] == "<other>"
    rows = (whole / "bench.csv").read_text().splitlines()
    assert len(rows) == 1 + POINTS and len({len(row.split(",")) for row in rows}) == 1
    chart, page = (whole / "chart.svg").read_text(), (whole / "index.html").read_text()
    assert chart.count("<circle") == 1 + POINTS and "<other>" not in chart
    assert len(re.findall('"/9j/', page)) == 3 * (1 + 2 * POINTS), "pictures inside the page"
    assert not re.search(r'(src|href)="?(http|//|file)', page), "needs no network"
    assert f'<body data-method="{all_methods()[0]}" data-atoms="8">' in page and not re.search("@[A-Z]+@", page), "begins there"
    assert not list(folder.glob("*.profile.json"))
    share = int(re.search(r"(\d+) % of it rendering", said.stderr)[1])
    print(f"{share} % rendering at 160x90")

    command = [SPLATD, "bench", dataset, "--views", cams, *SETTINGS, "--no-profile", "-o", broken]
    killed(command, broken / "state.jsonl", 15)   # in the middle of comparing
    killed(command, broken / "state.jsonl", 60)   # in the middle of timing
    with (broken / "state.jsonl").open("a") as state:
        state.write('{"setting": 1, "view')       # half a line, as a kill may leave it
    said = bench(dataset, cams, broken)
    went_on = re.search(r"went on from (\d+) results", said.stderr)
    assert went_on and 55 <= int(went_on[1]) < POINTS * 3 * (1 + 2 * 2), said.stderr
    second = json.loads((broken / "bench.json").read_text())
    del report["peers"], second["peers"]
    assert timeless(report) == timeless(second)
    lines = (broken / "state.jsonl").read_text().splitlines()[1:]
    keys = [tuple(json.loads(line).get(k) for k in ("setting", "view", "size", "repeat")) for line in lines]
    keys = [key for key in keys if key[0] is not None]
    assert len(keys) == len(set(keys)) == POINTS * 3 * (1 + 2 * 2), "every result once"

    # Another plan in the same folder is refused until --restart.
    said = bench(dataset, cams, broken, "--repeats", "1", code=2)
    assert "another 'repeats'" in said.stderr and "--restart" in said.stderr
    assert bench(dataset, cams, broken, "--repeats", "1", "--restart")


def test_profile(folder, dataset):
    splatd("bench", dataset, "--size", "96x54", "--frames", "2", "--repeats", "1", "--lod", "1,2", "-o",
           folder / "o")
    profile = json.loads((folder / "small.profile.json").read_text())
    assert profile["format"] == "splatd-profile" and profile["views"] == 2
    methods = [p["method"] for p in profile["points"]]
    assert {m: methods.count(m) for m in all_methods()} == dict.fromkeys(methods, 2 * 5), "two levels, five sizes"
    splatd("bench", dataset, "--size", "96x54", "--frames", "2", "--repeats", "1", "--lod", "1,2", "-o",
           folder / "o", "--profile", folder / "elsewhere.json")
    assert (folder / "elsewhere.json").read_text() == (folder / "small.profile.json").read_text()


def test_atoms(folder, dataset):
    textured, cams, out = pathlib.Path(os.environ["SPLATD_WALL_TEXTURED"]), folder / "wall.json", folder / "t"
    cams.write_text(json.dumps({"views": [{"name": "near", "width": 96, "height": 54, "camera": {
        "eye": [1, 0, 1], "target": [0, 0, 1], "fov": 60}}]}))
    command = ["bench", textured, "--views", cams, "--repeats", "1", "-o", out]
    splatd(*command, "--lod", "0", "--supersample", "1,4", "--atoms", "0,2,8", "--profile", folder / "t.json")
    points = json.loads((folder / "t.json").read_text())["points"]
    assert len(points) == 2 * 3 + 2 * (len(all_methods()) - 1), "splat alone draws textures"
    splats = {p["atoms"]: p for p in points if (p["method"], p["lod"], p["supersample"]) == ("splat", 0, 4)}
    assert splats[8]["psnr"] == 100, "the reference draws all atoms"
    assert splats[0]["psnr"] < splats[2]["psnr"] < 100, {a: p["psnr"] for a, p in splats.items()}
    assert all(p["atoms"] == 8 for p in points if p["method"] != "splat")
    head, *rows = (out / "bench.csv").read_text().splitlines()
    assert head.startswith("method,lod,supersample,atoms,front,") and any(r.startswith("splat,0,4,2,") for r in rows)
    assert "stroke-opacity" in (out / "chart.svg").read_text()
    said = splatd(*command, "--lod", "0", "--supersample", "1,4", "--atoms", "0,4,8", "--no-profile", code=2).stderr
    assert "another 'settings'" in said, said
    splatd(*command, "--lod", "1", "--supersample", "1", "--method", "splat", "--profile", folder / "t.json", "--restart")
    assert [p["atoms"] for p in json.loads((folder / "t.json").read_text())["points"]] == [0, 2, 8], "the default"
    for atoms, text in (("2,2", "splat lod=1 atoms=2 is asked for twice"), ("9", "--atoms"), ("all", "--atoms")):
        said = splatd(*command, "--method", "splat", "--lod", "1", "--supersample", "1", "--atoms", atoms, code=2).stderr
        assert text in said, said
    said = splatd("bench", dataset, "--atoms", "2", "-o", folder / "n", code=2).stderr
    assert "'small' has none" in said and not (folder / "n").exists(), said
    assert "-o OUT" in splatd("bench", textured, "--atoms", "2", code=2).stderr


def test_maps(folder, dataset):
    splatd("synth", "courtyard", "--points", "20000", "--format", "ptx", "-o", folder / "scan")
    mapped, cams, out = folder / "mapped.spld", folder / "m-views.json", folder / "m"
    cams.write_text(json.dumps({"views": [{"name": "near", "width": 64, "height": 36, "camera": {
        "eye": EYES["low"], "target": [0, 0, 1.5], "fov": 60}}]}))
    splatd("pack", folder / "scan" / "courtyard.ptx", "--panoramas", "scan", "-o", mapped)
    command = ["bench", mapped, "--views", cams, "--repeats", "1", "--lod", "2", "--supersample", "1", "-o", out]
    splatd(*command, "--profile", folder / "m.json")
    points = json.loads((folder / "m.json").read_text())["points"]
    assert [(p["method"], p.get("maps")) for p in points if p["method"] in ("splat", "points")] == [
        ("splat", "on"), ("splat", "off"), ("points", None)], points
    splats = {p["maps"]: p["psnr"] for p in points if p["method"] == "splat"}
    assert splats["on"] != splats["off"], splats
    rows = list(csv.DictReader((out / "bench.csv").read_text().splitlines()))
    assert [r["maps"] for r in rows if r["method"] in ("splat", "points")] == ["on", "off", ""], rows
    assert ">splat + panorama<" in (out / "chart.svg").read_text()
    assert "another 'settings'" in splatd(*command, "--maps", "off", "--no-profile", code=2).stderr
    splatd(*command, "--maps", "off", "--method", "splat", "--profile", folder / "m.json", "--restart")
    assert [p["maps"] for p in json.loads((folder / "m.json").read_text())["points"]] == ["off"]
    assert "'small' has none" in splatd("bench", dataset, "--maps", "on", code=2).stderr
    assert "-o OUT" in splatd("bench", mapped, "--maps", "both", code=2).stderr
    assert "on, off or both, not 'some'" in splatd("bench", mapped, "--maps", "some", code=2).stderr
    for maps in "on", "off":
        report = json.loads(splatd("bench", mapped, "--maps", maps, "--frames", "2", "--size", "96x54", "--json").stdout)
        assert len(report["rows"]) == 1, report


def test_references(folder, dataset):
    """A render of the scene as its own 'exact' image: equal pixels, and what is refused."""
    cams, truth = views(folder / "v.json"), folder / "truth"
    truth.mkdir()
    said = bench(dataset, cams, folder / "r", "--reference", truth, code=1)
    assert "view 'south' has no reference" in said.stderr and "south.color.png" in said.stderr
    for name, eye in EYES.items():
        for layer, ending in (("color", "png"), ("depth", "npy")):
            splatd("render", dataset, f"--eye={','.join(map(str, eye))}", "--target=0,0,1.5", "--fov=60", "--size=160x90",
                   "--near=0.01", "--far=1e12", "--background=transparent", f"--layer={layer}", "-o",
                   truth / f"{name}.{layer}.{ending}")
    splatd("bench", dataset, "--views", cams, "--reference", truth, "--method", "splat", "--lod", "1,2", "--supersample", "1",
           "--repeats", "1", "--no-profile", "-o", folder / "r")
    points = json.loads((folder / "r" / "bench.json").read_text())["points"]
    assert points[0]["psnr"] == 100 and points[0]["depth_beyond"] == 0 and points[0]["normal_mean"] is None, points[0]
    assert points[1]["psnr"] < 60
    splatd("render", dataset, "--size=160x91", "-o", truth / "low.color.png")
    said = bench(dataset, cams, folder / "r2", "--reference", truth, code=2)
    assert "low.color.png" in said.stderr and "160x91" in said.stderr and "160x90" in said.stderr
    assert not (folder / "r2").exists(), "refused before anything is made"


def test_refusals(folder, dataset):
    cams, out = views(folder / "v.json"), folder / "x"
    assert "'south' names no photograph" in bench(dataset, cams, out, "--photographs", code=2).stderr
    views(cams, photograph="nowhere.jpg")
    said = bench(dataset, cams, out, "--photographs", code=1).stderr
    assert "'south'" in said and "nowhere.jpg" in said
    camera = {"eye": [900, 0, 2], "target": [901, 0, 2], "fov": 60}
    views(cams, camera=camera)
    assert "'south' shows nothing of small" in bench(dataset, cams, out, code=2).stderr
    (folder / "bad.csv").write_text("name,ms,psnr\na,1,2\nb,zero,3\n")
    said = bench(dataset, views(cams), out, "--peers", folder / "bad.csv", code=2).stderr
    assert "bad.csv: line 3" in said and "'zero' is no ms" in said
    assert "--views" in splatd("bench", dataset, "--reference", folder, "-o", out, code=2).stderr
    assert "twice" in splatd("bench", dataset, "--lod", "1,1", "-o", out, code=2).stderr
    assert "-o OUT" in splatd("bench", dataset, "--supersample", "2", code=2).stderr
    assert "one dataset" in splatd("bench", dataset, dataset, "-o", out, code=2).stderr
    assert "1.5, 2 and 4, not '3'" in splatd("bench", dataset, "--supersample", "3", "-o", out, code=2).stderr
    assert not out.exists()
    linked, elsewhere = folder / "linked", folder / "elsewhere"
    linked.mkdir(), elsewhere.mkdir()
    (linked / "pictures").symlink_to(elsewhere)
    said = bench(dataset, cams, linked, code=2).stderr
    assert "linked/pictures: no folder" in said and not list(elsewhere.iterdir()), said


def main():
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        splatd("synth", "courtyard", "--points", "20000", "--format", "ply", "-o", folder / "scan")
        splatd("pack", folder / "scan" / "courtyard.ply", "-o", folder / "small.spld")
        parts = {"resume": [test_outputs_and_resume],
                 "others": [test_profile, test_atoms, test_maps, test_references, test_refusals]}
        for test in parts[sys.argv[1]]:
            try:
                test(folder, folder / "small.spld")
                print("ok   " + test.__name__, flush=True)
            except AssertionError as wrong:
                failed += 1
                print(f"FAIL {test.__name__}: line {wrong.__traceback__.tb_next.tb_lineno}: {wrong}", flush=True)
    sys.exit(1 if failed else 0)


main()
