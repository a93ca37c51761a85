"""What waits to be sent: the newest gaze, and each change between seen and lost before it."""

from __future__ import annotations

import threading
from collections import deque

from clients.bridge.codec import MILLISECOND_NS
from clients.bridge.gaze import Gaze

TOO_OLD_NS = 100 * MILLISECOND_NS
"""After a stall no gaze older than this is sent, unless it says that the eye was lost or found."""

MOST_CHANGES = 256
"""Eyes are lost and found a few times a second; so many unsent changes are a connection that died."""


class Slot:
    """One place for the newest gaze. A new one replaces it, unless that would hide that the eye was lost or found.

    Attributes:
        dropped: gazes that were replaced or grew too old.
    """

    def __init__(self) -> None:
        self._waiting: deque[Gaze] = deque(maxlen=MOST_CHANGES)
        self._told: bool | None = None
        self._lock = threading.Lock()
        self.dropped = 0

    def put(self, gaze: Gaze) -> None:
        """Leave the newest gaze."""
        with self._lock:
            waiting = self._waiting
            if waiting and not self._is_change(len(waiting) - 1):
                waiting.pop()
                self.dropped += 1
            elif len(waiting) == MOST_CHANGES:
                self.dropped += 1  # the deque lets the oldest go
            waiting.append(gaze)

    def take(self, now_ns: int) -> list[Gaze]:
        """What is to be sent now, oldest first; the slot is empty then."""
        with self._lock:
            taken = []
            for index, gaze in enumerate(self._waiting):
                if self._is_change(index) or now_ns - gaze.received_ns <= TOO_OLD_NS:
                    taken.append(gaze)
                else:
                    self.dropped += 1
            self._waiting.clear()
            if taken:
                self._told = taken[-1].valid
            return taken

    def clear(self) -> None:
        """Nobody listens any more: the next one to do so begins with the newest gaze."""
        with self._lock:
            self.dropped += len(self._waiting)
            self._waiting.clear()
            self._told = None

    def __len__(self) -> int:
        """How many wait: at most one more than there were changes."""
        return len(self._waiting)

    def _is_change(self, index: int) -> bool:
        """Whether the gaze there is the first one that says so, seen or lost; nothing is, to a new listener."""
        before = self._waiting[index - 1].valid if index > 0 else self._told
        return self._told is not None and before != self._waiting[index].valid
