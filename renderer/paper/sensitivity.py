"""Contrast sensitivity away from the gaze: the curves of the paper's figure 1.

The paper prints how the threshold grows with eccentricity (eq. 1), but not the threshold at the fovea that
it starts from; a common fit takes its place.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.acuity import contrast_threshold

FOVEAL_GAIN: Final = 75.0
FOVEAL_RISE: Final = 0.8
FOVEAL_DECAY_DEG: Final = 0.2
"""S(0, f) = 75 * f^0.8 * exp(-0.2 f), f in cpd: the form a f^c exp(-b f) of Movshon and Kiorpes (1988) with the
constants that Johnson and Fairchild (2003) are quoted with. Checked against public programs that use it, one of them
supplementary to Preiss, Fernandes and Urban (2014), for the form, and two others for the constants; the two papers
themselves could not be read.
"""

FALL_OFF: Final = 0.040
"""k of eq. 1 [1/(cpd deg)], of the paper's range 0.030 to 0.057: with it the curves fall to 1 within 6 % of the
cut-off of eq. 2, but for those within 2.5 deg of the gaze (17 % at the fovea)."""

ECCENTRICITIES_DEG: Final = (0.0, 2.5, 5.0, 10.0, 15.0, 20.0, 30.0)
"""Eccentricities of the curves [deg]."""

FREQUENCY_RANGE_CPD: Final = (0.5, 60.0)
FREQUENCIES: Final = 200


def foveal_sensitivity(frequency_cpd: ArrayLike) -> NDArray[np.float64]:
    """Contrast sensitivity at the fovea, 1 / C_t(0, f), by the fit that stands at `FOVEAL_GAIN`.

    Args:
        frequency_cpd: spatial frequency f [cpd], any shape, 0 or more.

    Returns:
        float64, same shape: 0 at frequency 0, 102 at most, at 4 cpd; below 1 no contrast is seen.
    """
    frequency = np.asarray(frequency_cpd, dtype=np.float64)
    return FOVEAL_GAIN * frequency**FOVEAL_RISE * np.exp(-FOVEAL_DECAY_DEG * frequency)


def sensitivity(frequency_cpd: ArrayLike, eccentricity_deg: ArrayLike, k: float = FALL_OFF) -> NDArray[np.float64]:
    """Contrast sensitivity 1 / C_t(E, f) (Siekawa and Mantiuk 2014, eq. 1).

    Args:
        frequency_cpd: spatial frequency f [cpd], any shape, above 0.
        eccentricity_deg: E [deg], same or broadcastable shape, 0 or more.
        k: fall-off [1/(cpd deg)], 0.030 to 0.057 in the literature.

    Returns:
        float64, the broadcast shape.
    """
    return 1 / contrast_threshold(frequency_cpd, eccentricity_deg, 1 / foveal_sensitivity(frequency_cpd), k)


def frequencies_cpd() -> NDArray[np.float64]:
    """(n,) float64 frequencies of the curves, evenly spaced in their logarithm [cpd]."""
    return np.geomspace(*FREQUENCY_RANGE_CPD, FREQUENCIES)
