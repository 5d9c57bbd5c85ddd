"""How the daemon is while it is attacked: alive and ready on its second port, no larger, no more open files, no uploads left
behind, nothing on stderr that is no line of its log."""
import json
import os
import pathlib
import re
import shutil
import tempfile
import threading
import time

from harness import REAL, WALL, Daemon, slower_than_usual
from mutating import drafts

STALL_S = 0.05
TEXT_LINE = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+Z splatd: (error|warning|info|debug): ")
PATH = {"keyframes": [{"camera": {"eye": [3, 0, 1], "target": [0, 0, 1], "fov": 60}},
                      {"camera": {"eye": [2, 1, 1], "target": [0, 0, 1], "fov": 60}}]}
AUTH = {"Authorization": "Bearer " + drafts.ADMIN.decode(), "Content-Type": "application/json"}


def is_sanitised(binary):
    """Twice or more as slow and large."""
    with open(binary, "rb") as file:
        return b"__asan_init" in (data := file.read()) or b"__tsan_init" in data


def _of_note(lines):
    """A sanitiser's report without its pictures of memory."""
    return [line for line in lines if re.search(r"ERROR|SUMMARY|runtime error|    #[0-7] |^(READ|WRITE|freed|previously)", line)
            or "Sanitizer" not in "".join(lines)][:30]


class Victim:
    """A daemon with all that there is to attack: tokens, a directory that takes datasets, tours."""

    def __init__(self, binary):
        self.binary, self.slow, self.checking = binary, is_sanitised(binary), threading.Lock()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="splatd-mutate-"))
        self.home, tokens = self.folder / "home", self.folder / "tokens"
        for name in (self.home, self.folder / "tours"):
            name.mkdir()
        tokens.write_text(f"{drafts.ADMIN.decode()} view,admin,tour\n{drafts.VIEWER.decode()} view\n")
        tokens.chmod(0o600)
        self.json = binary != REAL  # each format of the log once
        try:
            self.d = Daemon(binary, "--tokens", str(tokens), "--allow-anonymous", "--tours", str(self.folder / "tours"),
                            "--tour-frames", "8", "--tour-disk", "20M", "--cache", "2M", "--log-format",
                            "json" if self.json else "text", "--max-pixels", "1000000", datasets=[WALL, str(self.home)],
                            FAKE_FRAME_MS=1)
        except BaseException:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise
        self.said = []  # on stderr, and no line of the log
        self.tours, self.lines_seen, self.stalls, self.worst_rss = [], 0, 0.0, 0
        self.port = self.d.port
        self.rss_at_start, self.files_at_start = self.rss(), self.files()
        self.keep_tours()

    def rss(self):
        text = pathlib.Path(f"/proc/{self.d.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", text)[1]) * 1024

    def files(self):
        return len(os.listdir(f"/proc/{self.d.process.pid}/fd"))

    def names(self, number):
        return {drafts.TOUR: self.tours[number % len(self.tours)].encode()} if self.tours else {}

    def keep_tours(self):
        """Two that are made and are there for requests, none of those that requests have begun."""
        def ask(method, path, body=None):
            connection = self.d.connect(30)
            connection.request(method, path, body, AUTH)
            answer = connection.getresponse()
            found = answer.status, answer.read()
            connection.close()
            return found
        status, body = ask("GET", "/v1/tours")
        assert status == 200, (status, body)
        there = [tour["name"] for tour in json.loads(body)["tours"]]
        self.tours = [name for name in self.tours if name in there]
        for name in [name for name in there if name not in self.tours][4:]:
            ask("DELETE", f"/v1/tours/{name}")
        while len(self.tours) < 2:
            status, body = ask("POST", "/v1/datasets/wall/tours", json.dumps(
                {"path": PATH, "frames": 3, "settings": {"width": 16, "height": 16}}))
            if status != 202:
                assert status == 503, (status, body)
                return
            self.tours.append(json.loads(body)["name"])
            end = time.monotonic() + 20
            while json.loads(ask("GET", f"/v1/tours/{self.tours[-1]}")[1]).get("state") not in ("done", "failed"):
                if time.monotonic() > end:
                    break  # others have the device
                time.sleep(0.02)

    def is_dead(self):
        return self.d.process.poll() is not None

    def check(self):
        """What is wrong with it just now, as lines."""
        found = []
        try:
            for path in ("/healthz", "/metrics"):
                reply = self.d.ops(path, timeout=30)
                if reply.status != 200:
                    found.append(f"{path} says {reply.status}")
            for sample in re.findall(r"(?m)^splatd_loop_stall_cpu_seconds ([\d.e+-]+)$", reply.body.decode()):
                self.stalls = max(self.stalls, float(sample))
            rss, files = self.rss(), self.files()
            self.keep_tours()
        except (OSError, ValueError, KeyError, AssertionError) as error:
            return [*found, f"it does not answer: {error!r}"]
        self.worst_rss = max(self.worst_rss, rss)
        # a sanitiser keeps freed memory aside: 256 MiB, and around it what frames of 300 MiB have left in between
        if rss > self.rss_at_start + (1600 if self.slow else 150) * (1 << 20):
            found.append(f"resident memory went from {self.rss_at_start >> 20} to {rss >> 20} MiB")
        if files > self.files_at_start + 60:
            found.append(f"{files} descriptors, {self.files_at_start} at the start")
        limit = STALL_S * (10 if self.slow else 1)  # sanitisers slow down what the loop computes, not what it waits for
        if self.stalls > limit and self.stalls > limit * slower_than_usual():
            found.append(f"a turn of the loop took {self.stalls * 1000:.0f} ms of processor time")
        return found + self.unknown_lines()

    def unknown_lines(self):
        lines, found = self.d.lines[self.lines_seen:], []
        self.lines_seen += len(lines)
        for line in lines:
            try:
                known = {"time", "level", "message"} <= set(json.loads(line)) if self.json else TEXT_LINE.match(line)
            except ValueError:
                known = False
            if not known:
                self.said.append(line)
        return [f"no line of the log: {said}"] if (said := self.said[-1:] and "".join(_of_note(self.said))) else []

    def finish(self):
        """Ends it; what is wrong once nobody asks any more."""
        found, end = [], time.monotonic() + 60
        try:
            if not self.is_dead():
                while (left := [p.name for p in self.home.iterdir() if p.name.startswith(".")]) or \
                        (open_files := self.files()) > self.files_at_start + 12:
                    if time.monotonic() > end:
                        found.append(f"a minute later: {left or open_files} left, {self.files_at_start} at the start")
                        break
                    time.sleep(0.1)
                found += self.check()
                self.d.process.terminate()
            code = self.d.process.wait(60)
            time.sleep(0.1)  # the last lines
            found += self.unknown_lines()
            if code:
                found.append(f"exit code {code}")
        finally:
            if self.d.process.poll() is None:
                self.d.process.kill()
                self.d.process.wait()
            shutil.rmtree(self.folder, ignore_errors=True)
        return found
