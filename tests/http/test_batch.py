"""Batches: many views in one request, in order, each as it would be by itself; what fails is said in its place; others
get between; who leaves costs nothing more."""
import io
import json
import socket
import threading
import zipfile

from harness import FAKE, PATIENT, REAL, VIEW, Daemon, Hold, eventually, fresh, parts, run, together

BATCH = VIEW.replace("/view", "/views")
SMALL = VIEW + "?width=16&height=16"


def views(count, **more):
    return {"views": [{"camera": {"eye": [3, i / 10, 1], "target": [0, 0, 1]}} for i in range(count)], "width": 16,
            "height": 16, **more}


def test_each_part_is_the_view_by_itself():
    with Daemon(REAL) as d:
        batch = {"width": 32, "height": 24, "camera": {"target": [0, 0, 1], "fov": 50}, "quality": 80, "views": [
            {"camera": {"eye": [3, 0, 1]}}, {"camera": {"eye": [3, 1, 1]}, "layer": "depth"},
            {"camera": {"eye": [3, 0, 1], "fov": 20}, "width": 16, "quality": 90},
            {"camera": {"eye": [2, 0, 1]}, "format": "npy", "layer": "normal"}]}
        reply = d.post(batch, BATCH)
        assert reply.status == 200 and reply.headers["Splatd-Failed"] == "0", reply.body[:500]
        got = list(parts(reply))
        assert [name for name, _, _ in got] == ["000.jpg", "001.png", "002.jpg", "003.npy"]
        frames = d.status()["counters"]["frames"]
        assert frames == 4
        zipped = zipfile.ZipFile(io.BytesIO(d.post({**batch, "container": "zip"}, BATCH).body))
        assert zipped.testzip() is None
        index = json.loads(zipped.read("index.json"))
        for view, (name, headers, body), row in zip(batch["views"], got, index, strict=True):
            single = d.post({**{k: v for k, v in batch.items() if k not in ("views", "camera")}, **view,
                             "camera": {**batch["camera"], **view["camera"]}})
            assert single.headers["Splatd-Cache"] == "hit" and body == single.body == zipped.read(name), name
            assert row["name"] == name
            for header in ("Content-Type", "Splatd-Camera", "Splatd-Depth-Unit", "Splatd-Depth-Scale",
                           "Splatd-Complete"):
                assert headers[header] == single.headers[header] == row["headers"].get(header), (name, header)
        assert d.status()["counters"]["frames"] == frames, "what is in the cache is not rendered again"


def test_views_in_common_are_rendered_once_and_planned_ones_are_planned():
    with Daemon(FAKE, FAKE_FRAME_MS=20) as d:
        reply = d.post({"width": 8, "height": 8, "views": [{}] * 100}, BATCH)
        assert len({body for _, _, body in parts(reply)}) == 1 and len(list(parts(reply))) == 100
        assert d.status()["counters"]["frames"] == 1
        [(_, headers, _)] = parts(d.post({"views": [{"budget": "9s"}], "width": 8, "height": 8}, BATCH))
        assert headers["Splatd-Chosen"] and headers["Splatd-Demand"] == "met"


def test_bad_batches_are_refused_by_name():
    with Daemon(FAKE, "--max-pixels", "10000") as d:
        one = {"width": 16, "height": 16}
        for body, field in [
            ("", "body"), ("[]", "body"), ("{", "body"), ("{}", "views"), ({"views": []}, "views"),
            ({"views": {}}, "views"),
            ({"views": [one] * 257}, "views"), ({"views": [5]}, "views[0]"), ({"views": [one, []]}, "views[1]"),
            ({"views": [one, {**one, "camera": {"fov": 180}}]}, "views[1].camera.fov"),
            ({"views": [{**one, "a": 1}]}, "views[0].a"),
            ({"views": [{**one, "layers": ["color"]}]}, "views[0].layers"), ({"views": [one], "layers": "color"},
                                                                             "views[0].layers"),
            ({"views": [one], "container": "tar"}, "container"), ({"views": [{**one, "container": "zip"}]},
                                                                  "views[0].container"),
            ({"views": [one], "colour": 1}, "colour"), ({"views": [one], "quality": 0}, "views[0].quality"),
            ({"views": [one], "camera": 5}, "camera"), ('{"views":[{}],"views":[{}]}', "body"),
            ({"views": [one], "camera": {"fx": 5}, "x": 1}, "x"),
            ({"views": [{"lod": 1, "width": 0}]}, "views[0].width"),
            ({"views": [{"width": 50, "height": 50}] * 5}, "views"), ({"views": [{"views": []}]}, "views[0].views"),
            ('{"views":[{"lod":NaN}]}', "body"), ({"views": [{**one, "eye": [1, 2, 3]}]}, "views[0].eye"),
        ]:
            reply = d.post(body, BATCH)
            assert reply.status == 400 and reply.json()["field"] == field, (body, reply.body)
        for body, said in ((b"{}", "1 to 256; it is missing"), ({"views": []}, "it is an array of 0"), ({"views": 5}, "it is a number")):
            assert d.post(body, BATCH).json()["detail"].endswith(said)
        wrong = d.post({"views": [one, {**one, "v": "0" * 16}]}, BATCH)
        assert wrong.status == 404 and wrong.json()["field"] == "views[1].v"
        assert d.ask(BATCH).status == 405 and d.ask(BATCH + "?width=5", "POST", "{}").json()["field"] == "width"
        assert d.post({"views": [{"width": 50, "height": 50}] * 4}, BATCH).status == 200
        counters = d.status()["counters"]
        assert counters["frames"] == 1, counters


