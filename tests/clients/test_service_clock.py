"""The service's clock: as right as half the quickest round trip."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from clients.service_clock import ROUND_TRIPS, ServiceClock

delays = st.integers(0, 10**9)


@given(st.integers(-(10**18), 10**18), st.lists(st.tuples(delays, delays), min_size=1, max_size=30))
def test_the_offset_errs_by_half_a_round_trip_at_most(true_offset: int, trips: list[tuple[int, int]]) -> None:
    clock, now = ServiceClock(), 0
    for there, back in trips:
        clock.answered(now, now + there + true_offset, now + there + back)
        now += there + back
    quickest = min(there + back for there, back in trips[-ROUND_TRIPS:])
    assert clock.round_trip_ns == quickest
    assert clock.offset_ns is not None
    assert abs(clock.offset_ns - true_offset) <= quickest / 2 + 1


def test_nothing_is_known_before_the_first_round_trip_and_of_another_service() -> None:
    clock = ServiceClock()
    assert (clock.offset_ns, clock.round_trip_ns) == (None, None)
    clock.answered(0, 5, 10)
    assert clock.round_trip_ns == 10
    clock.restart()
    assert (clock.offset_ns, clock.round_trip_ns) == (None, None)
