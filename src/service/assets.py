"""The files of the page and the clients as C arrays with a table over them, for meson.

usage: assets.py OUT.h FILE…
FILE is api/viewer/NAME or api/clients/NAME; the table calls it viewer/NAME or clients/NAME."""
import hashlib
import pathlib
import sys

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".py": "text/x-python; charset=utf-8",
    ".sh": "text/x-shellscript; charset=utf-8",
    ".json": "application/json",
    ".ipynb": "application/x-ipynb+json",
    ".md": "text/markdown; charset=utf-8",
}

out, *names = sys.argv[1:]
arrays, table = [], []
for i, file in enumerate(map(pathlib.Path, sorted(names))):
    content = file.read_bytes()
    rows = ",\n".join(",".join(map(str, content[at : at + 24])) for at in range(0, len(content), 24))
    arrays.append(f"static const unsigned char asset_{i}[] = {{\n{rows}}};\n")
    tag = hashlib.sha256(content).hexdigest()[:16]
    table.append(
        f'    {{"{file.parent.name}/{file.name}", "{TYPES[file.suffix]}", "\\"{tag}\\"", asset_{i}, '
        f"sizeof asset_{i}}},\n"
    )
pathlib.Path(out).write_text("".join(arrays) + "static const struct asset assets[] = {\n" + "".join(table) + "};\n")
