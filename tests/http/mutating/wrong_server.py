"""A small server that is wrong on purpose, one fault at a time: mutate.py must find each, and none where there is none."""
import itertools
import json
import re
import socket
import struct
import threading
import time

from mutating import drafts, mutations, replies, wire

HEAD = re.compile(rb"\A([A-Z]+) (\S+) HTTP/(1\.[01])\r\n((?:[^\r\n]+\r\n)*)\r\n")
CHUNK = re.compile(rb"\A([0-9a-f]{1,6})\r\n", re.IGNORECASE)
LENGTHS, CODINGS = (re.compile(rb"(?im)^%b:[ \t]*(.*?)[ \t]*\r$" % name) for name in (b"content-length", b"transfer-encoding"))


class Refused(Exception):
    pass


def _reply(status, own, body, close, extra=b"", length=None):
    return (b"HTTP/1.1 %d Some Reason\r\nX-Request-Id: %b\r\n%b%bContent-Length: %d\r\n\r\n" %
            (status, own, b"Connection: close\r\n" * close, extra, len(body) if length is None else length)) + body


class Server:
    """Understands what it must of HTTP to be right; `fault` names what it does wrong."""

    def __init__(self, fault):
        self.fault, self.held = fault, None
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                s, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(s,), daemon=True).start()

    def _serve(self, s):
        data, held = b"", b""
        with s:
            s.settimeout(60)
            try:
                while True:
                    found = self._take(data)
                    while not found:
                        got = s.recv(65536)
                        if not got:
                            return
                        data += got
                        found = self._take(data)
                    method, own, close, end = found
                    data = data[end:]
                    answer = self._answer(method, own, close, s)
                    if self.fault == "out of order" and not close and not held and not own.endswith(b".1"):
                        held = answer
                        continue
                    s.sendall(answer + held)
                    held = b""
                    if close and self.fault != "stays open":
                        return
                    if close:
                        time.sleep(60)
            except Refused:
                s.sendall(_reply(400, b"none", b"", True).replace(b"X-Request-Id: none\r\n", b""))
            except (OSError, ValueError):
                pass
            finally:
                try:
                    s.shutdown(socket.SHUT_WR)
                    while s.recv(65536):  # or what was said may be lost
                        pass
                except OSError:
                    pass

    def _take(self, data):
        """(method, id, closes, end) of the first request in `data`, or None when it is not whole."""
        head_end = data.find(b"\r\n\r\n")
        if head_end < 0:
            return None
        head = HEAD.match(data)
        if not head:
            raise Refused
        lengths, codings, at = LENGTHS.findall(head[4]), CODINGS.findall(head[4]), head_end + 4
        if self.fault != "takes both" and lengths and codings or len(codings) > 1 or len(lengths) > 1 and self.fault != "takes two":
            raise Refused
        if codings:
            if codings[0].lower() != b"chunked":
                raise Refused
            while True:
                size = CHUNK.match(data[at:at + 20])
                if not size:
                    if len(data) - at > 9 or b"\n" in data[at:]:
                        raise Refused
                    return None
                at += size.end() + int(size[1], 16) + 2
                if len(data) < at:
                    return None
                if data[at - 2:at] != b"\r\n":
                    raise Refused
                if not int(size[1], 16):
                    break
        elif lengths:
            if not lengths[0].isdigit() and self.fault != "takes plus":
                raise Refused
            at += int(lengths[0])
        if len(data) < at:
            return None
        own = re.search(rb"X-Request-Id: (\S+)", head[4])
        return head[1], own[1] if own else b"none", b"Connection: close" in head[4], at

    def _answer(self, method, own, close, s):
        fault, body, some = self.fault, b'{"id": "wall"}', not close
        if fault == "other id" and some:
            own = b"other"
        if fault == "late chunk" and some:
            return b"HTTP/1.1 200 OK\r\nX-Request-Id: " + own + b"\r\nTransfer-Encoding: chunked\r\n\r\n" + \
                (b"" if method == b"HEAD" else b"e\r\n" + body + b"\r\n0\r\n\r\n0\r\n\r\n")
        if fault == "last chunk of HEAD" and method == b"HEAD":
            return b"HTTP/1.1 200 OK\r\nX-Request-Id: " + own + b"\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"
        if fault == "reset" and some:
            s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            s.close()
            return b""
        whole = {
            "extra bytes": lambda: _reply(200, own, body, close) + b"\r\n" * some,
            "missing byte": lambda: _reply(200, own, body, close, length=len(body) + some),
            "short by one": lambda: _reply(200, own, body, close, length=len(body) - some),
            "continue": lambda: b"HTTP/1.1 100 Continue\r\n\r\n" * some + _reply(200, own, body, close),
            "late continue": lambda: _reply(200, own, body, close) + b"HTTP/1.1 100 Continue\r\n\r\n" * some,
            "twice": lambda: _reply(200, own, body, close) * (2 if some else 1),
            "two lengths": lambda: _reply(200, own, body, close, b"Content-Length: 9\r\n" * some),
            "both framings": lambda: _reply(200, own, body, close, b"Transfer-Encoding: chunked\r\n" * some),
            "bare lf": lambda: _reply(200, own, body, close).replace(b"\r\n", b"\n" if some else b"\r\n"),
            "500": lambda: _reply(500 if some else 200, own, b"" if some else body, close),
            "says close": lambda: _reply(200, own, body, True),
            "says nothing of close": lambda: _reply(200, own, body, False),
            "body of 204": lambda: _reply(204, own, body, close) if some else _reply(200, own, body, close),
            "other problem": lambda: _reply(404, own, json.dumps({"instance": "urn:splatd:request:z", "status": 404}).encode(), close)
            if some else _reply(200, own, body, close),
        }.get(fault, lambda: _reply(200, own, body, close))()
        if method == b"HEAD" and fault != "body of HEAD":
            whole = whole[:-len(body)] if whole.endswith(body) else whole
        return whole


