"""Gaze of Pupil Core: records of Pupil Capture, a line of JSON each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from clients.bridge.codec import SECOND_NS
from clients.bridge.fields import LEAST_CONFIDENCE
from clients.bridge.json_lines import JsonLines
from clients.bridge.sample import Point

SCHEME = "pupil://"
PATHS = {"x": "norm_pos.0", "y": "norm_pos.1", "t": "timestamp", "c": "confidence"}
KEPT = ("topic", "timestamp", "norm_pos", "confidence", "on_surf")
"""Of a record; the rest is about pupils and cameras."""


def topic_of(surface: str | None) -> str:
    """What to subscribe to: gaze on a surface, or in the scene camera's picture."""
    return "gaze." if surface is None else f"surfaces.{surface}"


def pupil_lines(message: Mapping[str, Any]) -> bytes:
    """The records of a message: several of a surface, one of gaze."""
    records = message.get("gaze_on_surfaces", [message])
    kept = ({key: record[key] for key in KEPT if key in record} for record in records)
    return b"".join(json.dumps(record).encode("ascii") + b"\n" for record in kept)


class Pupil(JsonLines):
    """Pupil Core.

    Args:
        surface: the name that the screen has as a surface in Pupil Capture: gaze is then in fractions of the screen.
            None for gaze in the picture of the scene camera, which means nothing on a screen without a calibration, and
            nothing any more once the head moves.
        least_confidence: below it the eye counts as lost.
    """

    name = "pupil"
    origin = "bottom-left"
    ticks_ns = (SECOND_NS,)

    def __init__(self, surface: str | None = None, least_confidence: float = LEAST_CONFIDENCE) -> None:
        super().__init__(PATHS, least_confidence)
        self._topic = topic_of(surface)
        self.unit = "raw" if surface is None else "fraction"

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """A record; of a lost eye with no confidence."""
        x, y = point or (0.5, 0.5)
        return pupil_lines(
            {
                "topic": self._topic,
                "timestamp": time_ns / SECOND_NS,
                "norm_pos": (round(x, 5), round(y, 5)),
                "confidence": float(point is not None),
            }
        )
