"""One connection: bytes go out cut and paced as an exchange says, while what comes back is read, late or at once."""
import base64
import dataclasses
import json
import select
import socket
import struct
import time

from mutating import replies
from mutating.replies import Sent

WAIT_S = 40  # for the daemon to close: it cuts half a request after 10 s, and a machine may be slow


@dataclasses.dataclass
class Exchange:
    sents: list
    cuts: list = dataclasses.field(default_factory=list)  # (position, ms to wait there), ascending
    ending: str = "read"  # until the daemon closes; half: closed on our side first; drop, reset: we go, at once
    stop_at: int = 1 << 60  # bytes that are sent; then `ending`
    reads: str = "at once"  # or "late": once all is sent, "slowly": a little at a time, "little": leaves after some
    name: str = ""

    def tags(self):
        return sorted({tag for sent in self.sents for tag in sent.tags})

    def data(self, names):
        """What goes out; `names` fills the holes that recorded requests have for what the daemon names itself."""
        data = b"".join(sent.data for sent in self.sents)
        for hole, name in names.items():
            data = data.replace(hole, name)
        return data

    def to_json(self):
        row = dataclasses.asdict(self)
        for sent in row["sents"]:
            sent["data"] = base64.b85encode(sent["data"]).decode() if len(sent["data"]) > 4000 else \
                {"text": sent["data"].decode("latin-1")}
        return row

    @staticmethod
    def from_json(row):
        def sent(s):
            data = s["data"]["text"].encode("latin-1") if isinstance(s["data"], dict) else base64.b85decode(s["data"])
            return Sent(**{**s, "data": data, "statuses": tuple(s["statuses"]), "tags": tuple(s["tags"])})
        return Exchange(**{**row, "sents": [sent(s) for s in row["sents"]], "cuts": [tuple(c) for c in row["cuts"]]})


def _pieces(exchange, data):
    at = 0
    for position, pause_ms in exchange.cuts:
        if at < position < len(data):
            yield data[at:position], pause_ms / 1000
            at = position
    yield data[at:], 0


def _go_on_at(exchange):
    """Positions where the client waits to be told to send its body."""
    at, found = 0, set()
    for sent in exchange.sents:
        head = sent.data.find(b"\r\n\r\n") + 4
        if sent.continues and head > 4:
            found.add(at + head)
        at += len(sent.data)
    return found


def converse(port, exchange, names, wait_s=WAIT_S):
    """(bytes that came back, how it ended: see replies.fault)."""
    data = exchange.data(names)[:exchange.stop_at]
    received, ended = bytearray(), None
    s = socket.socket()
    if exchange.reads == "slowly":
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    try:
        s.settimeout(wait_s)
        s.connect(("127.0.0.1", port))
        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        ended = _talk(s, exchange, data, received, wait_s)
        if ended == "left" and exchange.ending == "reset":
            s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    except ConnectionRefusedError:
        ended = "refused"
    except OSError as error:
        ended = "timeout" if isinstance(error, TimeoutError) else "reset"
    finally:
        s.close()
    return bytes(received), ended


def _talk(s, exchange, data, received, wait_s):
    s.setblocking(False)
    pieces, waits = list(_pieces(exchange, data)), _go_on_at(exchange)
    out, sent, not_before, closed_ours, broken = b"", 0, 0.0, False, False
    end = time.monotonic() + wait_s
    while True:
        now = time.monotonic()
        if now > end:
            return "timeout"
        if not out and pieces and now >= not_before:
            out, pause = pieces.pop(0)
            not_before = now + pause
            if sent in waits and not received:  # a server that says nothing is not waited for long
                select.select([s], [], [], 0.1)
        if not out and not pieces and not closed_ours:
            if exchange.ending in ("drop", "reset"):
                return "left"
            if exchange.ending == "half":
                s.shutdown(socket.SHUT_WR)
            closed_ours = True
        reads = exchange.reads != "late" or (not out and not pieces) or broken
        timeout = min(end - now, max(0, not_before - now)) if pieces and not out else min(end - now, 1)
        readable, writable, _ = select.select([s] if reads else [], [s] if out else [], [], timeout)
        if readable:
            try:
                got = s.recv(512 if exchange.reads in ("slowly", "little") else 65536)
            except ConnectionResetError:
                return "reset"
            if not got:
                return "reset" if broken else "half" if exchange.ending == "half" and closed_ours else "eof"
            received += got
            if exchange.reads == "little" and len(received) > 700:
                return "left"
        if writable:
            try:
                step = s.send(out[:65536])
                sent, out = sent + step, out[step:]
            except (BrokenPipeError, ConnectionResetError):
                out, pieces, closed_ours, broken = b"", [], True, True  # what it had to say may still be there


def show(exchange, received, names):
    """For people, and short."""
    def cut(data):
        return repr(data if len(data) < 1500 else data[:700] + b" ... %d bytes ... " % (len(data) - 1000) + data[-300:])
    lines = [f"  {'+'.join(sent.tags) or 'plain'} (expected: {sent.expect}): {cut(sent.data)}" for sent in exchange.sents]
    return "\n".join([f"  ending {exchange.ending}, reading {exchange.reads}, {len(exchange.cuts)} cuts, "
                      f"{min(exchange.stop_at, len(exchange.data(names)))} bytes", *lines, f"  received {cut(received)}"])


def judge(port, exchange, names, wait_s=WAIT_S):
    """(what is wrong or None, what came back, how it ended)."""
    received, ended = converse(port, exchange, names, wait_s)
    if ended == "refused":
        return "refused", received, ended
    return replies.fault(exchange.sents, received, ended), received, ended


def save(path, seed, exchanges, what):
    with open(path, "w", encoding="utf-8") as file:
        json.dump({"seed": seed, "fault": what, "exchanges": [e.to_json() for e in exchanges]}, file, indent=1)


def load(path):
    with open(path, encoding="utf-8") as file:
        return [Exchange.from_json(row) for row in json.load(file)["exchanges"]]
