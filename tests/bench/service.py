"""The figures of RESULTS.md about the service under load, one subcommand each, on the scan that measure.py takes.

usage: service.py cached|saturation|overload|throughput|devices|spread|connections|tours [FRAMES]

Prints what was measured and how it stands to its bound; exit 1 beyond one, 77 without the data. What is bounded is a
ratio of one run, or processor time: machines are shared and change within minutes. Where two programs are compared
(throughput, tours), both are alive at once and run by turns of two seconds, the other one stopped.

environment: as for measure.py
"""
import contextlib
import http.client
import json
import os
import pathlib
import re
import resource
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from measure import CACHE, DATA, SPLATD, beyond, bound, free_port, get, packed, scan, view_query

TURN_S = 2
FRESH = iter(range(1, 10**9))


def fresh(path):
    """The same view as `path`, which no cache holds."""
    return f"{path}&margin={1 + next(FRESH) * 1e-7:.7f}"


class Service:
    """with Service() as s: a daemon that serves the scan, once it answers."""

    def __init__(self, *arguments, **environment):
        self.port, self.ops = free_port(), free_port()
        self.process = subprocess.Popen([SPLATD, "serve", "--listen", f"127.0.0.1:{self.port}", "--ops-listen",
                                         f"127.0.0.1:{self.ops}", "--quiet", *arguments, packed(scan(), "grenoble")],
                                        env={**os.environ, **environment})
        self.pid = self.process.pid

    def status(self):
        return json.loads(get(self.port, "/v1/status")[2])

    def resident(self):
        return self.status()["memory"]["resident_bytes"]

    def __enter__(self):
        while True:
            with contextlib.suppress(OSError):
                if get(self.port, "/v1/status")[0] == 200:
                    return self
            if self.process.poll() is not None:
                sys.exit("the daemon has ended")
            time.sleep(0.05)

    def __exit__(self, *rest):
        self.process.send_signal(signal.SIGCONT)
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(60)


