"""Gaze points and their buckets."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from renderer.errors import SettingsError
from renderer.gaze import Gaze, GazeBucket, bucket_of

COORDINATES = st.floats(-1e30, 1e30)
SIDES = st.integers(1, 512)


@pytest.mark.parametrize(
    ("x", "y"), [(-5000, 540), (1e9, 1e9), (0, 0), (1920, 1080), (1919.5, 1079.5), (1e30, -1e30), (-0.0, 5e-324)]
)
def test_the_gaze_may_lie_off_the_screen(x: float, y: float) -> None:
    assert (Gaze(x, y).x, Gaze(x, y).y) == (x, y)


@pytest.mark.parametrize("field", ["x", "y"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.1e30, 10**400, None, "960", True, [1.0]])
def test_a_gaze_that_is_not_two_finite_numbers_is_refused(field: str, value: object) -> None:
    with pytest.raises(SettingsError) as refused:
        Gaze(**({"x": 1.0, "y": 2.0} | {field: value}))  # type: ignore[arg-type]
    assert refused.value.field == f"gaze.{field}"


def test_buckets_are_half_open() -> None:
    for border, bucket in [(8.0, 1), (24.0, 2), (40.0, 3), (-8.0, 0), (-24.0, -1)]:
        below, above = math.nextafter(border, -math.inf), math.nextafter(border, math.inf)
        assert bucket_of(Gaze(border, border), 16) == GazeBucket(16 * bucket, 16 * bucket, 16)
        assert bucket_of(Gaze(above, below), 16) == GazeBucket(16 * bucket, 16 * (bucket - 1), 16)


@given(COORDINATES, COORDINATES, SIDES)
@example(0.49999999999999994, 1.5, 1)
@example(-1e-20, 1e16 - 2, 3)
def test_every_gaze_lies_in_its_bucket_exactly(x: float, y: float, side: int) -> None:
    bucket = bucket_of(Gaze(x, y), side)
    assert bucket.side_px == side
    for centre, coordinate in ((bucket.x, x), (bucket.y, y)):
        assert centre % side == 0
        assert -Fraction(side, 2) <= Fraction(coordinate) - Fraction(centre) < Fraction(side, 2)


@given(st.integers(-4000, 4000), SIDES, st.floats(-0.5, 0.5, exclude_max=True), st.floats(-0.5, 0.5, exclude_max=True))
def test_two_gazes_of_a_square_share_its_bucket(number: int, side: int, right: float, down: float) -> None:
    centre = number * side
    gaze = Gaze(centre + right * side, centre + down * side)
    if gaze.x - centre < side / 2 and gaze.y - centre < side / 2:
        assert bucket_of(gaze, side) == bucket_of(Gaze(centre, centre), side) == GazeBucket(centre, centre, side)


@given(COORDINATES, COORDINATES)
def test_bucket_0_is_the_gaze_itself(x: float, y: float) -> None:
    assert bucket_of(Gaze(x, y), 0) == GazeBucket(x, y, 0)
