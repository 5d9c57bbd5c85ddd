"""Every route under requests that are spoiled on their way: mutate.py, for a bounded time and with a fixed seed.

By option, through the environment: SPLATD_MUTATE_S=1200 is the long form, SPLATD_MUTATE_SEED=N another attack. In a build
with sanitisers both daemons run under them. A fault leaves mutate-….json, which mutate.py --replay sends again."""
import os

import mutate
from harness import FAKE, REAL, run
from mutating import wrong_server

SECONDS, SEED = float(os.environ.get("SPLATD_MUTATE_S", 8)), int(os.environ.get("SPLATD_MUTATE_SEED", 1))


if os.environ["SPLATD_SANITIZED"] == "0":  # nothing of ours is built for it: once is enough
    def test_the_judge_finds_planted_faults():
        assert wrong_server.self_test() == 0


def attack(binary, seconds, **more):
    """A turn of the loop that takes long is a fault where it does so again and again: others may have had the core."""
    for left in 2, 1, 0:
        said = mutate.attack(binary, seconds, SEED, **more)
        if not said or "a turn of the loop took" not in said.splitlines()[0] or not left:
            break
        print(f"     again: {said.splitlines()[0]}")
    assert not said, said


def test_spoiled_requests():
    attack(FAKE, SECONDS * 0.8)


def test_spoiled_requests_where_frames_are_rendered():
    attack(REAL, SECONDS * 0.2, first=1_000_000)


run(globals())
