"""Eccentricity and cell size at the edge of reason: tiny angles, grazing views, eyes very near and very far."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderer.acuity import ECCENTRICITIES, Acuity, contrast_threshold, cut_off_cpd, unit_angle_deg
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.errors import SettingsError
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from tests.renderer.drawing import glass_and_mirror
from tests.renderer.viewing import (
    PAPER_SCREEN,
    acuities,
    displays,
    gazes,
    pixel_centres,
    point_of,
    sizes_at,
    true_cell_size,
    true_eccentricity,
)

SQUARE = dataclasses.replace(PAPER_SCREEN, height_cm=None)
"""The paper's screen with square pixels, so that the pixel angle along x is the pixel angle."""


def middle_row(distance_cm: float, gaze: Gaze | None = None) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
    """Eccentricity and cell size of the pixels right of the middle of the screen, gaze in the middle."""
    display = dataclasses.replace(SQUARE, distance_cm=distance_cm)
    middle = Gaze(960.0, 540.0)
    return eccentricity_deg(display, middle)[540, 960:], sizes_at(display, Acuity(), middle)[540, 960:]


@pytest.mark.parametrize("kind", ECCENTRICITIES)
@pytest.mark.parametrize("distance_cm", [60.0, 1e4])
def test_h55_every_pixel_agrees_with_longer_arithmetic(kind: str, distance_cm: float) -> None:
    display, gaze = dataclasses.replace(PAPER_SCREEN, distance_cm=distance_cm), Gaze(1000.0, 500.0)
    angles = eccentricity_deg(display, gaze, kind)
    assert angles.shape == (1080, 1920)
    assert angles.dtype == np.float64
    np.testing.assert_allclose(
        angles, true_eccentricity(display, gaze, kind, np.longdouble).astype(float), rtol=1e-12, atol=1e-13
    )


def test_h55_from_afar_no_two_pixels_of_a_row_look_alike() -> None:
    angles = eccentricity_deg(dataclasses.replace(PAPER_SCREEN, distance_cm=1e4), Gaze(1000.5, 500.5))[500, 1000:]
    np.testing.assert_allclose(np.diff(angles), 1.49e-4, rtol=2e-3)


@given(st.data())
def test_h55_any_view_agrees_with_longer_arithmetic(data: st.DataObject) -> None:
    display = data.draw(displays(60, 40))
    gaze = data.draw(gazes(display))
    for kind in ECCENTRICITIES:
        angles = eccentricity_deg(display, gaze, kind)
        assert angles.min() >= 0.0
        assert angles.max() <= 180.0
        np.testing.assert_allclose(
            angles, true_eccentricity(display, gaze, kind, np.longdouble).astype(float), rtol=1e-9, atol=1e-10
        )


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
def test_h56_reference_eccentricities(x: float, y: float, exact: float, paper: float) -> None:
    gaze = Gaze(1000.0, 500.0)
    assert eccentricity_deg(PAPER_SCREEN, gaze)[int(y), int(x)] == pytest.approx(exact, abs=1e-9)
    assert eccentricity_deg(PAPER_SCREEN, gaze, "paper")[int(y), int(x)] == pytest.approx(paper, abs=1e-9)


@pytest.mark.parametrize("kind", ECCENTRICITIES)
def test_h56_the_pixel_looked_at_is_at_zero_exactly(kind: str) -> None:
    angles = eccentricity_deg(PAPER_SCREEN, Gaze(1000.5, 500.5), kind)
    assert angles[500, 1000] == 0.0
    assert np.count_nonzero(angles) == angles.size - 1


def test_h56_the_pixel_beside_the_one_looked_at() -> None:
    assert eccentricity_deg(PAPER_SCREEN, Gaze(1000.5, 500.5))[500, 1001] == pytest.approx(0.0248544347, abs=1e-9)


def test_h56_pixels_per_degree_differ_along_and_across_where_pixels_are_not_square() -> None:
    angles = eccentricity_deg(Display(101, 101, 101 / 38.4, 101 / 30.857142857142858), Gaze(50.5, 50.5))
    assert 1 / angles[50, 51] == pytest.approx(40.2124, abs=1e-4)
    assert 1 / angles[51, 50] == pytest.approx(32.3135, abs=1e-4)


@given(displays(60, 40), st.integers(-4000, 4000), st.integers(-4000, 4000), acuities(st.just(0.5)))
def test_h56_mirrors_of_the_gaze_mirror_every_bit(display: Display, right: int, down: int, acuity: Acuity) -> None:
    width, height = display.width_px, display.height_px
    gaze = Gaze(right / 8, down / 8)
    mirrored = Gaze(width - gaze.x, height - gaze.y)
    kind = acuity.eccentricity
    angles, sizes = eccentricity_deg(display, gaze, kind), sizes_at(display, acuity, gaze)
    for other, turn in ((Gaze(mirrored.x, gaze.y), np.s_[:, ::-1]), (Gaze(gaze.x, mirrored.y), np.s_[::-1, :])):
        assert_array_equal(eccentricity_deg(display, other, kind), angles[turn])
        assert_array_equal(sizes_at(display, acuity, other), sizes[turn])


@pytest.mark.parametrize(
    ("distance_cm", "in_the_middle", "last"), [(0.1, 1, 1446), (1e-4, 1, 1920), (1e4, 77, 81), (1e8, 1920, 1920)]
)
def test_h58_from_very_near_and_very_far(distance_cm: float, in_the_middle: int, last: int) -> None:
    _, sizes = middle_row(distance_cm)
    assert sizes[0] == in_the_middle
    assert abs(int(sizes[-1]) - last) <= 1


