"""How finely a screen is divided for the eye, as metrics of pictures want to know it."""

from __future__ import annotations

import math

from renderer.display import Display


def pixels_per_degree(display: Display) -> float:
    """Pixels per degree in the middle of the screen [1/deg]; of pixels that are not square, the geometric mean."""
    across, down = (_angle_deg(pitch, display.distance_cm) for pitch in (display.pitch_x_cm, display.pitch_y_cm))
    return 1.0 / math.sqrt(across * down)


def _angle_deg(pitch_cm: float, distance_cm: float) -> float:
    return math.degrees(2.0 * math.atan(pitch_cm / 2.0 / distance_cm))
