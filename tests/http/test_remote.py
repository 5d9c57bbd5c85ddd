"""Datasets that are not on this disk: their pictures have the bytes of the file's, whatever breaks off on the way; what a
server refuses is that dataset's state and stops nothing else; a file that changes is never mixed with what it was; what
was kept outlives the daemon, and is not trusted."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import threading
import time

from harness import FAKE, PATIENT, REAL, WALL, Daemon, Hold, Port, Skipped, eventually, fresh, run, together
from range_server import File, Server

if os.environ.get("SPLATD_REMOTE") == "0":
    print("skipped: built without servers")
    raise SystemExit(77)

for name in list(os.environ):  # of whoever runs this; nothing leaves this machine
    if name.lower().endswith("_proxy") or name.startswith("AWS_"):
        del os.environ[name]

TREE, WALL_LARGE = os.environ["SPLATD_TREE"], os.environ["SPLATD_WALL_LARGE"]
DATA = pathlib.Path(TREE).read_bytes()
SECRET = "hush-5e3c7"
QUERY = "view?width=320&height=200&lod=0.25&format=png"  # all pages
COARSE = "view?width=96&height=64&format=png"
ACCOUNT = ("AKIDEXAMPLE", SECRET, "eu-central-1")


def opened(daemon):
    """What comes from servers is opened beside the service: once that was tried."""
    eventually(lambda: all(slot["state"] != "loading" for slot in slots(daemon).values()))
    return slots(daemon)


def view(daemon, dataset, query=QUERY):
    if slots(daemon)[dataset]["state"] == "loading":
        opened(daemon)
    reply = daemon.ask(fresh(f"/v1/datasets/{dataset}/{query}"))
    assert reply.status == 200, reply.body
    assert reply.headers["Splatd-Complete"] == "true"
    return reply.body


def slots(daemon):
    return {slot["id"]: slot for slot in daemon.ask("/v1/datasets").json()["datasets"]}


def counters(daemon):
    return daemon.status()["counters"]


def no_secrets(daemon, *texts):
    for text in (*daemon.lines, *texts, daemon.ask("/v1/status").body.decode(), daemon.ask("/v1/datasets").body.decode(),
                 daemon.ops("/metrics").body.decode()):
        assert SECRET not in text, text


def test_whatever_breaks_off():
    files = {
        "plain": File(DATA), "untagged": File(DATA, etag=""), "weak": File(DATA, etag='W/"1"'), "careless": File(DATA, conditions=False),
        "resets": File(DATA, faults=["reset", "reset", None, "reset"]), "busy": File(DATA, faults=[503, (429, 1), 500, None, (503, 1)]),
        "cut": File(DATA, faults=["cut"] * 6), "flipped": File(DATA, faults=[None, "flip", None, None, "flip"]),
        "flips": File(DATA, faults=["flip"]), "stalls": File(DATA, faults=[None, "stall"]), "late": File(DATA, delay_s=0.2)}
    urls = {f"/data/{name}.spld": file for name, file in files.items()}
    with Server({**urls, "/data/moved.spld": File(DATA)}, moved={"/here/moved.spld": "/there", "/there": "/data/moved.spld"}) as server:
        remote = [server.url(path[1:] + f"?key={SECRET}", user=f"me:{SECRET}") for path in urls]
        with Daemon(REAL, "--remote-deadline", "15000", datasets=[TREE, server.url("here/moved.spld"), *remote]) as d:
            truth = view(d, "tree")
            names = [*files, "moved"]
            for name, picture in zip(names, together(len(names), lambda i: view(d, names[i]))):
                assert picture == truth, (name, picture)
            assert not [file for file in files.values() if file.faults], "a fault was not met"
            assert server.agents == {"splatd/0.1.0"}
            now = counters(d)
            assert now["remote_retries"] >= 10 and not now["remote_failures"] and not now["page_cache_hits"], now
            assert now["remote_bytes"] < 13 * 1.3 * len(DATA) and now["remote_requests"] < 200, now
            assert f"splatd_remote_bytes_total {now['remote_bytes']}" in d.ops("/metrics").body.decode()
            whole = sum(last + 1 - first for first, last in files["plain"].requests)
            assert whole < 1.3 * len(DATA), files["plain"].requests
            saved = d.ask("/v1/datasets/plain/views/a", "PUT", b"{}", {"Content-Type": "application/json"})
            assert saved.status in (401, 403, 409)
            no_secrets(d)


def test_what_is_refused_is_a_state():
    spoilt = bytearray(DATA)  # all pages but the first
    for i in range(24 * 65536 + 1000, 5000000, 1 << 18):  # pages begin at multiples of 64 KiB
        spoilt[i] ^= 1
    files = {
        "forbidden": (File(DATA, always=403), "answers 403", "credentials"), "empty": (File(b""), "answers 416", "empty"),
        "whole": (File(DATA, ranges=False), "answers 200", "no byte ranges"), "packed": (File(DATA, gzip=True), "packs what it sends", "switch"),
        "text": (File(b"no dataset at all" * 9), "not a packed dataset", "pack"), "short": (File(DATA[:-1000]), "truncated", "missing"),
        "longer": (File(DATA, always="extra"), "cannot read", "more bytes than the length that it says"),
        **{f"range-{i}": (File(DATA, content_range=told), "answers other bytes", "what stands between") for i, told in enumerate(
            ("bytes {0}-{1}/-5", "bytes -{0}-{1}/{2}", "bytes {0}-+{1}/{2}", "bytes {0}-{1}/99999999999999999999", "bytes {0}-{1}/*"))},
        **{f"later-{i}": (File(DATA, always=(503, after)), "given up after 1 attempts, at the last it answers 503", "")
           for i, after in enumerate(("99999999999999999999", "18446744073709551615", "9223372036854775808", "3600"))},
        "down": (File(DATA, always="reset"), "given up after", "attempts"), "loop": (None, "redirects", ""),
        "spoilt": (File(spoilt), None, ""), "missing": (None, "answers 404 (NoSuchKey)", "path")}
    with Server({f"/s/{name}.spld": file for name, (file, *_) in files.items() if file}, moved={"/s/loop.spld": "/s/loop.spld"}) as server:
        urls = [server.url(f"s/{name}.spld?key={SECRET}") for name in files]
        with Daemon(REAL, "--remote-deadline", "6000", "--watch", "100", datasets=[*urls, TREE]) as d:
            now = opened(d)
            for name, (_, *parts) in files.items():
                if parts[0]:
                    assert now[name]["state"] == "failed" and all(part in now[name]["reason"] for part in parts), now[name]
                    assert "127.0.0.1" not in now[name]["reason"], now[name]
                    assert d.ask(f"/v1/datasets/{name}/{QUERY}").status in (404, 503)
            view(d, "tree")
            # a page that is damaged at its server costs its own views, whenever one asks for it
            damaged = d.ask(f"/v1/datasets/spoilt/{QUERY}")
            assert damaged.status == 500 and "fetched twice" in damaged.json()["detail"], damaged.body
            server.files["/s/missing.spld"] = File(DATA)  # it appears
            files["down"][0].always = None
            eventually(lambda: slots(d)["missing"]["state"] == slots(d)["down"]["state"] == "ready")
            assert view(d, "missing") == view(d, "tree") == view(d, "down")
            assert counters(d)["remote_failures"] > 5
            no_secrets(d, damaged.body.decode())


def test_a_file_that_changes():
    later = pathlib.Path(WALL_LARGE).read_bytes()
    file = File(DATA)
    with Server({"/hall.spld": file}) as server, tempfile.TemporaryDirectory() as folder:
        shutil.copy(TREE, f"{folder}/before.spld")
        shutil.copy(WALL_LARGE, f"{folder}/after.spld")
        with Daemon(REAL, "--watch", "300", datasets=[server.url("hall.spld"), folder]) as d:
            version = opened(d)["hall"]["version"]
            with file.lock:
                file.data, file.etag = later, '"2"'
            reply = d.ask(f"/v1/datasets/hall/{QUERY}")
            assert reply.status == 500 and "hall changed while it was served; open it anew" in reply.json()["detail"], reply.body
            eventually(lambda: slots(d)["hall"].get("version") not in (None, version))
            assert slots(d)["hall"]["state"] == "ready" and "reason" not in slots(d)["hall"]
            assert view(d, "hall", COARSE) == view(d, "after", COARSE)


def test_a_page_cache():
    file = File(DATA)
    with Server({"/hall.spld": file}) as server, tempfile.TemporaryDirectory() as folder:
        pages = pathlib.Path(folder, "pages")
        options = [REAL, "--page-cache", str(pages)]
        url = server.url("hall.spld")
        with Daemon(*options, datasets=[url, TREE]) as d, Daemon(*options, datasets=[url]) as other:  # they share it
            truth = view(d, "tree")
            assert view(d, "hall") == truth
            assert pages.stat().st_mode & 0o777 == 0o700
            asked = len(file.requests)
            assert view(other, "hall") == truth
            assert len(file.requests) == asked and counters(other)["page_cache_hits"] >= 4
            assert counters(d)["page_cache_misses"] >= 4
        file.requests.clear()
        with Daemon(*options, datasets=[url]) as d:
            assert view(d, "hall") == truth
            assert len(file.requests) == 1, file.requests  # which says whether it is still the same
        blocks = [path for path in pages.rglob("*") if path.is_file()]
        assert len(blocks) >= 5
        for i, path in enumerate(blocks):
            data = bytearray(path.read_bytes())
            data[(i * 977 + 60) % len(data)] ^= 1
            path.write_bytes(data[:len(data) - (i % 2)])
        with Daemon(*options, datasets=[url]) as d:
            assert view(d, "hall") == truth
            now = counters(d)
            assert now["page_cache_spoilt"] >= 4 and not now["page_cache_hits"], now
        refused = subprocess.run([REAL, "serve", "--page-cache", f"{folder}/no/such", TREE], capture_output=True, text=True, timeout=150)
        assert refused.returncode == 2 and "page-cache" in refused.stderr, refused.stderr


def test_slow_servers_hold_up_nobody():
    slow, stuck = File(DATA), File(DATA, gate=threading.Event())
    with Server({"/slow.spld": slow, "/hall.spld": File(DATA)}) as server, Server({"/stuck.spld": stuck}) as other:
        with Daemon(REAL, "--remote-deadline", "600000", "--watch", "0", *PATIENT,
                    datasets=[server.url("slow.spld"), other.url("stuck.spld"), TREE]) as d:
            assert d.ops("/readyz").status == 200 and slots(d)["tree"]["state"] == "ready"  # it is not waited for
            assert slots(d)["stuck"]["state"] == "loading"
            assert d.ask(f"/v1/datasets/stuck/{COARSE}").status == 503
            truth = view(d, "tree", COARSE)
            eventually(lambda: slots(d)["slow"]["state"] == "ready")
            coarse = view(d, "slow", COARSE)
            slow.gate = threading.Event()
            part = d.ask(fresh(f"/v1/datasets/slow/{QUERY}&wait=0"))  # what is here: coarse, and said to be so
            assert part.status == 200 and part.headers["Splatd-Complete"] == "false", part.headers
            assert slots(d)["stuck"]["state"] == "loading"
            slow.gate.set()
            whole = together(2, lambda i: view(d, "tree" if i else "slow"))
            assert whole[0] == whole[1] != part.body and coarse == truth
        with Daemon(REAL, "--remote-deadline", "4000", "--watch", "0", datasets=[other.url("stuck.spld"), TREE]) as d:
            assert opened(d)["stuck"]["state"] == "failed" and slots(d)["tree"]["state"] == "ready"
        with Daemon(REAL, "--remote-deadline", "8000", "--watch", "0", datasets=[other.url("stuck.spld")]) as d:
            began, until = d.ops("/readyz").status, slots(d)["stuck"]["state"]
            assert began == 503 or until == "failed"  # until it was tried, where it is all that there is
            eventually(lambda: d.ops("/readyz").status == 200)
            assert slots(d)["stuck"]["state"] == "failed"


def test_a_server_that_fails_later():
    """What was opened and cannot be read any more is said as soon as it is known, not at the view's deadline."""
    file = File(DATA)
    with Server({"/hall.spld": file}) as server:
        with Daemon(REAL, "--remote-deadline", "3000", "--watch", "0", *PATIENT, datasets=[server.url("hall.spld")]) as d:
            view(d, "hall", COARSE)
            file.always = 503
            reply = d.ask(fresh(f"/v1/datasets/hall/{QUERY}"))
            assert reply.status == 503 and "given up after" in reply.json()["detail"] and reply.headers["Retry-After"], reply.body

            def refused_at_once():
                reply = d.ask(fresh(f"/v1/datasets/hall/{QUERY}"))
                assert reply.status == 503 and reply.headers["Retry-After"], reply.body
                return "given up a moment ago" in reply.json()["detail"]  # or it is a while ago, as we are slow
            eventually(refused_at_once)
            assert counters(d)["frames"] < 5, counters(d)
            file.always = None
            eventually(lambda: d.ask(fresh(f"/v1/datasets/hall/{QUERY}")).status == 200)


