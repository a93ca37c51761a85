"""Acuity from a contrast sensitivity function fitted to data of many studies: stelaCSF.

R. K. Mantiuk, M. Ashraf and A. Chapiro, "stelaCSF: a unified model of contrast sensitivity as the function of
spatio-temporal frequency, eccentricity, luminance and area", ACM Transactions on Graphics 41(4), 2022. What is
here is for patterns that do not flicker, in luminance; the constants are those their program of August 2022 holds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.acuity_model import AcuityModel

SCREEN_CD_M2 = 100.0
"""Luminance that the eye is taken to be adapted to: that of a usual screen [cd/m^2]."""

PATTERN_DEG2 = 1.0
"""Area of the pattern that is just seen [deg^2]."""

LIMIT_CPD = 64.0
"""Highest frequency that the model is defined for [cpd]; near the gaze it would see finer detail still."""

LAST_ECCENTRICITY_DEG = 60.0
"""Where the cut-off is followed to [deg]. At 67 deg no pattern of the area is seen at any contrast; before that
the cut-off plunges. Beyond, it stays what it is here: finer cells than the model asks for."""

LOWEST_CPD = 0.5
"""Start of the search for the cut-off [cpd], where every pattern up to `LAST_ECCENTRICITY_DEG` is seen."""

HIGHEST_CPD = 1024.0
"""End of that search [cpd], where nothing is seen."""

HALVINGS = 60
"""Steps of the search: enough to leave no more than rounding of the logarithm."""


class FallOff(NamedTuple):
    """Loss of log10 sensitivity with eccentricity, along one side of the visual field.

    Attributes:
        alone: whatever the frequency [1/deg].
        with_frequency: in proportion to it [1/(deg cpd)].
    """

    alone: float
    with_frequency: float


SIDES = {"temporal": FallOff(0.02694, 0.02010), "nasal": FallOff(0.01351, 0.01713)}
"""Of the visual field: temporal is away from the nose. Vertical meridians are as the temporal one."""


def sensitivity(
    frequency_cpd: ArrayLike,
    eccentricity_deg: ArrayLike,
    side: str,
    luminance_cd_m2: float = SCREEN_CD_M2,
    area_deg2: float = PATTERN_DEG2,
) -> NDArray[np.float64]:
    """Contrast sensitivity, 1 over the smallest contrast that is seen (Mantiuk et al. 2022).

    Args:
        frequency_cpd: spatial frequency [cpd], any shape, above 0; the model is defined from 1/16 to 64.
        eccentricity_deg: angle from the gaze [deg], same or broadcastable shape, 0 to 120.
        side: of the visual field, `temporal` or `nasal`.
        luminance_cd_m2: of the background [cd/m^2], 0.001 to 10,000; a second factor of the model, 1 to four
            digits from 1 cd/m^2 on, is left out.
        area_deg2: of the pattern [deg^2].

    Returns:
        float64.
    """
    frequency = np.asarray(frequency_cpd, dtype=np.float64)
    highest = 65.40 * (1 + 29.83 / luminance_cd_m2) ** -0.2038
    peak_cpd = 1.565 * (1 + 51.19 / luminance_cd_m2) ** -0.245
    parabola = 10 ** -((np.log10(frequency / peak_cpd)) ** 2 / 2**1.12573)
    parabola = np.where(frequency < peak_cpd, np.maximum(parabola, 0.9164), parabola)
    critical_area = 270 / (1 + (frequency / 0.65) ** 2)
    foveal = highest * parabola * frequency * np.sqrt(critical_area / (1 + critical_area / area_deg2))
    alone, with_frequency = SIDES[side]
    loss = (alone + with_frequency * frequency) * np.asarray(eccentricity_deg, dtype=np.float64)
    return np.asarray(foveal * 10**-loss)


def seen_up_to_cpd(
    eccentricity_deg: ArrayLike, side: str, luminance_cd_m2: float = SCREEN_CD_M2
) -> NDArray[np.float64]:
    """Highest frequency seen at full contrast: where the sensitivity has fallen to 1.

    Args:
        eccentricity_deg: angle from the gaze [deg], any shape, 0 to where `LOWEST_CPD` is still seen.
        side: of the visual field, `temporal` or `nasal`.
        luminance_cd_m2: of the background [cd/m^2].

    Returns:
        float64 [cpd], same shape; `LIMIT_CPD` is not applied.
    """
    angle = np.asarray(eccentricity_deg, dtype=np.float64)
    low, high = np.full(angle.shape, np.log(LOWEST_CPD)), np.full(angle.shape, np.log(HIGHEST_CPD))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        seen = sensitivity(np.exp(middle), angle, side, luminance_cd_m2) >= 1
        low, high = np.where(seen, middle, low), np.where(seen, high, middle)
    return np.asarray(np.exp(low))


def _nasal_cut_off_cpd(eccentricity_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """That of the nasal side, which sees more: what is temporal to one of the two eyes is nasal to the other."""
    return seen_up_to_cpd(np.minimum(eccentricity_deg, LAST_ECCENTRICITY_DEG), "nasal")


STELACSF = AcuityModel(
    "stelacsf",
    source="Mantiuk, Ashraf and Chapiro 2022: static pattern of 1 deg^2 at 100 cd/m^2, nasal side",
    formula="the highest frequency f with S(f, E) = 1, at most 64",
    valid_deg=LAST_ECCENTRICITY_DEG,
    limit_cpd=LIMIT_CPD,
    cut_off_cpd=_nasal_cut_off_cpd,
)
