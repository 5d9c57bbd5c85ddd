#!/usr/bin/env python3
"""Faults of one line that a test must notice: tests/mutants/ROOM.toml lists them, each with the file, the text that
stands there once, the text of the fault, and the tests that fail with it. A fault that lives is a test that is missing.

usage: mutants.py                       applies each in a copy, builds, runs its tests: KILLED or LIVED
         --only TEXT                    those whose room, file, words or tests hold TEXT; may be repeated
         --keep DIR                     uses and leaves DIR (copy and build), so that the next run begins warm
         --shard I/N                    every N-th from the I-th on (1 to N)
       mutants.py --check ROOT          judges the list alone
       mutants.py --self-test           plants every kind of mistake in a list and checks that it is found
"""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
LEAST = 40  # faults of the list
ROOMS = {"base", "geom", "image", "cloud", "sparse", "dataset", "gpu", "render", "synth", "pack", "measure", "service",
         "cmd", "shaders"}
KEYS = {"what", "file", "old", "new", "fails"}


def read(folder):
    """The faults of a list, each with its room."""
    faults = []
    for path in sorted(folder.glob("*.toml")):
        for fault in tomllib.loads(path.read_text(encoding="utf-8")).get("fault", []):
            faults.append({**fault, "room": path.stem})
    return faults


def tests_of(root):
    """Names that a fault may call: those that meson files of tests spell out, of some rooms behind the room's name, and
    those of both devices."""
    names = set()
    for path in (root / "tests").rglob("meson.build"):
        text, room = path.read_text(encoding="utf-8"), path.parent.name
        prefix = f"{room}-" if f"test('{room}-' + name" in text else ""
        names |= {prefix + name for name in re.findall(r"'([\w./-]+)'", text)}
    return names | {f"{name}-{device}" for name in names for device in ("vulkan", "egl")}


def violations(root, faults, least=LEAST):
    if len(faults) < least:
        yield f"{len(faults)} faults, fewer than {least}"
    for room in sorted(ROOMS - {fault["room"] for fault in faults}):
        yield f"{room}: no fault"
    known, seen = tests_of(root), set()
    for fault in faults:
        name = f"{fault['room']}: {fault.get('what', '?')}"
        if set(fault) - {"room"} != KEYS:
            yield f"{name}: keys {sorted(set(fault) - {'room'})} instead of {sorted(KEYS)}"
            continue
        path = root / fault["file"]
        top = "shaders/" if fault["room"] == "shaders" else f"src/{fault['room']}/"
        if fault["room"] not in ROOMS or not fault["file"].startswith(top):
            yield f"{name}: {fault['file']} is not of its room"
        if (fault["file"], fault["old"], fault["new"]) in seen:
            yield f"{name}: stands there twice"
        seen.add((fault["file"], fault["old"], fault["new"]))
        found = path.read_text(encoding="utf-8").count(fault["old"]) if path.is_file() else 0
        if found != 1:
            yield f"{name}: {found} places in {fault['file']} instead of one"
        if fault["old"] == fault["new"] or "\n" in fault["old"] + fault["new"]:
            yield f"{name}: not another text of one line"
        for test in fault["fails"] or [""]:
            if test not in known:
                yield f"{name}: no test '{test}'"


def plant(file="src/base/a.c", old="x = 1;", new="x = 2;", fails=("one",), **more):
    return {"room": "base", "what": "w", "file": file, "old": old, "new": new, "fails": list(fails), **more}


PLANTED = [  # faults of a list, and what must be said of it; None = nothing
    ([plant()], None),
    ([plant(fails=["one-egl"])], None),
    ([plant(old="y")], "base: w: 2 places in src/base/a.c instead of one"),
    ([plant(old="z = 1;")], "base: w: 0 places in src/base/a.c instead of one"),
    ([plant(file="src/base/none.c")], "base: w: 0 places in src/base/none.c instead of one"),
    ([plant(file="src/geom/b.c", old="z = 1;")], "base: w: src/geom/b.c is not of its room"),
    ([plant(new="x = 1;")], "base: w: not another text of one line"),
    ([plant(fails=["none"])], "base: w: no test 'none'"),
    ([plant(fails=[])], "base: w: no test ''"),
    ([plant(), plant()], "base: w: stands there twice"),
    ([plant(why="so")], "base: w: keys"),
    ([], "0 faults, fewer than 1"),
]


def self_test():
    global ROOMS
    rooms, ROOMS = ROOMS, {"base"}
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in {"src/base/a.c": "x = 1; y; y", "src/geom/b.c": "z = 1;", "tests/meson.build": "test('one')"}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        for faults, said in PLANTED:
            found = list(violations(root, faults, 1))
            if (said is None and found) or (said is not None and not any(f.startswith(said) for f in found)):
                yield f"wanted {said!r}, found {found}"
        missing = list(violations(root, [], 0))
        if missing != ["base: no fault"]:
            yield f"a room without faults: {missing}"
    ROOMS = rooms


