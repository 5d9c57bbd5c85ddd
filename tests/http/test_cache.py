"""What is not rendered twice: validators, 304, HEAD, URLs with a version, the cache and its limit, equal requests that are
on their way at the same time."""
import re
import socket
import threading

from harness import FAKE, PATIENT, REAL, VIEW, Daemon, Hold, eventually, fresh, lines, run, together

SMALL = VIEW + "?width=16&height=16"
FOREVER = "public, max-age=31536000, immutable"


def send(d, path, reads_little=False):
    s = socket.socket()
    if reads_little:  # before it connects: so that not all of a reply may be on its way
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    s.connect(("127.0.0.1", d.port))
    s.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    return s


def test_an_etag_is_answered_with_304_and_no_frame():
    with Daemon(REAL) as d:
        first = d.ask(SMALL)
        tag = first.headers["ETag"]
        assert re.fullmatch('"[0-9a-f]{32}"', tag) and first.headers["Cache-Control"] == "no-cache"
        for known in [tag, f'"other", {tag}', "W/" + tag, "*", f'"a,b" ,{tag}']:
            reply = d.ask(SMALL, headers={"If-None-Match": known})
            assert reply.status == 304 and reply.body == b"", (known, reply.status)
            assert reply.headers["ETag"] == tag and reply.headers["Cache-Control"] == "no-cache"
            assert d.ask(SMALL, "HEAD", headers={"If-None-Match": known}).status == 304
        for unknown in ['"other"', tag.strip('"'), tag[:-2] + '"', "", '"', "**", "W/*"]:
            reply = d.ask(SMALL, headers={"If-None-Match": unknown})
            assert reply.status == 200 and reply.body == first.body, unknown
        counters = d.status()["counters"]
        assert counters["frames"] == 1 and counters["not_modified"] == 10, counters
    with Daemon(REAL) as d:  # another process that renders the same way; nothing is rendered here
        assert d.ask(SMALL, headers={"If-None-Match": tag}).status == 304
        assert d.status()["counters"]["frames"] == 0
    with Daemon(FAKE) as d:
        assert d.ask(SMALL, headers={"If-None-Match": tag}).status == 200, "another renderer, the same ETag"


def test_several_lines_of_one_header_are_one_list():
    with Daemon(REAL) as d:
        def ask(*values):
            return d.ask(SMALL, headers=lines(*(("If-None-Match", value) for value in values))).status
        tag = d.ask(SMALL).headers["ETag"]
        for known in [('"other"', tag), (tag, '"other"'), ('"other", "another"', "", f'"a", W/{tag}'), ("x", "*")]:
            assert ask(*known) == 304, known
        for unknown in [('"other"', '"another"'), (tag[:20], tag[20:]), ("", "")]:
            assert ask(*unknown) == 200, unknown


def test_who_wants_another_version_gets_none():
    """If-Match (RFC 9110, 13.1.1) of what is read: with a strong validator, before If-None-Match, and without a frame."""
    with Daemon(REAL) as d:
        base = "/v1/datasets/wall"
        for path in (SMALL, f"{base}/thumbnail.jpg?width=16", f"{base}/pick?x=1&y=1&width=16&height=16",
                     f"{base}/tiles/0/0/0.png"):
            tag, frames = d.ask(path).headers["ETag"], d.status()["counters"]["frames"]
            for other in ('"other"', "W/" + tag, "", tag.strip('"'), f'"other", W/{tag}'):
                for method in ("GET", "HEAD"):
                    for more in ({}, {"If-None-Match": tag}):
                        reply = d.ask(path, method, headers={"If-Match": other, **more})
                        assert reply.status == 412, (path, other, method, reply.status)
            assert d.ask(path, headers={"If-Match": '"other"'}).json()["field"] == "If-Match"
            assert reply.headers["ETag"] is None and d.status()["counters"]["frames"] == frames, path
            assert d.ask(path, headers=lines(("If-Match", '"other"'), ("If-Match", f"W/{tag}"))).status == 412
            for one in ("*", tag, f'"other", {tag}'):
                reply = d.ask(path, headers={"If-Match": one})
                assert reply.status == 200 and reply.headers["ETag"] == tag, (path, one, reply.status)
                assert d.ask(path, headers={"If-Match": one, "If-None-Match": tag}).status == 304, (path, one)
            assert d.ask(path, headers=lines(("If-Match", '"other"'), ("If-Match", tag))).status == 200
        frames = d.status()["counters"]["frames"]
        assert d.ask(fresh(SMALL), headers={"If-Match": '"other"'}).status == 412 and d.status()["counters"]["frames"] == frames
        for path in (SMALL + "&budget=500ms", base):  # no ETag, and nothing that it could be held against
            assert d.ask(path, headers={"If-Match": '"other"'}).status == 200, path


