"""PUT and DELETE of datasets: who may, which names, bodies of every kind, clients that leave, disks that are full."""
import contextlib
import os
import pathlib
import select
import socket
import struct
import tempfile
import threading
import time

from harness import FAKE, REAL, WALL, Daemon, break_page, eventually, lines, run, together

ADMIN, VIEWER = "admin-0123456789abcdef", "viewer-0123456789abcdef"
AUTH = {"Authorization": f"Bearer {ADMIN}", "Content-Type": "application/octet-stream"}
WALL_1, WALL_2, LARGE = (
    pathlib.Path(path).read_bytes() for path in (WALL, os.environ["SPLATD_WALL_2"], os.environ["SPLATD_WALL_LARGE"]))


@contextlib.contextmanager
def serving(*args, binary=FAKE, named=(), **environment):
    with tempfile.TemporaryDirectory() as top:
        home = pathlib.Path(top, "home")
        home.mkdir()
        tokens = pathlib.Path(top, "tokens")
        tokens.write_text(f"{ADMIN} view,admin,tour\n{VIEWER} view\n")
        tokens.chmod(0o600)
        with Daemon(binary, "--watch", "30", "--tokens", str(tokens), *args, datasets=[str(home), *named],
                    **environment) as d:
            d.home = home
            yield d


def put(d, name, body, headers=AUTH, **kw):
    return d.ask(f"/v1/datasets/{name}", "PUT", body, headers, **kw)


def delete(d, name, headers=AUTH):
    return d.ask(f"/v1/datasets/{name}", "DELETE", headers=headers)


def listed(d):
    return {dataset["id"]: dataset for dataset in d.ask("/v1/datasets", headers=AUTH).json()["datasets"]}


def small(d, name):
    return d.ask(f"/v1/datasets/{name}/view?width=16&height=16", headers=AUTH)


def left_over(d):
    return [p.name for p in d.home.iterdir() if p.name.startswith(".")]


def test_only_an_admin_changes_datasets():
    with serving() as d:
        for headers, status in (({}, 401), ({"Authorization": f"Bearer {VIEWER}"}, 403),
                                ({"Authorization": "Bearer nobody-0123456789abcdef"}, 401)):
            assert put(d, "a", WALL_1, headers).status == status and delete(d, "a", headers).status == status
        assert list(d.home.iterdir()) == []
    with Daemon(FAKE) as d:  # nobody is one without --tokens
        assert put(d, "wall", WALL_1, {}).status == 403 and delete(d, "wall", {}).status == 403
        assert d.ask("/v1/datasets/wall").status == 200


def test_put_get_replace_delete():
    with serving(binary=REAL) as d:
        reply = put(d, "a", WALL_1)
        assert reply.status == 201 and reply.headers["Location"] == "/v1/datasets/a", reply.body
        assert reply.json()["state"] == "ready" and reply.json()["version"] == listed(d)["a"]["version"]
        assert (d.home / "a.spld").read_bytes() == WALL_1 and left_over(d) == []
        assert small(d, "a").status == 200
        reply = put(d, "a", WALL_2)
        assert reply.status == 200 and reply.json()["leaf_splats"] == 800, reply.body
        assert listed(d)["a"]["version"] == reply.json()["version"] and small(d, "a").status == 200
        (d.home / "a.profile.json").write_text("{}")
        assert delete(d, "a").status == 204
        assert listed(d) == {} and list(d.home.iterdir()) == [] and small(d, "a").status == 404
        assert delete(d, "a").status == 404
        time.sleep(0.2)
        assert listed(d) == {}, "a look from before brought it back"


