"""Work for which there is time only while nobody waits for a frame."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

QUIET_S = 0.5
"""How long nobody must have waited for a frame before idle work begins [s]: longer than encoding takes, and than
the pauses of a gaze that moves."""


class Closed(Exception):
    """There will be no more idle time: the service is stopping."""


class Idle:
    """Tells idle work when it may go on, and when it has to stop at once. Any thread may ask.

    Args:
        quiet_s: how long nobody must have waited for a frame.
    """

    def __init__(self, quiet_s: float = QUIET_S) -> None:
        self._quiet_s = quiet_s
        self._changed = threading.Condition()
        self._frames = 0
        self._quiet_since = time.monotonic()
        self._closed = False
        self._interrupt = threading.Event()

    @contextmanager
    def busy(self) -> Iterator[None]:
        """While somebody waits for a frame: idle work is interrupted at once, and none begins."""
        with self._changed:
            self._frames += 1
            self._interrupt.set()
        try:
            yield
        finally:
            with self._changed:
                self._frames -= 1
                self._quiet_since = time.monotonic()
                self._changed.notify_all()

    def wait(self) -> threading.Event:
        """Wait for idle time.

        Returns:
            what is set when it is over.

        Raises:
            Closed: if there will be none.
        """
        with self._changed:
            while not self._closed:
                pause_s = self._quiet_since + self._quiet_s - time.monotonic()
                if not self._frames and pause_s <= 0:
                    self._interrupt = threading.Event()
                    return self._interrupt
                self._changed.wait(None if self._frames else pause_s)
            raise Closed("the service is stopping")

    def close(self) -> None:
        """Interrupt idle work, and let none begin any more."""
        with self._changed:
            self._closed = True
            self._interrupt.set()
            self._changed.notify_all()
