"""FovVideoVDP is asked with the true screen and the true gaze."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.gaze import Gaze

vdp = pytest.importorskip("renderer.accuracy.vdp", reason="the extra 'quality' is not installed")

pytestmark = pytest.mark.filterwarnings("default")  # torch and scipy warn of each other

SCREEN = Display(640, 200, 50.0, 20.0, 60.0)
"""With pixels that are not square."""
LEFT, RIGHT = Gaze(100.0, 100.0), Gaze(540.0, 100.0)


def scene() -> NDArray[np.uint8]:
    """Noise of 8-pixel squares."""
    squares = np.random.default_rng(3).integers(60, 200, (25, 80, 1))
    return np.kron(squares, np.ones((8, 8, 3), dtype=np.int64)).astype(np.uint8)


def damaged(gaze: Gaze) -> NDArray[np.uint8]:
    """The scene, blurred to grey around a gaze."""
    frame = scene()
    y, x = np.indices(frame.shape[:2])
    frame[np.hypot(x - gaze.x, y - gaze.y) < 40] = 128
    return frame


def metric(gaze: Gaze) -> vdp.VisibilityMetric:
    return vdp.VisibilityMetric(SCREEN, gaze, eccentricity_deg(SCREEN, gaze))


def test_equal_frames_have_the_best_quality() -> None:
    found = metric(LEFT).judge(scene(), scene())
    assert found.jod == pytest.approx(10.0)
    assert found.heat_foveal_p99 == pytest.approx(0.0, abs=1e-6)


def test_damage_counts_where_the_eye_looks() -> None:
    looking = metric(LEFT)
    here, there = looking.judge(damaged(LEFT), scene()), looking.judge(damaged(RIGHT), scene())
    assert here.jod < there.jod < 10.0
    assert here.heat_foveal_p99 > 10 * there.heat_foveal_p99
    turned = metric(RIGHT).judge(damaged(RIGHT), scene())
    assert turned.heat_foveal_p99 > 10 * metric(RIGHT).judge(damaged(LEFT), scene()).heat_foveal_p99


def test_the_screen_is_as_large_as_it_is() -> None:
    geometry = vdp._geometry(SCREEN)
    assert geometry.display_size_m == pytest.approx((0.5, 0.2))
    assert geometry.display_size_deg == pytest.approx((45.24, 18.92), abs=0.01)


def test_a_gaze_off_the_screen_has_no_fovea_to_judge() -> None:
    found = metric(Gaze(-600.0, 100.0)).judge(damaged(LEFT), scene())
    assert found.heat_foveal_p99 is None
    assert found.jod < 10.0