class Copy:
    """A copy of the working tree and its build."""

    def __init__(self, root, folder):
        self.tree, self.build = folder / "tree", folder / "build"
        self.took, self.limits = {}, {}  # seconds of each test without a fault; its time limit
        names = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root,
                               stdout=subprocess.PIPE, check=True, text=True).stdout.split("\0")
        for name in filter(None, names):
            source, target = root / name, self.tree / name
            if not source.is_file():
                target.unlink(missing_ok=True)
            elif not target.is_file() or source.read_bytes() != target.read_bytes():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
                shutil.copymode(source, target)
        if not (self.build / "build.ninja").is_file():
            subprocess.run(["meson", "setup", str(self.build), str(self.tree)], check=True, stdout=subprocess.DEVNULL)

    def patience(self, tests):
        """Multiple of the tests' time limits that is waited for: 4 at first, then a minute and ten times what they took
        without a fault, since many a fault hangs and some limits are minutes."""
        if not all(test in self.took for test in tests):
            return 4
        if not self.limits:
            told = subprocess.run(["meson", "introspect", "--tests", str(self.build)], stdout=subprocess.PIPE, check=True)
            self.limits = {test["name"]: test["timeout"] for test in json.loads(told.stdout)}
        return min(4, max((60 + 10 * self.took[test]) / (self.limits.get(test) or 30) for test in tests))

    def run(self, tests):
        """Builds what the tests need and runs them: their results by name, or None where that does not build."""
        log = self.build / "meson-logs" / "testlog.json"
        log.unlink(missing_ok=True)
        subprocess.run(["meson", "test", "-C", str(self.build), "--timeout-multiplier",
                        str(self.patience(tests)), *tests], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, check=False)
        if not log.is_file():
            return None
        rows = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
        for row in rows:
            self.took.setdefault(row["name"].split(" / ")[-1], row["duration"])
        return {row["name"].split(" / ")[-1]: row["result"] for row in rows}


def verdict(results, tests):
    if results is None:
        return "DOES NOT BUILD"
    passed = [test for test in tests if results.get(test) == "OK"]
    skipped = [test for test in tests if results.get(test) == "SKIP"]
    if passed:
        return "LIVED in " + ", ".join(passed)
    return "KILLED" if len(skipped) < len(tests) else "not tried, skipped: " + ", ".join(skipped)


def apply(copy, fault):
    path = copy.tree / fault["file"]
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(fault["old"], fault["new"]), encoding="utf-8")
    try:
        return copy.run(fault["fails"])
    finally:
        path.write_text(text, encoding="utf-8")


def run_all(root, faults, folder):
    copy = Copy(root, folder)
    wanted = sorted({test for fault in faults for test in fault["fails"]})
    before = copy.run(wanted)
    broken = wanted if before is None else [test for test in wanted if before.get(test) not in ("OK", "SKIP")]
    if broken:
        print("fail without any fault: " + ", ".join(broken), flush=True)
    lived = []
    for number, fault in enumerate(faults, 1):
        began, name = time.monotonic(), f"{fault['room']}: {fault['what']} ({fault['file']})"
        useless = [test for test in fault["fails"] if test in broken]
        said = "NOT TRIED, fails without it: " + ", ".join(useless) if useless else \
            verdict(apply(copy, fault), fault["fails"])
        if not said.startswith(("KILLED", "not tried")):
            lived.append(f"{said}: {name}")
        print(f"{number:3}/{len(faults)} {said}: {name}, {', '.join(fault['fails'])}, {time.monotonic() - began:.1f} s", flush=True)
    print("\n".join([f"{len(faults) - len(lived)} of {len(faults)} faults noticed", *lived]))
    return not lived


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ", 1)[1])
    parser.add_argument("--check")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--keep")
    parser.add_argument("--shard", default="1/1")
    options = parser.parse_args()
    faults = read(HERE)
    if options.self_test or options.check:
        wrong = list(self_test() if options.self_test else violations(pathlib.Path(options.check), faults))
        print("\n".join(wrong) or f"{len(faults)} faults, each in its place")
        return not wrong
    part, parts = map(int, options.shard.split("/"))
    faults = [f for f in faults if not options.only or any(text in json.dumps(f) for text in options.only)][part - 1::parts]
    with tempfile.TemporaryDirectory() as folder:
        return run_all(HERE.parent.parent, faults, pathlib.Path(options.keep or folder).absolute())


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
