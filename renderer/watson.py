"""Acuity from the retina: the lattice of midget ganglion cells (Watson 2014).

A. B. Watson, "A formula for human retinal ganglion cell receptive field density as a function of visual field
location", Journal of Vision 14(7):15, 2014. Eccentricities are in degrees of the visual field, along one of its
four meridians.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.acuity_model import AcuityModel

FOVEAL_CONES_PER_DEG2 = 14804.6
"""Peak density of cones, which is that of receptive fields of each of their two kinds [1/deg^2]."""

FOVEAL_MIDGET_FRACTION = 1 / 1.12
"""Share of midget cells among ganglion cells at the fovea (after Drasdo et al. 2007)."""

MIDGET_FALL_OFF_DEG = 41.03
"""Eccentricity at which that share has halved [deg] (eq. 7)."""


class Meridian(NamedTuple):
    """Fall-off along one meridian of the visual field (Watson 2014, eq. 4 and Table 1).

    Attributes:
        weight: a, share of the hyperbolic term.
        hyperbola_deg: r2, where that term has fallen to a quarter [deg].
        decay_deg: re, where the exponential term has fallen to 1/e [deg].
    """

    weight: float
    hyperbola_deg: float
    decay_deg: float


MERIDIANS = {
    "temporal": Meridian(0.9851, 1.058, 22.14),
    "superior": Meridian(0.9935, 1.035, 16.35),
    "nasal": Meridian(0.9729, 1.084, 7.633),
    "inferior": Meridian(0.9960, 0.9932, 12.13),
}


def midget_density(eccentricity_deg: ArrayLike, meridian: str) -> NDArray[np.float64]:
    """Receptive fields of midget ganglion cells, of both kinds (Watson 2014, eq. 8).

    Args:
        eccentricity_deg: angle from the line of sight [deg], any shape, 0 or more.
        meridian: of the visual field: `temporal`, `superior`, `nasal` or `inferior`.

    Returns:
        float64 [1/deg^2], same shape.
    """
    angle = np.asarray(eccentricity_deg, dtype=np.float64)
    a, r2, re = MERIDIANS[meridian]
    fall_off = a * (1 + angle / r2) ** -2 + (1 - a) * np.exp(-angle / re)
    ganglion_cells = 2 / FOVEAL_MIDGET_FRACTION * FOVEAL_CONES_PER_DEG2 * fall_off
    return np.asarray(ganglion_cells * FOVEAL_MIDGET_FRACTION / (1 + angle / MIDGET_FALL_OFF_DEG))


def midget_cut_off_cpd(eccentricity_deg: ArrayLike, meridian: str) -> NDArray[np.float64]:
    """Highest frequency that the hexagonal lattice of one kind of midget cells, on or off, can tell.

    Half of the cells make one lattice, of spacing s = sqrt(2/(sqrt(3) D)); it resolves 1/(sqrt(3) s), in its
    worst direction (Watson 2014, eq. 9 and the text after it).

    Args:
        eccentricity_deg: angle from the line of sight [deg], any shape, 0 or more.
        meridian: of the visual field: `temporal`, `superior`, `nasal` or `inferior`.

    Returns:
        float64 [cpd], same shape.
    """
    one_kind = midget_density(eccentricity_deg, meridian) / 2
    spacing_deg = np.sqrt(2 / (math.sqrt(3) * one_kind))
    return np.asarray(1 / (math.sqrt(3) * spacing_deg))


def _finest_cut_off_cpd(eccentricity_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """That of the meridian that sees most: two eyes look at the screen, and each may be turned to it by any side."""
    return np.asarray(np.maximum.reduce([midget_cut_off_cpd(eccentricity_deg, name) for name in MERIDIANS]))


WATSON = AcuityModel(
    "watson",
    source="Watson 2014, eq. 4, 7 and 9: the lattice of midget ganglion cells, finest of the four meridians",
    formula="1 / (sqrt(3) * s), s = sqrt(2 / (sqrt(3) * D / 2)), D = midget cells per square degree",
    valid_deg=90.0,
    limit_cpd=float(_finest_cut_off_cpd(np.zeros(1))[0]),
    cut_off_cpd=_finest_cut_off_cpd,
)
