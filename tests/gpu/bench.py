"""splatd bench: a row for each combination, in the order that the options name them; what cannot be measured is refused."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SPLATD = os.environ["SPLATD_BINARY"]


def run(*arguments):
    return subprocess.run([SPLATD, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def must(*arguments):
    done = run(*arguments)
    assert done.returncode == 0, f"splatd {arguments}: exit {done.returncode}: {done.stderr}"
    return done.stdout


listed = json.loads(run("devices", "--json").stdout)
backends = list(dict.fromkeys(d["backend"] for d in listed if d["usable"]))
if not backends:
    print("no usable device")
    sys.exit(77)

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    must("synth", "courtyard", "--points", 5000, "--classes", "--format", "ply", "-o", folder)
    for name in "ab":
        must("pack", folder / "courtyard.ply", "-o", folder / f"{name}.spld")
    view = {"eye": [9, 7, 5], "target": [0, 0, 2], "up": [0, 0, 1], "vfov_deg": 50, "near": 0.1, "far": 100}
    (folder / "views.json").write_text(json.dumps({"yard": {"overview": view, "close": {**view, "eye": [5, 4, 3]}}}))
    common = ["--frames", 3, "--size", "160x120"]

    report = json.loads(must("bench", folder / "a.spld", folder / "b.spld", *common, "--device", ",".join(backends),
                             "--method", "points,splat", "--lod", "2,1", "--views", folder / "views.json", "--json"))
    assert (report["width"], report["height"], report["frames"]) == (160, 120, 3), report
    got = [(r["dataset"], r["backend"], r["method"], r["lod"]) for r in report["rows"]]
    assert got == [(d, b, m, l) for d in "ab" for b in backends for m in ("points", "splat") for l in (2, 1)], got
    for r in report["rows"]:
        for times in (r["frame_ms"], r["units"], report["calibrator_ms"]):
            assert 0 < times["min"] <= times["q1"] <= times["median"] <= times["q3"] <= times["max"], r
        assert r["splats_drawn"] > 0 and r["incomplete_frames"] == 0 and r["floor_ms"] > 0, r
    drawn = {got[i]: r["splats_drawn"] for i, r in enumerate(report["rows"])}
    for d, b, m, lod in got:
        assert drawn[d, b, m, lod] == drawn["a", backends[0], "splat", lod], drawn

    table = must("bench", folder / "a.spld", *common)
    assert "1 unit =" in table and sum(line.startswith("a ") for line in table.splitlines()) == 1, table

    soft = ["--soft", "box:-2,-2,0,2,2,3", "--soft", "plane:0,0,2,0,0,1>0", "--soft-model", "layer,express"]
    rows = json.loads(must("bench", folder / "a.spld", *common, *soft, "--lod", "2,1", "--json"))["rows"]
    assert [(r["lod"], r["soft"]) for r in rows] == [(l, s) for l in (2, 1) for s in ("solid", "layer", "express")], rows
    assert all((r["spheres_drawn"] > 0) == (r["soft"] != "solid") and r["processor_ms"] > 0 for r in rows), rows
    table = must("bench", folder / "a.spld", *common, *soft)
    assert "soft ms    spheres" in table and "spheres" not in must("bench", folder / "a.spld", *common)
    for terms, says in (["class:77"], "'class:77': class in 'a' is 1, 2,"), (["plane:0,0,90,0,0,1>0"], "lies beside it: its bounds are"), \
            (["class:2"], None), (["box:-8,-8,0,8,8,0.5 or class:77"], "'class:77'"):
        done = run("render", folder / "a.spld", "--size", "64x48", "--soft", *terms, "-o", folder / "warned.png")
        assert done.returncode == 0 and (says in done.stderr if says else "nothing" not in done.stderr), (terms, done.stderr)
        assert int(re.search(r"(\d+) soft spheres in ", done.stderr)[1]) > 0 or terms[0] in ("class:77", "plane:0,0,90,0,0,1>0"), done.stderr
    done = run("bench", folder / "a.spld", *common, "--soft", "class:77")
    assert done.returncode == 0 and "nothing is soft by 'class:77'" in done.stderr, done.stderr
    told = json.loads(must("info", folder / "a.spld", "--json"))
    assert {"value": 2.0, "name": "ground"}.items() <= told["classes"][1].items() and sum(c["count"] for c in told["classes"]) > 4000, told
    assert re.search(r"^  classes .*2 ground [\d,]+ \(\d", must("info", folder / "a.spld"), re.MULTILINE)
    key = {"camera": {"eye": [9, 7, 5], "target": [0, 0, 2]}}
    (folder / "keys.json").write_text(json.dumps({"keyframes": [{**key, "soft_opacity": 1}, {**key, "soft_opacity": 0}]}))
    done = run("tour", folder / "a.spld", "--path", folder / "keys.json", "--frames", 2, "--size", "16x16", "-o", folder / "tour")
    assert done.returncode == 2 and "--soft" in done.stderr and not (folder / "tour").exists(), done
    assert [line.split()[3] for line in table.splitlines() if line.startswith("a ")] == ["solid", "layer", "express"], table

    compared = ["bench", folder / "a.spld", *soft[:4], "--soft-model", "base,express", "--method", "splat", "--lod", 2,
                "--supersample", 1, "--frames", 2, "--size", "80x60", "--repeats", 1, "-o", folder / "compared"]
    table = must(*compared)
    report = json.loads((folder / "compared/bench.json").read_text())
    profile = json.loads((folder / "a.profile.json").read_text())
    assert report["soft"] == profile["soft"] == {"terms": f"{soft[1]} or {soft[3]}", "opacity": 0.3, "cover": 1, "blend": 0}, report["soft"]
    assert profile["format_version"] == 2
    for points in (report["points"], profile["points"]):
        assert [p.get("soft_model") for p in points] == [None, "base", "express"], points
        assert "soft_ms" not in points[0] and all(0 < p["soft_ms"] <= p["ms"] for p in points[1:]), points
        assert all(p["psnr"] > 15 for p in points), points
    solid, base, express = report["points"]
    assert base["psnr"] >= express["psnr"] - 1 and base["psnr"] != express["psnr"], (base, express)  # base is the reference
    rows = [row.split(",") for row in (folder / "compared/bench.csv").read_text().splitlines()]
    assert [row[rows[0].index("soft_model")] for row in rows[1:]] == ["solid", "base", "express"], rows
    chart = (folder / "compared/chart.svg").read_text()
    assert ">splat<" in chart and ">splat, base<" in chart and ">splat, express<" in chart
    page = (folder / "compared/index.html").read_text()
    assert page.count('"soft_reference":"') == 2, page[-2000:]
    assert (folder / "compared/pictures/view0-reference.jpg").read_bytes() != \
        (folder / "compared/pictures/view0-reference-soft.jpg").read_bytes()
    state = (folder / "compared/state.jsonl").read_text()
    assert must(*compared).splitlines()[0] == table.splitlines()[0]  # nothing is measured again
    assert (folder / "compared/state.jsonl").read_text() == state
    other = run(*[x if x != soft[1] else "box:-1,-1,0,2,2,3" for x in compared])
    assert other.returncode != 0 and "--restart" in other.stderr, other.stderr

    must("pack", folder / "courtyard.ply", "--max-points", 3000, "-o", folder / "c.spld")
    must("collect", folder / "a.spld", folder / "c.spld", "-o", folder / "yards.spld")  # tiles are read as views need them
    rows = json.loads(must("bench", folder / "yards.spld", folder / "a.spld", *common, "--json"))["rows"]
    assert [r["dataset"] for r in rows] == ["yards", "a"] and rows[0]["incomplete_frames"] == 0, rows
    assert rows[0]["splats_drawn"] > rows[1]["splats_drawn"] > 0, rows
    must("bench", folder / "yards.spld", *common, "--method", "splat", "--lod", "1,2", "--supersample", 1, "--repeats", 1, "-o", folder / "city")
    points = json.loads((folder / "city/bench.json").read_text())["points"]
    assert len(points) == 2 and all(p["psnr"] > 15 for p in points) and (folder / "yards.profile.json").exists(), points
    for way in ("--textures", "--left-out"):  # these go through every splat
        done = run("bench", way, folder / "yards.spld", "-o", folder / "none")
        assert done.returncode != 0 and done.stderr and not (folder / "none").exists(), (way, done)
    (folder / "c.spld").unlink()
    done = run("bench", folder / "yards.spld", *common, "--method", "splat", "--lod", 1, "--repeats", 1, "-o", folder / "less")
    assert done.returncode != 0 and "needs every tile" in done.stderr and "c.spld" in done.stderr, done.stderr

    for wrong in (["--soft-model", "base"], ["--soft", "box:1"], ["--soft", "class:1", "-o", folder / "out", "--photographs"],
                  ["--soft", "class:1", "--soft-model", "base,base"], ["--soft", "class:1", "--soft-opacity", 2],
                  ["--set", "yard"], ["--views", folder / "views.json", "--set", "hall"], ["--frames", 1],
                  ["--views", folder / "no.json"], ["--method", "lines"], ["--lod", "-1"], ["--size", "160x"]):
        done = run("bench", folder / "a.spld", *wrong)
        assert done.returncode == 2 and done.stderr and not done.stdout, (wrong, done)
    assert run("bench", folder / "a.spld", "--device", "no such device").returncode == 1
