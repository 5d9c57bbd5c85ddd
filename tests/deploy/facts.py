"""What the checks of deploy/ share: files with planted mistakes, and the facts that those files must agree with, read
from where the daemon has them.

A check is a function of a Tree that returns what is wrong. run() asks that the tree as it is has nothing wrong, and
that each planted mistake is found: a check that cannot fail is no check."""
import os
import pathlib
import re
import sys

ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"])


class Tree:
    """The checkout, with some text of one file replaced."""

    def __init__(self, path=None, old="", new=""):
        self.planted, self.old, self.new = path, old, new

    def read(self, path):
        text = (ROOT / path).read_text(encoding="utf-8")
        if path == self.planted:
            assert self.old in text, f"nothing to plant in {path}: {self.old}"
            text = text.replace(self.old, self.new)
        return text

    def parameters(self):
        """Name -> default of src/service/params.def."""
        return dict(re.findall(r'^PARAMETER\(\w+, "([a-z-]+)", \w+, "([^"]*)"', self.read(find("params.def")), re.M))

    def config(self, path):
        return parse_config(self.read(path))


def find(name):
    """A source file's path, wherever in src/ it lies."""
    [path] = (ROOT / "src").rglob(name)
    return str(path.relative_to(ROOT))


def parse_config(text):
    """Name -> value of a splatd.conf, lines that are commented out left aside."""
    return dict(re.findall(r"^([a-z-]+) *= *(.*?)\s*$", text, re.M))


def packages(text):
    """Section -> package names of deploy/packages.txt."""
    sections = {}
    for section, package in re.findall(r"^([a-z]+)\s+(\S+)", text, re.M):
        sections.setdefault(section, set()).add(package)
    return sections


def seconds(text):
    """'15min', '60', '30s' -> seconds."""
    value, unit = re.fullmatch(r"(\d+)(ms|s|min|m|h|)", text).groups()
    return int(value) * {"ms": 0.001, "": 1, "s": 1, "min": 60, "m": 60, "h": 3600}[unit]


def size(text):
    """'4G', '4Gi', '256M' -> bytes, of 1024."""
    value, unit = re.fullmatch(r"(\d+)([KMGT]?)i?", text).groups()
    return int(value) << 10 * " KMGT".index(unit or " ")


def run(check, planted, tree=Tree):
    wrong = check(tree())
    for mistake in planted:
        changed = tree(*mistake)
        try:
            found = check(changed)
        except (KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
            found = [repr(error)]
        if not found:
            wrong.append(f"not noticed: {mistake[1]!r} -> {mistake[2]!r} in {mistake[0]}")
    print("\n".join(wrong) or f"nothing wrong; {len(planted)} planted mistakes were found")
    sys.exit(1 if wrong else 0)
