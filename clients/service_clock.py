"""The service's monotonic clock against ours."""

from __future__ import annotations

from collections import deque
from typing import Final

ROUND_TRIPS: Final = 40
"""How many of the last round trips the service's clock is taken from: ten seconds of them, over which two clocks drift
apart by less than a millisecond, and of which one is quick even where both sides are busy."""


class ServiceClock:
    """What the quickest of the last round trips says: it was delayed least, so it errs least."""

    def __init__(self) -> None:
        self._trips: deque[tuple[int, int]] = deque(maxlen=ROUND_TRIPS)

    def restart(self) -> None:
        """Forget all: another service may be there now."""
        self._trips.clear()

    def answered(self, sent_ns: int, service_time_ns: int, received_ns: int) -> None:
        """Take a round trip into account: sent and received by our clock, answered by the service's."""
        self._trips.append((received_ns - sent_ns, service_time_ns - (sent_ns + received_ns) // 2))

    @property
    def round_trip_ns(self) -> int | None:
        """The least of the last round trips [ns]; None before the first."""
        return min(self._trips)[0] if self._trips else None

    @property
    def offset_ns(self) -> int | None:
        """The service's clock minus ours [ns], right to half the round trip; None before the first."""
        return min(self._trips)[1] if self._trips else None
