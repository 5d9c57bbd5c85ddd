"""Views of many samples beside small ones: what one view may cost is bounded, and however many large ones are on their way
small ones are served between their tiles, while the large ones go on too."""
import os
import re
import socket
import subprocess
import tempfile
import threading

from harness import FAKE, PATIENT, REAL, SANITIZED, VIEW, Daemon, Hold, eventually, fresh, run, together

SMALL = VIEW + "?width=16&height=16"
LARGE = VIEW + "?width=2048&height=2048&supersample=4&format=jpeg"  # 64 Mi samples, 16 tiles
BATCH, TOURS = "/v1/datasets/wall/views", "/v1/datasets/wall/tours"


def begin_large(d, count, path=LARGE):
    """Asks for `count` large views beside the test. Returns the list that their replies go to, and the threads."""
    replies = []
    threads = [threading.Thread(target=lambda: replies.append(d.ask(fresh(path)))) for _ in range(count)]
    before = d.status()["counters"]["cache_misses"]
    for thread in threads:
        thread.start()
    eventually(lambda: d.status()["counters"]["cache_misses"] - before >= count)
    return replies, threads


def finish_large(replies, threads):
    for thread in threads:
        thread.join()
    assert [reply.status for reply in replies] == [200] * len(threads), [reply.status for reply in replies]


def ask_beside(d, hold, paths, allowed):
    """The statuses of views that wait together, when so many tiles may be drawn."""
    asked = d.status()["counters"]["cache_misses"]

    def go_on():
        eventually(lambda: d.status()["counters"]["cache_misses"] == asked + len(paths))
        hold.allow(allowed)
    *replies, _ = together(len(paths) + 1, lambda i: d.ask(paths[i]) if i < len(paths) else go_on())
    return [reply.status for reply in replies]


def test_small_views_go_between_the_tiles_of_large_ones():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, FAKE_FRAME_MS=0, **hold.environment) as d:
        replies, threads = begin_large(d, 4)
        assert ask_beside(d, hold, [fresh(SMALL) for _ in range(8)], 40) == [200] * 8  # the large ones have 64
        assert len(replies) < 4, "small views waited for all the large ones"
        hold.allow_all()
        finish_large(replies, threads)


def test_a_small_view_of_much_work_holds_up_no_other():
    """What a forged dataset makes of it would take the device for minutes; it ends at its own deadline."""
    with tempfile.TemporaryDirectory(prefix="splatd-heap-") as home:
        heap = os.path.join(home, "heap.spld")
        subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--heap", heap], check=True)
        for deadline_s in (15, 60, 240):  # machines differ: whoever waited for it would do so however long it takes
            with Daemon(REAL, "--deadline", str(1000 * deadline_s), datasets=[os.environ["SPLATD_WALL"], heap]) as d:
                assert d.ask(fresh(SMALL)).status == 200
                path = "/v1/datasets/heap/view?width=640&height=360&eye=6,0,0&target=0,0,0"
                replies, threads = begin_large(d, 2, path)
                small = [d.ask(fresh(SMALL)).status for _ in range(1 if SANITIZED else 3)]
                between = not replies
                for thread in threads:
                    thread.join()
                assert {reply.status for reply in replies} <= {503, 504}, replies
                if between and set(small) == {200}:
                    return
        raise AssertionError("small views waited for what is much work")


def test_large_views_do_not_fill_the_queue_of_small_ones():
    with Daemon(FAKE, "--queue", "2", *PATIENT, FAKE_MPX_MS=20) as d:
        replies, threads = begin_large(d, 4)
        statuses = [reply.status for reply in together(2, lambda i: d.ask(fresh(SMALL)))]
        assert statuses == [200, 200], statuses
        for thread in threads:
            thread.join()
        assert 200 in [reply.status for reply in replies]


