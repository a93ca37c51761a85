"""Samples of a Lab Streaming Layer stream, a line of JSON each: its time, and its channels by their labels."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

from clients.bridge.codec import SECOND_NS, BadRecord, Line
from clients.bridge.errors import ConfigError
from clients.bridge.fields import LEAST_CONFIDENCE
from clients.bridge.json_lines import OPTIONAL, JsonLines
from clients.bridge.sample import Point, Sample

SCHEME = "lsl://"
TIME, CHANNELS = "time", "channels"
DEFAULT_LABELS = {"x": "norm_pos_x", "y": "norm_pos_y", "c": "confidence"}
"""As the streams of Pupil Labs call them."""


def lsl_line(time_s: float, channels: Mapping[str, float | int | str]) -> bytes:
    """A sample as a line."""
    return json.dumps({TIME: time_s, CHANNELS: channels}).encode("ascii") + b"\n"


class Lsl(JsonLines):
    """A stream of the Lab Streaming Layer. What its numbers count is not said by every stream: `raw` unless told.

    Args:
        labels: of the channels that hold each field (x, y, v, c, xl, yl, xr, yr); their order says nothing. Of a stream
            without labels, numbers from 0.
        least_confidence: below it the eye counts as lost.

    Raises:
        ConfigError: for other fields, or without x and y.
    """

    name = "lsl"
    unit = "raw"
    ticks_ns = (SECOND_NS,)

    def __init__(self, labels: Mapping[str, str] | None = None, least_confidence: float = LEAST_CONFIDENCE) -> None:
        labels = DEFAULT_LABELS if labels is None else labels
        if "t" in labels:
            raise ConfigError("paths", "no t: a stream of LSL has a time of its own", labels["t"])
        super().__init__(labels, least_confidence)
        self._paths["t"] = (TIME,)

    def keys_of(self, path: str) -> tuple[str, ...]:
        """A label as it is: it may hold dots."""
        return CHANNELS, path

    def read(self, line: Line) -> list[Sample]:
        """The sample of a line."""
        try:
            samples = super().read(line)
        except BadRecord:
            self.complaint = self._missing(line.text)
            raise
        self.complaint = None
        return samples

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """A line; a lost eye is NaN, without confidence."""
        x, y = (math.nan, math.nan) if point is None else (round(point.x, 5), round(point.y, 5))
        values = {"x": x, "y": y, "v": float(point is not None), "c": float(point is not None)}
        channels = {path[-1]: values[field[0]] for field, path in self._paths.items() if field != "t"}
        return lsl_line(time_ns / SECOND_NS, channels)

    def _missing(self, text: str) -> str | None:
        """Which labels a sample lacks; None if that is not what is wrong with it."""
        try:
            found = json.loads(text)[CHANNELS].keys()
        except (ValueError, KeyError, TypeError, AttributeError):
            return None
        labels = [path[-1] for field, path in self._paths.items() if field not in OPTIONAL]
        if set(labels) <= found:
            return None
        return f"expected channels {', '.join(labels)}, found {', '.join(found)}: --paths x=LABEL,y=LABEL names them"
