"""What it costs that a dataset lies on a server: the same views from a file and over HTTP through a proxy that delays and
bounds what passes, with and without a page cache.

usage: SPLATD_BINARY=build/src/splatd remote.py NAME.spld [--rtt-ms 20] [--mbit 1000] [VIEW-QUERY…]
Each query is a place that nobody has looked at before: asked for as it is at once (wait=0), then complete, then again. Of a collection the
other datasets of its folder, its tiles, are on the server too. Prints a table in Markdown, and fails where the pictures differ."""
import argparse
import http.client
import json
import os
import pathlib
import queue
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "http"))
from range_server import File, Server


class Proxy:
    """Passes bytes on half a round trip after they came, downwards no faster than so many a second, over all connections. Of a new
    connection nothing passes for a round trip, as its handshake would take."""

    def __init__(self, port, rtt_s, bytes_per_s):
        self.target, self.delay_s, self.rate = port, rtt_s / 2, bytes_per_s
        self.free, self.lock = 0.0, threading.Lock()
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=64)
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            client, _ = self.listener.accept()
            server = socket.create_connection(("127.0.0.1", self.target))
            self.start(client, server, False)
            self.start(server, client, True)

    def start(self, source, sink, shaped):
        line = queue.Queue()
        threading.Thread(target=self.read, args=(source, line, shaped), daemon=True).start()
        threading.Thread(target=self.write, args=(sink, line), daemon=True).start()

    def read(self, source, line, shaped):
        if not shaped:
            time.sleep(2 * self.delay_s)
        while True:
            try:
                data = source.recv(1 << 17)
            except OSError:
                data = b""
            due = time.monotonic()
            if shaped and data:
                with self.lock:
                    self.free = max(self.free, due) + len(data) / self.rate
                    due = self.free
                time.sleep(max(0, due - time.monotonic() - 0.02))  # so that no more is on its way than a wire holds
            line.put((due + self.delay_s, data))
            if not data:
                return

    def write(self, sink, line):
        while True:
            due, data = line.get()
            time.sleep(max(0, due - time.monotonic()))
            try:
                if not data:
                    sink.shutdown(socket.SHUT_WR)
                    return
                sink.sendall(data)
            except OSError:
                return


class Daemon:
    def __init__(self, *arguments):
        began = time.monotonic()
        self.process = subprocess.Popen([os.environ["SPLATD_BINARY"], "serve", "--listen", "127.0.0.1:0", "--ops-listen", "", "--cache", "0",
                                         "--deadline", "60000", *arguments], stderr=subprocess.PIPE, text=True)
        for line in self.process.stderr:
            if found := re.search(r"listening on http://[^ ]*:(\d+)/", line):
                self.port = int(found[1])
            if line.rstrip().endswith("ready"):
                break
        threading.Thread(target=self.process.stderr.read, daemon=True).start()
        while json.loads(self.ask("/v1/datasets")[2])["datasets"][0]["state"] == "loading":  # what is on a server is opened then
            time.sleep(0.01)
        self.ready_s = time.monotonic() - began

    def ask(self, path):
        began = time.monotonic()
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        connection.request("GET", path)
        reply = connection.getresponse()
        body = reply.read()
        assert reply.status == 200, body
        return time.monotonic() - began, reply.headers.get("Splatd-Complete"), body

    def numbers(self):
        dataset = json.loads(self.ask("/v1/datasets")[2])["datasets"][0]
        return json.loads(self.ask("/v1/status")[2])["counters"], dataset["resident_bytes"], dataset["id"]

    def stop(self):
        self.process.terminate()
        self.process.wait(60)


def measure(queries, *arguments):
    d = Daemon(*arguments)
    rows = []
    name = d.numbers()[2]
    d.ask(f"/v1/datasets/{name}/view?width=64&height=36&wait=0&lod=32")  # kernels are made
    counts, resident, _ = d.numbers()
    for query in queries:
        path = f"/v1/datasets/{name}/view?format=png&{query}"
        coarse_s, whole, _ = d.ask(path + "&wait=0")
        complete_s, _, picture = d.ask(path)
        again_s, _, again = d.ask(path)
        assert picture == again
        before, had = counts, resident
        counts, resident, _ = d.numbers()
        rows.append({"coarse": coarse_s, "partly": whole == "false", "complete": complete_s, "again": again_s, "picture": picture,
                     "pages": resident - had, **{key: counts[key] - before[key] for key in counts if key.startswith(("remote_", "page_"))}})
    d.stop()
    return d.ready_s, rows, counts, resident


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("dataset")
    parser.add_argument("queries", nargs="*")
    parser.add_argument("--rtt-ms", type=float, default=20)
    parser.add_argument("--mbit", type=float, default=1000)
    a = parser.parse_args()
    queries = a.queries or ["width=1280&height=720"]
    data = pathlib.Path(a.dataset).read_bytes()
    name = pathlib.Path(a.dataset).name
    tiles = json.loads(subprocess.check_output([os.environ["SPLATD_BINARY"], "info", "--json", "--no-verify", a.dataset]))["tiles"]
    files = {f"/{name}": File(data)}
    if tiles:
        files.update({f"/{path.name}": File(path.read_bytes()) for path in pathlib.Path(a.dataset).parent.glob("*.spld")})
    with Server(files) as server, tempfile.TemporaryDirectory() as pages:
        url = f"http://127.0.0.1:{Proxy(server.port, a.rtt_ms / 1000, a.mbit * 125000).port}/{name}"
        cases = [("file", measure(queries, a.dataset)), ("server", measure(queries, url)),
                 ("server, page cache empty", measure(queries, "--page-cache", pages, url)),
                 ("server, page cache as left", measure(queries, "--page-cache", pages, url))]
    print(f"{sum(len(file.data) for file in files.values()) / 1e6:.0f} MB in {len(files)} files, {a.rtt_ms:g} ms, {a.mbit:g} Mbit/s\n")
    print("| from | ready, s | place | first picture, s | complete, s | again, s | MB read | MB of pages | requests | cache hits |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for label, (ready_s, rows, _, _) in cases:
        for i, row in enumerate(rows):
            print(f"| {label} | {ready_s:.1f} | {i + 1} | {row['coarse']:.2f}{' (coarse)' if row['partly'] else ''} | {row['complete']:.2f} | "
                  f"{row['again']:.2f} | {row['remote_bytes'] / 1e6:.1f} | {row['pages'] / 1e6:.1f} | {row['remote_requests']} | "
                  f"{row['page_cache_hits']} of {row['page_cache_hits'] + row['page_cache_misses']} |")
    for label, (_, _, counts, resident) in cases:
        print(f"\n{label}: {counts['remote_bytes'] / 1e6:.1f} MB read in all, opening too, for {resident / 1e6:.1f} MB of pages", end="")
    print()
    first = [row["picture"] for row in cases[0][1][1]]
    assert all([row["picture"] for row in rows] == first for _, (_, rows, _, _) in cases), "pictures differ"


main()