def test_requests_that_mean_the_same_share_an_etag():
    with Daemon(REAL) as d:
        def tag(query):
            return d.ask(f"{VIEW}?{query}", "HEAD").headers["ETag"]
        plain = tag("eye=3,0,1&target=0,0,1&fov=50&width=64&height=48")
        for same in ["height=48&width=64&FOVY=50&POI=0,0,1.0&poc=3e0,-0,1", "eye=3,0,1&target=0,0,1&fov=5e1&width=64&"
                     "height=48&method=splat&lod=1&layer=color&format=jpg&quality=90&margin=1&transparent=false&"
                     "background=%23000000&depth_scale=77",
                     "eye=3,0,1&target=0,0,1&fov=50&width=64&height=48&soft_opacity=0.9&soft_model=base",  # of nothing
                     "eye=3,0,1&target=0,0,1&fov=50&width=64&height=48&atoms=3"]:  # the wall has no textures
            assert tag(same) == plain, same
        for other in ["lod=2", "quality=91", "format=png", "method=points", "background=000001", "layer=depth",
                      "near=0.5",
                      "up=0,1,0", "cx=32.5", "supersample=2", "margin=1.5", "transparent=true", "soft=axis:0,0,0,0,0,1<0.1"]:
            assert tag("eye=3,0,1&target=0,0,1&fov=50&width=64&height=48&" + other) != plain, other
        for left_out, whole in [("width=320", "width=320&height=180"), ("height=45", "width=80&height=45"),
                                ("background=navy", "background=000080")]:
            assert tag(left_out) == tag(whole), left_out
        assert d.status()["counters"]["frames"] == 0


def test_head_says_what_get_says():
    with Daemon(REAL) as d:
        for query in ["width=16&height=16", "layer=depth&width=16&height=16"]:
            path = f"{VIEW}?{query}"
            early = d.ask(path, "HEAD")
            frames = d.status()["counters"]["frames"]
            get, late = d.ask(path), d.ask(path, "HEAD")
            assert early.status == get.status == late.status == 200 and early.body == late.body == b""
            assert d.status()["counters"]["frames"] == frames + 1
            for name in ["Content-Type", "ETag", "Cache-Control", "Splatd-Camera", "Splatd-Depth-Unit",
                         "Splatd-Depth-Scale"]:
                assert early.headers[name] == get.headers[name] == late.headers[name], name
            assert "Content-Length" not in early.headers and int(late.headers["Content-Length"]) == len(get.body)
            assert late.headers["Splatd-Cache"] == "hit" and "Splatd-Cache" not in early.headers
        assert d.ask(VIEW + "?width=0", "HEAD").status == 400
        planned = d.ask(SMALL + "&budget=500ms", "HEAD")
        assert planned.status == 200 and planned.headers["Splatd-Chosen"] and int(planned.headers["Content-Length"]) > 0


def test_a_url_with_the_version_never_goes_out_of_date():
    with Daemon(REAL) as d:
        version = d.ask("/v1/datasets/wall").json()["version"]
        reply = d.ask(f"{SMALL}&v={version}")
        assert reply.status == 200 and reply.headers["Cache-Control"] == FOREVER
        again = d.ask(f"{SMALL}&v={version}", headers={"If-None-Match": reply.headers["ETag"]})
        assert again.status == 304 and again.headers["Cache-Control"] == FOREVER
        plain = d.ask(SMALL)
        assert plain.headers["ETag"] == reply.headers["ETag"] and plain.headers["Cache-Control"] == "no-cache"
        other = f"{int(version, 16) ^ 1:016x}"
        wrong = d.ask(f"{SMALL}&v={other}")
        assert wrong.status == 404 and wrong.json()["field"] == "v", wrong.body
        assert other in wrong.json()["detail"] and version in wrong.json()["detail"]
        assert d.post({"width": 16, "height": 16, "v": other}).json()["field"] == "v"
        assert d.post({"width": 16, "height": 16, "v": version}).body == reply.body
        for bad in ["", "1", version + "0", version.upper() + "G", "-" + version[1:], "0x" + version[2:]]:
            refused = d.ask(f"{SMALL}&v={bad}")
            assert refused.status == 400 and refused.json()["field"] == "v", (bad, refused.body)
        assert d.post({"v": 5}).json()["field"] == "v"