def processor_s(pid):
    """Of a process that lives: user and system time."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wrk(service, path, *headers):
    """Over 16 connections that stay, medians of three times 5 s: requests a second, and microseconds of the daemon's
    processor time a request, which a busy machine changes less."""
    rates, costs = [], []
    for _ in range(3):
        command = ["wrk", "-t", "1", "-c", "16", "-d", "5s", *headers, f"http://127.0.0.1:{service.port}{path}"]
        used = processor_s(service.pid)
        said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        used = processor_s(service.pid) - used
        if "Non-2xx" in said or "Socket errors" in said:
            sys.exit(f"wrk {path}: {said}")
        rates.append(float(re.search(r"Requests/sec:\s+([\d.]+)", said)[1]))
        costs.append(1e6 * used / int(re.search(r"(\d+) requests in", said)[1]))
    return statistics.median(rates), statistics.median(costs)


def cached():
    """What is not rendered: hits and 304s."""
    with Service() as s:
        status, headers, body, _ = get(s.port, view_query(0))
        small = view_query(0).replace("width=1280&height=720", "width=320&height=180")
        size = len(get(s.port, small)[2])
        print(f"a view of 1280x720 has {len(body)} bytes, one of 320x180 {size}")
        for what, (rate, cost), least in (
                ("304s", wrk(s, view_query(0), "-H", f"If-None-Match: {headers['ETag']}"), 20000),
                ("hits of 320x180", wrk(s, small), 15000), ("hits of 1280x720", wrk(s, view_query(0)), 15000)):
            print(f"{what}: {rate:.0f}/s, {1e6 / cost:.0f} a second of processor time; wanted {least}")
            bound(f"{what}, processor time a request", cost, 1e6 / least, "us")


def rendering_s(service):
    """Seconds that the gpu thread has spent on views since start."""
    name = 'splatd_frame_duration_seconds_sum{route="/v1/datasets/{id}/view"} '
    lines = get(service.ops, "/metrics")[2].decode().splitlines()
    return float(next(line for line in lines if line.startswith(name))[len(name):])


def ask_all(port, paths, clients, answered=lambda: None):
    """GETs every path, by that many clients at once, each one after the other; each must be a 200."""
    paths, lock, wrong = iter(paths), threading.Lock(), []

    def work():
        while not wrong:
            with lock:
                path = next(paths, None)
            if path is None:
                return
            status = get(port, path)[0]
            if status != 200:
                wrong.append(f"a view failed with {status}")
            answered()
    threads = [threading.Thread(target=work) for _ in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if wrong:
        sys.exit(wrong[0])


def saturation():
    """How much of the time the device has nothing to do while four clients wait."""
    idle, count = [], 40
    with Service("--cache", "0") as s:
        get(s.port, view_query(0))
        for _ in range(7):
            before, begin = rendering_s(s), time.monotonic()
            ask_all(s.port, [view_query(i / count) for i in range(count)], 4)
            idle.append(100 * (1 - (rendering_s(s) - before) / (time.monotonic() - begin)))
    print(f"{count} views of 1280x720 for 4 clients, seven times; not rendering: " + ", ".join(f"{x:.1f}" for x in idle)
          + " % of the time")
    bound("the gpu thread idles while requests wait, median", statistics.median(idle), 5, "%")


def overload():
    """Views that no cache holds, at four times the rate that they are made at, for a minute."""
    with Service("--cache", "0") as s:  # which would fill up to its own limit: 40 MiB of 1,000 views
        small = view_query(0.3).replace("width=1280&height=720", "width=640&height=360")
        alone = []
        for _ in range(20):
            begin = time.monotonic()
            if get(s.port, fresh(small))[0] != 200:
                sys.exit("a view failed without load")
            alone.append(time.monotonic() - begin)
        flood(s, small, 60, statistics.median(alone) / 4)


def in_frame_times(replies):
    """How long each 200 took, in mean times of the frames that were made meanwhile: the machine's pace changes."""
    ended = sorted((end, frame) for *_, end, frame in replies if frame)
    for status, _, ms, end, frame in replies:
        if status == 200:
            meanwhile = [f for e, f in ended if end - ms / 1e3 <= e <= end]
            yield ms / statistics.mean(meanwhile)


def flood(s, path, seconds, gap):
    replies, threads = [], []

    def ask(path):
        try:
            status, headers, _, ms = get(s.port, path)
            timing = re.search(r"frame;dur=([\d.]+)", headers.get("Server-Timing", ""))
            replies.append((status, headers.get("Retry-After"), ms, time.monotonic(), timing and float(timing[1])))
        except OSError as fault:
            replies.append((0, str(fault), 0, 0, None))
    before, begin, asked = s.resident(), time.monotonic(), 0
    while time.monotonic() - begin < seconds:
        threads.append(threading.Thread(target=ask, args=(fresh(path),)))
        threads[-1].start()
        asked += 1
        time.sleep(max(0, begin + asked * gap - time.monotonic()))
    for thread in threads:
        thread.join()
    after = s.status()
    good = sorted(in_frame_times(replies))
    other = [r for r in replies if r[0] != 200 and not (r[0] == 503 and r[1])]
    frame = statistics.mean(ms for *_, ms in replies if ms)
    slowest = max(ms for status, _, ms, *_ in replies if status == 200)
    queue, resident = after["queues"]["render"]["capacity"], after["memory"]["resident_bytes"]
    print(f"{asked} requests in {seconds} s, one every {1e3 * gap:.0f} ms: {len(good)} times 200, "
          f"{len(replies) - len(good)} times 503; frame under load {frame:.0f} ms, slowest 200 {slowest:.0f} ms; "
          f"resident {before >> 20} MiB before, {resident >> 20} after")
    bound("neither 200 nor 503 with Retry-After", len(other), 0, f"replies {other[:3]}")
    bound("p99 of the 200s", good[int(0.99 * len(good))], queue + 2, "frame times")
    bound("memory grown under overload", (resident - before) / 2**20, 32, "MiB")


