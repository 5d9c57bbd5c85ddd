"""No request holds up the others: bodies of a whole MiB of every shape to every route that takes one, what tours leave
on disk listed, read and fetched, and in all of it no turn of the loop of 50 ms, nor memory or disk beyond what was said.

A turn is judged by the processor time that it took; by the clock it may have been as much longer as the kernel says that
the loop's thread waited for a processor. Others on the machine change that, too, where they share a core or its host: so
a processor that counts slower than it might may take as much longer, and a stall is one that comes three times of the same."""
import array
import functools
import json
import math
import os
import pathlib
import random
import re
import signal
import socket
import statistics
import tempfile
import time

from harness import FAKE, PATIENCE_S, VIEW, Daemon, counting_s, eventually, run, slower_than_usual

MIB = 1 << 20
TOURS = "/v1/datasets/wall/tours"
SMALL = {"width": 64, "height": 48}
STALL_S, MEMORY = 0.05, 400 * MIB


class Stalled(AssertionError):
    pass


def thrice(test):
    """What stalls in each of its attempts stalls; others on the machine hold up now this and now that. It has also stalled
    when the same that it was busy with has held it up in three of them."""
    @functools.wraps(test)
    def attempt():
        blamed = []
        for left in reversed(range(8)):
            try:
                return test()
            except Stalled as why:
                blamed.append(why.args[0])
                if not left or blamed.count(blamed[-1]) == 3:
                    raise
                print(f"     again: {why}")
    return attempt


def waited_s(d):
    """How long the loop's thread, the first, was ready to run and did not."""
    return int(pathlib.Path(f"/proc/{d.process.pid}/task/{d.process.pid}/schedstat").read_text().split()[1]) / 1e9


def metrics(d):
    """What has no labels."""
    return {name: float(value) for name, value in re.findall(r"^(\w+) (\S+)$", d.ops("/metrics").body.decode(), re.M)}


def peak_bytes(d):
    return int(re.search(r"VmHWM:\s+(\d+) kB", pathlib.Path(f"/proc/{d.process.pid}/status").read_text())[1]) << 10


class Watch:
    """Blames whatever has made a turn longer than any before it."""

    def __init__(self, d):
        self.d, self.told, self.longest, self.counted = d, 0, [], []
        self.by_clock = (0, "")

    def blame(self, what):
        self.counted.append(counting_s())
        got = metrics(self.d)
        busiest = got["splatd_loop_stall_cpu_seconds"]
        self.by_clock = max(self.by_clock, (got["splatd_loop_stall_seconds"], what), key=lambda turn: turn[0])
        if busiest > self.told:
            self.longest.append(f"{what}: {1000 * busiest:.1f} ms")
        self.told = busiest

    def judge(self):
        got = metrics(self.d)
        slower = max(1, statistics.median(self.counted) / 0.0025)
        busiest, longest = got["splatd_loop_stall_cpu_seconds"], got["splatd_loop_stall_seconds"]
        print(f"     turns: {1000 * busiest:.1f} ms of processor time, {1000 * longest:.1f} ms by the clock; {self.longest[-1:]}; "
              f"{peak_bytes(self.d) >> 20} MiB; counts {slower:.2f} times slower")
        if busiest >= STALL_S * slower or longest >= STALL_S * slower + waited_s(self.d):
            what = self.longest[-1].partition(":")[0] if busiest >= STALL_S * slower else self.by_clock[1]
            raise Stalled(what, self.longest, longest, waited_s(self.d), slower)


def filled(head, piece, tail, separator=","):
    """`head`, as many of `piece` as a MiB has room for ('#' is its number), `tail`."""
    pieces, room, i = [], MIB - len((head + tail).encode()), 0
    while room > 0:
        pieces.append(piece.replace("#", str(i)))
        room -= len((pieces[-1] + separator).encode())
        i += 1
    return (head + separator.join(pieces[:-1]) + tail).encode()


