"""'splatd compare' as a user runs it: the figures of files made here, whose errors are known; what it refuses."""
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import zlib

SPLATD = os.environ["SPLATD_BINARY"]
WIDTH, HEIGHT = 40, 30
COUNT = WIDTH * HEIGHT
wrong = []


def run(*arguments, code=0, words=""):
    """stdout; wants that exit code, and the words on stderr."""
    done = subprocess.run([SPLATD, "compare", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=600)
    if done.returncode != code or words not in done.stderr:
        wrong.append(f"compare {' '.join(arguments)}: exit {done.returncode}, {done.stderr!r} lacks {words!r}")
    return done.stdout


def check(what, got, expected, within=1e-6):
    if got is None or not math.isclose(got, expected, rel_tol=within, abs_tol=within):
        wrong.append(f"{what} is {got}, not {expected}")


def png(name, pixels, width=WIDTH):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + pixels[i:i + 4 * width] for i in range(0, len(pixels), 4 * width))
    header = struct.pack(">IIBBBBB", width, len(pixels) // 4 // width, 8, 6, 0, 0, 0)
    with open(name, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def decode(name):
    """Pixels of a PNG of ours: filter none or sub, as splatd writes it."""
    with open(name, "rb") as file:
        data = file.read()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        packed += data[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    raw, rows = zlib.decompress(packed), []
    for y in range(len(raw) // (4 * WIDTH + 1)):
        line = bytearray(raw[y * (4 * WIDTH + 1):(y + 1) * (4 * WIDTH + 1)])
        kind = line.pop(0)
        assert kind in (0, 1), kind
        for i in range(4, len(line)):
            line[i] = (line[i] + line[i - 4]) & 255 if kind else line[i]
        rows.append(bytes(line))
    return b"".join(rows)


def npy(name, values, channels=""):
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({HEIGHT}, {WIDTH}{channels}), }}".encode()
    with open(name, "wb") as file:
        file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + struct.pack(f"<{len(values)}f", *values))


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    os.mkdir("truth")
    png("truth/east.color.png", bytes((100, 90, 80, 255)) * COUNT)
    png("east.color.png", bytes((100, 90, 80, 255)) * (COUNT - 1) + bytes((100, 90, 30, 255)))
    npy("truth/east.depth.npy", [8] * COUNT)
    npy("east.depth.npy", [8.25] * 300 + [math.nan] * 60 + [8] * (COUNT - 360))
    npy("truth/east.coverage.npy", [1] * COUNT)
    npy("east.coverage.npy", [1] * 300 + [0] * 60 + [1] * (COUNT - 360))
    npy("truth/east.normal.npy", [0, 0, 1] * COUNT, ", 3")

    figures = json.loads(run("east", "truth/east", "--tolerance", "0.2", "--json", words="east has no normal"))
    check("psnr", figures["psnr"], 10 * math.log10(65025 * 3 * COUNT / 2500))
    check("depth_rmse", figures["depth_rmse"], math.sqrt(300 * 0.0625 / 1140))
    check("depth_median", figures["depth_median"], 0)
    check("depth_beyond", figures["depth_beyond"], 300 / 1140)
    check("see_through", figures["see_through"], 300 / COUNT)
    check("holes", figures["holes"], 60 / COUNT)
    if figures["halo"] is not None or figures["normal_mean"] is not None or len(figures) != 10:
        wrong.append(f"figures without pixels are not null: {figures}")

    table = run("east", "truth/east", "--tolerance", "0.3", "--threads", "1", words="no normal")
    if "PSNR" not in table or "holes          5 %" not in table or "halo" in table or "depth beyond   0 %" not in table:
        wrong.append(f"the table is {table!r}")

    run("east.color.png", "truth/east.color.png", "--error-map", "map.png")
    pixels = decode("map.png")
    if pixels != bytes((0, 0, 0, 255)) * (COUNT - 1) + bytes((0, 0, 255, 255)):
        wrong.append(f"the error map ends in {pixels[-8:]!r}")
    png("a.png", bytes((100, 90, 77, 255)) * COUNT)
    run("a.png", "truth/east.color.png", "--error-map", "map.png")
    if decode("map.png") != bytes((0, 0, 24, 255)) * COUNT:
        wrong.append("three levels are not 24 in the error map")

    figures = json.loads(run("east.color.png", "east.color.png", "--json"))
    if figures["psnr"] is not None or figures["ssim"] != 1:
        wrong.append(f"equal images differ: {figures}")
    figures = json.loads(run("east.depth.npy", "truth/east.depth.npy", "--layer", "depth", "--json"))
    check("depth_rmse of files", figures["depth_rmse"], math.sqrt(300 * 0.0625 / 1140))

    # What a file is called says its layer, where --layer does not; numbers of a nameless one are no broken colours.
    for first, second in (("east.depth.npy", "truth/east.depth.npy"), ("east.depth.npy", "truth/east"), ("depth.npy", "truth/east.depth.npy")):
        os.path.exists("depth.npy") or os.link("east.depth.npy", "depth.npy")
        figures = json.loads(run(first, second, "--json"))
        check(f"depth_rmse of {first} and {second}", figures["depth_rmse"], math.sqrt(300 * 0.0625 / 1140))
    os.link("east.depth.npy", "numbers.npy")
    run("numbers.npy", "truth/east.depth.npy", code=2, words="numbers.npy: holds no colours, and its name does not say what else: --layer depth")
    run("numbers.npy", "truth/east.depth.npy", "--layer", "normal", code=2, words="layer normal has the shape")
    run("east.color.png", "east.depth.npy", code=2, words="have no layer in common")
    check("depth_rmse by --layer", json.loads(run("numbers.npy", "truth/east.depth.npy", "--layer", "depth", "--json"))["depth_rmse"],
          math.sqrt(300 * 0.0625 / 1140))

    png("small.png", bytes(4 * COUNT), WIDTH * 2)
    run("small.png", "east.color.png", code=2, words="80 x 15 pixels, not 40 x 30")
    run("nowhere", "truth/east", code=2, words="nowhere.color.png")
    run("east", "nowhere.png", code=2, words="nowhere.png")
    run("east", code=2, words="IMAGE and a TRUTH")
    run("east.color.png", "east.depth.npy", code=2, words="east.depth.npy")
    run("east.depth.npy", "truth/east.depth.npy", "--layer", "id", code=2, words="--layer")
    run("east", "truth/east", "--tolerance", "-1", code=2, words="--tolerance")
    run("east.depth.npy", "truth/east.depth.npy", "--layer", "depth", "--error-map", "m.png", code=2, words="colours")
    run("east.color.png", "truth/east.color.png", "--error-map", "no/where.png", code=1, words="no/where.png")
    with open("east.color.png", "r+b") as file:
        file.truncate(60)
    run("east", "truth/east", code=2, words="east.color.png")
    if os.path.exists("m.png"):
        wrong.append("an error map was left behind")

print("\n".join(wrong) or "all figures as worked out")
sys.exit(1 if wrong else 0)
