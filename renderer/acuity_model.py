"""What a model of acuity is: a formula for the finest detail seen at an eccentricity, where it comes from and holds."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LARGEST_ECCENTRICITY_DEG = 180.0
"""Eccentricity up to which every model must answer [deg]; beyond its valid range it extrapolates."""

STEPS_PER_DEG = 64
"""Nodes a degree at which a formula too costly for each pixel is tabulated. The unit angle between them is
interpolated: at most 1e-6 of it too wide, for every model that is tabulated."""


@dataclass(frozen=True, slots=True)
class AcuityModel:
    """One model of what the eye resolves away from the gaze.

    Attributes:
        name: what requests call it.
        source: authors, year, and which of their equations.
        formula: the cut-off frequency, as one line of text.
        valid_deg: eccentricities that its authors' data or definition cover, 0 to this [deg].
        limit_cpd: highest cut-off it states [cpd].
        cut_off_cpd: cut-off frequency [cpd] at eccentricities of 0 to 180 deg, float64 of any shape; never rises,
            and may exceed `limit_cpd`, which then holds.
        line: the unit angle where it is a line in eccentricity, (at the gaze [deg], slope [deg/deg]), else None.
    """

    name: str
    source: str
    formula: str
    valid_deg: float
    limit_cpd: float
    cut_off_cpd: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    line: tuple[float, float] | None = None


@functools.cache
def unit_angle_table(model: AcuityModel) -> NDArray[np.float64]:
    """Unit angle [deg] at every 1/64 deg from 0 to 180, (11521,) float64, read-only, without the model's limit."""
    eccentricities = np.arange(int(LARGEST_ECCENTRICITY_DEG) * STEPS_PER_DEG + 1) / STEPS_PER_DEG
    table = 0.5 / model.cut_off_cpd(eccentricities)
    table.flags.writeable = False
    return table
