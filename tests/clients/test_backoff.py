"""Waits before the next try grow to a limit, and differ between clients."""

from __future__ import annotations

import pytest

from clients.backoff import FIRST_S, JITTER, LONGEST_S, PROVEN_NS, Backoff


def test_waits_double_up_to_a_limit_and_begin_anew() -> None:
    backoff = Backoff(lambda: 0.5)
    waits = [backoff.wait_s() for _ in range(12)]
    assert waits[:4] == pytest.approx([FIRST_S, 2 * FIRST_S, 4 * FIRST_S, 8 * FIRST_S])
    assert waits[-1] == LONGEST_S
    backoff.restart()
    assert backoff.wait_s() == FIRST_S


@pytest.mark.parametrize(("random", "factor"), [(0.0, 1 - JITTER), (1.0, 1 + JITTER)])
def test_waits_differ_by_a_share(random: float, factor: float) -> None:
    assert Backoff(lambda: random).wait_s() == pytest.approx(FIRST_S * factor)


def test_only_lasting_good_data_makes_the_next_failure_a_new_one() -> None:
    backoff = Backoff(lambda: 0.5)
    for _ in range(8):
        backoff.wait_s()
    backoff.good(0)
    backoff.good(PROVEN_NS - 1)
    assert backoff.wait_s() == LONGEST_S
    backoff.good(0)
    backoff.good(PROVEN_NS)
    assert backoff.wait_s() == FIRST_S
