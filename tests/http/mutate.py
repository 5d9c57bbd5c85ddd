"""Attacks a daemon with requests that are spoiled on their way: framing, chunks, pipelines, half a request, and away.

usage, with the environment that `meson test` gives (SPLATD_BINARY, SPLATD_FAKE, …; --build DIR makes it):
    mutate.py [--seconds S] [--seed N] [--real] [--without TAG,…] [--only TAG,…] [--keep-going]
    mutate.py --replay FILE    sends what a fault has left behind, each time with a new daemon
    mutate.py --self-test      plants faults in a small server that is wrong on purpose; each must be found

mutating/ has the parts: drafts.py requests of every route of api/openapi.yaml, mutations.py what is done to them, plan.py how they
are cut and strung together, wire.py the connection, replies.py the strict judge of what came back, watch.py the daemon's
health meanwhile, attack.py the threads and the search for the shortest sequence that shows a fault, wrong_server.py the self-test.

A fault prints seed and number, the exact bytes, and leaves mutate-SEED-N.json for --replay in the working directory.
--keep-going begins again with a new daemon and lists each kind of fault once."""
import argparse
import itertools
import os
import pathlib
import re
import sys
import time


def use_build(build):
    """What tests/http/meson.build sets."""
    build, source = pathlib.Path(build).resolve(), pathlib.Path(__file__).resolve().parents[2]
    http = build / "tests" / "http"
    for name, path in {"SOURCE_ROOT": source, "BINARY": build / "src" / "splatd", "FAKE": http / "splatd-fake",
                       "WALL": http / "wall.spld", "WALL_2": http / "wall-2.spld",
                       "WALL_TEXTURED": http / "wall-textured.spld"}.items():
        os.environ.setdefault(f"SPLATD_{name}", str(path))


def attack(binary, seconds, seed=1, numbers=None, without=(), only=(), left="."):
    """None, or a report of the fault; what shows it again lies in the folder `left` then."""
    from mutating import attack as attacking, wire
    from mutating.watch import Victim
    began = time.monotonic()
    numbers = numbers or itertools.count()
    run = attacking.Attack(Victim(binary), seed, numbers, without, only)
    if run.run(seconds):
        print(f"  {run.sent} requests on {run.done} connections in {time.monotonic() - began:.0f} s, seed {seed}: "
              f"{dict(sorted(run.endings.items()))}, {len(run.tags)} mutations, {run.victim.worst_rss >> 20} MiB", flush=True)
        return None
    what, exchange, received = run.faults[0]
    suspects = exchange if isinstance(exchange, list) else [exchange] if exchange else []
    short = attacking.shortest(binary, suspects) if suspects else None
    path = pathlib.Path(left, f"mutate-{seed}-{run.done}.json")
    wire.save(path, seed, [short] if short else suspects[::-1], what)
    shown = [short] if short else suspects[:8]
    tags = [tag for e in shown[:1] for tag in e.tags()]
    return {"what": what, "tags": tags, "path": str(path), "text": "\n".join(
        [f"{what}\nseed {seed}, after {run.done} connections; --replay {path}"
         f"{'' if short else '; it did not show again with one connection alone: these were under way or just before'}",
         *(f" {e.name}\n{wire.show(e, received if len(suspects) == 1 else b'', {})}" for e in shown)])}


def keep_going(binary, options):
    """Kind of fault -> how often; the first of each is told in full."""
    numbers, seen, end = itertools.count(options.first), {}, time.monotonic() + options.seconds
    without = set(options.without)
    while (left := end - time.monotonic()) > 1:
        report = attack(binary, left, options.seed, numbers, without, options.only)
        if report:
            kind = (tuple(report["tags"]), re.sub(r"m\d+\.\d+|\d{4,}", "#", report["what"])[:60])
            seen[kind] = seen.get(kind, 0) + 1
            if seen[kind] == 1:
                print(f"FAULT {report['text']}\n", flush=True)
            if seen[kind] >= 2 and len(report["tags"]) == 1:
                without.update(report["tags"])
    for (tags, what), count in seen.items():
        print(f"{count:4} {'+'.join(tags)}: {what}")
    return 1 if seen else 0


def replay(binary, path):
    from mutating import attack as attacking, wire
    found = attacking.try_again(binary, wire.load(path))
    print(f"{found[0]}\n{wire.show(found[1], found[2], {})}" if found else "nothing is wrong")
    return 1 if found else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--seconds", type=float, default=15)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first exchange")
    parser.add_argument("--real", action="store_true", help="the daemon that renders, not the one without a device")
    parser.add_argument("--without", default=[], type=lambda text: text.split(","))
    parser.add_argument("--only", default=[], type=lambda text: text.split(","))
    parser.add_argument("--keep-going", action="store_true")
    parser.add_argument("--replay", metavar="FILE")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    use_build(options.build)
    binary = os.environ["SPLATD_BINARY" if options.real else "SPLATD_FAKE"]
    if options.self_test:
        from mutating import wrong_server
        return wrong_server.self_test()
    if options.replay:
        return replay(binary, options.replay)
    if options.keep_going:
        return keep_going(binary, options)
    report = attack(binary, options.seconds, options.seed, itertools.count(options.first), options.without, options.only)
    print(report["text"] if report else "nothing is wrong")
    return 1 if report else 0


if __name__ == "__main__":
    sys.exit(main())
