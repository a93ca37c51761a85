"""The display: how many pixels, how large, how far from the eye."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.errors import SettingsError, require_integer, require_number

MAX_SIDE_PX = 32_768
"""Longest side of a display [px]; four times an 8K screen."""

MAX_LENGTH_CM = 1e9
"""Longest length a display may state [cm]."""

MIN_PITCH_CM = 1e-12
"""Smallest pixel a display may have [cm]; lengths far below leave the range of numbers when squared."""


@dataclass(frozen=True, slots=True)
class Display:
    """A flat screen seen by an eye in front of its centre.

    Attributes:
        width_px, height_px: size of the frame [px], 1 to 32768.
        width_cm: physical width [cm].
        height_cm: physical height [cm]; None (the default) means square pixels.
        distance_cm: viewing distance [cm].

    Raises:
        SettingsError: for a size that is not positive and finite, or pixels too small to reckon with.
    """

    width_px: int = 1920
    height_px: int = 1080
    width_cm: float = 50.0
    height_cm: float | None = None
    distance_cm: float = 60.0

    def __post_init__(self) -> None:
        require_integer("display.width_px", self.width_px, 1, MAX_SIDE_PX)
        require_integer("display.height_px", self.height_px, 1, MAX_SIDE_PX)
        require_number("display.width_cm", self.width_cm, 0, MAX_LENGTH_CM, open_low=True)
        if self.height_cm is not None:
            require_number("display.height_cm", self.height_cm, 0, MAX_LENGTH_CM, open_low=True)
        require_number("display.distance_cm", self.distance_cm, 0, MAX_LENGTH_CM, open_low=True)
        if self.pitch_x_cm < MIN_PITCH_CM:
            raise SettingsError("display.width_cm", f"at least {MIN_PITCH_CM:g} cm a pixel", self.width_cm)
        if self.pitch_y_cm < MIN_PITCH_CM:
            raise SettingsError("display.height_cm", f"at least {MIN_PITCH_CM:g} cm a pixel", self.height_cm)

    @property
    def pitch_x_cm(self) -> float:
        """Width of one pixel [cm]."""
        return self.width_cm / self.width_px

    @property
    def pitch_y_cm(self) -> float:
        """Height of one pixel [cm]."""
        if self.height_cm is None:
            return self.pitch_x_cm
        return self.height_cm / self.height_px

    @property
    def aspect(self) -> float:
        """Physical width over physical height."""
        return (self.pitch_x_cm * self.width_px) / (self.pitch_y_cm * self.height_px)

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.width_px * self.height_px
