"""Several devices in one daemon: the same bytes whichever draws, each dataset on all of them, and a device that is lost
leaves the others serving."""
import pathlib
import shutil
import tempfile

from harness import FAKE, PATIENT, REAL, VIEW, WALL, Daemon, Hold, eventually, fresh, run, together

SMALL = VIEW + "?width=16&height=16"


def states(d):
    return [device["state"] for device in d.status()["devices"]]


def test_the_bytes_are_those_of_one_device():
    views = [f"?width=96&height=64&eye=3,{y},1&target=0,0,1&method={method}&format=png"
             for y in range(-3, 3) for method in ("splat", "points", "fill")]
    views += ["?width=2500&height=2000&format=png", "?width=64&height=48&layer=depth&format=npy"]
    with Daemon(REAL, "--cache", "0") as d:
        [device] = d.status()["devices"]
        one = [d.ask(VIEW + view) for view in views]
    twice = ",".join([f'{device["backend"]}:{device["index"]}'] * 2)
    with Daemon(REAL, "--cache", "0", "--device", twice) as d:
        devices = d.status()["devices"]
        assert [device["state"] for device in devices] == ["ready", "ready"]
        assert all(d.status()["device"].items() <= device.items() for device in devices), devices
        assert 0 < sum(device["device_limit_bytes"] for device in devices) <= device["device_limit_bytes"] + 1, devices
        def all_draw():
            return all(device["frames"] > 0 for device in d.status()["devices"])
        for turn in range(20):  # which of them is at hand is not ours to say
            if turn > 1 and all_draw():
                break
            two = together(len(views), lambda i: d.ask(VIEW + views[i]))
            for view, a, b in zip(views, one, two):
                assert (b.status, b.body == a.body, b.headers["ETag"] == a.headers["ETag"]) == (200, True, True), view
        status = d.status()
        assert all_draw(), "one drew everything"
        assert sum(device["frames"] for device in status["devices"]) == status["counters"]["frames"]
        assert sum("rendering on " in line for line in d.lines) == 2


# From some 1280x720 samples on: by pieces, of all methods and what looks beyond the borders of one.
LARGE = [f"?width=1280&height=1000&eye=3,{y},1&target=0,0,1&method={method}&format=png"
         for y, method in enumerate(("splat", "points", "fill", "nearest"))]
LARGE += ["?width=2500&height=2000&format=png&shade=edl", "?width=700&height=600&supersample=2&format=png",
          "?width=1280&height=1000&layers=depth,normal,id,coverage,primitive&container=zip&format=npy",
          "?width=1280&height=1000&soft=plane:0,0,1,0,0,1%3E0&clip=y%3C2&format=png",
          "?width=1100&height=1100&projection=orthographic&units_per_pixel=0.005&eye=0,0,9&target=0,0,0&format=png"]


def test_a_large_view_of_all_devices_has_the_bytes_of_one():
    with Daemon(REAL, "--cache", "0") as d:
        [device] = d.status()["devices"]
        one = [d.ask(VIEW + view) for view in LARGE]
    twice = ",".join([f'{device["backend"]}:{device["index"]}'] * 2)
    with Daemon(REAL, "--cache", "0", "--device", twice) as d:
        for view, a in zip(LARGE, one):
            b = d.ask(VIEW + view)
            assert (a.status, b.status, b.body == a.body, b.headers["ETag"] == a.headers["ETag"]) == (
                200, 200, True, True), (view, a.status, b.status)
            told = [name for name in a.headers if name.startswith("Splatd-") and name != "Splatd-Soft-Drawn"]  # by piece
            assert [b.headers[name] for name in told] == [a.headers[name] for name in told], view
        assert d.status()["counters"]["frames"] == len(LARGE)
    with Daemon(REAL, "--cache", "0", "--device", twice, SPLATD_INJECT_LOSS_AFTER="1x1") as d:
        assert d.ask(fresh(SMALL)).status == 200
        b = d.ask(VIEW + LARGE[0])
        assert (b.status, b.body == one[0].body) == (200, True), b.status
        assert d.status()["counters"]["device_losses"] == 1


