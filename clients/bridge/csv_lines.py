"""Self-made devices that send numbers, a line a sample: `1522, 431` or `(1522, 431)`."""

from __future__ import annotations

import re

from clients.bridge.codec import BadRecord, Line, LineCodec
from clients.bridge.errors import ConfigError
from clients.bridge.fields import KNOWN_FIELDS, LEAST_CONFIDENCE, sample_of
from clients.bridge.sample import Point, Sample

SKIPPED = "-"
SEPARATOR = re.compile(r"\s*[,;\t]\s*|\s+")
BRACKETS = "()[]{}<> \t"


class CsvLines(LineCodec):
    """Numbers separated by commas, semicolons, tabs or spaces, perhaps in brackets.

    Args:
        fields: what each number is: x, y, t, v (validity), c (confidence), xl, yl, xr, yr, or - for anything else.
        least_confidence: below it the eye counts as lost.

    Raises:
        ConfigError: for other fields, or without x and y.
    """

    name = "csv"
    starts_mid_line = True

    def __init__(self, fields: tuple[str, ...] = ("x", "y"), least_confidence: float = LEAST_CONFIDENCE) -> None:
        super().__init__()
        used = [field for field in fields if field != SKIPPED]
        pairs = ({"x", "y"}, {"xl", "yl", "xr", "yr"})
        if not set(used) <= KNOWN_FIELDS or len(set(used)) != len(used) or not any(pair <= set(used) for pair in pairs):
            raise ConfigError("fields", "x and y, or xl, yl, xr, yr, with t, v, c and -, each once", ",".join(fields))
        self._fields, self._least_confidence = fields, least_confidence

    def read(self, line: Line) -> list[Sample]:
        """The sample of a line with as many numbers as there are fields."""
        text = line.text.strip(BRACKETS)
        words = SEPARATOR.split(text)
        if len(words) != len(self._fields):
            raise BadRecord(line.text)
        return [sample_of(line, dict(zip(self._fields, words, strict=True)), self._least_confidence)]

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """A line; a lost eye is nan."""
        x, y = (f"{point.x:.5f}", f"{point.y:.5f}") if point is not None else ("nan", "nan")
        words = {"t": str(time_ns), "v": str(int(point is not None)), "c": str(int(point is not None)), SKIPPED: "0"}
        words |= {field: {"x": x, "y": y}[field[0]] for field in self._fields if field[0] in "xy"}
        return (",".join(words[field] for field in self._fields) + "\n").encode("ascii")