def all_shapes():
    """Valid JSON but for what a name says, and nothing that a route would take."""
    for name, piece in {"empty arrays": "[]", "empty objects": "{}", "nested objects": '{"":{}}', "small numbers": "1",
                        "numbers": "0.12345678901234567e-300", "strings": '""', "nothing": "null"}.items():
        yield name, filled('{"camera":[', piece, "]}")
    yield "members", filled("{", '"#":0', "}")
    yield "members that hold objects", filled('{"camera":{', '"#":{}', "}}")
    yield "one member again and again", filled("{", '"camera":{}', "}")
    yield "a name", filled('{"', "a", '":0}', "")
    yield "a string", filled('{"v":"', "a", '"}', "")
    yield "escapes", filled('{"v":"', "\\u00e9", '"}', "")
    yield "a whole number", filled('{"lod":', "7", "}", "")
    yield "a number", filled('{"lod":0.', "7", "}", "")
    yield "a number of zeros", filled('{"lod":0.', "0", "1}", "")
    yield "blanks", filled("{", " ", "}", "")
    yield "lines", filled("{", "\n", "}", "")
    yield "no end", filled("", "[1],", "", "")
    yield "no end of a string", filled('{"', "\\\\", "", "")
    yield "deep", b'{"camera":' + b"[" * 2000 + b"]" * 2000 + b" " * (MIB - 5000) + b"}"
    yield "too deep", b"[" * MIB
    yield "deep again and again", filled('{"camera":[', "[" * 1000 + "]" * 1000, "]}")
    yield "no JSON", os.urandom(MIB)
    yield "views", filled('{"views":[', '{"camera":{"eye":[3,0,1],"target":[0,0,1]},"near":1e-6}', "]}")
    yield "views that hold much", filled('{"width":8,"height":8,"views":[' + "{}," * 255, '{"camera":{"eye":[3]}}', "]}")
    yield "256 views", json.dumps({"width": 8, "height": 8, "format": "png", "views": [
        {"camera": {"eye": [3, 0, 1 + 1e-3 * i], "target": [0, 0, 1], "fov": 60}} for i in range(256)]}).encode()
    for name, differs in ("256 fisheyes", 0), ("256 fisheyes, none like another", 0.1):
        yield name, json.dumps({"width": 8, "height": 8, "format": "png", "views": [
            {"camera": {"eye": [3, 0, 1 + 1e-3 * i], "target": [0, 0, 1], "projection": "fisheye", "fov": 150 + differs * i}} for i in range(256)]}).encode()
    for name, lenses in ("256 views through 16 lenses", 16), ("256 views through as many lenses", 256):
        yield name, json.dumps({"width": 8, "height": 8, "views": [{"camera": {"eye": [3, 0, 1 + 1e-3 * i], "target": [0, 0, 1], "model": "FULL_OPENCV",
            "params": [300, 300, 641, 478, -0.1, 0, 0.06, -0.06, 0.001 + i % lenses * 1e-9, 0, 0, 0]}} for i in range(256)]}).encode()
    around = ",".join(f"{30 * math.cos(a)!r},{30 * math.sin(a)!r}" for a in (i * math.pi / 32 for i in range(64)))
    cut = f"polygon:{around}" + "".join(f" or box:{-math.pi * n!r},{-math.e * n!r},{-math.sqrt(n)!r},{math.pi + n!r},{math.e + n!r},{math.pi / 2 + n!r}" for n in range(1, 16))
    for name in "256 views of much that is cut", "the same again":
        yield name, json.dumps({"width": 8, "height": 8, "format": "png", "clip": cut, "soft": cut, "views": [
            {"camera": {"eye": [3, 0, 1 + 1e-3 * i], "target": [0, 0, 1], "fov": 60}} for i in range(256)]}).encode()


def held_back(d, name, body, path, client=None):
    """A client that has sent all of a POST but its last byte."""
    client = client or socket.create_connection(("127.0.0.1", d.port), PATIENCE_S)
    client.sendall(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nX-Request-Id: {name}\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body[:-1])
    return client


