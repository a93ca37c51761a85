"""Self-made devices whose lines a regular expression describes."""

from __future__ import annotations

import re

from clients.bridge.codec import BadRecord, Line, LineCodec
from clients.bridge.errors import ConfigError
from clients.bridge.fields import KNOWN_FIELDS, LEAST_CONFIDENCE, sample_of
from clients.bridge.sample import Point, Sample

DEFAULT_PATTERN = r"(?P<x>\S+) (?P<y>\S+)"


class PatternLines(LineCodec):
    """Lines that a regular expression matches as a whole; its groups name the fields.

    Args:
        pattern: with the groups x and y, or xl, yl, xr, yr, and perhaps t, v and c.
        least_confidence: below it the eye counts as lost.

    Raises:
        ConfigError: if it is no regular expression, or names other groups.
    """

    name = "regex"
    starts_mid_line = True

    def __init__(self, pattern: str = DEFAULT_PATTERN, least_confidence: float = LEAST_CONFIDENCE) -> None:
        super().__init__()
        self._least_confidence = least_confidence
        try:
            self._pattern = re.compile(pattern)
        except re.error as error:
            raise ConfigError("pattern", f"a regular expression ({error})", pattern) from None
        groups = self._pattern.groupindex.keys()
        if not groups <= KNOWN_FIELDS or not ({"x", "y"} <= groups or {"xl", "yl", "xr", "yr"} <= groups):
            raise ConfigError(
                "pattern", "groups (?P<x>...) and (?P<y>...), or xl, yl, xr, yr, with t, v and c", pattern
            )

    def read(self, line: Line) -> list[Sample]:
        """The sample of a line that matches."""
        match = self._pattern.fullmatch(line.text.strip())
        if match is None:
            raise BadRecord(line.text)
        fields = {name: word for name, word in match.groupdict().items() if word is not None}
        return [sample_of(line, fields, self._least_confidence)]

    def encode(self, time_ns: int, point: Point | None) -> bytes:  # noqa: ARG002 (a pattern has no inverse)
        """A line for the default pattern."""
        x, y = (f"{point.x:.5f}", f"{point.y:.5f}") if point is not None else ("nan", "nan")
        return f"{x} {y}\n".encode("ascii")
