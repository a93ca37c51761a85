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
from numpy.typing import NDArray

from renderer.acuity import ECCENTRICITIES, Acuity, unit_angle_deg
from renderer.cellmap import cell_sizes
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.errors import SettingsError
from renderer.gaze import Gaze, GazeBucket, bucket_of
from tests.renderer.viewing import (
    PAPER_SCREEN,
    acuities,
    displays,
    gazes,
    point_of,
    true_cell_size,
    true_eccentricity,
)

SQUARE = dataclasses.replace(PAPER_SCREEN, height_cm=None)
"""The paper's screen with square pixels, so that the pixel angle along x is the pixel angle."""

ROUNDING = 1e-6
"""How near alpha / beta may be to an integer for either of its neighbours to be right."""


def sizes_at(display: Display, acuity: Acuity, gaze: Gaze) -> NDArray[np.uint16]:
    return cell_sizes(display, acuity, GazeBucket(gaze.x, gaze.y, 0))


def middle_row(distance_cm: float, gaze: Gaze | None = None) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
    """Eccentricity and cell size of the pixels right of the middle of the screen, gaze in the middle."""
    display = dataclasses.replace(SQUARE, distance_cm=distance_cm)
    middle = Gaze(960.0, 540.0)
    return eccentricity_deg(display, middle)[540, 960:], sizes_at(display, Acuity(), middle)[540, 960:]


# Eccentricity


@pytest.mark.parametrize(
    ("x", "y", "exact", "paper"),
    [
        (0.5, 0.5, 27.0912283412, 27.0607330083),
        (1919.5, 0.5, 25.4223222391, 25.7212906576),
        (0.5, 1079.5, 28.4705428324, 28.1441476008),
        (1919.5, 1079.5, 26.8809519623, 26.8936648225),
        (960.5, 540.5, 1.5919995385, 1.5919961589),
        (1000.5, 500.5, 0.0198422533, 0.0198501851),
    ],
)
def test_reference_eccentricities(x: float, y: float, exact: float, paper: float) -> None:
    gaze = Gaze(1000.0, 500.0)
    assert eccentricity_deg(PAPER_SCREEN, gaze)[int(y), int(x)] == pytest.approx(exact, abs=1e-9)
    assert eccentricity_deg(PAPER_SCREEN, gaze, "paper")[int(y), int(x)] == pytest.approx(paper, abs=1e-9)


@pytest.mark.parametrize("kind", ECCENTRICITIES)
def test_the_pixel_looked_at_is_at_zero_exactly(kind: str) -> None:
    angles = eccentricity_deg(PAPER_SCREEN, Gaze(1000.5, 500.5), kind)
    assert angles[500, 1000] == 0.0
    assert np.count_nonzero(angles) == angles.size - 1


def test_the_pixel_beside_the_one_looked_at() -> None:
    assert eccentricity_deg(PAPER_SCREEN, Gaze(1000.5, 500.5))[500, 1001] == pytest.approx(0.0248544347, abs=1e-9)


@pytest.mark.parametrize("kind", ECCENTRICITIES)
@pytest.mark.parametrize("distance_cm", [60.0, 1e4])
def test_every_pixel_agrees_with_longer_arithmetic(kind: str, distance_cm: float) -> None:
    display, gaze = dataclasses.replace(PAPER_SCREEN, distance_cm=distance_cm), Gaze(1000.0, 500.0)
    angles = eccentricity_deg(display, gaze, kind)
    assert angles.shape == (1080, 1920)
    assert angles.dtype == np.float64
    np.testing.assert_allclose(
        angles, true_eccentricity(display, gaze, kind, np.longdouble).astype(float), rtol=1e-12, atol=1e-13
    )


def test_from_afar_no_two_pixels_of_a_row_look_alike() -> None:
    angles = eccentricity_deg(dataclasses.replace(PAPER_SCREEN, distance_cm=1e4), Gaze(1000.5, 500.5))[500, 1000:]
    np.testing.assert_allclose(np.diff(angles), 1.49e-4, rtol=2e-3)


