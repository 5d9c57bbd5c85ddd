"""The documents of the tree: no table is cut or ragged, what is linked exists, JSON in them is JSON, tests that a table
says fail (column "what fails without it") exist: `meson test` leaves out a name that it does not know.

usage: documents.py ROOT        prints each violation as FILE:LINE: what, exit 1 if there are any
       documents.py --self-test plants every kind of violation and checks that it is found
"""
import json
import pathlib
import re
import sys
import tempfile

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
RULE = re.compile(r"\|(\s*:?-+:?\s*\|)+\s*$")


def prose(lines):
    """(number, line) of what is neither in a fence nor indented as code."""
    fenced = False
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced and not line.startswith("    "):
            yield number, line


def columns(row):
    return len(re.findall(r"(?<!\\)\|", re.sub(r"`[^`]*`", lambda code: code.group().replace("\\|", ""), row))) - 1


def tables(lines):
    """Rows of one table stand together, the second one a rule, all as wide as it."""
    before, row, width = 0, 0, None
    rows = [(number, line.strip()) for number, line in prose(lines) if line.lstrip().startswith("|")]
    for at, (number, line) in enumerate(rows):
        row = row + 1 if number == before + 1 else 1
        before = number
        if row == 1:
            width = columns(line)
            if at + 1 == len(rows) or rows[at + 1][0] != number + 1 or not RULE.match(rows[at + 1][1]):
                yield number, "a table's row without its head; is the table cut by an empty line?"
        elif columns(line) != width:
            yield number, f"{columns(line)} columns in a table of {width}"


def anchors(path):
    """As GitHub makes them of headings."""
    heads = [line for _, line in prose(path.read_text(encoding="utf-8").splitlines()) if re.match(r"#+ ", line)]
    return {re.sub(r"[^\w\- ]", "", head.lstrip("# ").strip().lower()).replace(" ", "-") for head in heads}


def links(path, lines):
    for number, line in enumerate(lines, 1):
        for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, anchor = target.partition("#")
            file = path.parent / name if name else path
            if not file.exists():
                yield number, f"the link to {target} leads nowhere"
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                yield number, f"{name or 'this file'} has no heading #{anchor}"


def fences(text):
    for found in re.finditer(r"^```json\n(.*?)^```", text, re.M | re.S):
        try:
            json.loads(found.group(1))
        except ValueError as error:
            yield text[: found.start()].count("\n") + 1 + getattr(error, "lineno", 0), f"no JSON: {error}"


def tests_of(root):
    """Words that tests' meson files spell out, of which names are made, and the functions of C tests."""
    files = [path for path in (root / "tests").rglob("*") if path.name == "meson.build" or path.suffix == ".c"]
    text = {path: path.read_text(encoding="utf-8", errors="replace") for path in files}
    words = {word.strip("-") for path in files if path.name == "meson.build"
             for word in re.findall(r"'([\w./-]+)'", text[path])}
    functions = {name for path in files for name in re.findall(r"^static void (\w+)\(", text[path], re.M)}
    return words | {"vulkan", "egl"}, functions


def is_test(name, words):
    """Spelled out, or PREFIX-REST of words that are."""
    parts = name.split("-")
    return name in words or any("-".join(parts[:i]) in words and "-".join(parts[i:]) in words
                                for i in range(1, len(parts)))


def named_tests(lines, words, functions):
    inside = False
    for number, line in prose(lines):
        if not line.startswith("|"):
            inside = False
        elif line.rstrip().endswith("| what fails without it |"):
            inside = True
        elif inside:
            for name in re.findall(r"`([\w-]+)`", line.rstrip().rstrip("|").rpartition("|")[2]):
                if not is_test(name, words) and name not in functions:
                    yield number, f"no test '{name}'"


def documents(root):
    """Builds, in which folders come and go meanwhile, are not even looked into."""
    for path in root.iterdir():
        if not re.match(r"build|\.", path.name):
            yield from path.rglob("*.md") if path.is_dir() else [path] if path.suffix == ".md" else []


def violations(root):
    known = tests_of(root)
    for path in sorted(documents(root)):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines()
        for number, what in [*tables(lines), *links(path, lines), *fences(text), *named_tests(lines, *known)]:
            yield f"{path.relative_to(root)}:{number}: {what}"


def self_test():
    good = "# A head, `x`\n\n| a | b |\n|---|---|\n| 1 `x \\| y` | 2 |\n\n[here](#a-head-x) [there](b.md#b)\n\n    | code |\n"
    planted = {
        "cut by an empty line": "| a |\n|---|\n| 1 |\n\n| 2 |\n",
        "without its head": "| a |\n| 1 |\n",
        "3 columns in a table of 2": "| a | b |\n|---|---|\n| 1 | 2 | 3 |\n",
        "1 columns in a table of 2": "| a | b |\n|---|\n| 1 | 2 |\n",
        "leads nowhere": "[x](c.md)\n",
        "has no heading": "[x](b.md#c)\n",
        "this file has no heading": "[x](#c)\n",
        "no test 'units'": "| a | what fails without it |\n|---|---|\n| `x` | `unit-b`, `units` (`holds`) |\n",
        "no JSON": "```json\n{1}\n```\n",
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "b.md").write_text("# B\n")
        (root / "tests").mkdir()
        (root / "tests/meson.build").write_text("test('unit-' + name, {'b': files('b.c')})\n")
        (root / "tests/b.c").write_text("static void holds(void **state)\n")
        (root / "a.md").write_text(good)
        found = list(violations(root))
        assert not found, found
        for what, text in planted.items():
            (root / "a.md").write_text(good + "\n" + text)
            found = list(violations(root))
            assert len(found) == 1 and what in found[0], (what, found)
    print(f"{len(planted)} kinds of violation are found")


if sys.argv[1] == "--self-test":
    self_test()
    sys.exit()
wrong = list(violations(pathlib.Path(sys.argv[1]).resolve()))
print("\n".join(wrong) or "tables, links and JSON of the documents are whole")
sys.exit(1 if wrong else 0)