def test_names_that_take_long():
    """A resolver that does not answer is waited for no longer than a server."""
    with Daemon(FAKE, "--remote-deadline", "1000", "--watch", "0", datasets=["http://far.slow/hall.spld", WALL],
                LD_PRELOAD=os.environ["SPLATD_SLOW_DISK"]) as d:
        now = opened(d)["hall"]
        assert now["state"] == "failed" and "given up after" in now["reason"], now
        assert d.ask("/v1/datasets/wall/view?width=16&height=16").status == 200


def test_many_urls():
    data = pathlib.Path(WALL).read_bytes()
    with Server({f"/w{i}.spld": File(data) for i in range(90)}) as server:
        with Daemon(FAKE, datasets=[server.url(f"w{i}.spld") for i in range(90)]) as d:
            assert {slot["state"] for slot in opened(d).values()} == {"ready"}
            files = [os.readlink(path) for path in pathlib.Path(f"/proc/{d.process.pid}/fd").iterdir() if path.is_symlink()]
            # a kept connection has a socket, and two that wake it: 90 would be 270
            assert len([name for name in files if name.startswith("socket:")]) < 3 * 64 + 24, files


def test_a_kept_tour_waits_for_its_dataset():
    file = File(pathlib.Path(WALL).read_bytes())
    with Server({"/wall.spld": file}) as server, tempfile.TemporaryDirectory() as folder:
        options = [FAKE, "--tours", folder, "--watch", "100"]
        with Daemon(*options, datasets=[server.url("wall.spld")], **Hold(allowed=3).environment) as d:
            opened(d)
            camera = {"eye": [3, 0.2, 1], "target": [0, 0, 1], "fov": 60}
            document = {"path": {"keyframes": [{"camera": camera}, {"camera": {**camera, "eye": [2, -1, 2]}}]}, "frames": 30,
                        "settings": {"width": 64, "height": 48}}
            uri = d.post(document, "/v1/datasets/wall/tours").json()["uri"]
            eventually(lambda: d.ask(uri).json()["frames_done"] >= 2)
            d.stop(signal.SIGKILL)
        server.files.clear()  # at the next start it is not there
        with Daemon(*options, datasets=[server.url("wall.spld")]) as d:
            assert opened(d)["wall"]["state"] == "failed"
            tour = d.ask(uri).json()
            assert tour["state"] == "rendering" and 2 <= tour["frames_done"] < 30, tour
            server.files["/wall.spld"] = file
            eventually(lambda: d.ask(uri).json()["state"] != "rendering")
            tour = d.ask(uri).json()
            assert tour["state"] == "done" and tour["frames_done"] == 30, tour


