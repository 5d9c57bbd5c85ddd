"""The files of the page and the clients as C arrays with a table over them, for meson.

usage: assets.py OUT.h FILE…
FILE is api/viewer/NAME or api/clients/NAME; the table calls it viewer/NAME or clients/NAME. list/clients.html and
list/clients.json say which clients there are, each with the first line of its own comment."""
import hashlib
import html
import json
import pathlib
import re
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


def lists(files):
    """(name, content) of the list of clients, for people and for programs."""
    clients = []
    for file in files:
        text = file.read_text(encoding="utf-8")
        about = re.match(r'(?:#!.*\n)?(?:"""|# |// )(.+)', text).group(1)
        clients.append({"name": file.name, "uri": f"/clients/{file.name}", "bytes": file.stat().st_size, "about": about})
    rows = "".join(
        f"<dt><a href=\"{c['uri']}\">{c['name']}</a></dt>\n<dd>{html.escape(c['about'])}</dd>\n" for c in clients
    )
    yield "list/clients.html", (
        '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Clients of splatd</title>\n<h1>Clients of splatd</h1>\n<dl>\n{rows}</dl>\n"
    )
    yield "list/clients.json", json.dumps({"clients": clients}, indent=1) + "\n"


out, *names = sys.argv[1:]
files = [pathlib.Path(name) for name in sorted(names)]
contents = [(f"{file.parent.name}/{file.name}", file.read_bytes()) for file in files]
contents += [(name, text.encode()) for name, text in lists(f for f in files if f.parent.name == "clients")]
arrays, table = [], []
for i, (name, content) in enumerate(contents):
    rows = ",\n".join(",".join(map(str, content[at : at + 24])) for at in range(0, len(content), 24))
    arrays.append(f"static const unsigned char asset_{i}[] = {{\n{rows}}};\n")
    tag = hashlib.sha256(content).hexdigest()[:16]
    kind = TYPES[pathlib.Path(name).suffix]
    table.append(f'    {{"{name}", "{kind}", "\\"{tag}\\"", asset_{i}, sizeof asset_{i}}},\n')
pathlib.Path(out).write_text("".join(arrays) + "static const struct asset assets[] = {\n" + "".join(table) + "};\n")