class Run:
    """A program that makes frames; what the first to the last of them took of time in which it was not stopped, and of
    processor time."""

    def __init__(self, pid, count):
        self.pid, self.count = pid, count  # count(): how many are made
        self.active, self.first, self.last = 0, None, None

    def look(self, total):
        made = self.count()
        if made and self.first is None:
            self.first = (made, self.active, processor_s(self.pid))
        if made == total and self.last is None:
            self.last = (made, self.active, processor_s(self.pid))
        return self.last is not None

    def turn(self, total):
        """Lets it run until it is done, or its turn is over. True when it is done."""
        os.kill(self.pid, signal.SIGCONT)
        begin, active = time.monotonic(), self.active
        while True:
            self.active = active + time.monotonic() - begin
            if self.look(total) or self.active - active > TURN_S:
                break
            time.sleep(0.005)
        if self.last is None:
            os.kill(self.pid, signal.SIGSTOP)
        return self.last is not None

    def a_frame(self):
        """Seconds, and seconds of processor time."""
        (a, *begin), (b, *end) = self.first, self.last
        return [(y - x) / (b - a) for x, y in zip(begin, end)]


def by_turns(runs, total):
    left = list(runs)
    for run in left:
        os.kill(run.pid, signal.SIGSTOP)
    while left:
        left = [run for run in left if not run.turn(total)]
    return [run.a_frame() for run in runs]


def bare(path, total, folder, *arguments):
    """The frames of `path` in one process: render, encode, write, one after the other. It is stopped."""
    out, file = pathlib.Path(folder) / "bare", pathlib.Path(folder) / "path.json"
    file.write_text(json.dumps(path))
    process = subprocess.Popen([SPLATD, "tour", packed(scan(), "grenoble"), "--no-verify", "--path", file, "--size",
                                "1280x720", *arguments, "-o", out], stderr=subprocess.DEVNULL)
    return process, Run(process.pid, lambda: sum(1 for _ in out.glob("*.jpeg")))


def compare(what, service, body, total, folder, start, count, *arguments):
    """`total` frames by the service, which start() begins and count() counts, against bare ones."""
    process, run = bare(body, total, folder, *arguments)
    start()
    try:
        served, alone = by_turns([Run(service.pid, count), run], total)
    finally:
        process.send_signal(signal.SIGCONT)
        process.wait(60)
    print(f"{total} frames by turns of {TURN_S} s: {1000 * served[0]:.1f} ms a frame by the service, "
          f"{1000 * alone[0]:.1f} bare; of processor time {1000 * served[1]:.1f} and {1000 * alone[1]:.1f} ms")
    print(f"{what}, processor time: {served[1] / alone[1]:.3f} times")
    bound(what, served[0] / alone[0], 1.05, "times")


def cameras(count):
    """The same path that splatd bench takes, as cameras of our own."""
    views = json.loads((DATA / "cameras.json").read_text())["grenoble"]

    def mix(key, share):
        a, b = views["overview"][key], views["close"][key]
        return [x + (y - x) * share for x, y in zip(a, b)] if isinstance(a, list) else a + (b - a) * share
    names = {"eye": "eye", "target": "target", "vfov_deg": "fov", "near": "near", "far": "far"}
    return [{"up": [0, 0, 1], **{name: mix(key, i / (count - 1)) for key, name in names.items()}} for i in range(count)]


def throughput():
    """Views over HTTP for four clients, against the same frames without the service."""
    total, made = 120, []
    with tempfile.TemporaryDirectory() as folder, Service("--cache", "0") as s:
        get(s.port, view_query(0))
        paths = [view_query(i / (total - 1)) for i in range(total)]
        asking = threading.Thread(target=ask_all, args=(s.port, paths, 4, lambda: made.append(0)))
        compare("views over HTTP against bare frames", s, {"frames": [{"camera": c} for c in cameras(total)]}, total,
                folder, asking.start, lambda: len(made))
        asking.join()


