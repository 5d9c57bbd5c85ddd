"""Views whose pages have still to be read: they wait, without holding up others, or do with what is there."""
import contextlib
import os
import re
import shutil
import tempfile
import threading
import time

from harness import FAKE, MAPPED, PATIENT, REAL, TEXTURED, VIEW, Daemon, Hold, eventually, run, together

LARGE = os.environ["SPLATD_WALL_LARGE"]
LOOK = "width=64&height=48&eye=3,0.2,1&target=0,0,1&up=0,0,1&fov=50"


def test_views_that_wait_go_side_by_side():
    hold = Hold("FAKE_PAGES")
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        def go_on():
            eventually(lambda: d.status()["counters"]["cache_misses"] == 3 and not d.status()["queues"]["render"]["length"])
            time.sleep(2)  # that all of them wait
            hold.allow_all()
        *replies, _ = together(4, lambda i: d.ask(f"{VIEW}?{LOOK}&near=0.{i + 1}") if i < 3 else go_on())
        assert all(r.status == 200 and r.headers["Splatd-Complete"] == "true" for r in replies)
        for reply in replies:
            timing = dict(re.findall(r"(\w+);dur=([\d.]+)", reply.headers["Server-Timing"]))
            assert float(timing["pages"]) >= 1900 and float(timing["frame"]) < float(timing["pages"]), timing


def test_who_does_not_wait_shares_no_frame_with_who_does():
    hold = Hold("FAKE_PAGES")
    with Daemon(FAKE, *PATIENT, **hold.environment) as d:
        waiting = []
        thread = threading.Thread(target=lambda: waiting.append(d.ask(f"{VIEW}?{LOOK}")))
        thread.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 1)
        reply = d.ask(f"{VIEW}?{LOOK}&wait=0")
        assert not waiting
        assert reply.headers["Splatd-Complete"] == "false" and reply.headers["Splatd-Cache"] == "miss"
        assert reply.headers["Cache-Control"] == "no-store" and "ETag" not in reply.headers
        hold.allow_all()
        thread.join()
        assert waiting[0].headers["Splatd-Complete"] == "true" and waiting[0].headers["Splatd-Cache"] == "miss"
        again = d.ask(f"{VIEW}?{LOOK}&wait=0") # is the same view, and complete
        assert again.headers["Splatd-Cache"] == "hit" and again.headers["ETag"] == waiting[0].headers["ETag"]


def test_a_view_that_waits_keeps_its_deadline_and_those_who_leave_give_up():
    with Daemon(FAKE, "--deadline", "2000", **Hold("FAKE_PAGES").environment) as d:
        began = time.monotonic()
        reply = d.ask(f"{VIEW}?{LOOK}")
        assert reply.status == 503 and reply.json()["type"].endswith(":timeout"), reply.body
        assert 2 <= time.monotonic() - began
        connection = d.connect()
        connection.request("GET", f"{VIEW}?{LOOK}&near=0.2")
        eventually(lambda: d.status()["counters"]["cache_misses"] == 2)
        connection.close()
        eventually(lambda: d.ask(f"{VIEW}?{LOOK}&wait=0").status == 200)
        assert d.stop() == 0


@contextlib.contextmanager
def room_for_one_of_two(source=TEXTURED):
    """A daemon, its gate, a view of the one and of the other, and what takes the place of the first."""
    with tempfile.TemporaryDirectory() as home:
        one = os.path.join(home, "a.spld")
        shutil.copy(source, one)
        with Daemon(REAL, datasets=[LARGE]) as d:
            limit = d.status()["memory"]["device_bytes"] + 4096
        reads = Hold("SLOW_DISK_READS", allowed=None)
        preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
        near = LOOK.replace("fov=50", "fov=8")  # so that textures are wider than a pixel
        view, large = (f"/v1/datasets/{name}/view?{near}" for name in ("a", os.path.basename(LARGE)[:-5]))
        with Daemon(REAL, "--memory-limit", str(limit), "--deadline", "5000", datasets=[one, LARGE],
                    LD_PRELOAD=preload, **reads.environment) as d:
            def drive_out():
                eventually(lambda: d.ask(f"{large}&near={1e-6 * next(fresh_near):.6f}").headers["Splatd-Complete"] == "true")
            fresh_near = iter(range(1, 100))
            drive_out()
            yield d, reads, view, drive_out


