"""Vertex normals from smoothing groups."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

GROUPS = 32
"""Smoothing groups of a face, one a bit."""


class Smoothed(NamedTuple):
    """A mesh whose vertices are parted where its surface has an edge.

    Attributes:
        rows: (k,) int64, for each new vertex the old one.
        faces: (m, 3) int64 indices into `rows`.
        normals: (k, 3) float64, weighted by the faces' areas; zero where faces are flat.
    """

    rows: NDArray[np.int64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64]


def smoothed(vertices: NDArray[np.float64], faces: NDArray[np.int64], groups: NDArray[np.uint32]) -> Smoothed:
    """Normals that are smooth over faces of a common group.

    Faces that meet in a place are smooth there if they have a group in common, also by way of a third face
    there. Places are compared, not indices, so that seams of a texture do not show.

    Args:
        vertices: (n, 3).
        faces: (m, 3).
        groups: (m,) one bit a group; 0 for a flat face.
    """
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    places = place.ravel()[faces].ravel()
    masks = _joined(places, np.repeat(groups, 3))
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    own = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    _, shade = np.unique(np.stack([places, masks]), axis=1, return_inverse=True)
    shade = shade.ravel()
    sums = np.stack([np.bincount(shade, own[:, axis]) for axis in range(3)], axis=1)
    corners, index = np.unique(np.stack([faces.ravel(), masks]), axis=1, return_inverse=True)
    index = index.ravel()
    normals = np.zeros((corners.shape[1], 3))
    normals[index] = np.where(masks[:, None] != 0, sums[shade], 0.0)
    return Smoothed(corners[0], index.reshape(-1, 3), normals)


def _joined(places: NDArray[np.int64], masks: NDArray[np.uint32]) -> NDArray[np.int64]:
    """For each corner the groups of all corners of its place that hang together with it by common groups."""
    joined = masks.astype(np.int64)
    if (joined & (joined - 1) == 0).all():
        return joined
    count = int(places.max()) + 1
    while True:
        before = joined.copy()
        for bit in range(GROUPS):
            member = np.flatnonzero(joined >> bit & 1)
            if len(member):
                union = np.zeros(count, dtype=np.int64)
                np.bitwise_or.at(union, places[member], joined[member])
                joined[member] = union[places[member]]
        if (joined == before).all():
            return joined
