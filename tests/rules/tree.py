"""The rules of the source tree that a compiler does not hold: which room includes which, who may see an outside API, how
long a file may be, nothing left open. CONTRIBUTING.md has the reasons.

usage: tree.py ROOT       prints each violation as FILE:LINE: what, exit 1 if there are any
       tree.py --self-test plants every kind of violation and checks that it is found
"""
import pathlib
import re
import sys
import tempfile

# A room includes itself, rooms of lower floors, and public headers.
FLOOR = {"base": 0, "geom": 1, "cloud": 2, "sparse": 2, "dataset": 3, "gpu": 3, "image": 3, "render": 4,
         "measure": 5, "pack": 5, "synth": 5, "service": 6, "cmd": 7, "main.c": 8}
# The only room that sees these outside headers.
OUTSIDE = [(re.compile(r"^(vulkan|GL|GLES\d?|EGL|KHR)/"), "gpu"), (re.compile(r"^(microhttpd|uv)\.h$"), "service"),
           (re.compile(r"^(libav\w+|libswscale)/"), "image"), (re.compile(r"^cblas\.h$"), "sparse")]
# A public header includes public headers and these.
PLAIN_C = {"stdbool.h", "stddef.h", "stdint.h", "stdio.h", "math.h"}
LONGEST = 800
# A method's name stands in its own file, in the table and in tests; everyone else asks the table.
METHODS = pathlib.PurePath("include/splatd/method.h")
METHOD_FILES = pathlib.PurePath("src/render/methods")
OPEN_ENDS = re.compile(r"\b(TODO|FIXME|XXX)\b")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def check_include(path, parts, bracket, header):
    """What is wrong with `header` in the file `path` (relative, split into `parts`), or None."""
    if parts[0] == "include":
        if not header.startswith("splatd/") and header not in PLAIN_C:
            return f"a public header includes {header}; only <splatd/…> and {', '.join(sorted(PLAIN_C))}"
        return None
    if parts[0] != "src":
        return None
    room = parts[1]
    if room not in FLOOR:
        return f"unknown room {room}; give it a floor in tests/rules/tree.py"
    for pattern, owner in OUTSIDE:
        if pattern.search(header) and room != owner:
            return f"{header} outside src/{owner}"
    target = header.split("/")[0]
    if bracket == '"' and "/" in header and target in FLOOR:
        if target != room and FLOOR[target] >= FLOOR[room]:
            return f"{room} includes {header}, which is no lower floor"
    return None


def check_methods(relative, line, names):
    """The method that `line` names where nobody but its own file and the table may, or None."""
    if relative == METHODS or relative.parent == METHOD_FILES or relative.parts[0] not in ("src", "include", "shaders"):
        return None
    found = re.search(r"\bSPL_METHOD_(%s)\b" % "|".join(names), line) if names else None
    return f"names method {found[1].lower()}; ask its row (include/splatd/method.h)" if found else None


def violations(root):
    table = root / METHODS
    rows = re.findall(r"^    METHOD\((\w+), (\w+)\)", table.read_text(encoding="utf-8"), re.M) if table.exists() else []
    for _, name in rows:
        if not (root / METHOD_FILES / f"{name}.c").exists():
            yield f"{METHODS}:1: method {name} has no file {METHOD_FILES}/{name}.c"
    for path in sorted(p for top in ("include", "src", "shaders", "tests", "deploy") for p in (root / top).rglob("*")):
        relative = path.relative_to(root)
        parts = relative.parts
        if not path.is_file() or parts[:2] == ("tests", "rules") or parts[:3] == ("tests", "fuzz", "corpus"):
            continue
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:
            continue  # an image or a recorded scan
        source = path.suffix in (".c", ".h", ".def", ".glsl", ".comp")
        code = source or path.suffix in (".sh", ".py", ".build")
        if source and len(lines) > LONGEST:
            yield f"{relative}:{LONGEST + 1}: longer than {LONGEST} lines; split it"
        for number, line in enumerate(lines, 1):
            if code and OPEN_ENDS.search(line):
                yield f"{relative}:{number}: left open: {line.strip()}"
            found = INCLUDE.match(line) if source else None
            wrong = check_include(relative, parts, *found.groups()) if found else None
            wrong = wrong or (check_methods(relative, line, [name for name, _ in rows]) if source else None)
            if wrong:
                yield f"{relative}:{number}: {wrong}"


PLANTED = {  # file: (content, the start of what must be said; None = nothing)
    "src/base/up.c": ('#include "geom/morton.h"\n', "base includes geom/morton.h"),
    "src/gpu/side.c": ('#include "dataset/format.h"\n', "gpu includes dataset/format.h"),
    "src/render/api.c": ("#include <vulkan/vulkan.h>\n", "vulkan/vulkan.h outside src/gpu"),
    "src/render/gl.c": ("# include <GL/glcorearb.h>\n", "GL/glcorearb.h outside src/gpu"),
    "src/cmd/video.c": ("#include <libavcodec/avcodec.h>\n", "libavcodec/avcodec.h outside src/image"),
    "src/pack/blas.c": ("#include <cblas.h>\n", "cblas.h outside src/sparse"),
    "src/cmd/loop.c": ("#include <uv.h>\n", "uv.h outside src/service"),
    "src/measure/side.c": ('#include "pack/pack.h"\n', "measure includes pack/pack.h"),
    "src/attic/new.c": ('#include "base/error.h"\n', "unknown room attic"),
    "include/splatd/deep.h": ('#include "base/error.h"\n', "a public header includes base/error.h"),
    "shaders/long.comp": ("// line\n" * (LONGEST + 1), "longer than"),
    "tests/unit/later.c": ("/* TODO: test this */\n", "left open"),
    "include/splatd/method.h": ("#define SPL_METHODS(METHOD) \\\n    METHOD(DOTS, dots) \\\n    METHOD(FOG, fog)\n",
                                "method fog has no file"),
    "src/render/methods/dots.c": ("enum spl_method own = SPL_METHOD_DOTS;\n", None),
    "src/measure/dots.c": ("bool is = method == SPL_METHOD_DOTS || SPL_METHOD_COUNT;\n", "names method dots"),
    "src/service/good.c": ('#include <uv.h>\n#include <splatd/render.h>\n#include "render/frame.h"\n', None),
    "src/gpu/vulkan/good.c": ('#include <vulkan/vulkan.h>\n#include "gpu/gpu.h"\n#include "shared.h"\n', None),
    "src/cloud/good.c": ('#include "geom/morton.h"\n#include "base/error.h"\n', None),
}


def self_test():
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, (content, _) in PLANTED.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(content, encoding="utf-8")
        found = list(violations(root))
    for name, (_, said) in PLANTED.items():
        mine = [v.split(": ", 1)[1] for v in found if v.startswith(name + ":")]
        if (said is None and mine) or (said is not None and (len(mine) != 1 or not mine[0].startswith(said))):
            missed.append(f"{name}: wanted {said!r}, found {mine}")
    return missed


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    problems = self_test() if sys.argv[1] == "--self-test" else list(violations(pathlib.Path(sys.argv[1])))
    print("\n".join(problems) or "nothing found")
    sys.exit(1 if problems else 0)
