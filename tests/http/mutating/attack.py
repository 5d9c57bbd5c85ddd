"""Sends exchange after exchange, from several threads; on a fault finds the shortest sequence that shows it again."""
import dataclasses
import itertools
import threading
import time

from mutating import plan, wire
from mutating.watch import Victim

THREADS, CHECK_EVERY = 6, 150


class Attack:
    """Of one daemon, for a number of seconds or until a fault; with `keep_going` until it is dead. `numbers` goes on where
    another one ended."""

    def __init__(self, victim, seed, numbers, without=(), only=(), keep_going=False,
                 wait_s=wire.WAIT_S):
        self.victim, self.seed, self.numbers, self.without, self.only = victim, seed, numbers, without, only
        self.keep_going, self.wait_s = keep_going, wait_s
        self.lock, self.stopped = threading.Lock(), False
        self.done, self.sent, self.endings, self.tags = 0, 0, {}, {}
        self.faults = []  # (what, exchange or None, received)
        self.under_way, self.recent = {}, []

    def _note(self, what, exchange=None, received=b""):
        with self.lock:
            self.faults.append((what, exchange, received))
            self.stopped = not self.keep_going

    def _next(self):
        with self.lock:
            number = next(self.numbers, None)
            if number is not None and not self.stopped:
                exchange = plan.exchange(self.seed, number, self.without, self.only)
                self.under_way[threading.get_ident()] = exchange
                return number, exchange
        return None, None

    def _work(self, end):
        while time.monotonic() < end and not self.stopped:
            number, exchange = self._next()
            if exchange is None:
                return
            wrong, received, ended = wire.judge(self.victim.port, exchange, self.victim.names(number), self.wait_s)
            if wrong and self.victim_died():
                return
            with self.lock:
                self.under_way.pop(threading.get_ident(), None)
                self.recent = [*self.recent[-30:], exchange]
                self.done += 1
                self.sent += len(exchange.sents)
                self.endings[ended] = self.endings.get(ended, 0) + 1
                for tag in exchange.tags():
                    self.tags[tag] = self.tags.get(tag, 0) + 1
                due = self.done % CHECK_EVERY == 0
            if wrong:
                self._note(wrong, exchange, received)
            elif due and self.victim.checking.acquire(blocking=False):
                for what in self.victim.check():
                    self._note(what)
                self.victim.checking.release()

    def victim_died(self):
        for _ in range(20):  # the kernel closes its sockets before the process can be waited for
            if self.victim.is_dead():
                with self.lock:
                    self.stopped = True
                return True
            time.sleep(0.05)
        return False

    def run(self, seconds):
        end = time.monotonic() + seconds
        threads = [threading.Thread(target=self._work, args=(end,)) for _ in range(THREADS)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        died = self.victim.is_dead()
        said = self.victim.finish()
        if said:
            suspects = [*self.under_way.values()] + self.recent[::-1] if died else []
            self.faults.insert(0, ("\n".join(said), suspects or None, b""))
        return not self.faults


def try_again(binary, exchanges, wait_s=15):
    """(what is wrong, the exchange or None where it is with the daemon, what came back) when these are sent to a daemon of their
    own, one after the other; None when nothing is wrong."""
    victim, found = Victim(binary), None
    try:
        for number, exchange in enumerate(exchanges):
            wrong, received, _ = wire.judge(victim.port, exchange, victim.names(0), wait_s)
            if wrong:
                found = (wrong, exchange, received)
                break
    finally:
        said = victim.finish()
    return ("\n".join(said), None, b"") if said else found


def shortest(binary, exchanges, deadly, budget_s=60):
    """The exchange of these that shows a fault by itself, with as few requests, cuts and oddities as still show it; None when
    none of them does within the time."""
    end = time.monotonic() + budget_s

    def shows(exchange):
        again = try_again(binary, [exchange]) if time.monotonic() < end else None
        return again and (again[1] is None) == deadly
    found = next(filter(shows, itertools.islice(exchanges, 20)), None)
    if not found:
        return None

    def better(**changes):
        nonlocal found
        candidate = dataclasses.replace(found, **changes)
        if candidate != found and shows(candidate):
            found = candidate
            return True
        return False
    better(cuts=[], reads="at once")
    better(cuts=[])
    better(stop_at=1 << 60, ending="half" if found.ending == "half" else "read")
    at = 0
    while at < len(found.sents) and len(found.sents) > 1:
        if not better(sents=found.sents[:at] + found.sents[at + 1:], cuts=[]):
            at += 1
    return found
