"""Where a request and a reply end, byte for byte on a socket: bodies in chunks for every route that takes one, HEAD of every
route, lengths that can be read in two ways."""
import contextlib
import json
import re
import signal
import socket
import tempfile
import time

import openapi
from harness import FAKE, VIEW, Daemon, check_problem, eventually, run

PATH = {"camera_path": [{"camera_to_world": [1, 0, 0, 3, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1], "fov": 50, "aspect": 1}] * 3,
        "render_width": 16, "render_height": 16, "fps": 5, "seconds": 0.6}
SMALL = {"width": 16, "height": 16}
BODIES = {VIEW: SMALL, "/v1/datasets/wall/pick": {**SMALL, "x": 3, "y": 3},
          "/v1/datasets/wall/views": {"views": [SMALL, {**SMALL, "lod": 2}]},
          "/v1/datasets/wall/tours": {"path": PATH}}


class Problem:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, {"Content-Type": headers.get("content-type")}, body

    def json(self):
        return json.loads(self.body)


class Wire:
    """One connection; what comes is read reply by reply, and nothing may be left over."""

    def __init__(self, d):
        self.socket, self.buffer = socket.create_connection(("127.0.0.1", d.port), 150), b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, *parts):
        for part in parts:
            self.socket.sendall(part if isinstance(part, bytes) else part.encode())

    def more(self):
        got = self.socket.recv(1 << 16)
        self.buffer += got
        return bool(got)

    def take(self, count):
        while len(self.buffer) < count:
            assert self.more(), ("the reply ends early", self.buffer)
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def line(self):
        while b"\r\n" not in self.buffer:
            assert self.more(), ("the reply ends early", self.buffer)
        return self.take(self.buffer.index(b"\r\n") + 2)[:-2]

    def reply(self, head=False):
        """(status, headers, body); the body of a reply without a length goes on until the connection ends."""
        first = self.line()
        assert re.fullmatch(rb"HTTP/1\.[01] \d{3} .*", first), first
        status, headers = int(first.split()[1]), {}
        while line := self.line():
            name, _, value = line.partition(b": ")
            headers[name.decode().lower()] = value.decode("latin-1")
        if status == 100:
            return self.reply(head)
        if head or status in (204, 304):
            return status, headers, b""
        if headers.get("transfer-encoding") == "chunked":
            body = b""
            while size := int(self.line(), 16):
                body += self.take(size)
                assert self.line() == b""
            assert self.line() == b""
            return status, headers, body
        if "content-length" in headers:
            return status, headers, self.take(int(headers["content-length"]))
        while self.more():
            pass
        return status, headers, self.take(len(self.buffer))

    def ended(self):
        """Has the other side closed, with nothing more to say?"""
        assert not self.buffer, ("bytes that belong to no reply", self.buffer)
        try:
            return not self.more()
        except ConnectionResetError:
            return not self.buffer


def chunked(body, size):
    at = [body[i:i + size] for i in range(0, len(body), size)]
    return b"".join(b"%x\r\n%s\r\n" % (len(part), part) for part in at) + b"0\r\n\r\n"


def with_tours(*args):
    return Daemon(FAKE, "--tours", tempfile.mkdtemp(), *args, FAKE_FRAME_MS=1)


