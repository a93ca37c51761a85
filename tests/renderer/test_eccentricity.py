"""Eccentricities and cell sizes: reference values, a slow second computation, and views at the edge of reason.

`exact` puts the eye in front of the middle of the screen, `paper` in front of the gaze.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from renderer.acuity import ECCENTRICITIES, Acuity
from renderer.cellmap import cell_sizes
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.errors import SettingsError
from renderer.gaze import Gaze, GazeBucket, bucket_of
from tests.renderer.viewing import (
    PAPER_SCREEN,
    ROUNDING,
    acuities,
    displays,
    gazes,
    point_of,
    sizes_at,
    true_cell_size,
)

# Eccentricity


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(SettingsError, match="one of exact, paper"):
        eccentricity_deg(Display(2, 2), Gaze(1, 1), "flat")


# Cell size


@given(st.data(), acuities(st.just(0.0) | st.floats(0, 90)))
def test_cell_sizes_are_alpha_over_beta_rounded_down(data: st.DataObject, acuity: Acuity) -> None:
    display = data.draw(displays())
    gaze = data.draw(gazes(display))
    if acuity.eccentricity == "paper":
        acuity = dataclasses.replace(acuity, margin_deg=0.0)
    sizes = sizes_at(display, acuity, gaze).astype(int)
    truth = true_cell_size(display, acuity, gaze)
    floor = np.floor(truth).astype(int)
    on_the_edge = (abs(truth - np.round(truth)) < ROUNDING * truth) & (abs(sizes - floor) == 1)
    wrong = (sizes != floor) & ~on_the_edge
    assert not wrong.any(), (sizes[wrong][:5], truth[wrong][:5])


def test_on_the_papers_screen_cells_are_alpha_over_beta_rounded_down() -> None:
    for kind in ECCENTRICITIES:
        gaze, acuity = Gaze(300.0, 405.0), Acuity(eccentricity=kind)
        truth = true_cell_size(PAPER_SCREEN, acuity, gaze)
        clear = abs(truth - np.round(truth)) > ROUNDING
        assert_array_equal(sizes_at(PAPER_SCREEN, acuity, gaze)[clear], np.floor(truth[clear]).astype(int))


@pytest.mark.parametrize("kind", ECCENTRICITIES)
@pytest.mark.parametrize("height_cm", [None, 5.0, 500.0])
def test_near_a_wide_screen_too(kind: str, height_cm: float | None) -> None:
    display, gaze = Display(700, 600, 50.0, height_cm, 6.0), Gaze(30.0, 560.0)
    for scale in (1.0, 10.0, 100.0):
        acuity = Acuity(eccentricity=kind, scale=scale)
        truth = true_cell_size(display, acuity, gaze)
        clear = abs(truth - np.round(truth)) > ROUNDING * truth
        assert_array_equal(sizes_at(display, acuity, gaze)[clear], np.floor(truth[clear]).astype(int))


# One size for a whole bucket of gazes, and for a tracker's error


@given(st.data(), acuities())
def test_a_buckets_cells_are_fine_enough_for_every_gaze_in_it(data: st.DataObject, acuity: Acuity) -> None:
    display = data.draw(displays(120, 90))
    side = data.draw(st.sampled_from([1, 3, 16, 64, 512]))
    bucket = bucket_of(data.draw(gazes(display)), side)
    part = st.sampled_from([-0.5, 0.5, 0.0]) | st.floats(-0.5, 0.5)
    gaze = Gaze(bucket.x + data.draw(part) * side, bucket.y + data.draw(part) * side)
    allowed = true_cell_size(display, acuity, gaze)
    too_large = cell_sizes(display, acuity, bucket) > allowed * (1 + ROUNDING)
    assert not too_large.any(), (bucket, gaze)


def test_a_bucket_wider_than_the_eye_is_far_is_fine_enough_too() -> None:
    display, side = Display(8, 70, 12.0, 438.0, 2.0), 512
    acuity = Acuity(scale=3.8)
    parts = np.linspace(-0.5, 0.5, 33) * side
    allowed = np.minimum.reduce([true_cell_size(display, acuity, Gaze(x, y)) for x in parts for y in parts])
    sizes = cell_sizes(display, acuity, GazeBucket(0.0, 0.0, side))
    assert (sizes <= allowed * (1 + ROUNDING)).all()


@given(st.data(), acuities(st.floats(0.01, 45)), st.floats(0, 1), st.floats(0, 2 * math.pi))
def test_a_margin_makes_cells_fine_enough_for_every_gaze_within_it(
    data: st.DataObject, acuity: Acuity, part: float, direction: float
) -> None:
    display = data.draw(displays(120, 90))
    gaze = Gaze(data.draw(st.floats(-0.2, 1.2)) * display.width_px, data.draw(st.floats(-0.2, 1.2)) * display.height_px)
    other = gaze_beside(display, gaze, acuity.eccentricity, part * acuity.margin_deg, direction)
    if other is None:
        return
    allowed = true_cell_size(display, dataclasses.replace(acuity, margin_deg=0.0), other)
    too_large = sizes_at(display, acuity, gaze) > allowed * (1 + ROUNDING)
    assert not too_large.any(), (gaze, other)


@pytest.mark.parametrize("kind", ECCENTRICITIES)
def test_a_margin_of_one_degree_on_the_papers_screen(kind: str) -> None:
    display = dataclasses.replace(PAPER_SCREEN, width_px=960, height_px=540)
    gaze, acuity = Gaze(500.0, 250.0), Acuity(eccentricity=kind, scale=4.0)
    others = [gaze_beside(display, gaze, kind, 1.0, math.tau * turn / 8) for turn in range(8)]
    allowed = np.minimum.reduce([true_cell_size(display, acuity, other) for other in others if other is not None])
    sizes = sizes_at(display, dataclasses.replace(acuity, margin_deg=1.0), gaze)
    assert (sizes <= allowed * (1 + ROUNDING)).all()
    assert (sizes >= allowed * 0.75 - 1).all()


def gaze_beside(display: Display, gaze: Gaze, kind: str, angle_deg: float, direction: float) -> Gaze | None:
    """The gaze that many degrees away in a direction across the line of sight; None behind the screen's plane."""
    gaze_x, gaze_y = (float(part) for part in point_of(display, gaze))
    distance = display.distance_cm
    sight = np.array([0.0, 0.0, 1.0])
    if kind == "exact":
        sight = np.array([gaze_x, gaze_y, distance]) / math.hypot(gaze_x, gaze_y, distance)
    across = np.cross(sight, [0.0, 1.0, 0.0] if abs(sight[1]) < 0.9 else [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    aside = math.cos(direction) * across + math.sin(direction) * np.cross(sight, across)
    angle = math.radians(angle_deg)
    turned = math.cos(angle) * sight + math.sin(angle) * aside
    if turned[2] < 1e-6:
        return None
    x, y = turned[:2] / turned[2] * distance
    if kind == "paper":
        x, y = x + gaze_x, y + gaze_y
    return Gaze(x / display.pitch_x_cm + display.width_px / 2, y / display.pitch_y_cm + display.height_px / 2)


def test_a_margin_of_a_quarter_turn_makes_every_cell_as_fine_as_at_the_gaze() -> None:
    display = Display(64, 36, 5.0, None, 60.0)
    for kind in ECCENTRICITIES:
        sizes = sizes_at(display, Acuity(eccentricity=kind, scale=30.0, margin_deg=90.0), Gaze(-5000.0, 3.0))
        assert sizes.min() == sizes.max() == math.floor(30.0 / 86.2 / math.degrees(math.atan(5.0 / 64 / 60)))