def test_planned_views_are_nobodys_to_keep():
    with Daemon(FAKE) as d:
        for _ in range(2):
            reply = d.ask(SMALL + "&budget=500ms", headers={"If-None-Match": "*"})
            assert reply.status == 200 and reply.headers["Cache-Control"] == "no-store"
            assert reply.headers["ETag"] is None and reply.headers["Splatd-Cache"] == "miss"
        status = d.status()
        assert status["counters"]["frames"] == 2 and status["cache"]["entries"] == 0, status["cache"]


def test_the_cache_answers_gets_and_posts():
    with Daemon(REAL) as d:
        first = d.ask(SMALL)
        assert first.headers["Splatd-Cache"] == "miss"
        for reply in [d.ask(SMALL), d.post({"width": 16, "height": 16})]:
            assert reply.body == first.body and reply.headers["Splatd-Cache"] == "hit"
            for name in set(first.headers) - {"Date", "Server-Timing", "Splatd-Cache", "ETag", "Cache-Control",
                                             "X-Request-Id"}:
                assert reply.headers[name] == first.headers[name], name
        status = d.status()
        assert (status["counters"]["cache_hits"], status["counters"]["cache_misses"]) == (2, 1), status
        assert status["counters"]["frames"] == 1 and status["cache"]["entries"] == 1
        assert len(first.body) < status["cache"]["bytes"] < len(first.body) + 4096
        eventually(lambda: d.status()["memory"]["reply_bytes"] == 0)
        metrics = d.ops("/metrics").body.decode()
        for name, value in (("cache_bytes", status["cache"]["bytes"]), ("cache_entries", 1), ("cache_hits_total", 2)):
            assert f"\nsplatd_{name} {value}\n" in metrics, name


def test_the_cache_keeps_to_its_limit():
    raw = VIEW + "?width=64&height=64&format=raw"  # 16 KiB each
    with Daemon(FAKE, "--cache", "100K") as d:
        paths = [fresh(raw) for _ in range(12)]
        for path in paths:
            assert d.ask(path).headers["Splatd-Cache"] == "miss"
            assert d.ask(paths[0]).headers["Splatd-Cache"] == "hit", "what is used stays"
            assert d.status()["cache"]["bytes"] <= 100 * 1024
        cache = d.status()["cache"]
        assert 4 <= cache["entries"] <= 6 and cache["evictions"] == 12 - cache["entries"], cache
        assert d.ask(paths[-1]).headers["Splatd-Cache"] == "hit" and d.ask(paths[1]).headers["Splatd-Cache"] == "miss"
        large = VIEW + "?width=256&height=256&format=raw"
        assert [d.ask(large).headers["Splatd-Cache"] for _ in range(2)] == ["miss", "miss"]
        assert d.ask(paths[0]).headers["Splatd-Cache"] == "hit", "one that does not fit drops the others"
    with Daemon(FAKE, "--cache", "0") as d:
        assert [d.ask(SMALL).headers["Splatd-Cache"] for _ in range(2)] == ["miss", "miss"]
        assert d.status()["cache"] == {"entries": 0, "bytes": 0, "limit_bytes": 0, "evictions": 0}


def test_a_dropped_view_reaches_its_slow_reader():
    with Daemon(FAKE, "--cache", "20M") as d:
        path = VIEW + "?width=2048&height=2048&format=raw&background=123456"
        with send(d, path, reads_little=True) as slow:
            eventually(lambda: d.status()["cache"]["entries"] == 1)
            d.ask(fresh(VIEW + "?width=1200&height=1200&format=raw"))
            status = d.status()
            assert status["cache"]["evictions"] == 1 and status["memory"]["reply_bytes"] > 16 << 20, status
            data = bytearray(slow.recv(1 << 16))
            while len(data) < data.index(b"\r\n\r\n") + 4 + (16 << 20):
                data += slow.recv(1 << 20)
        assert data[data.index(b"\r\n\r\n") + 4:] == b"\x12\x34\x56\xff" * (2048 * 2048)
        eventually(lambda: d.status()["memory"]["reply_bytes"] == 0)


