"""The proxies of deploy/, as they are shipped but for addresses. Three daemons behind HAProxy: a dataset stays with its daemon;
one daemon killed and one drained under load cost no client a request. One behind nginx: TLS, uploads, signed URLs."""
import contextlib
import http.client
import os
import pathlib
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading

from harness import FAKE, REAL, WALL, Daemon, Port, eventually, run

HAPROXY, NGINX, OPENSSL = (shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin") for name in
                           ("haproxy", "nginx", "openssl"))
SHIPPED = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"], "deploy")
if not (HAPROXY and NGINX and OPENSSL):
    print("skipped: no haproxy, nginx or openssl")
    sys.exit(77)


def changed(text, *pairs):
    for pattern, new in pairs:
        text, count = re.subn(pattern, new, text, flags=re.M)
        assert count >= 1, pattern
    return text


def configuration(fd, daemons):
    """The shipped one: other addresses, checks that do not take seconds, no overflow to other daemons at a load of one."""
    text = (SHIPPED / "haproxy.cfg").read_text()
    for address, d in zip(("10.0.0.11", "10.0.0.12", "10.0.0.13"), daemons):
        text = changed(text, (rf"^( +server \w+) {re.escape(address)}:8080$",
                              rf"\1 127.0.0.1:{d.port} port {d.ops_port}"))
    return changed(text, (r"bind 0\.0\.0\.0:80$", f"bind fd@{fd}"), (r"slowstart 10s", "slowstart 1s"),
                   (r"inter 1s fall 2 rise 2 port 8081", "inter 100ms fall 2 rise 2"),
                   (r"^( +timeout (connect|check|queue|http-request)) \d+s$", r"\1 60s"), (r"gt 2000", "gt 1000000"),
                   (r"^ +hash-balance-factor 150\n", ""))


@contextlib.contextmanager
def balanced(ids, drain_ms=0):
    with tempfile.TemporaryDirectory() as home, contextlib.ExitStack() as stack:
        for name in ids:
            shutil.copy(WALL, os.path.join(home, f"{name}.spld"))
        daemons = [stack.enter_context(Daemon(FAKE, "--drain-delay", str(drain_ms), "--cache", "0", datasets=[home],
                                              FAKE_FRAME_MS=3)) for _ in range(3)]
        listens, file = Port(), pathlib.Path(home, "haproxy.cfg")
        port = listens.number
        file.write_text(configuration(listens.fd, daemons))
        process = subprocess.Popen([HAPROXY, "-db", "-f", str(file)], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL, pass_fds=[listens.fd])
        try:
            def answers():
                try:
                    return ask(port, "/v1/status")[0] == 200
                except OSError:
                    return False
            eventually(answers)
            yield port, daemons
        finally:
            process.terminate()
            process.wait(150)


def ask(port, path, connection=None):
    own = connection or http.client.HTTPConnection("127.0.0.1", port, timeout=150)
    own.request("GET", path)
    answer = own.getresponse()
    body = answer.read()
    if not connection:
        own.close()
    return answer.status, body


def frames(d):
    return d.status()["counters"]["frames"]


def test_a_dataset_stays_with_its_daemon():
    ids = [f"scan-{i}" for i in range(12)]
    with balanced(ids) as (port, daemons):
        for name in ids:
            before = [frames(d) for d in daemons]
            for i in range(5):
                assert ask(port, f"/v1/datasets/{name}/view?width=16&height=16&near=0.{i + 1}")[0] == 200
            served = sorted(frames(d) - n for d, n in zip(daemons, before))
            assert served == [0, 0, 5], (name, served)
        assert all(frames(d) > 0 for d in daemons), [frames(d) for d in daemons]


def test_one_is_killed_and_one_is_drained_under_load():
    with balanced([f"scan-{i}" for i in range(8)], 8000) as (port, daemons):
        stop, failures, served = threading.Event(), [], [0] * 6

        def work(i):
            connection, n = None, 0
            while not stop.is_set():
                connection = connection or http.client.HTTPConnection("127.0.0.1", port, timeout=150)
                try:
                    status, body = ask(port, f"/v1/datasets/scan-{n % 8}/view?width=16&height=16&near={1e-6 * n + 0.1}",
                                       connection)
                    if status != 200:
                        failures.append((status, body[:200]))
                    served[i] += status == 200
                except OSError as error:
                    failures.append(("connection", repr(error)))
                    connection = None
                n += 1
        threads = [threading.Thread(target=work, args=(i,)) for i in range(len(served))]
        for thread in threads:
            thread.start()

        def progress(count):
            target = sum(served) + count
            eventually(lambda: sum(served) >= target)
        progress(200)
        daemons[0].process.send_signal(signal.SIGKILL)
        daemons[0].wait_exit()
        progress(300)
        assert daemons[1].stop() == 0  # SIGTERM: not ready, goes on for the drain delay, finishes what runs
        progress(300)
        stop.set()
        for thread in threads:
            thread.join()
        # Of the killed daemon at most what was in flight there: a request a client, whose reply had begun.
        assert len(failures) <= len(served), failures
        assert not [f for f in failures if f[0] == 503], failures
        print(f"served {sum(served)}, failed {len(failures)}: {failures}")


