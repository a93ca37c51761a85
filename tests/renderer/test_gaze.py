"""Gaze points and their buckets."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from renderer.gaze import Gaze, GazeBucket, bucket_of

COORDINATES = st.floats(-1e30, 1e30)
SIDES = st.integers(1, 512)


@given(COORDINATES, COORDINATES)
def test_bucket_0_is_the_gaze_itself(x: float, y: float) -> None:
    assert bucket_of(Gaze(x, y), 0) == GazeBucket(x, y, 0)
