"""Angles at the eye: an arctangent of lengths against the arccosine of a rounded dot product."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.gaze import Gaze
from renderer.kernel import kernel
from renderer.numerics.comparison import Comparison, time_ratio

SCREEN = Display(1920, 1080, 50.0, 35.0, 60.0)
GAZE = Gaze(1000.0, 500.0)
"""The paper's example (Siekawa and Mantiuk 2014)."""


@kernel
def _by_arccosine(x: NDArray[Any], y: NDArray[Any], place: NDArray[Any], angle: NDArray[np.float64]) -> None:
    """Angle between (x, y, distance) and the gaze [deg], in the precision of `x`; `place`: the gaze's own lengths."""
    gx, gy, distance = place[0], place[1], place[2]
    reach = math.sqrt(gx * gx + gy * gy + distance * distance)
    for row in range(len(y)):
        for column in range(len(x)):
            length = math.sqrt(x[column] * x[column] + y[row] * y[row] + distance * distance)
            dot = (x[column] * gx + y[row] * gy + distance * distance) / (length * reach)
            one = x.dtype.type(1.0)
            angle[row, column] = math.acos(min(one, dot)) * (180.0 / math.pi)


def _lengths(number: type) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """x of the columns, y of the rows, and the gaze with the distance [cm]."""
    x = (np.arange(SCREEN.width_px) + 0.5 - SCREEN.width_px / 2) * SCREEN.pitch_x_cm
    y = (np.arange(SCREEN.height_px) + 0.5 - SCREEN.height_px / 2) * SCREEN.pitch_y_cm
    gaze = ((GAZE.x - SCREEN.width_px / 2) * SCREEN.pitch_x_cm, (GAZE.y - SCREEN.height_px / 2) * SCREEN.pitch_y_cm)
    return x.astype(number), y.astype(number), np.array([*gaze, SCREEN.distance_cm], dtype=number)


def _truth() -> NDArray[np.longdouble]:
    x, y, place = _lengths(np.longdouble)
    gx, gy, distance = place
    across = np.hypot((y[:, None] - gy) * distance, (x - gx) * distance)
    turned = x * gy - y[:, None] * gx
    return np.asarray(np.degrees(np.arctan2(np.hypot(across, turned), x * gx + y[:, None] * gy + distance * distance)))


def compare_angles() -> tuple[Comparison, ...]:
    """Largest error of the eccentricity of any pixel [deg]; a pixel near the gaze is 0.025 deg wide."""
    truth = _truth()
    room = np.zeros((SCREEN.height_px, SCREEN.width_px))

    def error(angles: NDArray[np.float64]) -> float:
        return float(np.abs(angles - truth).max())

    ours = error(eccentricity_deg(SCREEN, GAZE))
    lines = []
    for other, number in (("arccosine, float32", np.float32), ("arccosine, float64", np.float64)):
        lengths = _lengths(number)
        _by_arccosine(*lengths, room)
        lines.append(
            Comparison(
                "1920x1080 at 60 cm", "largest error of the eccentricity [deg]", "arctangent, float64", other,
                ours, error(room),
                time_ratio(
                    functools.partial(eccentricity_deg, SCREEN, GAZE), functools.partial(_by_arccosine, *lengths, room)
                ),
            )
        )  # fmt: skip
    return tuple(lines)
