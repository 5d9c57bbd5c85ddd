"""Datasets that come, change and go while the daemon runs: picked up, replaced under load, dropped, refused when broken."""
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import threading
import time

from harness import FAKE, PATIENT, REAL, WALL, Daemon, Hold, break_page, eventually, fresh, run

WATCH = ("--watch", "30")


def folder():
    return tempfile.TemporaryDirectory()


def put(directory, name, data):
    """As somebody careful would: written elsewhere, then renamed."""
    hidden = pathlib.Path(directory, "." + name)
    hidden.write_bytes(data)
    hidden.rename(pathlib.Path(directory, name + ".spld"))


def wall():
    return pathlib.Path(WALL).read_bytes()


def other():
    """Another valid dataset: its version differs from the wall's."""
    return pathlib.Path(os.environ["SPLATD_WALL_2"]).read_bytes()


def listed(d):
    return {dataset["id"]: dataset for dataset in d.ask("/v1/datasets").json()["datasets"]}


def small(d, name, **kw):
    return d.ask(fresh(f"/v1/datasets/{name}/view?width=16&height=16"), **kw)


def test_what_its_disk_did_not_give_in_time_is_tried_again():
    with folder() as home, Daemon(FAKE, *WATCH, datasets=[home], FAKE_LOAD_LATE=2) as d:
        put(home, "a", wall())
        eventually(lambda: "no page has come" in listed(d).get("a", {}).get("reason", ""))
        eventually(lambda: listed(d)["a"]["state"] == "ready")
        assert small(d, "a").status == 200


def test_what_costs_the_device_twice_is_put_aside():
    with folder() as home:
        put(home, "a", wall())
        put(home, "b", wall())
        with Daemon(FAKE, *WATCH, datasets=[home], SPLATD_INJECT_LOSS_AFTER="1x6") as d:
            def ready(count):
                eventually(lambda: d.status()["counters"]["device_losses"] == count and d.status()["state"] == "ready")
            for losses in (1, 2):  # a view of `a`, then the device is lost with one of `b`
                assert small(d, "a").status == 200
                lost = small(d, "b")
                assert lost.status == 503 and lost.json()["type"] == "urn:splatd:error:device-lost", lost.body
                ready(losses)
            eventually(lambda: listed(d)["b"]["state"] == "failed")
            assert "lost twice" in listed(d)["b"]["reason"] and listed(d)["a"]["state"] == "ready"
            refused = small(d, "b")
            assert refused.status == 404 and "lost twice" in refused.json()["detail"], refused.body
            assert small(d, "a").status == 200
            d.log("dataset b is put aside")
            put(home, "b", other())  # another file: tried again
            eventually(lambda: listed(d)["b"]["state"] == "ready")
            for losses in (3, 4, 5):  # `b` again, then the last that there is, which is not put aside
                name = "b" if losses < 5 else "a"
                eventually(lambda: small(d, name).status == 503)
                ready(losses)
            assert listed(d)["b"]["state"] == "failed" and listed(d)["a"]["state"] == "ready"
            assert "SPLATD" not in listed(d)["b"]["reason"] and home not in listed(d)["b"]["reason"]


def test_an_empty_directory_fills_up():
    with folder() as home, Daemon(REAL, *WATCH, datasets=[home]) as d:
        assert listed(d) == {} and d.ask("/").json()["views"] == []
        put(home, "a", wall())
        eventually(lambda: listed(d).get("a", {}).get("state") == "ready")
        assert small(d, "a").status == 200
        full = d.ask("/v1/datasets/a").json()
        assert full["state"] == "ready" and 0 < full["page_bytes"] <= full["resident_bytes"], full
        put(home, "b", other())
        eventually(lambda: listed(d).get("b", {}).get("state") == "ready")
        assert listed(d)["a"]["version"] != listed(d)["b"]["version"] and list(listed(d)) == ["a", "b"]
        before = d.status()["memory"]["device_bytes"]
        os.unlink(os.path.join(home, "a.spld"))
        eventually(lambda: "a" not in listed(d))
        assert small(d, "a").status == 404 and small(d, "b").status == 200
        eventually(lambda: d.status()["memory"]["device_bytes"] < before)


