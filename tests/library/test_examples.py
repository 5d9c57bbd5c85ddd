"""The examples of api/examples, built and run as their first lines say, on a scan that is made and packed here: their
pictures are those of `splatd render`, and what they pick lies where the picture says."""
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

from installed import ROOT, SKIPPED, Installed, run

SPLATD = os.environ["SPLATD_BINARY"]
EXAMPLES = ROOT / "api/examples"
POINTS = 20000
SIZE = "640x360"


def make_dataset(folder):
    run(SPLATD, "synth", "courtyard", "--points", POINTS, "--format", "ptx", "-o", folder)
    run(SPLATD, "pack", folder / "courtyard.ptx", "-o", folder / "courtyard.spld")
    return folder / "courtyard.spld"


def distance_at_the_middle(dataset, folder):
    run(SPLATD, "render", dataset, "--size", SIZE, "--layer", "range", "--format", "raw", "-o", folder / "range.raw")
    width, height = (int(number) for number in SIZE.split("x"))
    at = 4 * ((height // 2) * width + width // 2)
    return struct.unpack("<f", (folder / "range.raw").read_bytes()[at:at + 4])[0]


def check_said(said, dataset, folder):
    picked = re.search(r"^middle: (\S+) (\S+) (\S+), (\S+) away, splat (\d+)$", said, re.M)
    assert picked, said
    assert abs(float(picked[4]) - distance_at_the_middle(dataset, folder)) < 0.5, said
    assert re.search(r"^courtyard: \d+ splats of \d+ points$", said, re.M), said
    assert re.search(r"^drawn by \S+", said, re.M), said


def the_c_example(lib, dataset, folder):
    program = lib.build(EXAMPLES / "view.c")
    said = lib.run(program, dataset, folder / "example.png")
    run(SPLATD, "render", dataset, "--size", SIZE, "-o", folder / "command.png")
    assert (folder / "example.png").read_bytes() == (folder / "command.png").read_bytes(), "another picture"
    check_said(said, dataset, folder)
    print(said, end="")
    for arguments, why in (([], "usage: view"), ([folder / "none.spld", folder / "x.png"], "view: not-found: ")):
        wrong = subprocess.run([program, *arguments], env=lib.environment, capture_output=True, text=True)
        assert wrong.returncode and wrong.stderr.startswith(why), wrong
    assert not (folder / "x.png").exists()


def the_python_example(lib, dataset, folder):
    """As it is, into a numpy array where there is numpy, and as if there were none."""
    run(SPLATD, "render", dataset, "--size", SIZE, "--format", "raw", "-o", folder / "command.raw")
    raw = (folder / "command.raw").read_bytes()
    width, height = SIZE.split("x")
    wanted = f"P6\n{width} {height}\n255\n".encode() + bytes(raw[i] for i in range(len(raw)) if i % 4 != 3)
    without = "import sys, runpy; sys.modules['numpy'] = None; sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], " \
              "run_name='__main__')"
    for how in ([], ["-c", without]):
        said = lib.run(sys.executable, *how, EXAMPLES / "view.py", dataset, folder / "example.ppm")
        assert (folder / "example.ppm").read_bytes() == wanted, "another picture"
        check_said(said, dataset, folder)
        (folder / "example.ppm").unlink()
    print(said, end="")


def the_reader_example(lib, dataset):
    """Cancelled before the end, then opened whole, by the same reads."""
    said = lib.run(sys.executable, EXAMPLES / "reader.py", dataset)
    stopped = re.search(r"^cancelled after (\d+) of (\d+) bytes$", said, re.M)
    assert stopped and 0 < int(stopped[1]) < int(stopped[2]) == dataset.stat().st_size, said
    assert re.search(r"^courtyard: \d+ splats of \d+ points, through our own reads$", said, re.M), said
    wrong = subprocess.run([sys.executable, EXAMPLES / "reader.py", EXAMPLES / "view.py"], env=lib.environment,
                           capture_output=True, text=True)
    assert wrong.returncode == 1 and wrong.stderr.startswith("reader: view.py"), wrong
    print(said, end="")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        dataset = make_dataset(folder)
        probe = subprocess.run([SPLATD, "render", dataset, "--size", "16x16", "-o", folder / "probe.png"],
                               capture_output=True, text=True)
        if probe.returncode and "device" in probe.stderr:
            print(probe.stderr)
            return SKIPPED
        lib = Installed(folder / "installed")
        for check in (the_c_example, the_python_example):
            check(lib, dataset, folder)
        the_reader_example(lib, dataset)
    return 0


if __name__ == "__main__":
    sys.exit(main())
