"""The camera: where the picture is seen from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.display import Display
from renderer.errors import SettingsError, require_number, require_point

MAX_POSITION_M = 1e15
"""Largest coordinate of a camera [m]."""


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera whose vertical field of view fills the height of the display.

    Attributes:
        position: of the eye in the scene [m].
        look_at: a point in the middle of the picture [m].
        up: direction that points up in the picture, not along the view.
        vertical_fov_deg: full vertical field of view [deg], 0.001 to 179.

    Raises:
        SettingsError: naming the field, for numbers that are not finite, a view of no length or an
            `up` along the view.
    """

    position: tuple[float, float, float] = (0.0, 0.0, 5.0)
    look_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    vertical_fov_deg: float = 40.0

    def __post_init__(self) -> None:
        for name in ("position", "look_at", "up"):
            object.__setattr__(self, name, require_point(f"camera.{name}", getattr(self, name), MAX_POSITION_M))
        require_number("camera.vertical_fov_deg", self.vertical_fov_deg, 1e-3, 179.0)
        forward = _direction(self.position, self.look_at)
        if forward is None:
            raise SettingsError("camera.look_at", "a point away from camera.position", self.look_at)
        up = _direction((0.0, 0.0, 0.0), self.up)
        if up is None or float(np.linalg.norm(np.cross(forward, up))) < 1e-9:
            raise SettingsError("camera.up", "a direction that is not along the view", self.up)


class ViewFrame(NamedTuple):
    """A camera set up for a display: the ray through pixel point (x, y) runs from the camera along
    corner + x * step_x + y * step_y (float64, world units, not normalised).
    """

    corner: NDArray[np.float64]
    step_x: NDArray[np.float64]
    step_y: NDArray[np.float64]


def view_frame(camera: Camera, display: Display) -> ViewFrame:
    """The rays of `camera` on `display`.

    The picture keeps true proportions on the physical screen, whose pixels need not be square.
    """
    forward = _direction(camera.position, camera.look_at)
    up = _direction((0.0, 0.0, 0.0), camera.up)
    assert forward is not None and up is not None
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    true_up = np.cross(right, forward)
    half_height = math.tan(math.radians(camera.vertical_fov_deg) / 2)
    half_width = half_height * display.aspect
    step_x = right * (2 * half_width / display.width_px)
    step_y = true_up * (-2 * half_height / display.height_px)
    return ViewFrame(forward - half_width * right + half_height * true_up, step_x, step_y)


def _direction(start: tuple[float, ...], end: tuple[float, ...]) -> NDArray[np.float64] | None:
    """Unit vector from start to end, None where they coincide; safe for tiny and huge lengths."""
    offset = np.asarray(end, dtype=np.float64) - np.asarray(start, dtype=np.float64)
    largest = float(np.abs(offset).max())
    if largest == 0.0:
        return None
    offset /= largest
    return offset / np.linalg.norm(offset)
