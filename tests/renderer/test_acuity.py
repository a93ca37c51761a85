"""Equations 1 to 3 and the other acuity models, against closed forms worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.acuity import ECCENTRICITIES, MODELS, Acuity, contrast_threshold, cut_off_cpd, unit_angle_deg
from renderer.errors import SettingsError


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


@given(st.floats(0, 180), st.sampled_from(MODELS))
def test_the_unit_angle_is_half_a_cycle_at_the_cut_off(eccentricity_deg: float, model: str) -> None:
    assert unit_angle_deg(eccentricity_deg, model) * cut_off_cpd(eccentricity_deg, model) == pytest.approx(
        0.5, rel=1e-14
    )


@pytest.mark.parametrize("model", MODELS)
def test_detail_is_lost_steadily_away_from_the_gaze(model: str) -> None:
    angles = np.linspace(0, 180, 1801)
    assert (np.diff(cut_off_cpd(angles, model)) < 0).all()
    np.testing.assert_allclose(np.diff(unit_angle_deg(angles, model), 2), 0, atol=1e-14)


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
    with pytest.raises(SettingsError, match="one of peli, geisler-perry, guenter, found 'barten'"):
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
