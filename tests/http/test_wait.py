"""Views whose pages have still to be read: they wait, without holding up others, or do with what is there."""
import contextlib
import os
import re
import shutil
import tempfile
import threading
import time

from harness import FAKE, MAPPED, REAL, TEXTURED, VIEW, Daemon, eventually, run, together

LARGE = os.environ["SPLATD_WALL_LARGE"]
LOOK = "width=64&height=48&eye=3,0.2,1&target=0,0,1&up=0,0,1&fov=50"


class Reads:
    """The gate of slow_disk.c."""

    def __init__(self, home):
        self.path = os.path.join(home, "reads")
        preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
        self.environment = {"LD_PRELOAD": preload, "SLOW_DISK_READS": self.path}

    def allow(self, count):
        with open(self.path + "~", "w") as file:
            file.write(str(count))
        os.rename(self.path + "~", self.path)

    def allow_all(self):
        os.unlink(self.path)


def test_views_that_wait_go_side_by_side():
    with Daemon(FAKE, FAKE_PAGES_MS=1500) as d:
        began = time.monotonic()
        replies = together(3, lambda i: d.ask(f"{VIEW}?{LOOK}&near=0.{i + 1}"))
        assert all(r.status == 200 and r.headers["Splatd-Complete"] == "true" for r in replies)
        took = time.monotonic() - began
        assert 1.5 <= took < 4, took
        for reply in replies:
            timing = dict(re.findall(r"(\w+);dur=([\d.]+)", reply.headers["Server-Timing"]))
            assert float(timing["pages"]) >= 1000 > float(timing["queue"]) + float(timing["frame"]), timing


def test_who_does_not_wait_shares_no_frame_with_who_does():
    with Daemon(FAKE, FAKE_PAGES_MS=3000) as d:
        waiting = []
        thread = threading.Thread(target=lambda: waiting.append(d.ask(f"{VIEW}?{LOOK}")))
        thread.start()
        time.sleep(0.3)
        reply = d.ask(f"{VIEW}?{LOOK}&wait=0")
        assert thread.is_alive()
        assert reply.headers["Splatd-Complete"] == "false" and reply.headers["Splatd-Cache"] == "miss"
        assert reply.headers["Cache-Control"] == "no-store" and "ETag" not in reply.headers
        thread.join()
        assert waiting[0].headers["Splatd-Complete"] == "true" and waiting[0].headers["Splatd-Cache"] == "miss"
        again = d.ask(f"{VIEW}?{LOOK}&wait=0") # is the same view, and complete
        assert again.headers["Splatd-Cache"] == "hit" and again.headers["ETag"] == waiting[0].headers["ETag"]


def test_a_view_that_waits_keeps_its_deadline_and_those_who_leave_give_up():
    with Daemon(FAKE, "--deadline", "400", FAKE_PAGES_MS=60000) as d:
        began = time.monotonic()
        reply = d.ask(f"{VIEW}?{LOOK}")
        assert reply.status == 503 and reply.json()["type"].endswith(":timeout"), reply.body
        assert 0.4 <= time.monotonic() - began < 10
        connection = d.connect()
        connection.request("GET", f"{VIEW}?{LOOK}&near=0.2")
        time.sleep(0.1)
        connection.close()
        assert d.ask(f"{VIEW}?{LOOK}&wait=0").status == 200
        assert d.stop() == 0


@contextlib.contextmanager
def room_for_one_of_two(source=TEXTURED):
    """A daemon, its gate, a view of the one and of the other, and what takes the place of the first."""
    with tempfile.TemporaryDirectory() as home:
        one = os.path.join(home, "a.spld")
        shutil.copy(source, one)
        with Daemon(REAL, datasets=[LARGE]) as d:
            limit = d.status()["memory"]["device_bytes"] + 4096
        reads = Reads(home)
        near = LOOK.replace("fov=50", "fov=8")  # so that textures are wider than a pixel
        view, large = (f"/v1/datasets/{name}/view?{near}" for name in ("a", os.path.basename(LARGE)[:-5]))
        with Daemon(REAL, "--memory-limit", str(limit), "--deadline", "2000", datasets=[one, LARGE],
                    **reads.environment) as d:
            def drive_out():
                eventually(lambda: d.ask(f"{large}&near={1e-6 * next(fresh_near):.6f}").headers["Splatd-Complete"] == "true")
            fresh_near = iter(range(1, 100))
            drive_out()
            yield d, reads, view, drive_out


def test_what_is_there_now():
    with room_for_one_of_two() as (d, reads, view, drive_out):
        reads.allow(1)  # the first page, which is waited for; its textures hang
        body = {"camera": {"eye": [3, 0.2, 1], "target": [0, 0, 1], "fov": 8}, "width": 64, "wait": False}
        replies = [d.ask(f"{view}&wait=0"), d.ask(f"{view}&wait=0"), d.post(body, "/v1/datasets/a/view")]
        for reply in replies:
            assert reply.status == 200 and reply.headers["Splatd-Complete"] == "false", reply.headers
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
        assert d.ask(f"{view}&near=0.5&wait=1").headers["Splatd-Complete"] == "true"


def test_maps_are_read_as_pages_are():
    with room_for_one_of_two(MAPPED) as (d, reads, view, drive_out):
        view += "&format=raw"
        reads.allow(1)  # the first page; the map hangs
        early = d.ask(f"{view}&wait=0")
        assert early.headers["Splatd-Complete"] == "false" and early.headers["Splatd-Pending"] == "true", early.headers
        plain = d.ask(f"{view}&maps=off&wait=0")
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
        began = time.monotonic()
        assert d.stop() == 0
        assert time.monotonic() - began < 20


def test_head_of_what_is_there_now_promises_nothing():
    with Daemon(FAKE) as d:
        for query, promised in (("", True), ("&wait=1", True), ("&wait=0", False)):
            reply = d.ask(f"{VIEW}?{LOOK}{query}", method="HEAD")
            assert reply.status == 200 and ("ETag" in reply.headers) == promised, (query, reply.headers)
            assert (reply.headers["Cache-Control"] == "no-store") != promised, (query, reply.headers)


def test_what_wait_may_be():
    with Daemon(FAKE) as d:
        for value in ("2", "-1", "true", "", "no"):
            reply = d.ask(f"{VIEW}?wait={value}")
            assert reply.status == 400 and reply.json()["field"] == "wait", reply.body
        assert d.post({"wait": 0}).json()["field"] == "wait"
        assert d.post({"wait": True, "width": 16}).status == 200
        assert d.ask("/v1/datasets/wall/pick?x=1&y=1&wait=0").json()["field"] == "wait"


run(globals())
