"""What ingress-nginx hashes by, in a real nginx: the map of deploy/kubernetes/ingress-nginx.yaml and the variable that
the ingress names. What it makes of each path, and that three daemons behind a consistent hash of it share the datasets."""
import contextlib
import http.client
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import urllib.parse

import yaml

from facts import ROOT

sys.path.insert(0, str(ROOT / "tests/http"))
from harness import FAKE, WALL, Daemon, eventually  # noqa: E402

NGINX = shutil.which("nginx", path=os.environ["PATH"] + ":/usr/sbin")
if not NGINX:
    print("skipped: no nginx")
    sys.exit(77)
SNIPPET = yaml.safe_load((ROOT / "deploy/kubernetes/ingress-nginx.yaml").read_text())["data"]["http-snippet"]
INGRESS = yaml.safe_load((ROOT / "deploy/kubernetes/base/ingress.yaml").read_text())
VARIABLE = INGRESS["metadata"]["annotations"]["nginx.ingress.kubernetes.io/upstream-hash-by"]

KEYS = {  # path -> what is hashed
    "/v1/datasets/hall": "hall",
    "/v1/datasets/hall/view?width=16": "hall",
    "/v1/datasets/hall?x=/v1/datasets/yard/": "hall",
    "/v1/datasets/hall/views": "hall",
    "/v1/datasets/site-7_b.2/pick?x=1&y=2": "site-7_b.2",
    "/v1/datasets/a%20b/view": "a%20b",
    "/v1/datasets/": "/v1/datasets/",
    "/v1/datasets": "/v1/datasets",
    "/v1/datasets?state=ready": "/v1/datasets",
    "/v1/status": "/v1/status",
    "/x/v1/datasets/hall": "/x/v1/datasets/hall",
    "/": "/",
}


class Connection(http.client.HTTPConnection):
    """To a socket in the file system: a port that is free now may be somebody's when nginx comes to it."""

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.place)


def ask(place, path):
    connection = Connection("127.0.0.1", timeout=120)
    connection.place = place
    connection.request("GET", path)
    answer = connection.getresponse()
    result = answer.status, answer.getheader("X-Key"), answer.read()
    connection.close()
    return result


def frames(d):
    return d.status()["counters"]["frames"]


ids = [f"scan-{i}" for i in range(48)]  # the ring follows the ports: 12 leave one of three with none in 1 run of 40
with tempfile.TemporaryDirectory() as top, contextlib.ExitStack() as stack:
    for name in ids:
        shutil.copy(WALL, os.path.join(top, f"{name}.spld"))
    daemons = [stack.enter_context(Daemon(FAKE, "--cache", "0", datasets=[top])) for _ in range(3)]
    place = f"{top}/socket"
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    folders = "".join(f"{kind}_temp_path {top}/{kind};" for kind in kinds)
    servers = "".join(f"server 127.0.0.1:{d.port};" for d in daemons)
    pathlib.Path(top, "nginx.conf").write_text(
        f"pid {top}/pid; error_log {top}/error.log; daemon off; events {{}} http {{ {folders} access_log off;\n"
        f"{SNIPPET}\n"
        f"upstream pods {{ hash {VARIABLE} consistent; {servers} }} server {{ listen unix:{place};"
        f"location / {{ add_header X-Key {VARIABLE} always; proxy_set_header Host $host; proxy_pass http://pods; }} }} }}")
    process = subprocess.Popen([NGINX, "-c", f"{top}/nginx.conf", "-p", top], stderr=subprocess.DEVNULL)
    try:
        def answers():
            assert process.poll() is None, pathlib.Path(top, "error.log").read_text()
            try:
                return ask(place, "/v1/status")[0] == 200
            except OSError:
                return False
        eventually(answers, 120)
        got = {path: ask(place, path)[1] for path in KEYS}
        assert got == KEYS, {path: key for path, key in got.items() if KEYS[path] != key}
        for name in ids:
            before = [frames(d) for d in daemons]
            for i in range(4):
                path = f"/v1/datasets/{urllib.parse.quote(name)}/view?width=16&height=16&near=0.{i + 1}"
                assert ask(place, path)[0] == 200
            served = sorted(frames(d) - n for d, n in zip(daemons, before))
            assert served == [0, 0, 4], (name, served)
        assert all(frames(d) for d in daemons), [frames(d) for d in daemons]
    finally:
        process.terminate()
        process.wait(120)
print(f"{len(KEYS)} paths, {len(ids)} datasets, {len(daemons)} daemons")
