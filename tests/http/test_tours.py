"""Tours: made to their end, watched, cancelled, killed in the middle and gone on with, refused, out of disk."""
import io
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import zipfile

import openapi
import tiles
from harness import FAKE, PATIENT, REAL, WALL, Daemon, Hold, eventually, lines, run, together, Reply

TOURS = "/v1/datasets/wall/tours"
SMALL = dict(width=64, height=48)


def look(x, y=0.2, z=1.0, **more):
    return {"camera": {"eye": [x, y, z], "target": [0, 0, 1], "fov": 60}, **more}


def body(frames=6, **more):
    return {"path": {"keyframes": [look(3), look(2, -1, 2), look(4, 1)]}, "frames": frames, "settings": SMALL, **more}


class Folder:
    def __enter__(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="splatd-tours-"))
        return self.path

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)


def begin(d, document, status=202):
    reply = d.post(document, TOURS)
    assert reply.status == status, (reply.status, reply.body)
    if status == 202:
        assert reply.headers["Location"] == reply.json()["uri"]
    return reply.json()


def ended(d, uri, state="done"):
    eventually(lambda: d.ask(uri).json()["state"] in ("done", "failed"))
    tour = d.ask(uri).json()
    assert tour["state"] == state, tour
    return tour


SLOW = dict(width=96, height=54, soft="axis:0,0,0,0,0,1<0.5", soft_model="base")  # 2000 s a frame at 386000 s a megapixel


def test_a_slow_frame_gives_way_and_goes_with_its_tour():
    with Folder() as tours, Daemon(FAKE, "--tours", tours, FAKE_SOFT_MS=386000000) as d:
        slow = begin(d, body(settings=SLOW))["uri"]
        eventually(lambda: d.ops("/metrics").body.count(b'splatd_tours{state="rendering"} 1\n'))  # its first frame is being drawn
        for i in range(3):
            assert d.view(width=16 + i, height=16).status == 200
        assert d.ask(slow).json()["state"] == "rendering" and d.ask(slow).json()["frames_done"] == 0
        assert d.ask(slow, "DELETE").status == 204
        ended(d, begin(d, body(2))["uri"])  # or the frames of the tour that was removed are drawn on


def test_what_the_dataset_lacks_is_refused_at_once():
    with Folder() as tours, Daemon(FAKE, "--tours", tours) as d:
        refused = begin(d, body(settings=dict(SMALL, soft="nothing_like_it>3")), 400)
        assert refused["field"] == "settings.soft" and "nothing_like_it" in refused["detail"], refused
        assert not d.ask("/v1/tours").json()["tours"]


def test_a_frame_whose_faces_are_too_many_samples_fails_its_tour():
    """Its keys look past everything on either side and cost little; between them the whole of a fisheye comes into the image."""
    def key(cx):
        return {"camera": {"eye": [3, 0, 1], "target": [0, 0, 1], "projection": "fisheye", "fx": 400, "cx": cx, "cy": 256}}
    path = {"path": {"keyframes": [key(-1e6), key(1e6)]}, "frames": 3, "settings": {"width": 512, "height": 512}}
    for samples, state in (300000, "failed"), (4000000, "done"):
        with Folder() as tours, Daemon(FAKE, "--tours", tours, "--max-samples", str(samples)) as d:
            tour = ended(d, begin(d, path)["uri"], state)
            assert state == "done" or "the limit is 300000" in json.dumps(tour), tour


def read_stream(d, uri, begun=None):
    """Reads a stream to its end; `begun` is set once its first byte is there."""
    connection = d.connect()
    connection.request("GET", uri)
    answer = connection.getresponse()
    first = answer.read(1)
    if begun:
        begun.set()
    reply = Reply(answer.status, answer.headers, first + answer.read())
    connection.close()
    openapi.check("GET", uri, {}, None, reply)
    return reply


def watch(d, uris):
    """Reads streams beside the test, once each has sent something: the threads, and what they read by URI."""
    replies, threads = {}, []
    for uri in uris:
        begun = threading.Event()
        threads.append(threading.Thread(target=lambda uri=uri, begun=begun: replies.update({uri: read_stream(d, uri, begun)})))
        threads[-1].start()
        assert begun.wait(150)
    return threads, replies


def events_of(text):
    found = []
    for block in text.decode().split("\n\n"):
        fields = dict(re.findall(r"^(event|data|id|retry): (.*)$", block, re.M))
        if "event" in fields:
            found.append((fields["event"], json.loads(fields["data"])))
    return found


def parts_of(reply):
    assert reply.headers["Content-Type"] == "multipart/x-mixed-replace; boundary=splatd-frame"
    parts, rest = [], reply.body
    while not rest.startswith(b"--splatd-frame--"):
        head, rest = rest.split(b"\r\n\r\n", 1)
        assert head.startswith(b"--splatd-frame\r\nContent-Type: image/"), head
        length = int(re.search(rb"Content-Length: (\d+)", head)[1])
        parts.append(rest[:length])
        assert rest[length:length + 2] == b"\r\n"
        rest = rest[length + 2:]
    return parts


def frames_of(d, tour):
    return [d.ask(tour["frame"].replace("{n}", str(n))).body for n in range(tour["frames"])]


def test_without_a_folder_every_route_says_so():
    with Daemon(FAKE) as d:
        for method, path in [("POST", TOURS), ("GET", "/v1/tours"), ("GET", "/v1/tours/0123456789abcdef"),
                             ("DELETE", "/v1/tours/0123456789abcdef"), ("GET", "/v1/tours/0123456789abcdef/events"),
                             ("GET", "/v1/tours/0123456789abcdef/stream"), ("GET", "/v1/tours/0123456789abcdef/frames/0"),
                             ("GET", "/v1/tours/0123456789abcdef/frames.zip"),
                             ("GET", "/v1/tours/0123456789abcdef/video.mp4")]:
            reply = d.ask(path, method, json.dumps(body()) if method == "POST" else None)
            assert reply.status == 501 and "--tours DIR" in reply.json()["detail"], (path, reply.body)


