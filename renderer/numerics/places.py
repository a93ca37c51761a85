"""Coordinates: moved to the middle of the scene before they are rounded to float32, or afterwards."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from renderer.numerics.comparison import Comparison, time_ratio

POINTS = 300_000


def _first(there: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.asarray(there - there.mean(axis=0), dtype=np.float32)


def _late(there: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.asarray(there.astype(np.float32) - there.mean(axis=0).astype(np.float32))


def compare_places() -> tuple[Comparison, ...]:
    """Errors of vertices of a scene far from the origin."""
    rng = np.random.default_rng(18)
    points = rng.uniform(-1, 1, (POINTS, 3))
    lines = []
    for away in (1e3, 1e6):
        there = points + away
        exact = there - there.mean(axis=0)
        error, late = (float(np.abs(part - exact).max()) / 2 for part in (_first(there), _late(there)))
        ratio = time_ratio(functools.partial(_first, there), functools.partial(_late, there))
        lines.append(
            Comparison(f"scene {away / 2:,.0f} sizes away", "largest error of a vertex [sizes]",
                       "centred in float64", "centred in float32", error, late, ratio)
        )  # fmt: skip
    return tuple(lines)
