"""How long to wait before the next try."""

from __future__ import annotations

from collections.abc import Callable

FIRST_S = 0.25
FACTOR = 2.0
LONGEST_S = 5.0
JITTER = 0.2
"""Waits differ by up to a fifth, so that many clients of one service do not return at once."""
PROVEN_NS = 10_000_000_000
"""After so long of good data the next failure is a new one."""


class Backoff:
    """Waits that double up to a limit.

    Args:
        random: gives numbers from 0 to 1.
    """

    def __init__(self, random: Callable[[], float]) -> None:
        self._random = random
        self._tries = 0
        self._good_since_ns: int | None = None

    def wait_s(self) -> float:
        """How long to wait now [s]."""
        wait = min(FIRST_S * FACTOR**self._tries, LONGEST_S)
        self._tries = min(self._tries + 1, 16)
        self._good_since_ns = None
        return wait * (1 + JITTER * (2 * self._random() - 1))

    def good(self, now_ns: int) -> None:
        """Data came, and it was good."""
        if self._good_since_ns is None:
            self._good_since_ns = now_ns
        elif now_ns - self._good_since_ns >= PROVEN_NS:
            self._tries = 0
