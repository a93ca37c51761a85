"""Scenes by the number of their seed: every effect, everything somewhere, nothing in line with anything."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.scene import (
    Light,
    Material,
    Mesh,
    PointLight,
    RectangleLight,
    Rgb,
    Scene,
    Sphere,
    SphereLight,
    Surroundings,
    Texture,
)
from tests.renderer.drawing import icosphere

CHECKS = Texture(np.uint8([[[230] * 3, [60, 40, 30]], [[50, 60, 40], [220] * 3]]))
MATERIALS = (
    Material("matt", diffuse=(0.7, 0.5, 0.3)),
    Material("tiles", diffuse=(0.8, 0.8, 0.7), diffuse_texture=CHECKS),
    Material("gloss", diffuse=(0.2, 0.4, 0.7), specular=(0.4, 0.4, 0.4), shininess=40.0, reflection=(0.2, 0.2, 0.2)),
    Material("mirror", diffuse=(0.0, 0.0, 0.0), reflection=(0.8, 0.9, 0.8)),
    Material("glass", diffuse=(0.0, 0.0, 0.0), transmission=(1.0, 1.0, 1.0)),
    Material("metal", specular=(0.8, 0.7, 0.5), base="ashikhmin-shirley", exponent_u=60.0, exponent_v=60.0),
)
GRID = 2.0**-10
"""Spacing of the coordinates of scenes that can be moved by whole numbers without rounding."""

EVEN = Surroundings((0.3, 0.4, 0.5), (0.3, 0.4, 0.5), (0.1, 0.1, 0.1))
"""The same from everywhere, so that a scene may be turned."""


def _triple(vector: NDArray[np.float64]) -> Rgb:
    x, y, z = vector.tolist()
    return x, y, z


def random_scene(seed: int) -> Scene:
    """A floor, loose triangles, a smooth ball, spheres, lights of every kind; about 4 across, on the grid."""
    rng = np.random.default_rng(seed)

    def somewhere(low: float, high: float, *shape: int) -> NDArray[np.float64]:
        return np.round(rng.uniform(low, high, (*shape, 3)) / GRID) * GRID

    def some_material() -> Material:
        return MATERIALS[rng.integers(len(MATERIALS))]

    ground = somewhere(-0.1, 0.1, 4) + np.array([(-2, -1, 2), (2, -1, 2), (2, -1, -2), (-2, -1, -2)])
    corners = (somewhere(-1, 1, 8)[:, None] + somewhere(-0.6, 0.6, 8, 3)).reshape(-1, 3)
    ball, faces = icosphere(1)
    round_ball = np.round((ball * rng.uniform(0.2, 0.5) + somewhere(-1, 1)) / GRID) * GRID
    uvs = rng.uniform(-2, 2, (24, 2))
    meshes = (
        Mesh(ground, np.array([[0, 1, 2], [0, 2, 3]]), MATERIALS[1], uvs=uvs[:4]),
        Mesh(corners, np.arange(24).reshape(-1, 3), some_material(), uvs=uvs),
        Mesh(round_ball, faces, some_material(), ball.copy()),
    )
    spheres = tuple(
        Sphere(_triple(somewhere(-1, 1)), float(rng.integers(100, 500)) * GRID, some_material())
        for _ in range(rng.integers(0, 4))
    )
    lights: list[Light] = [
        PointLight(_triple(somewhere(-3, 3) + (0, 3.5, 0)), _triple(rng.uniform(2, 12, 3)))
        for _ in range(rng.integers(1, 4))
    ]
    size = rng.uniform(0.2, 1, 2).tolist()
    for _ in range(rng.integers(0, 3)):
        corner = _triple(somewhere(-2, 2) + (0, 4, 0))
        radiance = _triple(rng.uniform(2, 6, 3))
        lights.append(RectangleLight(corner, (size[0], 0, 0), (0, 0, size[1]), radiance, two_sided=True))
    if rng.random() < 0.4:
        lights.append(SphereLight(_triple(somewhere(-2, 2) + (0, 4, 0)), size[0], (3.0, 4.0, 5.0)))
    camera = Camera(_triple(somewhere(-1, 1) + (0, 1, 4)), _triple(somewhere(-0.2, 0.2)), (0.1, 1.0, 0.05), 45.0)
    return Scene(meshes, spheres, tuple(lights), EVEN, camera)


def random_rotation(rng: np.random.Generator) -> NDArray[np.float64]:
    """(3, 3) float64, evenly distributed."""
    turned, triangle = np.linalg.qr(rng.normal(size=(3, 3)))
    turned = turned * np.sign(np.diagonal(triangle))
    return np.asarray(turned * np.sign(np.linalg.det(turned)))


def placed(
    scene: Scene, factor: float = 1.0, rotation: NDArray[np.float64] | None = None, offset: Rgb = (0.0, 0.0, 0.0)
) -> Scene:
    """The whole scene and its camera larger by `factor`, then turned, then elsewhere; light falls as before."""

    def turned(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        return vectors if rotation is None else vectors @ rotation.T

    def place(point: Rgb) -> Rgb:
        return _triple(turned(np.array(point) * factor) + np.array(offset))

    def along(direction: Rgb, stretch: float) -> Rgb:
        return _triple(turned(np.array(direction) * stretch))

    def light(lamp: Light) -> Light:
        if isinstance(lamp, PointLight):
            red, green, blue = (factor * factor * part for part in lamp.intensity)
            return dataclasses.replace(lamp, position=place(lamp.position), intensity=(red, green, blue))
        if isinstance(lamp, SphereLight):
            return dataclasses.replace(lamp, center=place(lamp.center), radius=lamp.radius * factor)
        edge_u, edge_v = along(lamp.edge_u, factor), along(lamp.edge_v, factor)
        return dataclasses.replace(lamp, corner=place(lamp.corner), edge_u=edge_u, edge_v=edge_v)

    def mesh(old: Mesh) -> Mesh:
        normals = None if old.normals is None else turned(old.normals)
        return dataclasses.replace(old, vertices=turned(old.vertices * factor) + np.array(offset), normals=normals)

    eye = scene.camera
    return dataclasses.replace(
        scene,
        meshes=tuple(mesh(old) for old in scene.meshes),
        spheres=tuple(dataclasses.replace(s, center=place(s.center), radius=s.radius * factor) for s in scene.spheres),
        lights=tuple(light(lamp) for lamp in scene.lights),
        camera=Camera(place(eye.position), place(eye.look_at), along(eye.up, 1.0), eye.vertical_fov_deg),
    )
