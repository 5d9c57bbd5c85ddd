"""The second listener: what probes and Prometheus are told when all is well, when the device is lost or hangs, when the
queue is full, when the main listener has no connection left, and on the way out."""
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time

from harness import FAKE, PATIENT, REAL, VIEW, WALL, Daemon, Hold, eventually, fresh, run, together

SMALL = VIEW + "?width=16&height=16"


def metrics(d):
    """{'name{labels}': value}; every line must be the text format 0.0.4, every sample have its type and help."""
    reply = d.ops("/metrics")
    assert reply.status == 200 and reply.headers["Content-Type"] == "text/plain; version=0.0.4; charset=utf-8"
    text, samples, types, helped = reply.body.decode(), {}, {}, set()
    assert text.endswith("\n")
    for line in text.splitlines():
        if found := re.fullmatch(r"# HELP ([a-z0-9_]+) \S.*", line):
            assert found[1] not in helped, line
            helped.add(found[1])
        elif found := re.fullmatch(r"# TYPE ([a-z0-9_]+) (counter|gauge|histogram)", line):
            assert found[1] in helped and found[1] not in types, line
            types[found[1]] = found[2]
        else:
            found = re.fullmatch(r'([a-z0-9_]+)(\{(?:[a-z_]+="(?:[^"\\\n]|\\[\\"n])*",?)+\})? (\S+)', line)
            assert found, line
            name = found[1] if found[1] in types else re.sub("_(bucket|sum|count)$", "", found[1])
            assert name in types, line
            assert (types[name] == "counter") == name.endswith("_total"), line
            assert line.split(" ")[0] not in samples, line
            samples[found[1] + (found[2] or "")] = float(found[3])
    return samples


def test_all_is_well():
    with Daemon(REAL) as d:
        for path in ("/healthz", "/readyz"):
            reply = d.ops(path)
            assert (reply.status, reply.body, reply.headers["Cache-Control"]) == (200, b"ok\n", "no-store")
            assert d.ops(path, "HEAD").body == b""
            reply = d.ops(path, "POST")
            assert reply.status == 405 and reply.headers["Allow"] == "GET, HEAD"
        assert d.ops("/").status == d.ops("/v1/status").status == d.ops("/metrics/").status == 404
        assert d.ask("/healthz").status == d.ask("/metrics").status == 404, "it is on the wrong listener as well"
        assert d.status()["parameters"]["ops-listen"] == "127.0.0.1:0"


def test_metrics_count_what_happens():
    with Daemon(REAL) as d:
        for _ in range(3):
            assert d.ask(fresh(SMALL)).status == 200
        assert d.ask(VIEW + "?width=0").status == 400 and d.ask("/nowhere").status == 404
        status, got = d.status(), metrics(d)
        counters = {**status["counters"], "replies_2xx": status["counters"]["replies_2xx"] + 1}  # its own reply
        assert {f"splatd_{name}_total": value for name, value in counters.items()}.items() <= got.items(), got
        device = status["device"]
        [info] = [name for name in got if name.startswith("splatd_device_info{")]
        assert f'name="{device["name"]}"' in info and f'software="{str(device["software"]).lower()}"' in info, info
        assert got["splatd_ready"] == got["splatd_alive"] == got["splatd_datasets"] == 1
        assert got["splatd_standstill_seconds"] == 0 and got["splatd_queue_capacity"] == 32
        assert got["process_resident_memory_bytes"] > 1e6 and got["process_cpu_seconds_total"] > 0
        assert 3 < got["process_open_fds"] < got["process_max_fds"]
        assert abs(got["process_start_time_seconds"] - time.time()) < 600
        time.sleep(0.3)  # a start that moves would be a restart to Prometheus
        assert metrics(d)["process_start_time_seconds"] == got["process_start_time_seconds"]
        for which, count in (("request", 4), ("queue", 3), ("frame", 3), ("encode", 3)):
            name, route = f"splatd_{which}_duration_seconds", 'route="/v1/datasets/{id}/view"'
            buckets = [value for sample, value in got.items() if sample.startswith(f"{name}_bucket{{{route}")]
            assert len(buckets) == 18 and buckets == sorted(buckets) and buckets[-1] == count, (which, buckets)
            assert got[f"{name}_count{{{route}}}"] == count and got[f"{name}_sum{{{route}}}"] > 0
        assert got['splatd_request_duration_seconds_count{route="none"}'] == 1


