"""A daemon under test, and the client that talks to it. Every reply of status 400 or more is checked to be an RFC 9457
problem, every reply to be what api/openapi.yaml promises (openapi.py); every daemon must end the way the test says."""
import email.message
import email.parser
import http.client
import inspect
import itertools
import json
import os
import queue
import re
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import urllib.parse

import openapi

REAL, FAKE, WALL, TEXTURED, MAPPED = (os.environ[name] for name in (
    "SPLATD_BINARY", "SPLATD_FAKE", "SPLATD_WALL", "SPLATD_WALL_TEXTURED", "SPLATD_WALL_MAPPED"))
VIEW = "/v1/datasets/wall/view"
SANITIZED = os.environ.get("SPLATD_SANITIZED") == "1"
# What a real frame may take where a test says nothing of it: machines are shared, and sanitised ones are slower.
DEADLINE_MS = 60000
# For what must come to pass: so long that only a fault lasts longer. No test waits for its end but one that fails.
PATIENCE_S = 150


class Reply:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)


def check_problem(reply, method):
    assert reply.headers["Content-Type"] == "application/problem+json", (reply.status, reply.headers["Content-Type"])
    if method == "HEAD":
        return
    problem = reply.json()
    for name, kind in {"type": str, "title": str, "status": int, "detail": str, "instance": str}.items():
        assert isinstance(problem.get(name), kind) and problem[name], (name, problem)
    assert problem["status"] == reply.status, problem
    assert problem["type"].startswith("urn:splatd:error:"), problem
    assert not set(problem) - {"type", "title", "status", "detail", "instance", "field"}, problem
    if reply.status == 503:
        assert int(reply.headers["Retry-After"]) >= 1


class Daemon:
    """with Daemon(REAL) as d: …   ends it with SIGTERM and expects exit code 0, unless the test stopped it itself."""

    def __init__(self, binary, *args, datasets=(WALL,), wait_for=r"( |\"message\":\")ready(\"})?\n", preexec=None,
                 **environment):
        self.process = subprocess.Popen(
            [binary, *(["serve"] if binary == REAL else []), "--listen", "127.0.0.1:0",
             *([] if "--ops-listen" in args else ["--ops-listen", "127.0.0.1:0"]),
             *(["--deadline", str(DEADLINE_MS)] if binary == REAL and "--deadline" not in args else []),
             *args, *datasets],
            # a thousand lines at once, of which a pipe of the usual size would lose some, maybe "ready"
            stderr=subprocess.PIPE, pipesize=1 << 20, text=True, errors="backslashreplace", preexec_fn=preexec,
            env={**os.environ, **{k: str(v) for k, v in environment.items()}})
        self.lines, self.port, self.ops_port, self.code = [], None, None, None
        ready = queue.Queue()
        self.reader = threading.Thread(target=self._read, args=(ready, wait_for), daemon=True)
        self.reader.start()
        if not ready.get(timeout=PATIENCE_S):
            self.wait_exit()
            raise AssertionError(f"exit code {self.code} before ready:\n" + "".join(self.lines))

    def _read(self, ready, wait_for):
        for line in self.process.stderr:
            self.lines.append(line)
            if found := re.search(r"listening on http://[^ ]*:(\d+)/", line):
                self.port = int(found.group(1))
            if found := re.search(r"health and metrics on http://[^ ]*:(\d+)/", line):
                self.ops_port = int(found.group(1))
            if re.search(wait_for, line):
                ready.put(True)
        ready.put(False)

    def connect(self, timeout=PATIENCE_S):
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)

    def ask(self, path, method="GET", body=None, headers={}, connection=None):
        own = connection or self.connect()
        own.request(method, path, body, headers)
        answer = own.getresponse()
        reply = Reply(answer.status, answer.headers, answer.read())
        if not connection:
            own.close()
        if reply.status >= 400:
            check_problem(reply, method)
        openapi.check(method, path, headers, body, reply)
        return reply

    def ops(self, path, method="GET", timeout=PATIENCE_S):
        """Asks the second listener."""
        connection = http.client.HTTPConnection("127.0.0.1", self.ops_port, timeout=timeout)
        connection.request(method, path)
        answer = connection.getresponse()
        reply = Reply(answer.status, answer.headers, answer.read())
        connection.close()
        return reply

    def view(self, **params):
        return self.ask(f"{VIEW}?{urllib.parse.urlencode(params, safe=',')}")

    def post(self, document, path=VIEW):
        body = document if isinstance(document, (str, bytes)) else json.dumps(document)
        return self.ask(path, "POST", body, {"Content-Type": "application/json"})

    def status(self):
        return self.ask("/v1/status").json()

    def processor_s(self):
        """What it has taken of processors so far."""
        with open(f"/proc/{self.process.pid}/stat") as file:
            fields = file.read().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def wait_exit(self, timeout=PATIENCE_S):
        """Its code, once all that it said is in `lines`."""
        try:
            self.code = self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        self.reader.join(timeout)
        return self.code

    def log(self, text, count=1):
        """Waits until so many lines have `text`, for they are written beside replies."""
        eventually(lambda: len([line for line in self.lines if text in line]) >= count)
        return [line for line in self.lines if text in line]

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        return self.wait_exit()

    def __enter__(self):
        return self

    def __exit__(self, kind, *rest):
        if self.code is None and self.process.poll() is None:
            code = self.stop()
        else:
            code = 0 if self.code is not None else self.process.wait() or "0, early"
        if code or kind not in (None, SystemExit):  # that of run(), whose tests had their say
            sys.stdout.write("".join(self.lines) + f"the daemon's exit code: {code}\n")
        if not kind:
            assert code == 0, f"exit code {code}"