def nerfstudio():
    matrices = [[0, 0, 1, 3 - 0.25 * i, 1, 0, 0, 0.1 * i, 0, 1, 0, 1, 0, 0, 0, 1] for i in range(4)]
    return matrices, {"camera_type": "perspective", "render_width": 64, "render_height": 48, "fps": 24, "seconds": 1,
                      "is_cycle": False, "keyframes": [], "camera_path":
                      [{"camera_to_world": m, "fov": 60, "aspect": 4 / 3} for m in matrices]}


def check_files(d, tour, frames):
    uri = tour["frame"].replace("{n}", "1")
    whole = d.ask(uri)
    tag = {"If-Range": whole.headers["ETag"]}
    assert whole.headers["Content-Type"] == "image/jpeg" and whole.body == frames[1]
    for text, first, last in [("0-9", 0, 10), ("5-", 5, None), ("-7", -7, None), ("10-99999999", 10, None)]:
        part = d.ask(uri, headers={"Range": "bytes=" + text, **tag})
        assert part.status == 206 and part.body == whole.body[first:last], (text, part.status)
    assert d.ask(uri, headers={"Range": "bytes=0-9", "If-Range": '"another"'}).body == whole.body
    assert d.ask(uri, headers={"Range": "bytes=0-1,4-5"}).status == 200
    head = d.ask(uri, "HEAD", headers={"Range": "bytes=0-1"})  # ranges are GET's alone
    assert head.status == 200 and int(head.headers["Content-Length"]) == len(whole.body), head.headers
    assert d.ask(uri, headers={"Range": f"bytes={len(whole.body)}-"}).status == 416
    assert d.ask(uri, headers={"If-None-Match": whole.headers["ETag"]}).status == 304
    assert d.ask(uri, headers={"If-Match": whole.headers["ETag"], "Range": "bytes=0-9"}).status == 206
    assert d.ask(uri, headers={"If-Match": '"x"', "Range": "bytes=0-9", "If-None-Match": "*"}).status == 412
    assert d.ask(uri, headers=lines(("If-None-Match", '"x"'), ("If-None-Match", whole.headers["ETag"]))).status == 304
    head = d.ask(uri, "HEAD")
    assert head.status == 200 and int(head.headers["Content-Length"]) == len(whole.body) and not head.body
    for n in ("4", "-1", "1e0", "99999999999", "x"):
        assert d.ask(tour["frame"].replace("{n}", n)).status == 404
    archive = zipfile.ZipFile(io.BytesIO(d.ask(tour["zip"]).body))
    assert archive.testzip() is None and archive.namelist() == [f"{n:06}.jpeg" for n in range(4)]
    assert [archive.read(name) for name in archive.namelist()] == frames
    assert d.ask(tour["zip"], "HEAD").status == 200  # made, and nobody takes it


def check_video(d, tour, frames):
    reply = d.ask(tour["video"])
    if reply.status == 501:
        return
    assert reply.status == 200 and reply.headers["Content-Type"] == "video/mp4"
    assert d.ask(tour["video"], headers={"Range": "bytes=4-7"}).body == b"ftyp"
    assert d.ask(tour["video"], headers={"Range": "bytes=0-1", "If-Range": '"x"'}).body == reply.body
    assert d.ask(tour["video"], headers={"Range": "bytes=999999999-"}).status == 416
    assert d.ask(tour["video"], headers={"If-None-Match": "*"}).status == 304
    assert d.ask(tour["video"], headers={"If-Match": "*"}).body == reply.body
    assert d.ask(tour["video"], headers={"If-Match": '"x"'}).status == 412
    if not shutil.which("ffprobe"):
        return
    with tempfile.NamedTemporaryFile(suffix=".mp4") as file:
        file.write(reply.body)
        file.flush()
        probe = ["ffprobe", "-v", "error", "-count_frames", "-of", "json", "-show_entries",
                 "stream=codec_name,width,height,nb_read_frames,avg_frame_rate,pix_fmt,color_space", file.name]
        [stream] = json.loads(subprocess.run(probe, check=True, stdout=subprocess.PIPE).stdout)["streams"]
    assert stream == {"codec_name": "h264", "width": 64, "height": 48, "pix_fmt": "yuv420p", "color_space": "bt709",
                      "avg_frame_rate": "24/1", "nb_read_frames": str(frames)}, stream


def can_make_video(d):
    return d.post({**body(), "video": True, "settings": {"width": 63, "height": 48}}, TOURS).status != 501


def test_a_camera_path_becomes_frames_a_zip_a_stream_and_a_video():
    matrices, path = nerfstudio()
    with Folder() as folder, Daemon(REAL, "--tours", str(folder)) as d:
        video = can_make_video(d)
        uri = begin(d, {"path": path, "video": video, "settings": {"lod": 0.5}})["uri"]
        events = events_of(read_stream(d, uri + "/events").body)
        tour = ended(d, uri)
        assert events[-1][0] == "end" and events[-1][1] == tour, (events[-1], tour)
        assert {name for name, _ in events[:-1]} <= {"progress"}
        done = [status["frames_done"] for _, status in events]
        assert done == sorted(done) and done[-1] == 4 and tour["progress"] == 1 and tour["remaining_s"] == 0
        assert (tour["fps"], tour["width"], tour["height"], tour["format"]) == (24, 64, 48, "jpeg")
        assert d.ask("/v1/tours").json()["tours"] == [tour] and tour["ended"] >= tour["created"]
        frames = frames_of(d, tour)
        for matrix, frame in zip(matrices, frames):  # a frame is the view from there
            view = {"camera": {"matrix": matrix, "convention": "opengl", "fov": 60}, "lod": 0.5, **SMALL}
            assert d.post(view).body == frame
        assert len(set(frames)) == 4
        check_files(d, tour, frames)
        if video:
            check_video(d, tour, 4)
        assert parts_of(read_stream(d, tour["stream"])) == frames
        eventually(lambda: disk_bytes(folder / tour["name"], False) == d.ask("/v1/tours").json()["bytes"])
        assert d.ask(uri, "DELETE").status == 204 and d.ask(uri).status == 404
        assert d.ask("/v1/tours").json() == {"tours": [], "bytes": 0, "bytes_max": 10 << 30}
        eventually(lambda: not list(folder.iterdir()))