def _exchanges():
    """Plain ones, and those that a right server refuses."""
    def plain(i, **more):
        return drafts.Draft(id=f"m0.{i}", **more).sent()

    def refused(name):
        import random
        draft = drafts.Draft("POST", id="m0.0")
        mutations.ALL[name](random.Random(1), draft)
        draft.tags.append(name)
        return draft.sent()
    last = drafts.canary("m0.9")
    yield wire.Exchange([plain(0), plain(1), plain(2, method="HEAD"), plain(3), last])
    yield wire.Exchange([plain(0, method="HEAD"), last], cuts=[(i, 0) for i in range(1, 150)])
    for name in ("chunks", "chunks-lower", "length-plus", "length-twice-differs", "both", "both-2", "chunk-word"):
        yield wire.Exchange([refused(name), plain(1), last])


FAULTS = ["body of HEAD", "last chunk of HEAD", "out of order", "extra bytes", "missing byte", "short by one", "late chunk", "continue",
          "late continue", "twice", "other id", "two lengths", "both framings", "bare lf", "500", "says close", "reset",
          "says nothing of close", "stays open", "body of 204", "other problem", "takes both", "takes two", "takes plus"]


def _found(fault):
    server = Server(fault)
    try:
        for exchange in _exchanges():
            received, ended = wire.converse(server.port, exchange, {}, 2 if fault else 60)  # a right one is given time
            wrong = replies.fault(exchange.sents, received, ended)
            if wrong:
                return wrong
        return None
    finally:
        server.listener.close()


def _replays():
    """What is saved is what is sent again."""
    import os
    import tempfile
    from mutating import plan
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "x.json")
        some = [plan.exchange(5, n) for n in range(40)]
        wire.save(path, 5, some, "what")
        return wire.load(path) == some == [plan.exchange(5, n) for n in range(40)]


def self_test():
    missed = [f"{fault or 'nothing'} wrong: {wrong or 'nothing found'}"
              for fault, wrong in zip(itertools.chain([None], FAULTS), map(_found, itertools.chain([None], FAULTS)))
              if (wrong is not None) != (fault is not None)]
    if not _replays():
        missed.append("an exchange that was saved is another one when it is read again")
    print("\n".join(missed) or f"{len(FAULTS)} planted faults found, none where there is none")
    return 1 if missed else 0
