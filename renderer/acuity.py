"""How fine the eye sees away from the gaze: cut-off frequency and unit angle.

Peli, Yang and Goldstein (1991), as used by Siekawa and Mantiuk (2014), equations 1 to 3, and two more
models of the same form, in which the unit angle grows linearly with eccentricity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import SettingsError, require_choice, require_number

MODELS = ("peli", "geisler-perry", "guenter")
ECCENTRICITIES = ("exact", "paper")

E1_CPD = 43.1
"""Cut-off frequency at the fovea [cpd] (Siekawa and Mantiuk 2014, eq. 2)."""

E2_DEG = 3.118
"""Eccentricity at which the cut-off has halved [deg] (Siekawa and Mantiuk 2014, eq. 2)."""

K_THRESHOLD = (0.030, 0.057)
"""Range of the fall-off k of eq. 1 [1/(cpd deg)] over observers and tasks (Peli et al. 1991)."""

GEISLER_PERRY_LOG_CONTRAST = math.log(64.0)
"""ln(1/CT0), CT0 = 1/64 (Geisler and Perry 1998)."""

GEISLER_PERRY_ALPHA = 0.106
"""Spatial decay alpha [1/cpd] (Geisler and Perry 1998)."""

GEISLER_PERRY_E2_DEG = 2.3
"""Half-resolution eccentricity e2 [deg] (Geisler and Perry 1998)."""

GUENTER_SLOPE = 1.32 / 60.0
"""Growth of the minimum angle of resolution [deg/deg] (Guenter et al. 2012, the cautious end)."""

GUENTER_FOVEA_DEG = 1.0 / 48.0
"""Minimum angle of resolution at the fovea [deg] (Guenter et al. 2012)."""

MAX_SCALE = 1000.0
MAX_MARGIN_DEG = 90.0


@dataclass(frozen=True, slots=True)
class Acuity:
    """How the eye's resolution is taken into account.

    Attributes:
        model: `peli` (the paper's, default), `geisler-perry` or `guenter`.
        eccentricity: `exact`: the eye is in front of the screen's centre (default); `paper`: in front
            of the gaze (eq. 4).
        scale: factor on the unit angle, 0.001 to 1000: 2 makes cells twice as wide as the eye calls for.
        margin_deg: error of the eye tracker [deg], 0 to 90: cells are small enough for any gaze this far away.

    Raises:
        SettingsError: naming the field, for a value out of range.
    """

    model: str = "peli"
    eccentricity: str = "exact"
    scale: float = 1.0
    margin_deg: float = 0.0

    def __post_init__(self) -> None:
        require_choice("quality.acuity.model", self.model, MODELS)
        require_choice("quality.acuity.eccentricity", self.eccentricity, ECCENTRICITIES)
        require_number("quality.acuity.scale", self.scale, 1 / MAX_SCALE, MAX_SCALE)
        require_number("quality.acuity.margin_deg", self.margin_deg, 0.0, MAX_MARGIN_DEG)


def contrast_threshold(
    frequency_cpd: ArrayLike, eccentricity_deg: ArrayLike, foveal_threshold: ArrayLike, k: float = K_THRESHOLD[0]
) -> NDArray[np.float64]:
    """Contrast threshold C_t(E, f) = C_t(0, f) * exp(k * f * E) (Siekawa and Mantiuk 2014, eq. 1).

    Args:
        frequency_cpd: spatial frequency f [cpd], any shape, 0 or more.
        eccentricity_deg: E [deg], same or broadcastable shape, 0 or more.
        foveal_threshold: C_t(0, f), same or broadcastable shape.
        k: fall-off [1/(cpd deg)]; the literature has 0.030 to 0.057.

    Returns:
        float64 thresholds, infinity where the exponential leaves float64.
    """
    exponent = k * np.asarray(frequency_cpd, dtype=np.float64) * np.asarray(eccentricity_deg, dtype=np.float64)
    with np.errstate(over="ignore"):
        return np.asarray(foveal_threshold, dtype=np.float64) * np.exp(exponent)


def cut_off_cpd(eccentricity_deg: ArrayLike, model: str = "peli", display_cpd: float = math.inf) -> NDArray[np.float64]:
    """Highest frequency the eye resolves, f_c = min(display_cpd, E1*E2/(E2+E)) (eq. 2), or another model's.

    Args:
        eccentricity_deg: E [deg], any shape, 0 or more.
        model: one of `MODELS`.
        display_cpd: highest frequency the display can show [cpd].

    Returns:
        float64 [cpd], same shape.

    Raises:
        SettingsError: for an unknown model.
    """
    floor_deg, slope = unit_angle_line(model)
    cut_off = 0.5 / (floor_deg + slope * np.asarray(eccentricity_deg, dtype=np.float64))
    return np.minimum(display_cpd, cut_off)


def unit_angle_deg(eccentricity_deg: ArrayLike, model: str = "peli") -> NDArray[np.float64]:
    """Smallest angle worth a ray, alpha = 1/(2*f_c), without the display's limit (eq. 3).

    Args:
        eccentricity_deg: E [deg], any shape, 0 or more.
        model: one of `MODELS`.

    Returns:
        float64 [deg], same shape.

    Raises:
        SettingsError: for an unknown model.
    """
    floor_deg, slope = unit_angle_line(model)
    return floor_deg + slope * np.asarray(eccentricity_deg, dtype=np.float64)


def unit_angle_line(model: str) -> tuple[float, float]:
    """The unit angle as a line in eccentricity: alpha = floor_deg + slope * E, (floor_deg, slope).

    peli: (E2 + E)/(2*E1*E2). geisler-perry: alpha_gp*(e2 + E)/(2*e2*ln 64). guenter: half a cycle is
    the minimum angle of resolution itself, 1/48 deg + slope*E.

    Raises:
        SettingsError: for an unknown model.
    """
    if model == "peli":
        return 1 / (2 * E1_CPD), 1 / (2 * E1_CPD * E2_DEG)
    if model == "geisler-perry":
        floor_deg = GEISLER_PERRY_ALPHA / (2 * GEISLER_PERRY_LOG_CONTRAST)
        return floor_deg, floor_deg / GEISLER_PERRY_E2_DEG
    if model == "guenter":
        return GUENTER_FOVEA_DEG, GUENTER_SLOPE
    raise SettingsError("acuity.model", "one of " + ", ".join(MODELS), model)