def now(d, path, body=None):
    """What is there now, once it is drawn in time."""
    replies = []

    def drawn():
        replies.append(d.post(body, path) if body else d.ask(path))
        return replies[-1].status == 200
    eventually(drawn)
    return replies[-1]


def test_what_is_there_now():
    with room_for_one_of_two() as (d, reads, view, drive_out):
        reads.allow(1)  # the first page, which is waited for; its textures hang
        body = {"camera": {"eye": [3, 0.2, 1], "target": [0, 0, 1], "fov": 8}, "width": 64, "wait": False}
        replies = [now(d, f"{view}&wait=0"), now(d, f"{view}&wait=0"), now(d, "/v1/datasets/a/view", body)]
        for reply in replies:
            assert reply.headers["Splatd-Complete"] == "false", reply.headers
            assert reply.headers["Splatd-Pending"] == "true"
            assert reply.headers["Splatd-Cache"] == "miss"
            assert reply.headers["Cache-Control"] == "no-store" and "ETag" not in reply.headers
        late = d.ask(view)
        assert late.status == 503 and late.json()["type"].endswith(":timeout"), late.body
        reads.allow_all()
        eventually(lambda: d.ask(f"{view}&wait=0").headers["Splatd-Pending"] == "false")
        whole = d.ask(f"{view}&wait=0")
        waited = d.ask(view)
        assert waited.headers["Splatd-Cache"] == whole.headers["Splatd-Cache"] == "hit"
        assert waited.headers["ETag"] == whole.headers["ETag"] and waited.body == whole.body != replies[0].body
        drive_out()
        assert now(d, f"{view}&near=0.5&wait=1").headers["Splatd-Complete"] == "true"


def test_maps_are_read_as_pages_are():
    with room_for_one_of_two(MAPPED) as (d, reads, view, drive_out):
        view += "&format=raw"
        reads.allow(1)  # the first page; the map hangs
        early = now(d, f"{view}&wait=0")
        assert early.headers["Splatd-Complete"] == "false" and early.headers["Splatd-Pending"] == "true", early.headers
        plain = now(d, f"{view}&maps=off&wait=0")
        assert plain.headers["Splatd-Complete"] == "true" and plain.body == early.body
        late = d.ask(view)
        assert late.status == 503 and late.json()["type"].endswith(":timeout"), late.body
        reads.allow_all()
        eventually(lambda: d.ask(f"{view}&wait=0").headers["Splatd-Complete"] == "true")
        whole = d.ask(view)
        assert whole.headers["Splatd-Cache"] == "hit" and whole.body != early.body
        assert d.ask("/v1/datasets/a").json()["resident_bytes"] >= d.ask("/v1/datasets/a").json()["maps"]["bytes"]
        drive_out()
        assert d.ask("/v1/datasets/a").json()["resident_bytes"] < d.ask("/v1/datasets/a").json()["maps"]["bytes"]


def test_a_daemon_ends_though_a_read_hangs():
    with room_for_one_of_two() as (d, reads, view, _):
        reads.allow(0)
        assert d.ask(view).json()["type"].endswith(":timeout")
        assert d.stop() == 0


def test_head_of_what_is_there_now_promises_nothing():
    with Daemon(FAKE) as d:
        for query, promised in (("", True), ("&wait=1", True), ("&wait=0", False)):
            reply = d.ask(f"{VIEW}?{LOOK}{query}", method="HEAD")
            assert reply.status == 200 and ("ETag" in reply.headers) == promised, (query, reply.headers)
            assert (reply.headers["Cache-Control"] == "no-store") != promised, (query, reply.headers)


def test_what_wait_may_be():
    with Daemon(FAKE) as d:
        for value in ("2", "-1", "yes", "", "no"):
            reply = d.ask(f"{VIEW}?wait={value}")
            assert reply.status == 400 and reply.json()["field"] == "wait", reply.body
        assert d.post({"wait": 2}).json()["field"] == "wait"
        for value in (True, False, 1, 0):
            assert d.post({"wait": value, "width": 16}).status == 200
        assert d.ask(f"{VIEW}?wait=true&width=16").status == 200
        assert d.ask("/v1/datasets/wall/pick?x=1&y=1&wait=0").json()["field"] == "wait"


run(globals())
