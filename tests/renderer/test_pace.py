"""Learned rates: they follow what is measured, and no single hiccup."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pace import (
    FIRST_MARGIN,
    FRAME_SEED_NS,
    KEPT_RATES,
    LARGEST_MARGIN,
    LATE_SHARE,
    LEAST_SAMPLES,
    MAP_SEED_NS,
    SAMPLE_SEED_NS,
    Pace,
    Rate,
    margin_after,
)
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scene import Scene

HUNDRED = Display(10, 10)


def rate_after(*measured: float) -> Rate:
    rate = Rate(1e9)
    for ns in measured:
        rate = rate.after(ns)
    return rate


def test_the_first_measurement_replaces_the_guess() -> None:
    assert rate_after(5.0) == (5.0, 1)


@given(st.lists(st.floats(1, 100), min_size=1, max_size=4))
def test_the_first_four_are_averaged(measured: list[float]) -> None:
    assert rate_after(*measured).mean == pytest.approx(sum(measured) / len(measured))


@given(st.floats(1, 1e4), st.floats(1, 1e4))
def test_a_new_speed_is_learned(before: float, after: float) -> None:
    """However far off, in some dozens of frames."""
    assert rate_after(*[before] * 10, *[after] * 80).mean == pytest.approx(after, rel=0.01)


@given(st.floats(0, 1e12))
def test_one_outlier_among_steady_frames_changes_little(outlier: float) -> None:
    rate = rate_after(*[100.0] * 20, outlier)
    assert 80 <= rate.mean <= 150


@pytest.mark.parametrize("spread", [0.02, 0.1, 0.4])
def test_the_margin_holds_for_all_but_the_share_that_may_be_late(spread: float) -> None:
    """Whatever the spread of the predictions, and no wider than it takes: over its log-normal quantile."""
    ratios = np.random.default_rng(1).lognormal(0.0, spread, 8000)
    margins = list(itertools.accumulate(ratios, margin_after, initial=4.0))[:-1]
    late = ratios > margins
    assert late[1000:].mean() == pytest.approx(LATE_SHARE, rel=0.25)
    assert np.mean(margins[1000:]) == pytest.approx(math.exp(1.88 * spread), rel=0.15)


def test_the_margin_has_bounds() -> None:
    assert functools.reduce(margin_after, [0.5] * 2000, 4.0) == 1.0
    assert functools.reduce(margin_after, [1e9] * 200, 1.0) == LARGEST_MARGIN


@pytest.fixture(scope="module")
def empty() -> PreparedScene:
    return prepare(Scene())


def request(**changes: object) -> FrameRequest:
    return FrameRequest(Gaze(5, 5), HUNDRED, None, dataclasses.replace(Quality(), **changes))  # type: ignore[arg-type]


def test_what_was_not_measured_is_guessed_by_the_number_of_threads(empty: PreparedScene) -> None:
    for threads in (1, 4):
        seeds = (MAP_SEED_NS / threads, FRAME_SEED_NS / threads, SAMPLE_SEED_NS / threads)
        assert Pace(threads).rates(empty, request()) == (*seeds, FIRST_MARGIN)


def test_each_part_is_learned_by_itself(empty: PreparedScene) -> None:
    pace = Pace(1)
    pace.learn(empty, request(), None, 200.0, 1e6, LEAST_SAMPLES - 1)
    assert pace.rates(empty, request()) == (MAP_SEED_NS, pytest.approx(2.0), SAMPLE_SEED_NS, FIRST_MARGIN)
    pace.learn(empty, request(), 1000.0, 200.0, 10.0 * LEAST_SAMPLES, LEAST_SAMPLES)
    known = pace.rates(empty, request())
    assert known == (10.0, 2.0, 10.0, FIRST_MARGIN)
    for other in (request(max_depth=1), request(antialiasing="regular"), request(shadow_samples=99)):
        assert pace.rates(empty, other) == known._replace(sample=SAMPLE_SEED_NS)
    assert pace.rates(prepare(Scene()), request()) == known._replace(sample=SAMPLE_SEED_NS)
    assert pace.rates(empty, request(map="scanline")) == known._replace(map_pixel=MAP_SEED_NS)
    assert pace.rates(empty, request(reconstruction="smooth")) == known._replace(frame_pixel=FRAME_SEED_NS)
    large = dataclasses.replace(request(), display=Display(20, 10))
    assert pace.rates(empty, large) == (MAP_SEED_NS, FRAME_SEED_NS, known.sample, FIRST_MARGIN)


def test_frames_that_take_longer_than_was_predicted_widen_the_margin(empty: PreparedScene) -> None:
    pace = Pace(1)
    pace.learn(empty, request(), 1000.0, 200.0, 10.0 * LEAST_SAMPLES, LEAST_SAMPLES)
    for factor, widens in ((1.0, False), (2.0, True)):
        before = pace.rates(empty, request())
        parts = (before.map_pixel, before.frame_pixel, LEAST_SAMPLES * before.sample / HUNDRED.pixels)
        map_ns, frame_ns, trace_ns = (factor * HUNDRED.pixels * part for part in parts)
        pace.learn(empty, request(), map_ns, frame_ns, trace_ns, LEAST_SAMPLES)
        assert (pace.rates(empty, request()).margin > before.margin) == widens
    assert pace.rates(empty, request(max_depth=1)).margin == FIRST_MARGIN


def test_scenes_that_are_gone_are_forgotten(empty: PreparedScene) -> None:
    pace = Pace(1)
    pace.learn(empty, request(), None, 100.0, 1e6, LEAST_SAMPLES)
    for depth in range(KEPT_RATES):
        other = dataclasses.replace(empty, identity=depth)
        pace.learn(other, request(), None, 100.0, 1e6, LEAST_SAMPLES)
    assert pace.rates(empty, request()).sample == SAMPLE_SEED_NS
