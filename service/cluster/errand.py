"""Items of work done by whoever is there: handed out by speed, handed out again when a worker is lost."""

from __future__ import annotations

import queue
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from renderer.errors import SceneError
from renderer.frame import Abandoned
from service.cluster.backlog import Backlog, rate_after
from service.cluster.crew import ClusterLost, Crew, Inbox, Member
from service.cluster.worker import DONE, MISSING, Answer

TRACE, RUN = "trace", "run"
"""Methods of a worker."""

AHEAD: Final = 2
"""Items that a worker has at once: it does one while another is on its way."""

LATE: Final = 10.0
LEAST_LATE_S: Final = 3.0
"""A piece is given to another worker as well when it takes so many times what it should, and at least so long [s]."""

MOST_TRIES: Final = 3
"""How often an item may fail before the errand does."""

GLANCE_S: Final = 0.05
"""How often whoever waits for the cluster looks whether to go on waiting [s]."""


class WorkerFailed(Exception):
    """The workers cannot do what they were asked for; the message says why."""


class Done(NamedTuple):
    """An item that was done.

    Attributes:
        item: its number.
        member: number of the worker that did it.
        data: what it answered.
        away_s: how long it was away [s].
    """

    item: int
    member: int
    data: bytes
    away_s: float


class _Flight(NamedTuple):
    """An item that a worker has, since a time [monotonic s]."""

    item: int
    member: int
    since: float


@dataclass(frozen=True, eq=False, slots=True)
class Errand:
    """Items of work with one scene.

    Attributes:
        crew: whoever may do them.
        key: of the scene.
        pack: gives it packed, to be sent to the cluster.
        method: of the worker.
        build: the buffer for an item.
        weights: work of each item.
        abandon: set to give up; None for never.
        patience_s: how long to wait for a worker when there is none [s].
        stays: True to wait as long for a cluster that was lost.
        helped: True where workers that have no share of their own take from the others'.
    """

    crew: Crew
    key: str
    pack: Callable[[], bytes]
    method: str
    build: Callable[[int], bytes]
    weights: Sequence[float]
    abandon: threading.Event | None
    patience_s: float
    stays: bool
    helped: bool

    def done(self, backlog: Backlog[int]) -> Iterator[Done]:
        """Have the items done, each once, as they come.

        Raises:
            Abandoned: soon after `abandon` is set.
            ClusterLost: if the cluster is lost, or has no worker for too long.
            SceneError: if no worker can load the scene.
            WorkerFailed: if an item fails wherever it is tried.
        """
        left, tries = set(range(len(self.weights))), Counter[int]()
        flights: dict[int, _Flight] = {}
        late: set[int] = set()
        inbox = self.crew.open_inbox()
        seen = time.monotonic()
        try:
            while left:
                if self._hand_out(backlog, flights, inbox):
                    seen = time.monotonic()
                elif time.monotonic() - seen > self.patience_s:
                    raise ClusterLost(self.crew.obstacle or "no worker of the cluster can be had")
                for call, answer in _waiting_in(inbox):
                    flight = flights.pop(call, None)
                    if flight is None or flight.item not in left:
                        continue
                    if answer is not None and answer.kind == DONE:
                        left.discard(flight.item)
                        yield Done(flight.item, flight.member, answer.data, time.monotonic() - flight.since)
                        continue
                    backlog.put_back([flight.item])
                    if answer is not None:
                        self._note(flight, answer, tries)
                if self.abandon is not None and self.abandon.is_set():
                    raise Abandoned
                again = (self._late(flights) & left) - late
                late |= again
                backlog.put_back(again)
        finally:
            self.crew.close_inbox(inbox)

    def learn(self, number: int, work: float, took_s: float) -> None:
        """Take note of how fast a worker was."""
        with self.crew.changed:
            member = self.crew.members.get(number)
            if member is not None and took_s > 0.0:
                rates, kind = member.rates, (self.key, self.method)
                rates[kind] = rate_after(rates.get(kind), work / took_s)

    def _note(self, flight: _Flight, answer: Answer, tries: Counter[int]) -> None:
        """What to think of an answer that is no result."""
        if answer.kind == MISSING:
            with self.crew.changed:
                if flight.member in self.crew.members:
                    self.crew.members[flight.member].warm.discard(self.key)
            return
        tries[flight.item] += 1
        if tries[flight.item] == MOST_TRIES:
            raise WorkerFailed(f"a worker of the cluster: {answer.text}")

    def _hand_out(self, backlog: Backlog[int], flights: dict[int, _Flight], inbox: Inbox) -> bool:
        """Give every worker that has room something to do; whether any may come to have something."""
        crew = self.crew
        with crew.changed:
            if crew.down is not None and not self.stays:
                raise ClusterLost(crew.down)
            backlog.keep(crew.members)
            able = [member for member in crew.members.values() if self.key not in member.broken]
            if crew.members and not able:
                why = next(iter(crew.members.values())).broken[self.key]
                raise SceneError(f"no worker of the cluster can load it: {why}")
            for member in able:
                if self.key not in member.warm:
                    crew.load(member, self.key, self.pack)
            ready = [member for member in able if self.key in member.warm]
            owners = [member for member in ready if backlog.owns(member.number)]
            rates = {member.number: member.rates.get((self.key, self.method), 1.0) for member in ready}
            has = Counter(flight.member for flight in flights.values())
        for _ in range(AHEAD):
            for member in ready if self.helped or not owners else owners:
                if has[member.number] < AHEAD and (item := backlog.take(member.number, rates)) is not None:
                    has[member.number] += 1
                    self._send(member, item, flights, inbox)
        return bool(able)

    def _send(self, member: Member, item: int, flights: dict[int, _Flight], inbox: Inbox) -> None:
        packed = self.build(item)
        since = time.monotonic()
        flights[self.crew.ask(member, self.method, self.key, packed, inbox)] = _Flight(item, member.number, since)

    def _late(self, flights: dict[int, _Flight]) -> set[int]:
        """Pieces that have been away for much longer than they should."""
        late: set[int] = set()
        if self.method != TRACE:
            return late
        now = time.monotonic()
        with self.crew.changed:
            for item, number, since in flights.values():
                member = self.crew.members.get(number)
                rate = None if member is None else member.rates.get((self.key, self.method))
                if rate is not None and now - since > max(LEAST_LATE_S, LATE * self.weights[item] / rate):
                    late.add(item)
        return late


def _waiting_in(inbox: Inbox) -> Iterator[tuple[int, Answer | None]]:
    """The answers that have come, after a moment if nothing has."""
    try:
        news = inbox.get(timeout=GLANCE_S)
        while True:
            if news is not None:
                yield news
            news = inbox.get_nowait()
    except queue.Empty:
        return