def test_equal_requests_on_their_way_are_one_frame():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        def go_on():
            eventually(lambda: d.status()["counters"]["cache_misses"] == 12)
            hold.allow_all()
        *got, _ = together(13, lambda i: go_on() if i == 12 else d.ask(SMALL) if i % 2 else d.post({"height": 16, "width": 16}))
        assert {reply.status for reply in got} == {200} and len({reply.body for reply in got}) == 1
        origins = sorted(reply.headers["Splatd-Cache"] for reply in got)
        counters = d.status()["counters"]
        assert counters["frames"] == 1 and origins.count("miss") == 1, (origins, counters)
        assert counters["views_shared"] == origins.count("shared") == 11
        assert len({reply.headers["ETag"] for reply in got} - {None}) == 1


def test_who_leaves_takes_nobody_along():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        for leaver in (0, 1):  # the one who asked first, one who joined
            path, replies = fresh(SMALL), []
            hold.allow(leaver)
            frames, left = d.status()["counters"]["frames"], d.status()["counters"]["clients_left"]
            asking = threading.Thread(target=lambda: replies.append(d.ask(path)))
            if leaver:
                asking.start()
                eventually(lambda: d.status()["queues"]["render"]["length"] == 0 and d.status()["counters"]
                           ["cache_misses"] == 2 * leaver + 1)
            gone = send(d, path)
            eventually(lambda: d.status()["counters"]["cache_misses"] == 3 * leaver + 1)
            if not leaver:
                asking.start()
                eventually(lambda: d.status()["counters"]["cache_misses"] == 2)
            gone.close()
            eventually(lambda: d.status()["counters"]["clients_left"] == left + 1)
            hold.allow(leaver + 1)
            asking.join()
            counters = d.status()["counters"]
            assert replies[0].status == 200 and counters["frames"] == frames + 1, counters
            assert counters["clients_left"] == left + 1, counters


def test_a_view_that_everybody_left_is_dropped_and_can_be_asked_for_again():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        busy = threading.Thread(target=lambda: d.ask(fresh(SMALL)))
        busy.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 1)
        path = fresh(SMALL)
        gone = [send(d, path), send(d, path)]
        eventually(lambda: d.status()["counters"]["cache_misses"] == 3)
        for s in gone:
            s.close()
        eventually(lambda: d.status()["counters"]["clients_left"] == 2)
        hold.allow_all()
        assert d.ask(path).headers["Splatd-Cache"] == "miss"
        busy.join()
        assert d.status()["counters"]["frames"] == 2


def test_an_error_reaches_all_that_share_it():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, SPLATD_INJECT_LOSS_AFTER="1", **hold.environment) as d:
        def go_on():
            eventually(lambda: d.status()["counters"]["cache_misses"] == 5)
            hold.allow_all()
        blocker = threading.Thread(target=lambda: d.ask(fresh(SMALL)))
        blocker.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 1)
        *got, _ = together(5, lambda i: d.ask(SMALL) if i < 4 else go_on())
        assert {reply.status for reply in got} == {503}, [reply.status for reply in got]
        blocker.join()
        eventually(lambda: d.status()["state"] == "ready")
        again = d.ask(SMALL)
        assert again.status == 200 and again.headers["Splatd-Cache"] == "miss"


def test_nothing_follows_the_headers_of_a_head():
    with Daemon(FAKE, FAKE_FRAME_MS=0) as d:
        for i in range(300):  # libmicrohttpd has sent the end of a body with some
            connection = d.connect()
            connection.connect()
            connection.sock.sendall(f"HEAD {VIEW}?width={16 + i} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            connection.sock.shutdown(1)
            got = b"".join(iter(lambda: connection.sock.recv(65536), b""))
            assert got.startswith(b"HTTP/1.1 200 ") and b"\r\nConnection: close\r\n" in got
            assert got.endswith(b"\r\n\r\n") and got.count(b"\r\n\r\n") == 1, got[-100:]
            connection.close()


run(globals())