def test_views_are_drawn_side_by_side():
    hold = Hold()
    with Daemon(FAKE, "--device", "fake:0,fake:1,fake:2", *PATIENT, **hold.environment) as d:
        def go_on():
            eventually(lambda: d.status()["counters"]["cache_misses"] == 3)
            eventually(lambda: d.status()["queues"]["render"]["length"] == 0)  # or they wait for each other
            hold.allow_all()
        *replies, _ = together(4, lambda i: d.ask(fresh(SMALL)) if i < 3 else go_on())
        assert [reply.status for reply in replies] == [200] * 3


def test_datasets_come_and_go_on_all_devices():
    with tempfile.TemporaryDirectory() as home:
        shutil.copy(WALL, pathlib.Path(home, "a.spld"))
        with Daemon(FAKE, "--device", "fake:0,fake:1", "--watch", "50", datasets=[home]) as d:
            for round in range(6):
                eventually(lambda: d.ask("/v1/datasets/a").status == 200)
                assert d.ask("/v1/datasets/a").json()["resident_bytes"] == 2 << 16
                replies = together(8, lambda i: d.ask(fresh("/v1/datasets/a/view?width=16&height=16")))
                assert [reply.status for reply in replies] == [200] * 8
                pathlib.Path(home, "a.spld").unlink()
                eventually(lambda: d.ask("/v1/datasets/a").status == 404)
                shutil.copy(WALL, pathlib.Path(home, "new"))
                pathlib.Path(home, "new").rename(pathlib.Path(home, "a.spld"))
            assert d.status()["memory"]["device_bytes"] < 1 << 30


def test_a_lost_device_leaves_the_others_and_comes_back():
    hold = Hold("FAKE_OPENING", allowed=None)
    with Daemon(FAKE, "--device", "fake:0,fake:1", SPLATD_INJECT_LOSS_AFTER="40x1", **hold.environment) as d:  # the second after 80
        codes = []

        def lose(count):
            while d.status()["counters"]["device_losses"] < count:
                codes.extend(reply.status for reply in together(2, lambda i: d.ask(fresh(SMALL))))
                assert len(codes) < 1000
        hold.allow(0)
        lose(1)
        assert sorted(states(d)) == ["ready", "rebuilding"] and d.ops("/readyz").status == 200
        other = states(d).index("ready")
        left = min(10, 40 * (other + 1) - 1 - d.status()["devices"][other]["frames"])  # before it is lost, too
        assert [d.ask(fresh(SMALL)).status for _ in range(left)] == [200] * left
        hold.allow_all()
        eventually(lambda: states(d) == ["ready", "ready"])
        lose(2)
        assert codes.count(503) <= 4 and set(codes) == {200, 503}, codes
        eventually(lambda: states(d) == ["ready", "ready"])
        assert d.log("device 1 of 2 lost") and d.log("device 2 of 2 lost")


def test_a_device_that_stays_away_is_given_up():
    d = Daemon(FAKE, "--device", "fake:0,fake:1", FAKE_FRAME_MS=5, FAKE_OPEN_LIMIT=2, SPLATD_INJECT_LOSS_AFTER="5x9")
    codes = []
    while d.status()["counters"]["device_losses"] < 1:
        codes.append(d.ask(fresh(SMALL)).status)
        assert len(codes) < 50
    eventually(lambda: "failed" in states(d))
    assert d.ops("/readyz").status == 200 and d.status()["state"] == "ready"
    gauges = d.ops("/metrics").body.decode()
    assert 'splatd_devices{state="failed"} 1\n' in gauges and 'splatd_devices{state="ready"} 1\n' in gauges
    assert d.ask(fresh(SMALL)).status == 200, "the other serves"
    try:
        for _ in range(20):
            d.ask(fresh(SMALL))
    except OSError:
        pass  # it ends with its last device
    assert d.wait_exit() == 1
    assert any("is given up, the others go on" in line for line in d.lines), d.lines


def test_lists_of_devices_are_checked():
    for devices, text in {"fake,other": "two kinds", "fake,": "empty", ",".join(["fake"] * 17): "more than 16"}.items():
        try:
            with Daemon(FAKE, "--device", devices):
                raise SystemExit(f"{devices} was taken")
        except AssertionError as ended:
            assert text in str(ended) and "device" in str(ended), ended
    try:
        with Daemon(REAL, "--device", "vulkan:97,vulkan:98"):
            raise SystemExit("devices that are not there were taken")
    except AssertionError as ended:
        assert "vulkan:97" in str(ended) or "vulkan:98" in str(ended), ended


run(globals())