def test_metrics_of_datasets_stages_and_tours():
    with tempfile.TemporaryDirectory() as top:
        home = pathlib.Path(top, "home")
        home.mkdir()
        shutil.copy(WALL, home / "a.spld")
        (home / "broken.spld").write_bytes(b"no dataset")
        with Daemon(REAL, "--tours", str(pathlib.Path(top, "tours")), "--watch", "50", datasets=[str(home)]) as d:
            got = metrics(d)
            assert (got["splatd_datasets"], got["splatd_datasets_refused"]) == (1, 1), got
            assert 'splatd_dataset_resident_bytes{dataset="broken"}' not in got
            stages = [name for name in got if name.startswith("splatd_stage_seconds_total{")]
            assert len(stages) == 8 and not any(got[name] for name in stages), got
            path = {"keyframes": [{"camera": {"eye": [x, 0, 1], "target": [0, 0, 1], "fov": 60}} for x in (3, 4)]}
            reply = d.post({"path": path, "frames": 3, "settings": {"width": 32, "height": 32}}, "/v1/datasets/a/tours")
            assert reply.status == 202, reply.body
            eventually(lambda: metrics(d)['splatd_tours{state="done"}'] == 1)
            got = metrics(d)
            assert not any(got[f'splatd_tours{{state="{state}"}}'] for state in ("rendering", "video", "failed"))
            assert got["splatd_tour_frames_total"] == 3 and got["splatd_tours_bytes"] > 0
            assert got['splatd_stage_seconds_total{stage="shade"}'] > 0
            one = d.ask("/v1/datasets/a").json()["resident_bytes"]
            assert got['splatd_dataset_resident_bytes{dataset="a"}'] == one > 0
            assert one <= got["splatd_device_memory_bytes"] <= got["splatd_device_memory_limit_bytes"]
            (home / "a.spld").unlink()
            eventually(lambda: metrics(d)["splatd_datasets"] == 0)
            assert 'splatd_dataset_resident_bytes{dataset="a"}' not in metrics(d)


def test_not_ready_while_loading():
    hold = Hold("FAKE_OPENING")
    with Daemon(FAKE, wait_for="health and metrics", **hold.environment) as d:
        eventually(lambda: d.ops("/healthz").status == 200)
        reply = d.ops("/readyz")
        assert reply.status == 503 and b"loaded" in reply.body, reply.body
        assert metrics(d)["splatd_ready"] == 0
        hold.allow_all()
        eventually(lambda: d.ops("/readyz").status == 200)
        eventually(lambda: d.port)  # said on stderr, which a thread of the harness reads
        assert d.ask(fresh(SMALL)).status == 200


def test_probes_are_answered_while_datasets_are_opened():
    with tempfile.TemporaryDirectory() as folder:
        preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
        for gate, waits in ((os.path.join(folder, "a"), True), (os.path.join(folder, "b"), False)):
            with Daemon(FAKE, wait_for="health and metrics", LD_PRELOAD=preload, SLOW_DISK_GATE=gate) as d:
                for _ in range(5):
                    assert d.ops("/healthz").status == 200
                    reply = d.ops("/readyz")
                    assert reply.status == 503 and b"loaded" in reply.body, reply.body
                    got = metrics(d)
                    assert got["splatd_ready"] == got["splatd_datasets"] == 0
                assert d.process.poll() is None and not any("dataset wall" in line for line in d.lines), d.lines
                if not waits:
                    continue  # SIGTERM does not wait for the disk either
                pathlib.Path(gate).touch()
                eventually(lambda: d.ops("/readyz").status == 200)
                eventually(lambda: d.port)
                assert d.ask(fresh(SMALL)).status == 200


def test_a_dataset_that_cannot_be_opened_ends_the_start():
    with tempfile.TemporaryDirectory() as folder:
        broken = pathlib.Path(folder, "broken.spld")
        broken.write_bytes(pathlib.Path(WALL).read_bytes()[:-100])
        try:
            Daemon(FAKE, datasets=[WALL, broken])
            raise SystemExit("it started")
        except AssertionError as error:
            assert re.search(r"exit code [12] before ready", str(error)) and "broken.spld" in str(error), error


def test_not_ready_while_the_queue_is_full():
    hold = Hold()
    with Daemon(FAKE, "--queue", "2", *PATIENT, **hold.environment) as d:
        work = threading.Thread(target=together, args=(8, lambda i: d.ask(fresh(SMALL))))
        work.start()
        eventually(lambda: b"the queue is full: 2 of 2" in d.ops("/readyz").body)
        assert d.ops("/healthz").status == 200
        hold.allow_all()
        work.join()
        assert d.ops("/readyz").status == 200


def test_not_ready_while_the_device_is_reopened():
    hold = Hold("FAKE_OPENING", allowed=None)
    with Daemon(FAKE, SPLATD_INJECT_LOSS_AFTER="1", **hold.environment) as d:
        hold.allow(0)
        assert [d.ask(fresh(SMALL)).status for _ in range(2)] == [200, 503]
        reply = d.ops("/readyz")
        assert reply.status == 503 and b"reopened" in reply.body, reply.body
        assert d.ops("/healthz").status == 200
        hold.allow_all()
        eventually(lambda: d.ops("/readyz").status == 200)
        assert metrics(d)["splatd_device_losses_total"] == 1


