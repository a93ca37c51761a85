"""The error tree, and the checks that raise its errors: one line that names the field, what was expected and found."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.errors import (
    RenderError,
    SceneError,
    SettingsError,
    UnknownScene,
    require_choice,
    require_integer,
    require_number,
    require_point,
)

ANYTHING = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text()
    | st.binary()
    | st.lists(st.floats(), max_size=4)
)


def test_everything_the_user_can_do_wrong_is_a_render_error() -> None:
    assert issubclass(SettingsError, RenderError)
    assert issubclass(SceneError, RenderError)
    assert issubclass(UnknownScene, SceneError)
    assert not issubclass(SettingsError, SceneError)
    assert not issubclass(RenderError, ValueError)


def test_a_settings_error_names_field_expectation_and_finding() -> None:
    error = SettingsError("gaze.x", "a number", "left")
    assert str(error) == "gaze.x: expected a number, found 'left'"
    assert (error.field, error.expected, error.found) == ("gaze.x", "a number", "left")


def test_an_unknown_scene_lists_the_known_ones() -> None:
    error = UnknownScene("sphere", ("cornell", "spheres"))
    assert str(error) == "unknown scene 'sphere': the scenes are cornell, spheres"
    assert error.scene_id == "sphere"


def test_the_message_stays_one_line_whatever_was_found() -> None:
    with pytest.raises(SettingsError) as refused:
        require_choice("map", "a\nb\r\u2028c", ("full",))
    assert len(str(refused.value).splitlines()) == 1


def test_numbers_become_floats() -> None:
    number = require_number("n", 3, 0, 10)
    assert number == 3.0
    assert type(number) is float
    assert require_number("n", 10, 0, 10) == 10.0
    assert require_number("n", -0.0, 0, 10) == 0.0


def test_the_lower_end_can_be_left_out() -> None:
    assert require_number("n", 0, 0, 1) == 0.0
    assert require_number("n", 5e-324, 0, 1, open_low=True) == 5e-324
    with pytest.raises(SettingsError, match=r"n: expected a number in \(0, 1\], found 0"):
        require_number("n", 0, 0, 1, open_low=True)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.5, -0.5, 10**400, True, None, "1", [1], 1j])
def test_what_is_no_number_in_the_range(value: object) -> None:
    with pytest.raises(SettingsError, match=r"^n: expected a number in \[0, 1\], found"):
        require_number("n", value, 0, 1)


@pytest.mark.parametrize("value", [0, 11, 5.0, math.nan, True, None, "5", 10**400])
def test_what_is_no_integer_in_the_range(value: object) -> None:
    with pytest.raises(SettingsError, match=r"^n: expected an integer from 1 to 10, found"):
        require_integer("n", value, 1, 10)


def test_integers_and_choices_pass_unchanged() -> None:
    assert [require_integer("n", value, 1, 10) for value in (1, 10)] == [1, 10]
    assert require_choice("n", "full", ("aligned", "full")) == "full"


@pytest.mark.parametrize("value", ["ful", "", "FULL", None, 1, ["full"], {}])
def test_what_is_no_choice(value: object) -> None:
    with pytest.raises(SettingsError, match=r"^n: expected one of aligned, full, found"):
        require_choice("n", value, ("aligned", "full"))


def test_points_are_three_finite_numbers() -> None:
    assert require_point("p", [1, -2.5, 1e9], 1e9) == (1.0, -2.5, 1e9)
    assert require_point("p", (0, 0, 0), 1.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("value", "field"),
    [
        ([1.0, 2.0], "p"),
        ([1, 2, 3, 4], "p"),
        ("123", "p"),
        (None, "p"),
        ({"x": 1, "y": 2, "z": 3}, "p"),
        ([math.nan, 0, 0], "p.x"),
        ([0, 101, 0], "p.y"),
        ([0, 0, "0"], "p.z"),
    ],
)
def test_what_is_no_point(value: object, field: str) -> None:
    with pytest.raises(SettingsError) as refused:
        require_point("p", value, 100.0)
    assert refused.value.field == field


@given(ANYTHING)
def test_anything_either_passes_or_is_a_settings_error_of_one_line(value: object) -> None:
    refusals: list[SettingsError] = []
    for check in (
        lambda: require_number("n", value, -1e30, 1e30),
        lambda: require_integer("n", value, -5, 5),
        lambda: require_choice("n", value, ("a",)),
        lambda: require_point("n", value, 1e30),
    ):
        try:
            check()
        except SettingsError as error:
            refusals.append(error)
    assert all(error.field.startswith("n") for error in refusals)
    assert all(len(str(error).splitlines()) == 1 for error in refusals)
