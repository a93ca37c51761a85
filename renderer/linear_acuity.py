"""Acuity models whose unit angle grows linearly with eccentricity: of sensitivity, and of what observers accept."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.acuity_model import AcuityModel

E1_CPD = 43.1
"""Cut-off frequency at the fovea [cpd] (Siekawa and Mantiuk 2014, eq. 2)."""

E2_DEG = 3.118
"""Eccentricity at which the cut-off has halved [deg] (Siekawa and Mantiuk 2014, eq. 2)."""

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


def _linear(name: str, source: str, formula: str, valid_deg: float, floor_deg: float, slope: float) -> AcuityModel:
    def cut_off_cpd(eccentricity_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.5 / (floor_deg + slope * eccentricity_deg)

    return AcuityModel(name, source, formula, valid_deg, 0.5 / floor_deg, cut_off_cpd, (floor_deg, slope))


PELI = _linear(
    "peli",
    source="Peli, Yang and Goldstein 1991, as Siekawa and Mantiuk 2014 use it, eq. 2",
    formula="43.1 * 3.118 / (3.118 + E)",
    valid_deg=23.0,
    floor_deg=1 / (2 * E1_CPD),
    slope=1 / (2 * E1_CPD * E2_DEG),
)

_GEISLER_PERRY_FLOOR_DEG = GEISLER_PERRY_ALPHA / (2 * GEISLER_PERRY_LOG_CONTRAST)

GEISLER_PERRY = _linear(
    "geisler-perry",
    source="Geisler and Perry 1998",
    formula="2.3 * ln(64) / (0.106 * (2.3 + E))",
    valid_deg=30.0,
    floor_deg=_GEISLER_PERRY_FLOOR_DEG,
    slope=_GEISLER_PERRY_FLOOR_DEG / GEISLER_PERRY_E2_DEG,
)

GUENTER = _linear(
    "guenter",
    source="Guenter, Finch, Drucker, Tan and Snyder 2012: the slope that their observers accept",
    formula="1 / (2 * (1/48 + 1.32/60 * E))",
    valid_deg=30.0,
    floor_deg=GUENTER_FOVEA_DEG,
    slope=GUENTER_SLOPE,
)
