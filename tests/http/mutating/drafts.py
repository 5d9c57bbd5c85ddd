"""Requests as they should be, of every route and method in api/openapi.yaml, before mutations.py spoils them."""
import dataclasses
import json
import os
import pathlib
import re

import openapi
from mutating.replies import ANSWER, EITHER, REFUSE, REST, Sent
from random_requests import random_request, random_value

ADMIN, VIEWER = b"admin-0123456789abcdef", b"viewer-0123456789abcdef"
TOUR = b"0000000000tour00"  # stands for the name of a tour that there is, and is as long
FILES = {"viewer": ["main.js", "none.js"], "embed": ["wall", "none"], "clients": ["splatd.py", "splat-view.js", "none"]}
DATASETS = [pathlib.Path(os.environ[name]).read_bytes() for name in ("SPLATD_WALL", "SPLATD_WALL_2")]
ORDER = [ANSWER, EITHER, REFUSE, REST]


@dataclasses.dataclass
class Draft:
    method: str = "GET"
    target: bytes = b"/v1/datasets/wall"
    id: str = ""
    version: str = "1.1"
    fields: list = dataclasses.field(default_factory=lambda: [b"Host: localhost"])  # raw lines
    body: bytes = None
    framing: list = None  # raw lines; None: Content-Length where there is a body
    sent_body: bytes = None  # with its chunks; None: as it is
    line: bytes = None  # the whole request line, where it is not made of the three
    before: bytes = b""
    end_of_line: bytes = b"\r\n"
    expect: str = ANSWER
    rest_behind: bool = False  # where this one ends, the daemon and we may differ for good reasons
    half: bool = False  # the daemon waits for more, so that only our end ends it
    statuses: tuple = ()
    closes: bool = False
    continues: bool = False
    tags: list = dataclasses.field(default_factory=list)

    def worse(self, expect):
        self.expect = max(self.expect, expect, key=ORDER.index)

    def need_body(self):
        if self.body is None:
            self.body = b'{"width": 16, "height": 9}'

    def sent(self):
        lines = [self.line if self.line is not None else b"%s %s HTTP/%s" % (self.method.encode("latin-1"), self.target,
                                                                             self.version.encode()),
                 *([b"X-Request-Id: " + self.id.encode()] if self.id else []), *self.fields,
                 *(self.framing if self.framing is not None else [] if self.body is None
                   else [b"Content-Length: %d" % len(self.body)])]
        body = self.sent_body if self.sent_body is not None else self.body or b""
        path = self.target.split(b"?")[0]
        return Sent(self.before + b"".join(line + self.end_of_line for line in lines) + self.end_of_line + body,
                    self.method, self.id, self.expect, self.version, self.closes,
                    may_close=self.method == "PUT" or self.continues or len(body) > 1 << 20,
                    may_break=path.startswith(b"/v1/tours/") and path.endswith((b"/stream", b"/events", b"/frames.zip")),
                    continues=self.continues, statuses=self.statuses, tags=tuple(self.tags))


def canary(own):
    """Must be answered when nothing before it has gone wrong, and ends the connection."""
    return Draft(id=own, fields=[b"Host: localhost", b"Connection: close"], closes=True, statuses=(200,)).sent()


def _json_body(r, operation):
    content = operation.get("requestBody", {}).get("content", {})
    schema = content.get("application/json", {}).get("schema")
    if schema:
        document = random_value(r, schema)
        if isinstance(document, dict):
            document.update(width=16, height=9)
        return json.dumps(document).encode()
    return None


def _fill(r, template, method):
    own = r.choice(["a", "b", "c"]) if method in ("put", "delete") else r.choice(["wall", "wall", "wall", "a"])
    room = template.split("/")[1]
    names = {"id": own, "n": r.choice("0019"), "name": r.choice(FILES.get(room, [TOUR.decode()]))}
    return re.sub(r"\{(\w+)\}", lambda m: names.get(m[1], "1"), template)


def _documented(r):
    template, method, operation, parameters = r.choice(list(openapi.operations()))
    if method == "delete" and r.random() < 0.7:
        method = "get"  # or nothing lasts
    draft = Draft(method.upper(), _fill(r, template, method).encode())
    if template.endswith(("/view", "/pick")) and method == "get":
        draft.target += b"?width=16&height=9" + (b"&x=3&y=4" if template.endswith("/pick") else b"")
        if template.endswith("/view") and r.random() < 0.5:
            draft.target += b"&near=%.6f" % (r.randint(1, 10 ** 6) * 1e-6)  # not in the cache
    draft.body = _json_body(r, operation) if method != "put" else _dataset(r)
    if draft.body is not None and method == "post":
        draft.fields.append(b"Content-Type: application/json")
    return draft


def _dataset(r):
    data = r.choice(DATASETS)
    return r.choice([lambda: data, lambda: data, lambda: data[:r.randrange(len(data))], lambda: b"x" * r.randrange(5000),
                     lambda: bytes(r.randrange(1 << 20, 3 << 20)), lambda: b""])()


def _random(r):
    method, target, headers, body = random_request(r)
    if target.startswith("/v1/tours/") and r.random() < 0.8:
        target = "/v1/tours/" + TOUR.decode() + "".join(re.findall(r"(/.*)?", target[len("/v1/tours/"):])[:1])
    draft = Draft(method, target.encode("latin-1", "replace"), body=body)
    draft.fields += [f"{name}: {value}".encode("latin-1", "replace") for name, value in headers.items()]
    return draft


def _known(r):
    """Whose status says whether the body came through."""
    return r.choice([
        lambda: Draft("POST", b"/v1/datasets/wall/view", body=b'{"width": 16, "height": 9}' + b" " * r.choice([0, 0, 9, 70000]),
                      statuses=(200, 503)),
        lambda: Draft("POST", b"/v1/datasets/wall/pick", body=b'{"width": 16, "height": 9, "x": 3, "y": 4}', statuses=(200, 503)),
        lambda: Draft("PUT", b"/v1/datasets/" + r.choice([b"a", b"b", b"c"]), body=r.choice(DATASETS),
                      statuses=(200, 201, 503, 507)),
        lambda: Draft("GET", b"/v1/datasets/wall/view?width=16&height=9", statuses=(200, 503)),
        lambda: Draft("GET", b"/v1/tours/" + TOUR + r.choice([b"", b"/frames.zip", b"/frames/0", b"/events", b"/stream"])),
    ])()


def make(r, own):
    """A request that is framed as it should be; its X-Request-Id is `own`."""
    draft = r.choice([_documented, _documented, _known, _random])(r)
    draft.id = own
    who = r.random()
    if who < 0.9 or draft.statuses:
        draft.fields.append(b"Authorization: Bearer " + ADMIN)
    elif who < 0.97:
        draft.fields.append(b"Authorization: Bearer " + r.choice([VIEWER, b"nobody-0123456789abcdef", b""]))
    if draft.method == "GET" and r.random() < 0.3:
        draft.method = "HEAD"
    return draft
