"""Equations 1 to 3 and the other acuity models, against closed forms and published values."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.acuity import (
    ACUITY_MODELS,
    ECCENTRICITIES,
    MODELS,
    Acuity,
    contrast_threshold,
    cut_off_cpd,
    unit_angle_deg,
)
from renderer.acuity_model import STEPS_PER_DEG, unit_angle_table
from renderer.errors import SettingsError
from renderer.stela_csf import LAST_ECCENTRICITY_DEG, LIMIT_CPD, seen_up_to_cpd, sensitivity
from renderer.watson import MERIDIANS, midget_cut_off_cpd, midget_density
from tests.renderer.viewing import CUT_OFF_CPD


@pytest.mark.parametrize(
    ("model", "eccentricity_deg", "cpd"),
    [
        ("peli", 0.0, 43.1),
        ("peli", 3.118, 43.1 / 2),
        ("peli", 90.0, 1.4431775),
        ("geisler-perry", 0.0, 39.2347),
        ("geisler-perry", 2.3, 39.2347 / 2),
        ("geisler-perry", 90.0, 0.977681),
        ("guenter", 0.0, 24.0),
        ("guenter", 60 / (48 * 1.32), 12.0),
        ("guenter", 10.0, 0.5 / (1 / 48 + 10 * 1.32 / 60)),
        ("watson", 0.0, 65.3737),
        ("stelacsf", 0.0, 64.0),
        ("stelacsf", 1.0, 64.0),
    ],
)
def test_cut_off_frequencies_as_published(model: str, eccentricity_deg: float, cpd: float) -> None:
    assert cut_off_cpd(eccentricity_deg, model) == pytest.approx(cpd, rel=2e-6)


def test_the_papers_cut_off_is_the_default() -> None:
    angles = np.linspace(0, 180, 37).reshape(1, 37)
    np.testing.assert_allclose(cut_off_cpd(angles), 43.1 * 3.118 / (3.118 + angles), rtol=1e-14)
    assert cut_off_cpd(angles).shape == (1, 37)


def test_the_unit_angle_at_the_fovea_and_at_the_edge_of_the_field() -> None:
    np.testing.assert_allclose(unit_angle_deg([0.0, 90.0]), [0.0116009, 0.3464577], rtol=5e-6)


@pytest.mark.parametrize("model", MODELS)
def test_every_model_agrees_with_a_second_way_to_compute_it(model: str) -> None:
    angles = np.linspace(0, 180, 3601)
    np.testing.assert_allclose(cut_off_cpd(angles, model), CUT_OFF_CPD[model](angles), rtol=2e-8)


@given(st.floats(0, 180), st.sampled_from(MODELS))
def test_the_unit_angle_is_half_a_cycle_at_the_cut_off(eccentricity_deg: float, model: str) -> None:
    assert unit_angle_deg(eccentricity_deg, model) * cut_off_cpd(eccentricity_deg, model) == pytest.approx(
        0.5, rel=1e-14
    )


@pytest.mark.parametrize("model", MODELS)
def test_no_model_sees_finer_farther_from_the_gaze(model: str) -> None:
    angles = np.linspace(0, 180, 18_001)
    falls = np.diff(cut_off_cpd(angles, model))
    assert (falls <= 0).all()
    valid, limited = angles[1:] <= ACUITY_MODELS[model].valid_deg, cut_off_cpd(angles[1:], model) == 64.0
    assert (falls[valid & ~limited] < 0).all()


@pytest.mark.parametrize("model", ["peli", "geisler-perry", "guenter"])
def test_three_models_are_lines(model: str) -> None:
    floor_deg, slope = ACUITY_MODELS[model].line or (math.nan, math.nan)
    angles = np.linspace(0, 180, 37)
    np.testing.assert_allclose(unit_angle_deg(angles, model), floor_deg + slope * angles, rtol=1e-14)


@pytest.mark.parametrize("model", MODELS)
def test_a_model_says_where_it_comes_from_and_how_far_it_holds(model: str) -> None:
    declared = ACUITY_MODELS[model]
    assert declared.name == model
    assert re.search(r"(19|20)\d\d", declared.source)
    assert 20 <= declared.valid_deg <= 180
    assert cut_off_cpd(0.0, model) == pytest.approx(declared.limit_cpd, rel=1e-12)


@pytest.mark.parametrize("model", ["watson", "stelacsf"])
def test_a_table_is_as_good_as_the_formula(model: str) -> None:
    declared = ACUITY_MODELS[model]
    table = unit_angle_table(declared)
    assert table.shape == (180 * STEPS_PER_DEG + 1,)
    assert (np.diff(table) >= 0).all()
    angles = np.random.default_rng(5).uniform(0, 180, 100_000)
    between = np.interp(angles, np.arange(len(table)) / STEPS_PER_DEG, table)
    ratio = np.maximum(between, 0.5 / declared.limit_cpd) / unit_angle_deg(angles, model)
    assert ratio.max() < 1 + 1e-6
    assert ratio.min() > 1 - 2e-6


# Watson's retina


def test_the_fovea_as_watson_prints_it() -> None:
    for meridian in MERIDIANS:
        assert midget_density(0.0, meridian) == pytest.approx(29609.2, abs=0.1)
        spacing_arcmin = 60 / (math.sqrt(3) * midget_cut_off_cpd(0.0, meridian))
        assert spacing_arcmin == pytest.approx(0.5299, abs=5e-5)


def test_both_terms_of_the_density_have_the_foveal_factor() -> None:
    ganglion_cells = midget_density(10.0, "temporal") * 1.12 * (1 + 10 / 41.03)
    assert ganglion_cells == pytest.approx(613, abs=1)


@pytest.mark.parametrize(
    ("meridian", "cpd"),
    [("temporal", [65.4, 23.1, 12.6, 8.0, 4.9, 3.5]), ("inferior", [65.4, 21.5, 10.7, 5.8, 2.9, 1.8])],
)
def test_cut_offs_along_a_meridian(meridian: str, cpd: list[float]) -> None:
    np.testing.assert_allclose(midget_cut_off_cpd([0, 2, 5, 10, 20, 30], meridian), cpd, atol=0.06)


def test_far_out_the_temporal_side_of_the_visual_field_sees_most_as_the_nasal_retina_has_more_cells() -> None:
    for angle in (10.0, 20.0, 40.0):
        temporal = midget_cut_off_cpd(angle, "temporal")
        assert all(temporal > midget_cut_off_cpd(angle, other) for other in ("nasal", "superior", "inferior"))


def test_the_finest_meridian_is_taken_since_two_eyes_look() -> None:
    angles = np.linspace(0, 90, 91)
    for meridian in MERIDIANS:
        assert (cut_off_cpd(angles, "watson") >= midget_cut_off_cpd(angles, meridian)).all()
    assert cut_off_cpd(5.0, "watson") == midget_cut_off_cpd(5.0, "nasal")
    assert cut_off_cpd(20.0, "watson") == midget_cut_off_cpd(20.0, "temporal")


# stelaCSF


@pytest.mark.parametrize(
    ("side", "luminance_cd_m2", "cpd"),
    [
        ("temporal", 100.0, [64, 43.3, 20.1, 10.2, 4.4, 2.1]),
        ("nasal", 100.0, [64, 49.4, 23.7, 12.6, 6.0, 3.6]),
        ("temporal", 10.0, [64, 37.7, 17.9, 9.2, 3.9, 1.8]),
    ],
)
def test_frequencies_seen_at_full_contrast(side: str, luminance_cd_m2: float, cpd: list[float]) -> None:
    angles = np.array([0.0, 2.0, 5.0, 10.0, 20.0, 30.0])
    found = np.minimum(LIMIT_CPD, seen_up_to_cpd(angles, side, luminance_cd_m2))
    np.testing.assert_allclose(found, cpd, atol=0.06)
    beyond = found < LIMIT_CPD
    np.testing.assert_allclose(sensitivity(found, angles, side, luminance_cd_m2)[beyond], 1, rtol=1e-12)


def test_the_side_that_sees_more_is_taken() -> None:
    angles = np.linspace(0, LAST_ECCENTRICITY_DEG, 121)
    nasal = cut_off_cpd(angles, "stelacsf")
    np.testing.assert_array_equal(nasal, np.minimum(LIMIT_CPD, seen_up_to_cpd(angles, "nasal")))
    near = angles <= 30
    assert (nasal >= np.minimum(LIMIT_CPD, seen_up_to_cpd(angles, "temporal")))[near].all()


def test_where_nothing_is_seen_any_more_cells_grow_no_further() -> None:
    assert sensitivity(np.geomspace(1 / 16, 64, 1000), 68.0, "nasal").max() < 1
    last = cut_off_cpd(LAST_ECCENTRICITY_DEG, "stelacsf")
    assert last == pytest.approx(0.880, abs=1e-3)
    np.testing.assert_array_equal(cut_off_cpd([61.0, 90.0, 180.0], "stelacsf"), last)


def test_the_display_limits_the_cut_off_but_not_the_unit_angle() -> None:
    np.testing.assert_allclose(cut_off_cpd([0.0, 3.118, 90.0], display_cpd=20.0), [20.0, 20.0, 1.4431775], rtol=1e-6)
    assert cut_off_cpd(0.0, "guenter", display_cpd=30.0) == pytest.approx(24.0)
    assert unit_angle_deg(0.0) == pytest.approx(1 / 86.2)


def test_a_contrast_threshold_grows_with_frequency_times_eccentricity() -> None:
    assert contrast_threshold(0.0, 50.0, 0.01) == 0.01
    assert contrast_threshold(8.0, 0.0, 0.01) == 0.01
    assert contrast_threshold(4.0, 5.0, 0.01) == pytest.approx(0.01 * math.exp(0.6), rel=1e-14)
    assert contrast_threshold(4.0, 5.0, 0.01, k=0.057) == pytest.approx(0.01 * math.exp(1.14), rel=1e-14)
    assert contrast_threshold(1 / 0.03, 1.0, 1.0) == pytest.approx(math.e, rel=1e-14)


def test_a_contrast_threshold_takes_arrays_and_survives_the_end_of_the_scale() -> None:
    thresholds = contrast_threshold(np.array([[1.0], [60.0]]), np.array([0.0, 90.0, 1000.0]), 0.01, k=0.0461)
    assert thresholds.shape == (2, 3)
    assert thresholds.dtype == np.float64
    assert thresholds[1, 1] == pytest.approx(0.01 * math.exp(248.94), rel=1e-12)
    assert thresholds[1, 2] == math.inf
    assert contrast_threshold([], [], []).shape == (0,)


@pytest.mark.parametrize("formula", [cut_off_cpd, unit_angle_deg])
def test_an_unknown_model_is_refused(formula) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(SettingsError, match="one of peli, geisler-perry, guenter, watson, stelacsf, found 'barten'"):
        formula(1.0, "barten")


@pytest.mark.parametrize(
    ("field", "bad"),
    [
        ("model", ["Peli", "", None, 3]),
        ("eccentricity", ["Exact", "", None, True]),
        ("scale", [0, 9.9e-4, 1000.1, -1, math.nan, math.inf, "1", None]),
        ("margin_deg", [-1e-9, 90.1, math.nan, math.inf, "0", None]),
    ],
)
def test_a_bad_acuity_setting_is_named(field: str, bad: list[object]) -> None:
    for value in bad:
        with pytest.raises(SettingsError) as refused:
            Acuity(**{field: value})  # type: ignore[arg-type]
        assert refused.value.field == f"quality.acuity.{field}"
        assert refused.value.found is value


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("eccentricity", ECCENTRICITIES)
def test_every_choice_and_both_ends_of_each_range_are_accepted(model: str, eccentricity: str) -> None:
    for scale, margin_deg in [(0.001, 0.0), (1000.0, 90.0)]:
        acuity = Acuity(model, eccentricity, scale, margin_deg)
        assert (acuity.model, acuity.eccentricity) == (model, eccentricity)
