"""The gaze: the point of the display the eye looks at."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.errors import require_number

MAX_GAZE_PX = 1e30
"""Farthest gaze [px]; the gaze may lie off the screen."""


@dataclass(frozen=True, slots=True)
class Gaze:
    """A point in display pixels, origin at the top-left corner, y down; may lie off the screen.

    Raises:
        SettingsError: for coordinates that are not finite.
    """

    x: float
    y: float

    def __post_init__(self) -> None:
        require_number("gaze.x", self.x, -MAX_GAZE_PX, MAX_GAZE_PX)
        require_number("gaze.y", self.y, -MAX_GAZE_PX, MAX_GAZE_PX)


@dataclass(frozen=True, slots=True)
class GazeBucket:
    """All gazes that share one cell map: the half-open square of side `side_px` around (x, y).

    Attributes:
        x, y: its centre [px].
        side_px: its side [px]; 0 is the single gaze (x, y).
    """

    x: float
    y: float
    side_px: int


def bucket_of(gaze: Gaze, side_px: int) -> GazeBucket:
    """The bucket [k*side - side/2, k*side + side/2) in x and y that holds `gaze`; the gaze itself for side 0."""
    if side_px == 0:
        return GazeBucket(gaze.x, gaze.y, 0)
    return GazeBucket(_bucket_centre(gaze.x, side_px), _bucket_centre(gaze.y, side_px), side_px)


def _bucket_centre(value: float, side_px: int) -> int:
    """Nearest multiple of the side, the higher one at a border; in integers, since value/side + 0.5 rounds."""
    numerator, denominator = value.as_integer_ratio()
    return side_px * ((2 * numerator + side_px * denominator) // (2 * side_px * denominator))