def test_bodies_in_chunks_for_every_route():
    """Whoever waits within a body's handler is not asked again: one reply a request, the connection goes on."""
    with with_tours() as d:
        for path, document in BODIES.items():
            text = json.dumps(document)
            for size in (1, 7, 1000, 65536):
                for padding in (0, 3000, 200_000 if size > 1 else 0):
                    body = chunked((text + " " * padding).encode(), size)
                    head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" \
                           f"Transfer-Encoding: chunked\r\n\r\n"
                    with Wire(d) as wire:
                        for cut in (0, len(body) // 2, len(body) - 1):  # the end of the body comes by itself, or not
                            wire.send(head.encode() + body[:cut], body[cut:])
                            status, _, reply = wire.reply()
                            assert status in (200, 201, 202), (path, size, padding, status, reply)
                        wire.send("GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                        assert wire.reply()[0] == 200 and wire.ended()


def every_path(d):
    """Every route's path, filled in."""
    tour = d.post({"path": PATH}, "/v1/datasets/wall/tours").json()["name"]
    eventually(lambda: d.ask(f"/v1/tours/{tour}").json()["state"] == "done")
    names = {"/viewer/": "page.css", "/embed/": "wall", "/clients/": "splatd.py", "/v1/tours/": tour}
    for path in openapi.DOCUMENT["paths"]:
        name = next((name for start, name in names.items() if path.startswith(start)), "")
        yield path.replace("{id}", "wall").replace("{name}", name).replace("{n}", "0")


def test_head_of_every_route_is_followed_by_the_next_reply():
    with with_tours() as d:
        paths = list(every_path(d))
        assert len(paths) > 15, paths
        for path in paths:
            for query in ("", "?width=16&height=16&format=png", "?x=3&y=3"):
                with Wire(d) as wire:
                    wire.send(f"HEAD {path}{query} HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    status, headers, _ = wire.reply(head=True)
                    if headers.get("connection", "").lower() == "close":
                        assert wire.ended(), path
                        continue
                    wire.send("GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                    assert wire.reply()[0] == 200 and wire.ended(), (path, status)


def test_a_head_without_a_length_says_that_the_connection_ends():
    """What a view has that nobody has rendered, no HEAD knows, and libmicrohttpd would frame it wrongly. Whoever has sent
    the next request right behind has to read that it was not taken; once rendered, the length is told and it is."""
    behind = "GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    with with_tours() as d:
        for i, wish in enumerate(("", "Connection: keep-alive\r\n")):
            path = f"{VIEW}?width={64 + i}"
            head = f"HEAD {path} HTTP/1.1\r\nHost: localhost\r\n{wish}\r\n"
            with Wire(d) as wire:
                wire.send(head + behind)
                status, headers, _ = wire.reply(head=True)
                assert status == 200 and "content-length" not in headers and headers["connection"] == "close", headers
                assert wire.ended()
            length = len(d.ask(path).body)
            with Wire(d) as wire:
                wire.send(head + behind)
                status, headers, _ = wire.reply(head=True)
                assert status == 200 and int(headers["content-length"]) == length, headers
                assert headers.get("connection", "").lower() != "close" and wire.reply()[0] == 200 and wire.ended()


AMBIGUOUS = [
    ("Content-Length: 2\r\nContent-Length: 40", b"{}"),
    ("Content-Length: 0\r\nContent-Length: 2", b"{}"),
    ("Content-Length: 2\r\nContent-Length: 2", b"{}"),
    ("Content-Length: 2\r\nTransfer-Encoding: chunked", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Transfer-Encoding: chunked\r\nContent-Length: 2", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Transfer-Encoding: chunked\r\nTransfer-Encoding: identity", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Transfer-Encoding: chunked, identity", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Transfer-Encoding: gzip, chunked", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Transfer-Encoding: xchunked", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Transfer-Encoding:", b""),
    ("Transfer-Encoding : chunked", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Content-Length : 2", b"{}"),
    ("Content-Length:\r\n 2", b"{}"),
    ("Transfer-Encoding:\r\n\tchunked", b"2\r\n{}\r\n0\r\n\r\n"),
    ("Content\tLength: 2", b"{}"),
]
# libmicrohttpd 0.9.75 would answer these itself: a page of HTML, behind two heads.
MALFORMED = [
    ("Content-Length: 2, 2", b"{}"),
    ("Content-Length: +2", b"{}"),
    ("Content-Length: -2", b"{}"),
    ("Content-Length: 0x2", b"{}"),
    ("Content-Length: 2 2", b"{}"),
    ("Content-Length: 99999999999999999999999", b"{}"),
    ("Content-Length:", b""),
]


def test_lengths_that_can_be_read_in_two_ways_end_the_connection():
    hidden = b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\n\r\n"  # what must never be answered
    with with_tours() as d:
        for method, path in (("POST", VIEW), ("GET", "/v1/status"), ("PUT", "/v1/datasets/x"), ("DELETE", "/v1/tours/x")):
            for headers, body in AMBIGUOUS + MALFORMED:
                with Wire(d) as wire:
                    wire.send(b"GET /v1/datasets HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    assert wire.reply()[0] == 200  # the connection itself is fine
                    wire.send(f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                              f"{headers}\r\n\r\n".encode() + body + hidden)
                    status, answer, text = wire.reply()
                    too_large = "999" in headers
                    assert status == (413 if too_large else 400), (method, headers, status, text)
                    check_problem(Problem(status, answer, text), method)
                    assert json.loads(text)["field"], (method, headers, status, text)
                    assert answer.get("connection", "").lower() == "close" and wire.ended(), (method, headers, answer)
        with Wire(d) as wire:
            wire.send(b"POST %s HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n" % VIEW.encode())
            assert wire.reply()[0] == 400 and wire.ended()
        with Wire(d) as wire:
            wire.send(f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\nContent-Length: 3\r\n\r\n")
            status, _, text = wire.reply()
            problem = json.loads(text)
            assert problem["field"] == "Content-Length" and "several" in problem["detail"], problem


# Bodies in chunks that are none, or too large to be waited for, and their statuses.
CHUNKS = [
    (b"zz\r\n{}\r\n0\r\n\r\n", 400), (b"-2\r\n{}\r\n0\r\n\r\n", 400), (b"+2\r\n{}\r\n0\r\n\r\n", 400),
    (b"0x2\r\n{}\r\n0\r\n\r\n", 400), (b"2 \r\n{}\r\n0\r\n\r\n", 400), (b"\r\n{}\r\n0\r\n\r\n", 400),
    (b"2\r\n{}0\r\n\r\n", 400), (b"2\r\n{}xx", 400), (b"2\r\n{}\r\nzz\r\n", 400), (b"2\r\n{}\r\n0\r\nno name\r\n\r\n", 400),
    (b"F" * 17 + b"\r\n{}", 413), (b"1" + b"0" * 200 + b"\r\n{}", 413), (b"2\r\n{}\r\n" + b"f" * 30 + b"\r\n{}", 413),
    (b"FFFFFFFFFFFFFFFF\r\n{}", 413), (b"7fffffffffffffff\r\n{}", 413), (b"80000001\r\n{}", 413), (b"900000;a=b\r\n{}", 413),
    (b"2\r\n{}\r\n7fffffffffffffff\r\n{}", 413), (b"2\r\n{}\r\n0\r\n" + b"A: b\r\n" * 4000, 431),
]


def test_chunks_that_are_none_are_answered_once_and_at_once():
    hidden = b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with with_tours() as d:
        for body, expected in CHUNKS:
            for path in BODIES:
                for pause in (False, True):
                    with Wire(d) as wire:
                        head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" \
                               "Transfer-Encoding: chunked\r\n\r\n".encode()
                        if pause:
                            wire.send(head)
                            time.sleep(0.02)
                            head = b""
                        wire.send(head + body + (b"" if b"xx" in body else hidden))
                        status, answer, text = wire.reply()
                        assert status == expected, (path, body[:40], status, text)
                        check_problem(Problem(status, answer, text), "POST")
                        assert answer["connection"].lower() == "close" and wire.ended(), (path, body[:40], answer)
        assert not d.status()["counters"]["slow_closed"], "it took until a client that is slow is cut"


# Lines of a body in chunks that libmicrohttpd has no room for; it goes on asking itself whether their end is there.
ENDLESS = [b"2;" + b"e" * 24000, b"2\r\n{}\r\n2;" + b"e" * 24000, b"0" * 24000, b"2" + b" " * 24000, b"0;" + b"e" * 24000]


def test_a_chunks_first_line_that_does_not_end_is_told_so():
    with with_tours() as d:
        for path in (*BODIES, "/v1/datasets/wall/rays", "/nowhere"):
            for body in ENDLESS:
                with Wire(d) as wire:
                    wire.send(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                              "Transfer-Encoding: chunked\r\n\r\n", body)
                    status, answer, text = wire.reply()
                    assert status == 400, (path, body[:9], status, text)
                    check_problem(Problem(status, answer, text), "POST")
                    assert answer["connection"].lower() == "close" and wire.ended(), (path, body[:9], answer)
        assert not d.status()["counters"]["slow_closed"], "it took until a client that is slow is cut"


def test_endless_lines_of_clients_that_left_cost_nothing():
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    with Daemon(FAKE) as d:
        began_s = d.processor_s()
        for _ in range(200):
            with Wire(d) as wire:
                wire.send(head, ENDLESS[0])
        eventually(lambda: d.status()["connections"] <= 1)
        assert (busy_s := d.processor_s() - began_s) < 2, busy_s
        assert not d.status()["counters"]["slow_closed"], "it took until a client that is slow is cut"


def test_long_lines_that_end_are_taken_however_slowly():
    text = json.dumps(SMALL).encode()
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    line = b"%x;" % len(text) + b"e" * 8000
    with Daemon(FAKE) as d:
        for pause_s, pieces in (0, 1), (0.02, 40):
            with Wire(d) as wire, Wire(d) as late:
                for at in range(0, len(line), len(line) // pieces):
                    wire.send((head if not at else "").encode() + line[at:at + len(line) // pieces])
                    time.sleep(pause_s)
                wire.send(b"\r\n" + text + b"\r\n0\r\n\r\n")
                assert wire.reply()[0] == 200
                late.send((head.encode() + line + b"\r\n" + text + b"\r\n0\r\n\r\n") * 40)
                time.sleep(0.3)
                assert [late.reply()[0] for _ in range(40)] == [200] * 40


def test_who_has_closed_its_side_gets_all_that_it_asked_for():
    """However late it reads; its requests lie in libmicrohttpd's buffer and the kernel's until then."""
    text = json.dumps({"width": 256, "height": 256, "layer": "depth", "format": "npy"}).encode()
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    request = f"{head}Transfer-Encoding: chunked\r\n\r\n".encode() + chunked(text, 20)
    with Daemon(FAKE) as d, Wire(d) as wire:
        wire.send(request)
        assert wire.reply()[0] == 200
        wire.send(request * 100)  # a picture that is kept is not waited for
        wire.socket.shutdown(socket.SHUT_WR)
        for i in range(100):
            if i % 25 == 0:
                time.sleep(1.2)  # looked at every half a second
            status, _, body = wire.reply()
            assert status == 200 and len(body) > 256 * 256 * 4, (i, status)


def test_clients_that_left_amid_a_request_are_let_go():
    """The end of their stream came with their last bytes, so libmicrohttpd does not see it."""
    post = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    rays = "POST /v1/datasets/wall/rays HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    chunks = "Transfer-Encoding: chunked\r\n\r\n2;" + "e" * 4000
    halves = ["GET", "GET /v1/methods HTTP/1.1\r\nHost:", post + chunks, post + "Content-Length: 9\r\n\r\n{", rays + chunks]
    with Daemon(FAKE) as d:
        d.process.send_signal(signal.SIGSTOP)
        for half in halves * 4:
            with Wire(d) as wire:
                wire.send(half)
        d.process.send_signal(signal.SIGCONT)
        eventually(lambda: d.status()["connections"] <= 1)
        assert not d.status()["counters"]["slow_closed"], "it took until a client that is slow is cut"


def test_headers_that_libmicrohttpd_refuses_are_answered_once():
    cookies = "Cookie: " + "; ".join(f"a{i}={i}" for i in range(1500))
    with with_tours() as d:
        for headers, expected in (("no name", 400), ("X: " + "y" * 20000, 431), (cookies, 431)):
            for method in ("GET", "POST"):
                with Wire(d) as wire:
                    wire.send(f"{method} {VIEW} HTTP/1.1\r\nHost: localhost\r\n{headers}\r\n\r\n")
                    status, answer, text = wire.reply()
                    assert status == expected, (headers[:20], status, text)
                    check_problem(Problem(status, answer, text), method)
                    assert answer["connection"].lower() == "close" and wire.ended(), (headers[:20], answer)


def test_a_faulty_request_ends_no_other():
    """libmicrohttpd's log does not say which of several requests it means."""
    text = json.dumps(SMALL).encode()
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with with_tours() as d:
        for fault, coding in ((b"zz\r\n", "Transfer-Encoding: chunked"), (b"", "Content-Length: x"), (b"", "no name")):
            with Wire(d) as half, Wire(d) as chunks, Wire(d) as wire:
                half.send(head)
                chunks.send(head, "Transfer-Encoding: chunked\r\n\r\n", b"%x\r\n" % len(text))
                time.sleep(0.05)
                wire.send(head, coding + "\r\n\r\n", fault)
                status, answer, _ = wire.reply()
                assert status == 400 and answer["connection"].lower() == "close" and wire.ended(), (coding, answer)
                half.send(f"Content-Length: {len(text)}\r\n\r\n", text)
                chunks.send(text, b"\r\n0\r\n\r\n")
                assert half.reply()[0] == 200 and chunks.reply()[0] == 200


def test_who_is_at_rest_is_not_meant():
    """Clients that keep a connection, are amid their headers or amid a body in chunks, and send nothing just now."""
    text = json.dumps(SMALL).encode()
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with with_tours() as d:
        with Wire(d) as kept, Wire(d) as fresh, Wire(d) as half, Wire(d) as chunks, Wire(d) as waits:
            kept.send("GET /v1/methods HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert kept.reply()[0] == 200
            fresh.send("GE")
            half.send(head)
            chunks.send(head, "Transfer-Encoding: chunked\r\n\r\n", b"%x\r\n" % len(text), text[:5])
            waits.send(head, f"Content-Length: {len(text)}\r\n\r\n", text[:5])
            time.sleep(1.2)  # looked at every half a second
            for _ in range(2):
                for fault, coding in ((b"zz\r\n", "Transfer-Encoding: chunked"), (b"", "no name"), (b"2\r\n{}\r\n0\r\nno name\r\n\r\n", "Transfer-Encoding: chunked")):
                    with Wire(d) as wire:
                        wire.send(head, coding + "\r\n\r\n", fault)
                        status, answer, told = wire.reply()
                        assert status == 400, (coding, status, told)
                        check_problem(Problem(status, answer, told), "POST")
                        assert answer["connection"].lower() == "close" and wire.ended(), (coding, answer)
            half.send(f"Content-Length: {len(text)}\r\n\r\n", text)
            chunks.send(text[5:], b"\r\n0\r\n\r\n")
            waits.send(text[5:])
            fresh.send("T /v1/methods HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert [wire.reply()[0] for wire in (half, chunks, waits, fresh)] == [200] * 4


def test_what_waits_behind_a_request_is_meant():
    """It was read with the request before, so nothing comes of it when it is looked at; nobody else may be told for it."""
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    text = json.dumps(SMALL).encode()
    slow = f"GET {VIEW}?width=16&height=9&eye=3,0,1&target=0,0,0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with Daemon(FAKE, FAKE_FRAME_MS=1500) as d, Wire(d) as behind, Wire(d) as half:
        behind.send(slow, "GET /v1/methods HTTP/1.1\r\nHost: localhost\r\nno name\r\n\r\n")
        time.sleep(1.2)
        half.send(head)
        assert behind.reply()[0] == 200 and behind.reply()[0] == 400 and behind.ended()
        half.send(f"Content-Length: {len(text)}\r\n\r\n", text)
        assert half.reply()[0] == 200


def test_a_request_whose_rest_does_not_come_is_told_so():
    head = f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with with_tours() as d, contextlib.ExitStack() as stack:
        wires = [stack.enter_context(Wire(d)) for _ in range(4)]
        for wire, rest in zip(wires, ("", "Content-Length: 20\r\n\r\n{", "Transfer-Encoding: chunked\r\n\r\n2\r\n{}x",
                                      "Transfer-Encoding: chunked\r\n\r\n2;" + "x" * 300)):
            wire.send(head + rest)
        for wire in wires:
            status, answer, text = wire.reply()
            assert status == 408, (status, text)
            check_problem(Problem(status, answer, text), "POST")
            assert answer["connection"].lower() == "close" and wire.ended()


def test_requests_that_do_not_fit_are_forgotten_by_nobody():
    """libmicrohttpd never completes a request with two errors; it kept its memory, and SIGTERM waited for it."""
    long = b"HEAD /v1/status?" + b"a=b&" * 2000 + b" HTTP/1.1\r\nHost: localhost\r\nX: 1\r\n\r\n"
    view = f"GET {VIEW}?width=16&height=9 HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
    with Daemon(FAKE, FAKE_FRAME_MS=5) as d:
        for _ in range(20):
            with Wire(d) as wire:
                wire.send(view + long)
                with contextlib.suppress(ConnectionResetError):
                    while wire.more():
                        pass
        eventually(lambda: b"\nsplatd_requests_open 0\n" in d.ops("/metrics").body)


def test_a_client_that_waits_to_send_nothing_gets_its_reply():
    """Expect: 100-continue before an empty body, and the next request right behind."""
    with with_tours() as d:
        for method, path in (("POST", VIEW), ("GET", "/v1/status"), ("HEAD", "/v1/status"), ("PUT", "/v1/datasets/a")):
            for length in ("Content-Length: 0\r\n", ""):
                with Wire(d) as wire:
                    wire.send(f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\n{length}\r\n"
                              "GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                    assert wire.reply(head=method == "HEAD")[0] >= 200
                    assert wire.reply()[0] == 200 and wire.ended(), (method, length)


def test_headers_that_are_not_what_they_seem():
    """Lines that libmicrohttpd takes for the end of the headers, or reads a part of."""
    with with_tours() as d:
        for odd in (b": a", b":", b": ", b":a: b", b"\0: a", b"X: a\0b", b"X: a\0", b"X: \0", b"X: a\r\n b", b"X:\r\n b", b"Host:\r\n evil.example",
                    b"Content-Length: 5\0 6"):
            for before, behind in ((b"Host: localhost\r\n", b""), (b"", b"Host: localhost\r\n")):
                with Wire(d) as wire:
                    wire.send(b"GET /v1/datasets/wall HTTP/1.1\r\n" + before + odd + b"\r\n" + behind + b"\r\n",
                              b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    with contextlib.suppress(ConnectionResetError):
                        while wire.more():
                            pass
                    assert re.match(rb"HTTP/1.1 4\d\d ", wire.buffer) and b" 200 " not in wire.buffer, (odd, before, wire.buffer)
        with Wire(d) as wire:  # blanks around a value are nothing odd
            wire.send(b"GET /v1/status HTTP/1.1\r\nHost:localhost\r\nX:  a \t\r\nY:\r\nConnection: close\r\nZ: \r\n\r\n")
            assert wire.reply()[0] == 200 and wire.ended()


def test_a_nul_in_the_first_line_is_refused():
    """libmicrohttpd gives its parts as C strings, which end at the first NUL: the rest of a path, of a query, of a method."""
    with with_tours() as d:
        lines = [b"GET " + target + b" HTTP/1.1" for target in (
            b"/v1/status\0junk", b"/v1/status\0", b"\0/v1/status", b"/v1/datasets/wall\0/../x", b"/v1/status?\0",
            VIEW.encode() + b"?width=16&height=9&layer=id\0&bogus=1", VIEW.encode() + b"?width=16&height=9\0",
            b"/v1/status?wid\0=1", b"/v1/status%00\0")]
        lines += [b"GET\0junk /v1/status HTTP/1.1", b"GET\0 /v1/status HTTP/1.1", b"GET /v1/status HTTP/1.1\0junk"]
        for line in lines:
            for header in (b"Host: localhost\r\nX: 1\r\n", b"Host: localhost\r\n"):
                with Wire(d) as wire:
                    wire.send(line + b"\r\n" + header + b"\r\n", b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    with contextlib.suppress(ConnectionResetError):
                        while wire.more():
                            pass
                    assert re.match(rb"HTTP/1.[01] 4\d\d ", wire.buffer) and b" 200 " not in wire.buffer, (line, wire.buffer)
        for plain in (b"GET /v1/status HTTP/1.1", b"GET  /v1/status HTTP/1.1", b"GET /v1/status?a=%00%41 HTTP/1.1"):
            with Wire(d) as wire:
                wire.send(plain + b"\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                status, _, text = wire.reply()
                assert (status == 200 or b"'a'" in text or b"parameter" in text) and b"NUL" not in text, (plain, status, text)


def test_a_last_reply_arrives_whole_whatever_is_sent_behind_it():
    """Closing a socket with bytes unread resets it, and what it still had to send is lost."""
    with Daemon(FAKE) as d:
        expected = d.ask("/v1/openapi.json").body
        assert len(expected) > 50000
        for _ in range(3):
            s = socket.socket()
            s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)  # so that much of the reply has still to be sent
            s.settimeout(150)
            s.connect(("127.0.0.1", d.port))
            s.sendall(b"GET /v1/openapi.json HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n" + b"x" * 40000)
            received = b""
            while got := s.recv(512):
                received += got
            s.close()
            assert received.endswith(expected), len(received)


run(globals())
