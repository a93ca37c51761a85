"""How fine the eye sees away from the gaze: cut-off frequency and unit angle, by one of several models.

Equations 1 to 3 of Siekawa and Mantiuk (2014). Beside their model, after Peli, Yang and Goldstein (1991), there are
others; each is declared in a file of its own or of its family.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.acuity_model import AcuityModel
from renderer.errors import SettingsError, require_choice, require_number
from renderer.linear_acuity import GEISLER_PERRY, GUENTER, PELI
from renderer.stela_csf import STELACSF
from renderer.watson import WATSON

ACUITY_MODELS: Mapping[str, AcuityModel] = {
    model.name: model for model in (PELI, GEISLER_PERRY, GUENTER, WATSON, STELACSF)
}
MODELS = tuple(ACUITY_MODELS)
ECCENTRICITIES = ("exact", "paper")

K_THRESHOLD = (0.030, 0.057)
"""Range of the fall-off k of eq. 1 [1/(cpd deg)] over observers and tasks (Peli et al. 1991)."""

MAX_SCALE = 1000.0
MAX_MARGIN_DEG = 90.0


@dataclass(frozen=True, slots=True)
class Acuity:
    """How the eye's resolution is taken into account.

    Attributes:
        model: `peli` (the paper's, default), `geisler-perry`, `guenter`, `watson` or `stelacsf`.
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
        eccentricity_deg: E [deg], any shape, 0 to 180.
        model: one of `MODELS`.
        display_cpd: highest frequency the display can show [cpd].

    Returns:
        float64 [cpd], same shape.

    Raises:
        SettingsError: for an unknown model.
    """
    known = acuity_model(model)
    cut_off = known.cut_off_cpd(np.asarray(eccentricity_deg, dtype=np.float64))
    return np.asarray(np.minimum(min(display_cpd, known.limit_cpd), cut_off))


def unit_angle_deg(eccentricity_deg: ArrayLike, model: str = "peli") -> NDArray[np.float64]:
    """Smallest angle worth a ray, alpha = 1/(2*f_c), without the display's limit (eq. 3).

    Args:
        eccentricity_deg: E [deg], any shape, 0 to 180.
        model: one of `MODELS`.

    Returns:
        float64 [deg], same shape.

    Raises:
        SettingsError: for an unknown model.
    """
    return np.asarray(0.5 / cut_off_cpd(eccentricity_deg, model))


def acuity_model(name: str) -> AcuityModel:
    """The model of that name.

    Raises:
        SettingsError: for an unknown one.
    """
    if name not in ACUITY_MODELS:
        raise SettingsError("acuity.model", "one of " + ", ".join(MODELS), name)
    return ACUITY_MODELS[name]