def test_who_would_overwrite_nothing_does_not():
    """If-None-Match and If-Match (RFC 9110, 13.1): a change that was meant for something else than what is there is none."""
    with serving() as d:
        first = put(d, "a", WALL_1, {**AUTH, "If-None-Match": "*"})
        assert first.status == 201, first.body
        old, wrong = f'"{first.json()["version"]}"', '"0123456789abcdef"'
        for headers in ({"If-None-Match": "*"}, {"If-None-Match": f"{wrong}, {old}"}, {"If-Match": wrong}, {"If-Match": "W/" + old},
                        {"If-Match": old, "If-None-Match": "*"}):
            for reply in (put(d, "a", WALL_2, {**AUTH, **headers}), delete(d, "a", {**AUTH, **headers})):
                assert reply.status == 412 and reply.json()["field"] in headers, (headers, reply.body)
            assert (d.home / "a.spld").read_bytes() == WALL_1 and left_over(d) == [], headers
        for headers in ({"If-Match": "*"}, {"If-Match": old}):
            none = put(d, "b", WALL_1, {**AUTH, **headers})
            assert none.status == 412 and none.json()["field"] == "If-Match", none.body
        part = put(d, "a", WALL_2, {**AUTH, "Content-Range": f"bytes 0-{len(WALL_2) - 1}/{2 * len(WALL_2)}"})
        assert part.status == 400 and part.json()["field"] == "Content-Range", part.body
        assert listed(d).keys() == {"a"} and [p.name for p in d.home.iterdir()] == ["a.spld"]
        for several in ((("If-Match", wrong), ("If-Match", "W/" + old)), (("If-None-Match", wrong), ("If-None-Match", "*"))):
            reply = put(d, "a", WALL_2, lines(*AUTH.items(), *several))
            assert reply.status == 412 and reply.json()["field"] == several[0][0], (several, reply.body)
        again = put(d, "a", WALL_1, lines(*AUTH.items(), ("If-Match", wrong), ("If-Match", f"W/{wrong}, {old}")))
        assert again.status == 200 and again.json()["version"] == first.json()["version"], again.body
        second = put(d, "a", WALL_2, {**AUTH, "If-Match": f"{wrong},{old}", "If-None-Match": wrong})
        assert second.status == 200 and listed(d)["a"]["version"] == second.json()["version"] != first.json()["version"]
        assert delete(d, "a", {**AUTH, "If-Match": old}).status == 412  # it was that
        assert delete(d, "a", {**AUTH, "If-Match": f'"{second.json()["version"]}"'}).status == 204
        assert delete(d, "a", {**AUTH, "If-Match": "*"}).status == 404


def test_what_curl_makes_of_a_file_and_a_slash():
    """`curl -T hall.spld URL/v1/datasets/` puts the file's name behind the slash, and people put scans."""
    with serving() as d:
        for name in ("hall.spld", "hall.SPLD"):
            reply = put(d, name, WALL_1)
            assert reply.status == 400 and reply.json()["field"] == "id", reply.body
            assert "PUT /v1/datasets/hall" in reply.json()["detail"] and reply.json()["detail"].endswith("hall")
        assert listed(d) == {} and left_over(d) == []
        assert put(d, "hall.spld.2", WALL_1).status == 201
        for body in (b"ply\nformat ascii 1.0\n" + 200 * b" ", b"LASF" + 300 * b"\0", b"1 2 3\n" * 99):
            said = put(d, "scan", body).json()["detail"]
            assert "'splatd pack SCAN -o NAME.spld'" in said and said.endswith("then PUT that file"), said
            assert put(d, "my-collection", body).json()["detail"].endswith("then PUT that file")  # whatever it is called
        for body in (WALL_1[:-100], WALL_1[:40], WALL_1[:4] + WALL_1[5:], WALL_1[:8] + b"\7" + WALL_1[9:], b""):
            reply = put(d, "hall", body)
            assert reply.status == 422 and "pack the scan" not in reply.json()["detail"], reply.body


def pieces(body, size, pause=0.0):
    """`body` for a chunked request, with a pause after some of the chunks, so that both sides wait for each other."""
    for at in range(0, len(body), size):
        yield body[at:at + size]
        if pause and at // size % 97 == 0:
            time.sleep(pause)


def test_bodies_in_chunks_of_any_size():
    """libmicrohttpd goes on to the next chunk in its buffer though the connection was suspended with this one."""
    assert len(LARGE) > 2 << 20  # several steps of the pool
    with serving() as d:
        for name, body, status in (("good", LARGE, 201), ("bad", LARGE[:-1] + b"x" + b"y" * 99, 422)):
            for size in (700, 1000, 4096, 8192, 65536, 1 << 20):
                for pause in (0, 0.002):
                    reply = put(d, name, pieces(body, size, pause))
                    assert reply.status == status, (name, size, pause, reply.status, reply.body)
                    if status == 201:
                        assert (d.home / f"{name}.spld").read_bytes() == body
                        assert delete(d, name).status == 204
        assert put(d, "bytes", pieces(WALL_2, 1)).status == 201
        assert left_over(d) == []