def all_is_read(d):
    """What clients have sent is no longer with the kernel, and the daemon has ended the turn in which it read it."""
    def queued():
        rows = [row.split() for row in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]]
        return [row[4] for row in rows if f":{d.port:04X}" in (row[1][-5:], row[2][-5:]) and row[3] == "01"]
    eventually(lambda: set(queued()) == {"00000000:00000000"})
    assert d.ops("/healthz").status == 200


@thrice
def test_bodies_that_end_at_once_stall_nobody():
    """Of so many a turn of the loop reads few, however few of them there would be time for; the others wait in the order
    in which they came, and who leaves meanwhile is not read."""
    count, gone, most = 48, 12, 3
    body = ('{"views":[' + ",".join(['{"clip":"z<2 and polygon:0,0,1,0,1,1,0,1 and z<1"}'] * 15000) + "]}").encode()
    for path in (VIEW + "s", VIEW):
        with Daemon(FAKE, "--deadline", "600000", FAKE_FRAME_MS=1, MALLOC_PERTURB_=0) as d:
            for _ in range(5):
                assert d.post(body, path).status == 400
            one, slower = metrics(d)["splatd_loop_stall_cpu_seconds"], slower_than_usual()
            clients = [held_back(d, f"held-{i}", body, path) for i in range(count)]
            all_is_read(d)
            d.process.send_signal(signal.SIGSTOP)
            for client in clients:
                client.sendall(body[-1:])
            for client in clients[-gone:]:
                client.close()
            d.process.send_signal(signal.SIGCONT)
            replies = [client.recv(12) for client in clients[:-gone]]
            assert set(replies) == {b"HTTP/1.1 400"}, replies
            busiest = metrics(d)["splatd_loop_stall_cpu_seconds"]
            print(f"     {path}: one body {1000 * one:.1f} ms, {count} at once {1000 * busiest:.1f} ms")
            if busiest > most * one + STALL_S * slower:
                raise Stalled(path, one, busiest, slower)
            eventually(lambda: d.status()["counters"]["clients_left"] == gone)
            refused = d.log(" status=400 ", 5 + count - gone)  # of those that left lines are written, too
            read = [int(held[1]) for line in refused if (held := re.search(r" id=held-(\d+) ", line))]
            assert read == list(range(count - gone)), read
            for client in clients:
                client.close()


def read_replies(client, count, status):
    """The heads of so many; what is left of the last one's body comes with the next."""
    head, got = f"HTTP/1.1 {status}".encode(), b""
    while got.count(head) < count:
        piece = client.recv(1 << 20)
        assert piece, got[-200:]
        got += piece


@thrice
def test_requests_without_bodies_that_come_at_once_stall_nobody():
    """Lists of what there is, a few on each of many connections; and bodies of one byte, of which a turn takes up many."""
    count, each = 600, 5
    for method, path, length, status in ("GET", "/v1/methods", 0, 200), ("POST", VIEW, 1, 400):
        one = f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {length}\r\n\r\n{'{' * length}".encode()
        with Daemon(FAKE, "--deadline", "600000", "--connections", "1000", "--connections-per-address", "1000", "--log-rate", "1") as d:
            slower = slower_than_usual()
            clients = [socket.create_connection(("127.0.0.1", d.port), PATIENCE_S) for _ in range(count)]
            for client in clients:
                client.sendall(one)
                read_replies(client, 1, status)
            before = metrics(d)["splatd_loop_stall_cpu_seconds"]
            d.process.send_signal(signal.SIGSTOP)
            for client in clients:
                client.sendall(one * each)
            d.process.send_signal(signal.SIGCONT)
            for client in clients:
                read_replies(client, each, status)
            busiest = metrics(d)["splatd_loop_stall_cpu_seconds"]
            print(f"     {method} {path}: {1000 * before:.1f} ms one by one, {count * each} at once {1000 * busiest:.1f} ms")
            for client in clients:
                client.close()
            if busiest > before + 2 * STALL_S * slower:
                raise Stalled(path, before, busiest, slower)


