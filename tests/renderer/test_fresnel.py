"""Fresnel and Snell at the values that the equations give."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.fresnel import fresnel, refracted_cosine

GLASS = 1.5


def share_and_angle(incidence_deg: float, eta: float) -> tuple[float, float]:
    """Share reflected, and the angle of refraction in degrees."""
    cosine = math.cos(math.radians(incidence_deg))
    refracted = refracted_cosine(cosine, eta)
    return fresnel(cosine, refracted, eta), math.degrees(math.acos(min(1.0, refracted)))


@pytest.mark.parametrize(
    ("incidence", "eta", "share", "angle"),
    [
        (0.0, 1 / GLASS, 0.04, 0.0),
        (45.0, 1 / GLASS, 0.0502399110122359, 28.1255057020557),
        (56.3099324740, 1 / GLASS, 25 / 338, 33.6900675260),
        (80.0, 1 / GLASS, 0.387704354691473, 41.0364105252033),
        (85.0, 1 / GLASS, 0.612799645264828, 41.6156005121),
        (10.0, GLASS, 0.0400829591550701, 15.0980866052),
        (30.0, GLASS, 0.0551901672953759, 48.5903778907),
    ],
)
def test_h27_exact_values(incidence: float, eta: float, share: float, angle: float) -> None:
    found_share, found_angle = share_and_angle(incidence, eta)
    assert found_share == pytest.approx(share, abs=1e-12)
    assert found_angle == pytest.approx(angle, abs=1e-6)
    assert math.sin(math.radians(incidence)) * eta == pytest.approx(math.sin(math.radians(found_angle)), abs=1e-12)


@given(st.floats(1e-3, 1.0), st.floats(0.1, 10.0))
def test_h27_the_reverse_ray_is_reflected_alike(cosine: float, eta: float) -> None:
    refracted = refracted_cosine(cosine, eta)
    if refracted > 1e-3:
        assert refracted_cosine(refracted, 1 / eta) == pytest.approx(cosine, abs=1e-9)
        assert fresnel(refracted, cosine, 1 / eta) == pytest.approx(fresnel(cosine, refracted, eta), abs=1e-9)


@pytest.mark.parametrize(
    ("index", "share", "tolerance"),
    [(1.33, 0.0200593122, 1e-9), (2.42, 0.1723949249, 1e-9), (1.0003, 2.2493e-8, 1e-11), (1e6, 0.999996, 1e-9)],
)
def test_h28_other_indices_at_normal_incidence(index: float, share: float, tolerance: float) -> None:
    assert fresnel(1.0, refracted_cosine(1.0, 1 / index), 1 / index) == pytest.approx(share, abs=tolerance)
    assert fresnel(1.0, refracted_cosine(1.0, index), index) == pytest.approx(share, abs=tolerance)


@pytest.mark.parametrize("eta", [1 / GLASS, GLASS])
def test_h28_limits(eta: float) -> None:
    for cosine in (1.0, 1.0 + 2.0**-23):
        assert fresnel(cosine, refracted_cosine(cosine, eta), eta) == pytest.approx(0.04, abs=1e-15)
    for cosine in (0.0, -0.0, 1e-8):
        assert fresnel(cosine, refracted_cosine(cosine, eta), eta) == pytest.approx(1.0, abs=1e-6)


def test_h28_a_share_is_a_share() -> None:
    rng = np.random.default_rng(28)
    for cosine, eta in zip(rng.uniform(-1e-7, 1 + 1e-7, 20_000), 10 ** rng.uniform(-1, 1, 20_000), strict=True):
        assert 0.0 <= fresnel(cosine, refracted_cosine(cosine, eta), eta) <= 1.0


@pytest.mark.parametrize(
    ("eta", "critical"), [(1.5, 41.810314895779), (1.33, 48.753466631327), (1.5 / 1.33, 62.457324845541)]
)
def test_h29_total_reflection_begins_at_the_critical_angle(eta: float, critical: float) -> None:
    for beyond in (0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3):
        for sign in (-1, 1):
            cosine = math.cos(math.radians(critical) + sign * beyond)
            refracted = refracted_cosine(cosine, eta)
            share = fresnel(cosine, refracted, eta)
            assert math.isfinite(share)
            assert math.isfinite(refracted)
            if beyond >= 1e-5:
                assert (share == 1.0) == (sign > 0)
                assert (refracted <= 0.0) == (sign > 0)


def test_h29_just_below_the_critical_angle() -> None:
    assert share_and_angle(41.80, GLASS)[0] == pytest.approx(0.890772, abs=1e-6)
    assert share_and_angle(41.81, GLASS)[0] == pytest.approx(0.979855, abs=1e-6)


@given(st.floats(0.0, 1.0))
def test_h30_the_same_index_on_both_sides_changes_nothing(cosine: float) -> None:
    refracted = refracted_cosine(cosine, 1.0)
    assert refracted <= 0.0 or fresnel(cosine, refracted, 1.0) == 0.0
    assert max(0.0, refracted) == pytest.approx(cosine, abs=5e-7)
