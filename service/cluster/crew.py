"""The workers that are there now, as the engine tells: who they are, which scenes they hold, what they are asked."""

from __future__ import annotations

import itertools
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from renderer.version import source_hash
from service.cluster.link import ANSWER, ASK, DOWN, FORGET, GONE, JOINED, LOST, SCENE, START, UP, Link, LinkDown
from service.cluster.worker import DONE, Answer, Presence
from service.rendering import NotReady

LOAD: Final = "load"
"""Method of a worker."""

NO_WORKER: Final = "no worker of the cluster is ready"

Inbox = queue.SimpleQueue[tuple[int, Answer | None] | None]
"""Numbers of calls and their answers, None where the worker was lost; None alone says that workers have changed."""


class ClusterLost(NotReady):
    """The cluster cannot be reached, or has no worker."""


@dataclass(eq=False, slots=True)
class Member:
    """A worker.

    Attributes:
        number: its own, never used again.
        presence: what it said of itself.
        rates: work a second, by scene and kind of work.
        warm: scenes it holds.
        loading, broken: scenes it is preparing, and those that it cannot, with the reason.
        pieces: that it has now.
    """

    number: int
    presence: Presence
    rates: dict[tuple[str, str], float] = field(default_factory=dict)
    warm: set[str] = field(default_factory=set)
    loading: set[str] = field(default_factory=set)
    broken: dict[str, str] = field(default_factory=dict)
    pieces: int = 0


class Crew:
    """The workers of a cluster. Everything about them is guarded by `changed`.

    Args:
        address: of the cluster, for messages.
        options: of the engine.
        announce: receives lines for people: workers that come and go.

    Attributes:
        changed: notified when workers come and go.
        members: by number.
        down: why the cluster cannot be reached; None if it can.
    """

    def __init__(self, address: str, options: dict[str, Any], announce: Callable[[str], None]) -> None:
        self.changed = threading.Condition()
        self.members: dict[int, Member] = {}
        self.down: str | None = f"the cluster at {address} is being joined"
        self._announce = announce
        self._numbers = itertools.count()
        self._sent: set[str] = set()
        self._inboxes: set[Inbox] = set()
        self._calls: dict[int, tuple[int, Callable[[Answer | None], None]]] = {}
        self._link = Link(options, self._heard)

    @property
    def obstacle(self) -> str | None:
        """Why nothing can be traced now; None if it can."""
        with self.changed:
            return self.down or (None if self.members else NO_WORKER)

    def wait_ready(self, patience_s: float, workers: int) -> None:
        """Return when so many workers are ready.

        Raises:
            ClusterLost: if they are not in time.
        """
        with self.changed:
            if not self.changed.wait_for(lambda: len(self.members) >= workers, patience_s):
                raise ClusterLost(self.down or NO_WORKER)

    def close(self) -> None:
        """End the engine; whoever waits for workers gets a ClusterLost."""
        self._link.close()
        with self.changed:
            self._lose("the cluster was left")
            self._wake()

    def open_inbox(self) -> Inbox:
        """An inbox that is told when workers change."""
        inbox: Inbox = queue.SimpleQueue()
        with self.changed:
            self._inboxes.add(inbox)
        return inbox

    def close_inbox(self, inbox: Inbox) -> None:
        """Tell it no more."""
        with self.changed:
            self._inboxes.discard(inbox)

    def ask(self, member: Member, method: str, key: str, packed: bytes, inbox: Inbox) -> int:
        """Ask a worker for something; the number of the call, whose answer comes to the inbox."""
        with self.changed:
            call = next(self._numbers)
            self._call(call, member, method, key, packed, lambda answer: inbox.put((call, answer)))
            return call

    def load(self, member: Member, key: str, pack: Callable[[], bytes]) -> None:
        """Have a worker prepare a scene, unless it does already; `pack` gives it where the engine has not got it."""
        with self.changed:
            if key in member.loading:
                return
            try:
                if key not in self._sent:
                    self._link.send(SCENE, key, pack())
                    self._sent.add(key)
            except LinkDown:
                return
            member.loading.add(key)
            call = next(self._numbers)
            self._call(call, member, LOAD, key, None, lambda answer: self._loaded(member, key, answer))

    def forget(self, key: str) -> None:
        """Drop a scene from the cluster's memory; workers drop it when they need the room."""
        with self.changed:
            self._sent.discard(key)
        try:
            self._link.send(FORGET, key)
        except LinkDown:
            return  # whatever engine comes next does not know it

    def _call(
        self,
        call: int,
        member: Member,
        method: str,
        key: str,
        packed: bytes | None,
        tell: Callable[[Answer | None], None],
    ) -> None:
        member.pieces += 1
        self._calls[call] = member.number, tell
        try:
            self._link.send(ASK, call, member.number, method, key, packed)
        except LinkDown:
            self._answered(call, None)

    def _answered(self, call: int, answer: Answer | None) -> None:
        number, tell = self._calls.pop(call, (-1, None))
        if number in self.members:
            self.members[number].pieces -= 1
        if tell is not None:
            tell(answer)

    def _loaded(self, member: Member, key: str, answer: Answer | None) -> None:
        member.loading.discard(key)
        if answer is None:
            return
        if answer.kind == DONE:
            member.warm.add(key)
        else:
            member.broken[key] = answer.text
            self._announce(f"the worker on {member.presence.host} cannot load a scene: {answer.text}")
        self._wake()

    def _heard(self, kind: str, *rest: Any) -> None:
        """Take in a message of the engine."""
        with self.changed:
            if kind == ANSWER:
                self._answered(rest[0], rest[2])
                return
            if kind == LOST:
                self._answered(rest[0], None)
                return
            if kind == UP:
                self.down = None
            elif kind == START:
                self._announce(f"a worker with {rest[1]} threads is started (it compiles or loads the kernels) ...")
            elif kind == JOINED:
                self._join(*rest)
            elif kind == GONE:
                self._leave(*rest)
            elif kind == DOWN:
                if rest[0] != self.down:
                    self._announce(rest[0])
                self._lose(rest[0])
            self.changed.notify_all()
            self._wake()

    def _join(self, number: int, presence: Presence) -> None:
        if presence.source != source_hash():
            self._announce(f"the worker on {presence.host} has another version of gazetrace: it is not used")
            return
        self.members[number] = Member(number, presence)
        many = len(self.members)
        self._announce(f"a worker on {presence.host} with {presence.threads} threads is ready: {many} in all")

    def _leave(self, number: int, why: str) -> None:
        member = self.members.pop(number, None)
        if member is not None:
            self._announce(f"the worker on {member.presence.host} is gone: {len(self.members)} left")
        elif why:
            self._announce(f"a worker could not be started: {why}")

    def _lose(self, why: str) -> None:
        self.down = why
        self.members.clear()
        self._sent.clear()
        for call in list(self._calls):
            self._answered(call, None)

    def _wake(self) -> None:
        for inbox in self._inboxes:
            inbox.put(None)
