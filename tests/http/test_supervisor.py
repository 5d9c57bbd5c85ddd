"""Under systemd, played by this test: what is said through NOTIFY_SOCKET and when the watchdog is fed, listening sockets
that are passed in, and the configuration that deploy/ ships."""
import fcntl
import http.client
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import threading

from harness import FAKE, VIEW, WALL, Daemon, Hold, eventually, run

SMALL = VIEW + "?width=16&height=16"
ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"])
SYSTEMD = os.environ["SPLATD_SYSTEMD"] == "1"


class Supervisor:
    """A NOTIFY_SOCKET and the messages that come."""

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.path)
        self.lines = []
        threading.Thread(target=self._read, daemon=True).start()
        return self

    def _read(self):
        try:
            while data := self.socket.recv(4096):
                self.lines += data.decode().splitlines()
        except OSError:
            pass

    def said(self, line):
        return self.lines.count(line)

    def catch_up(self):
        """Waits until all that was said so far is in `lines`."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as own:
            count = self.said("caught up")
            own.sendto(b"caught up", self.path)
        eventually(lambda: self.said("caught up") > count)

    def __exit__(self, *rest):
        self.socket.close()
        self.folder.cleanup()


def test_ready_status_stopping():
    with Supervisor() as s:
        with Daemon(FAKE, "--cache", "0", NOTIFY_SOCKET=s.path, FAKE_OPEN_MS=300, FAKE_FRAME_MS=300,
                    SPLATD_INJECT_LOSS_AFTER="1") as d:
            eventually(lambda: s.said("READY=1") == 1)
            assert s.said("STATUS=rendering on flat colour (software)") == 1, s.lines
            assert [d.ask(f"{SMALL}&lod={lod}").status for lod in (2, 3)] == [200, 503]  # equal ones would come from the cache
            eventually(lambda: d.ops("/readyz").status == 200)
            asking = threading.Thread(target=d.ask, args=(SMALL + "&lod=4",))
            asking.start()
            eventually(lambda: d.status()["counters"]["cache_misses"] == 3)
            d.process.send_signal(signal.SIGTERM)
            eventually(lambda: s.said("STOPPING=1") == 1)
            asking.join()
            assert d.wait_exit() == 0
        assert s.said("READY=1") == 1


def test_the_watchdog_is_fed_while_idle_and_starved_by_a_hang():
    for stall_s in (1, 5, 25):  # how long it is dead before it ends; we may be held up meanwhile
        with Supervisor() as s:
            d = Daemon(FAKE, "--deadline", "100", "--stall", str(1000 * stall_s), NOTIFY_SOCKET=s.path, WATCHDOG_USEC=300000,
                       **Hold("FAKE_HANG").environment)
            eventually(lambda: s.said("WATCHDOG=1") >= 5)  # idle is alive
            assert d.ask(SMALL).status == 503
            try:
                eventually(lambda: d.ops("/healthz").status == 503)
                s.catch_up()  # with what was on its way
                before = s.said("WATCHDOG=1")
            except OSError:  # it has ended
                before = None
            assert d.wait_exit() == 1
            s.catch_up()
            if before is not None:
                assert s.said("WATCHDOG=1") == before, "fed while the device hung"
                return
    raise AssertionError("it ended before it was told to be dead")


def listening():
    """A listening socket, its port, and a descriptor of it out of the way of 3 and 4."""
    s = socket.create_server(("127.0.0.1", 0))
    return s, s.getsockname()[1], fcntl.fcntl(s.fileno(), fcntl.F_DUPFD, 50)


def start_with(fds, *arguments):
    """The daemon with `fds` as 3, 4, …"""
    given = " ".join(f"{3 + i}<&{fd}" for i, fd in enumerate(fds))
    return subprocess.Popen(["bash", "-c", f'export LISTEN_PID=$$ LISTEN_FDS={len(fds)}; exec "$@" {given}', "-", FAKE,
                             *arguments, WALL], pass_fds=fds, stderr=subprocess.PIPE, text=True)


def get(port, path):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=150)
    connection.request("GET", path)
    answer = connection.getresponse()
    answer.read()
    return answer.status


def test_sockets_that_are_passed():
    main, port, main_fd = listening()
    ops, ops_port, ops_fd = listening()
    with main, ops:
        process = start_with([main_fd, ops_fd], "--listen", "127.0.0.1:1")  # which nobody could bind
        assert get(port, SMALL) == 200  # it waited in the backlog
        assert get(ops_port, "/readyz") == 200
        process.send_signal(signal.SIGTERM)
        assert process.wait(150) == 0
        process = start_with([main_fd], "--ops-listen", "")
        assert get(port, SMALL) == 200, "the port outlives the process"
        process.send_signal(signal.SIGTERM)
        assert process.wait(150) == 0
        with open(os.devnull) as null:
            fd = fcntl.fcntl(null.fileno(), fcntl.F_DUPFD, 50)
            for fds, said in ([[fd], "no listening stream socket"], [[main_fd] * 3, "3 sockets"]):
                process = start_with(fds)
                assert process.wait(150) == 2 and said in process.stderr.read(), fds
    for fd in (main_fd, ops_fd, fd):
        os.close(fd)


def test_a_build_without_systemd_says_so():
    process = start_with([], "--listen", "127.0.0.1:0")
    assert process.wait(150) == 2 and "libsystemd" in process.stderr.read()


def test_the_shipped_configuration_is_accepted():
    with Daemon(FAKE, "--config", ROOT / "deploy/splatd.conf") as d:
        assert d.status()["parameters"]["queue"] == 32
    text = (ROOT / "deploy/splatd.conf").read_text()
    everything = re.sub(r"^#(\w[\w-]* = )", r"\1", text, flags=re.M).replace("require-gpu = true", "")
    assert everything.count("=") >= text.count("=") - 1
    for name in "tokens", "url-key", "tours", "memory-limit":
        assert re.search(rf"^{name} = ", everything, re.M), f"{name} is not shown"
    with tempfile.NamedTemporaryFile("w", suffix=".conf") as file, tempfile.TemporaryDirectory() as folder:
        token = "a-token-of-the-test"
        for name, text in ("tokens", f"{token} view,tour,admin"), ("url.key", "k" * 32):
            pathlib.Path(folder, name).write_text(text)
        everything = re.sub("/run/credentials/splatd.service|/var/lib/splatd", folder, everything)
        file.write(everything)
        file.flush()
        with Daemon(FAKE, "--config", file.name, "--drain-delay", "0") as d:
            told = d.ask("/v1/status", headers={"Authorization": f"Bearer {token}"}).json()["parameters"]
            assert told["log-format"] == "json" and pathlib.Path(folder, "tours").is_dir(), told
        file.write("\ndeadline = soon\n")
        file.flush()
        done = subprocess.run([FAKE, "--config", file.name, WALL], capture_output=True, text=True, timeout=30)
        assert done.returncode == 2 and f"{file.name}, line {everything.count(chr(10)) + 2}: deadline takes" in done.stderr
    unit = (ROOT / "deploy/splatd.service").read_text()
    assert "Type=notify" in unit and "WatchdogSec=" in unit and "serve --config /etc/splatd/splatd.conf" in unit


if SYSTEMD:
    del test_a_build_without_systemd_says_so
else:
    del test_ready_status_stopping, test_the_watchdog_is_fed_while_idle_and_starved_by_a_hang, test_sockets_that_are_passed
run(globals())
