"""'splatd tour' as a user runs it: its frames are those of 'splatd render', its video plays, what it refuses it says."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SPLATD = os.environ["SPLATD_BINARY"]


def run(*arguments, code=0):
    done = subprocess.run([SPLATD, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if code == 0 and done.returncode and "device" in done.stderr and arguments[0] == "render":
        print(done.stderr)
        sys.exit(77)
    assert done.returncode == code, (arguments, done.returncode, done.stderr)
    return done.stderr


def check_video(path, frames):
    if shutil.which("ffprobe"):
        probe = ["ffprobe", "-v", "error", "-count_frames", "-of", "csv=p=0", "-show_entries",
                 "stream=codec_name,width,height,avg_frame_rate,nb_read_frames", path]
        assert subprocess.run(probe, check=True, stdout=subprocess.PIPE, text=True).stdout.strip() == \
            f"h264,128,96,24/1,{frames}"
        decoded = subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-f", "null", "-"], stderr=subprocess.PIPE)
        assert decoded.returncode == 0 and not decoded.stderr, decoded


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    run("synth", "courtyard", "--points", 20000, "--format", "ply", "-o", ".")
    run("pack", "courtyard.ply", "-o", "c.spld")
    eyes = [(4 + i, -2, 1.6 + 0.1 * i) for i in range(3)]
    frames = [{"camera": {"eye": e, "target": [0, 5, 1], "up": [0, 0, 1], "fov": 60}} for e in eyes]
    pathlib.Path("whole.json").write_text(json.dumps({"frames": frames}))
    pathlib.Path("keys.json").write_text(json.dumps({"keyframes": frames, "fps": 24}))
    for i, e in enumerate(eyes):
        run("render", "c.spld", "--eye", ",".join(map(str, e)), "--target", "0,5,1", "--up", "0,0,1", "--fov", 60,
            "--size", "64x48", "-o", f"{i}.png")
    run("tour", "c.spld", "--path", "whole.json", "--size", "64x48", "--format", "png", "-o", "frames")
    names = sorted(os.listdir("frames"))
    assert names == ["000000.png", "000001.png", "000002.png"], names
    for i, name in enumerate(names):
        assert pathlib.Path("frames", name).read_bytes() == pathlib.Path(f"{i}.png").read_bytes(), name
    run("tour", "c.spld", "--path", "keys.json", "--size", "64x48", "--frames", 5, "--layer", "depth", "--format", "npy",
        "--ease", "in-out", "--rotations", "slerp", "--positions", "uniform", "--closed", "-o", "depth")
    assert len(os.listdir("depth")) == 5
    # as 'render' does, a tour says what a depth image could not hold
    for scale, lost in ((1000, False), (1e6, True)):
        said = run("tour", "c.spld", "--path", "whole.json", "--size", "64x48", "--layer", "depth", "--format", "png",
                   "--depth-scale", scale, "-o", "png")
        assert ("of 3 frames lie beyond 65535 steps" in said) == lost, said
    # the example whose roof fades: first and last frame are those of 'render', the roof gone in the last
    example = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"], "api/examples/roof-tour.json").resolve()
    roof = ["--soft", "plane:0,0,2.3,0,0,1>0", "--size", "64x48"]
    run("synth", "interior", "--points", 20000, "--format", "ply", "-o", ".")
    run("pack", "interior.ply", "--primitives", "all", "-o", "interior.spld")
    run("tour", "interior.spld", "--path", example, *roof, "--frames", 6, "--format", "png", "-o", "roof")
    keys = json.loads(example.read_text())["keyframes"]
    frames = [pathlib.Path("roof", f"{i:06}.png").read_bytes() for i in range(6)]
    for i in (0, 5):
        place = [f"--{name}={','.join(map(str, keys[i]['camera'][name]))}" for name in ("eye", "target", "up")]
        run("render", "interior.spld", *place, "--fov", keys[i]["camera"]["fov"], *roof, "--soft-opacity", keys[i]["soft_opacity"],
            "-o", "key.png")
        assert pathlib.Path("key.png").read_bytes() == frames[i], i
    assert len(set(frames)) == 6 and keys[0]["soft_opacity"] == 1 and keys[-1]["soft_opacity"] == 0
    # five images stay two only where nobody takes the other three for theirs; of other endings any may lie beside them
    before = {name: pathlib.Path("depth", name).read_bytes() for name in os.listdir("depth")}
    few = ["--path", "keys.json", "--size", "64x48", "--frames", 2, "-o", "depth"]
    message = run("tour", "c.spld", *few, "--format", "npy", code=2)
    assert re.search(r"'depth' holds 00000[234]\.npy, of a longer tour than this one of 2 frames", message), message
    assert before == {name: pathlib.Path("depth", name).read_bytes() for name in os.listdir("depth")}
    run("tour", "c.spld", *few, "--format", "jpeg")
    for arguments, said in [
        (["-o", "x"], "--path"), (["--path", "keys.json"], "-o"), (["--path", "nowhere.json", "-o", "x"], "nowhere.json"),
        (["--path", "keys.json", "-o", "x"], "give frames or seconds, as in --frames 150 or --seconds 5"), (["--path", "keys.json", "--ease", "up", "-o", "x"], "--ease"),
        (["--path", "keys.json", "--frames", "0", "-o", "x"], "--frames"),
        (["--path", "keys.json", "--frames", "2", "--layer", "depth", "-o", "x.mp4"], "video"),
        (["--path", "c.spld", "-o", "x"], "c.spld"),
    ]:
        message = run("tour", "c.spld", *arguments, code=2)
        assert said in message, (arguments, message)
    assert not os.path.exists("x")
    # not smaller: of 64x48 x264 itself gives other bytes each time, of the same pictures
    video = ["tour", "c.spld", "--path", "keys.json", "--size", "128x96", "--seconds", 0.5, "-o"]
    probe = subprocess.run([SPLATD, *map(str, video), "a.mp4"], stderr=subprocess.PIPE, text=True)
    if "-Dvideo=enabled" in probe.stderr:
        assert probe.returncode == 2
    else:
        assert probe.returncode == 0, probe.stderr
        run(*video, "b.mp4")
        check_video("a.mp4", 12)
        assert pathlib.Path("a.mp4").read_bytes() == pathlib.Path("b.mp4").read_bytes()
        run("tour", "c.spld", "--path", "keys.json", "--size", "129x96", "--frames", 2, "-o", "c.mp4", code=2)
    assert not [name for name in os.listdir(".") if name.endswith(".part")]
    print("frames, video and refusals are as they should be")
