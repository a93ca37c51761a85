"""FovVideoVDP: how visible two pictures differ to an eye that looks at a known place (Mantiuk et al. 2021).

Quality is in JOD: 10 is no difference, and 9 what one in four would still choose over the reference. It pools over
the screen, so it hardly falls where the gaze was wrong; its map of differences around the gaze does, and goes beside
it. It is nearly blind to brightness and to hue. The only file that knows pyfvvdp and torch, of the extra `quality`;
pyfvvdp's licence is CC BY-NC: not for commercial use.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import pyfvvdp
import torch
from numpy.typing import NDArray

from renderer.accuracy.pixels_per_degree import pixels_per_degree
from renderer.display import Display
from renderer.gaze import Gaze

SCREEN: Final = "standard_fhd"
"""Photometry of the screen: 200 cd/m^2 white, 0.6 cd/m^2 black."""

CM_PER_INCH: Final = 2.54

NEAR_DEG: Final = 5.0
"""Half-angle of what counts as around the gaze [deg]."""


class Visibility(NamedTuple):
    """Quality [JOD], and the 99th percentile of the map of differences within 5 deg; None where that is off screen."""

    jod: float
    heat_foveal_p99: float | None


class VisibilityMetric:
    """FovVideoVDP for one screen and gaze."""

    def __init__(self, display: Display, gaze: Gaze, eccentricity_deg: NDArray[np.float64]) -> None:
        """Set the metric up.

        Args:
            display, gaze: the screen and where the eye looks.
            eccentricity_deg: (h, w) angle of each pixel from the gaze [deg].
        """
        self._near = eccentricity_deg <= NEAR_DEG
        # The metric counts pixels from the centre of the first one, gazetrace from its corner.
        self._gaze = np.array([gaze.x - 0.5, gaze.y - 0.5])
        self._metric = pyfvvdp.fvvdp(
            display_name=SCREEN,
            display_geometry=_geometry(display),
            foveated=True,
            heatmap="raw",
            device=torch.device("cpu"),
        )

    def judge(self, frame: NDArray[np.uint8], reference: NDArray[np.uint8]) -> Visibility:
        """Hold a picture, (h, w, 3) uint8 sRGB, against its reference."""
        with torch.no_grad():
            jod, found = self._metric.predict(frame, reference, dim_order="HWC", fixation_point=self._gaze)
        heat = found["heatmap"][0, 0, 0].float().numpy()[self._near]
        return Visibility(float(jod), float(np.percentile(heat, 99)) if heat.size else None)


def _geometry(display: Display) -> pyfvvdp.fvvdp_display_geometry:
    """The screen as it is; given its diagonal alone, the metric would take its pixels for square."""
    size_cm = (display.pitch_x_cm * display.width_px, display.pitch_y_cm * display.height_px)
    geometry = pyfvvdp.fvvdp_display_geometry(
        (display.width_px, display.height_px),
        distance_m=display.distance_cm / 100,
        diagonal_size_inches=math.hypot(*size_cm) / CM_PER_INCH,
    )
    geometry.display_size_m = tuple(side / 100 for side in size_cm)
    geometry.display_size_deg = tuple(math.degrees(2 * math.atan(side / 2 / display.distance_cm)) for side in size_cm)
    geometry.ppd_centre = pixels_per_degree(display)
    return geometry