def test_what_is_soft_fades_between_keyframes():
    """Each frame is the view with the strength that lies between its keys'."""
    soft = {"soft": "plane:0,0,1,0,0,1>0", **SMALL}
    with Folder() as folder, Daemon(REAL, "--tours", str(folder)) as d:
        uri = begin(d, {"path": {"keyframes": [look(3, soft_opacity=1), look(3, soft_opacity=0, soft_cover=0.5)]}, "frames": 5,
                        "settings": soft})["uri"]
        for frame, opacity in zip(frames_of(d, ended(d, uri)), (1, 0.75, 0.5, 0.25, 0)):
            assert d.post({**look(3), **soft, "soft_opacity": opacity, "soft_cover": 0.5}).body == frame, opacity


def test_every_format_and_member_is_taken():
    extrinsic = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]
    intrinsic = {"width": 64, "height": 48, "intrinsic_matrix": [50, 0, 0, 0, 50, 0, 31.5, 23.5, 1]}
    paths = [
        ("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n", 2),
        ({"class_name": "PinholeCameraTrajectory", "parameters": [{"extrinsic": extrinsic, "intrinsic": intrinsic}]}, 1),
        ({"cameras_txt": "1 PINHOLE 64 48 50 50 32 24\n", "images_txt": "1 1 0 0 0 0 0 0 1 a.png\n\n"}, 1),
        ({"frames": [look(3), look(4), look(5)]}, 3),
    ]
    motion = {"positions": "uniform", "rotations": "slerp", "ease": "in-out", "closed": 1}
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder)) as d:
        for path, frames in paths:
            tour = begin(d, {"path": path, "settings": SMALL})
            assert tour["frames"] == frames
            ended(d, tour["uri"])
        tour = begin(d, {"path": {"keyframes": [look(3, time=0), look(4, time=0.5)]}, "settings": SMALL, "fps": 10,
                         "seconds": 1, "interpolation": motion})
        assert tour["frames"] == 10 and tour["fps"] == 10
        ended(d, tour["uri"])
        for layer, kind, start in [("depth", "png", b"\x89PNG"), ("normal", "npy", b"\x93NUMPY"), ("id", "raw", b"\xff" * 0)]:
            tour = begin(d, body(2, settings={**SMALL, "layer": layer, "format": kind}))
            ended(d, tour["uri"])
            assert all(frame.startswith(start) for frame in frames_of(d, tour))
            assert tour["stream"] == (tour["uri"] + "/stream" if kind == "png" else None), tour
            assert d.ask(tour["uri"] + "/stream").status == (200 if kind == "png" else 409)
        tour = begin(d, body(2, settings={**SMALL, "layers": ["color", "depth"]}))
        assert tour["layers"] == ["color", "depth"] and tour["format"] == "zip"
        ended(d, tour["uri"])
        for frame in frames_of(d, tour):
            assert zipfile.ZipFile(io.BytesIO(frame)).namelist() == ["color.jpg", "depth.png", "index.json"]
        assert tour["stream"] is None and d.ask(tour["uri"] + "/stream").status == 409
        assert tour["video"] is None and d.ask(tour["uri"] + "/video.mp4").status == 404


def test_a_side_that_is_left_out_follows_from_the_path():
    keys = {"keyframes": [look(3), look(4)]}
    wide = {"keyframes": [{**look(3), "width": 100}, {"camera": {**look(4)["camera"], "height": 50}}]}
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder)) as d:
        for path, settings, size in [(nerfstudio()[1], {"width": 32}, (32, 24)), (nerfstudio()[1], {"height": 96}, (128, 96)),
                                     (keys, {"width": 64}, (64, 36)), (keys, {"height": 9}, (16, 9)),
                                     (wide, {"width": 64}, (64, 36))]:
            tour = begin(d, {"path": path, "settings": settings, "frames": 2})
            assert (tour["width"], tour["height"]) == size, (settings, tour)
            ended(d, tour["uri"])


