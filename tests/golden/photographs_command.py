"""'splatd pack --cameras' as a user runs it: splats take the photographs' colours and textures, what is wrong with a
photograph is said by name, and the rest is packed when --keep-going says so."""
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

SPLATD = os.environ["SPLATD_BINARY"]


def run(*arguments, code=0):
    done = subprocess.run([SPLATD, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode and "no usable GPU" in done.stderr:
        print(done.stderr)
        sys.exit(77)
    assert done.returncode == code, (arguments, done.returncode, done.stderr)
    return done.stdout + done.stderr


def write_png(path, width, height, pixel, bits=8):
    """`pixel`: the bytes of every one, or a function of x and y that gives a grey level."""
    rows = (b"\0" + pixel * width) * height if isinstance(pixel, bytes) else b"".join(
        b"\0" + b"".join(bytes((pixel(x, y),)) * 3 for x in range(width)) for y in range(height))
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)),
              (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    data = b"\x89PNG\r\n\x1a\n"
    for kind, body in chunks:
        data += struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    pathlib.Path(path).write_bytes(data)


def camera(eye, target, size=(64, 48)):
    return '{"eye":%s,"target":%s,"up":[0,0,1],"fov":60,"width":%d,"height":%d}' % (list(eye), list(target), *size)


def put_views(cameras):
    views = ['{"name":"%s","photograph":"images/%s.png","camera":%s}' % (n, n, c) for n, c in cameras.items()]
    pathlib.Path("views.json").write_text('{"views":[%s]}' % ",".join(views))


def pack(*arguments, code=0):
    before = sorted(os.listdir("."))
    textures = () if "--textures" in arguments else ("--textures", "none")
    said = run("pack", "wall.xyz", "--cameras", "views.json", "-o", "wall.spld", *textures, *arguments, code=code)
    left = [f for f in sorted(os.listdir(".")) if f not in before and f != "wall.spld"]
    assert not left, left
    return said


def color_at(eye, target):
    """The middle pixel of a frame."""
    text = ",".join(map(str, eye)), ",".join(map(str, target))
    out = subprocess.run([SPLATD, "render", "wall.spld", "--eye", text[0], "--target", text[1], "--size", "9x9",
                          "--format", "raw", "-o", "-"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    return tuple(out.stdout[4 * 40:4 * 40 + 3])


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    os.mkdir("images")
    # a wall in the plane y = 0, x and z within 2; no colours of its own
    step = 0.04
    points = ["%.3f 0 %.3f" % (i * step - 2, k * step - 2) for i in range(101) for k in range(101)]
    pathlib.Path("wall.xyz").write_text("\n".join(points) + "\n")
    good = {"left": camera((-1, -3, 0), (-1, 0, 0)), "right": camera((1, -3, 0), (1, 0, 0))}
    for name in good:
        write_png(f"images/{name}.png", 64, 48, bytes((200, 100, 50)))
    put_views(good)
    said = pack()
    assert "2 photographs" in said, said
    assert color_at((0, -2, 0), (0, 0, 0)) == (200, 100, 50), color_at((0, -2, 0), (0, 0, 0))
    told = run("info", "wall.spld")
    seen = re.search(r"photographs: ([\d,]+) points, with the poses of views.json\n"
                     r" +constant: the other ([\d,]+) points", told)
    assert seen and sum(int(n.replace(",", "")) for n in seen.groups()) == 101 * 101, told

    # exposures: the darker half is evened out with the brighter one, without a step, in maps of both too
    write_png("images/left.png", 64, 48, bytes((160, 80, 40)))
    pack()
    seen = [color_at((x, -2, 0), (x, 0, 0)) for x in (-1.8, -1, -0.1, 0.1, 1, 1.8)]
    assert all(abs(a - b) <= 6 for one in seen for a, b in zip(one, seen[0])), seen

    run("pack", "wall.xyz", "--panoramas", "views.json", "-o", "wall.spld")
    seen = [color_at((x, -2, 0), (x, 0, 0)) for x in (-1.8, -1, -0.1, 0.1, 1, 1.8)]
    assert all(abs(a - b) <= 10 for one in seen for a, b in zip(one, seen[0])), seen  # blocks' colours are 8 apart

    # what cannot be used is named, and fails the packing; nothing is left behind, the old file stays
    before = pathlib.Path("wall.spld").read_bytes()
    write_png("images/left.png", 64, 48, bytes((200, 100, 50)))
    whole = pathlib.Path("images/left.png").read_bytes()
    bad = dict(good)
    bad["odd"] = camera((0, -3, 0), (0, 0, 0))
    odd = "images/odd.png"

    def refused(words, make, views=None):
        put_views(views or bad)
        if os.path.exists(odd):
            os.remove(odd)
        make()
        said = pack(code=2)
        assert words in said and ("odd" in said or views), said
        assert pathlib.Path("wall.spld").read_bytes() == before
        if views is None or "left" in views:
            said = pack("--keep-going")
            assert "left out" in said and words in said and re.search(r"\(1 could not be used\)", said), said
            assert color_at((0, -2, 0), (0, 0, 0)) == (200, 100, 50)
            pathlib.Path("wall.spld").write_bytes(before)

    refused("no such file", lambda: None)
    refused("PNG", lambda: pathlib.Path(odd).write_bytes(whole[:60]))
    refused("64 x 40 pixels", lambda: write_png(odd, 64, 40, bytes((9, 9, 9))))
    refused("16 bit", lambda: write_png(odd, 64, 48, bytes(6), 16))
    refused("black", lambda: write_png(odd, 64, 48, bytes(3)))
    gray = lambda: write_png(odd, 64, 48, bytes((200, 100, 50)))
    refused("sees no splat", gray, {**good, "odd": camera((0, -3, 0), (0, -9, 0))})
    refused("within the splats", gray, {**good, "odd": camera((0, -0.03, 0), (0, 0, 0))})
    pose = '{"matrix":[%s,0,0,0,1],"convention":"opencv","fov":60,"width":64,"height":48}'
    mirrored = pose % "-1,0,0,0, 0,0,1,-3, 0,-1,0,0"
    scaled = pose % "2,0,0,0, 0,0,2,-3, 0,-2,0,0"
    refused("mirrored", gray, {**good, "odd": mirrored})
    refused("scaled", gray, {**good, "odd": scaled})
    for name in good:
        write_png(f"images/{name}.png", 64, 48, bytes(3))
    put_views(good)
    said = pack("--keep-going", code=2)
    assert said.count("nothing but black") == 2 and "no photograph" in said, said
    assert pathlib.Path("wall.spld").read_bytes() == before

    # a model of another scale: each photograph shows something, none what the others show
    def speckle(phase):
        return lambda x, y: 40 + 40 * ((x * 7 + phase * 31 + y * 3) * 2654435761 % 2**32 >> 30)
    apart = {f"p{i}": camera((0.3 * i - 0.5, -3, 0.2 * i), (0.3 * i - 0.5, 0, 0)) for i in range(4)}
    for i, name in enumerate(apart):
        write_png(f"images/{name}.png", 64, 48, speckle(i * i + 1))
    put_views(apart)
    said = pack(code=2)
    assert "contradict" in said, said

    # photographs that share nothing but the scan: its colours contradict them, its intensity says nothing of them
    beside = {name: camera((x, -1.2, 0), (x, 0, 0)) for name, x in (("left", -1.2), ("right", 1.2))}
    for i, name in enumerate(beside):
        write_png(f"images/{name}.png", 64, 48, lambda x, y: speckle(i)(x // 4, y // 4))
    put_views(beside)
    greys = [30 + (i * 48271 % 2**31 * 69621 % 2**31) % 200 for i in range(len(points))]
    for red in (0, 9):
        pathlib.Path("wall.xyz").write_text("".join(f"{p} {g + red} {g} {g}\n" for p, g in zip(points, greys)))
        said = pack("--columns", "x,y,z,r,g,b", code=2 if red else 0)
        assert ("contradict" if red else "2 photographs") in said, said
    pathlib.Path("wall.xyz").write_text("\n".join(points) + "\n")

    # textures: what is finer than the splats shows in a close view, and only with atoms
    def rings(x, y):
        return int(128 + 90 * math.sin(0.8 * math.hypot(x - 64, y - 48)))
    write_png("images/rings.png", 128, 96, rings)
    put_views({"rings": camera((0, -1.5, 0), (0, 0, 0), (128, 96))})

    def spread(atoms):
        out = subprocess.run([SPLATD, "render", "wall.spld", "--eye", "0,-0.75,0", "--target", "0,0,0", "--size",
                              "64x48", "--format", "raw", "--atoms", str(atoms), "-o", "-"], stdout=subprocess.PIPE,
                             stderr=subprocess.DEVNULL, check=True).stdout
        grey = [out[4 * i] for i in range(64 * 48)]
        return sum((g - sum(grey) / len(grey)) ** 2 for g in grey) / len(grey)

    # the same bytes whatever the threads; what is left is said from the first stage that counts; presets
    files = []
    for threads in (1, 2, 4):
        said = pack("--textures", "adaptive", "--texture-quality", "draft", "--threads", threads)
        files.append(pathlib.Path("wall.spld").read_bytes())
        assert "training: epoch 2" in said and "training: epoch 3" not in said, said
    assert files[0] == files[1] == files[2], [len(f) for f in files]
    said = pack("--textures", "adaptive", "--texture-quality", "36")
    plain = pathlib.Path("wall.spld").read_bytes()
    said = pack("--textures", "adaptive", "--texture-quality", "normal", "--texture-quality", "36")
    assert pathlib.Path("wall.spld").read_bytes() == plain != files[0]

    for coding in ("adaptive",):
        said = pack("--textures", coding, "--texture-quality", "36", "--keep-textures", "images/kept")
        found = re.search(r"(\d+) textures of (\d+) x \d+: resampled at ([\d.]+) dB, coded at ([\d.]+) dB", said)
        assert found and int(found[1]) > 1000 and float(found[3]) > 30 and float(found[4]) > 25, said
        assert "epoch 1" in said and "atoms a splat: 0:" in said, said
        assert spread(8) > 1.3 * spread(0), (coding, spread(8), spread(0))
        assert run("info", "wall.spld", "--json").count("resampling_psnr") <= 1
        atoms = re.findall(r"\n  ([0-8]) +([\d,]+) +[\d.]+ %(?:  (#+))?", run("info", "wall.spld").split("by number of")[1])
        counts = [int(count.replace(",", "")) for _, count, _ in atoms]
        assert [int(n) for n, _, _ in atoms] == list(range(9)), atoms
        levels = json.loads(run("info", "wall.spld", "--json"))["by_level"]
        assert sum(counts) == sum(level["splats"] for level in levels), (counts, levels)
        assert len(atoms[counts.index(max(counts))][2]) == 40, atoms

    # the same photograph as one that was left out: textures gain where splats are wide, and pictures show it
    table = run("bench", "--left-out", "wall.spld", "--cameras", "views.json", "-o", "compared").splitlines()
    row = table[-1].split()
    assert row[0] == "rings" and float(table[-1][24:].split()[3]) > 1, table
    assert sorted(os.listdir("compared")) == ["rings.coloured.png", "rings.photograph.png", "rings.textured.png"]
    shutil.rmtree("compared")
    said = run("pack", "wall.xyz", "--panoramas", "views.json", "-o", "mapped.spld")
    assert "maps of 1 station from 1 picture" in said, said
    table = run("bench", "--left-out", "mapped.spld", "--cameras", "views.json").splitlines()
    assert float(table[-1][24:].split()[3]) > 1, table
    os.remove("mapped.spld")
    for arguments, words in (((), "--cameras"), (("--cameras", "nowhere"), "nowhere"),
                             (("--cameras", "views.json", "--lod", "x"), "--lod")):
        done = subprocess.run([SPLATD, "bench", "--left-out", "wall.spld", *arguments], stderr=subprocess.PIPE, text=True)
        assert done.returncode == 2 and words in done.stderr, (arguments, done.stderr)
    run("pack", "wall.xyz", "--points-only", "-o", "bare.spld")
    done = subprocess.run([SPLATD, "bench", "--left-out", "bare.spld", "--cameras", "views.json"], stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2 and "bare.spld has no textures or maps" in done.stderr, done.stderr
    os.remove("bare.spld")

    # the textures as they were before: coders beside each other, the photograph itself on the splats, a view that was
    # left out and whose photograph is the same plane seen from nearer
    cameras = {"rings": camera((0, -1.5, 0), (0, 0, 0), (128, 96)), "nearer": camera((0, -1, 0), (0, 0, 0), (128, 96))}
    write_png("images/nearer.png", 128, 96, lambda x, y: int(128 + 90 * math.sin(0.8 / 1.5 * math.hypot(x - 64, y - 48))))
    put_views(cameras)
    arguments = ("--textures", "images/kept", "wall.spld", "--cameras", "views.json", "-o", "coders", "--repeats", "1", "--size", "160x90")
    table = run("bench", *arguments, "--epochs", "2")
    rows = {line[:24].strip(): line[24:].split() for line in table.splitlines()}
    assert "paper D12W4" in rows and "paper D16W8" in rows and "adaptive, lambda 0.00029" in rows, table
    columns = dict(geometry=0, all=4, megabytes=5, psnr=8, packed=9, tile=10, left_out=11)

    def figure(row, column):
        return float(rows[row][columns[column]].replace("-", "nan"))
    # the photograph itself, but at the frame's edge, where splats reach in whose centres it does not show
    assert figure("LOD 0", "psnr") == math.inf
    assert figure("LOD 0", "packed") > figure("colours only", "packed") + 10, table
    assert figure("LOD 0", "tile") > figure("colours only", "tile") + 10, table
    assert figure("LOD 0", "left_out") > figure("colours only", "left_out") + 6, table
    assert figure("LOD 0 BC7", "psnr") > figure("LOD 0 BC1", "psnr") > 25, table
    assert figure("LOD 0", "psnr") > figure("LOD 1", "psnr") > figure("LOD 1 BC1", "psnr"), table
    assert figure("as packed", "packed") > figure("colours only", "packed") + 3, table
    info = json.loads(run("info", "wall.spld", "--json"))
    assert abs(figure("as packed", "all") - info["bytes_per_splat"]["total"]) < 0.02, (table, info)
    assert table.count("visibility") == 3 and re.search(r"\n  8 +\d", table), table
    assert "1 that were packed" in table and "; 1 left out" in table, table
    assert sorted(os.listdir("coders")) == ["rate.svg", "textures.csv", "training.csv", "training.svg"]

    def not_measured(words, *arguments):
        done = subprocess.run([SPLATD, "bench", "--textures", *arguments, "-o", "coders", "--codings", "none",
                               "--repeats", "1", "--size", "16x9"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert done.returncode == 2 and words in done.stderr, (arguments, done.stderr)
    not_measured("no textures", "wall.spld")
    not_measured("--sample", "images/kept", "--sample", "0")
    not_measured("not 'D9'", "images/kept", "--codings", "D8W4,D9")
    not_measured("NAME.spld, which is missing", "images/kept", "--cameras", "views.json")
    not_measured("--cameras MODEL", "images/kept", "wall.spld", "--images", "images")
    put_views({"nearer": cameras["nearer"]})
    not_measured("'rings' was packed", "images/kept", "wall.spld", "--cameras", "views.json")
    put_views({**cameras, "large": camera((0, -1, 0), (0, 0, 0), (640, 480))})
    not_measured("the limit is 1", "images/kept", "wall.spld", "--cameras", "views.json", "--memory", "1")
    put_views(good)
    write_png("images/left.png", 64, 48, bytes((200, 100, 50)))
    write_png("images/right.png", 64, 48, bytes((200, 100, 50)))
    points.append("3 0 3")
    pathlib.Path("wall.xyz").write_text("\n".join(points) + "\n")
    pack()
    not_measured("pack again", "images/kept", "wall.spld")
    shutil.rmtree("coders")
    os.unlink("images/kept")

    model = ("--cameras", "views.json")
    for arguments, words in ((("--images", "."), "--cameras"), (("--keep-going",), "--cameras"),
                             (("--cameras", "nowhere"), "nowhere"), ((*model, "--textures", "D9"), "D9"),
                             (("--texture-quality", "40"), "--cameras"), (("--texture-quality", "best"), "--cameras"),
                             ((*model, "--texture-quality", "fast"), "draft, normal, best"), (("--textures", "none"), "--cameras"),
                             ((*model, "--textures", "none", "--texture-quality", "40"), "codes nothing"),
                             ((*model, "--keep-textures", "./wall.xyz"), "is an input too"),
                             ((*model, "--keep-textures", "images/right.png"), "is an input too"),
                             ((*model, "--keep-textures", "./wall.spld"), "is an output too"),
                             ((*model, "--memory", "1"), "memory"), ((*model, "--device", "nosuch"), "nosuch")):
        done = subprocess.run([SPLATD, "pack", "wall.xyz", "-o", "wall.spld", *arguments], stderr=subprocess.PIPE,
                              text=True)
        assert done.returncode in (1, 2) and words in done.stderr, (arguments, done.stderr)
    assert sorted(os.listdir(".")) == ["images", "views.json", "wall.spld", "wall.xyz"], os.listdir(".")
    shutil.rmtree("images")
