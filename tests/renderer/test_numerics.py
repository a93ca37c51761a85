"""The table of numerical care: each way of the renderer is as right as its docstring says, and what it beats is not."""

from __future__ import annotations

import pytest

from renderer.numerics import CHAPTERS, Comparison
from renderer.numerics.comparison import time_ratio

pytestmark = pytest.mark.slow


def lines(subject: str) -> dict[tuple[str, str, str], Comparison]:
    """By the case, what it measures, and the way that loses."""
    found = {(line.case, line.measure, line.other): line for line in CHAPTERS[subject]()}
    for line in found.values():
        assert line.time_ratio is None or line.time_ratio > 0.0
    return found


def test_h04_robust_traversal_lets_no_ray_through() -> None:
    near, far, vertices = lines("traversal").values()
    assert near.chosen_error == far.chosen_error == 0.0
    assert near.other_error < 1e-3
    assert far.other_error > 0.05
    assert vertices.chosen_error < 0.05 < vertices.other_error


def test_h01_h02_no_ray_hits_what_it_leaves() -> None:
    found = lines("leaving a surface")
    again = [line for line in found.values() if line.measure.startswith("rays")]
    assert [line.other for line in again] == ["no offset", "fixed 1e-4", "16 ulp, from o + t*d", "integer offset"]
    assert all(line.chosen_error == 0.0 for line in again)
    assert again[0].other_error > 0.4
    assert again[1].other_error > 0.4
    assert again[2].other_error > 0.0
    wide = [line for line in found.values() if line.measure.startswith("offset")]
    assert len(wide) == 2
    assert all(line.chosen_error < 1e-4 for line in wide)
    assert all(line.other_error > 10 for line in wide)


def test_h20_far_spheres_keep_their_shape() -> None:
    for line in lines("spheres").values():
        assert line.chosen_error < 1e-9 < line.other_error or "float64" in line.other
        assert line.chosen_error < line.other_error


def test_h18_scenes_are_centred_before_they_are_rounded() -> None:
    for line in lines("places").values():
        assert line.chosen_error < 2.0**-23 < line.other_error


def test_h55_small_angles() -> None:
    single, double = lines("angles").values()
    assert single.chosen_error == double.chosen_error < 1e-12 < double.other_error
    assert single.other_error == pytest.approx(0.0198, abs=0.005)


def test_h29_h52_light_near_the_critical_angle_and_in_sums() -> None:
    boundary, sums = lines("light").values()
    assert boundary.chosen_error < 1e-8
    assert boundary.other_error > 1e-4
    assert sums.other_error < sums.chosen_error < 2.0**-24 * 4096


def test_the_ratio_is_of_the_times() -> None:
    def counted(steps: int) -> int:
        return sum(k * k for k in range(steps))

    assert time_ratio(lambda: counted(200_000), lambda: counted(20_000)) > 3
