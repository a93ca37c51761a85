"""Values out of a nested file (TOML, JSON), each checked where it is read, each error naming its place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from renderer.errors import SceneError, SettingsError, require_choice, require_integer, require_number, short

_REQUIRED: Final = object()


class Fields:
    """One table of a file.

    A field that is absent gives the default, or without a default an error. `refuse_unknown` raises for
    the fields that nobody asked for.

    Raises:
        SceneError: in every method, as "file: place.field: expected ..., found ...".
    """

    def __init__(self, values: object, file: str, place: str = "") -> None:
        self.file = file
        self.place = place
        if not isinstance(values, dict):
            raise SceneError(f"{file}: {place or 'top level'}: expected a table of fields, found {short(values)}")
        self._values: dict[str, object] = values
        self._asked: set[str] = set()

    def __contains__(self, key: str) -> bool:
        """Whether the field is there; counts as asking for it."""
        self._asked.add(key)
        return key in self._values

    def names(self) -> tuple[str, ...]:
        """Names of all fields of the table."""
        return tuple(self._values)

    def value(self, key: str) -> object:
        """The field as it stands in the file, None where it is absent; for fields of several kinds."""
        self._asked.add(key)
        return self._values.get(key)

    def where(self, key: str) -> str:
        """The place of a field."""
        return f"{self.place}.{key}" if self.place else key

    def refuse(self, key: str, expected: str, found: object) -> SceneError:
        """The error for a field whose value is not as expected; raise it."""
        return SceneError(f"{self.file}: {self.where(key)}: expected {expected}, found {short(found)}")

    def in_file(self, error: SettingsError) -> SceneError:
        """The error of a record made from this file's fields, naming the file; raise it."""
        return SceneError(f"{self.file}: {error.field}: expected {error.expected}, found {short(error.found)}")

    def number(
        self, key: str, low: float, high: float, default: float | object = _REQUIRED, *, open_low: bool = False
    ) -> float:
        """A finite number in [low, high], or in (low, high]."""
        value = self._get(key, "a number", default)
        try:
            return require_number(self.where(key), value, low, high, open_low=open_low)
        except SettingsError as error:
            raise self.in_file(error) from None

    def integer(self, key: str, low: int, high: int, default: int | object = _REQUIRED) -> int:
        """A whole number from low to high."""
        value = self._get(key, "an integer", default)
        try:
            return require_integer(self.where(key), value, low, high)
        except SettingsError as error:
            raise self.in_file(error) from None

    def text(self, key: str, default: str | object = _REQUIRED) -> str:
        """A string."""
        value = self._get(key, "text", default)
        if not isinstance(value, str):
            raise self.refuse(key, "text", value)
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: str | object = _REQUIRED) -> str:
        """One of the strings `choices`."""
        value = self._get(key, "one of " + ", ".join(choices), default)
        try:
            return require_choice(self.where(key), value, choices)
        except SettingsError as error:
            raise self.in_file(error) from None

    def flag(self, key: str, default: bool | object = _REQUIRED) -> bool:
        """True or false."""
        value = self._get(key, "true or false", default)
        if not isinstance(value, bool):
            raise self.refuse(key, "true or false", value)
        return value

    def numbers(
        self, key: str, count: int, low: float, high: float, default: tuple[float, ...] | object = _REQUIRED
    ) -> tuple[float, ...]:
        """A list of `count` finite numbers, each in [low, high]."""
        value = self._get(key, f"{count} numbers", default)
        if not isinstance(value, list | tuple) or len(value) != count:
            raise self.refuse(key, f"{count} numbers", value)
        try:
            return tuple(require_number(f"{self.where(key)}[{i}]", part, low, high) for i, part in enumerate(value))
        except SettingsError as error:
            raise self.in_file(error) from None

    def point(
        self, key: str, limit: float, default: tuple[float, float, float] | object = _REQUIRED
    ) -> tuple[float, float, float]:
        """Three finite numbers, each of a magnitude up to `limit`."""
        x, y, z = self.numbers(key, 3, -limit, limit, default)
        return x, y, z

    def rgb(
        self, key: str, high: float, default: tuple[float, float, float] | object = _REQUIRED
    ) -> tuple[float, float, float]:
        """Red, green and blue, each from 0 to `high`."""
        red, green, blue = self.numbers(key, 3, 0.0, high, default)
        return red, green, blue

    def table(self, key: str) -> Fields:
        """A table within this one; without any field where it is absent."""
        return Fields(self._get(key, "a table of fields", {}), self.file, self.where(key))

    def tables(self, key: str) -> Iterator[Fields]:
        """The tables of a list; none where it is absent."""
        for i, value in enumerate(self.items(key)):
            yield Fields(value, self.file, f"{self.where(key)}[{i}]")

    def items(self, key: str) -> list[object]:
        """A list of anything; empty where it is absent."""
        value = self._get(key, "a list", [])
        if not isinstance(value, list):
            raise self.refuse(key, "a list", value)
        return value

    def refuse_unknown(self) -> None:
        """Raise for a field that nobody asked for."""
        for key, value in self._values.items():
            if key not in self._asked:
                raise self.refuse(key, f"one of the fields {', '.join(sorted(self._asked))}", value)

    def _get(self, key: str, expected: str, default: object) -> object:
        self._asked.add(key)
        value = self._values.get(key, default)
        if value is _REQUIRED:
            raise SceneError(f"{self.file}: {self.where(key)}: expected {expected}, found nothing")
        return value
