"""Unit vectors out of vectors of any length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors of unit length; 0 for those that are 0 or not finite. Safe for any length."""
    finite = np.where(np.isfinite(vectors).all(axis=-1, keepdims=True), vectors, 0.0)
    largest = np.abs(finite).max(axis=-1, keepdims=True)
    reduced = finite / np.where(largest > 0.0, largest, 1.0)
    length = np.linalg.norm(reduced, axis=-1, keepdims=True)
    return np.asarray(reduced / np.where(length > 0.0, length, 1.0))