def devices():
    """Views over HTTP for four clients: a daemon with two devices against one with one, a round of each in turn."""
    paths = [view_query(i / 19) for i in range(20)]
    for what, environment in (("a core a device", {"LP_NUM_THREADS": "0"}), ("all cores each", {})):
        with Service("--cache", "0", "--device", "vulkan:0", **environment) as one, \
                Service("--cache", "0", "--device", "vulkan:0,vulkan:0", **environment) as two:
            same = all(get(one.port, path)[2] == get(two.port, path)[2] for path in paths)
            rounds = {one: [], two: []}
            for _ in range(5):
                for s in (one, two):
                    used, began = processor_s(s.pid), time.monotonic()
                    ask_all(s.port, paths, 4)
                    rounds[s].append(((time.monotonic() - began) / len(paths), (processor_s(s.pid) - used) / len(paths)))
            single, double = ([statistics.median(x) for x in zip(*rounds[s])] for s in (one, two))
            rate = statistics.median(a[0] / b[0] for a, b in zip(rounds[one], rounds[two]))
            print(f"{what}: {1 / single[0]:.2f} views/s with one device, {1 / double[0]:.2f} with two: {rate:.2f} times the "
                  f"rate; {1000 * single[1]:.0f} and {1000 * double[1]:.0f} ms of processor time a view; bytes "
                  f"{'equal' if same else 'DIFFER'}", flush=True)
            if environment:
                bound("time of a view with two devices to that with one", 1 / rate, 1 / 1.6, "times")


def busiest_s(pid):
    """Processor time of each thread of a process that lives."""
    times = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):
            fields = (task / "stat").read_text().rsplit(")", 1)[1].split()
            times[task.name] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return times


def spread():
    """Large views for one client: two devices of a core each against one of a core, view by view in turn. Beside the
    latency, which others on the machine lengthen, the processor time of the thread that has most of it: of two devices
    the one that others wait for."""
    options = ("--cache", "0", "--deadline", "60000")
    with Service(*options, "--device", "vulkan:0", LP_NUM_THREADS="0") as one, \
            Service(*options, "--device", "vulkan:0,vulkan:0", LP_NUM_THREADS="0") as two:
        for width, height in ((3840, 2160), (1920, 1080), (1600, 900), (1280, 800)):
            paths = [view_query(i / 9).replace("width=1280&height=720", f"width={width}&height={height}")
                     for i in range(10)]
            same, rows = True, []
            for path in paths:
                get(one.port, path), get(two.port, path)
                took, bodies = [], []
                for s in (one, two):
                    before, began = busiest_s(s.pid), time.monotonic()
                    status, _, body, _ = get(s.port, path)
                    if status != 200:
                        sys.exit(body)
                    bodies.append(body)
                    wall, after = time.monotonic() - began, busiest_s(s.pid)
                    took += [wall, max(after[t] - before.get(t, 0) for t in after)]
                same &= bodies[0] == bodies[1]
                rows.append(took)
            a, b, c, d = (1000 * statistics.median(x) for x in zip(*rows))
            ratio = statistics.median(row[2] / row[0] for row in rows)
            busy = statistics.median(row[3] / row[1] for row in rows)
            print(f"{width}x{height}: {a:.0f} ms with one device, {c:.0f} with two, {ratio:.2f} of it; the busiest thread "
                  f"{b:.0f} and {d:.0f} ms of processor time, {busy:.2f} of it; bytes {'equal' if same else 'DIFFER'}",
                  flush=True)
            if height > 1000:
                bound(f"processor time of the busiest thread at {width}x{height}, with two devices to one", busy, 0.65,
                      "times")


def tours():
    total = int(sys.argv[2]) if len(sys.argv) > 2 else 300
    path = {"keyframes": [{"camera": camera} for camera in cameras(2)]}
    body = {"path": path, "frames": total, "settings": {"width": 1280, "height": 720, "lod": 2}}
    with tempfile.TemporaryDirectory() as folder, Service("--tours", folder + "/tours") as s:
        def start():
            connection = http.client.HTTPConnection("127.0.0.1", s.port, timeout=60)
            connection.request("POST", "/v1/datasets/grenoble/tours", json.dumps(body))
            reply = connection.getresponse()
            if reply.status != 202:
                sys.exit(reply.read())
        compare(f"{total} frames of a tour against as many bare ones", s, path, total, folder, start,
                lambda: sum(1 for _ in pathlib.Path(folder, "tours").glob("*/*.jp*g")), "--frames", str(total), "--lod",
                "2")