def test_bodies_that_end_as_a_drain_does_are_refused():
    """What ends while all that waits is refused can wait no more: libmicrohttpd aborts where it is stopped then."""
    body = ('{"views":[' + ",".join(['{"clip":"z<2 and polygon:0,0,1,0,1,1,0,1 and z<1"}'] * 15000) + "]}").encode()
    deadline_s, grace_s, count = 1, 4, 110
    d = Daemon(FAKE, "--deadline", str(1000 * deadline_s))
    clients = [socket.create_connection(("127.0.0.1", d.port), PATIENCE_S) for _ in range(count)]
    for client in clients:
        client.sendall(b"GET /v1/methods HTTP/1.1\r\nHost: localhost\r\n\r\n")
        read_replies(client, 1, 200)
    d.process.send_signal(signal.SIGTERM)
    ends = time.monotonic() + deadline_s + grace_s
    for i in range(2):  # so that it does not end before
        held_back(d, f"slow-{i}", b"{ ", VIEW, clients[i])
        time.sleep(1.4)  # whoever is silent for two seconds is cut meanwhile
    time.sleep(max(0, ends - 1.8 - time.monotonic()))
    for i, client in enumerate(clients[2:]):
        held_back(d, f"held-{i}", body, VIEW + "s", client)
    time.sleep(max(0, ends - 0.25 - time.monotonic()))
    for client in clients[2:]:  # faster than they are read
        try:
            client.sendall(body[-1:])
        except OSError:
            break
        time.sleep(0.005)
    assert d.wait_exit() == 0, d.lines[-1]
    for client in clients:
        client.close()


def paths():
    """Bodies of tours: each format, as much of it as a MiB holds; and what no format looks at, refused where it is much."""
    settings = f'"settings":{json.dumps(SMALL)},"frames":100000'
    matrix = "[1.0,0.0,0.0,3.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0,1.0,0.0,0.0,0.0,1.0]"
    yield "keyframes", filled('{%s,"path":{"keyframes":[' % settings, '{"camera":{"eye":[3,0,1],"target":[0,#,1]}}', "]}}")
    yield "frames", filled('{%s,"path":{"frames":[' % settings, '{"camera":{"eye":[3,0,1],"target":[0,#,1]}}', "]}}")
    yield "one keyframe", json.dumps({"path": {"keyframes": [{"camera": {"eye": [3, 0, 1], "target": [0, 0, 1]}}]}, "frames": 100000, "settings": SMALL}).encode()
    yield "nerfstudio", filled('{%s,"path":{"render_width":64,"render_height":48,"camera_path":[' % settings,
                               '{"camera_to_world":%s,"fov":60}' % matrix, "]}}")
    yield "Open3D", filled('{%s,"path":{"parameters":[' % settings,
                           '{"extrinsic":[1,0,0,0,0,1,0,0,0,0,1,0,#,2,3,1],"intrinsic":{"width":64,"height":48,'
                           '"intrinsic_matrix":[50,0,0,0,50,0,31.5,23.5,1]}}', "]}}")
    yield "COLMAP", filled('{%s,"path":{"cameras_txt":"1 PINHOLE 64 48 50 50 32 24\\n","images_txt":"' % settings,
                           "1# 1 0 0 0 0 0 0 1 #\\n\\n", '"}}', "")
    yield "TUM", filled('{%s,"path":"' % settings, "# 0 0 # 0 0 0 1\\n", '"}', "")
    small = '{%s,"path":{"camera_type":"perspective","render_width":64,"render_height":48,"camera_path":[{"camera_to_world":%s,"fov":60}],' \
        '"keyframes":' % (settings, matrix)
    yield "idle and deep", filled(small + "[", "[" * 1000 + "1" + "]" * 1000, "]}}")
    yield "idle and deepest", (small + "[" * 2040 + ",".join("1" * 500000) + "]" * 2040 + "}}").encode()
    yield "idle arrays", filled(small + "[", "[]", "]}}")
    yield "idle objects", filled(small + "[", '{"":{}}', "]}}")
    yield "ignored members", filled(small + "{", '"#":0', "}}}")
    yield "ignored text", filled(small + '"', "\\\"", '"}}', "")


