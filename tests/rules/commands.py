"""What every subcommand owes its users: --help teaches by example on stdout, a wrong option is refused with exit code 2 and
a message on stderr, README.md names the command.

usage: commands.py SPLATD README.md"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

SPLATD, README = sys.argv[1], open(sys.argv[2], encoding="utf-8").read()
wrong = []


def check(arguments, code, where):
    """Runs splatd; wants `code`, something on `where` and nothing on the other stream. Returns what was said."""
    done = subprocess.run([SPLATD, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=600)
    said, silent = (done.stdout, done.stderr) if where == "stdout" else (done.stderr, done.stdout)
    if done.returncode != code or not said or silent:
        wrong.append(f"splatd {' '.join(arguments)}: exit {done.returncode}, stdout {done.stdout!r}, stderr {done.stderr!r}")
    return said


overview = check(["--help"], 0, "stdout")
commands = re.findall(r"^  ([a-z]+) {2,}\S", overview, re.MULTILINE)
if sorted(commands) != sorted("serve pack collect render tour info synth bench compare devices sign plan".split()):
    wrong.append(f"splatd --help lists {commands}")
for command in commands:
    text = check([command, "--help"], 0, "stdout")
    if re.search(r" $", text, re.MULTILINE):
        wrong.append(f"splatd {command} --help has lines that end in blanks")
    if "--method fill" in text and "not measured" not in re.sub(r"\s+", " ", text.split("--method fill")[1].split("--")[0]):
        wrong.append(f"splatd {command} --help does not say that what method fill closes is not measured")
    if len(re.findall(rf"^\s+(?:\S+ )*splatd {command}\b", text, re.MULTILINE)) < 2:
        wrong.append(f"splatd {command} --help shows fewer than two examples")
    check([command, "--no-such-option"], 2, "stderr")
    if f"`splatd {command}" not in README:
        wrong.append(f"README.md does not show splatd {command}")
# What is missing is named, beside an example that has it.
for words, wanted in {
    "serve": r"NAME\.spld.*: splatd serve \S+\.spld", "pack": r"one scan: splatd pack \S+ -o \S+\.spld",
    "pack a.ply": r"-o NAME\.spld", "collect": r"one dataset: splatd collect \S+ -o \S+\.spld", "collect a.spld": r"-o NAME\.spld",
    "collect a.spld -o b.ply": r"-o NAME\.spld, not 'b\.ply'", "collect a.spld -o -": r"-o NAME\.spld, not '-'",
    "render": r"one dataset: splatd render \S+ -o \S+", "render a.spld": "-o OUT",
    "render a.spld b.spld -o c.png": "takes one dataset", "tour": r"one dataset: splatd tour \S+ --path \S+ -o \S+",
    "tour a.spld -o b.mp4": "--path FILE", "tour a.spld --path b.json": r"-o OUT\.mp4",
    "info": r"one dataset: splatd info \S+\.spld", "synth": r"one SCENE: splatd synth \S+ -o \S+", "synth courtyard": "-o DIR",
    "bench": r"one dataset: splatd bench \S+\.spld", "bench --left-out a.spld": "--cameras is missing",
    "bench --textures a.tex": "-o OUT is missing", "compare": r"IMAGE and a TRUTH: splatd compare \S+ \S+",
    "compare a.png": "TRUTH, which is missing", "sign": "URL.*--key FILE.*--help", "render a.spld -o b.png --size 3x": "1280x720",
    "render a.spld -o b.png --background rad": "white",
    "tour a.spld --path b.json -o c.avi": r"NAME\.mp4 or a folder.*without \.avi",
    "tour a.spld --path b.json -o -": "NAME\\.mp4",
    "pack a.xyz -o b.ply": r"-o NAME\.spld, not 'b\.ply'",
    "pack a.xyz -o b": r"-o NAME\.spld", "pack a.xyz -o -": r"-o NAME\.spld",
    "info a.spld --dictionary b.spld": r"--dictionary NAME\.png",
    "compare a.png b.png --error-map c.npy": r"--error-map NAME\.png",
    "synth courtyard -o b.ply": r"a folder: give 'b\.ply' without \.ply", "bench a.spld -o b.html": "a folder",
    "bench --textures a.tex -o b.png": "a folder", "bench --left-out a.spld --cameras b -o c.csv": "a folder",
    "render a.spld --format png -o b.spld": r"ends in \.png", "render a.spld --format png -o b.jpg": r"ends in \.png",
    "render a.spld -o b.JPG": r"a\.spld", "render a.spld -o b.Jpeg": r"a\.spld", "render a.spld -o b.PNG": r"a\.spld",
    "render a.spld --layer depth -o b.NPY": r"a\.spld", "render a.spld --format png -o b.JPEG": r"ends in \.png",
    "render a.spld -o b.TXT": "does not say which format",
    "render a.spld --memory-limit 1X -o b.png": "K, M, G or T",
    "pack a.xyz --memory 17179869184G -o b.spld": "K, M, G or T",
    "render a.spld -o": "requires an argument, FILE.*splatd render --help",
    "tour a.spld --pth b -o c": "did you mean --path", "render a.spld --superample 2 -o b.png": "did you mean --supersample",
    "render a.spld --layer colour -o b.png": "--layer takes color, depth.* or primitive, not 'colour'",
    "tour a.spld --path b --format gif -o c": "--format takes jpeg, png.*, not 'gif'",
    "render a.spld --visibility x -o b.png": "--visibility takes adaptive, constant or none, not 'x'",
    "tour a.spld --path b --ease up -o c": "--ease takes none, in, out or in-out, not 'up'",
    "render a.spld --eye 1,2 -o b.png": "--eye takes three numbers X,Y,Z, not '1,2'",
    "tour a.spld --require-gpu=no --path b -o c": "--require-gpu takes no argument",
    "render a.spld --soft-opacity 0.2 -o b.png": "--soft-opacity is of what is soft.*--soft 'class:3-5'",
    "render a.spld --of first -o b.png": "--of is of what is soft", "tour a.spld --path b --soft-cover 0 -o c": "--soft-cover is of",
    "render a.spld --ramp turbo -o b.png": "--ramp is of values.*--color-by height",
    "tour a.spld --path b --color-by flat:red --range 0..1 -o c": "--range is of values",
    "bench a.spld --soft-opacity 0.2": "--soft 'class:3-5'", "render a.spld --soft class=5 -o b.png": "write 'class:5'",
    "plan": r"--points N is missing: splatd plan --points \S+", "plan --points 1e16": "--points takes.*'1e16'",
    "plan --points nan": "--points takes.*'nan'", "plan --points 1.5": "--points takes a whole number.*'1.5'",
    "plan --points -1": "--points takes.*'-1'", "plan --points 1e12 --gpu a100": "--gpu takes h100 or cpu, not 'a100'",
    "plan --points 1e12 --views-per-second inf": "--views-per-second takes.*'inf'",
    "plan --points 1e12 --cached 1.1": "--cached takes.*'1.1'", "plan --points 1e12 --headroom 0.9": "--headroom takes.*'0.9'",
    "plan --points 1e12 --copies 0": "--copies takes.*'0'", "plan --points 1e12 --size 0x9": "--size takes.*'0x9'",
    "plan --points 1e12 --size 32769x9": "--size takes.*32769x9", "plan 1e12": "no argument '1e12'",
    "serve nosuch": r"nosuch: there is no such file or directory of datasets.*splatd pack",
    "sign /v1/datasets/a/view --key nosuch": "nosuch.*openssl rand -hex 32",
}.items():
    said = check(words.split(), 2, "stderr")
    if not re.search(wanted, said):
        wrong.append(f"splatd {words}: {said!r} does not say {wanted!r}")
with tempfile.TemporaryDirectory() as folder:
    scan = pathlib.Path(folder, "scan.xyz")
    scan.write_text("".join(f"{x} {y} 0\n" for x in range(20) for y in range(20)))
    before, same = scan.read_bytes(), pathlib.Path(folder, "same.xyz")
    same.symlink_to(scan)
    if "-o NAME.spld" not in check(["pack", str(same), "-o", str(scan)], 2, "stderr") or scan.read_bytes() != before:
        wrong.append("splatd pack writes over its scan")
    # What takes bytes takes suffixes; a bare number counts what it always did. The next thing wrong is what is said.
    for words in ("render a.spld --memory-limit 100M -o b.png", "tour a.spld --memory-limit 2G --path b -o c",
                  "bench a.spld --memory-limit 2G", "bench a.spld --memory-limit 100"):
        if "a.spld" not in (said := check(words.split(), 2, "stderr")):
            wrong.append(f"splatd {words}: {said!r}")
    for words in ("--memory 4G", "--memory 4096"):
        if "a.xyz" not in (said := check(["pack", "a.xyz", "-o", "b.spld", *words.split()], 2, "stderr")):
            wrong.append(f"splatd pack {words}: {said!r}")
    # A folder's name may hold dots where it exists, where a slash says so, or where a number follows.
    for name in (folder + "/..", folder + "/run.v2/", folder + "/lod-1.5"):
        if "folder" in (said := check(["tour", "a.spld", "--path", "b", "-o", name], 2, "stderr")):
            wrong.append(f"splatd tour -o {name}: {said!r}")
    # Each stage counts in a unit or not at all, and photographs and their share of the points are told apart.
    packed = folder + "/packed.spld"
    said = subprocess.run([SPLATD, "pack", scan, "-o", packed], stderr=subprocess.PIPE, text=True, timeout=600).stderr
    if "looking at colours: 1 scan in" not in said or re.search(r"^[a-z ,]*: \d+ in ", said, re.MULTILINE):
        wrong.append(f"pack's stages: {said!r}")
    text, told = (check(["info", *json_too, packed], 0, "stdout") for json_too in ([], ["--json"]))
    if "derived" not in text:
        wrong.append("info does not say that uncertainty is derived")
    told = json.loads(told)
    if told["classes"] is not None or "  classes " in text or not any(term.startswith("plane:") for term in told["soft"]) or \
            [line.split("'")[1] for line in text.splitlines() if "--soft '" in line] != told["soft"]:
        wrong.append(f"info's terms of what is soft: {told['classes']}, {told['soft']}, {text!r}")
# What deploy/operating.md shows of a plan is what the command says; every heading that a figure names is there, and JSON has the
# same lines.
root = pathlib.Path(sys.argv[2]).parent
shown = (root / "deploy/operating.md").read_text(encoding="utf-8").split("## Larger than one machine")[1].split("\n## ")[0]
shown = max(re.findall(r"(?:^(?: {4}.*)?\n)+", shown, re.M), key=len)
shown = re.sub(r"^ {4}", "", shown, flags=re.M).strip()
words = "plan --points 1e12 --views-per-second 1000 --gpu h100".split()
said = check(words, 0, "stdout")
if len(shown.splitlines()) < 40 or not said.startswith(shown):
    wrong.append(f"deploy/operating.md does not show what splatd {' '.join(words)} says: {said}")
told = json.loads(check([*words, "--json"], 0, "stdout"))
for figure in told["figures"]:
    file, headings = figure["measured"].split(", ", 1)
    found = re.findall(r"^#+ (.*)$", (root / file).read_text(encoding="utf-8"), re.M)
    if headings not in found and not all(heading in found for heading in headings.split("; ")):
        wrong.append(f"splatd plan: {file} has no heading {headings!r}")
if any(line["what"] not in said or not line["value"] >= 0 for line in told["lines"]) or len(told["lines"]) < 25:
    wrong.append(f"splatd plan --json: {told['lines']}")
with open("/dev/full", "w") as full, tempfile.TemporaryDirectory() as folder:
    scan = subprocess.run([SPLATD, "synth", "courtyard", "--points", "20000", "-o", folder], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, timeout=600).stdout.split()[0]
    subprocess.run([SPLATD, "pack", scan, "-o", folder + "/a.spld"], stderr=subprocess.DEVNULL, timeout=600)
    for arguments in (["--help"], ["--version"], *([command, "--help"] for command in commands), ["serve", "--manual"], ["info", folder + "/a.spld"],
                      ["info", folder + "/a.spld", "--json"], ["info", scan], ["synth", "--list"], ["synth", "courtyard", "--print-views"],
                      ["synth", "courtyard", "--points", "20000", "-o", folder + "/b"], ["plan", "--points", "1e9"], ["plan", "--points", "1e9", "--json"],
                      ["devices"], ["devices", "--json"]):
        done = subprocess.run([SPLATD, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, timeout=600)
        if done.returncode != 1 or "written" not in done.stderr and "write to stdout" not in done.stderr:
            wrong.append(f"splatd {' '.join(arguments)} >/dev/full: exit {done.returncode}, stderr {done.stderr!r}")
check(["no-such-command"], 2, "stderr")
check([], 2, "stderr")
check(["--version"], 0, "stdout")
print("\n".join(wrong) or f"{len(commands)} commands")
sys.exit(1 if wrong else 0)