def test_whoever_leaves_in_a_chunk_leaves_nothing():
    with serving() as d:
        for cut in (1 << 20, (1 << 20) + 1, 1500000, 2 << 20):
            with socket.create_connection(("127.0.0.1", d.port), 150) as s:
                s.sendall(f"PUT /v1/datasets/gone HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n"
                          f"Authorization: Bearer {ADMIN}\r\n\r\n".encode())
                s.sendall(b"".join(b"3e8\r\n" + LARGE[at:at + 1000] + b"\r\n" for at in range(0, cut, 1000)))
                eventually(lambda: "gone" in listed(d))
            eventually(lambda: "gone" not in listed(d) and left_over(d) == [])
        assert put(d, "gone", pieces(LARGE, 1000)).status == 201


def test_what_a_crash_leaves_is_swept_at_the_next_start():
    with serving() as d:
        with socket.create_connection(("127.0.0.1", d.port), 150) as s:
            s.sendall(f"PUT /v1/datasets/gone HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999999\r\n"
                      f"Authorization: Bearer {ADMIN}\r\n\r\n".encode() + b"x" * 2_000_000)
            eventually(lambda: left_over(d))
            past = time.time() - 60  # a folder that nobody has touched for a while, and a lock all the same
            for name in left_over(d):
                os.utime(d.home / name, (past, past))
            with Daemon(FAKE, datasets=[str(d.home)]) as other:  # a second service on the folder leaves it alone
                assert left_over(d) and other.ask("/v1/datasets").status == 200
            d.process.kill()
            d.wait_exit()
            assert left_over(d)
        for name in left_over(d):
            os.utime(d.home / name, (past, past))
        with Daemon(FAKE, datasets=[str(d.home)]):
            assert left_over(d) == []


def test_what_the_device_refuses_changes_no_file():
    """Whatever may refuse a version is asked before its file takes the place of the one before."""
    with serving(binary=REAL) as d:
        assert put(d, "a", WALL_1).status == 201 and small(d, "a").status == 200
        least = d.ask("/v1/status", headers=AUTH).json()["memory"]["device_bytes"]
    with serving("--memory-limit", str(least + (1 << 20)), binary=REAL) as d:
        assert put(d, "a", WALL_1).status == 201
        version = listed(d)["a"]["version"]
        for name in ("a", "new"):
            reply = put(d, name, LARGE)
            assert reply.status == 413 and "memory" in reply.json()["detail"], reply.body
        assert (d.home / "a.spld").read_bytes() == WALL_1 and not (d.home / "new.spld").exists()
        eventually(lambda: left_over(d) == [])
        after = listed(d)
        assert list(after) == ["a"] and after["a"]["version"] == version and "reason" not in after["a"], after
        assert small(d, "a").status == 200 and put(d, "a", WALL_2).status == 200 and small(d, "a").status == 200


def test_what_cannot_be_put_in_place_changes_nothing():
    with serving() as d:
        (d.home / "a.spld").mkdir()
        (d.home / "a.spld" / "x").write_text("")
        reply = put(d, "a", WALL_1)
        assert reply.status >= 400 and (d.home / "a.spld").is_dir(), (reply.status, reply.body)
        assert small(d, "a").status != 200
        eventually(lambda: left_over(d) == [])


def test_names_that_are_no_ids_make_no_files():
    with serving() as d:
        outside = set(d.home.parent.iterdir())
        for name in ("..%2fx", "%2e%2e%2fx", "..", ".x", "a%2fb", "a%5cb", "%2fetc%2fx", "a%20b", "a%00b", "%c3%bc", "a" * 128,
                     "a:b", "*", "%2e", "a;b"):
            for reply in (put(d, name, WALL_1), delete(d, name)):
                assert reply.status == 400 and reply.json()["field"] == "id", (name, reply.status, reply.body)
        for name in ("../x", "a/b", "a/../b", ""):
            assert put(d, name, WALL_1).status in (404, 405), name
        assert list(d.home.iterdir()) == [] and set(d.home.parent.iterdir()) == outside
        assert put(d, "a" * 127, WALL_1).status == 201


def test_bodies_that_are_no_datasets_leave_what_was_there():
    broken = bytearray(WALL_1)
    break_page(broken)
    with serving() as d:
        assert put(d, "a", WALL_1).status == 201
        for body in (b"", b"x", b"ply\nformat ascii 1.0\n", bytes(broken), WALL_1[:-1], WALL_1 + b"x", b"\0" * 3_000_000):
            for name in ("a", "b"):
                reply = put(d, name, body)
                assert reply.status == 422 and reply.json()["field"] == "body", (len(body), reply.status, reply.body)
                assert str(d.home) not in reply.body.decode() and ".incoming" not in reply.body.decode()
        assert list(listed(d)) == ["a"] and listed(d)["a"].get("reason") is None, listed(d)
        assert [p.name for p in d.home.iterdir()] == ["a.spld"] and (d.home / "a.spld").read_bytes() == WALL_1
        assert small(d, "a").status == 200


