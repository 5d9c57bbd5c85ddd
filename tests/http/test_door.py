"""Who may knock where no token is asked for: Host must name this service, and a page of another site changes nothing.

A page that a user visits can make their browser send requests here. It cannot forge Host, nor hide its Origin."""
import http.client
import json
import pathlib
import socket
import tempfile

from harness import FAKE, VIEW, Daemon, run

SMALL = VIEW + "?width=16&height=16"
TOURS = "/v1/datasets/wall/tours"
LOOK = {"keyframes": [{"camera": {"eye": [x, 0, 1], "target": [0, 0, 1]}} for x in (3, 4)]}
TOUR = json.dumps({"path": LOOK, "frames": 1, "settings": {"width": 16, "height": 16}})
TOKEN = "viewer-0123456789abcdef"
PLAIN, JSON, FORM = "text/plain;charset=UTF-8", "application/json", "multipart/form-data; boundary=x"


def raw(d, text):
    """What is sent byte for byte; the status, and the problem where there is one."""
    with socket.create_connection(("127.0.0.1", d.port), 150) as s:
        s.sendall(text)
        reply = http.client.HTTPResponse(s)
        reply.begin()
        body = reply.read()
        return reply.status, json.loads(body) if "json" in (reply.headers["Content-Type"] or "") else body


def host_status(d, host, path="/v1/datasets"):
    return d.ask(path, headers={"Host": host}).status


def test_names_that_are_not_ours_are_not_answered():
    with Daemon(FAKE) as d:
        for host in ("127.0.0.1", f"127.0.0.1:{d.port}", "localhost", "LocalHost:8080", "localhost.:1", "10.1.2.3:80",
                     "[::1]", "[::1]:8080", "[FE80::1]:80", "[::ffff:127.0.0.1]:80", "127.0.0.1.:80"):
            assert host_status(d, host) == 200, host
        for host in ("evil.example", f"evil.example:{d.port}", "localhost.evil.example", "127.0.0.1.evil.example", "x",
                     "localhost:80.evil.example", "[::1].evil.example", "[localhost]", "[::1", "::1", "127.1", "0x7f.1",
                     "2130706433", "localhost@evil.example", "evil.example#localhost", "localhost..", ".", "", ":80",
                     "localhost:80:80", "localhost:x", "localhost evil", "localhost,evil.example", "127.0.0.1/"):
            for path in ("/v1/datasets", SMALL, "/", "/nowhere", "/viewer/main.js"):
                reply = d.ask(path, headers={"Host": host})
                assert reply.status == 421, (host, path, reply.status)
                problem = reply.json()
                assert problem["field"] == "Host" and "--host-name" in problem["detail"], problem
        assert d.ask(SMALL, "HEAD", headers={"Host": "evil.example"}).status == 421
        assert d.ask(VIEW, "POST", "{}", {"Host": "evil.example"}).status == 421
        assert d.ask(VIEW, "OPTIONS", headers={"Host": "evil.example"}).status == 421
        assert d.status()["counters"]["refused_access"] == 24 * 5 + 3
        assert d.ops("/metrics").status == 200


