"""More than the device can do, clients that leave or dawdle, a device that is lost, a daemon that is told to stop:
every reply is 200 or says when to come back, and none is dropped."""
import os
import pathlib
import re
import signal
import socket
import threading
import time

from harness import FAKE, REAL, VIEW, Daemon, eventually, fresh, run, together

SMALL = VIEW + "?width=16&height=16"


def processor_s(d):
    """What the daemon has taken of processors so far."""
    fields = pathlib.Path(f"/proc/{d.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def statuses(replies):
    for reply in replies:
        if isinstance(reply, Exception):
            raise reply
    return [reply.status for reply in replies]


def test_a_full_queue_is_said_at_once():
    with Daemon(FAKE, "--queue", "2", FAKE_FRAME_MS=200) as d:
        assert d.ask(fresh(SMALL)).status == 200  # so that the service knows how long a frame takes
        times = {}

        def ask(i):
            began = time.monotonic()
            reply = d.ask(fresh(SMALL))
            times.setdefault(reply.status, []).append(time.monotonic() - began)
            return reply
        got = statuses(together(12, ask))
        assert set(got) == {200, 503} and 3 <= got.count(200) <= 5, got
        assert max(times[503]) < max(times[200]), times  # 200 waited for two frames before it, 503 for none
        counters = d.status()["counters"]
        assert counters["refused_full"] == got.count(503) and counters["frames"] == got.count(200) + 1


def test_who_asks_again_finds_no_queue_full_of_what_nobody_waits_for():
    """Behind a frame that takes longer than the deadline: clients with their timeout ask again, and so do others."""
    with Daemon(FAKE, "--queue", "4", "--deadline", "1500", "--cache", "0", FAKE_HANG_MS=8000, FAKE_FRAME_MS=0) as d:
        hangs = threading.Thread(target=lambda: d.ask(fresh(SMALL)))
        hangs.start()
        eventually(lambda: d.status()["queues"]["render"]["length"] == 0 and d.status()["counters"]["requests"] > 1)
        for _ in range(2):
            replies = together(4, lambda i: d.ask(fresh(SMALL)))
            assert [reply.json()["type"] for reply in replies] == ["urn:splatd:error:timeout"] * 4, [r.body for r in replies]
        left = [d.connect() for _ in range(4)]
        for connection in left:
            connection.request("GET", fresh(SMALL))
        eventually(lambda: d.status()["queues"]["render"]["length"] == 4)
        assert d.ask(fresh(SMALL)).json()["type"] == "urn:splatd:error:busy"  # these are waited for
        for connection in left:
            connection.close()
        eventually(lambda: d.status()["counters"]["clients_left"] == 4)
        assert d.ask(fresh(SMALL)).status in (200, 503) and d.status()["counters"]["refused_full"] == 1
        hangs.join()


def test_the_deadline_ends_a_wait():
    with Daemon(FAKE, "--deadline", "300", FAKE_FRAME_MS=200) as d:
        got = statuses(together(6, lambda i: d.ask(fresh(SMALL))))
        assert got.count(200) == 1 and got.count(503) == 5, got
        eventually(lambda: d.status()["queues"]["render"]["length"] == 0)
        status = d.status()
        assert status["counters"]["deadline_missed"] == 5 and status["counters"]["frames"] == 1, status
        assert d.ask(fresh(SMALL)).status == 200


def test_a_frame_slower_than_the_deadline_ends_too():
    with Daemon(FAKE, "--deadline", "100", FAKE_FRAME_MS=5000) as d:
        assert d.post({"width": 16, "height": 16}).status == 503
        reply = d.ask(fresh(SMALL))
        assert reply.status == 503 and reply.json()["type"] == "urn:splatd:error:timeout", reply.body
        assert "deadline" in reply.json()["detail"], reply.body


def test_work_of_clients_that_left_is_dropped():
    with Daemon(FAKE, FAKE_FRAME_MS=300) as d:
        first = threading.Thread(target=lambda: d.ask(fresh(SMALL)))
        first.start()
        eventually(lambda: d.status()["counters"]["requests"] >= 2)
        gone = []
        for _ in range(8):
            s = socket.create_connection(("127.0.0.1", d.port))
            s.sendall(f"GET {fresh(SMALL)} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            gone.append(s)
        eventually(lambda: d.status()["queues"]["render"]["length"] >= 7)
        for s in gone:
            s.close()
        assert d.ask(fresh(SMALL)).status == 200
        first.join()
        counters = d.status()["counters"]
        assert counters["clients_left"] == 8 and counters["frames"] == 2, (counters, "frames were rendered for nobody")


def lose_under_load(d, losses):
    def work(i):
        connection, got = d.connect(), []
        for _ in range(25):
            reply = d.ask(fresh(SMALL), connection=connection)
            got.append((reply.status, reply.body if reply.status == 200 else reply.json()["type"]))
        return got
    results = together(6, work)
    for result in results:
        if isinstance(result, Exception):
            raise result
    replies = [reply for result in results for reply in result]
    assert {status for status, _ in replies} == {200, 503}
    assert {kind for status, kind in replies if status == 503} == {"urn:splatd:error:device-lost"}
    assert len({body for status, body in replies if status == 200}) == 1, "frames differ after the loss"
    assert d.ask(fresh(SMALL)).status == 200
    status = d.status()
    assert status["state"] == "ready" and status["counters"]["device_losses"] == losses, status


def test_a_lost_device_comes_back_under_load():
    with Daemon(FAKE, FAKE_FRAME_MS=2, SPLATD_INJECT_LOSS_AFTER="40x3") as d:
        lose_under_load(d, 3)


def test_a_real_device_comes_back_under_load():
    with Daemon(REAL, SPLATD_INJECT_LOSS_AFTER="40x2") as d:
        lose_under_load(d, 2)


def test_too_many_losses_end_the_daemon():
    d = Daemon(FAKE, FAKE_FRAME_MS=1, SPLATD_INJECT_LOSS_AFTER="2x50")
    got = []
    try:
        for _ in range(50):
            got.append(d.ask(fresh(SMALL)).status)
    except OSError:
        pass  # it has ended
    assert d.wait_exit() == 1
    assert got.count(503) >= 4 and got.count(200) == 8, got
    assert any("more than 3 times" in line for line in d.lines), d.lines


def test_nobody_waits_for_a_device_that_is_gone():
    d = Daemon(FAKE, FAKE_FRAME_MS=1, FAKE_OPEN_LIMIT=1, SPLATD_INJECT_LOSS_AFTER="1")
    views = {"views": [{"camera": {"eye": [3 + i, 2, 3], "target": [0, 0, 0]}, "width": 8, "height": 6}
                       for i in range(12)]}
    began = time.monotonic()
    try:
        assert d.post(views, "/v1/datasets/wall/views").status in (200, 503)
    except OSError:
        pass  # it has ended
    assert d.wait_exit() == 1
    assert time.monotonic() - began < 6, "the batch waited for its deadline"


def test_a_device_that_stays_away_ends_the_daemon():
    d = Daemon(FAKE, FAKE_OPEN_LIMIT=1, SPLATD_INJECT_LOSS_AFTER="1")
    assert [d.ask(fresh(SMALL)).status for _ in range(2)] == [200, 503]
    assert d.wait_exit() == 1


def test_sigterm_under_load_drops_no_reply():
    for number in (signal.SIGTERM, signal.SIGINT):
        d = Daemon(FAKE, FAKE_FRAME_MS=20)
        stopping = threading.Event()

        def work(i):
            connection, good = d.connect(), 0
            while True:
                asked = stopping.is_set()
                try:
                    reply = d.ask(fresh(SMALL), connection=connection)
                except OSError:
                    assert asked, "a request sent before the signal was dropped"
                    return good
                assert reply.status == 200, reply.status
                good += 1
                if reply.headers["Connection"] == "close":
                    return good
        timer = threading.Timer(0.5, lambda: (stopping.set(), d.process.send_signal(number)))
        timer.start()
        for result in together(8, work):
            if isinstance(result, Exception):
                raise result
            assert result >= 1
        timer.join()
        assert d.wait_exit() == 0
        assert not any("bug" in line for line in d.lines)


def test_sigterm_finishes_a_long_frame():
    d = Daemon(FAKE, FAKE_FRAME_MS=1500)
    replies = []
    asking = threading.Thread(target=lambda: replies.append(d.ask(fresh(SMALL))))
    asking.start()
    eventually(lambda: d.status()["counters"]["requests"] >= 2)
    d.process.send_signal(signal.SIGTERM)
    time.sleep(0.3)
    try:
        socket.create_connection(("127.0.0.1", d.port), 1).close()
        raise AssertionError("still accepts")
    except ConnectionRefusedError:
        pass
    assert d.wait_exit() == 0
    asking.join()
    assert replies[0].status == 200 and replies[0].headers["Connection"] == "close"


def test_a_second_signal_ends_at_once():
    d = Daemon(FAKE, "--deadline", "600000", FAKE_FRAME_MS=500000)  # far longer than wait_exit() is patient
    s = socket.create_connection(("127.0.0.1", d.port))
    s.sendall(f"GET {fresh(SMALL)} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    eventually(lambda: d.status()["counters"]["requests"] >= 2)
    d.process.send_signal(signal.SIGTERM)
    time.sleep(0.2)
    d.process.send_signal(signal.SIGTERM)
    assert d.wait_exit() == 1
    s.close()


def test_slow_requests_are_cut_and_cost_nothing():
    with Daemon(FAKE) as d:
        slow = [socket.create_connection(("127.0.0.1", d.port)) for _ in range(50)]
        began, busy_s, cut = time.monotonic(), processor_s(d), 0
        while cut < len(slow) and time.monotonic() - began < 60:
            cut = 0
            for s in slow:
                try:
                    s.send(b"G" if time.monotonic() - began < 1 else b"E")
                    s.setblocking(False)
                    cut += s.recv(1000) == b""
                except BlockingIOError:
                    pass
                except OSError:
                    cut += 1
            assert d.ask(fresh(SMALL)).status == 200
            time.sleep(0.5)
        took, busy_s = time.monotonic() - began, processor_s(d) - busy_s
        assert cut == len(slow), cut
        assert took > 8, "cut although they had time left"
        assert busy_s < 0.2 * took, (busy_s, took)
        assert d.status()["counters"]["slow_closed"] >= len(slow)


def test_idle_connections_do_not_stop_the_daemon():
    with Daemon(FAKE, "--deadline", "600000") as d:  # what an exit may wait for: far longer than stop() is patient
        idle = [socket.create_connection(("127.0.0.1", d.port)) for _ in range(20)]
        keep = d.connect()
        assert d.ask(fresh(SMALL), connection=keep).status == 200
        assert d.stop() == 0
        for s in idle:
            s.close()


def test_half_a_request_holds_up_no_exit():
    with Daemon(FAKE, "--deadline", "600000") as d:
        halves = [socket.create_connection(("127.0.0.1", d.port)) for _ in range(4)]
        for s in halves:
            s.sendall(f"POST {VIEW} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99\r\n\r\n{{".encode())
        eventually(lambda: d.status()["counters"]["requests"] >= 4)
        assert d.stop() == 0
        for s in halves:
            s.close()


def test_equal_requests_get_equal_bytes_under_load():
    with Daemon(REAL, "--queue", "64", "--cache", "0") as d:
        got = together(20, lambda i: [d.ask(VIEW + "?width=160&height=90").body for _ in range(5)])
        assert len({body for bodies in got for body in bodies}) == 1


def test_memory_is_flat():
    def resident():
        return d.status()["memory"]["resident_bytes"]
    # AddressSanitizer keeps what is freed for a while: no leak either
    asan = os.environ.get("ASAN_OPTIONS", "") + ":quarantine_size_mb=1:thread_local_quarantine_size_kb=64"
    with Daemon(FAKE, "--cache", "0", FAKE_FRAME_MS=0, ASAN_OPTIONS=asan) as d:
        for _ in range(100):
            d.ask(VIEW)
        before = resident()
        for i in range(400):
            d.ask(VIEW if i % 4 else VIEW + "?width=0")
        assert resident() - before < 4 << 20, (before, resident())


def test_ipv6_and_quiet():
    import http.client
    import subprocess
    from harness import WALL
    with socket.socket(socket.AF_INET6) as probe:
        try:
            probe.bind(("::1", 0))
        except OSError:
            return  # a machine without IPv6
        port = probe.getsockname()[1]
    process = subprocess.Popen([FAKE, "--quiet", "--ops-listen", "", "--listen", f"[::1]:{port}", WALL],
                               stderr=subprocess.PIPE, text=True)

    def up():
        try:
            connection = http.client.HTTPConnection("::1", port, timeout=5)
            connection.request("GET", "/v1/status")
            return connection.getresponse().status == 200
        except OSError:
            return False
    eventually(up)
    process.send_signal(signal.SIGTERM)
    assert process.wait(10) == 0 and process.stderr.read() == ""


run(globals())