def test_sizes_are_capped_and_large_bodies_only_go_here():
    with serving("--max-upload", "100000") as d:
        assert len(WALL_1) < 100000 and put(d, "a", WALL_1).status == 201
        reply = put(d, "b", b"x" * 100001)
        assert reply.status == 413 and "100000" in reply.json()["detail"], reply.body

        def chunks():
            for _ in range(200):
                yield b"x" * 1000
        reply = d.ask("/v1/datasets/b", "PUT", chunks(), AUTH)
        assert reply.status == 413 and list(listed(d)) == ["a"]
        eventually(lambda: left_over(d) == [])
        reply = d.ask("/v1/datasets/a/view", "POST", b" " * 2_000_000, AUTH)
        assert reply.status == 413
        head = (f"PUT /v1/datasets/b HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999\r\nExpect: 100-continue\r\n"
                f"Authorization: Bearer {VIEWER}\r\n\r\n").encode()
        with socket.create_connection(("127.0.0.1", d.port), 150) as s:
            s.sendall(head)
            assert b" 403 " in s.recv(4096)


def large(megabytes):
    """No dataset, but as long as one."""
    return b"SPLATD" + b"\0" * (megabytes << 20)


def test_large_bodies_go_to_disk_while_views_go_on():
    with serving(FAKE_FRAME_MS=1) as d:
        assert put(d, "a", WALL_1).status == 201

        def resident():
            return d.ask("/v1/status", headers=AUTH).json()["memory"]["resident_bytes"]
        before = resident()

        def work(i):
            if i < 2:
                return put(d, f"big{i}", large(24)).status
            connection = d.connect()
            return {d.ask("/v1/datasets/a/view?width=16&height=16", headers=AUTH, connection=connection).status
                    for _ in range(100)}
        results = together(6, work)
        assert results == [422, 422] + 4 * [{200}], results
        assert resident() - before < 40 << 20, (before, resident())
        assert left_over(d) == []


def test_clients_that_leave_leave_nothing():
    with serving() as d:
        for sent in (0, 1000, 1_500_000, 3_000_000):
            with socket.create_connection(("127.0.0.1", d.port), 150) as s:
                s.sendall(f"PUT /v1/datasets/gone HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999999\r\n"
                          f"Authorization: Bearer {ADMIN}\r\n\r\n".encode() + b"x" * sent)
                eventually(lambda: "gone" in listed(d))
                if sent > 2_000_000:  # reset instead of the end of a stream
                    s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            eventually(lambda: "gone" not in listed(d))
            eventually(lambda: left_over(d) == [])
        assert put(d, "gone", WALL_1).status == 201


def test_one_change_of_a_dataset_at_a_time():
    with serving() as d:
        with socket.create_connection(("127.0.0.1", d.port), 150) as s:
            s.sendall(f"PUT /v1/datasets/a HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(WALL_1)}\r\n"
                      f"Authorization: Bearer {ADMIN}\r\n\r\n".encode() + WALL_1[:1000])
            eventually(lambda: listed(d).get("a", {}).get("state") == "loading")
            assert small(d, "a").status == 503
            for reply in (put(d, "a", WALL_2), delete(d, "a")):
                assert reply.status == 503 and reply.json()["field"] == "id", reply.body
            s.sendall(WALL_1[1000:])
            assert b" 201 " in s.recv(4096)
        assert small(d, "a").status == 200


