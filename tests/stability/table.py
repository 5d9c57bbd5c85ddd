#!/usr/bin/env python3
"""The stability table for people: what table.json holds, as Markdown between two marks in tests/bench/RESULTS.md.

usage: table.py --update STABILITY [NAME] [--method METHOD] [--whole]   measures anew with that program, then writes both
                                               files; only the conditions whose names begin so, only the method's rows
       table.py --write                        writes RESULTS.md from table.json as it is
       table.py --check                        exit 1 where RESULTS.md does not hold what table.json does
"""
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
TABLE = HERE / "table.json"
RESULTS = HERE.parent / "bench" / "RESULTS.md"
BEGIN, END = "<!-- table.py: begin -->\n", "<!-- table.py: end -->\n"
# figure, heading, factor, decimals
SPLAT = [("psnr", "PSNR", 1, 1), ("ssim", "SSIM", 1, 2), ("holes", "holes", 100, 1), ("see_through", "see-through", 100, 1),
         ("depth_beyond", "beyond", 100, 1), ("halo", "halo", 100, 1), ("normal_median", "normal", 1, 1),
         ("flicker", "flicker", 1, 1)]
POINTS = [("psnr", "points: PSNR", 1, 1), ("holes", "holes", 100, 1), ("see_through", "see-through", 100, 1),
          ("depth_beyond", "beyond", 100, 1), ("flicker", "flicker", 1, 1)]
FILL = [("psnr", "fill: PSNR", 1, 1), ("holes", "holes", 100, 1), ("see_through", "see-through", 100, 1),
        ("depth_beyond", "beyond", 100, 1), ("halo", "halo", 100, 1), ("flicker", "flicker", 1, 1)]
NEAREST = [("psnr", "nearest: PSNR", 1, 1), ("holes", "holes", 100, 1), ("see_through", "see-through", 100, 1),
           ("depth_beyond", "beyond", 100, 1), ("flicker", "flicker", 1, 1)]
BEGIN_TEXTURES, END_TEXTURES = "<!-- table.py: textures begin -->\n", "<!-- table.py: textures end -->\n"
COLOURED = [("psnr", "colours: PSNR", 1, 1), ("ssim", "SSIM", 1, 2), ("flicker", "flicker", 1, 1)]
TEXTURED = [("psnr", "textures: PSNR", 1, 1), ("ssim", "SSIM", 1, 2), ("flicker", "flicker", 1, 1)]
BEGIN_MAPS, END_MAPS = "<!-- table.py: maps begin -->\n", "<!-- table.py: maps end -->\n"
UNMAPPED = [("psnr", "colours: PSNR", 1, 1), ("ssim", "SSIM", 1, 2), ("halo", "halo", 100, 1),
            ("depth_beyond", "beyond", 100, 1), ("flicker", "flicker", 1, 1)]
MAPPED = [("psnr", "maps: PSNR", 1, 1), *UNMAPPED[1:]]
BEGIN_PRIMITIVES, END_PRIMITIVES = "<!-- table.py: primitives begin -->\n", "<!-- table.py: primitives end -->\n"
DISCS = [("psnr", "splats: PSNR", 1, 1), ("ssim", "SSIM", 1, 2), ("holes", "holes", 100, 1), ("halo", "halo", 100, 1),
         ("depth_beyond", "beyond", 100, 1), ("depth_median", "depth, mm", 1000, 1), ("flicker", "flicker", 1, 1)]
PRIMITIVES = [("psnr", "primitives: PSNR", 1, 1), *DISCS[1:]]


def cell(row, figure, factor, decimals):
    value = row and row[figure]
    if value is None:
        return "–"
    if figure == "psnr" and value >= 99:
        return "equal"
    return f"{value * factor:.{decimals}f}"


def markdown(kinds):
    """The rows of these methods, each with its columns."""
    rows = json.loads(TABLE.read_text(encoding="utf-8"))["rows"]
    by_name = {}
    for row in rows:
        if row["method"] in kinds:
            by_name.setdefault((row["condition"], row["value"]), {})[row["method"]] = row
    headings = ["condition", ""] + [column[1] for columns in kinds.values() for column in columns]
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    last = None
    order = list(dict.fromkeys(condition for condition, _ in by_name))
    for (condition, value), methods in sorted(by_name.items(), key=lambda item: order.index(item[0][0])):
        cells = [condition if condition != last else "", value]
        for method, columns in kinds.items():
            cells += [cell(methods.get(method), f, factor, d) for f, _, factor, d in columns]
        lines.append("| " + " | ".join(cells) + " |")
        last = condition
    return "\n".join(lines) + "\n"


def main(arguments):
    if arguments[:1] == ["--update"] and len(arguments) > 1:
        code = subprocess.run([arguments[1], "conditions", "--update", *arguments[2:]], check=False).returncode
        if code:
            return code
    elif arguments not in (["--write"], ["--check"]):
        sys.exit(__doc__)
    text = RESULTS.read_text(encoding="utf-8")
    new = text
    for begin, end, kinds in ((BEGIN, END, {"splat": SPLAT, "points": POINTS, "fill": FILL, "nearest": NEAREST}),
                              (BEGIN_TEXTURES, END_TEXTURES, {"coloured": COLOURED, "textured": TEXTURED}),
                              (BEGIN_MAPS, END_MAPS, {"unmapped": UNMAPPED, "mapped": MAPPED}),
                              (BEGIN_PRIMITIVES, END_PRIMITIVES, {"discs": DISCS, "primitives": PRIMITIVES})):
        if text.count(begin) != 1 or text.count(end) != 1:
            sys.exit(f"{RESULTS}: the marks {begin.strip()} and {end.strip()} must be there once each")
        head, rest = new.split(begin)
        new = head + begin + markdown(kinds) + end + rest.split(end)[1]
    if arguments == ["--check"]:
        if new != text:
            print(f"{RESULTS} is not what {TABLE.name} says: run tests/stability/table.py --write")
        return int(new != text)
    RESULTS.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
