"""Meshes, lights and cameras moved to their places in the scene."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.scene import Mesh, PointLight


def placed(mesh: Mesh, world_from_mesh: NDArray[np.float64]) -> Mesh:
    """`mesh` under an affine transform, which may mirror and scale unequally.

    Args:
        mesh: to be moved; it is not changed.
        world_from_mesh: (4, 4) float64 with last row 0 0 0 1.

    Returns:
        The mesh with moved vertices. Normals follow by the inverse transpose, so that they stay square to
        the surface, tangents by the transform itself; where the transform mirrors, the faces are wound the
        other way, so that counter-clockwise still means outside, and tangents change their handedness.

    Raises:
        SceneError: for vertices that leave the range of a scene.
    """
    linear = world_from_mesh[:3, :3]
    cofactor, mirrors = _cofactor(linear)
    with np.errstate(all="ignore"):
        vertices = mesh.vertices @ linear.T + world_from_mesh[:3, 3]
        normals = None if mesh.normals is None else mesh.normals @ cofactor.T
        tangents = mesh.tangents
        if tangents is not None:
            side = -tangents[:, 3:] if mirrors else tangents[:, 3:]
            tangents = np.hstack([tangents[:, :3] @ linear.T, side])
    return dataclasses.replace(
        mesh,
        vertices=vertices,
        faces=np.ascontiguousarray(mesh.faces[:, ::-1]) if mirrors else mesh.faces,
        normals=normals,
        tangents=tangents,
    )


def placed_light(light: PointLight, world_from_model: NDArray[np.float64]) -> PointLight:
    """`light` moved with the model that it lights; what the model receives stays the same at any scale.

    Args:
        light: to be moved.
        world_from_model: (4, 4) affine transform. Under unequal scales the mean one counts.

    Raises:
        SettingsError: for a light that leaves the range of a scene.
    """
    x, y, z = (world_from_model[:3, :3] @ light.position + world_from_model[:3, 3]).tolist()
    area = abs(float(np.linalg.det(world_from_model[:3, :3]))) ** (2 / 3)
    red, green, blue = (part * area for part in light.intensity)
    return dataclasses.replace(light, position=(x, y, z), intensity=(red, green, blue))


def placed_camera(camera: Camera, world_from_model: NDArray[np.float64]) -> Camera:
    """`camera` moved with the model that it looks at.

    Raises:
        SettingsError: for a transform that flattens the view.
    """
    linear, origin = world_from_model[:3, :3], world_from_model[:3, 3]
    px, py, pz = (linear @ camera.position + origin).tolist()
    ax, ay, az = (linear @ camera.look_at + origin).tolist()
    ux, uy, uz = (linear @ camera.up).tolist()
    return dataclasses.replace(camera, position=(px, py, pz), look_at=(ax, ay, az), up=(ux, uy, uz))


def _cofactor(linear: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """A positive multiple of the inverse transpose, and whether `linear` mirrors.

    The cofactors are the determinant times the inverse transpose; they need no division, so a transform
    that flattens the mesh is no special case.
    """
    size = float(np.abs(linear).max())
    a, b, c = linear / size if size > 0.0 else linear
    cofactor = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    mirrors = bool(np.dot(a, cofactor[0]) < 0.0)
    return (-cofactor if mirrors else cofactor), mirrors
