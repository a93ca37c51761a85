"""Which scenes native code works on, noted in memory that survives the process that writes it."""

from __future__ import annotations

import mmap
import re
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

PLACES = 256
"""Scenes at work at once that can be noted: more than a service has threads for."""

PLACE_BYTES = 96
"""A byte that says whether the place is in use, then a scene and its version."""

NOTE = re.compile(rb"([a-z0-9][a-z0-9_-]{0,63}) ([0-9a-f]{1,16})\0*")
"""What a place holds; the process that wrote it may have damaged it."""


class Edition(NamedTuple):
    """A scene as its files were."""

    scene_id: str
    version: str


class WorkNotes:
    """What is at work in one process, and which of the editions it was told of it has done with.

    Any thread may write; nothing is locked, so that nothing is lost or held up by a thread that crashes.

    Args:
        memory: of `size(told)` bytes, zero at first; shared with whoever reads it afterwards.
        told: editions that may be done with.
    """

    def __init__(self, memory: mmap.mmap, told: Sequence[Edition] = ()) -> None:
        self._memory = memory
        self._free = deque(range(PLACES))
        self._told = tuple(told)

    @staticmethod
    def size(told: Sequence[Edition] = ()) -> int:
        """Bytes of memory for the notes."""
        return PLACES * PLACE_BYTES + len(told)

    def begin(self, edition: Edition) -> int:
        """Note that an edition is at work: the place of the note."""
        place = self._free.popleft()
        start = place * PLACE_BYTES
        self._memory[start + 1 : start + PLACE_BYTES] = " ".join(edition).encode().ljust(PLACE_BYTES - 1, b"\0")
        self._memory[start] = 1
        return place

    def end(self, place: int) -> None:
        """It is no longer."""
        self._memory[place * PLACE_BYTES] = 0
        self._free.append(place)

    def done_with(self, edition: Edition) -> None:
        """Note that one of those told needs no further attention."""
        self._memory[PLACES * PLACE_BYTES + self._told.index(edition)] = 1

    def at_work(self) -> frozenset[Edition]:
        """Editions at work; when the process has ended, those that were."""
        found = set()
        for start in range(0, PLACES * PLACE_BYTES, PLACE_BYTES):
            note = NOTE.fullmatch(self._memory[start + 1 : start + PLACE_BYTES]) if self._memory[start] else None
            if note is not None:
                found.add(Edition(note[1].decode(), note[2].decode()))
        return frozenset(found)

    def done(self) -> frozenset[Edition]:
        """Editions that were told and are done with."""
        first = PLACES * PLACE_BYTES
        return frozenset(edition for number, edition in enumerate(self._told) if self._memory[first + number])
