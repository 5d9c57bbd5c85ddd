"""Which exchange has which number: everything about it follows from seed and number, so that a fault can be made again."""
import random

from mutating import drafts, mutations
from mutating.replies import REFUSE, REST
from mutating.wire import Exchange


def _cuts(r, data, sents):
    """Where the bytes are cut into segments: nowhere, everywhere, at line ends, between requests, at random."""
    kind, length = r.random(), len(data)
    if kind < 0.45:
        return []
    if kind < 0.55 and length < 3000:
        return [(i, 0) for i in range(1, length)]
    if kind < 0.7:  # within and around each end of a line
        ends = [i for i in range(min(length, 4000)) if data[i:i + 1] == b"\n"]
        shift = r.choice([-1, 0, 1])
        return [(i + shift, 0) for i in ends]
    if kind < 0.8:
        at, found = 0, []
        for sent in sents:
            at += len(sent.data)
            found.append((at + r.choice([-2, -1, 0, 0, 1, 5]), r.choice([0, 0, 2, 30])))
        return sorted(found)
    slow = r.random() < 0.2
    return sorted((r.randrange(length), r.randrange(30) if slow else 0) for _ in range(r.choice([1, 2, 5, 30])))


def exchange(seed, number, without=(), only=()):
    r = random.Random(f"{seed} {number}")
    count = r.choices([1, r.randrange(2, 6), r.randrange(7, 21)], [5, 4, 1])[0]
    spoiled = set(r.sample(range(count), min(count, r.choice([1, 1, 1, 2]))))
    sents, half, rest = [], False, False
    for i in range(count):
        draft = drafts.make(r, f"m{number}.{i}")
        if only and i in spoiled:
            name = r.choice(only)
            mutations.ALL[name](r, draft)
            draft.tags.append(name)
        elif i in spoiled:
            mutations.spoil(r, draft, without)
        sent = draft.sent()
        if rest:
            sent.expect = REST
        sents.append(sent)
        half, rest = half or draft.half, rest or draft.rest_behind
        if draft.closes:
            break
    last = drafts.canary(f"m{number}.{count}")
    if rest:
        last.expect = REST
    sents.append(last)
    plan = Exchange(sents, name=f"{seed} {number}")
    data = b"".join(sent.data for sent in sents)
    plan.cuts = _cuts(r, data, sents)
    plan.reads = r.choices(["at once", "late", "slowly", "little"], [12, 3, 1, 1])[0]
    end = r.random()
    if half or end < 0.06:
        plan.ending = "half"
    elif end < 0.2:
        plan.ending, plan.stop_at = r.choice(["drop", "reset"]), r.randrange(len(data) + 1)
    elif end < 0.23 and any(sent.expect == REFUSE for sent in sents):
        plan.ending = "drop"
    return plan
