"""'splatd pack --cameras' as a user runs it: splats take the photographs' colours, what is wrong with a photograph is said
by name, and the rest is packed when --keep-going says so."""
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
    row = b"\0" + pixel * width
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)),
              (b"IDAT", zlib.compress(row * height)), (b"IEND", b"")]
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
    said = run("pack", "wall.xyz", "--cameras", "views.json", "-o", "wall.spld", *arguments, code=code)
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
    assert "color" in run("info", "wall.spld")

    # exposures: the darker half is evened out with the brighter one, without a step
    write_png("images/left.png", 64, 48, bytes((160, 80, 40)))
    pack()
    seen = [color_at((x, -2, 0), (x, 0, 0)) for x in (-1.8, -1, -0.1, 0.1, 1, 1.8)]
    assert all(abs(a - b) <= 6 for one in seen for a, b in zip(one, seen[0])), seen

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
    mirrored = '{"matrix":[-1,0,0,0, 0,0,1,-3, 0,-1,0,0, 0,0,0,1],"convention":"opencv","fov":60,"width":64,"height":48}'
    scaled = '{"matrix":[2,0,0,0, 0,0,2,-3, 0,-2,0,0, 0,0,0,1],"convention":"opencv","fov":60,"width":64,"height":48}'
    refused("mirrored", gray, {**good, "odd": mirrored})
    refused("scaled", gray, {**good, "odd": scaled})
    for name in good:
        write_png(f"images/{name}.png", 64, 48, bytes(3))
    put_views(good)
    said = pack("--keep-going", code=2)
    assert said.count("nothing but black") == 2 and "no photograph" in said, said
    assert pathlib.Path("wall.spld").read_bytes() == before

    # a model of another scale: each photograph shows something, none what the others show
    def stripes(name, phase):
        rows = b"".join(b"\0" + b"".join(bytes((40 + 40 * ((x * 7 + phase * 31 + y * 3) * 2654435761 % 2**32 >> 30),)) * 3
                                         for x in range(64)) for y in range(48))
        chunks = [(b"IHDR", struct.pack(">IIBBBBB", 64, 48, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
        pathlib.Path(f"images/{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
            struct.pack(">I", len(b)) + k + b + struct.pack(">I", zlib.crc32(k + b)) for k, b in chunks))
    apart = {f"p{i}": camera((0.3 * i - 0.5, -3, 0.2 * i), (0.3 * i - 0.5, 0, 0)) for i in range(4)}
    for i, name in enumerate(apart):
        stripes(name, i * i + 1)
    put_views(apart)
    said = pack(code=2)
    assert "contradict" in said, said

    for arguments, words in ((("--images", "."), "--cameras"), (("--keep-going",), "--cameras"),
                             (("--cameras", "nowhere"), "nowhere"), (("--cameras", "views.json", "--memory", "1"), "memory"),
                             (("--cameras", "views.json", "--device", "nosuch"), "nosuch")):
        said = run("pack", "wall.xyz", "-o", "wall.spld", *arguments, code=None if "--device" in arguments else 2) \
            if "--device" not in arguments else subprocess.run(
                [SPLATD, "pack", "wall.xyz", "-o", "wall.spld", *arguments], stderr=subprocess.PIPE, text=True).stderr
        assert words in said, (arguments, said)
    assert sorted(os.listdir(".")) == ["images", "views.json", "wall.spld", "wall.xyz"], os.listdir(".")
    shutil.rmtree("images")