def test_nginx_speaks_tls_for_it():
    admin = "admin-0123456789abcdef"
    wall = pathlib.Path(WALL).read_bytes()
    with tempfile.TemporaryDirectory() as top:
        top = pathlib.Path(top)
        (top / "home").mkdir()
        for name, text in (("tokens", f"{admin} view,admin\n"), ("url.key", "0123456789abcdef0123456789abcdef")):
            (top / name).write_text(text)
            (top / name).chmod(0o600)
        subprocess.run([OPENSSL, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", top / "key.pem", "-out",
                        top / "cert.pem", "-days", "2", "-subj", "/CN=scans.example", "-addext",
                        "subjectAltName=DNS:scans.example"], check=True, capture_output=True)
        with Daemon(FAKE, "--tokens", str(top / "tokens"), "--url-key", str(top / "url.key"),
                    datasets=[str(top / "home")]) as d:
            ports = Port(), Port()
            port, plain = (port.number for port in ports)
            site = changed((SHIPPED / "nginx.conf").read_text(), (r"127\.0\.0\.1:8080", f"127.0.0.1:{d.port}"),
                           (r"listen 80;", f"listen 127.0.0.1:{plain};"), (r"listen 443", f"listen 127.0.0.1:{port}"),
                           (r"/etc/letsencrypt\S+fullchain\.pem", str(top / "cert.pem")),
                           (r"/etc/letsencrypt\S+privkey\.pem", str(top / "key.pem")), (r"/var/log/nginx", str(top)))
            folders = "".join(f"{kind}_temp_path {top}/{kind};" for kind in
                              ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
            (top / "site.conf").write_text(site)
            (top / "nginx.conf").write_text(f"pid {top}/pid; error_log {top}/error.log; daemon off; events {{}}"
                                            f"http {{ {folders} include {top}/site.conf; }}")
            process = subprocess.Popen([NGINX, "-c", str(top / "nginx.conf"), "-p", str(top)],
                                       stderr=subprocess.DEVNULL, env=Port.environment(*ports), pass_fds=[port.fd for port in ports])
            try:
                trusted = ssl.create_default_context(cafile=str(top / "cert.pem"))

                def https(method, path, body=None, headers={}):
                    connection = http.client.HTTPSConnection("127.0.0.1", port, timeout=150, context=trusted)
                    connection.sock = trusted.wrap_socket(socket.create_connection(("127.0.0.1", port), 150),
                                                          server_hostname="scans.example")
                    connection.request(method, path, body, {"Host": "scans.example", **headers})
                    answer = connection.getresponse()
                    result = answer.status, answer.headers, answer.read()
                    connection.close()
                    return result

                def up():
                    try:
                        return https("GET", "/v1/openapi.yaml")[0] == 200
                    except OSError:
                        return False
                eventually(up)
                auth = {"Authorization": f"Bearer {admin}"}
                assert https("GET", "/v1/status")[0] == 401
                assert https("PUT", "/v1/datasets/a", wall, auth)[0] == 201
                assert https("PUT", "/v1/datasets/b", b"x" * 5_000_000, auth)[0] == 422
                assert https("POST", "/v1/datasets/a/view", b" " * 2_000_000, auth)[0] == 413
                status, headers, body = https("GET", "/v1/datasets/a/view?width=16&height=16", None, auth)
                assert status == 200 and body and "max-age" in headers["Strict-Transport-Security"]
                signed = subprocess.run([REAL, "sign", "https://scans.example/v1/datasets/a/view?eye=1,2,3&width=16",
                                         "--key", top / "url.key"], capture_output=True, text=True, check=True).stdout
                assert https("GET", signed.strip().removeprefix("https://scans.example"))[0] == 200
                connection = http.client.HTTPConnection("127.0.0.1", plain, timeout=150)
                connection.request("GET", "/v1/status?x=1", headers={"Host": "scans.example"})
                answer = connection.getresponse()
                assert answer.status == 301 and answer.headers["Location"] == "https://scans.example/v1/status?x=1"
                connection.close()
                log = (top / "splatd.log").read_text()
                assert "/v1/datasets/a/view" in log and "sig=" not in log and admin not in log, log
            finally:
                process.send_signal(signal.SIGQUIT)
                process.wait(150)


run(globals())
