"""How long to wait before the next try."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

FIRST_S: Final = 0.25
FACTOR: Final = 2.0
LONGEST_S: Final = 5.0
JITTER: Final = 0.2
"""Waits differ by up to a fifth, so that many clients of one service do not return at once."""
PROVEN_NS: Final = 10_000_000_000
"""After so long of good data the next failure is a new one."""


class Backoff:
    """Waits that double up to a limit.

    Args:
        random: gives numbers from 0 to 1.
    """

    def __init__(self, random: Callable[[], float]) -> None:
        self._random = random
        self._next_s = FIRST_S
        self._good_since_ns: int | None = None

    def wait_s(self) -> float:
        """How long to wait now [s]."""
        wait_s = self._next_s
        self._next_s = min(wait_s * FACTOR, LONGEST_S)
        self._good_since_ns = None
        return wait_s * (1 + JITTER * (2 * self._random() - 1))

    def restart(self) -> None:
        """The last try went well."""
        self._next_s = FIRST_S

    def good(self, now_ns: int) -> None:
        """Data came, and it was good: in time that tells that the last try went well."""
        if self._good_since_ns is None:
            self._good_since_ns = now_ns
        elif now_ns - self._good_since_ns >= PROVEN_NS:
            self.restart()
