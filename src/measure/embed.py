"""A text file as the C array of unsigned char `NAME`, for meson. usage: embed.py NAME IN OUT"""
import pathlib
import sys

name, source, out = sys.argv[1:]
content = pathlib.Path(source).read_bytes() + b"\0"
rows = (content[i:i + 24] for i in range(0, len(content), 24))
pathlib.Path(out).write_text(f"static const unsigned char {name}[] = {{\n" +
                             "".join(",".join(map(str, row)) + ",\n" for row in rows) + "};\n")
