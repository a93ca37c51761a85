"""What can go wrong by the user's doing, as one small tree.

RenderError
├── SettingsError   a display, gaze, camera or quality value that cannot be rendered
└── SceneError      a scene, mesh or texture that cannot be loaded
    └── UnknownScene    no scene has this id

A mistake of our own (a wrong shape, a wrong dtype) is a ValueError or an assertion instead.
"""

from __future__ import annotations

import math
import reprlib
from typing import Final, TypeVar

_T = TypeVar("_T")

_LONGEST: Final = 80
_SHORT_REPR: Final = reprlib.Repr()
_SHORT_REPR.maxlist = _SHORT_REPR.maxtuple = 16
_SHORT_REPR.maxlevel = 3
_SHORT_REPR.maxstring = _SHORT_REPR.maxlong = _SHORT_REPR.maxother = _LONGEST
_MOST_BITS: Final = 1000


class RenderError(Exception):
    """Input that cannot be rendered; the message is one line fit to show to its author."""


class SettingsError(RenderError):
    """A setting outside its range: `field` names it, as a dotted path."""

    def __init__(self, field: str, expected: str, found: object) -> None:
        super().__init__(f"{field}: expected {expected}, found {short(found)}")
        self.field = field
        self.expected = expected
        self.found = found


class SceneError(RenderError):
    """A scene that cannot be loaded; the message names the file and the field or line."""


class UnknownScene(SceneError):
    """No scene of the library has this id."""

    def __init__(self, scene_id: str, known: tuple[str, ...]) -> None:
        super().__init__(f"unknown scene {scene_id!r}: the scenes are {', '.join(known)}")
        self.scene_id = scene_id


def short(value: object) -> str:
    """`value` for a message, on one line of bounded length, however long or deeply nested it is."""
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        return f"an integer of {value.bit_length():,} bits"
    try:
        text = " ".join(_SHORT_REPR.repr(value).split())
    except ValueError:
        return f"a {type(value).__name__} of numbers too long to print"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def require_number(field: str, value: object, low: float, high: float, *, open_low: bool = False) -> float:
    """Return `value` as a float if it is a finite number in [low, high], or in (low, high].

    Raises:
        SettingsError: naming `field`, for anything else (NaN, infinity, text, None, out of range).
    """
    expected = f"a number in {'(' if open_low else '['}{low:g}, {high:g}]"
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SettingsError(field, expected, value)
    try:
        number = float(value)
    except OverflowError:
        raise SettingsError(field, expected, value) from None
    if not math.isfinite(number) or number > high or number < low or (open_low and number == low):
        raise SettingsError(field, expected, value)
    return number


def require_integer(field: str, value: object, low: int, high: int) -> int:
    """Return `value` if it is an integer in [low, high].

    Raises:
        SettingsError: naming `field`, for anything else.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SettingsError(field, f"an integer from {low} to {high}", value)
    return value


def require_choice(field: str, value: object, choices: tuple[str, ...]) -> str:
    """Return `value` if it is one of `choices`.

    Raises:
        SettingsError: naming `field`, for anything else.
    """
    if not isinstance(value, str) or value not in choices:
        raise SettingsError(field, "one of " + ", ".join(choices), value)
    return value


def require_point(field: str, value: object, limit: float) -> tuple[float, float, float]:
    """Return `value` as three finite floats, each at most `limit` in magnitude.

    Raises:
        SettingsError: naming `field`, for anything else.
    """
    if not isinstance(value, tuple | list) or len(value) != 3:
        raise SettingsError(field, "three numbers", value)
    x, y, z = (require_number(f"{field}.{axis}", part, -limit, limit) for axis, part in zip("xyz", value, strict=True))
    return x, y, z


def require_rgb(field: str, value: object, high: float) -> tuple[float, float, float]:
    """Return `value` as red, green and blue, each a finite float from 0 to `high`.

    Raises:
        SettingsError: naming `field` and the channel, for anything else.
    """
    if not isinstance(value, tuple | list) or len(value) != 3:
        raise SettingsError(field, "three numbers: red, green, blue", value)
    channels = zip(("red", "green", "blue"), value, strict=True)
    red, green, blue = (require_number(f"{field}.{channel}", part, 0.0, high) for channel, part in channels)
    return red, green, blue


def require_flag(field: str, value: object) -> bool:
    """Return `value` if it is true or false.

    Raises:
        SettingsError: naming `field`, for anything else.
    """
    if not isinstance(value, bool):
        raise SettingsError(field, "true or false", value)
    return value


def require_kind(field: str, value: object, *kinds: type[_T]) -> _T:
    """Return `value` if it is of one of the types `kinds`.

    Raises:
        SettingsError: naming `field`, for anything else.
    """
    if not isinstance(value, kinds):
        raise SettingsError(field, " or ".join(kind.__name__ for kind in kinds), value)
    return value


def require_all(field: str, values: object, *kinds: type[_T]) -> tuple[_T, ...]:
    """Return `values` as a tuple if it is a list of nothing but the types `kinds`.

    Raises:
        SettingsError: naming `field` and the place in the list, for anything else.
    """
    if not isinstance(values, tuple | list):
        raise SettingsError(field, "a list", values)
    return tuple(require_kind(f"{field}[{index}]", value, *kinds) for index, value in enumerate(values))
