"""The rules of the source tree that a compiler does not hold: which room includes which, who may see an outside API, how
long a file and a line may be, nothing left open. CONTRIBUTING.md has the reasons.

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
           (re.compile(r"^(libav\w+|libswscale)/"), "image"), (re.compile(r"^cblas\.h$"), "sparse"), (re.compile(r"^curl/"), "dataset")]
# A public header includes public headers and these.
PLAIN_C = {"stdbool.h", "stddef.h", "stdint.h", "stdio.h", "math.h"}
LONGEST = 800
COLUMNS = 120  # but of tables (.def), whose rows are one line each
# A method's name stands in its own file, in the table, beside its kernels, in documents and in tests; everyone else asks the
# table, the page and scripts that are shipped among them.
METHODS = pathlib.PurePath("include/splatd/method.h")
METHOD_FILES = pathlib.PurePath("src/render/methods")
METHOD_PLACES = (METHODS, pathlib.PurePath("shaders/meson.build"))
METHOD_TOPS = ("src", "include", "shaders", "api", "deploy", ".ci")
DOCUMENTS = (".md", ".ipynb", ".svg", ".css")
INTERFACE = pathlib.PurePath("api/openapi.yaml")
# Words that mean something else where nothing speaks of methods: a scan's points, one splat.
HOMONYMS = {"points", "splat"}
CODE = (".c", ".h", ".def")
COMMENTS = {**dict.fromkeys((".c", ".h", ".def", ".glsl", ".comp", ".js"), r"/\*.*?\*/|(?<!:)//[^\n]*"), ".html": r"<!--.*?-->",
            **dict.fromkeys((".py", ".sh", ".yaml", ".yml", ".conf", ".build", ".txt", ""), r"(?m)(?:^|(?<=\s))#.*$")}
EXAMPLE = re.compile(r'"\s*splatd \w+ ')  # a line of --help that shows a command; tests/e2e runs those
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


def without_comments(text, suffix):
    """The same lines, without what is said about them."""
    return re.sub(COMMENTS.get(suffix, r"(?!)"), lambda found: "\n" * found[0].count("\n"), text, flags=re.S)


def method_patterns(names):
    """What names a method: (the suffixes of files that it counts in, None for all; a pattern with the group "name")."""
    every, rare = "|".join(names) or "(?!)", "|".join(name for name in names if name not in HOMONYMS) or "(?!)"
    no_file_or_call = r"\b(?!\.\w|\()"
    any_name, own = rf"(?P<name>{every}){no_file_or_call}", rf"(?P<name>{rare}){no_file_or_call}"
    upper = rf"(?P<name>{every.upper()})\b"
    web, quote, inside = (".js", ".html"), "[\"'`]", "[^\"'`]*"
    return [(suffixes, re.compile(pattern)) for suffixes, pattern in (
        (None, rf"\bSPL_METHOD_{upper}"),
        (None, rf"\bspl_method_{any_name}"),
        # method=NAME, method: "NAME", method === 'NAME', ["method", "NAME"], method NAME
        (None, rf"(?<![a-zA-Z])(?i:methods?)\b[\"'\])]*\s*(?:[!=]?==?|:|,|\?\?|\+=|\bis\b)?\s*[\[({{]*{quote}?{any_name}"),
        # a string that is the name, or has it where methods are spoken of
        (None, rf"{quote}{own}{quote}"),
        (None, rf"(?i:methods?)\b.*{quote}(?:{inside}\W)?{any_name}{inside}{quote}"),
        (None, rf"{quote}(?:{inside}\W)?{any_name}{inside}{quote}.*(?i:\bmethods?)\b"),
        # NAME, NAME
        (None, rf"\b{any_name}{quote}?,\s*{quote}?(?:{rare})\b{quote}?(?:,|$|[\])}}\s;])"),
        (None, rf"\b{own}{quote}?,\s*{quote}?(?:{every})\b{quote}?(?:,|$|[\])}}\s;])"),
        (web, rf">\s*{any_name}\s*<"),
        (web, rf"\b(?:const|let|var)\s+{upper}"),
        (web, rf"[{{,]\s*{own}\s*:"),
        (web, rf"\.{own}"),
        (CODE, rf"^\s*#\s*define\s+{upper}"),
        (CODE, rf"(?:->|\.)(?P<name>{rare})\.\w"),  # a parameter of its own
    )]


def check_methods(relative, line, patterns):
    """What is wrong with `line`, without its comments: it names a method where nobody but the table may; or None."""
    if EXAMPLE.search(line):
        return None
    for suffixes, pattern in patterns:
        drawing = suffixes == CODE and relative.parts[:2] == ("src", "render")  # what methods share lies beside them
        found = pattern.search(line) if not suffixes or relative.suffix in suffixes and not drawing else None
        if found:
            return f"names method {found['name'].lower()}; ask its row (include/splatd/method.h; over HTTP /v1/methods)"
    return None


def names_methods(relative, names):
    """May the file name methods, or is it none that is shipped?"""
    own = relative.parts[0] == "shaders" and any(relative.name.startswith(name) for name in names)
    return relative.parts[0] not in METHOD_TOPS or relative in METHOD_PLACES or relative.parent == METHOD_FILES or own or \
        relative == INTERFACE or relative.suffix in DOCUMENTS


def violations(root):
    table = root / METHODS
    rows = re.findall(r"^    METHOD\((\w+), (\w+)\)", table.read_text(encoding="utf-8"), re.M) if table.exists() else []
    names = [name for _, name in rows]
    patterns, any_method = method_patterns(names), re.compile("|".join(names) or "(?!)", re.I)
    for name in names:
        if not (root / METHOD_FILES / f"{name}.c").exists():
            yield f"{METHODS}:1: method {name} has no file {METHOD_FILES}/{name}.c"
    for path in sorted(p for top in (*METHOD_TOPS, "tests") for p in (root / top).rglob("*")):
        relative = path.relative_to(root)
        parts = relative.parts
        if not path.is_file() or parts[:2] == ("tests", "rules") or parts[:3] == ("tests", "fuzz", "corpus"):
            continue
        if "__pycache__" in parts:
            continue  # where files come and go while tests run
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # an image or a recorded scan
        lines = text.splitlines()
        said = [] if names_methods(relative, names) else without_comments(text, path.suffix).splitlines()
        named = {number for number, line in enumerate(said, 1) if any_method.search(line)}
        source = path.suffix in (".c", ".h", ".def", ".glsl", ".comp")
        code = source or path.suffix in (".sh", ".py", ".build")
        if source and len(lines) > LONGEST:
            yield f"{relative}:{LONGEST + 1}: longer than {LONGEST} lines; split it"
        for number, line in enumerate(lines, 1):
            if source and path.suffix != ".def" and len(line) > COLUMNS:
                yield f"{relative}:{number}: {len(line)} columns, more than {COLUMNS}"
            if code and OPEN_ENDS.search(line):
                yield f"{relative}:{number}: left open: {line.strip()}"
            found = INCLUDE.match(line) if source else None
            wrong = check_include(relative, parts, *found.groups()) if found else None
            wrong = wrong or (check_methods(relative, said[number - 1], patterns) if number in named else None)
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
    "tests/unit/wide.c": ("// " + "\u00e9" * (COLUMNS - 3) + "\n// " + "e" * (COLUMNS - 2) + "\n", f"{COLUMNS + 1} columns"),
    "src/service/wide.def": ("// " + "e" * COLUMNS + "\n", None),
    "tests/unit/later.c": ("/* TODO: test this */\n", "left open"),
    "include/splatd/method.h": ("#define SPL_METHODS(METHOD) \\\n    METHOD(DOTS, dots) \\\n    METHOD(FOG, fog)\n",
                                "method fog has no file"),
    "src/render/methods/dots.c": ("enum spl_method own = SPL_METHOD_DOTS;\n", None),
    "src/measure/dots.c": ("bool is = method == SPL_METHOD_DOTS || SPL_METHOD_COUNT;\n", "names method dots"),
    "src/measure/row.c": ("return &spl_method_dots;\n", "names method dots"),
    "src/measure/own.c": ("double d = view.dots.density;\n", "names method dots"),
    "src/cmd/list.c": ('{"method", "LIST", "such as fog,dots"},\n', "names method dots"),
    "src/cmd/default.c": ('{"method", .otherwise = "dots; all with -o"},\n', "names method dots"),
    "src/cmd/told.c": ('puts("no normals; method dots draws it");\n', "names method dots"),
    "src/service/compare.c": ('if (!strcmp(text, "dots"))\n', "names method dots"),
    "src/service/macro.h": ("#define DOTS 1\n", "names method dots"),
    "src/measure/start.html": ("<script>\nconst i = all.findIndex(p => p.method === 'dots' && p.lod === 1);\n", "names method dots"),
    "api/viewer/option.html": ("<select><option>dots</option></select>\n", "names method dots"),
    "api/viewer/chosen.js": ('const used = frame.chosen ?? {method: "dots", lod: 1};\n', "names method dots"),
    "api/viewer/constant.js": ('export const DOTS = ["density"];\n', "names method dots"),
    "api/viewer/bare.js": ("choices(names.includes(m) ? m : 'dots');\n", "names method dots"),
    "api/viewer/key.js": ("const colours = {fog: 1};\n", "names method fog"),
    "api/viewer/member.js": ("offer(table.dots);\n", "names method dots"),
    "api/clients/draw.py": ('hall.view(method="dots")\n', "names method dots"),
    "api/clients/draw.sh": ('curl "$url/view?lod=1&method=dots"\n', "names method dots"),
    "deploy/warm.sh": ("splatd render hall.spld --method dots\n", "names method dots"),
    "deploy/warm.yaml": ("bench:\n  draws: [fog, dots]\n", "names method fog"),
    "deploy/board.json": ('{"method": "dots"}\n', "names method dots"),
    "deploy/splatd.env": ("SPLATD_METHOD=dots\n", "names method dots"),
    "shaders/common/pick.glsl": ("if (method == SPL_METHOD_DOTS) discard;\n", "names method dots"),
    "shaders/meson.build": ("kernels += {'dots_depth': 'splats', 'dots': 'splats'}\n", None),
    "shaders/dots_depth.comp": ("// of method dots\n", None),
    "api/methods.md": ("Method dots draws dots.\n", None),
    "api/viewer/other.js": ("// method dots is like this\nrow.fog(); array.dots(0); open('dots.js');\n", None),
    "src/cmd/example.c": ('"  splatd render hall.spld --method dots -o view.png\\n"\n', None),
    "tests/unit/dots.c": ("assert(SPL_METHOD_DOTS);\n", None),
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