def test_a_part_that_fails_is_a_problem_in_its_place():
    with Daemon(FAKE, FAKE_FRAME_MS=5, SPLATD_INJECT_LOSS_AFTER="3") as d:
        reply = d.post(views(12), BATCH)
        got = list(parts(reply))
        failed = [(name, json.loads(body)) for name, headers, body in got
                  if headers["Content-Type"] == "application/problem+json"]
        assert reply.status == 200 and 1 <= len(failed) == int(reply.headers["Splatd-Failed"]) < 12, reply.headers
        assert len(got) == 12 and [name[:3] for name, _, _ in got] == [f"{i:03}" for i in range(12)]
        for name, problem in failed:
            assert name.endswith(".json") and problem["type"] == "urn:splatd:error:device-lost", problem
            assert problem["status"] == 503 and problem["detail"] and problem["title"] and problem["instance"]


def in_flight(d, count):
    """Waits until so many views were asked for, of which the device has the first."""
    eventually(lambda: d.status()["counters"]["cache_misses"] >= count and d.status()["queues"]["render"]["length"] < count)


def test_others_get_between():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        done = []
        batch = threading.Thread(target=lambda: done.append(d.post(views(25), BATCH)))
        batch.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 2)  # as many at a time
        others = threading.Thread(target=lambda: done.extend(together(3, lambda i: d.ask(fresh(SMALL)))))
        others.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 2 + 3)
        hold.allow(10)  # which the batch alone would take
        others.join()
        assert [reply.status for reply in done] == [200] * 3 and d.status()["counters"]["frames"] <= 10, done
        hold.allow_all()
        batch.join()
        assert done[3].status == 200 and len(list(parts(done[3]))) == 25
        assert d.status()["counters"]["frames"] == 28


def test_a_batch_is_larger_than_the_queue():
    with Daemon(FAKE, "--queue", "1", FAKE_FRAME_MS=10) as d:
        reply = d.post(views(12), BATCH)
        assert reply.status == 200 and reply.headers["Splatd-Failed"] == "0"
    hold = Hold()
    with Daemon(FAKE, "--queue", "1", *PATIENT, **hold.environment) as d:
        busy = [threading.Thread(target=lambda: d.ask(fresh(SMALL))) for _ in range(2)]
        busy[0].start()
        in_flight(d, 1)
        busy[1].start()
        eventually(lambda: d.status()["queues"]["render"]["length"] == 1)
        reply = d.post(views(3), BATCH)
        assert reply.status == 503 and reply.json()["type"] == "urn:splatd:error:busy", reply.body
        hold.allow_all()
        for thread in busy:
            thread.join()


def test_a_batch_whose_client_left_is_given_up():
    hold = Hold(allowed=2)
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        body = json.dumps(views(50)).encode()
        with socket.create_connection(("127.0.0.1", d.port)) as s:
            s.sendall(f"POST {BATCH} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body)
            eventually(lambda: d.status()["counters"]["frames"] == 2)
        eventually(lambda: d.status()["counters"]["clients_left"] == 1)
        hold.allow_all()
        for _ in range(10):  # each would come after one of the batch
            assert d.ask(fresh(SMALL)).status == 200
        assert d.status()["counters"]["frames"] <= 2 + 1 + 10, "frames for nobody"
        eventually(lambda: d.status()["memory"]["reply_bytes"] == 0)


def test_sigterm_finishes_a_batch():
    hold = Hold(allowed=1)
    d = Daemon(FAKE, *PATIENT, **hold.environment)
    replies = []
    asking = threading.Thread(target=lambda: replies.append(d.post(views(6), BATCH)))
    asking.start()
    eventually(lambda: d.status()["counters"]["frames"] >= 1)
    d.process.terminate()
    eventually(lambda: d.ops("/readyz").status == 503)
    hold.allow_all()
    assert d.wait_exit() == 0
    asking.join()
    assert replies[0].status == 200 and replies[0].headers["Splatd-Failed"] == "0"


run(globals())