def test_bad_tours_are_refused_by_field():
    cases = [
        ("", "body"), ("[]", "body"), ("{", "body"), ({}, "path"), ({"path": 5}, "path"), ({"path": {}}, "path"),
        ({"path": "1 2 3"}, "tz"), ({**body(), "shade": 1}, "shade"), ({**body(), "frames": 0}, "frames"),
        ({**body(), "frames": 1.5}, "frames"), ({**body(), "frames": "2"}, "frames"), ({**body(), "fps": 0}, "fps"),
        ({**body(), "fps": 1e-300}, "fps"), ({"path": {"keyframes": [look(3)]}, "seconds": 1e-300}, "seconds"),
        ({**body(), "seconds": 2}, "seconds"), ({"path": body()["path"]}, "frames"),
        ({"path": {"keyframes": [look(3), {"camera": {"eye": [1, 2]}}]}}, "keyframes[1].camera.eye"),
        ({"path": {"keyframes": [look(3), look(4, soft_opacity=1.5)]}}, "keyframes[1].soft_opacity"),
        ({"path": {"keyframes": [look(3, soft_opacity="0.5")]}}, "keyframes[0].soft_opacity"),
        ({"path": {"keyframes": [look(3, soft_blend=-1)]}}, "keyframes[0].soft_blend"),
        ({"path": {"keyframes": [look(3, soft_cover=2)]}}, "keyframes[0].soft_cover"),
        ({"path": {"keyframes": [look(3, soft="uncertainty>1")]}}, "keyframes[0].soft"),
        ({"path": {"keyframes": [look(3)]}, "settings": {"soft": "uncertainty"}}, "settings.soft"),
        ({"path": {"keyframes": [look(3, soft_opacity=0.5)]}, "frames": 2}, "settings.soft"),
        ({"path": {"keyframes": [look(3, soft_opacity=0.5)]}, "frames": 2, "settings": {"soft_opacity": 0.1}}, "settings.soft"),
        ({"path": {"keyframes": [look(3)]}, "settings": {"soft_model": "exact"}}, "settings.soft_model"),
        ({"path": {"keyframes": [{"camera": {"eye": [3, 0, 1], "target": [0, 0, 1], "projection": "cube"}}]}, "frames": 2,
          "settings": {"layer": "depth"}}, "settings.layer"),
        ({"path": {"camera_path": [{"fov": 60}], "render_width": 9, "render_height": 9}}, "camera_path[0].camera_to_world"),
        ({**body(), "interpolation": 1}, "interpolation"), ({**body(), "interpolation": {"ease": "up"}}, "ease"),
        ({**body(), "interpolation": {"speed": 1}}, "speed"), ({**body(), "interpolation": {"closed": 2}}, "closed"),
        ({**body(), "interpolation": {"positions": "cubic"}}, "positions"),
        ({**body(), "interpolation": {"rotations": 7}}, "rotations"), ({**body(), "settings": []}, "settings"),
        ({**body(), "settings": {"width": 9999}}, "settings.width"), ({**body(), "settings": {"height": 8192}}, "height"),
        ({**body(), "settings": {"width": 64, "height": 9999}}, "settings.height"),
        ({**body(), "settings": {"quality": 500}}, "settings.quality"),
        ({**body(), "settings": {"camera": {}}}, "settings.camera"), ({**body(), "settings": {"x": 1}}, "settings.x"),
        ({**body(), "settings": {"budget": "5ms"}}, "settings.budget"),
        ({**body(), "settings": {"psnr": 30}}, "settings.psnr"), ({**body(), "settings": {"v": "0" * 16}}, "settings.v"),
        ({**body(), "settings": {"layers": ["color"], "container": "multipart"}}, "settings.container"),
        ({**body(), "settings": {"layers": ["color"], "layer": "color"}}, "settings.layers"),
        ({**body(), "video": True, "settings": {**SMALL, "layers": ["color"]}}, "video"), ({**body(), "video": 2}, "video"),
        ({**body(), "video": True, "settings": {**SMALL, "layer": "depth", "format": "png"}}, "video"),
    ]
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder)) as d:
        for document, field in cases:
            reply = d.post(document, TOURS)
            assert reply.status == 400 and reply.json()["field"] == field, (document, reply.body)
        if can_make_video(d):
            assert begin(d, body(video=True, settings={"width": 64, "height": 47}), 400)["field"] == "height"
        assert d.ask("/v1/datasets/none/tours", "POST", json.dumps(body())).status == 404
        for path in ("/v1/tours/..%2f..%2fetc", "/v1/tours/0123456789abcdef", "/v1/tours/x/events"):
            assert d.ask(path).status == 404
        assert d.ask("/v1/tours?x=1").status == 400 and d.ask("/v1/tours", "DELETE").status == 405
        assert not list(folder.iterdir())


def test_quotas():
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), "--tour-frames", "8", "--tour-pixels", "20000",
                                    "--tour-disk", "60K") as d:
        assert begin(d, body(9), 400)["field"] == "frames"
        assert "the limit is 8" in begin(d, body(1000000), 400)["detail"]  # not that of all paths
        assert begin(d, body(7), 400)["field"] == "frames"  # 21,504 pixels
        kept = begin(d, body(6))
        ended(d, kept["uri"])
        full = begin(d, body(6, settings={**SMALL, "format": "raw"}))  # 12 KiB a frame
        failed = ended(d, full["uri"], "failed")
        assert "61440 bytes" in failed["error"] and 0 < failed["frames_done"] < 6, failed
        assert d.ask(failed["frame"].replace("{n}", "0")).status == 200
        assert d.ask(failed["frame"].replace("{n}", "5")).status == 409
        assert len(zipfile.ZipFile(io.BytesIO(d.ask(failed["zip"]).body)).namelist()) == failed["frames_done"]
        assert failed["stream"] is None and d.ask(failed["uri"] + "/stream").status == 409  # raw
        for uri in (kept["uri"], failed["uri"]):
            assert d.ask(uri, "DELETE").status == 204
        ended(d, begin(d, body(2))["uri"])
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), "--tour-age", "1") as d:
        begin(d, body(2))
        eventually(lambda: d.ask("/v1/tours").json()["tours"] == [])  # old
        eventually(lambda: not list(folder.iterdir()))
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), "--tour-disk", "0") as d:
        assert "0 bytes" in begin(d, body(), 507)["detail"]
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), FAKE_FRAME_MS=100) as d:
        for _ in range(32):
            begin(d, body(5000))
        assert "32 tours are still to be made" in begin(d, body(), 503)["detail"]


def size(path):
    """0 where it has gone meanwhile: what is being written has another name."""
    try:
        return path.stat().st_size if path.is_file() else 0
    except FileNotFoundError:
        return 0


def disk_bytes(folder, hidden=True):
    return sum(size(f) for f in folder.rglob("*") if hidden or f.name[0] != ".")


def idle(text):
    """A body of one camera whose path has `text` where nobody looks."""
    path = json.dumps({**nerfstudio()[1], "keyframes": "HERE"}).replace('"HERE"', text)
    return f'{{"path": {path}, "frames": 5000, "settings": {json.dumps(SMALL)}}}'


