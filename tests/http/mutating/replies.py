"""What a connection must carry back for the requests that went into it.

Strict, where clients are mild: exact line ends, no header of framing twice, chunks to the byte, nothing after HEAD, 204 and 304,
each reply with the X-Request-Id of the request whose turn it is, and nothing left over. `fault()` is a pure function of
what was sent, what was received and how the connection ended, so that --self-test can plant whatever it likes."""
import dataclasses
import json
import re

STATUS_LINE = re.compile(rb"HTTP/1\.1 ([1-5]\d\d) [\x20-\x7e]*\r\n")
FIELD = re.compile(rb"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[ \t]*([\x20-\x7e]*)\r\n")
CHUNK = re.compile(rb"([0-9a-fA-F]{1,8})\r\n")
SINGLE = {"content-length", "transfer-encoding", "connection", "x-request-id", "content-type", "date"}

# What a request may hope for.
ANSWER = "answer"  # framed as it should be: one reply, with its id
EITHER = "either"  # broken without being ambiguous: that reply, or a refusal as below
REFUSE = "refuse"  # where it ends is a matter of opinion: 4xx or 5xx, closed, and nothing behind it is read
REST = "rest"  # from here on the bytes are no requests of ours; replies need only look like some


@dataclasses.dataclass
class Sent:
    data: bytes
    method: str = "GET"
    id: str = ""
    expect: str = ANSWER
    version: str = "1.1"
    closes: bool = False  # asks for the end of the connection
    may_close: bool = False  # may be answered before all of its body is read, and the connection closed then
    may_break: bool = False  # a stream whose source can go away, which only a broken end can say
    continues: bool = False  # asked to be told to go on
    statuses: tuple = ()  # () = any that is no fault by itself
    tags: tuple = ()  # what was done to it


@dataclasses.dataclass
class Reply:
    status: int
    headers: dict
    body: bytes
    end: int  # position behind it
    framed: bool  # False: it ends with the connection


class Short(Exception):
    """The bytes end before the reply does."""


class Fault(Exception):
    pass


def _match(pattern, data, at, what):
    found = pattern.match(data, at)
    if not found:
        line_end = data.find(b"\n", at)
        if line_end < 0 and len(data) - at < 20000:
            raise Short(what)
        raise Fault(f"no {what}: {data[at:at + 80]!r}")
    return found


def _chunks(data, at):
    body = b""
    while True:
        found = _match(CHUNK, data, at, "chunk size")
        at, length = found.end(), int(found[1], 16)
        if not length:
            while data[at:at + 2] != b"\r\n":
                at = _match(FIELD, data, at, "trailer").end()
            return body, at + 2
        if len(data) < at + length + 2:
            raise Short("chunk")
        if data[at + length:at + length + 2] != b"\r\n":
            raise Fault(f"a chunk of {length} bytes is followed by {data[at + length:at + length + 20]!r}")
        body += data[at:at + length]
        at += length + 2


def _behind_double_head(data, at):
    """Where the reply at `at` really begins. Where several requests could be meant, libmicrohttpd 0.9.75 refuses cookies that its
    pool has no room for itself, with its head twice; the connection is closed behind it and nothing is read out of step."""
    end = data.find(b"\r\n\r\n", at) + 4
    head = data[at:end]
    double = end > 4 and data.startswith(head, end) and b"X-Request-Id" not in head and b"\r\nConnection: close\r\n" in head
    return end if double and head.startswith(b"HTTP/1.1 431 ") else at


def read_reply(data, at, method, ended):
    """The reply that begins at `at`; raises Short or Fault."""
    at = _behind_double_head(data, at)
    found = _match(STATUS_LINE, data, at, "status line")
    at, status, headers = found.end(), int(found[1]), {}
    while data[at:at + 2] != b"\r\n":
        found = _match(FIELD, data, at, "header")
        name, value = found[1].decode().lower(), found[2].decode().strip()
        if name in headers and name in SINGLE:
            raise Fault(f"header {name} stands twice in one reply")
        headers[name], at = value, found.end()
    at += 2
    length, coding = headers.get("content-length"), headers.get("transfer-encoding")
    if length is not None and coding is not None:
        raise Fault("a reply with Content-Length and Transfer-Encoding")
    if length is not None and not re.fullmatch(r"\d{1,18}", length):
        raise Fault(f"a reply with Content-Length: {length}")
    if status < 200 or status == 204:
        if coding or length not in (None, "0"):
            raise Fault(f"a {status} with a body")
        return Reply(status, headers, b"", at, True)
    unread = status in (400, 408, 413, 414, 431)  # nobody may have read the method yet
    if status == 304 or method == "HEAD" and not (unread and at < len(data) and headers.get("connection") == "close"):
        return Reply(status, headers, b"", at, True)
    if coding is not None:
        if coding.lower() != "chunked":
            raise Fault(f"a reply with Transfer-Encoding: {coding}")
        body, at = _chunks(data, at)
        return Reply(status, headers, body, at, True)
    if length is not None:
        if len(data) < at + int(length):
            raise Short("body")
        return Reply(status, headers, data[at:at + int(length)], at + int(length), True)
    if ended not in ("eof", "half"):
        raise Short("body that ends with the connection")
    return Reply(status, headers, data[at:], len(data), False)