def test_a_replaced_file_is_a_new_version_and_no_request_fails():
    with folder() as home:
        put(home, "a", wall())
        with Daemon(FAKE, *WATCH, "--queue", "256", datasets=[home], FAKE_FRAME_MS=3) as d:
            versions, failures, stop = set(), [], threading.Event()

            def load():
                connection = d.connect()
                while not stop.is_set():
                    reply = small(d, "a", connection=connection)
                    if reply.status != 200:
                        failures.append(reply.body)
            threads = [threading.Thread(target=load) for _ in range(4)]
            for thread in threads:
                thread.start()
            for i in range(6):
                before = listed(d)["a"]["version"]
                put(home, "a", other() if i % 2 == 0 else wall())
                eventually(lambda: listed(d)["a"]["version"] != before)
                versions.add(listed(d)["a"]["version"])
            stop.set()
            for thread in threads:
                thread.join()
            assert not failures and len(versions) == 2, (failures[:3], versions)


def test_the_old_version_finishes_what_it_began():
    with folder() as home:
        put(home, "a", wall())
        hold = Hold()
        with Daemon(FAKE, *WATCH, *PATIENT, datasets=[home], **hold.environment) as d:
            replies = []
            asking = [threading.Thread(target=lambda: replies.append(small(d, "a").status)) for _ in range(3)]
            for thread in asking:
                thread.start()
            eventually(lambda: d.status()["queues"]["render"]["length"] == 2)
            os.unlink(os.path.join(home, "a.spld"))
            eventually(lambda: listed(d) == {})
            hold.allow_all()
            for thread in asking:
                thread.join()
            assert replies == [200, 200, 200], replies


def said_of(d, name):
    return [line for line in d.lines if f"dataset {name} " in line and "warning" in line]


def test_a_broken_file_is_said_once_and_skipped():
    broken = bytearray(wall())
    break_page(broken)
    with folder() as home:
        put(home, "bad", broken)
        put(home, "good", wall())
        with Daemon(FAKE, *WATCH, datasets=[home]) as d:
            assert listed(d)["bad"]["state"] == "failed" and "bad.spld" in listed(d)["bad"]["reason"]
            assert home not in json.dumps(listed(d)), "clients read where the files lie"
            put(home, "late", broken[:1000])
            eventually(lambda: listed(d).get("late", {}).get("state") == "failed")
            reply = small(d, "late")
            assert reply.status == 404 and "truncated" in reply.json()["detail"], reply.body
            put(home, "good", broken)
            eventually(lambda: "reason" in listed(d)["good"])
            assert listed(d)["good"]["state"] == "ready" and small(d, "good").status == 200
            time.sleep(0.3)
            for name in ("bad", "late", "good"):
                eventually(lambda: said_of(d, name))
                assert len(said_of(d, name)) == 1, said_of(d, name)
            put(home, "bad", wall())
            put(home, "good", other())
            eventually(lambda: listed(d)["bad"]["state"] == "ready" and "reason" not in listed(d)["good"])