def connect(port, receive=None):
    s = socket.socket()
    if receive:
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
    s.connect(("127.0.0.1", port))
    s.settimeout(60)
    return s


def read_reply(s):
    data = b""
    while b"\r\n\r\n" not in data:
        data += s.recv(65536)
    head, _, body = data.partition(b"\r\n\r\n")
    if not head.startswith(b"HTTP/1.1 200"):
        sys.exit(head.decode())
    left = int(re.search(rb"(?i)\r\ncontent-length: (\d+)", head)[1]) - len(body)
    while left > 0:
        left -= len(s.recv(min(left, 65536)))


def request(path):
    return f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()


def median_ms(port, paths):
    """Of a request on a connection that stays."""
    with connect(port) as s:
        times = []
        for path in paths:
            begin = time.monotonic()
            s.sendall(request(path))
            read_reply(s)
            times.append(1e3 * (time.monotonic() - begin))
    return statistics.median(times)


@contextlib.contextmanager
def crowd(port, slow_path):
    """2,000 connections that have asked once and keep still; 200 that read a large image byte by byte."""
    idle, slow = [connect(port) for _ in range(2000)], [connect(port, 4096) for _ in range(200)]
    over = threading.Event()
    for s in idle:
        s.sendall(request("/v1/datasets"))
        read_reply(s)
    for s in slow:
        s.sendall(request(slow_path))

    def trickle():
        while not over.wait(0.1):
            for s in slow:
                s.recv(10)
    reader = threading.Thread(target=trickle)
    reader.start()
    try:
        yield len(idle) + len(slow)
    finally:
        over.set()
        reader.join()
        for s in idle + slow:
            s.close()


def connections():
    """What many who do nothing, and some who read slowly, cost the others."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    small = view_query(0.3).replace("width=1280&height=720", "width=320&height=180")
    large = view_query(0) + "&format=raw"
    kinds = {"cached views": lambda: [small] * 1000, "rendered views": lambda: [fresh(small) for _ in range(25)]}
    alone, together, each = [], [], []  # by turns, alone first and last
    with Service() as s:
        def measure():
            return {kind: median_ms(s.port, paths()) for kind, paths in kinds.items()}
        size = len(get(s.port, large)[2])
        measure()
        for _ in range(11):
            alone.append(measure())
            before = s.resident()
            with crowd(s.port, large) as count:
                together.append(measure())
                each.append((s.resident() - before) / count)
        alone.append(measure())
    print(f"2000 idle connections and 200 that read {size} bytes at 100 a second, {len(together)} times")
    for kind in kinds:
        values = [2 * t[kind] / (a[kind] + b[kind]) for a, t, b in zip(alone, together, alone[1:])]
        print(f"{kind}, p50 with them to p50 without: " + ", ".join(f"{x:.3f}" for x in values))
        bound(f"p50 of {kind} beside them, median", statistics.median(values), 1.1, "times")
    print("bytes of memory a connection: " + ", ".join(f"{x:.0f}" for x in each))
    bound("memory a connection, most", max(each), 16384, "bytes")


if __name__ == "__main__":
    figures = {f.__name__: f for f in (cached, saturation, overload, throughput, devices, spread, connections, tours)}
    if not 2 <= len(sys.argv) <= (3 if sys.argv[1:2] == ["tours"] else 2) or sys.argv[1] not in figures:
        sys.exit(__doc__)
    CACHE.mkdir(parents=True, exist_ok=True)
    figures[sys.argv[1]]()
    if beyond:
        sys.exit("beyond its bound: " + "; ".join(beyond))
