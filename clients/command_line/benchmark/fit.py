"""How one quantity grows with another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class PowerLaw:
    """y = factor * x^exponent.

    Attributes:
        factor: y at x = 1.
        exponent: 1 for what grows in proportion, 0 for what does not grow.
    """

    factor: float
    exponent: float

    def at(self, x: float) -> float:
        """y at `x`, above 0."""
        return float(self.factor * x**self.exponent)


def fitted_power_law(x: Sequence[float], y: Sequence[float]) -> PowerLaw:
    """The power law nearest to the points: least squares of the logarithms.

    Args:
        x: above 0, at least two different ones.
        y: above 0, as many.

    Raises:
        ValueError: for numbers without such a law.
    """
    across, up = np.array(x, dtype=np.float64), np.array(y, dtype=np.float64)
    if not (across.shape == up.shape and (across > 0).all() and (up > 0).all() and len(set(x)) > 1):
        raise ValueError(f"expected positive numbers, at least two different x, found x {list(x)} and y {list(y)}")
    exponent, height = np.polyfit(np.log(across), np.log(up), 1)
    return PowerLaw(float(np.exp(height)), float(exponent))
