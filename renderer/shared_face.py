"""Faces that two transparent solids share: one triangle in place of two, which bounds both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
"""Odd multiplier that spreads bits: 2^64 over the golden ratio."""


def mixed_bits(numbers: NDArray[np.float32]) -> NDArray[np.uint64]:
    """A 64-bit hash of each row of (n, columns) float32 numbers."""
    words = numbers.view(np.uint32)
    mixed = np.zeros(len(words), dtype=np.uint64)
    for column in range(words.shape[1]):
        mixed = (mixed ^ words[:, column]) * GOLDEN
        mixed ^= mixed >> np.uint64(29)
    return mixed


def join_faces(
    corners: NDArray[np.float32], normals: NDArray[np.float32], medium: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Find the triangles of media that lie at the same place, whichever corner comes first and whichever way they face.

    Of each such pair the one of the higher medium is kept, which also says what the other bounded.

    Args:
        corners: (m, 3, 3) float32 positions.
        normals: (m, 3) float32 geometric.
        medium: (m,) int64 number of each triangle's medium, 0 where it has none.

    Returns:
        (m,) bool, True for the triangles to keep, and (m,) int64, the medium of the triangle that a kept one stands
        for too: above 0 where it faces the same way, below 0 where it faces the other way, 0 for none.
    """
    keep, other = np.ones(len(medium), dtype=np.bool_), np.zeros(len(medium), dtype=np.int64)
    rows = np.flatnonzero(medium)
    places = np.sort(mixed_bits(corners[rows].reshape(-1, 3) + np.float32(0.0)).reshape(-1, 3), axis=1)
    place = mixed_bits(places.view(np.float32))
    order = np.lexsort((rows, -medium[rows], place))
    rows, place = rows[order], place[order]
    again = np.flatnonzero(place[1:] == place[:-1]) + 1
    keep[rows[again]] = False
    seconds = again[keep[rows[again - 1]]]
    firsts, seconds = rows[seconds - 1], rows[seconds]
    side = np.where((normals[firsts].astype(np.float64) * normals[seconds]).sum(axis=1) > 0.0, 1, -1)
    other[firsts] = side * medium[seconds]
    return keep, other
