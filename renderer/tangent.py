"""Tangents: which way the grain of a surface runs.

It runs along the texture coordinate u: on a mesh by its texture coordinates, averaged at the vertices of
smooth meshes, on a sphere along the parallels. Where there are no texture coordinates it follows a field
that depends on the normal alone. No such field is continuous all over the sphere (Poincaré and Brouwer's
hairy ball); this one, the constant field of a plane projected stereographically, is continuous but for a
single point, straight down. That is the frame of Frisvad (2012) with its pole below; the reformulation of
Duff et al. (2017) is more accurate at the pole but jumps along the whole equator.

A grain has no sense of direction: a tangent and its opposite look the same. Normal maps need more: the side on
which v runs, too, which is the other one where texture coordinates are mirrored.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.direction import unit
from renderer.kernel import formula
from renderer.lanes import choose
from renderer.scene import Mesh

TANGENT = 10
"""Numbers of a triangle's tangents: a unit vector for each corner, 0 where nothing says where u runs; handedness."""

HANDED_COLUMN = 9
"""1 where v runs along the cross product of the outward normal and the tangent, -1 where against it, 0 where
nothing says."""


def mesh_tangents(mesh: Mesh) -> NDArray[np.float64]:
    """(m, TANGENT) float64: where u runs at the corners of each face, and its handedness.

    A smooth mesh may state tangents. Else the faces around a vertex share one, their mean by area, those with
    mirrored texture coordinates another; on a flat mesh each face has its own. Faces without extent in texture
    coordinates get zeros.
    """
    if mesh.tangents is not None and mesh.normals is not None:
        stated = mesh.tangents[mesh.faces]
        sides = np.sign(np.nan_to_num(stated[:, :, 3])).sum(axis=1, keepdims=True)
        return np.hstack([unit(stated[:, :, :3]).reshape(-1, HANDED_COLUMN), np.sign(sides)])
    if mesh.uvs is None:
        return np.zeros((len(mesh.faces), TANGENT))
    corners, uvs = mesh.vertices[mesh.faces], mesh.uvs[mesh.faces]
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    with np.errstate(all="ignore"):
        (du_1, dv_1), (du_2, dv_2) = (uvs[:, 1] - uvs[:, 0]).T, (uvs[:, 2] - uvs[:, 0]).T
        winding = np.sign(du_1 * dv_2 - du_2 * dv_1)
        along_u = winding[:, None] * (edge_1 * dv_2[:, None] - edge_2 * dv_1[:, None])
        own = unit(along_u)
        area = np.linalg.norm(np.cross(edge_1, edge_2), axis=1, keepdims=True)
    handed = np.nan_to_num(winding)[:, None]
    if mesh.normals is None:
        return np.hstack([np.tile(own, (1, 3)), handed])
    largest = float(area.max(initial=0.0))
    shared = np.zeros((2 * len(mesh.vertices), 3))
    place = mesh.faces + len(mesh.vertices) * (handed < 0.0)
    for corner in range(3):
        np.add.at(shared, place[:, corner], own * (area / largest if largest > 0.0 else area))
    return np.hstack([unit(shared)[place].reshape(-1, HANDED_COLUMN), handed])


@formula
def tangent_of_normal(nx: float, ny: float, nz: float) -> tuple[float, float, float]:
    """A vector across a unit normal, continuous but for the normal (0, -1, 0); see above. Takes numbers or lanes."""
    across = nx * nx + nz * nz
    up = ny >= 0.0
    shrink = choose(up, 1.0, 1.0 - ny) / choose(up, 1.0 + ny, across)
    known = up | (across > 0.0)
    return choose(known, -nz * nx * shrink, 0.0), choose(known, -nz, 0.0), choose(known, 1.0 - nz * nz * shrink, 1.0)