def test_bodies_that_dawdle_give_way():
    with serving("--max-upload", "4096T") as d:
        dawdling, began = [], time.monotonic()
        for i in range(4):
            dawdling.append(socket.create_connection(("127.0.0.1", d.port), 150))
            dawdling[-1].sendall(f"PUT /v1/datasets/slow-{i} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(WALL_1)}\r\n"
                                 f"Authorization: Bearer {ADMIN}\r\n\r\n".encode() + WALL_1[:1000])
        eventually(lambda: sum(dataset["state"] == "loading" for dataset in listed(d).values()) == 4)
        assert put(d, "a", WALL_1).status == 503  # nobody has dawdled yet
        time.sleep(6)
        huge = {**AUTH, "Content-Length": str(1 << 50)}
        for headers, status in (({**AUTH, "If-Match": "*"}, 412), ({**AUTH, "Content-Range": "bytes 0-1/9"}, 400), (huge, 507),
                                ({"Authorization": f"Bearer {VIEWER}"}, 403)):
            assert put(d, "a", b"" if headers is huge else WALL_1, headers).status == status
        assert put(d, ".a", WALL_1).status == 400 and delete(d, "a").status == 404
        assert put(d, "slow-0", WALL_1).status == 503 and delete(d, "slow-3").status == 503
        cut = select.select(dawdling, [], [], 0)[0]
        assert not cut or time.monotonic() - began > 25, "one was cut for who is not let in, before half a minute was over"
        while put(d, "a", WALL_1).status == 503:
            time.sleep(0.3)
        cut = select.select(dawdling, [], [], 0)[0]
        assert len(cut) == 1 and b" 408 " in cut[0].recv(4096), len(cut)
        for s in dawdling:
            s.close()


def test_no_dataset_is_removed_while_a_view_of_it_is_saved():
    """Both would be told that it was done, and the next dataset of this name have the view."""
    view = b'{"eye": [3, 0, 1], "target": [0, 0, 1], "fov": 60}'
    with serving() as d:
        for _ in range(40):
            assert put(d, "a", WALL_1).status == 201
            asked = [lambda: put(d, "a/views/secret", view, {**AUTH, "Content-Type": "application/json"}), lambda: delete(d, "a")]
            saved, removed = (reply.status for reply in together(2, lambda i: asked[i]()))
            assert saved in (201, 404, 503) and removed in (204, 503), (saved, removed)
            eventually(lambda: delete(d, "a").status in (204, 404))
            assert not list(d.home.glob("*.views.json")), (saved, removed)


def test_a_file_that_was_named_itself_is_the_operators():
    with serving(named=[WALL]) as d:
        assert put(d, "wall", WALL_2).status == 409 and delete(d, "wall").status == 409
        assert small(d, "wall").status == 200 and os.path.exists(WALL)
    with tempfile.NamedTemporaryFile("w") as tokens:
        tokens.write(f"{ADMIN} admin\n")
        tokens.flush()
        with Daemon(FAKE, "--tokens", tokens.name) as d:
            assert put(d, "new", WALL_1).status == 409


def test_put_under_load_fails_nobody():
    with serving("--queue", "256", FAKE_FRAME_MS=2) as d:
        assert put(d, "a", WALL_1).status == 201
        stop, failures = threading.Event(), []

        def load():
            connection = d.connect()
            while not stop.is_set():
                reply = d.ask("/v1/datasets/a/view?width=16&height=16", headers=AUTH, connection=connection)
                if reply.status != 200:
                    failures.append(reply.body)
        threads = [threading.Thread(target=load) for _ in range(4)]
        for thread in threads:
            thread.start()
        versions = {put(d, "a", WALL_2 if i % 2 else WALL_1).json()["version"] for i in range(8)}
        stop.set()
        for thread in threads:
            thread.join()
        assert not failures and len(versions) == 2, failures[:2]


def test_a_full_disk_is_said():
    def limit():  # bytes a file may have; as with a full disk, write() fails
        import resource
        import signal
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, 2_000_000))
    with serving("--max-upload", "4096T", preexec=limit) as d:
        reply = put(d, "a", large(5))
        assert reply.status == 507 and reply.json()["field"] == "body", reply.body
        assert listed(d) == {} and left_over(d) == []
        reply = d.ask("/v1/datasets/a", "PUT", b"", {**AUTH, "Content-Length": str(1 << 50)})
        assert reply.status == 507 and "free" in reply.json()["detail"], reply.body
        assert put(d, "a", WALL_1).status == 201


def test_sigterm_waits_for_an_upload():
    with serving() as d:
        with socket.create_connection(("127.0.0.1", d.port), 150) as s:
            s.sendall(f"PUT /v1/datasets/a HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(WALL_1)}\r\n"
                      f"Authorization: Bearer {ADMIN}\r\n\r\n".encode() + WALL_1[:1000])
            eventually(lambda: "a" in listed(d))
            d.process.terminate()
            eventually(lambda: d.ops("/readyz").body == b"no: stopping\n")
            s.sendall(WALL_1[1000:])
            assert b" 201 " in s.recv(4096)
        assert d.wait_exit() == 0
        assert (d.home / "a.spld").read_bytes() == WALL_1 and left_over(d) == []


run(globals())