def test_pixels_per_degree_differ_along_and_across_where_pixels_are_not_square() -> None:
    angles = eccentricity_deg(Display(101, 101, 101 / 38.4, 101 / 30.857142857142858), Gaze(50.5, 50.5))
    assert 1 / angles[50, 51] == pytest.approx(40.2124, abs=1e-4)
    assert 1 / angles[51, 50] == pytest.approx(32.3135, abs=1e-4)


@given(st.data())
def test_any_view_agrees_with_longer_arithmetic(data: st.DataObject) -> None:
    display = data.draw(displays(60, 40))
    gaze = data.draw(gazes(display))
    for kind in ECCENTRICITIES:
        angles = eccentricity_deg(display, gaze, kind)
        assert angles.min() >= 0.0
        assert angles.max() <= 180.0
        np.testing.assert_allclose(
            angles, true_eccentricity(display, gaze, kind, np.longdouble).astype(float), rtol=1e-9, atol=1e-10
        )


@given(displays(60, 40), st.integers(-4000, 4000), st.integers(-4000, 4000), acuities(st.just(0.5)))
def test_mirrors_of_the_gaze_mirror_every_bit(display: Display, right: int, down: int, acuity: Acuity) -> None:
    width, height = display.width_px, display.height_px
    gaze = Gaze(right / 8, down / 8)
    mirrored = Gaze(width - gaze.x, height - gaze.y)
    kind = acuity.eccentricity
    angles, sizes = eccentricity_deg(display, gaze, kind), sizes_at(display, acuity, gaze)
    for other, turn in ((Gaze(mirrored.x, gaze.y), np.s_[:, ::-1]), (Gaze(gaze.x, mirrored.y), np.s_[::-1, :])):
        assert_array_equal(eccentricity_deg(display, other, kind), angles[turn])
        assert_array_equal(sizes_at(display, acuity, other), sizes[turn])


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


@pytest.mark.parametrize(
    ("distance_cm", "in_the_middle", "last"), [(0.1, 1, 1446), (1e-4, 1, 1920), (1e4, 77, 81), (1e8, 1920, 1920)]
)
def test_from_very_near_and_very_far(distance_cm: float, in_the_middle: int, last: int) -> None:
    _, sizes = middle_row(distance_cm)
    assert sizes[0] == in_the_middle
    assert abs(int(sizes[-1]) - last) <= 1


def test_at_the_edge_of_sight_cells_are_as_large_as_the_screen_not_one_pixel() -> None:
    for distance_cm, edge_deg in [(0.1, 89.770699), (1e-4, 89.999771)]:
        angles, sizes = middle_row(distance_cm)
        assert angles[-1] == pytest.approx(edge_deg, abs=1e-6)
        assert sizes[-1] >= 1446
    angles, sizes = middle_row(1e-8)
    assert angles[-1] == pytest.approx(90.0, abs=1e-6)
    assert (sizes[1:] == 1920).all()


@pytest.mark.parametrize("distance_cm", [1e-8, 1e-4, 0.1, 10.0, 60.0, 1e4, 1e8])
def test_cells_never_shrink_away_from_the_gaze(distance_cm: float) -> None:
    angles, sizes = middle_row(distance_cm)
    assert (np.diff(angles) >= 0).all()
    assert (np.diff(sizes.astype(int)) >= 0).all()


def test_where_a_pixel_is_more_than_the_eye_resolves_every_cell_is_one_pixel() -> None:
    display, gaze = Display(64, 64, 100.0, 100.0, 30.0), Gaze(32.0, 32.0)
    angle = eccentricity_deg(display, gaze)[63, 63]
    assert angle == pytest.approx(66.684, abs=1e-3)
    assert unit_angle_deg(angle) == pytest.approx(0.2597, abs=1e-4)
    assert (sizes_at(display, Acuity(), gaze) == 1).all()


def test_a_display_of_one_pixel_has_one_cell_size() -> None:
    for distance_cm in (1e-8, 60.0, 1e8):
        sizes = sizes_at(Display(1, 1, 50.0, 35.0, distance_cm), Acuity(scale=1000.0), Gaze(1e30, -1e30))
        assert sizes.tolist() == [[1]]


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
