"""Tangents: which way the grain of a surface runs.

It runs along the texture coordinate u: on a mesh by its texture coordinates, averaged at the vertices of
smooth meshes, on a sphere along the parallels. Where there are no texture coordinates it follows a field
that depends on the normal alone. No such field is continuous all over the sphere (Poincaré and Brouwer's
hairy ball); this one, the constant field of a plane projected stereographically, is continuous but for a
single point, straight down. That is the frame of Frisvad (2012) with its pole below; the reformulation of
Duff et al. (2017) is more accurate at the pole but jumps along the whole equator.

A grain has no sense of direction: a tangent and its opposite look the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.direction import unit
from renderer.kernel import formula
from renderer.scene import Mesh

TANGENT = 9
"""Numbers of a triangle's tangents: a unit vector for each corner, 0 where nothing says where u runs."""


def mesh_tangents(mesh: Mesh) -> NDArray[np.float64]:
    """(m, TANGENT) float64: where u runs at the corners of each face.

    On a smooth mesh the faces around a vertex share a tangent, their mean by area; on a flat one each face
    has its own. Faces without extent in texture coordinates get zeros.
    """
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
    if mesh.normals is None:
        return np.tile(own, (1, 3))
    largest = float(area.max(initial=0.0))
    shared = np.zeros((len(mesh.vertices), 3))
    for corner in range(3):
        np.add.at(shared, mesh.faces[:, corner], own * (area / largest if largest > 0.0 else area))
    return unit(shared)[mesh.faces].reshape(-1, TANGENT)


@formula
def tangent_of_normal(nx: float, ny: float, nz: float) -> tuple[float, float, float]:
    """A vector across a unit normal, continuous but for the normal (0, -1, 0); see above."""
    if ny >= 0.0:
        shrink = 1.0 / (1.0 + ny)
    else:
        across = nx * nx + nz * nz
        if not across > 0.0:
            return 0.0, 0.0, 1.0
        shrink = (1.0 - ny) / across
    return -nz * nx * shrink, -nz, 1.0 - nz * nz * shrink
