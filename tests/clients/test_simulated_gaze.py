"""The simulated eye moves as eyes do."""

from __future__ import annotations

import numpy as np
import pytest

from clients.simulated_gaze import RATE_HZ, SCREEN_DEG, simulated_gaze


def degrees(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A minute of gaze (n, 2) [deg] with blinks left in as NaN, and its events."""
    trace = simulated_gaze(60.0, seed)
    return np.stack([trace.x, trace.y], axis=1) * SCREEN_DEG, np.array(trace.events)


def test_the_same_seed_gives_the_same_trace_and_another_seed_another() -> None:
    first, again, other = simulated_gaze(5.0, 1), simulated_gaze(5.0, 1), simulated_gaze(5.0, 2)
    np.testing.assert_array_equal(first.x, again.x)
    assert first.events == again.events
    assert not np.array_equal(first.x, other.x)


@pytest.mark.parametrize("seconds", [0.0, 0.001, 0.3, 2.0])
def test_it_lasts_as_long_as_asked(seconds: float) -> None:
    trace = simulated_gaze(seconds)
    assert trace.time_ms[0] == 0
    assert seconds - 1 / RATE_HZ < trace.seconds <= seconds
    np.testing.assert_array_equal(np.isnan(trace.x), ~trace.valid)


def test_it_stays_on_the_screen() -> None:
    trace = simulated_gaze(60.0)
    assert trace.unit == "fraction"
    for values in (trace.x[trace.valid], trace.y[trace.valid]):
        assert values.min() > 0
        assert values.max() < 1


def test_saccades_follow_the_main_sequence() -> None:
    """Duration 2.2 ms a degree and 21 ms; peak velocity 1.875 times the mean (minimum jerk)."""
    gaze, events = degrees()
    moving = np.flatnonzero(events == "saccade")
    runs = np.split(moving, np.flatnonzero(np.diff(moving) > 1) + 1)
    seen = 0
    for run in runs:
        first, last = run[0] - 1, run[-1] + 1
        if last >= len(gaze) or np.isnan(gaze[first : last + 1]).any():
            continue
        amplitude = float(np.linalg.norm(gaze[last] - gaze[first]))
        lasts_ms = (last - first) * 1e3 / RATE_HZ
        assert lasts_ms == pytest.approx(2.2 * amplitude + 21, abs=1e3 / RATE_HZ)
        if amplitude > 5:
            velocity = np.linalg.norm(np.diff(gaze[first : last + 1], axis=0), axis=1).max() * RATE_HZ
            assert velocity == pytest.approx(1.875 * amplitude / (lasts_ms / 1e3), rel=0.1)
            seen += 1
    assert seen > 50


def test_fixations_are_steady_and_last_as_long_as_those_of_people() -> None:
    gaze, events = degrees()
    still = np.flatnonzero(events == "fixation")
    lengths = [len(run) * 1e3 / RATE_HZ for run in np.split(still, np.flatnonzero(np.diff(still) > 1) + 1)]
    assert 200 < np.median(lengths) < 350
    steps = np.linalg.norm(np.diff(gaze, axis=0), axis=1)
    both_still = (events[1:] == "fixation") & (events[:-1] == "fixation") & np.isfinite(steps)
    assert np.median(steps[both_still]) * RATE_HZ < 30, "slower than any saccade [deg/s]"


def test_it_blinks_some_fifteen_times_a_minute() -> None:
    _, events = degrees(seed=3)
    shut = events == "blink"
    blinks = int((shut[1:] & ~shut[:-1]).sum())
    assert 5 <= blinks <= 30
    assert shut.mean() == pytest.approx(blinks * 0.150 / 60, rel=0.1)
