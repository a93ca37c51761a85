"""Self-made devices that send a JSON object a line."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from clients.bridge.codec import BadRecord, Line, LineCodec
from clients.bridge.errors import ConfigError
from clients.bridge.fields import KNOWN_FIELDS, LEAST_CONFIDENCE, sample_of
from clients.bridge.sample import Point, Sample

DEFAULT_PATHS = {"x": "x", "y": "y", "t": "t", "v": "v", "c": "c"}
OPTIONAL = frozenset(("t", "v", "c"))


class JsonLines(LineCodec):
    """A JSON object a line.

    Args:
        paths: where each field (x, y, t, v, c, xl, yl, xr, yr) stands, keys joined by dots: `gaze.x`, `eyes.0.x`. t, v
            and c may be missing in a record.
        least_confidence: below it the eye counts as lost.

    Raises:
        ConfigError: for other fields, or without x and y.
    """

    name = "jsonl"

    def __init__(self, paths: Mapping[str, str] | None = None, least_confidence: float = LEAST_CONFIDENCE) -> None:
        super().__init__()
        self._least_confidence = least_confidence
        self._paths = {field: self.keys_of(path) for field, path in (DEFAULT_PATHS if paths is None else paths).items()}
        pairs = ({"x", "y"}, {"xl", "yl", "xr", "yr"})
        if not self._paths.keys() <= KNOWN_FIELDS or not any(pair <= self._paths.keys() for pair in pairs):
            raise ConfigError("paths", "x and y, or xl, yl, xr, yr, with t, v and c", ",".join(self._paths))

    def keys_of(self, path: str) -> tuple[str, ...]:
        """The keys of a path."""
        return tuple(path.split("."))

    def read(self, line: Line) -> list[Sample]:
        """The sample of a line."""
        try:
            record = json.loads(line.text)
        except (ValueError, RecursionError):
            raise BadRecord(line.text) from None
        found = {field: _at(record, path) for field, path in self._paths.items()}
        words = {field: _word(value) for field, value in found.items() if value is not _ABSENT}
        if self._paths.keys() - words.keys() - OPTIONAL:
            raise BadRecord(line.text)
        return [sample_of(line, words, self._least_confidence)]

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """A line; a lost eye is null."""
        x, y = (None, None) if point is None else (round(point.x, 5), round(point.y, 5))
        values = {"t": time_ns, "v": point is not None, "c": float(point is not None)} | dict.fromkeys(
            ("x", "xl", "xr"), x
        )
        values |= dict.fromkeys(("y", "yl", "yr"), y)
        record: dict[str, Any] = {}
        for field, path in self._paths.items():
            place = record
            for key in path[:-1]:
                place = place.setdefault(key, {})
            place[path[-1]] = values[field]
        return json.dumps(record).encode("ascii") + b"\n"


_ABSENT = object()


def _at(record: Any, path: tuple[str, ...]) -> Any:
    """What stands at a path; list items by number."""
    for key in path:
        if isinstance(record, dict) and key in record:
            record = record[key]
        elif isinstance(record, list) and key.isdecimal() and int(key) < len(record):
            record = record[int(key)]
        else:
            return _ABSENT
    return record


def _word(value: Any) -> str:
    """A JSON value as text; null and NaN say that the eye is lost."""
    if isinstance(value, dict | list):
        raise BadRecord(str(value))
    return str(value)
