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
                       "WALL_TEXTURED": http / "wall-textured.spld", "WALL_MAPPED": http / "wall-mapped.spld"}.items():
        os.environ.setdefault(f"SPLATD_{name}", str(path))


def report(binary, run, what, exchange, received, left):
    """(tags, text) of a fault; what shows it again lies in the folder `left` then."""
    from mutating import attack as attacking, wire
    suspects = exchange if isinstance(exchange, list) else [exchange] if exchange else []
    short = attacking.shortest(binary, suspects, isinstance(exchange, list)) if suspects else None
    shown = [short] if short else suspects[:8]
    path = pathlib.Path(left, f"mutate-{run.seed}-{(shown or run.recent)[0].name.split()[-1] if shown or run.recent else 0}.json")
    wire.save(path, run.seed, [short] if short else suspects[::-1], what)
    lines = [what, f"seed {run.seed}, after {run.done} connections; --replay {path}"]
    if suspects and not short:
        lines.append("it did not show again with one connection alone; under way or just before were")
    if short:
        _, _, received = attacking.try_again(binary, [short]) or ("", None, b"")
    for one in shown:
        lines.append(f" {one.name}\n{wire.show(one, received if len(shown) == 1 else b'', {})}")
    return tuple(shown[0].tags() if shown else ()), "\n".join(lines)


def attack(binary, seconds, seed=1, first=0, without=(), only=(), left="."):
    """None, or what is said of the first fault."""
    from mutating import attack as attacking
    from mutating.watch import Victim
    began, run = time.monotonic(), attacking.Attack(Victim(binary), seed, itertools.count(first), without, only)
    if not run.run(seconds):
        return report(binary, run, *run.faults[0], left)[1]
    stalls = f", longest turn {run.victim.stalls * 1000:.0f} ms" if run.victim.stalls else ""
    print(f"  {run.sent} requests on {run.done} connections in {time.monotonic() - began:.0f} s, seed {seed}: "
          f"{dict(sorted(run.endings.items()))}, {len(run.tags)} mutations, {run.victim.worst_rss >> 20} MiB{stalls}", flush=True)
    return None


def keep_going(binary, options):
    """Kinds of faults are counted, and told in full once."""
    from mutating import attack as attacking, wire
    from mutating.watch import Victim
    numbers, seen, end = itertools.count(options.first), {}, time.monotonic() + options.seconds
    while (left := end - time.monotonic()) > 1:
        run = attacking.Attack(Victim(binary), options.seed, numbers, options.without, options.only, keep_going=True,
                               wait_s=options.wait)
        run.run(left)
        print(f"  {run.sent} requests on {run.done} connections, {len(run.faults)} faults", flush=True)
        for what, exchange, received in run.faults:
            kind = re.sub(r"[A-Z]+ m\d+\.\d+|\d{4,}|(?<=b').*", "#", what)[:90]
            seen.setdefault(kind, []).append((run, what, exchange, received))
    for kind, found in sorted(seen.items()):
        print(f"{len(found):4} {kind}")
    for kind, found in sorted(seen.items())[:options.told]:
        least = min(found, key=lambda row: len(row[2].sents) if isinstance(row[2], wire.Exchange) else 99)
        print(f"FAULT {report(binary, *least, '.')[1]}\n", flush=True)
    return 1 if seen else 0


def replay(binary, path):
    from mutating import attack as attacking, wire
    found = attacking.try_again(binary, wire.load(path))
    print(f"{found[0]}\n{wire.show(found[1], found[2], {}) if found[1] else ''}" if found else "nothing is wrong")
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
    parser.add_argument("--wait", type=float, default=5, help="seconds for the daemon to close, with --keep-going")
    parser.add_argument("--told", type=int, default=40, help="kinds of faults that are told in full, with --keep-going")
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
    said = attack(binary, options.seconds, options.seed, options.first, options.without, options.only)
    print(said or "nothing is wrong")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