def test_h59_at_the_edge_of_sight_cells_are_as_large_as_the_screen_not_one_pixel() -> None:
    for distance_cm, edge_deg in [(0.1, 89.770699), (1e-4, 89.999771)]:
        angles, sizes = middle_row(distance_cm)
        assert angles[-1] == pytest.approx(edge_deg, abs=1e-6)
        assert sizes[-1] >= 1446
    angles, sizes = middle_row(1e-8)
    assert angles[-1] == pytest.approx(90.0, abs=1e-6)
    assert (sizes[1:] == 1920).all()


@pytest.mark.parametrize("distance_cm", [1e-8, 1e-4, 0.1, 10.0, 60.0, 1e4, 1e8])
def test_h59_cells_never_shrink_away_from_the_gaze(distance_cm: float) -> None:
    angles, sizes = middle_row(distance_cm)
    assert (np.diff(angles) >= 0).all()
    assert (np.diff(sizes.astype(int)) >= 0).all()


def test_h60_where_a_pixel_is_more_than_the_eye_resolves_every_cell_is_one_pixel() -> None:
    display, gaze = Display(64, 64, 100.0, 100.0, 30.0), Gaze(32.0, 32.0)
    angle = eccentricity_deg(display, gaze)[63, 63]
    assert angle == pytest.approx(66.684, abs=1e-3)
    assert unit_angle_deg(angle) == pytest.approx(0.2597, abs=1e-4)
    assert (sizes_at(display, Acuity(), gaze) == 1).all()


def test_h60_where_the_eye_resolves_every_pixel_the_frame_is_the_full_one(renderer: Renderer) -> None:
    scene = prepare(glass_and_mirror())
    wide = Display(64, 64, width_cm=100, distance_cm=30)
    for antialiasing in ("stochastic", "regular"):
        asked = Quality(samples_per_cell=3, antialiasing=antialiasing)
        full, *others = (
            renderer.render(
                scene, FrameRequest(Gaze(32, 32), wide, None, dataclasses.replace(asked, map=tiling), linear=True)
            )
            for tiling in ("full", "aligned", "scanline")
        )
        for other in others:
            assert other.cost.cells == wide.pixels
            np.testing.assert_array_equal(other.pixels, full.pixels)


def test_h55_an_angle_from_its_cosine_would_be_blind() -> None:
    """Why angles come from atan2: beside the pixel looked at, acos of a dot product in float32 is off by a good part
    of a pixel (0.0249 degrees), ours by less than 1e-11.
    """
    gaze = Gaze(1000.0, 500.0)
    row = true_eccentricity(PAPER_SCREEN, gaze, "exact", np.longdouble)[500, 990:1010].astype(np.float64)
    x, y = (part[500, 990:1010] for part in pixel_centres(PAPER_SCREEN))
    sight = np.stack([x, y, np.full(20, 60.0)], axis=1).astype(np.float32)
    looked_at = np.array([*point_of(PAPER_SCREEN, gaze), 60.0]).astype(np.float32)
    cosines = sight @ looked_at / np.linalg.norm(sight, axis=1) / np.linalg.norm(looked_at)
    assert cosines.dtype == np.float32
    blind = np.degrees(np.arccos(np.minimum(cosines, 1).astype(np.float64)))
    assert np.abs(blind - row).max() > 0.005
    assert np.abs(eccentricity_deg(PAPER_SCREEN, gaze)[500, 990:1010] - row).max() < 1e-11


def test_h58_the_eye_at_0_and_90_degrees() -> None:
    assert cut_off_cpd(np.array([0.0, 90.0])) == pytest.approx([43.1, 1.4431775], rel=1e-7)
    assert unit_angle_deg(np.array([0.0, 90.0])) == pytest.approx([0.0116009, 0.3464577], abs=1e-7)


@pytest.mark.parametrize("distance_cm", [0.0, -1.0, math.nan, math.inf])
def test_h58_distances_that_are_none_are_refused(distance_cm: float) -> None:
    with pytest.raises(SettingsError, match=r"display\.distance_cm: expected a number in \(0, "):
        dataclasses.replace(PAPER_SCREEN, distance_cm=distance_cm)


@pytest.mark.parametrize("distance_cm", [1e-8, 1e-4, 0.1, 60.0, 1e4, 1e8])
def test_h59_the_angle_of_a_pixel_is_no_difference_of_angles(distance_cm: float) -> None:
    """From one arctangent of both its edges, against long double; at 1e-8 cm alpha / beta would be 1.45e10."""
    display = dataclasses.replace(SQUARE, distance_cm=distance_cm)
    truth = true_cell_size(display, Acuity(), Gaze(960.0, 540.0))[540, 960:]
    _, sizes = middle_row(distance_cm)
    clear = np.abs(truth - np.round(truth)) > 1e-6 * truth
    np.testing.assert_array_equal(sizes[clear], np.floor(truth[clear]).astype(int))
    assert sizes.min() >= 1
    assert sizes.max() <= 1920


def test_h59_other_models_at_0_and_90_degrees() -> None:
    assert cut_off_cpd(np.array([0.0, 90.0]), "geisler-perry") == pytest.approx([39.2347, 0.977681], rel=1e-5)
    assert contrast_threshold(60.0, 90.0, 1.0, 0.0461) == pytest.approx(math.exp(248.94), rel=1e-6)
    assert contrast_threshold(1e4, 180.0, 1.0) == math.inf
