"""What is done to a request, and what the daemon may then do: see replies.py for ANSWER, EITHER, REFUSE and REST.

A new mutation is a row of one of the tables below. Framing that readers of HTTP disagree about (RFC 9112, 6.3 and 11.2) must be
refused, because who reads it otherwise than a proxy in front answers one client with another's reply."""
import json

from mutating.replies import ANSWER, EITHER, REFUSE, REST
from random_requests import HOSTILE


def _length(value, expect, more=()):
    def mutate(r, d):
        d.need_body()
        text = value(len(d.body)) if callable(value) else value
        d.framing = [line + b"%b" % text for line in (b"Content-Length: ",)] + [m(len(d.body)) for m in more]
        d.worse(expect)
    return mutate


def _less(r, d):
    d.need_body()
    d.framing = [b"Content-Length: %d" % (len(d.body) * r.choice([0, 1, 2]) // 3)] if r.random() < 0.7 else []
    d.statuses, d.rest_behind = (), len(d.body) > 0


def _more(r, d):
    d.need_body()
    d.framing = [b"Content-Length: %d" % (len(d.body) + r.choice([1, 2, 50, 5000]))]
    d.worse(EITHER)
    d.statuses, d.rest_behind, d.half = (), True, True


def _raw(*lines, expect=REFUSE):
    """Framing of these lines, %d being the body's length."""
    def mutate(r, d):
        d.need_body()
        d.framing = [line.replace(b"%d", b"%d" % len(d.body)) for line in lines]
        d.worse(expect)
    return mutate


LENGTHS = {
    "length-less": _less,
    "length-more": _more,
    "length-twice": _raw(b"Content-Length: %d", b"Content-Length: %d", expect=EITHER),
    "length-twice-differs": _raw(b"Content-Length: %d", b"Content-Length: 0"),
    "length-twice-differs-2": _raw(b"Content-Length: 0", b"content-length: %d"),
    "length-list": _raw(b"Content-Length: %d, %d", expect=EITHER),
    "length-list-differs": _raw(b"Content-Length: %d, 0"),
    "length-negative": _length(lambda n: b"-%d" % n, REFUSE),
    "length-minus-one": _length(b"-1", REFUSE),
    "length-plus": _length(lambda n: b"+%d" % n, REFUSE),
    "length-hex": _length(lambda n: b"0x%x" % n, REFUSE),
    "length-exponent": _length(b"1e1", REFUSE),
    "length-empty": _length(b"", REFUSE),
    "length-word": _length(b"ten", REFUSE),
    "length-space": _length(b"1 0", REFUSE),
    "length-tail": _length(lambda n: b"%d;" % n, REFUSE),
    "length-8-bit": _length(lambda n: b"%d\xb2" % n, REFUSE),
    "length-nul": _length(lambda n: b"%d\0" % n, EITHER),  # libmicrohttpd reads up to the NUL and tells nobody
    "length-2^64": _length(lambda n: b"%d" % ((1 << 64) + n), REFUSE),
    "length-2^64-1": _length(b"18446744073709551615", REFUSE),
    "length-2^63": _length(b"9223372036854775808", REFUSE),
    "length-10^40": _length(b"1" + b"0" * 40, REFUSE),
    "length-zeros": _length(lambda n: b"%020d" % n, EITHER),
    "length-blanks": _length(lambda n: b" \t %d \t" % n, EITHER),
    "length-space-colon": _raw(b"Content-Length : %d"),
    "length-folded": _raw(b"Content-Length:\r\n %d", expect=EITHER),
    "length-no-colon": _raw(b"Content-Length %d"),
}


def chunked(r, body, size, extension=False, zeros=False):
    out, at = [], 0
    while at < len(body):
        piece = body[at:at + size(r)]
        word = (b"%X" if r.random() < 0.5 else b"%x") % len(piece)
        out.append((b"0" * r.randrange(6) if zeros else b"") + word +
                   (r.choice([b";a", b";a=b", b';a="b;c"', b" ; a = b"]) if extension else b"") + b"\r\n" + piece + b"\r\n")
        at += len(piece)
    return b"".join(out)


SIZES = [lambda r: 1, lambda r: 1000, lambda r: 8192, lambda r: 65536, lambda r: r.randrange(1, 3000), lambda r: 1 << 30]


def _chunks(extension=False, zeros=False, last=b"0\r\n\r\n", coding=b"Transfer-Encoding: chunked", expect=ANSWER):
    def mutate(r, d):
        d.need_body()
        size = r.choice(SIZES[1:] if len(d.body) > 20000 else SIZES)
        d.framing, d.sent_body = [coding], chunked(r, d.body, size, extension, zeros) + last
        d.worse(expect)
    return mutate


def _bad_chunk(head, expect=REFUSE, half=False):
    """A chunk whose size line is `head`, behind one that is as it should be."""
    def mutate(r, d):
        _chunks()(r, d)
        d.sent_body = b"5\r\n     \r\n" * r.randrange(2) + head + b"\r\n" + b"y" * 9 + b"\r\n0\r\n\r\n"
        d.worse(expect)
        d.statuses, d.half, d.rest_behind = (), half, half
    return mutate


def _open_end(r, d):
    _chunks(last=b"")(r, d)
    d.worse(EITHER)
    d.statuses, d.half, d.rest_behind = (), True, True


def _coding(*lines, expect=REFUSE):
    """Chunks under these lines of framing."""
    def mutate(r, d):
        _chunks()(r, d)
        d.framing = [line.replace(b"%d", b"%d" % r.choice([0, 5, len(d.body), len(d.sent_body)])) for line in lines]
        d.worse(expect)
    return mutate


def _coding_1_0(r, d):
    _chunks(expect=EITHER)(r, d)
    d.version, d.closes = "1.0", True


CHUNKS = {
    "chunks": _chunks(), "chunks-again": _chunks(), "chunks-more": _chunks(),
    "chunks-extension": _chunks(extension=True, expect=EITHER),  # libmicrohttpd 0.9.75 takes none
    "chunks-zeros": _chunks(zeros=True),
    "chunks-last-000": _chunks(last=b"000\r\n\r\n"),
    "chunks-last-extension": _chunks(last=b"0;end\r\n\r\n", expect=EITHER),
    "chunks-trailer": _chunks(last=b"0\r\nX-Sum: 5\r\n\r\n"),
    "chunks-trailer-framing": _chunks(last=b"0\r\nContent-Length: 5\r\nTransfer-Encoding: gzip\r\n\r\n", expect=EITHER),
    "chunks-trailer-id": _chunks(last=b"0\r\nX-Request-Id: another\r\n\r\n"),
    "chunks-trailer-large": _chunks(last=b"0\r\nX: " + b"y" * 20000 + b"\r\n\r\n", expect=EITHER),
    "chunks-trailer-broken": _chunks(last=b"0\r\nno colon\r\n\r\n", expect=EITHER),
    "chunks-lower": _chunks(coding=b"transfer-encoding: chunked"),
    "chunks-Chunked": _chunks(coding=b"Transfer-Encoding: Chunked"),
    "chunks-blanks": _chunks(coding=b"Transfer-Encoding:  \tchunked\t ", expect=EITHER),
    "chunks-no-end": _open_end,
    "chunk-word": _bad_chunk(b"zz"), "chunk-negative": _bad_chunk(b"-5"), "chunk-plus": _bad_chunk(b"+9"),
    "chunk-empty": _bad_chunk(b""), "chunk-0x": _bad_chunk(b"0x9"), "chunk-space": _bad_chunk(b" 9"),
    "chunk-8-bit": _bad_chunk(b"9\xb2"), "chunk-nul": _bad_chunk(b"9\0"), "chunk-too-short": _bad_chunk(b"3"),
    "chunk-2^64": _bad_chunk(b"10000000000000009"), "chunk-10^40": _bad_chunk(b"1" + b"0" * 40),
    "chunk-2^64-1": _bad_chunk(b"FFFFFFFFFFFFFFFF", EITHER, half=True),
    "chunk-too-long": _bad_chunk(b"f0", EITHER, half=True),
    "chunk-cr": _bad_chunk(b"9\r", REFUSE), "chunk-extension-large": _bad_chunk(b"9;" + b"e" * 20000, EITHER),
    "both": _coding(b"Content-Length: %d", b"Transfer-Encoding: chunked"),
    "both-2": _coding(b"Transfer-Encoding: chunked", b"Content-Length: %d"),
    "coding-gzip": _coding(b"Transfer-Encoding: gzip"),
    "coding-gzip-chunked": _coding(b"Transfer-Encoding: gzip, chunked"),
    "coding-chunked-gzip": _coding(b"Transfer-Encoding: chunked, gzip"),
    "coding-identity": _coding(b"Transfer-Encoding: identity"),
    "coding-xchunked": _coding(b"Transfer-Encoding: xchunked"),
    "coding-empty": _coding(b"Transfer-Encoding:"),
    "coding-parameter": _coding(b"Transfer-Encoding: chunked;q=1"),
    "coding-quoted": _coding(b'Transfer-Encoding: "chunked"'),
    "coding-vt": _coding(b"Transfer-Encoding: \x0bchunked"),
    "coding-twice": _coding(b"Transfer-Encoding: chunked, chunked"),
    "coding-twice-2": _coding(b"Transfer-Encoding: chunked", b"Transfer-Encoding: chunked"),
    "coding-two": _coding(b"Transfer-Encoding: gzip", b"Transfer-Encoding: chunked"),
    "coding-two-2": _coding(b"Transfer-Encoding: chunked", b"Transfer-Encoding: gzip"),
    "coding-and-length": _coding(b"Transfer-Encoding: gzip", b"Content-Length: %d"),
    "coding-space-colon": _coding(b"Transfer-Encoding : chunked"),
    "coding-folded": _coding(b"Transfer-Encoding:\r\n chunked", expect=EITHER),
    "coding-1.0": _coding_1_0,
}


def _field(*lines, expect=ANSWER, **more):
    def mutate(r, d):
        d.fields = d.fields + list(lines)
        d.worse(expect)
        for name, value in more.items():
            setattr(d, name, value)
        alive = more.get("closes") is False or b"Connection: keep-alive" in lines
        if alive and d.version == "1.0" and not any(b"lose" in field for field in d.fields):
            d.closes = False
    return mutate


def _lines_end(mark):
    def mutate(r, d):
        d.end_of_line = mark
        bare = mark == b"\r"  # where such lines end nobody can say
        d.worse(REST if bare else EITHER)
        d.rest_behind, d.half = d.rest_behind or bare, d.half or bare
    return mutate


def _hosts(*lines):
    def mutate(r, d):
        d.fields = [f for f in d.fields if not f.startswith(b"Host")] + list(lines)
        d.statuses = ()
        d.worse(EITHER)
    return mutate


def _continue(value=b"100-continue", expect=ANSWER, continues=True):
    def mutate(r, d):
        d.need_body()
        d.fields = d.fields + [b"Expect: " + value]
        d.continues = d.continues or continues
        d.worse(expect)
    return mutate


FIELDS = {
    "close": _field(b"Connection: close", closes=True),
    "close-list": _field(b"Connection: keep-alive, Close", closes=True, expect=EITHER),
    "keep-alive": _field(b"Connection: keep-alive"),
    "upgrade": _field(b"Connection: Upgrade, HTTP2-Settings", b"Upgrade: h2c", b"HTTP2-Settings: AAMAAABk"),
    "websocket": _field(b"Connection: upgrade", b"Upgrade: websocket", b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="),
    "connection-odd": _field(b"Connection: content-length, transfer-encoding, x-request-id"),
    "continue": _continue(), "continue-again": _continue(), "continue-Case": _continue(b"100-Continue"),
    "expect-odd": _continue(b"200-ok", EITHER, False), "expect-empty": _continue(b"", EITHER, False),
    "range": _field(b"Range: bytes=0-0"), "range-end": _field(b"Range: bytes=-5"), "range-odd": _field(b"Range: bytes=9-2,-,x"),
    "range-huge": _field(b"Range: bytes=18446744073709551615-18446744073709551616"),
    "none-match": _field(b"If-None-Match: *", statuses=()), "none-match-long": _field(b"If-None-Match: " + b'"x", ' * 300, statuses=()),
    "cookie": _field(b"Cookie: " + b"a=b; " * 20), "cookie-long": _field(b"Cookie: " + b"a=b;" * 1500, expect=EITHER),
    "encoding": _field(b"Accept-Encoding: gzip;q=0.0, identity;q=0", b"TE: trailers, gzip"),
    "authorization": _field(b"Authorization: Basic Og==", b"Authorization: Bearer x", expect=EITHER, statuses=()),
    "id-twice": _field(b"X-Request-Id: second"), "large": _field(b"X-Large: " + b"y" * 3000, expect=EITHER),
    "larger": _field(b"X-Large: " + b"y" * 13000, expect=EITHER), "largest": _field(b"X-Large: " + b"y" * 70000, expect=EITHER),
    "many": _field(*[b"X-%d: y" % i for i in range(100)], expect=EITHER),
    "too-many": _field(*[b"X-%d: y" % i for i in range(1000)], expect=EITHER),
    "folded": _field(b"X-Fold: a\r\n b\r\n\tc", expect=EITHER), "fold-first": _field(b" X-Fold: a", expect=EITHER),
    "nul": _field(b"X-Nul: a\0b", expect=EITHER), "nul-name": _field(b"X-\0: a", expect=EITHER),
    "8-bit": _field(b"X-8: \xff\xfe\x80", expect=EITHER), "8-bit-name": _field(b"X-\xe9\xff: a", expect=EITHER),
    "cr": _field(b"X-Cr: a\rb", expect=EITHER), "no-colon": _field(b"nothing here", expect=EITHER),
    "no-name": _field(b": a", expect=EITHER, statuses=(), rest_behind=True, half=True), "space-colon": _field(b"X-Space : a", expect=EITHER, statuses=()),
    "bare-lf": _lines_end(b"\n"), "bare-cr": _lines_end(b"\r"), "cr-cr-lf": _lines_end(b"\r\r\n"),
    "no-host": _hosts(), "two-hosts": _hosts(b"Host: a", b"Host: b"), "host-odd": _hosts(b"Host: \x7f@:99999/%00"),
}


def _line(change, expect=EITHER, plain=False, **more):
    """Another request line; `plain`: method and version stay what they are for the reply."""
    def mutate(r, d):
        d.line = change(r, d)
        d.worse(expect)
        d.statuses = ()
        if not plain and d.method == "HEAD":
            d.method = "GET"
            d.line = change(r, d)
        for name, value in more.items():
            setattr(d, name, value)
    return mutate


def _method(name, expect=ANSWER):
    def mutate(r, d):
        d.method, d.statuses = name, ()
        d.worse(expect)
    return mutate


def _target(change, expect=EITHER):
    def mutate(r, d):
        d.target, d.statuses = change(r, d.target), ()
        d.worse(expect)
    return mutate


def _version_1_0(alive):
    def mutate(r, d):
        d.version, d.closes = "1.0", not alive
        d.fields = d.fields + [b"Connection: keep-alive"] * alive
    return mutate


def _versioned(text, **more):
    return _line(lambda r, d: d.method.encode("latin-1") + b" " + d.target + text, **more)


LINES = {
    "brew": _method("BREW"), "lower-case": _method("get"), "patch": _method("PATCH"), "options": _method("OPTIONS"),
    "trace": _method("TRACE"), "connect": _method("CONNECT"), "m-search": _method("M-SEARCH"),
    "long-method": _method("G" * 1000, EITHER), "longest-method": _method("G" * 20000, EITHER), "method-odd": _method("G(){}", EITHER),
    "method-8-bit": _method("G\xe9T", EITHER), "absolute": _target(lambda r, t: b"http://x" + t, ANSWER),
    "absolute-odd": _target(lambda r, t: b"HTTPS://a:b@[::1]:99999" + t), "authority": _target(lambda r, t: b"x:80"),
    "star": _target(lambda r, t: b"*"), "fragment": _target(lambda r, t: t + b"#frag?a=b"),
    "percent": _target(lambda r, t: t + r.choice([b"%", b"%0", b"%zz", b"%00", b"%ff%fe", b"%2e%2e%2f", b"%25%30%30"])),
    "hostile": _target(lambda r, t: t + b"?" + r.choice(HOSTILE).replace(" ", "").encode()),
    "dots": _target(lambda r, t: b"/.." * 9 + t), "slashes": _target(lambda r, t: t.replace(b"/", b"//")),
    "8-kib": _target(lambda r, t: t + b"?" + b"a" * (8190 - len(t) + r.randrange(4))),
    "9-kib": _target(lambda r, t: t + b"?" + b"a" * 9000), "13-kib": _target(lambda r, t: t + b"?" + b"a" * 13000),
    "64-kib": _target(lambda r, t: t + b"a" * 65000), "parameters": _target(lambda r, t: t + b"?" + b"a&" * 70),
    "parameters-more": _target(lambda r, t: t + b"?" + b"a=b&" * 2000), "target-empty": _target(lambda r, t: b""),
    "target-space": _target(lambda r, t: t + b" x"), "target-8-bit": _target(lambda r, t: t + b"\xff\x80"),
    "target-nul": _target(lambda r, t: t + b"\0x"), "target-question": _target(lambda r, t: t + b"??&&=&=?"),
    "1.0": _version_1_0(False), "1.0-keep-alive": _version_1_0(True),
    "0.9": _versioned(b"", id="", rest_behind=True, half=True), "1.2": _versioned(b" HTTP/1.2"), "1.9": _versioned(b" HTTP/1.9"),
    "2.0": _versioned(b" HTTP/2.0"), "9.9": _versioned(b" HTTP/9.9"), "http": _versioned(b" http/1.1"),
    "1.1x": _versioned(b" HTTP/1.1x"), "1.": _versioned(b" HTTP/1."), "spaces": _versioned(b"   HTTP/1.1"),
    "tabs": _line(lambda r, d: d.method.encode() + b"\t" + d.target + b"\tHTTP/1.1"),
    "preface": _line(lambda r, d: b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", id="", rest_behind=True, half=True),
    "tls": _line(lambda r, d: b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03" + r.randbytes(40).replace(b"\n", b""), id="", rest_behind=True,
                 half=True),
    "noise": _line(lambda r, d: r.randbytes(r.randrange(1, 200)), id="", rest_behind=True, half=True),
    "line-cr": _line(lambda r, d: b"GET\r /", id="", rest_behind=True, half=True),
    "blank-lines": _line(lambda r, d: d.line, plain=True, before=b"\r\n" * 2),
    "blank-lines-many": _line(lambda r, d: d.line, plain=True, before=b"\r\n" * 3000),
}


def _garble(r, body):
    """JSON that is nearly what it was."""
    def swapped():
        try:
            document = json.loads(body)
        except ValueError:  # spoiled already
            return body[::-1]
        if isinstance(document, dict) and document:
            document[r.choice(list(document))] = r.choice([None, [], {}, "x", -1, 1e308, True, [[[]]], {"a": {"b": 1}}])
        return json.dumps(document).encode()
    return r.choice([
        swapped, swapped, lambda: b"[" * r.choice([10, 5000, 200000]), lambda: b'{"a":' * 3000 + b"1" + b"}" * 3000,
        lambda: body.replace(b"16", b"1" + b"0" * 400), lambda: body.replace(b"16", b"NaN"), lambda: body.replace(b"9", b"-Infinity"),
        lambda: body[:-1] + b', "width": 16, "width": 17}', lambda: body[:r.randrange(len(body) + 1)], lambda: body + b"x",
        lambda: b"\xef\xbb\xbf" + body, lambda: body.replace(b'"', b'"\xff', 1), lambda: body.replace(b'"', b'"\\u0000', 1),
        lambda: b'"\\ud800"', lambda: body.decode("latin-1").encode("utf-16"), lambda: b"\0" * 100, lambda: body + b" " * (1 << 20),
        lambda: b"0" * (9 << 20), lambda: b'--b\r\nContent-Disposition: form-data; name="a"\r\n\r\n5\r\n--b--\r\n'])()


def _body(r, d):
    d.need_body()
    if d.method == "PUT":
        return
    d.body, d.statuses = _garble(r, d.body if d.body[:1] == b"{" else b'{"width": 16, "height": 9}'), ()
    if r.random() < 0.2:
        d.fields = d.fields + [r.choice([b"Content-Type: multipart/form-data; boundary=b", b"Content-Type: a/b",
                                         b"Content-Type: application/x-www-form-urlencoded"])]
    if len(d.body) > 8 << 20:
        d.worse(EITHER)  # more than is read and dropped


BODIES = {"body": _body}
KINDS = [LENGTHS, CHUNKS, CHUNKS, FIELDS, LINES, BODIES]
ALL = {name: mutate for kind in KINDS for name, mutate in kind.items()}


ALONE = {"cookie-long", "larger", "largest", "many", "too-many", "no-name", "bare-cr"}  # what they do hides what another does


def spoil(r, draft, without=()):
    """One mutation of the framing or the words, at times one more of what is harmless beside it."""
    for _ in range(1 if r.random() < 0.75 else 2):
        kind = r.choice(KINDS if not draft.tags else [FIELDS])
        name = r.choice(sorted(kind))
        if name in without or draft.tags and ALONE & {name, *draft.tags} or draft.line is not None and kind is LINES:
            continue
        kind[name](r, draft)
        draft.tags.append(name)