def test_what_is_kept_of_a_path_is_bounded_before_it_is_accepted():
    deep = idle("[" * 2040 + ",".join("1" * 260000) + "]" * 2040)
    texts = idle('"' + '\\\\' * 490000 + '"')
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), "--tour-disk", "1M") as d:
        refused = begin(d, deep, 507)
        assert "remove some" in refused["detail"] and "1048576 bytes" in refused["detail"], refused
        assert begin(d, idle("[" * 60 + "]" * 70), 400)["field"] == "body"
        assert not list(folder.iterdir()) and d.ask("/v1/tours").json()["bytes"] == 0
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), "--tour-disk", "8M", FAKE_FRAME_MS=100) as d:
        assert begin(d, deep, 400)["field"] == "body"
        for _ in range(2):
            tour = begin(d, texts)
        eventually(lambda: disk_bytes(folder) > 3.8e6)
        taken = {reply.status for reply in together(8, lambda _: d.post(texts, TOURS))}
        assert 202 in taken and len(taken) > 1 and taken <= {202, 503, 507}, taken  # two more have room
        eventually(lambda: disk_bytes(folder, False) >= d.ask("/v1/tours").json()["bytes"] > 6e6)
        assert disk_bytes(folder) < 8 << 20
        d.process.send_signal(signal.SIGKILL)
        d.wait_exit()
        with Daemon(FAKE, "--tours", str(folder), "--tour-disk", "8M") as again:  # listed, counted, gone on with
            tours = again.ask("/v1/tours").json()
            assert tour["name"] in [t["name"] for t in tours["tours"]] and tours["bytes"] > 6e6, tours
            assert again.ask(tour["uri"]).json()["state"] == "rendering"
            for t in tours["tours"]:
                assert again.ask(t["uri"], "DELETE").status == 204
            eventually(lambda: not list(folder.iterdir()))


def test_a_tour_of_the_version_before_goes_on():
    with Folder() as folder:
        with Daemon(FAKE, "--tours", str(folder)) as d:
            wanted = frames_of(d, ended(d, begin(d, depth_tour(6))["uri"]))
        with Daemon(FAKE, "--tours", str(folder), **Hold().environment) as d:
            tour = begin(d, depth_tour(6))
            file = folder / tour["name"] / "tour.json"
            assert file.exists()  # what was promised outlives everything
            d.process.send_signal(signal.SIGKILL)
            d.wait_exit()
        state = json.loads(file.read_text())
        assert state["format_version"] == 2 and json.loads(state["body"]) == depth_tour(6)
        file.write_text(json.dumps({**state, "format_version": 1, "body": json.loads(state["body"])}))
        with Daemon(FAKE, "--tours", str(folder)) as d:
            assert frames_of(d, ended(d, tour["uri"])) == wanted


def test_a_client_that_leaves_while_its_path_is_read():
    preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
    with Folder() as folder, Folder() as elsewhere:
        gate = elsewhere / "gate"
        gate.touch()  # for the dataset
        with Daemon(FAKE, "--tours", str(folder), *PATIENT, LD_PRELOAD=preload, SLOW_DISK_GATE=gate,
                    SLOW_DISK_NAME="tour.json", UV_THREADPOOL_SIZE=1) as d:
            gate.unlink()
            first = d.connect()
            first.request("POST", TOURS, json.dumps(body(2)))
            try:
                eventually(lambda: d.ask("/v1/tours").json()["tours"])  # its state is being written by the pool's one thread
                uri = d.ask("/v1/tours").json()["tours"][0]["uri"]
                assert d.ask(uri, "DELETE").status == 503  # whoever made it has no reply yet
                leaving = d.connect()
                leaving.request("POST", TOURS, json.dumps(body(3)))
                eventually(lambda: b"\nsplatd_requests_open 2\n" in d.ops("/metrics").body)
                leaving.close()
                eventually(lambda: d.status()["counters"]["clients_left"] == 1)
                assert [t["frames"] for t in d.ask("/v1/tours").json()["tours"]] == [2]
            finally:
                gate.touch()
            assert first.getresponse().status == 202
            ended(d, uri)
            ended(d, begin(d, body(5))["uri"])
            assert [t["frames"] for t in d.ask("/v1/tours").json()["tours"]] == [2, 5]


def test_a_tour_that_nobody_was_told_of_is_none():
    """Whoever made it leaves, or is told 503, while its tour.json is on the way to the disk: who asks again would have two."""
    preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
    for deadline in (PATIENT, ("--deadline", "2000")):
        with Folder() as folder, Folder() as elsewhere:
            gate = elsewhere / "gate"
            gate.touch()  # for the dataset
            with Daemon(FAKE, "--tours", str(folder), *deadline, LD_PRELOAD=preload, SLOW_DISK_GATE=gate,
                        SLOW_DISK_NAME="tour.json", UV_THREADPOOL_SIZE=1) as d:
                gate.unlink()
                try:
                    if deadline == PATIENT:
                        leaving = d.connect()
                        leaving.request("POST", TOURS, json.dumps(body(2)))
                        eventually(lambda: d.ask("/v1/tours").json()["tours"])
                        leaving.close()
                        eventually(lambda: d.status()["counters"]["clients_left"] == 1)
                    else:  # one whose tour.json is being written, and one whose path is not read yet
                        replies = together(2, lambda i: d.post(body(2 + i), TOURS))
                        assert all(r.status == 503 and "deadline" in r.json()["detail"] for r in replies), replies
                    assert d.ask("/v1/tours").json()["tours"] == []
                finally:
                    gate.touch()
                eventually(lambda: not list(folder.iterdir()))
                assert d.ask("/v1/tours").json() == {"tours": [], "bytes": 0, "bytes_max": 10 << 30}
                if deadline == PATIENT:
                    ended(d, begin(d, body(3))["uri"])
                    assert d.status()["counters"]["tour_frames"] == 3