def test_a_request_has_one_host():
    with Daemon(FAKE) as d:
        get = f"GET {SMALL} HTTP/1.1\r\n".encode()
        assert raw(d, get + b"Host: localhost\r\nConnection: close\r\n\r\n")[0] == 200
        for hosts in (b"Host: localhost\r\nHost: evil.example\r\n", b"Host: localhost\r\nhost: localhost\r\n", b""):
            status, problem = raw(d, get + hosts + b"Connection: close\r\n\r\n")
            assert status == 400, (hosts, status)
            assert not isinstance(problem, dict) or problem["field"] == "Host", problem
        old = f"GET {SMALL} HTTP/1.0\r\n".encode()
        assert raw(d, old + b"\r\n")[0] == 200  # from before there was Host; no browser sends it
        assert raw(d, old + b"Host: evil.example\r\n\r\n")[0] == 421
        for target in ("http://localhost", "http://evil.example"):  # absolute form is for proxies
            for host, status in (("localhost", 404), ("evil.example", 421)):
                got = raw(d, f"GET {target}{SMALL} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
                assert got[0] == status, (target, host, got)


def test_names_that_are_listed_are_ours():
    with Daemon(FAKE, "--host-name", "scans.example", "--host-name", "Splatd") as d:
        for host in ("scans.example", "SCANS.example:443", "scans.example.", "splatd", "localhost"):
            assert host_status(d, host) == 200, host
        for host in ("a.scans.example", "scans.example.evil", "example", "xscans.example"):
            assert host_status(d, host) == 421, host
        assert d.status()["parameters"]["host-name"] == ["scans.example", "Splatd"]
    with Daemon(FAKE, "--host-name", "*") as d:
        assert host_status(d, "any.example:1") == 200 and host_status(d, "any thing") == 421


def tour(d, **headers):
    return d.ask(TOURS, "POST", TOUR, {name.replace("_", "-"): value for name, value in headers.items()})


def test_pages_of_others_change_nothing():
    with tempfile.TemporaryDirectory() as home, \
            Daemon(FAKE, "--tours", home, "--host-name", "scans.example", "--cors", "https://dash.example") as d:
        own = f"127.0.0.1:{d.port}"
        for origin in ("https://evil.example", "null", "", "http://127.0.0.1", "http://127.0.0.1:1", f"http://{own}.evil",
                       "http://localhost:3000", "https://scans.example.evil", "file://", f"http://x@{own}", own,
                       f"http://{own}/", "https://dash.example.evil", "http://dash.example"):
            for kind in (PLAIN, FORM, "application/x-www-form-urlencoded", "application/jsonx", "text/json", ""):
                reply = tour(d, Origin=origin, Content_Type=kind)
                assert reply.status == 403, (origin, kind, reply.status)
                problem = reply.json()
                assert problem["field"] == "Origin" and "--cors" in problem["detail"], problem
            assert d.ask(TOURS, "POST", TOUR, {"Origin": origin}).status == 403
            assert d.ask("/v1/tours/none", "DELETE", headers={"Origin": origin}).status == 403
            assert d.ask("/v1/datasets/wall", "PUT", "x", {"Origin": origin}).status == 403
            asked = {"Origin": origin, "Access-Control-Request-Method": "POST"}
            reply = d.ask(TOURS, "OPTIONS", headers=asked)  # so that JSON of its pages stays unsent
            assert reply.status == 405 and not reply.headers["Access-Control-Allow-Origin"]
        assert d.ask("/v1/tours").json()["tours"] == []
        # what only reads is answered; browsers keep the answer from the page
        reply = d.ask(VIEW, "POST", '{"width": 16}', {"Origin": "https://evil.example", "Content-Type": PLAIN})
        assert reply.status == 200 and not reply.headers["Access-Control-Allow-Origin"]
        for headers in ({}, {"Content_Type": PLAIN}, {"Origin": f"http://{own}", "Content_Type": PLAIN},
                        {"Origin": f"https://{own}", "Content_Type": FORM},  # a proxy's TLS ends before us
                        {"Origin": "https://scans.example:8443"}, {"Origin": "https://dash.example"},
                        {"Origin": "https://evil.example", "Content_Type": JSON}):  # whose preflight had failed
            reply = tour(d, **headers)
            assert reply.status == 202, (headers, reply.status, reply.body)
        name = reply.json()["name"]
        assert d.ask(f"/v1/tours/{name}", "DELETE", headers={"Origin": f"https://{own}"}).status in (200, 202, 204)


def test_where_a_token_is_asked_for_it_decides():
    with tempfile.TemporaryDirectory() as home:
        file = pathlib.Path(home, "tokens")
        file.write_text(f"{TOKEN} view,tour\n")
        file.chmod(0o600)
        args = ("--tokens", str(file), "--tours", home)
        with Daemon(FAKE, *args) as d:
            bearer = {"Authorization": f"Bearer {TOKEN}"}
            foreign = {"Host": "evil.example", "Origin": "https://evil.example", "Content-Type": PLAIN}
            assert d.ask(TOURS, "POST", TOUR, foreign).status == 401
            assert d.ask(TOURS, "POST", TOUR, {**foreign, **bearer}).status == 202
            assert host_status(d, "evil.example") == 401
        with Daemon(FAKE, *args, "--allow-anonymous") as d:  # who shows none has the rules of a service without
            assert d.ask(TOURS, "POST", TOUR, {**foreign, **bearer}).status == 202
            assert d.ask(SMALL, headers={"Host": "evil.example", **bearer}).status == 200
            assert host_status(d, "evil.example") == 421 and host_status(d, "localhost") == 200
            assert d.ask(TOURS, "POST", TOUR, {**foreign, "Host": "localhost"}).status == 403
            assert d.ask(SMALL, headers={"Host": "evil.example", "Authorization": "Basic x"}).status == 401


def test_replies_are_what_they_say():
    with Daemon(FAKE) as d:
        for path in (SMALL, "/", "/v1/datasets", "/nowhere", "/embed/wall", "/viewer/main.js", "/clients/splatd.py",
                     "/v1/openapi.yaml", VIEW + "?width=x"):
            headers = d.ask(path).headers
            assert headers.get_all("X-Content-Type-Options") == ["nosniff"], path
            assert path.startswith("/clients/") or not headers["Access-Control-Allow-Origin"], path


run(globals())