def test_a_hanging_driver_fails_liveness_and_ends_the_process():
    for stall_s in (1, 5, 25):  # how long it is told to be dead before it ends; we may be held up meanwhile
        d = Daemon(FAKE, "--deadline", "100", "--stall", str(1000 * stall_s), **Hold("FAKE_HANG").environment)
        assert d.ops("/healthz").status == 200
        began = time.monotonic()
        assert d.ask(fresh(SMALL)).status == 503  # at its deadline
        alive = d.ops("/healthz").status == 200
        assert alive or time.monotonic() - began > stall_s, "slow is not dead"
        try:
            eventually(lambda: d.ops("/healthz").status == 503)
            assert b"nothing has moved" in d.ops("/healthz").body and d.ops("/readyz").status == 503
            assert metrics(d)["splatd_standstill_seconds"] > stall_s
            assert d.ask("/v1/status").status == 200
            told = True
        except OSError:  # it has ended
            told = False
        assert d.wait_exit() == 1
        assert any("the device or its driver hangs; ending" in line for line in d.lines), d.lines
        if alive and told:
            return
    raise AssertionError("it ended before it was told to be dead")


def test_a_long_frame_is_no_hang():
    with Daemon(FAKE, "--stall", "100", "--deadline", "30000", FAKE_FRAME_MS=700) as d:
        work = threading.Thread(target=d.ask, args=(SMALL,))
        work.start()
        while work.is_alive():
            assert d.ops("/healthz").status == 200
            time.sleep(0.05)
        time.sleep(0.3)  # idle for longer than the limit
        assert d.ops("/healthz").status == 200


def test_a_process_that_was_not_run_did_not_hang():
    """As with its machine or container, for longer than all limits together, in the middle of a frame."""
    hold = Hold()
    with Daemon(FAKE, "--stall", "1000", "--deadline", "1000", FAKE_FRAME_MS=0, **hold.environment) as d:
        work = threading.Thread(target=d.ask, args=(SMALL,))
        work.start()
        eventually(lambda: d.status()["counters"]["cache_misses"] == 1)
        d.process.send_signal(signal.SIGSTOP)
        time.sleep(6)
        d.process.send_signal(signal.SIGCONT)
        for _ in range(10):
            assert d.ops("/healthz").status == 200
            time.sleep(0.1)
        hold.allow_all()
        work.join()
        eventually(lambda: d.ask(fresh(SMALL)).status == 200)


def test_a_full_main_listener_does_not_keep_probes_out():
    with Daemon(FAKE, "--connections", "50") as d:
        crowd = []
        try:
            for _ in range(80):
                crowd.append(socket.create_connection(("127.0.0.1", d.port), 5))
            eventually(lambda: metrics(d)["splatd_connections"] >= 50)
            for _ in range(20):
                assert d.ops("/healthz").status == d.ops("/readyz").status == 200
        finally:
            for s in crowd:
                s.close()
        eventually(lambda: metrics(d)["splatd_connections"] == 0)


def test_a_stopping_service_says_so_and_finishes():
    hold = Hold()
    d = Daemon(FAKE, *PATIENT, **hold.environment)
    replies = []
    asking = threading.Thread(target=lambda: replies.append(d.ask(fresh(SMALL))))
    asking.start()
    eventually(lambda: d.status()["counters"]["cache_misses"] == 1)
    d.process.send_signal(signal.SIGTERM)
    eventually(lambda: d.ops("/readyz").status == 503)
    assert d.ops("/readyz").body == b"no: stopping\n" and d.ops("/healthz").status == 200
    hold.allow_all()
    asking.join()
    assert d.wait_exit() == 0 and replies[0].status == 200


def test_a_drain_delay_lets_balancers_notice():
    for delay_s in (1.2, 6, 30):  # we may be held up ourselves, though not for as long
        d = Daemon(FAKE, "--drain-delay", str(int(1000 * delay_s)))
        d.process.send_signal(signal.SIGTERM)
        began = time.monotonic()
        try:
            eventually(lambda: d.ops("/readyz").status == 503)
            reply = d.ask(fresh(SMALL))  # a new connection
            noticed = reply.status == 200 and reply.headers["Connection"] != "close"
        except OSError:
            noticed = False
        assert noticed or time.monotonic() - began > delay_s, "nothing more was accepted"
        assert d.wait_exit() == 0
        if noticed:
            return
    raise AssertionError("nothing more was accepted")


def test_an_address_that_is_taken():
    with Daemon(FAKE) as d:
        taken = f"127.0.0.1:{d.ops_port}"
        try:
            Daemon(FAKE, "--ops-listen", taken)
            raise AssertionError("it started")
        except AssertionError as error:
            assert "exit code 1 " in str(error) and f"{taken}: " in str(error), error
            assert "--ops-listen takes another address" in str(error), error
        with Daemon(FAKE, "--ops-listen", "") as quiet:
            assert quiet.ops_port is None and quiet.ask(SMALL).status == 200
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            other.bind(("127.0.0.1", 8081))
            other.listen()
        except OSError:
            pass  # somebody else has it, which does as well
        process = subprocess.Popen([FAKE, "--listen", "127.0.0.1:0", WALL], stderr=subprocess.PIPE, text=True)
        lines = []
        for line in process.stderr:
            lines.append(line)
            if line.endswith(" ready\n"):
                break
        process.send_signal(signal.SIGTERM)
        assert process.wait(150) == 0
        assert any("warning" in line and "--ops-listen takes another" in line for line in lines), lines


run(globals())