def info(*arguments, **environment):
    return subprocess.run([REAL, "info", *arguments], capture_output=True, text=True, timeout=150,
                          env={**os.environ, **environment})


def test_who_waits_is_told_for_what():
    """Once, after two seconds, without what the URL has of secrets; of what answers nothing."""
    slow = File(DATA)
    with tempfile.TemporaryDirectory() as folder, Server({"/slow.spld": slow, "/tree.spld": File(DATA)}) as server:
        path = pathlib.Path(folder, "path.txt")
        path.write_text("0 0 0 2 0 0 0 1\n1 1 0 2 0 0 0 1\n")
        said = f"splatd: waiting for http://127.0.0.1:{server.port}/slow.spld, which is given up when nothing comes for "
        for command in (["info"], ["render", "--size", "16", "-o", os.devnull, "--format", "png"],
                        ["tour", "--path", path, "--size", "16", "-o", f"{folder}/frames"]):
            slow.gate = threading.Event()
            begun = time.monotonic()
            process = subprocess.Popen([REAL, *command, server.url("slow.spld", user=f"me:{SECRET}") + f"?sig={SECRET}"], text=True,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            first = process.stderr.readline()
            took = time.monotonic() - begun
            slow.gate.set()
            process.kill()
            rest = process.communicate()[1]
            assert first.startswith(said) and 1.9 < took, (command, took, first, rest)
            assert SECRET not in first + rest and rest.count("waiting for") == 0, rest
        quick = info(server.url("tree.spld"))
        assert quick.returncode == 0 and "waiting" not in quick.stderr, quick.stderr


def test_s3():
    keys = {"AWS_ACCESS_KEY_ID": ACCOUNT[0], "AWS_SECRET_ACCESS_KEY": SECRET, "AWS_REGION": ACCOUNT[2]}
    token = "TOKEN/+=" + SECRET
    with Server({"/bucket/a b/tree.spld": File(DATA, account=ACCOUNT), "/bucket/token.spld": File(DATA, account=(*ACCOUNT, token)),
                 "/public/tree.spld": File(DATA)}) as server:
        keys["AWS_ENDPOINT_URL"] = f"http://127.0.0.1:{server.port}"
        local = info(TREE)
        for reply in (info("s3://bucket/a b/tree.spld", **keys), info("s3://public/tree.spld", AWS_ENDPOINT_URL=keys["AWS_ENDPOINT_URL"])):
            assert reply.returncode == 0 and reply.stdout == local.stdout, (reply.stdout, reply.stderr)
        assert info("s3://bucket/token.spld", **keys, AWS_SESSION_TOKEN=token).returncode == 0
        for wrong in ({"AWS_SECRET_ACCESS_KEY": SECRET + "x"}, {"AWS_REGION": "us-east-1"}, {"AWS_ACCESS_KEY_ID": "AKIDOTHER"},
                      {"AWS_SESSION_TOKEN": token}):
            reply = info("s3://bucket/a b/tree.spld", **{**keys, **wrong})
            assert reply.returncode == 1 and "403 (SignatureDoesNotMatch)" in reply.stderr and SECRET not in reply.stderr, reply.stderr
            assert "s3://bucket/a b/tree.spld" in reply.stderr
        with Daemon(REAL, datasets=["s3://bucket/a b/tree.spld"], **keys) as d:
            assert view(d, "tree")
            no_secrets(d)


def test_what_no_server_is_asked_for():
    for url, part in (("file:///etc/passwd", "not from file://"), ("ftp://h/x.spld", "not from ftp://"), ("https://", "names no host"),
                      (f"https://u:{SECRET}@h/a b.spld", "blank"), ("s3://bucket", "s3://BUCKET/KEY"), ("http://h/.spld", "cannot be a dataset's id")):
        for command in ("serve", "info"):
            if command == "serve" or "id" not in part:
                reply = subprocess.run([REAL, command, url], capture_output=True, text=True, timeout=150)
                assert reply.returncode == 2 and part in reply.stderr and SECRET not in reply.stderr, (url, command, reply)
    half = subprocess.run([REAL, "serve", "s3://b/x.spld"], capture_output=True, text=True, timeout=150,
                          env={**os.environ, "AWS_SECRET_ACCESS_KEY": SECRET})
    assert half.returncode == 2 and "AWS_ACCESS_KEY_ID is not set" in half.stderr and SECRET not in half.stderr
    with Server({"/away.spld": File(DATA)}, moved={"/x.spld": "file:///etc/passwd"}) as server:
        reply = info(server.url("x.spld"))
        assert reply.returncode == 1 and "passwd" not in reply.stderr + reply.stdout, reply.stderr
        bench = subprocess.run([REAL, "bench", server.url("away.spld")], capture_output=True, text=True, timeout=150)
        assert bench.returncode == 2 and "fetch it first" in bench.stderr, bench.stderr


def test_nginx():
    nginx = shutil.which("nginx", path="/usr/sbin:" + os.environ["PATH"])
    if not nginx:
        raise Skipped("nginx is not installed")
    with tempfile.TemporaryDirectory() as folder:
        listens = Port()
        port = listens.number
        os.chmod(folder, 0o755)
        shutil.copy(TREE, f"{folder}/hall.spld")
        temporary = "".join(f"{kind}_temp_path {folder}/{kind};" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        pathlib.Path(folder, "nginx.conf").write_text(
            f"daemon off; pid {folder}/pid; error_log {folder}/error; events {{}}\n"
            f"http {{ access_log {folder}/access; {temporary} server {{ listen 127.0.0.1:{port}; root {folder}; }} }}\n")
        process = subprocess.Popen([nginx, "-c", f"{folder}/nginx.conf", "-e", f"{folder}/error"], stderr=subprocess.DEVNULL,
                                   env=Port.environment(listens), pass_fds=[listens.fd])
        try:
            url = f"http://127.0.0.1:{port}/hall.spld"
            eventually(lambda: info(url).returncode == 0)
            shutil.copy(TREE, f"{folder}/other.spld")
            with Daemon(REAL, "--watch", "200", datasets=[url, f"http://127.0.0.1:{port}/other.spld", TREE]) as d:
                assert view(d, "hall") == view(d, "tree")
                log = pathlib.Path(folder, "access").read_text()
                assert log.count(" 206 ") > 3 and " 200 " not in log
                version = opened(d)["other"]["version"]
                shutil.copy(WALL_LARGE, f"{folder}/next")
                os.rename(f"{folder}/next", f"{folder}/other.spld")
                reply = d.ask(f"/v1/datasets/other/{QUERY}")
                assert reply.status == 500 and "changed while it was served" in reply.json()["detail"], reply.body
                assert " 412 " in pathlib.Path(folder, "access").read_text()
                eventually(lambda: slots(d)["other"].get("version") not in (None, version))
        finally:
            process.terminate()
            process.wait(150)


run(globals())
