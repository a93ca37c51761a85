"""The display's derived lengths, and what is no display."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.display import MAX_SIDE_PX, Display
from renderer.errors import SettingsError

LENGTHS = ("width_cm", "height_cm", "distance_cm")


def test_a_pixel_of_the_papers_screen_is_narrower_than_high() -> None:
    display = Display(1920, 1080, 50.0, 35.0, 60.0)
    assert display.pitch_x_cm == pytest.approx(50 / 1920, rel=1e-15)
    assert display.pitch_y_cm == pytest.approx(35 / 1080, rel=1e-15)
    assert 1 / math.degrees(math.atan(display.pitch_x_cm / 60)) == pytest.approx(40.2124, abs=1e-4)
    assert 1 / math.degrees(math.atan(display.pitch_y_cm / 60)) == pytest.approx(32.3135, abs=1e-4)
    assert display.aspect == pytest.approx(50 / 35, rel=1e-15)
    assert display.pixels == 2_073_600


@given(st.integers(1, MAX_SIDE_PX), st.integers(1, MAX_SIDE_PX), st.floats(1e-3, 1e3))
def test_pixels_are_square_unless_a_height_is_given(width: int, height: int, width_cm: float) -> None:
    display = Display(width, height, width_cm)
    assert display.pitch_y_cm == display.pitch_x_cm
    assert display.aspect == pytest.approx(width / height, rel=1e-14)


def test_one_pixel_is_a_display() -> None:
    display = Display(1, 1, 0.03, 0.04, 1.0)
    assert (display.pitch_x_cm, display.pitch_y_cm, display.pixels) == (0.03, 0.04, 1)


@pytest.mark.parametrize("field", ["width_px", "height_px"])
@pytest.mark.parametrize("value", [0, -1, 32_769, 1.0, math.nan, "1920", None, True])
def test_a_size_in_pixels_is_an_integer_from_1_to_32768(field: str, value: object) -> None:
    with pytest.raises(SettingsError, match="an integer from 1 to 32768") as refused:
        Display(**{field: value})  # type: ignore[arg-type]
    assert refused.value.field == f"display.{field}"


@pytest.mark.parametrize("field", LENGTHS)
@pytest.mark.parametrize("value", [0, -0.0, -1, math.nan, math.inf, -math.inf, 1.1e9, 10**400, "50", True])
def test_a_length_is_positive_and_finite(field: str, value: object) -> None:
    with pytest.raises(SettingsError, match=r"expected a number in \(0, 1e\+09\]") as refused:
        Display(**{field: value})  # type: ignore[arg-type]
    assert refused.value.field == f"display.{field}"


@pytest.mark.parametrize("field", ["width_cm", "distance_cm"])
def test_only_the_height_may_be_left_open(field: str) -> None:
    with pytest.raises(SettingsError, match=field):
        Display(**{field: None})  # type: ignore[arg-type]
    assert Display(height_cm=None).height_cm is None


@pytest.mark.parametrize("field", ["width_cm", "height_cm"])
@pytest.mark.parametrize("value", [5e-324, 1e-160, 1e-11])
def test_pixels_too_small_to_square_are_refused(field: str, value: float) -> None:
    with pytest.raises(SettingsError, match="at least 1e-12 cm a pixel") as refused:
        Display(**{field: value})  # type: ignore[arg-type]
    assert refused.value.field == f"display.{field}"


@pytest.mark.parametrize("distance_cm", [5e-324, 1e-8, 1e9])
def test_any_distance_but_none_is_allowed(distance_cm: float) -> None:
    assert Display(distance_cm=distance_cm).distance_cm == distance_cm
