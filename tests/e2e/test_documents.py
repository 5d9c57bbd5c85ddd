"""The examples of the documents and of every --help, as they are printed there: each curl gets an answer from a daemon, each
splatd and splatd.sh does what it says on small inputs. A splatd command may fail for one reason only, that a file is not
there which its reader would have (a scan, photographs); benchmarks and daemons run in an empty folder, so that they get as
far as their arguments."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__)
ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"]).resolve()
sys.path.insert(0, str(HERE.parents[1] / "http"))
from harness import REAL, TEXTURED, Daemon, run

COMMANDS = "serve pack collect render tour info synth bench compare devices sign plan".split()
SERVICE = "http://127.0.0.1:8080"
# What an example of a reader's own site needs, which no test has.
ELSEWHERE = re.compile(r"https://|s3://|\$TOKEN|docker |kubectl ")
# (command, what its example has, what is put behind it so that it does not take long)
SMALLER = [("synth", " -o ", "--points 3000"), ("synth", "--print-views", "--size 16x12"),
           ("synth", "--panoramas", "--panoramas 256 --samples 1"), ("synth", "--photos", "--photos 2 --panoramas 256 --photo-size 16x12"), ("tour", "", "--size 32"), ("tour", "roof-tour", "--frames 5"),
           ("render", "", "--size 32")]


def help_of(command):
    return subprocess.run([REAL, command, "--help"], capture_output=True, text=True, check=True, timeout=600).stdout


def complete(text):
    """Whether quotes are closed and the line does not go on."""
    plain = re.sub(r"'[^']*'|\"(\\.|[^\"\\])*\"", "", text)
    return not text.endswith("\\") and "'" not in plain and '"' not in plain


def examples():
    """(where, command) of every line of code that begins with splatd, splatd.sh or curl, joined with those it goes on in."""
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "deploy/operating.md")}
    texts.update((str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")) for file in sorted((ROOT / "api").rglob("*.md")))
    for command in COMMANDS:
        words = help_of(command)
        texts[f"splatd {command} --help"] = re.sub(r"^usage:(.*\n)(       .*\n)*", "", words)
    for where, text in texts.items():
        lines = re.sub(r"^```.*$", "", text, flags=re.M).splitlines()
        while lines:
            line = lines.pop(0)
            if not re.match(r"\s*(splatd(\.sh)?|curl) [\w'\"$-]", line) or not (line[0] == " " or "curl" in line):
                continue
            while not complete(line) and lines:
                line += "\n" + lines.pop(0)
            if not ELSEWHERE.search(line) and "..." not in line and "…" not in re.sub("#.*", "", line):
                yield where, line.strip()


def bash(command, folder, **environment):
    return subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, errors="replace", timeout=600,
                          env={**os.environ, **environment})


def test_requests():
    functions = 'curl() { command curl -sS --fail-with-body -o got "$@"; }; splatd.sh() { "$CLIENT" "$@"; }; '
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as tours:
        datasets = [str(pathlib.Path(folder, name)) for name in ("hall.spld", "courtyard.spld")]
        subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--station", *datasets], check=True)
        datasets.append(str(pathlib.Path(folder, "town.spld")))  # where the examples by longitude and latitude are
        subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--unit=ft", "--crs=EPSG:2994", datasets[-1]], check=True)
        pathlib.Path(folder, "camera_path.json").write_text(PATH)
        pathlib.Path(folder, "hall.views.json").write_text('{"views": [{"name": "door", "eye": [3, 0, 1], "target": [0, 0, 1]}]}')
        pathlib.Path(folder, "directions.npy").write_bytes(DIRECTIONS)
        with Daemon(REAL, "--tours", tours, datasets=datasets) as d:
            here = f"http://127.0.0.1:{d.port}"
            asked = 0
            for where, command in examples():
                if not re.match(r"curl|splatd\.sh", command):
                    continue
                asked += 1
                url = f"{here}/v1/datasets/{'courtyard/view' if 'serve' in where else 'hall'}"
                done = bash(functions + command.replace(SERVICE, here), folder, url=url, SPLATD_URL=here,
                            CLIENT=str(ROOT / "api/clients/splatd.sh"))
                said = done.stdout + pathlib.Path(folder, "got").read_text(errors="replace")
                refused = "without libavcodec" in said or "has no PROJ" in said
                assert done.returncode == 0 or refused, (where, command, done.stdout[-500:], done.stderr[-500:])
            assert asked >= 12, asked
            for file in [ROOT / "README.md", *(ROOT / "api").rglob("*.md")]:
                for address in re.findall(r"(?<!\()" + re.escape(SERVICE) + r"(/(?:[^\s\"'`#)<]|<(?=[\d.]|plane:))*)", file.read_text(encoding="utf-8")):
                    # templates are for maps to fill in; others are POSTed to, as the commands do
                    if not address.endswith("/tours") and "/rays" not in address and "{" not in address:
                        assert d.ask(address).status == 200, (file, address)


DIRECTIONS = b"\x93NUMPY\x01\x00\x3c\x00" + b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3)}".ljust(59) + b"\n" + bytes(8) + b"\0\0\x80?"
PATH = """{"camera_path": [{"camera_to_world": [0,0,1,3, 1,0,0,0, 0,1,0,1, 0,0,0,1], "fov": 60},
 {"camera_to_world": [0,0,1,2, 1,0,0,0, 0,1,0,1, 0,0,0,1], "fov": 60}], "render_width": 64, "render_height": 48, "fps": 24}"""


def test_commands():
    with tempfile.TemporaryDirectory() as full, tempfile.TemporaryDirectory() as empty, tempfile.TemporaryDirectory() as other:
        pathlib.Path(full, "camera_path.json").write_text(PATH)
        pathlib.Path(full, "directions.npy").write_bytes(DIRECTIONS)
        pathlib.Path(full, "groundtruth.txt").write_text("1 3 0 1 0 0 0 1\n2 3 0 2 0 0 0 1\n")
        pathlib.Path(full, "keys.json").write_text('{"keyframes": [{"camera": {"eye": [3, 0, 1], "target": [0, 0, 1], "fov": 60}},'
                                                   ' {"camera": {"eye": [2, 1, 1], "target": [0, 0, 1], "fov": 60}}], "fps": 2}')
        shutil.copytree(ROOT / "api/examples", pathlib.Path(full, "api/examples"),
                        ignore=shutil.ignore_patterns("__pycache__"))  # which another test may be writing
        key = pathlib.Path(full, "url.key")
        key.write_text("0123456789abcdef0123456789abcdef\n")
        key.chmod(0o600)
        made = bash(f"{REAL} synth courtyard --points 3000 --format ply -o . && mv courtyard.ply hall.ply", full)
        assert made.returncode == 0, made
        subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--station", f"{other}/wall.spld"], check=True)
        ran = set()
        for where, example in examples():
            for command in re.split(r"&&|\|", example):
                found = re.match(r"\s*splatd (\w+)(.*)", command, re.S)
                if not found:
                    continue
                name, rest = found.groups()
                assert name in COMMANDS, (where, command)
                for file, source in ("hall.spld", TEXTURED), ("courtyard.spld", f"{other}/wall.spld"):  # others may have written over them
                    shutil.copy(source, pathlib.Path(full, file))
                folder = empty if name in ("bench", "serve") else full
                rest = re.sub(r"\s{2,}#.*", "", rest.replace("\\\n", " "))
                rest, arrow, target = rest.partition(" >")
                rest += " ".join(["", *(more for which, has, more in SMALLER if which == name and has in rest and "--rays" not in rest)])
                done = bash(f"{REAL} {name}{rest} {arrow}{target}", folder)
                absent = re.search(r"no such file|No such file|is no file|is no folder", done.stderr)
                unbuilt = name == "tour" and "libavcodec" in done.stderr
                assert done.returncode == 0 or absent or unbuilt, (where, command, done.returncode, done.stderr)
                if done.returncode == 0:
                    ran.add(name)
        assert ran == {"pack", "render", "tour", "info", "synth", "devices", "sign", "plan"}, ran


def test_pictures():
    """The commands that make pictures of the documents, on fewer points; what lies there is no larger than a page should load."""
    with tempfile.TemporaryDirectory() as folder:
        binaries = pathlib.Path(folder, "bin")
        binaries.mkdir()
        (binaries / "splatd").symlink_to(REAL)
        for name, needs in (("default-views", "ffmpeg"), ("clip", "ffmpeg"), ("around", "ffmpeg"), ("colors", "ffmpeg"),
                            ("map-viewer", "chromium"), ("page", "chromium")):
            pictures = [f"{name}.jpg"] if name != "colors" else ["colors-street.jpg", "colors-class.jpg", "colors-trees.jpg"]
            if not shutil.which(needs) or (needs == "chromium" and not pathlib.Path("/usr/share/javascript/leaflet/leaflet.js").exists()):
                continue
            done = bash(f'"{ROOT}/api/pictures/{name}.sh" out', folder, POINTS="4000", PATH=f"{binaries}:{os.environ['PATH']}")
            for picture in pictures:
                kept, made = ROOT / "api/pictures" / picture, pathlib.Path(folder, "out", picture)
                assert 20000 < kept.stat().st_size <= 150 * 1024, (picture, kept.stat().st_size)
                assert done.returncode == 0 and made.read_bytes().startswith(b"\xff\xd8\xff"), (name, done.stderr[-800:])
                assert size_of(made) == size_of(kept), (picture, size_of(made))


def size_of(jpeg):
    data = jpeg.read_bytes()
    frame = re.search(rb"\xff[\xc0\xc2]..\x08(..)(..)", data, re.S)
    return tuple(int.from_bytes(frame[i], "big") for i in (2, 1))


run(globals())
