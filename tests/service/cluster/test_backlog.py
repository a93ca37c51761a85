"""Shares by speed, nothing twice and nothing forgotten."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.cluster.backlog import Backlog, cut, rate_after

rates = st.lists(st.floats(1.0, 1e7), min_size=1, max_size=6)


@settings(max_examples=40)
@given(weights=st.lists(st.integers(1, 5000), min_size=1, max_size=40), rates=rates, piece_s=st.floats(1e-3, 10.0))
def test_shares_are_all_cells_in_their_order(weights: list[int], rates: list[float], piece_s: float) -> None:
    shares = cut(np.cumsum(weights), rates, piece_s)
    cells = [cell for pieces in shares for piece in pieces for cell in range(piece.start, piece.stop)]
    assert cells == list(range(len(weights)))
    assert len(shares) == len(rates)
    for rate, pieces in zip(rates, shares, strict=True):
        for piece in pieces:
            most = max(1.0, rate * piece_s)
            assert piece.stop == piece.start + 1 or sum(weights[piece]) <= most


@given(rates=rates)
def test_shares_go_by_speed(rates: list[float]) -> None:
    shares = cut(np.arange(1, 10_001), rates, math.inf)
    for rate, pieces in zip(rates, shares, strict=True):
        cells = sum(piece.stop - piece.start for piece in pieces)
        assert cells == pytest.approx(10_000 * rate / sum(rates), abs=1.001)


def test_whoever_is_done_takes_the_last_of_who_has_most_left() -> None:
    backlog = Backlog({"slow": [0, 1, 2], "fast": [3], "fair": [4, 5, 6]}, [1.0] * 7)
    speeds = {"slow": 1.0, "fast": 10.0, "fair": 2.0}
    assert [backlog.take("fast", speeds) for _ in range(3)] == [3, 2, 1]
    assert backlog.take("slow", speeds) == 0
    assert [backlog.take("slow", speeds) for _ in range(4)] == [6, 5, 4, None]
    assert len(backlog) == 0


def test_what_a_lost_worker_had_goes_first() -> None:
    backlog = Backlog({"lost": [0, 1], "left": [2, 3]}, [1.0] * 4)
    assert backlog.take("lost", {}) == 0
    backlog.keep({"left"})
    backlog.put_back([0])
    assert not backlog.owns("lost")
    assert [backlog.take("left", {}) for _ in range(5)] == [1, 0, 2, 3, None]


def test_speeds_follow_what_is_measured() -> None:
    rate = rate_after(None, 100.0)
    assert rate == 100.0
    for _ in range(40):
        rate = rate_after(rate, 300.0)
    assert rate == pytest.approx(300.0, rel=1e-3)
