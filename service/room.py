"""Memory for frames in work: who wants more than is left waits for its turn."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from renderer.frame import Abandoned
from service.jobs import Stopping

GLANCE_S = 0.05
"""How often whoever waits looks whether its frame was given up [s]."""


class Room:
    """So many bytes, lent in the order in which they were asked for. Any thread may ask.

    Attributes:
        nbytes: the bound.
    """

    def __init__(self, nbytes: int) -> None:
        self.nbytes = nbytes
        self._lent = 0
        self._waiting: deque[object] = deque()
        self._changed = threading.Condition()
        self._closed = False

    @property
    def lent(self) -> int:
        """Bytes that are in use."""
        return self._lent

    @property
    def waiting(self) -> int:
        """How many wait for their turn."""
        return len(self._waiting)

    @contextmanager
    def take(self, nbytes: int, abandon: threading.Event | None = None) -> Iterator[None]:
        """Hold `nbytes` during the block; who asked before goes first, so that small frames never starve a large one.

        Args:
            nbytes: at most the bound.
            abandon: set it, from another thread, to wait no longer.

        Raises:
            Abandoned: soon after `abandon` is set, if there was no room by then.
            Stopping: if the service ends before there is room.
            ValueError: for more than there will ever be.
        """
        if nbytes > self.nbytes:
            raise ValueError(f"expected at most {self.nbytes} bytes, found {nbytes}")
        turn = object()
        with self._changed:
            self._waiting.append(turn)
            try:
                while self._waiting[0] is not turn or self._lent + nbytes > self.nbytes:
                    if self._closed:
                        raise Stopping("the service is stopping")
                    if abandon is not None and abandon.is_set():
                        raise Abandoned
                    self._changed.wait(None if abandon is None else GLANCE_S)
                self._lent += nbytes
            finally:
                self._waiting.remove(turn)
                self._changed.notify_all()
        try:
            yield
        finally:
            with self._changed:
                self._lent -= nbytes
                self._changed.notify_all()

    def close(self) -> None:
        """Send away who still waits."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
