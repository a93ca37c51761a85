"""Frozen dataclasses to JSON and back, every value checked against its field's type; standard library only.

A field may be a bool, an int, a finite float, a str, a Literal, an optional one, a tuple of one kind, a record, or
a Mapping for an object that others check; `Annotated` adds bounds (`Between`, `Length`, a compiled pattern).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache
from types import NoneType
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

LONGEST_FOUND = 80
"""Characters of an offending value that a message repeats."""


class ProtocolError(Exception):
    """A message that the wire does not allow: `field` names the place, `message` what was expected and found."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field
        self.message = message


class Between(NamedTuple):
    """Bounds of a number, both included."""

    low: float
    high: float

    def allows(self, value: Any) -> bool:
        """Whether `value` lies within them."""
        return bool(self.low <= value <= self.high)

    def __str__(self) -> str:
        return f"a number from {self.low:g} to {self.high:g}"


class Length(NamedTuple):
    """Most characters of a text, or items of a list."""

    most: int

    def allows(self, value: Any) -> bool:
        """Whether `value` is as short."""
        return len(value) <= self.most

    def __str__(self) -> str:
        return f"a length of at most {self.most}"


class Matching(NamedTuple):
    """A regular expression for the whole of a text."""

    pattern: str

    def allows(self, value: Any) -> bool:
        """Whether `value` matches."""
        return re.fullmatch(self.pattern, value) is not None

    def __str__(self) -> str:
        return f"what matches {self.pattern}"


class Record:
    """What a dataclass inherits to check its own fields: what could not be read cannot be made, nor sent.

    Raises:
        ProtocolError: when it is made, naming the field.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, (hint, _) in fields_of(kind).items():
            _read(hint, getattr(self, name), name)


def load(text: str, place: str) -> dict[str, Any]:
    """The JSON object in `text`.

    Raises:
        ProtocolError: naming `place`, for anything else, NaN and a field that is there twice included.
    """
    try:
        values = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_object)
    except RecursionError:
        raise ProtocolError(place, "expected JSON, found one nested too deeply") from None
    except ValueError as error:
        raise ProtocolError(place, f"expected JSON: {str(error)[:LONGEST_FOUND]}") from None
    if not isinstance(values, dict):
        raise ProtocolError(place, f"expected a JSON object, found {shown(values)}")
    return values


def dump(values: Mapping[str, Any]) -> str:
    """JSON without spaces.

    Raises:
        ProtocolError: for a value that JSON cannot hold.
    """
    try:
        return json.dumps(values, allow_nan=False, separators=(",", ":"))
    except (ValueError, TypeError, RecursionError) as error:
        raise ProtocolError("message", f"expected values of JSON: {error}") from None


def build(kind: Any, values: Mapping[str, Any], place: str = "", *, strict: bool) -> Any:
    """A record of class `kind` from the fields of a JSON object.

    Args:
        kind: a dataclass that is a `Record`.
        values: the object.
        place: what stands before a field's name in a message.
        strict: False to ignore fields that there are not.

    Raises:
        ProtocolError: naming the field.
    """
    described = fields_of(kind)
    if strict and (unknown := values.keys() - described.keys()):
        raise ProtocolError(place + min(unknown), f"there is no such field; there are {', '.join(described) or 'none'}")
    read = {}
    for name, (hint, required) in described.items():
        if name in values:
            read[name] = _read(hint, values[name], place + name, strict)
        elif required:
            raise ProtocolError(place + name, "is required")
    try:
        return kind(**read)
    except ProtocolError as error:
        raise ProtocolError(place + error.field, error.message) from None


def plain(record: Any) -> dict[str, Any]:
    """A record as a JSON object, every field in it."""
    return {name: _plain(getattr(record, name)) for name in fields_of(record.__class__)}


def shown(value: object) -> str:
    """A value as a message repeats it: short, printable."""
    text = "null" if value is None else ascii(value)
    return text if len(text) <= LONGEST_FOUND else text[: LONGEST_FOUND - 3] + "..."


@cache
def fields_of(kind: Any) -> dict[str, tuple[Any, bool]]:
    """Name, type and whether it is required, of each field of a dataclass."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: (hints[field.name], field.default is MISSING) for field in fields(kind)}


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) != len(pairs):
        raise ValueError("a field is there twice")
    return values


def _plain(value: Any) -> Any:
    if isinstance(value, Record):
        return plain(value)
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return dict(value) if isinstance(value, Mapping) else value


def _read(hint: Any, value: Any, place: str, strict: bool = True) -> Any:
    """`value` as the type `hint` says.

    Raises:
        ProtocolError: naming `place`.
    """
    origin = get_origin(hint)
    if NoneType in get_args(hint):
        (wanted,) = (kind for kind in get_args(hint) if kind is not NoneType)
        return None if value is None else _read(wanted, value, place, strict)
    if origin is Annotated:
        base, bound = get_args(hint)
        value = _read(base, value, place, strict)
        if not bound.allows(value):
            raise ProtocolError(place, f"expected {bound}, found {shown(value)}")
        return value
    if origin is tuple and isinstance(value, list | tuple):
        return tuple(_read(get_args(hint)[0], item, f"{place}[{i}]", strict) for i, item in enumerate(value))
    if isinstance(value, Mapping) and isinstance(hint, type) and issubclass(hint, Record):
        return build(hint, value, place + ".", strict=strict)
    if not _is(hint, origin, value):
        raise ProtocolError(place, f"expected {_expected(hint, origin)}, found {shown(value)}")
    return float(value) if hint is float else value


def _is(hint: Any, origin: Any, value: Any) -> bool:
    if origin is Literal:
        return isinstance(value, str) and value in get_args(hint)
    if isinstance(value, bool):
        return hint is bool
    if hint is float:
        return isinstance(value, int | float) and -_LARGEST <= value <= _LARGEST
    return isinstance(value, origin or hint)


_LARGEST = math.nextafter(math.inf, 0.0)


def _expected(hint: Any, origin: Any) -> str:
    if origin is Literal:
        return "one of " + ", ".join(get_args(hint))
    names = {int: "an integer", float: "a finite number", bool: "true or false", str: "text", tuple: "a list"}
    return names.get(origin or hint, "an object")