@thrice
def test_bodies_of_a_mib_stall_nobody():
    with tempfile.TemporaryDirectory(prefix="splatd-tours-") as folder, Daemon(FAKE, "--tours", folder, "--deadline", "60000") as d:
        watch, shapes = Watch(d), list(all_shapes())
        for path in (VIEW, VIEW + "s", VIEW.replace("view", "pick"), TOURS):
            for name, body in shapes:
                assert len(body) <= MIB, name
                reply = d.post(body, path)
                assert reply.status in (200, 400), (path, name, reply.status)
                assert "number" not in name or path == TOURS or b"the limit" in reply.body, (name, reply.body)
                watch.blame(f"{name} to {path}")
        assert d.ask("/v1/datasets/wall", "PUT", os.urandom(MIB)).status in (403, 401)
        watch.blame("PUT")
        watch.judge()
        assert not os.listdir(folder) and peak_bytes(d) < MEMORY, peak_bytes(d) / MIB


@thrice
def test_paths_of_a_mib_stall_nobody():
    with tempfile.TemporaryDirectory(prefix="splatd-tours-") as folder, Daemon(FAKE, "--tours", folder, "--tour-frames", "100000", "--tour-pixels", "1000000000",
                                    "--deadline", "60000") as d:
        watch = Watch(d)
        for name, body in paths():
            assert len(body) <= MIB, name
            reply = d.post(body, TOURS)
            watch.blame(name)
            assert reply.status == (400 if name.startswith("idle") else 202), (name, reply.status, reply.body)
            if reply.status == 400:
                continue
            tour = reply.json()
            assert tour["frames"] == 100000, (name, tour)
            eventually(lambda: pathlib.Path(folder, tour["name"], "tour.json").exists())
            assert pathlib.Path(folder, tour["name"], "tour.json").stat().st_size < 2 * MIB + 4096, name
            assert d.ask(tour["uri"], "DELETE").status == 204
            watch.blame(name + ", deleted")
        watch.judge()
        eventually(lambda: not os.listdir(folder))
        assert peak_bytes(d) < MEMORY, peak_bytes(d) / MIB


