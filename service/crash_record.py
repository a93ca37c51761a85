"""Which scenes bring the service down: what is held against each, from one process of it to the next.

A crash is held against the scenes that were at work in it. They are suspected, and worked on one at a time where that
does not take too long; so the next crash is one suspect's, whatever else is at work then. A suspect of which a frame is
finished merely ran beside the culprit.
"""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Set
from dataclasses import dataclass, field

from service.work_notes import Edition

NATIVE_CRASHES = frozenset(
    number.name for number in (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT)
)
"""Signals by which native code ends its process; others, such as SIGKILL for want of memory, come from outside."""

MEMORY_S = 3600.0
"""How long a crash is held against the scene that was alone at work in it [s]."""


@dataclass(frozen=True, slots=True)
class Past:
    """What a process of the service is told of those before it.

    Attributes:
        crashes: how often one was brought down.
        ended_by: the signal that did so last.
        at_work: scenes at work then.
        suspected: to be worked on one at a time.
        refused: not to be worked on.
    """

    crashes: int = 0
    ended_by: str = "-"
    at_work: tuple[str, ...] = ()
    suspected: tuple[Edition, ...] = ()
    refused: tuple[Edition, ...] = ()

    @property
    def told(self) -> tuple[Edition, ...]:
        """Every edition it speaks of."""
        return (*self.suspected, *self.refused)

    def to_line(self) -> bytes:
        """It as a line of JSON."""
        return json.dumps([self.crashes, self.ended_by, self.at_work, self.suspected, self.refused]).encode() + b"\n"

    @staticmethod
    def from_line(line: bytes) -> Past:
        """What `to_line` wrote."""
        crashes, ended_by, at_work, suspected, refused = json.loads(line)
        editions = (tuple(Edition(*each) for each in some) for some in (suspected, refused))
        return Past(crashes, ended_by, tuple(at_work), *editions)


@dataclass(slots=True)
class _Held:
    """What is held against an edition: when it crashed alone, and how often beside others."""

    alone_s: list[float] = field(default_factory=list)
    beside_others: int = 0


class CrashRecord:
    """Every crash of a service.

    Args:
        most: crashes with a scene at work, after which it is refused.
        clock: monotonic [s].
    """

    def __init__(self, most: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.past = Past()
        self._most = most
        self._clock = clock
        self._held: dict[Edition, _Held] = {}
        self._refused: set[Edition] = set()

    def crashed(self, ended_by: str, at_work: Set[Edition], done: Set[Edition]) -> None:
        """A process was ended by a signal.

        Args:
            ended_by: its name; only native crashes are held against anything.
            at_work: editions that were.
            done: editions of `past.told` of which it finished a frame, or which have another version now.
        """
        self._refused -= done
        for edition in done & self._held.keys():
            self._held[edition].beside_others = 0
        suspected = self._suspected() - done
        if ended_by in NATIVE_CRASHES:
            self._hold((at_work & suspected) or at_work)
        self.past = Past(
            self.past.crashes + 1,
            ended_by,
            tuple(sorted({edition.scene_id for edition in at_work})),
            tuple(sorted(self._suspected())),
            tuple(sorted(self._refused)),
        )

    def _hold(self, blamed: Set[Edition]) -> None:
        for edition in blamed:
            held = self._held.setdefault(edition, _Held())
            if len(blamed) > 1:
                held.beside_others += 1
                continue
            held.alone_s.append(self._clock())
            if len(held.alone_s) + held.beside_others >= self._most:
                self._refused.add(edition)
                del self._held[edition]

    def _suspected(self) -> set[Edition]:
        """Editions against which something is held; what is too old is forgotten."""
        oldest_s = self._clock() - MEMORY_S
        for edition, held in list(self._held.items()):
            held.alone_s = [crash_s for crash_s in held.alone_s if crash_s > oldest_s]
            if not held.alone_s and not held.beside_others:
                del self._held[edition]
        return set(self._held)
