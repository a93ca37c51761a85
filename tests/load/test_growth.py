"""The line through a process's memory: found where it is known, and its error is that of repeated series."""

from __future__ import annotations

import numpy as np
import pytest

from tests.load.growth import growth_of

FRAMES = list(range(0, 4000, 2))
MIB = float(1 << 20)


@pytest.mark.parametrize("slope", [0.0, 100.0, -30.0])
def test_a_straight_line_is_found(slope: float) -> None:
    growth = growth_of(FRAMES, [300 * MIB + slope * frame for frame in FRAMES])
    assert growth.slope == pytest.approx(slope, abs=1e-3)
    assert growth.error == pytest.approx(0.0, abs=1e-3)
    assert growth.done == FRAMES[-1]


@pytest.mark.parametrize("alike", [1, 40])
def test_the_error_is_how_far_slopes_of_repeated_series_differ(alike: int) -> None:
    """Also where so many neighbours are the same: they say no more than one of them."""
    generator = np.random.default_rng(1)
    found = []
    for _ in range(300):
        noise = np.repeat(generator.normal(0.0, MIB, len(FRAMES) // alike), alike)
        found.append(growth_of(FRAMES, list(300 * MIB + 50.0 * np.array(FRAMES) + noise)))
    slopes = np.array([each.slope for each in found])
    stated = np.sqrt(np.mean([each.error**2 for each in found]))
    assert stated / slopes.std() == pytest.approx(1.0, abs=0.15)
    assert abs(slopes.mean() - 50.0) < 4 * slopes.std() / np.sqrt(len(found))


def test_what_grows_is_not_flat() -> None:
    noise = np.random.default_rng(2).normal(0.0, MIB, len(FRAMES))
    assert growth_of(FRAMES, list(noise)).flat
    assert not growth_of(FRAMES, list(noise + 300.0 * np.array(FRAMES))).flat


@pytest.mark.parametrize("frames", [FRAMES[:19], [7] * 100])
def test_too_little_says_nothing(frames: list[int]) -> None:
    with pytest.raises(ValueError, match="expected 20 samples or more"):
        growth_of(frames, [MIB] * len(frames))