def lists():
    """Bodies of a million rays, NPY and what becomes of it; as many as JSON holds; and what is wrong at their ends."""
    million, most = 1 << 20, 1 << 15
    rng = random.Random(5)
    directions = array.array("d", [rng.uniform(-1, 1) for _ in range(3 * million)])  # all around, in no order
    header = "{'descr': '<f%d', 'fortran_order': %s, 'shape': (%d, 3), }"

    def body(kind, order="False", numbers=directions):
        text = (header % (8 if kind == "d" else 4, order, len(numbers) // 3)).ljust(117) + "\n"
        return b"\x93NUMPY\x01\x00v\x00" + text.encode() + (numbers if kind == "d" else array.array("f", numbers)).tobytes()
    broken = directions[:]
    broken[-1] = math.nan
    double, kind = body("d"), "application/x-npy"
    for name, sent, query, status in (
            ("doubles", double, "", 200), ("doubles, sent again", double, "", 200),
            ("floats by columns", body("f", "True"), "&frame=world&resolution=1000&format=raw", 200),
            ("every layer as ZIP", double, "&layers=range,color,normal,id,coverage,primitive&container=zip", 200),
            ("a million as JSON", double, "&format=json", 400), ("no number at the end", body("d", numbers=broken), "", 400),
            ("cut off", double[:-1], "", 400), ("too many", body("d", numbers=directions + directions[:3]), "", 400)):
        yield name, sent, query, kind, status
    listed = json.dumps({"camera": {"eye": [3, 0, 1], "target": [0, 0, 1]}, "format": "json", "layers": ["range", "color", "normal"],
                         "directions": [[round(x, 5) for x in directions[3 * i:3 * i + 3]] for i in range(most)]}).encode()
    spoiled = json.dumps({"directions": [[1, 0, 0]] * (most - 1) + [[1, 0, None]]}).encode()
    for name, sent, status in (("JSON", listed, 200), ("JSON, spoiled at its end", spoiled, 400), ("JSON of blanks", b" " * MIB, 400)):
        yield name, sent.ljust(MIB - 1), "", "application/json", status


@thrice
def test_a_million_rays_stall_nobody():
    # Meson has malloc() fill what it gives: a long body's room, which is there at once and filled as the body comes
    with Daemon(FAKE, "--deadline", "60000", FAKE_FRAME_MS=1, MALLOC_PERTURB_=0) as d:
        watch = Watch(d)
        for name, body, query, kind, status in lists():
            where = VIEW.replace("view", "rays") + ("" if kind.endswith("json") else f"?eye=3,0,1&target=0,0,1{query}")
            reply = d.ask(where, "POST", body, {"Content-Type": kind})
            assert reply.status == status, (name, reply.status, reply.body[:300])
            watch.blame(name)
        watch.judge()
        assert peak_bytes(d) < MEMORY, peak_bytes(d) / MIB


def keep(folder, number, frames, kind="png", files=1, bytes=100, **more):
    """A tour that has ended, as it lies on disk."""
    home = pathlib.Path(folder, f"{number:016x}")
    home.mkdir()
    state = {"format_version": 2, "dataset": "wall", "version": "0" * 16, "state": "done", "created": 1700000000 + number,
             "ended": int(time.time()), "frames": frames, "width": 8192, "height": 8192, "fps": 30.0, "layers": 1,
             "format": kind, "video": False, "failure": None, "body": None}
    for i in range(files):
        if not i:
            with open(home / f"{i:06}.{kind}", "wb") as file:
                file.truncate(bytes)
        else:  # names of one file: thousands of new ones take longer than all that is looked at here
            os.link(home / f"{0:06}.{kind}", f"{home}/{i:06}.{kind}")
    (home / "tour.json").write_text(json.dumps({**state, **more}))
    return f"/v1/tours/{home.name}"


def length_of(d, uri):
    """Reads a reply to its end and forgets it."""
    connection = d.connect()
    connection.request("GET", uri)
    reply, length = connection.getresponse(), 0
    assert reply.status == 200, reply.status
    while piece := reply.read(MIB):
        length += len(piece)
    connection.close()
    return length


@thrice
def test_what_tours_leave_stalls_nobody():
    frame = 192 * MIB
    with tempfile.TemporaryDirectory(prefix="splatd-tours-") as folder:
        large = keep(folder, 0, 3, files=3, bytes=frame)
        many = keep(folder, 1, 20000, files=20000, bytes=1)
        for number in range(2, 1000):
            keep(folder, number, 10000)
        with Daemon(FAKE, "--tours", folder, "--connections", "64") as d:
            watch = Watch(d)
            watch.blame("the start")
            assert len(d.ask("/v1/tours").json()["tours"]) == 1000
            watch.blame("a list of a thousand")
            assert length_of(d, large + "/frames.zip") > 3 * frame
            watch.blame("a ZIP of large frames")
            assert length_of(d, many + "/frames.zip") > 20000 * 100
            watch.blame("a ZIP of many frames")
            assert length_of(d, large + "/stream") > 3 * frame
            watch.blame("a stream of large frames")
            assert length_of(d, large + "/frames/2") == frame
            watch.blame("a large frame")
            for uri in (large, many):
                assert d.ask(uri, "DELETE").status == 204
            watch.blame("removing them")
            eventually(lambda: len(os.listdir(folder)) == 998)
            watch.judge()
            assert peak_bytes(d) < MEMORY / 2, peak_bytes(d) / MIB


run(globals())