def test_what_is_removed_while_it_is_read_counts_until_then():
    """No restart takes it up, and the quota has no room for more before its files are gone."""
    settings = {"width": 640, "height": 480, "format": "raw"}
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), "--tour-disk", "20M", FAKE_FRAME_MS=0) as d:
        tour = ended(d, begin(d, body(10, settings=settings))["uri"])
        reader = socket.socket()
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        reader.connect(("127.0.0.1", d.port))
        reader.sendall(f"GET {tour['zip']} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        assert reader.recv(100).startswith(b"HTTP/1.1 200")
        assert d.ask(tour["uri"], "DELETE").status == 204 and not (folder / tour["name"] / "tour.json").exists()
        kept = d.ask("/v1/tours").json()
        assert kept["tours"] == [] and kept["bytes"] > 10 * 640 * 480 * 3, kept
        again = ended(d, begin(d, body(10, settings=settings))["uri"], "failed")
        assert "may" in again["error"] and d.ask(again["uri"], "DELETE").status == 204
        reader.close()
        eventually(lambda: d.ask("/v1/tours").json()["bytes"] == 0 and not list(folder.iterdir()))
        ended(d, begin(d, body(10, settings=settings))["uri"])


def test_a_tour_has_failed_when_its_last_frame_is_written():
    preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
    with Folder() as folder, Folder() as elsewhere:
        gate = elsewhere / "gate"
        gate.touch()  # for the dataset
        with Daemon(FAKE, "--tours", str(folder), "--tour-disk", "60K", LD_PRELOAD=preload, SLOW_DISK_GATE=gate,
                    SLOW_DISK_NAME="000000.raw") as d:
            gate.unlink()
            tour = begin(d, body(6, settings={**SMALL, "format": "raw"}))  # four frames of 12 KiB fit
            try:
                eventually(lambda: d.ask(tour["uri"]).json()["frames_done"] == 3)
                for _ in range(20):  # the fifth frame has been refused by now, or is about to be
                    now = d.ask(tour["uri"]).json()
                    assert (now["state"], now["error"], now["frames_done"]) == ("rendering", None, 3), now
            finally:
                gate.touch()
            tour = ended(d, tour["uri"], "failed")
            assert "61440 bytes" in tour["error"] and tour["frames_done"] == 4, tour
            assert d.ask(tour["frame"].replace("{n}", "0")).status == 200


def test_cancelling_ends_streams_and_removes_files():
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), FAKE_FRAME_MS=20) as d:
        tour = begin(d, body(5000))
        other = begin(d, body(1))
        assert d.ask(tour["zip"]).status == 409 and d.ask(tour["frame"].replace("{n}", "4999")).status == 409
        threads, replies = watch(d, [tour["events"], tour["stream"]])
        eventually(lambda: d.ask(tour["uri"]).json()["frames_done"] > 5)
        status = d.ask(tour["uri"]).json()
        assert status["state"] == "rendering" and status["remaining_s"] > 0 and 0 < status["progress"] < 1
        assert d.view(**SMALL).status == 200  # in between
        assert d.ask(tour["uri"], "DELETE").status == 204 and d.ask(tour["uri"], "DELETE").status == 404
        for thread in threads:
            thread.join(150)
        assert events_of(replies[tour["events"]].body)[-1][0] == "removed"
        assert parts_of(replies[tour["stream"]])
        ended(d, other["uri"])
        eventually(lambda: {p.name for p in folder.iterdir()} == {other["name"]})
        assert d.status()["counters"]["tour_frames"] < 5000


def depth_tour(frames):
    return body(frames, settings={**SMALL, "layer": "depth", "format": "png", "depth_scale": 100})


def test_a_killed_tour_goes_on_with_the_same_bytes():
    with Folder() as folder, Folder() as plain:
        with Daemon(FAKE, "--tours", str(plain)) as d:
            wanted = frames_of(d, ended(d, begin(d, depth_tour(60))["uri"]))
        assert len(set(wanted)) > 30  # the fake renderer's depth follows the eye
        with Daemon(FAKE, "--tours", str(folder), **Hold(allowed=20).environment) as d:
            tour = begin(d, depth_tour(60))
            eventually(lambda: d.ask(tour["uri"]).json()["frames_done"] >= 15)
            d.process.send_signal(signal.SIGKILL)
            d.wait_exit()
        files = {f.name: f.stat().st_ino for f in (folder / tour["name"]).iterdir() if f.name[0] != "."}
        assert 15 <= len(files) - 1 < 60, files
        (folder / "0123456789abcdef").mkdir()  # not understood: a tour that has failed
        (folder / "0123456789abcdef" / "tour.json").write_text("{}")
        (folder / "0123456789abcdef" / "000000.jpg").write_bytes(b"x" * 5000)
        (folder / "00000000000000aa").mkdir()  # a crash while it began
        (folder / ".fedcba9876543210").mkdir()  # half removed
        with Daemon(FAKE, "--tours", str(folder), FAKE_FRAME_MS=20) as d:  # ended by SIGTERM, a stream open
            [stream], _ = watch(d, [tour["events"]])
            eventually(lambda: d.ask(tour["uri"]).json()["frames_done"] > len(files))
            d.log("0123456789abcdef is not understood")
            odd = d.ask("/v1/tours/0123456789abcdef").json()
            assert odd["state"] == "failed" and "tour.json" in odd["error"] and odd["bytes"] == 5002, odd
            for leaf in ("events", "stream", "frames.zip", "frames/0"):
                assert d.ask(f"/v1/tours/0123456789abcdef/{leaf}").status in (200, 404)
            assert d.ask("/v1/tours/0123456789abcdef", "DELETE").status == 204
            eventually(lambda: not (folder / "0123456789abcdef").exists())
            assert d.stop() == 0
            stream.join(150)
        with Daemon(FAKE, "--tours", str(folder)) as d:
            tour = ended(d, tour["uri"])
            assert frames_of(d, tour) == wanted
            after = {f.name: f.stat().st_ino for f in (folder / tour["name"]).iterdir()}
            assert {n: i for n, i in after.items() if n in files and n != "tour.json"} == \
                {n: i for n, i in files.items() if n != "tour.json"}  # not made again
            assert not (folder / ".fedcba9876543210").exists() and not (folder / "00000000000000aa").exists()
        with Daemon(FAKE, "--tours", str(folder)) as d:  # done is done
            assert d.ask(tour["uri"]).json() == tour and frames_of(d, tour)[:2] == wanted[:2]
        lost, emptied, linked = (folder / tour["name"] / f"0000{i}.png" for i in ("07", "08", "09"))
        for path in lost, linked:
            path.unlink()
        emptied.write_bytes(b"")
        linked.symlink_to("000001.png")
        with Daemon(FAKE, "--tours", str(folder)) as d:  # but not where somebody has taken frames away
            tour = d.ask(tour["uri"]).json()
            assert tour["state"] == "failed" and "3 of its 60 frames are gone" in tour["error"], tour
            assert d.ask(tour["frame"].replace("{n}", "6")).body == wanted[6]
            assert all(d.ask(tour["frame"].replace("{n}", str(i))).status == 409 for i in (7, 8, 9))


