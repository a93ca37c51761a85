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


def test_the_services_clock_is_taken_from_the_quickest_of_the_last_round_trips() -> None:
    clock = ServiceClock()
    assert (clock.round_trip_ns, clock.offset_ns) == (None, None)
    offset = 10**12
    for i, (there, back) in enumerate([(900, 100), (50, 50), (10, 900)]):
        sent = i * 10_000
        clock.answered(sent, sent + there + offset, sent + there + back)
    assert (clock.round_trip_ns, clock.offset_ns) == (100, offset)
    for i in range(ROUND_TRIPS):
        clock.answered(i * 10_000, i * 10_000 + 300 + offset, i * 10_000 + 600)
    assert (clock.round_trip_ns, clock.offset_ns) == (600, offset)
    clock.restart()
    assert clock.offset_ns is None