def stays_open(reply, version):
    words = [word.strip().lower() for word in reply.headers.get("connection", "").split(",")]
    return reply.framed and "close" not in words and (version == "1.1" or "keep-alive" in words)


def _check_reply(sent, reply):
    """Of a whole reply that is taken for the one to `sent`."""
    own, status = reply.headers.get("x-request-id"), reply.status
    refused = status >= 400 and not stays_open(reply, sent.version)
    if sent.expect == REFUSE and not refused:
        raise Fault(f"answered with {status} and {'goes on' if stays_open(reply, sent.version) else 'ends'}, "
                    "though nobody knows where this request ends")
    early = refused and sent.expect != ANSWER and (own is None or status == 414 and not own.startswith("m"))
    if sent.id and own != sent.id and not early:  # its headers may not have been read
        raise Fault(f"the reply to {sent.id} is that to {own}, status {status}")
    if status in (500, 502, 504) or status >= 500 and "x-request-id" not in reply.headers and sent.expect == ANSWER:
        raise Fault(f"status {status}: {reply.body[:200]!r}")
    if sent.statuses and status not in sent.statuses and not (sent.expect != ANSWER and refused):
        raise Fault(f"status {status}, expected {sent.statuses}: {reply.body[:200]!r}")
    if sent.version == "1.0" and "transfer-encoding" in reply.headers:
        raise Fault("chunks for HTTP/1.0")
    if sent.closes and stays_open(reply, sent.version):
        raise Fault("asked to close, and says that the connection stays open")
    if own and status >= 400 and reply.body:
        problem = json.loads(reply.body)
        if problem["instance"] != f"urn:splatd:request:{own}" or problem["status"] != status:
            raise Fault(f"a problem about {problem['instance']} in the reply to {own}")


def _check_rest(sents, at, data):
    """What came for bytes that only the daemon knows how to read."""
    ids = [sent.id for sent in sents if sent.id]
    if at < len(data) and not data.startswith(b"HTTP/1.1 ", at):
        raise Fault(f"bytes that begin no reply: {data[at:at + 80]!r}")
    for own in re.findall(rb"\r\nX-Request-Id: m([\w.-]+)\r\n", data[at:]):
        own = "m" + own.decode()
        if own not in ids:
            raise Fault(f"the reply to {own} came twice or too late")
        ids = ids[ids.index(own) + 1:]


def _next_reply(sent, at, data, ended):
    """The reply to `sent`, behind what tells it to go on; None where there is none and need not be."""
    asked = sent.continues
    while True:
        if at == len(data):
            if ended in ("left", "half") or ended == "eof" and (sent.expect == EITHER or sent.may_break):
                return None
            raise Fault(f"no reply: {ended}")
        try:
            reply = read_reply(data, at, sent.method, ended)
        except Short as short:
            if ended == "left" or sent.may_break:
                return None
            raise Fault(f"the reply ends within its {short}: {data[at:][-80:]!r}, {ended}") from None
        if reply.status >= 200:
            return reply
        if reply.status != 100 or not asked:
            raise Fault(f"a {reply.status} that nobody asked for")
        at, asked = reply.end, False


def _check_end(sent, reply, at, data, ended):
    """Of the connection, behind a reply that says it is the last."""
    if reply.status < 400 and not sent.closes and sent.version == "1.1" and not sent.may_close and sent.expect == ANSWER \
            and sent.method != "HEAD":
        raise Fault(f"closed behind a reply of {reply.status}, though nobody asked for it")
    if at < len(data):
        raise Fault(f"bytes behind a reply that was the last: {data[at:at + 80]!r}")
    if ended == "timeout":
        raise Fault("said that it closes, and did not")


def _walk(sents, data, ended):
    """`ended`: eof, reset, timeout (the daemon's end was waited for in vain), left (we went first), half (we closed our side
    first and it then closed its own: who does so counts as gone)."""
    at = 0
    # who closes while bytes of ours are unread resets the connection, and what it had said before may be lost on its way
    if ended == "reset" and any(sent.may_close or sent.expect != ANSWER for sent in sents):
        ended = "left"
    for number, sent in enumerate(sents):
        try:
            if sent.expect == REST:
                return _check_rest(sents[number:], at, data)
            reply = _next_reply(sent, at, data, ended)
            if not reply:
                return None
            at = reply.end
            _check_reply(sent, reply)
            if not stays_open(reply, sent.version):
                return _check_end(sent, reply, at, data, ended)
        except (Fault, ValueError, KeyError, TypeError) as found:  # the last three of a problem document
            raise Fault(f"{'+'.join(sent.tags) or 'plain'} {sent.method} {sent.id or number}: {found}") from None
    if at < len(data):
        raise Fault(f"bytes behind the last reply: {data[at:at + 80]!r}")
    if ended == "timeout":
        raise Fault("still open")
    return None


def fault(sents, data, ended):
    """What is wrong, in a line; None when nothing is."""
    try:
        _walk(sents, data, ended)
    except Fault as found:
        return str(found)
    return None