_fresh = itertools.count(1)


def fresh(path):
    """A view like that of `path` that nobody has asked for before: another near plane in front of everything."""
    return f"{path}{'&' if '?' in path else '?'}near={1e-6 * next(_fresh):.6f}"


def parts(reply):
    """(name, headers, bytes) of each part of a multipart/mixed reply."""
    kind = reply.headers["Content-Type"]
    assert kind.startswith("multipart/mixed; boundary="), kind
    boundary = b"--" + kind.split("=", 1)[1].encode()
    pieces = reply.body.split(boundary)
    assert pieces[0] == b"" and pieces[-1] == b"--\r\n" and len(pieces) > 2
    for piece in pieces[1:-1]:
        head, _, body = piece[2:].partition(b"\r\n\r\n")
        headers = email.parser.BytesHeaderParser().parsebytes(head + b"\r\n\r\n")
        assert len(body) == int(headers["Content-Length"]) + 2 and body[-2:] == b"\r\n"
        yield headers.get_filename(), headers, body[:-2]


def npy(rows, kind="f", order="False"):
    """A body of directions: float32, or float64 with kind "d"."""
    header = f"{{'descr': '<{'f4' if kind == 'f' else 'f8'}', 'fortran_order': {order}, 'shape': ({len(rows)}, 3), }}"
    header += " " * (117 - len(header)) + "\n"
    flat = [x for row in rows for x in row] if order == "False" else [row[k] for k in range(3) for row in rows]
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + struct.pack(f"<{len(flat)}{kind}", *flat)


def lines(*pairs):
    """Headers of which several may have one name, each of which is sent as a line of its own."""
    headers = email.message.Message()
    for name, value in pairs:
        headers[name] = value
    return headers


class Port:
    """A listening socket for a server of others, so that nobody takes its port before it has begun: nginx finds it by
    `environment`; pass_fds=[port.fd]."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0), backlog=511)
        self.number, self.fd = self.socket.getsockname()[1], self.socket.fileno()

    @staticmethod
    def environment(*ports):
        return {**os.environ, "NGINX": "".join(f"{port.fd};" for port in ports)}


class Hold:
    """What is held up until a test says so, by a file (tests/support/fake_renderer.c, slow_disk.c): of FAKE_STEPS and
    SLOW_DISK_READS only as many end as are allowed, of FAKE_OPENING, FAKE_PAGES and FAKE_HANG none. Give the daemon
    `environment`, and a deadline that nobody meets."""

    all = []  # the folder of one goes with it

    def __init__(self, name="FAKE_STEPS", allowed=0):
        self.all.append(self)
        self.folder = tempfile.TemporaryDirectory(prefix="splatd-hold-")
        self.path = os.path.join(self.folder.name, "held")
        self.environment = {name: self.path}
        if allowed is not None:
            self.allow(allowed)

    def allow(self, count):
        """So many since it was held; another call counts on."""
        with open(self.path + "~", "w") as file:
            file.write(str(count))
        os.rename(self.path + "~", self.path)

    def allow_all(self):
        os.unlink(self.path)


PATIENT = ("--deadline", "600000")


def eventually(condition, seconds=PATIENCE_S):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "did not happen: " + inspect.getsource(condition)
        time.sleep(0.01)


def together(count, work):
    """Runs work(i) in `count` threads at once; their results in order, exceptions included."""
    results = [None] * count

    def run(i):
        try:
            results[i] = work(i)
        except Exception as error:
            results[i] = error
    threads = [threading.Thread(target=run, args=(i,)) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def break_page(data):
    """Flips a bit of a dataset's first page, which the section table knows (api/format.md)."""
    row = data.index(b"PAGE", struct.unpack_from("<Q", data, 24)[0])
    data[struct.unpack_from("<Q", data, row + 8)[0]] ^= 1


def counting_s():
    """Processor time of a sum that takes 2.5 ms where nobody shares the core."""
    began, x = time.thread_time(), 0
    for i in range(20000):
        x = (x * 1103515245 + i) & 0xffffffff
    return time.thread_time() - began


def slower_than_usual():
    """How many times as much processor time things take on this machine, just now."""
    return statistics.median(counting_s() for _ in range(9)) / 0.0025


def patiently(test, *seconds):
    """Runs test(s) for the first of these that it passes with: a time that the daemon is given, in which it and we have to
    be run as well. What is wrong is so with the longest of them, too."""
    for given in seconds:
        try:
            return test(given)
        except AssertionError as why:
            if given == seconds[-1]:
                raise
            print(f"     not within {given} s: {str(why)[:200]!r}", flush=True)


class Skipped(Exception):
    """What a test raises that cannot judge here; its words are why."""


def run(namespace):
    """Runs the namespace's tests, or those that the command line names. Exits with 1 where one failed, else with 77
    where one was skipped."""
    failed = skipped = 0
    for name, test in list(namespace.items()):
        if not name.startswith("test_") or len(sys.argv) > 1 and name not in sys.argv[1:]:
            continue
        began = time.monotonic()
        try:
            test()
            print(f"ok   {name} ({time.monotonic() - began:.2f} s)", flush=True)
        except Skipped as why:
            skipped += 1
            print(f"skip {name}: {why}", flush=True)
        except Exception:
            failed += 1
            print(f"FAIL {name}\n{traceback.format_exc()}", flush=True)
    if not failed and len(sys.argv) == 1:
        openapi.save(os.path.basename(sys.argv[0]))
    sys.exit(1 if failed else 77 if skipped else 0)
