"""The log: a line a request with its id, without secrets, as text or JSON; a flood of requests or a reader that sleeps
costs nobody anything."""
import http.client
import json
import re
import socket
import subprocess
import time

from harness import FAKE, PATIENT, VIEW, WALL, Daemon, Hold, eventually, run, together

SMALL = VIEW + "?width=16&height=16"


def requests_in(d, count):
    """The log's first `count` lines about requests, parsed; waits for them."""
    def found():
        return [json.loads(line) for line in d.lines if '"message":"request"' in line]
    eventually(lambda: len(found()) >= count)
    return found()


def test_a_line_a_request():
    with Daemon(FAKE, "--log-format", "json") as d:
        replies = [d.ask(SMALL), d.ask(VIEW + "?width=0&sig=geheim"), d.post({}), d.ask("/nowhere?token=geheim"),
                   d.ask("/" + "a" * 9000), d.ask("/v1/status", "HEAD")]
        lines = requests_in(d, len(replies))
        assert all({"time", "level", "message", "id", "method", "path", "status", "bytes", "ms"} <= set(line) for line in lines)
        assert [line["status"] for line in lines] == [r.status for r in replies] == [200, 400, 200, 404, 414, 200]
        assert [line["id"] for line in lines] == [r.headers["X-Request-Id"] for r in replies]
        assert [line["method"] for line in lines] == ["GET", "GET", "POST", "GET", "GET", "HEAD"]
        assert [line["path"] for line in lines[:4]] == [VIEW, VIEW, VIEW, "/nowhere"]
        for line, reply in zip(lines, replies):
            assert len(reply.body) < line["bytes"] < len(reply.body) + 2000, (line, len(reply.body))
            assert 0 <= line["ms"] < 60000
        # what the cache said, where it was asked
        assert [line.get("cache") for line in lines] == [r.headers.get("Splatd-Cache") for r in replies]
        assert d.ask(SMALL).headers["Splatd-Cache"] == requests_in(d, len(replies) + 1)[-1]["cache"] == "hit"
        assert "geheim" not in "".join(d.lines)
        for line in d.lines:
            assert {"time", "level", "message"} <= set(json.loads(line)), line


def test_request_ids():
    with Daemon(FAKE) as d:
        for sane in ("a", "0-._Z", "f" * 64):
            assert d.ask(SMALL, headers={"X-Request-Id": sane}).headers["X-Request-Id"] == sane
        problem = d.ask(VIEW + "?width=0", headers={"X-Request-Id": "mine"})
        assert problem.json()["instance"] == "urn:splatd:request:mine"
        own = set()
        for insane in ("", "f" * 65, "a b", "a\"b", "a;b", "é", "{}"):
            got = d.ask(SMALL, headers={"X-Request-Id": insane.encode("utf-8")}).headers["X-Request-Id"]
            assert re.fullmatch("[0-9a-f]{8}-[0-9]+", got), (insane, got)
            own.add(got)
        assert len(own) == 7, own
        eventually(lambda: any("id=mine method=GET path=/v1/datasets/wall/view status=400 " in line for line in d.lines))
        pairs = d.ask(VIEW + "?" + "a&" * 300)  # answered past libmicrohttpd
        assert pairs.status == 414 and pairs.json()["instance"].endswith(pairs.headers["X-Request-Id"])
        large = d.ask(SMALL, headers={"X-Request-Id": "much", "X-Much": "y" * 13000})
        assert large.status == 431 and large.json()["instance"] == "urn:splatd:request:much" and large.json()["field"] == "headers"
        eventually(lambda: [line for line in d.lines if "id=much method=GET path=/v1/datasets/wall/view status=431 " in line
                            and "end=" not in line])


def test_clients_that_leave_are_in_the_log():
    with Daemon(FAKE, "--log-format", "json", *PATIENT, **Hold().environment) as d:
        with socket.create_connection(("127.0.0.1", d.port)) as s:
            s.sendall(f"GET {SMALL} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            eventually(lambda: d.status()["counters"]["cache_misses"] == 1)
        eventually(lambda: any('"end":"client-left"' in line for line in d.lines))


def test_a_flood_is_bounded():
    with Daemon(FAKE, "--log-rate", "2", "--log-format", "json") as d:
        began = time.monotonic()
        together(4, lambda i: [d.ask("/v1/status") for _ in range(50)])
        took = time.monotonic() - began
        assert len(requests_in(d, 20)) <= 20 + 2 * took + 1, "more lines than log-rate allows"
        eventually(lambda: d.ask("/nowhere") and any("were left out" in line for line in d.lines))
        left_out = next(json.loads(line)["lines"] for line in d.lines if "were left out" in line)
        assert left_out >= 1
    with Daemon(FAKE, "--log-rate", "0") as d:
        d.ask(SMALL)
        time.sleep(0.1)
        assert not any("method=" in line for line in d.lines)


def test_a_reader_that_sleeps_stops_nobody():
    process = subprocess.Popen([FAKE, "--log-rate", "1000000", "--ops-listen", "", "--listen", "127.0.0.1:0", WALL],
                               stderr=subprocess.PIPE)
    text = b""
    while b" ready\n" not in text:
        text += process.stderr.read1(65536)
    port = int(re.search(rb"listening on http://127.0.0.1:(\d+)/", text)[1])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    for _ in range(1000):  # some 150 KB of log into a pipe of 64
        connection.request("GET", "/v1/datasets")
        assert connection.getresponse().read()
    process.terminate()
    assert process.wait(150) == 0


run(globals())
