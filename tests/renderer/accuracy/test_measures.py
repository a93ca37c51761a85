"""Measures of frames whose errors are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.accuracy.error_map import RAMP, error_map
from renderer.accuracy.measures import plain_measures
from renderer.accuracy.pixels_per_degree import pixels_per_degree
from renderer.display import Display
from renderer.store import LUMINANCE

FOVEA = np.zeros((6, 8), dtype=bool)
FOVEA[2:4, 3:5] = True


def grey(value: float) -> NDArray[np.float32]:
    return np.full((6, 8, 3), value, dtype=np.float32)


def test_equal_frames_differ_in_nothing() -> None:
    found = plain_measures(grey(0.3), grey(0.3), 1.0, FOVEA)
    assert found.luminance_ratio == 1.0
    assert (found.relative_mse, found.rms, found.foveal_rms, found.foveal_max_error) == (0.0, 0.0, 0.0, 0.0)
    assert found.foveal_psnr_db is None, "it is infinite"


def test_a_uniform_error() -> None:
    found = plain_measures(grey(0.5), grey(0.4), 1.0, FOVEA)
    assert found.luminance_ratio == pytest.approx(1.25)
    assert found.relative_mse == pytest.approx(0.01 / (0.16 + 0.01), rel=1e-5)
    assert (found.rms, found.foveal_rms) == (pytest.approx(0.1), pytest.approx(0.1))
    assert found.foveal_psnr_db == pytest.approx(20.0, abs=1e-4)
    assert found.foveal_max_error == pytest.approx(0.1)


def test_the_fovea_is_judged_by_itself() -> None:
    frame = grey(0.4)
    frame[0, 0] += 0.3
    frame[2, 3, 1] += 0.2
    found = plain_measures(frame, grey(0.4), 1.0, FOVEA)
    assert found.foveal_max_error == pytest.approx(0.2)
    assert found.foveal_psnr_db == pytest.approx(-20 * math.log10(0.2 / math.sqrt(12)), abs=1e-4)
    green = LUMINANCE[1] * 0.2
    assert found.foveal_rms == pytest.approx(green / 2)
    assert found.rms == pytest.approx(math.sqrt((0.09 + green**2) / 48), rel=1e-5)


def test_what_is_beyond_white_shows_as_white() -> None:
    found = plain_measures(grey(200.0), grey(100.0), 0.5, FOVEA)
    assert (found.luminance_ratio, found.relative_mse, found.foveal_max_error) == (1.0, 0.0, 0.0)
    assert found.rms == found.foveal_rms == 0.0
    assert plain_measures(grey(0.2), grey(0.1), 2.0, FOVEA).rms == pytest.approx(0.2)


def test_what_does_not_exist_is_none() -> None:
    off_screen = plain_measures(grey(0.5), grey(0.0), 1.0, np.zeros_like(FOVEA))
    assert (off_screen.foveal_psnr_db, off_screen.foveal_max_error, off_screen.foveal_rms) == (None, None, None)
    assert off_screen.luminance_ratio is None, "the reference is black"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["frame", "reference"])
def test_no_metric_sees_a_pixel_that_is_not_finite(value: float, name: str) -> None:
    frames = {"frame": grey(0.5), "reference": grey(0.5)}
    frames[name][1, 2, 0] = value
    with pytest.raises(ValueError, match=f"{name}: expected finite pixels, found 1 that are not"):
        plain_measures(frames["frame"], frames["reference"], 1.0, FOVEA)


def test_an_error_map_is_black_where_nothing_is_wrong_and_bright_where_all_is() -> None:
    frame = grey(0.0)
    frame[0] = 1.0
    frame[1] = 1e-3
    frame[2] = 10**-1.5
    colours = error_map(frame, grey(0.0), 1.0)
    assert (colours.shape, colours.dtype) == ((6, 8, 3), np.uint8)
    for row, stop in ((0, -1), (1, 0), (2, 2), (3, 0)):
        np.testing.assert_allclose(colours[row], np.broadcast_to(RAMP[stop], (8, 3)), atol=1)


def test_pixels_per_degree_are_those_of_the_middle_of_the_screen() -> None:
    """1 / (2 atan(pitch / 2d)): 40.212 across and 32.314 down on this screen; their geometric mean."""
    assert pixels_per_degree(Display(1920, 1080, 50.0, 35.0, 60.0)) == pytest.approx(36.047, abs=5e-4)
    assert pixels_per_degree(Display(1000, 500, 100.0, None, 1e4)) == pytest.approx(math.radians(1e5), rel=1e-6)
