"""How many messages a client may send: so many a second, and no more than those of a second at once."""

from __future__ import annotations

from collections.abc import Callable

NS_PER_S = 1_000_000_000


class Allowance:
    """A bucket that fills at `per_second` and holds those of one second.

    Args:
        per_second: messages.
        clock: monotonic [ns].
    """

    def __init__(self, per_second: int, clock: Callable[[], int]) -> None:
        self._per_second = per_second
        self._clock = clock
        self._filled_ns = clock()
        self._left = float(per_second)

    def spend(self) -> bool:
        """Take one; False if there is none."""
        now_ns = self._clock()
        gained = (now_ns - self._filled_ns) * self._per_second / NS_PER_S
        self._left = min(float(self._per_second), self._left + gained)
        self._filled_ns = now_ns
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