def copy_slowly(d, home, name):
    """A copy in progress, of which nothing is said: False where we were too slow for it to look like one."""
    data, late = wall(), False
    with open(os.path.join(home, name + ".spld"), "wb") as file:
        for at in range(0, len(data), len(data) // 20 + 1):
            began = time.monotonic()
            file.write(data[at:at + len(data) // 20 + 1])
            file.flush()
            time.sleep(0.02)
            state = listed(d).get(name, {}).get("state")
            late = late or time.monotonic() - began > 0.4  # it may have rested for two looks
            assert late or state in (None, "loading"), state
    return not late


def test_partial_files_and_foreign_names_are_left_alone():
    with folder() as home, Daemon(FAKE, "--watch", "500", datasets=[home]) as d:
        data = wall()
        while not copy_slowly(d, home, "slow"):
            os.unlink(os.path.join(home, "slow.spld"))
            eventually(lambda: listed(d) == {})
        eventually(lambda: listed(d).get("slow", {}).get("state") == "ready")
        for name in (".hidden.spld", "no\nline.spld", "blank .spld", "x.spld.part", "ü.spld", "a" * 200 + ".spld"):
            pathlib.Path(home, name).write_bytes(data)
        os.mkdir(os.path.join(home, "folder.spld"))
        os.symlink("/nowhere", os.path.join(home, "dangling.spld"))
        eventually(lambda: listed(d).get("folder", {}).get("state") == "failed")
        eventually(lambda: listed(d).get("dangling", {}).get("state") == "failed")
        assert set(listed(d)) == {"slow", "folder", "dangling"}, listed(d)
        said = [line for line in d.log("4 files are left out, as '") if "digits" in line]
        assert said and sum(name in said[-1] for name in ("line.spld'", "blank .spld'", "ü.spld'", "a…'")) == 3, d.lines


def test_a_directory_that_cannot_be_listed_drops_nothing():
    with folder() as top:
        home = os.path.join(top, "home")
        os.mkdir(home)
        put(home, "a", wall())
        shutil.copy(WALL, os.path.join(top, "named.spld"))
        with Daemon(FAKE, *WATCH, datasets=[home, os.path.join(top, "named.spld")]) as d:
            assert set(listed(d)) == {"a", "named"}
            put(top, "named", other())  # a file that was named itself is watched as well
            before = listed(d)["named"]["version"]
            eventually(lambda: listed(d)["named"]["version"] != before)
            os.rename(home, home + ".away")  # as when a disk is unmounted
            eventually(lambda: any("left as they are" in line and "home" in line for line in d.lines))
            time.sleep(0.2)
            assert set(listed(d)) == {"a", "named"} and small(d, "a").status == 200
            os.rename(home + ".away", home)
            os.unlink(os.path.join(top, "named.spld"))
            eventually(lambda: set(listed(d)) == {"a"})
            assert len([line for line in d.lines if "left as they are" in line]) == 1


def test_many_changes_leave_nothing_behind():
    with folder() as home, Daemon(FAKE, "--watch", "20", datasets=[home]) as d:
        put(home, "a", wall())
        eventually(lambda: listed(d).get("a", {}).get("state") == "ready")
        descriptors = len(os.listdir(f"/proc/{d.process.pid}/fd"))
        for i in range(10):
            before = listed(d)["a"]["version"]
            put(home, "a", other() if i % 2 == 0 else wall())
            eventually(lambda: listed(d)["a"]["version"] != before)
        maps = pathlib.Path(f"/proc/{d.process.pid}/maps")
        eventually(lambda: maps.read_text().count(home) == 1)
        eventually(lambda: len(os.listdir(f"/proc/{d.process.pid}/fd")) <= descriptors)


def test_pages_of_who_was_seen_last_make_room():
    with folder() as home:
        put(home, "a", wall())
        with Daemon(REAL, "--watch", "0", datasets=[home]) as d:
            small(d, "a")
            memory = d.status()["memory"]
            page = listed(d)["a"]["resident_bytes"]
            assert memory["device_limit_bytes"] >= memory["device_bytes"] > page > 0, memory
        put(home, "b", other())
        limit = memory["device_bytes"] + 4096
        with Daemon(REAL, *WATCH, "--memory-limit", str(limit), datasets=[home]) as d:
            for turn in range(6):
                name, rest = ("a", "b") if turn % 2 else ("b", "a")
                evicted = d.status()["counters"]["pages_evicted"]
                reply = d.ask(f"/v1/datasets/{name}/view?width=16&height=16&near=0.{turn + 1}")
                assert reply.status == 200 and reply.headers["Splatd-Complete"] == "true"
                assert listed(d)[name]["resident_bytes"] > 0 and listed(d)[rest]["resident_bytes"] == 0, listed(d)
                status = d.status()
                assert status["memory"]["device_bytes"] <= status["memory"]["device_limit_bytes"] == limit
                assert turn == 0 or status["counters"]["pages_evicted"] == evicted + 1
            os.unlink(os.path.join(home, "a.spld"))
            eventually(lambda: "a" not in listed(d))
            assert small(d, "b").status == 200
        too_small = str(memory["device_bytes"] - page + 4096)
        os.unlink(os.path.join(home, "b.spld"))
        with Daemon(REAL, *WATCH, "--memory-limit", too_small, datasets=[home]) as d:
            put(home, "c", wall())
            eventually(lambda: listed(d).get("c", {}).get("state") == "failed")
            reply = small(d, "c")
            assert reply.status == 404 and too_small in reply.json()["detail"], reply.body


ODD = {  # what a name may stand for that is no dataset, and a part of what is said of it
    "loop": (lambda path: os.symlink(path, path), "symbolic links"),
    "dangling": (lambda path: os.symlink("/nowhere", path), "no such file"),
    "folder": (os.mkdir, "not a regular file"),
    "pipe": (os.mkfifo, "not a regular file"),
    "socket": (lambda path: socket.socket(socket.AF_UNIX).bind(path), "not a regular file"),
    "device": (lambda path: os.symlink("/dev/zero", path), "not a regular file"),
    "empty": (lambda path: pathlib.Path(path).touch(), "empty"),
}


def make_odd(home):
    for name, (make, _) in ODD.items():
        make(os.path.join(home, name + ".spld"))
    os.mkfifo(os.path.join(home, "good.profile.json"))


def check_odd(d):
    for name, (_, reason) in ODD.items():
        dataset = listed(d)[name]
        assert dataset["state"] == "failed" and reason in dataset["reason"], dataset


def test_one_bad_entry_is_its_own_state_at_start_and_later():
    with folder() as home:
        make_odd(home)
        put(home, "good", wall())
        with Daemon(FAKE, *WATCH, datasets=[home]) as d:
            check_odd(d)
            assert small(d, "good").status == 200
            put(home, "late", other())  # the listing is not frozen
            eventually(lambda: listed(d).get("late", {}).get("state") == "ready")
            os.unlink(os.path.join(home, "loop.spld"))
            put(home, "loop", wall())
            eventually(lambda: listed(d)["loop"]["state"] == "ready")
            time.sleep(0.3)
            for name in ODD:
                eventually(lambda: said_of(d, name))
                assert len(said_of(d, name)) == 1, said_of(d, name)
    with folder() as home, Daemon(FAKE, *WATCH, datasets=[home]) as d:
        put(home, "good", wall())
        make_odd(home)
        eventually(lambda: len([x for x in listed(d).values() if x["state"] == "failed"]) == len(ODD))
        check_odd(d)
        eventually(lambda: listed(d)["good"]["state"] == "ready")


def test_what_may_pass_is_tried_again():
    with folder() as home, folder() as away, Daemon(FAKE, *WATCH, datasets=[home]) as d:
        target = os.path.join(away, "real.spld")
        os.symlink(target, os.path.join(home, "a.spld"))
        eventually(lambda: listed(d).get("a", {}).get("state") == "failed")
        shutil.copy(WALL, target)
        eventually(lambda: listed(d)["a"]["state"] == "ready")
        os.rename(target, target + ".away")
        eventually(lambda: "reason" in listed(d)["a"])
        assert small(d, "a").status == 200  # the version that was there


def test_more_files_than_are_served():
    with folder() as home:
        for i in range(1030):
            pathlib.Path(home, f"n{i:04}.spld").touch()
        put(home, "a", wall())
        put(home, "z", other())
        with Daemon(FAKE, *WATCH, datasets=[home]) as d:
            reply = d.ask("/v1/datasets").json()
            ids = [dataset["id"] for dataset in reply["datasets"]]
            assert len(ids) == 1024 and ids[0] == "a" and ids[-1] == "n1022" and reply["left_out"] == 8, reply["left_out"]
            assert small(d, "a").status == 200 and small(d, "z").status == 404
            for i in range(10):
                os.unlink(os.path.join(home, f"n{i:04}.spld"))
            eventually(lambda: listed(d).get("z", {}).get("state") == "ready")
            assert "left_out" not in d.ask("/v1/datasets").json()
            d.log("datasets are left out")
            said = re.findall(r"(\d+) datasets are left out", "".join(d.lines))
            assert said[0] == "8" and len(said) == len(set(said)), said  # a look may fall between two of the unlinks


def test_a_directory_that_cannot_be_listed_freezes_no_other():
    with folder() as top:
        one, two = os.path.join(top, "one"), os.path.join(top, "two")
        for home in (one, two):
            os.mkdir(home)
            put(home, os.path.basename(home), wall())
        with Daemon(FAKE, *WATCH, datasets=[one, two]) as d:
            assert set(listed(d)) == {"one", "two"}
            os.rename(one, one + ".away")
            eventually(lambda: any("left as they are" in line for line in d.lines))
            put(two, "more", wall())
            os.unlink(os.path.join(two, "two.spld"))
            eventually(lambda: set(listed(d)) == {"one", "more"})
            os.rename(one + ".away", one)
            put(one, "back", wall())
            eventually(lambda: set(listed(d)) == {"one", "more", "back"})


def test_one_name_in_two_directories_is_served_once():
    with folder() as one, folder() as two:
        put(one, "a", wall())
        put(two, "a", other())
        with Daemon(FAKE, *WATCH, datasets=[one, two]) as d:
            before = listed(d)["a"]["version"]
            d.log("two datasets are called 'a'")
            os.unlink(os.path.join(one, "a.spld"))
            eventually(lambda: listed(d).get("a", {}).get("version", before) != before)


def test_what_does_not_fit_at_start_is_not_served():
    with folder() as home:
        put(home, "a", wall())
        with Daemon(REAL, *WATCH, datasets=[home]) as d:
            small(d, "a")
            memory, page = d.status()["memory"], listed(d)["a"]["resident_bytes"]
        with Daemon(REAL, *WATCH, "--memory-limit", str(memory["device_bytes"] - page + 4096), datasets=[home]) as d:
            assert listed(d)["a"]["state"] == "failed" and "memory" in listed(d)["a"]["reason"], listed(d)
            reply = small(d, "a")
            assert reply.status == 404, reply.body
            assert not any("bytes, /v1/datasets/a/view" in line for line in d.lines), d.lines
        named = os.path.join(home, "a.spld")
        with Daemon(REAL, *WATCH, "--memory-limit", str(memory["device_bytes"] - page + 4096), datasets=[named]) as d:
            assert listed(d)["a"]["state"] == "failed"


def test_sigterm_while_a_share_hangs():
    """An opening in the pool that never comes back keeps nobody."""
    with folder() as home:
        preload = " ".join(filter(None, [os.environ.get("LD_PRELOAD"), os.environ["SPLATD_SLOW_DISK"]]))
        with Daemon(FAKE, *WATCH, "--deadline", "1000", datasets=[home], LD_PRELOAD=preload,
                    SLOW_DISK_GATE=os.path.join(home, "never")) as d:
            put(home, "a", wall())
            eventually(lambda: listed(d).get("a", {}).get("state") == "loading")
            time.sleep(0.3)  # two looks more, and it is being opened
            assert d.stop() == 0


def test_a_knot_is_opened_like_any_other():
    """Half a million points that all claim to lie on wires: joined by whoever opened them, they took two minutes."""
    with folder() as home, Daemon(FAKE, *WATCH, datasets=[home]) as d:
        subprocess.run([os.environ["SPLATD_MAKE_WALL"], "--knot", os.path.join(home, ".knot")], check=True)
        os.rename(os.path.join(home, ".knot"), os.path.join(home, "knot.spld"))
        eventually(lambda: listed(d).get("knot", {}).get("state") == "ready")
        assert d.processor_s() < 60, "two minutes of work, whoever else works here"
        assert d.stop() == 0


def test_sigterm_while_datasets_are_opened():
    for _ in range(3):
        with folder() as home:
            with Daemon(FAKE, "--watch", "5", datasets=[home]) as d:
                for i in range(20):
                    put(home, f"d{i}", wall())


run(globals())
