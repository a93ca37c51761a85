"""The screen that the eye looks at, and where on it a device's point lies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from clients.bridge.asl import HEIGHT as ASL_HEIGHT
from clients.bridge.asl import WIDTH as ASL_WIDTH
from clients.bridge.errors import ConfigError
from clients.bridge.sample import Point


@dataclass(frozen=True, slots=True)
class Screen:
    """A screen and the eye in front of its middle. The defaults are those of a render request."""

    width_px: float = 1920
    height_px: float = 1080
    width_cm: float = 50
    height_cm: float = 35
    distance_cm: float = 60

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(name, "a number above 0", value)

    @classmethod
    def of_display(cls, display: Mapping[str, Any]) -> Screen:
        """The screen that the service's `ready` describes."""
        return cls(**{name: float(display[name]) for name in cls.__slots__})

    def degrees(self, x: float, y: float) -> Point:
        """Angles from the screen's middle [deg], right and down, of a place in fractions of the screen."""
        return Point(
            math.degrees(math.atan2((x - 0.5) * self.width_cm, self.distance_cm)),
            math.degrees(math.atan2((y - 0.5) * self.height_cm, self.distance_cm)),
        )

    def fraction(self, x_deg: float, y_deg: float) -> Point:
        """The inverse of `degrees`, for angles within 90 deg."""
        return Point(
            0.5 + math.tan(math.radians(x_deg)) * self.distance_cm / self.width_cm,
            0.5 + math.tan(math.radians(y_deg)) * self.distance_cm / self.height_cm,
        )

    def angle(self, a: Point, b: Point) -> float:
        """The angle at the eye between two places in fractions of the screen [deg]."""
        directions = [((p.x - 0.5) * self.width_cm, (p.y - 0.5) * self.height_cm, self.distance_cm) for p in (a, b)]
        (ax, ay, az), (bx, by, bz) = directions
        cross = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        return math.degrees(math.atan2(math.hypot(*cross), ax * bx + ay * by + az * bz))


class Unit(StrEnum):
    """What a device's numbers count."""

    PX = "px"
    FRACTION = "fraction"
    DEG = "deg"
    """Degrees from the screen's middle."""
    ASL = "asl"
    """The scene monitor of ASL, 260 x 240."""
    RAW = "raw"
    """Camera units: nothing without a calibration."""


class Origin(StrEnum):
    """Where a device's (0, 0) is; y counts down from the top and the middle, up from the bottom."""

    TOP_LEFT = "top-left"
    BOTTOM_LEFT = "bottom-left"
    CENTER = "center"


@dataclass(frozen=True, slots=True)
class Place:
    """Where a device's point lies on the screen, before calibration.

    Attributes:
        unit: of the device.
        origin: of the device.
        screen: the screen; its pixels are the device's pixels.
    """

    unit: Unit
    origin: Origin
    screen: Screen

    def fraction(self, point: Point) -> Point:
        """Fractions of the screen from its top-left corner; of `raw`, the numbers as they are."""
        if self.unit is Unit.RAW:
            return point
        if self.unit is Unit.DEG:
            if max(abs(point.x), abs(point.y)) >= 90:
                return Point(math.nan, math.nan)
            x, y = self.screen.fraction(*point)
            return Point(x, 1 - y) if self.origin is Origin.BOTTOM_LEFT else Point(x, y)
        width, height = self._size()
        x, y = point.x / width, point.y / height
        if self.origin is Origin.BOTTOM_LEFT:
            y = 1 - y
        elif self.origin is Origin.CENTER:
            x, y = x + 0.5, y + 0.5
        return Point(x, y)

    def device(self, fraction: Point) -> Point:
        """The inverse of `fraction`."""
        if self.unit is Unit.RAW:
            return fraction
        x, y = fraction
        if self.origin is Origin.BOTTOM_LEFT:
            y = 1 - y
        if self.unit is Unit.DEG:
            return self.screen.degrees(x, y)
        if self.origin is Origin.CENTER:
            x, y = x - 0.5, y - 0.5
        width, height = self._size()
        return Point(x * width, y * height)

    def _size(self) -> tuple[float, float]:
        if self.unit is Unit.PX:
            return self.screen.width_px, self.screen.height_px
        return (ASL_WIDTH, ASL_HEIGHT) if self.unit is Unit.ASL else (1.0, 1.0)
