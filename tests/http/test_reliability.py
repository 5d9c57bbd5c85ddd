"""What nothing may take down: random requests, clients that leave in the middle of a reply, bodies without an end, a clock
that jumps, a dataset that is cut while it is served, days of work. deploy/operating.md says what each looks like from outside.

By option, through the environment: SPLATD_RANDOM_REQUESTS=100000 (2000), SPLATD_RANDOM_SEED=N, SPLATD_SOAK_S=1800 (1).
A soak of any length judges what a request leaves behind; from 1800 s on also what an hour does."""
import json
import os
import re
import random
import select
import shutil
import socket
import struct
import subprocess
import tempfile
import threading
import time

from harness import FAKE, REAL, SANITIZED, VIEW, WALL, Daemon, Skipped, eventually, run, slower_than_usual, together
from random_requests import random_request

WALL_2 = os.environ["SPLATD_WALL_2"]
SMALL = VIEW + "?width=16&height=16"
SILENT_S = 5  # after so long whoever sends nothing gives way


def garbage(r, d):
    """Bytes that are no HTTP, or a part of some; then away."""
    data = r.choice([lambda: bytes(r.randrange(256) for _ in range(r.randrange(300))),
                     lambda: f"GET {SMALL} HTTP/1.1\r\nHost: localhost\r\n".encode()[:r.randrange(60)],
                     lambda: f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {r.randrange(999)}\r\n\r\n{{".encode(),
                     lambda: f"GET {SMALL} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode() * r.randrange(1, 20),
                     lambda: b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n" + b"zz\r\n" * r.randrange(9)])()
    try:
        with socket.create_connection(("127.0.0.1", d.port), 30) as s:
            if r.random() < 0.3:
                s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            s.sendall(data)
            if r.random() < 0.3:
                s.settimeout(0.05)
                s.recv(100)
    except OSError:
        pass


def test_random_requests():
    count, seed = int(os.environ.get("SPLATD_RANDOM_REQUESTS", 2000)), int(os.environ.get("SPLATD_RANDOM_SEED", 1))
    r, seen = random.Random(seed), {}
    with Daemon(FAKE, "--log-rate", "0", FAKE_FRAME_MS=0) as d:
        connection = d.connect()
        for i in range(count):
            if i % 20 == 19:
                garbage(r, d)
                continue
            method, target, headers, body = random_request(r)
            try:
                reply = d.ask(target, method, body, headers, connection=connection)
            except AssertionError as fault:
                raise AssertionError(f"request {i} of seed {seed}: {method} {target[:500]} {headers} {body}\n{fault}") from None
            except OSError:  # closed after a reply, which HTTP allows
                connection.close()
                continue
            seen[reply.status] = seen.get(reply.status, 0) + 1
            assert reply.status < 500 or reply.status in (501, 503), (i, target, reply.status, reply.body)
        assert d.ask(SMALL).status == 200 and d.ops("/healthz").status == 200
    print(f"  {count} requests, seed {seed}: {dict(sorted(seen.items()))}")
    assert sum(seen.values()) > 0.9 * 0.95 * count and seen[200] > 0.03 * count and seen[400] > 0.03 * count, seen


def test_clients_that_leave_in_the_middle_of_a_reply():
    def descriptors():
        return len(os.listdir(f"/proc/{d.process.pid}/fd"))
    with Daemon(FAKE, "--cache", "0", FAKE_FRAME_MS=0) as d:
        assert d.ask(SMALL).status == 200
        before, all_wait = descriptors(), threading.Barrier(8)

        def leave(i):
            s = socket.create_connection(("127.0.0.1", d.port), 60)
            s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            s.sendall(f"GET {VIEW}?width=1600&height=900&format=raw HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            assert s.recv(1000).startswith(b"HTTP/1.1 200")
            all_wait.wait(60)
            if i == 0:
                assert d.status()["memory"]["reply_bytes"] >= 1600 * 900 * 4, "nobody waits in the middle of a reply"
            all_wait.wait(60)
            if i % 2:
                s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            s.close()
            return True
        assert all(result is True for _ in range(4) for result in together(8, leave))
        assert d.ask(SMALL).status == 200
        eventually(lambda: d.status()["memory"]["reply_bytes"] == 0)
        eventually(lambda: descriptors() <= before + 1)
        assert d.ops("/healthz").status == 200


def test_bodies_on_their_way_have_memory_together():
    """Clients that send all but the last byte of a MiB: 128 MiB are kept, whatever they all do then; small ones get in."""
    small = json.dumps({"width": 16, "height": 16}).encode()
    body = small[:-1] + b" " * ((1 << 20) - len(small)) + b"}"
    too_slow = Skipped(f"128 MiB take longer than {SILENT_S} s to send, and whoever is silent for so long gives way")

    def hold(d, count, length=len(body) - 1):
        held = []
        for _ in range(count):
            held.append(socket.create_connection(("127.0.0.1", d.port), 60))
            held[-1].sendall(f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body[:length])
        return held

    def fill(d):
        began, held = time.monotonic(), hold(d, 140)
        while d.post(body).status != 503:  # who was refused for one of these does not come again
            held += hold(d, 2)
            if time.monotonic() - began > 60:
                raise too_slow
            assert len(held) < 800 or time.monotonic() - began > SILENT_S, "nobody is refused"
        return held

    def finish(held):
        heads = []
        for s in held:
            s.sendall(body[-1:])
            heads.append(s.recv(4096))
            s.close()
        return heads

    def all_are_taken(d):
        for _ in range(2 if os.environ["SPLATD_SANITIZER"] == "thread" else 5):
            began, taken = time.monotonic(), all(head.startswith(b"HTTP/1.1 200 ") for head in finish(hold(d, 128)))
            if taken or time.monotonic() - began < SILENT_S:
                return taken
        raise too_slow
    with Daemon(FAKE, FAKE_FRAME_MS=0) as d:
        began = time.monotonic()
        assert all_are_taken(d)
        if os.environ["SPLATD_SANITIZER"] == "thread" and time.monotonic() - began > SILENT_S:  # others may be luckier
            raise too_slow
        for _ in range(5):
            began, held = time.monotonic(), fill(d)
            assert d.post(small).status == 200 and d.post(small[:-1] + b" " * 60000 + b"}").status == 200
            heads = finish(held)
            if quick := time.monotonic() - began < SILENT_S:
                break  # or some have given way, as they were silent for long
            eventually(lambda: all_are_taken(d))
        taken = [head for head in heads if head.startswith(b"HTTP/1.1 200 ")]
        refused = [head for head in heads if head.startswith(b"HTTP/1.1 503 ")]
        if quick:
            assert 120 <= len(taken) <= 128 and len(taken) + len(refused) == len(heads), (len(taken), len(refused))
        assert all(b"\r\nRetry-After: " in head and b"application/problem+json" in head for head in refused), refused[0]
        assert d.post(body).status == 200 and all_are_taken(d)
        for s in hold(d, 150):  # away
            s.close()
        eventually(lambda: all_are_taken(d))
        too_long = []
        for _ in range(20):  # 413, and cut
            s = socket.create_connection(("127.0.0.1", d.port), 60)
            s.sendall(f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n200000\r\n".encode() + bytes(2 << 20))
            too_long.append(s)
        assert d.post(b"[" + body[1:]).status == 400 and d.post(body, VIEW.replace("wall", "none")).status == 404
        eventually(lambda: all_are_taken(d))
        for s in too_long:
            s.close()
        for _ in range(5):  # after 10 s all are cut, which is no giving way: where we were not run meanwhile, again
            held = fill(d)
            eventually(lambda: d.post(body).status == 200)  # who fell silent for 5 s gives way
            told = [s.recv(4096) for s in select.select(held, [], [], 150)[0]]  # its reply may be on its way yet
            assert told and all(head.split(b"\r\n")[0].startswith(b"HTTP/1.1 408 ") for head in told), told
            for s in held:
                s.close()
            if any(b"which another request wants" in head for head in told):
                break
        else:
            raise AssertionError(told[0])
        eventually(lambda: all_are_taken(d))


def resident_kb(d):
    with open(f"/proc/{d.process.pid}/status") as file:
        return int(re.search(r"VmRSS:\s*(\d+)", file.read())[1])


def las(wkt):
    """A scan of four points, version 1.4, whose coordinate system is described at length."""
    points = b"".join(struct.pack("<3iH4BhHd", x, y, 0, 0, 17, 0, 2, 0, 0, 0, 0) for x in (0, 100) for y in (0, 100))
    record = struct.pack("<H16sHH32s", 0, b"LASF_Projection", 2112, len(wkt), b"") + wkt
    begin = struct.pack("<4sHH16s2B32s32sHHHIIBHI5I", b"LASF", 0, 16, b"", 1, 4, b"", b"", 1, 2026, 375, 375 + len(record), 1, 6, 30, 0, *[0] * 5)
    bounds = struct.pack("<12d", .01, .01, .01, 0, 0, 0, 1, 0, 1, 0, 0, 0)
    return begin + bounds + struct.pack("<QQI16Q", 0, 0, 0, 4, 4, *[0] * 14) + record + points


def test_what_all_are_told_is_held_once():
    """60 clients that ask what there is, 200 datasets that have much to say, and read nothing of it."""
    utm = (b'PROJCS["' + b"site " * 6000 + b'",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
           b'UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],'
           b'PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]')
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/scan.las", "wb") as file:
            file.write(las(utm))
        subprocess.run([REAL, "pack", f"{folder}/scan.las", "-o", f"{folder}/tile-0.spld"], check=True, capture_output=True)
        for i in range(1, 200):
            os.link(f"{folder}/tile-0.spld", f"{folder}/tile-{i}.spld")
        with Daemon(FAKE, datasets=[folder]) as d:
            whole, held = d.ask("/v1/datasets").body, []
            began_s = d.processor_s()
            for _ in range(5):
                assert d.ask("/v1/datasets").body == whole
            five_s = d.processor_s() - began_s
            assert len(json.loads(whole)["datasets"]) == 200 and len(whole) > 6e6, len(whole)
            before, began_s = resident_kb(d), d.processor_s()
            for _ in range(60):
                held.append(socket.socket())
                held[-1].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                held[-1].connect(("127.0.0.1", d.port))
                held[-1].sendall(b"GET /v1/datasets HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            eventually(lambda: d.status()["connections"] > 60)
            assert (took_s := d.processor_s() - began_s) < 2 * five_s, (took_s, five_s)  # made once for all who had asked
            assert SANITIZED or resident_kb(d) - before < 60000, (resident_kb(d), before)  # 360 MB in copies
            got = b"".join(iter(lambda: held[0].recv(1 << 20), b""))
            assert got.startswith(b"HTTP/1.1 200 ") and got.endswith(b"\r\n\r\n" + whole), got[:500]
            for s in held:
                s.close()


def test_a_clock_that_jumps():
    preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_CLOCK"]]))
    with Daemon(FAKE, "--queue", "2", "--deadline", "60000", LD_PRELOAD=preload, FAKE_FRAME_MS=100) as d:
        assert d.ask(SMALL).status == 200
        statuses = [reply.status for reply in together(6, lambda i: d.ask(SMALL))]
        assert set(statuses) <= {200, 503} and 200 in statuses, statuses
        keep = d.connect()
        for _ in range(5):  # neither closed as idle nor past any deadline
            assert d.ask(SMALL, connection=keep).status == 200
        assert d.ops("/healthz").status == d.ops("/readyz").status == 200
        status = d.status()
        assert 0 < status["uptime_s"] < 600 and status["counters"]["deadline_missed"] == 0
        days = {line[:10] for line in d.lines}
        assert len(days) > 1, ("the clock did not jump", days)


PAGES = 65536  # bytes, where the first page of a small dataset begins


def test_a_dataset_that_is_cut_or_overwritten_while_served():
    for damage in ("cut", "overwrite"):
        with tempfile.TemporaryDirectory() as folder:
            a, b = (os.path.join(folder, name) for name in ("a.spld", "b.spld"))
            shutil.copy(WALL, a)
            shutil.copy(WALL_2, b)
            with Daemon(REAL, "--watch", "0", "--cache", "0", datasets=[a, b], SPLATD_INJECT_LOSS_AFTER="3") as d:
                def view(name, **kw):
                    return d.ask(f"/v1/datasets/{name}/view?width=16&height=16", **kw)
                whole = view("a").body
                pick = "/v1/datasets/a/pick?eye=3,0,0.5&target=0,0,0.5&fov=50&width=64&height=48&x=32.5&y=24.5"
                with open(a, "r+b") as file:
                    if damage == "cut":
                        file.truncate(300)
                    else:
                        file.seek(PAGES)
                        file.write(b"\xff" * 4000)
                assert view("a").body == whole, "what is on the device is as good as before"
                found = d.ask(pick)  # its class is read from the file
                assert found.status == 200 and found.json()["position"] and found.json()["splat"] is not None, found.body
                assert view("b").status == 503  # the device is lost, so that pages must be read anew
                eventually(lambda: d.ops("/readyz").status == 200)
                assert view("b").status == 200
                for reply in (view("a"), d.ask("/v1/datasets/a/view", "POST", "{}", {"Content-Type": "application/json"}),
                              d.post({"directions": [[0, 0, 1]]}, "/v1/datasets/a/rays"),
                              d.ask("/v1/datasets/a/thumbnail.jpg"), d.ask("/v1/datasets/a/tiles/0/0/0.png")):
                    assert reply.status == 500 and "rename" in reply.json()["detail"], reply.body
                    assert folder not in reply.json()["detail"], "a client is told where the file lies"
                assert view("b").status == 200 and d.ops("/healthz").status == 200


def slope(samples):
    """Least squares through (x, y)."""
    n, mean_x, mean_y = len(samples), *(sum(column) / len(samples) for column in zip(*samples))
    spread = sum((x - mean_x) ** 2 for x, _ in samples)
    return sum((x - mean_x) * (y - mean_y) for x, y in samples) / spread if n > 2 and spread else 0


def test_soak():
    seconds, r = float(os.environ.get("SPLATD_SOAK_S", 1)), random.Random(1)
    # AddressSanitizer keeps what is freed for a while
    asan = os.environ.get("ASAN_OPTIONS", "") + ":quarantine_size_mb=1:thread_local_quarantine_size_kb=64"
    with Daemon(REAL, "--log-rate", "0", "--cache", "1M", ASAN_OPTIONS=asan) as d:
        connection, memory, descriptors, asked = d.connect(), [], [], 0
        picture = f"{VIEW}?width=320&height=180&format=png"
        first = d.ask(picture, connection=connection)
        for _ in range(20):
            d.ask(picture, connection=connection)
        began = time.monotonic()
        while (now := time.monotonic() - began) < seconds or len(memory) < 15:
            for _ in range(20):
                query = f"eye={r.uniform(2, 5)},{r.uniform(-1, 1)},{r.uniform(0, 2)}&target=0,0,1&width=160&height=90"
                layer = r.choice(["color", "depth&format=npy", "normal&format=raw", "range&format=png"])
                assert d.ask(f"{VIEW}?{query}&layer={layer}", connection=connection).status == 200
                assert d.ask(f"{VIEW}?{query}&lod=-1", connection=connection).status == 400
                asked += 2
            d.ask(SMALL)  # a connection of its own
            assert d.ask(f"{VIEW.replace('view', 'pick')}?x=9&y=9&{query}", connection=connection).status == 200
            assert d.ask(picture, headers={"If-None-Match": first.headers["ETag"]}, connection=connection).status == 304
            views = [{"camera": {"eye": [3, r.uniform(-1, 1), 1]}} for _ in range(3)]
            assert d.post({"width": 16, "height": 16, "views": views}, VIEW + "s").status == 200
            assert d.ops("/metrics").status == 200
            asked += 5
            memory.append((now, d.status()["memory"]["resident_bytes"]))
            descriptors.append((now, len(os.listdir(f"/proc/{d.process.pid}/fd"))))
        assert d.ask(picture, connection=connection).body == first.body, "the last picture differs from the first"
        turns = dict(re.findall(r"(?m)^splatd_loop_stall_(cpu_seconds|seconds) ([\d.e+-]+)$", d.ops("/metrics").body.decode()))
        steady = len(memory) // 3  # allocators and drivers settle first
        grown, opened = slope(memory[steady:]) * 3600, slope(descriptors[steady:]) * 3600
        sixths = ", ".join(f"{memory[i * (len(memory) - 1) // 6][1] / 1e6:.2f}" for i in range(7))
        print(f"  {asked} requests in {seconds:.0f} s: memory {grown / 1e6:+.2f} MB/h, descriptors {opened:+.2f}/h, "
              f"resident MB at the start and after each sixth: {sixths}")
        print(f"  the loop's longest turn: {float(turns['seconds']) * 1000:.1f} ms by the clock, "
              f"{float(turns['cpu_seconds']) * 1000:.1f} ms of processor time", flush=True)
        assert SANITIZED or float(turns["cpu_seconds"]) < 0.05 * max(1, slower_than_usual()), turns
        leaked = (memory[-1][1] - memory[steady][1] - (2 << 20)) / (asked * (1 - steady / len(memory)))
        print(f"  {max(leaked, 0):.0f} bytes of memory a request beyond 2 MiB", flush=True)
        # A picture of 160 x 90 has 57,600; AddressSanitizer keeps books of its own, and is given a second. Those of
        # ThreadSanitizer are four times what our code has ever touched: a part of a buffer that is touched late looks
        # like a leak of five times its size, and says nothing of ours. The other builds judge the same code.
        if os.environ["SPLATD_SANITIZER"] != "thread":
            assert leaked < (16384 if SANITIZED else 4096), (leaked, memory)
        assert descriptors[-1][1] <= descriptors[steady][1] + 2, descriptors  # a connection may still be closing
        if seconds >= 1800:  # glibc takes and gives in steps of 128 KiB, each 1.7 MB/h over ten minutes, 0.6 over thirty
            assert grown < 2e6 and abs(opened) < 1, (grown, opened)


run(globals())