def test_a_tour_that_was_killed_before_its_end_was_written_is_complete():
    with Folder() as folder:
        with Daemon(FAKE, "--tours", str(folder), **(hold := Hold()).environment) as d:
            video = can_make_video(d)
            tours = [begin(d, body(3, video=made)) for made in (False, True)[:1 + video]]
            files = {folder / tour["name"] / "tour.json": (folder / tour["name"] / "tour.json").read_bytes() for tour in tours}
            hold.allow_all()
            for tour in tours:
                ended(d, tour["uri"])
            d.log("done after 3 of 3 frames", len(tours))
        for file, began in files.items():
            file.write_bytes(began)
        with Daemon(FAKE, "--tours", str(folder)) as d:
            for tour in tours:
                assert ended(d, tour["uri"])["frames_done"] == 3
                rest = "its video is made" if tour["video"] else "it is complete"
                assert len(d.log(f"{tour['name']}: all of its 3 frames are there")) == 1 and rest in d.log(tour["name"])[0], d.lines
            assert not [line for line in d.lines if "goes on at" in line], d.lines


def test_what_is_no_tours_stays():
    """The folder may be an operator's, too: links are not followed, and nothing goes but what a tour writes."""
    with Folder() as folder, Folder() as other, Folder() as whole:
        with Daemon(FAKE, "--tours", str(whole)) as d:
            done = ended(d, begin(d, body(3))["uri"])
        state = json.loads((whole / done["name"] / "tour.json").read_text())
        for name in "precious", "tour.json", "000000.jpg", ".tour.json.1-1":
            (other / name).write_text("{}")
        kept = {p.name for p in other.iterdir()}
        for name in "fedcba9876543210", ".fedcba9876543211", "fedcba9876543212":
            (folder / name).symlink_to(other if name[-1] != "2" else other / "nowhere")
        (folder / "fedcba9876543213").write_text("a file")
        foreign = folder / "fedcba9876543214"
        foreign.mkdir()
        for name in "mine.txt", ".hidden", "000001.jpg":
            (foreign / name).write_text("x")
        shutil.copytree(whole / done["name"], mixed := folder / "fedcba9876543215")
        for name in "notes.txt", ".hidden":
            (mixed / name).write_text("x")
        late = []
        for i, change in enumerate(({"ended": 10**17}, {"ended": 2**63 - 1}, {"created": -1}, {"created": 10**17})):
            late.append(folder / f"aedcba987654321{i}")
            shutil.copytree(whole / done["name"], late[-1])
            (late[-1] / "tour.json").write_text(json.dumps({**state, **change}))
        with Daemon(FAKE, "--tours", str(folder)) as d:
            assert {p.name for p in other.iterdir()} == kept and {p.name for p in foreign.iterdir()} == {"mine.txt", ".hidden", "000001.jpg"}
            assert all((folder / f"fedcba987654321{i}").is_symlink() for i in (0, 2)) and (folder / ".fedcba9876543211").is_symlink()
            assert len([line for line in d.lines if "is left" in line]) >= 4, d.lines
            assert {tour["uri"][-16:] for tour in d.ask("/v1/tours").json()["tours"]} == {p.name for p in late} | {mixed.name}
            for path in late:
                tour = d.ask(f"/v1/tours/{path.name}").json()
                assert tour["state"] == "failed" and "values that no tour has" in tour["error"], tour
                assert d.ask(f"/v1/tours/{path.name}/frames.zip").status in (200, 404, 409)
            assert len(frames_of(d, d.ask(f"/v1/tours/{mixed.name}").json())) == 3
            assert d.ask(f"/v1/tours/{mixed.name}", "DELETE").status == 204
            eventually(lambda: {p.name for p in mixed.iterdir()} == {"notes.txt", ".hidden"})
            d.log(f"{mixed.name} is left")


def test_no_more_frames_are_incomplete_than_there_are():
    """More than are named are only counted: some of these a crash kept from the disk, and they are drawn again."""
    with Folder() as folder:
        with Daemon(FAKE, "--tours", str(folder), FAKE_FRAME_MS=0) as d:
            tour = ended(d, begin(d, body(130))["uri"])
        file = folder / tour["name"] / "tour.json"
        file.write_text(json.dumps({**json.loads(file.read_text()), "incomplete": {"count": 125, "first": list(range(100))}}))
        for i in range(120, 130):
            next((folder / tour["name"]).glob(f"{i:06}.*")).unlink()
        with Daemon(FAKE, "--tours", str(folder)) as d:
            assert d.ask(tour["uri"]).json()["incomplete_frames"] == {"count": 120, "first": list(range(100))}


