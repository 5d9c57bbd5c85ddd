"""deploy/operating.md against the tree: each test it names exists, each parameter it names is in the table, none of the
thirty complaints is left out.

usage: operating.py ROOT"""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
text = (root / "deploy/operating.md").read_text(encoding="utf-8")
wrong = []
for path, name in re.findall(r"`(tests/[\w/.]+?\.\w+)(?::(\w+))?`", text):
    file = root / path
    if not file.is_file():
        wrong.append(f"{path} does not exist")
    elif name and not re.search(rf"\b{name}\(", file.read_text(encoding="utf-8")):
        wrong.append(f"{path} has no {name}")
table = set(re.findall(r'^PARAMETER\(\w+, "([a-z-]+)"', (root / "src/service/ops/params.def").read_text(encoding="utf-8"), re.M))
limits = text[text.index("## Limits"):text.index("## What goes wrong")]
for name in re.findall(r"`([a-z][a-z-]+)`", limits):
    if name not in table:
        wrong.append(f"{name} is no parameter")
numbers = [int(n) for n in re.findall(r"^\| (\d+) \| .* \| .* \| `tests/", text, re.M)]
if numbers != list(range(1, 31)):
    wrong.append(f"complaints with a test: {numbers}")
print("\n".join(wrong) or f"{len(re.findall('`tests/', text))} tests named")
sys.exit(1 if wrong else 0)