def test_what_a_view_may_cost_counts_samples():
    with Daemon(FAKE) as d:
        reply = d.ask(VIEW + "?width=8192&height=8192&supersample=4")
        problem = reply.json()
        assert reply.status == 400 and problem["field"] == "supersample", problem
        assert "1073741824" in problem["detail"] and "268435456" in problem["detail"], problem
        reply = d.ask(VIEW + "?width=8192&height=8192&layers=color,depth,normal,id&format=raw")
        assert reply.status == 400 and reply.json()["field"] == "layers", reply.json()
        assert d.status()["counters"]["frames"] == 0
    with tempfile.TemporaryDirectory() as folder, \
            Daemon(FAKE, "--max-samples", "40000", "--tours", folder, "--tour-pixels", "100000") as d:
        assert d.status()["limits"]["samples"] == 40000
        assert d.view(width=100, height=100, supersample=2).status == 200
        assert d.view(width=200, height=200, supersample=0.25).status == 200
        for params, field in [({"width": 101, "supersample": 2}, "supersample"), ({"width": 51, "supersample": 4}, "supersample"),
                              ({"width": 401}, "width"), ({"width": 401, "supersample": 0.5}, "width")]:
            reply = d.view(height=100, **params)
            assert reply.status == 400 and reply.json()["field"] == field, (params, reply.body)
            reply = d.post({"height": 100, "views": [{"width": 8}, params]}, BATCH)
            assert reply.status == 400 and reply.json()["field"] == "views[1]." + field, (params, reply.body)
        half = {"width": 75, "height": 75, "supersample": 2}
        reply = d.post({"views": [half] * 2}, BATCH)  # 22,500 samples each
        assert reply.status == 400 and reply.json()["field"] == "views" and "45000 samples" in reply.json()["detail"]
        assert d.post({"views": [half]}, BATCH).status == 200

        keys = [{"camera": {"eye": [x, 0.2, 0.1], "target": [0, 0, 0]}} for x in (3, 4)]
        path, side = {"keyframes": keys}, {"width": 100, "height": 101}
        for settings, frames, field in [({**side, "supersample": 2}, 2, "settings.supersample"),
                                        ({"width": 50, "height": 50, "supersample": 2}, 11, "frames")]:
            reply = d.post({"path": path, "frames": frames, "settings": settings}, TOURS)
            assert reply.status == 400 and reply.json()["field"] == field, reply.body
        own = {"camera_path": [{"camera_to_world": [1, 0, 0, 3, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "fov": 60}] * 2,
               "render_width": 100, "render_height": 101, "fps": 2, "seconds": 1}
        reply = d.post({"path": own, "frames": 2, "settings": {"supersample": 2}}, TOURS)
        assert reply.status == 400 and reply.json()["field"] == "settings.supersample", reply.body


def test_a_plan_chooses_nothing_that_is_too_large():
    with Daemon(FAKE, "--max-samples", "40000") as d:
        for demand in ({"psnr": 60}, {"budget": "60s"}):
            sides = {}
            for side in (100, 150):  # 2 x 2 fits the smaller one, 1.25 x 1.25 the larger
                reply = d.view(width=side, height=side, **demand)
                assert reply.status == 200, reply.body
                sides[side] = re.search("supersample=([0-9.]+)", reply.headers["Splatd-Chosen"]).group(1)
            assert sides == {100: "2", 150: "1.25"}, (demand, sides)


def test_too_many_large_views_are_refused_and_small_ones_are_not():
    hold = Hold(allowed=1)
    with Daemon(FAKE, "--max-samples", "67108864", *PATIENT, FAKE_FRAME_MS=0, **hold.environment) as d:
        assert d.ask(fresh(SMALL)).status == 200
        replies, threads = begin_large(d, 4)
        refused = d.ask(fresh(LARGE))
        assert refused.status == 503 and "large views" in refused.json()["detail"], refused.body
        assert ask_beside(d, hold, [fresh(SMALL)], 12) == [200]
        large = d.status()["queues"]["large"]
        assert large["length"] == 4 and large["samples_max"] == 1 << 28, large
        hold.allow_all()
        finish_large(replies, threads)
        assert d.ask(fresh(LARGE)).status == 200
        eventually(lambda: d.status()["queues"]["large"] == {"length": 0, "samples": 0, "samples_max": 1 << 28, "bytes": 0})


def test_a_large_view_that_nobody_waits_for_ends():
    hold = Hold()
    with Daemon(FAKE, *PATIENT, FAKE_FRAME_MS=0, **hold.environment) as d:
        s = socket.create_connection(("127.0.0.1", d.port))
        s.sendall(f"GET {fresh(LARGE)} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        eventually(lambda: d.status()["queues"]["large"]["length"] == 1)
        assert ask_beside(d, hold, [fresh(SMALL) for _ in range(4)], 4 + 8) == [200] * 4  # it has begun, and has 16 tiles
        s.close()
        eventually(lambda: d.status()["counters"]["clients_left"] == 1)
        hold.allow_all()
        eventually(lambda: d.status()["queues"]["large"]["length"] == 0)
        assert d.status()["counters"]["frames"] == 4, "it was made for nobody"


def test_sigterm_finishes_large_views():
    with Daemon(FAKE, *PATIENT, FAKE_MPX_MS=10) as d:
        replies, threads = begin_large(d, 2)
        assert d.stop() == 0
        finish_large(replies, threads)


def test_encoding_a_large_image_holds_up_no_small_one():
    with Daemon(FAKE, "--encoders", "1", *PATIENT, FAKE_FRAME_MS=0) as d:
        for _ in range(5):  # we may be held up ourselves while they are encoded, though not again and again
            frames = d.status()["counters"]["frames"]
            replies, threads = begin_large(d, 2, VIEW + "?width=8192&height=4096&layer=id&format=png")
            eventually(lambda: d.status()["counters"]["frames"] == frames + 2)  # the first is being encoded
            assert d.ask(fresh(SMALL)).status == 200
            between = len(replies) < 2
            finish_large(replies, threads)
            if between:
                return
        raise AssertionError("the small image waited for the large ones")


def test_frames_of_tours_are_interrupted_too():
    keys = [{"camera": {"eye": [x, 0.2, 0.1], "target": [0, 0, 0]}} for x in (3, 4)]
    tour = {"path": {"keyframes": keys}, "frames": 2, "settings": {"width": 2048, "height": 2048, "supersample": 4}}
    hold = Hold()
    with tempfile.TemporaryDirectory() as folder, Daemon(FAKE, "--tours", folder, *PATIENT, FAKE_FRAME_MS=0, **hold.environment) as d:
        assert d.post(tour, TOURS).status == 202
        paths = [*(fresh(SMALL) for _ in range(4)), fresh(VIEW + "?width=2048&height=2048&supersample=2")]
        assert ask_beside(d, hold, paths, 4 + 4 + 15) == [200] * 5  # a frame has 16 tiles
        assert d.status()["counters"]["tour_frames"] == 0, "views waited for a tour"
        assert d.stop() == 0  # which does not wait for the frame: the next start makes it
        assert not any("frame-" in name for _, _, names in os.walk(folder) for name in names)


def test_an_interrupted_view_has_the_same_bytes():
    path = VIEW + "?width=1200&height=1000&supersample=4&format=png&layer="
    with Daemon(REAL, "--cache", "0", *PATIENT) as d:
        for layer in ("color", "depth"):
            alone, small = d.ask(path + layer), 0
            while small < 2:  # where we are slow, it may be over before we have come between
                replies = []
                thread = threading.Thread(target=lambda: replies.append(d.ask(path + layer)))
                thread.start()
                while thread.is_alive():
                    assert d.ask(fresh(SMALL)).status == 200
                    small += 1
                assert alone.status == replies[0].status == 200
                assert replies[0].body == alone.body and replies[0].headers["ETag"] == alone.headers["ETag"]


run(globals())