def test_frames_that_are_not_complete_are_named():
    """A tile of a collection is gone: frames that show it are as it is from afar, and the tour says which, also after a restart."""
    away, near = [[[x + 20, -15, 8], [x + 20, 30, 0]] for x in (-20, 60)]  # eye and target
    path = {"frames": [{"camera": {"eye": eye, "target": target, "fov": 40}} for eye, target in (near, away, away, near, away)]}
    with Folder() as folder, Folder() as tours:
        tiles.make(folder, whole=False)
        (folder / "city/tile-1.spld").unlink()
        with Daemon(REAL, "--tours", tours, datasets=[folder / "city/city.spld"]) as d:
            shown = [d.ask(f"/v1/datasets/city/view?eye={e[0]},{e[1]},{e[2]}&target={t[0]},{t[1]},{t[2]}&fov=40&width=64&height=48").headers
                     for e, t in (near, away)]
            assert [h["Splatd-Complete"] for h in shown] == ["false", "true"], shown
            reply = d.post({"path": path, "settings": SMALL}, "/v1/datasets/city/tours")
            tour = ended(d, reply.json()["uri"])
            assert tour["frames_done"] == 5 and tour["incomplete_frames"] == {"count": 2, "first": [0, 3]}, tour
            assert d.ask("/v1/tours").json()["tours"][0]["incomplete_frames"] == tour["incomplete_frames"]
            eventually(lambda: json.loads((tours / tour["name"] / "tour.json").read_text())["incomplete"] == {"count": 2, "first": [0, 3]})
        assert any("done after 5 of 5 frames, 2 of them not complete" in line for line in d.lines), d.lines
        with Daemon(REAL, "--tours", tours, datasets=[folder / "city/city.spld"]) as d:
            assert d.ask(tour["uri"]).json()["incomplete_frames"] == {"count": 2, "first": [0, 3]}
        (tours / tour["name"] / "000003.jpeg").unlink()  # one that is not there is not known
        with Daemon(REAL, "--tours", tours, datasets=[folder / "city/city.spld"]) as d:
            assert d.ask(tour["uri"]).json()["incomplete_frames"] == {"count": 1, "first": [0]}
        (folder / "path.json").write_text(json.dumps(path))
        told = tiles.splatd("tour", folder / "city/city.spld", "--path", folder / "path.json", "--size", "64x48", "-o", folder / "out")
        assert "2 of 5 frames are not complete (0, 3)" in told, told
        told = tiles.splatd("tour", folder / "city/tile-0.spld", "--path", folder / "path.json", "--size", "64x48", "-o", folder / "out0")
        assert "not complete" not in told, told


def test_what_is_not_understood_counts_against_the_quota():
    with Folder() as folder:
        (folder / "0123456789abcdef").mkdir()
        (folder / "0123456789abcdef" / "tour.json").write_bytes(b"[" * (3 << 20))  # as an older version left one
        with Daemon(FAKE, "--tours", str(folder), "--tour-disk", "2M") as d:
            reply = d.post(body(3), TOURS)
            assert reply.status == 507 and reply.headers["Retry-After"] is None and "remove some" in reply.json()["detail"], reply.body
            assert [tour["name"] for tour in d.ask("/v1/tours").json()["tours"]] == ["0123456789abcdef"]
            assert d.ask("/v1/tours/0123456789abcdef", "DELETE").status == 204
            ended(d, begin(d, body(3))["uri"])


def test_a_lost_device_does_not_end_a_tour():
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder), SPLATD_INJECT_LOSS_AFTER="5x2") as d:
        assert ended(d, begin(d, body(20))["uri"])["frames_done"] == 20


def test_a_full_disk_ends_the_tour_and_nothing_else():
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder)) as d:
        resource.prlimit(d.process.pid, resource.RLIMIT_FSIZE, (8000, 8000))
        tour = ended(d, begin(d, body(6, settings={**SMALL, "format": "raw"}))["uri"], "failed")
        assert "File too large" in tour["error"] and tour["frames_done"] == 0, tour
        assert re.match(r"cannot write '\d{6}.raw': ", tour["error"]) and str(folder) not in tour["error"], tour
        assert not [f for f in (folder / tour["name"]).iterdir() if f.name.endswith("raw")]
        assert d.view(**SMALL).status == 200
        assert ended(d, begin(d, body(2))["uri"])["frames_done"] == 2
        if can_make_video(d):
            tour = ended(d, begin(d, body(400, video=True))["uri"],
                         "failed")
            assert "File too large" in tour["error"] and tour["frames_done"] == 400, tour
            assert str(folder) not in tour["error"], tour
    if os.getuid():
        return  # what follows needs the right to mount
    with Folder() as folder:
        small = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(folder)], stderr=subprocess.DEVNULL)
        if small.returncode:
            return
        try:
            with Daemon(FAKE, "--tours", str(folder)) as d:
                tour = ended(d, begin(d, body(20, settings={**SMALL, "format": "raw"}))["uri"], "failed")
                assert "No space left" in tour["error"] and 0 < tour["frames_done"] < 20, tour
                assert d.ask(tour["uri"], "DELETE").status == 204
                eventually(lambda: not list(folder.iterdir()))
                ended(d, begin(d, body(2))["uri"])
        finally:
            subprocess.run(["umount", str(folder)], check=True)


def test_a_tour_that_the_disk_has_no_room_for_is_none():
    """Its tour.json cannot be written: it was never promised, nothing of it stays, and to come back soon is in vain."""
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder)) as d:
        before = resource.prlimit(d.process.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(d.process.pid, resource.RLIMIT_FSIZE, (100, before[1]))
        reply = d.post(body(2), TOURS)
        assert reply.status == 507 and reply.headers["Retry-After"] is None, (reply.status, reply.body)
        assert "File too large" in reply.json()["detail"] and str(folder) not in reply.json()["detail"], reply.body
        assert d.ask("/v1/tours").json()["tours"] == []
        eventually(lambda: not list(folder.iterdir()) and d.ask("/v1/tours").json()["bytes"] == 0)
        resource.prlimit(d.process.pid, resource.RLIMIT_FSIZE, before)
        folder.rename(folder.with_suffix(".away"))  # no want of room
        try:
            reply = d.post(body(2), TOURS)
        finally:
            folder.with_suffix(".away").rename(folder)
        assert reply.status == 500 and "cannot be made" in reply.json()["detail"], (reply.status, reply.body)
        assert d.ask("/v1/tours").json()["tours"] == []
        ended(d, begin(d, body(2))["uri"])


def test_two_services_do_not_share_a_folder():
    with Folder() as folder, Daemon(FAKE, "--tours", str(folder)):
        second = subprocess.run([FAKE, "--listen", "127.0.0.1:0", "--tours", str(folder), WALL], timeout=150,
                                stderr=subprocess.PIPE, text=True)
        assert second.returncode == 2 and "another service keeps its tours" in second.stderr, second
    for where in ("/proc/none/x", WALL):
        refused = subprocess.run([FAKE, "--listen", "127.0.0.1:0", "--tours", where, WALL], timeout=150,
                                 stderr=subprocess.PIPE, text=True)
        assert refused.returncode and "tours' folder" in refused.stderr, refused


run(globals())
