"""Which lights can be noticed: not a black one, one that faces away, or one too far off to change a pixel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.scene import Light, Material, PointLight, RectangleLight, Scene, SphereLight
from renderer.tonemap import SMALLEST_STEP


class _Box(NamedTuple):
    """Corners of an upright box, (3,) float64 each [m]."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]


def reaching_lights(scene: Scene) -> tuple[Light, ...]:
    """The lights of `scene` that can change an 8-bit pixel, in their order.

    The others are those that shine on nothing, and the faintest of those whose light, all of them together
    at the place of the geometry nearest to each, stays below half the smallest step of an 8-bit code.
    """
    box = _bounds(scene)
    if box is None:
        return ()
    response = max((_strongest(material) for material in _materials(scene)), default=0.0)
    share = {
        number: scene.exposure * response * _most_irradiance(light, box)
        for number, light in enumerate(scene.lights)
        if any(light.intensity if isinstance(light, PointLight) else light.radiance)
    }
    left_out, unseen = set(), 0.0
    for number in sorted(share, key=lambda number: share[number]):
        unseen += share[number]
        if not unseen < SMALLEST_STEP:
            break
        left_out.add(number)
    return tuple(light for number, light in enumerate(scene.lights) if number in share and number not in left_out)


def _materials(scene: Scene) -> set[Material]:
    return {mesh.material for mesh in scene.meshes if len(mesh.faces)} | {sphere.material for sphere in scene.spheres}


def _strongest(material: Material) -> float:
    """Bound on the radiance that a surface sends anywhere for an irradiance of 1; Ashikhmin and Shirley have none."""
    if material.base == "ashikhmin-shirley":
        return math.inf
    return max(material.diffuse) / math.pi + max(material.specular)


def _bounds(scene: Scene) -> _Box | None:
    """A box around everything that light can fall on; None where there is nothing."""
    lows, highs = [], []
    for mesh in scene.meshes:
        if len(mesh.faces):
            corners = mesh.vertices[mesh.faces.ravel()]
            lows.append(corners.min(axis=0))
            highs.append(corners.max(axis=0))
    for sphere in scene.spheres:
        lows.append(np.subtract(sphere.center, sphere.radius))
        highs.append(np.add(sphere.center, sphere.radius))
    return _Box(np.min(lows, axis=0), np.max(highs, axis=0)) if lows else None


def _most_irradiance(light: Light, box: _Box) -> float:
    """Bound on what arrives of a light anywhere in a box, in its strongest channel; infinite near a point light."""
    if isinstance(light, PointLight):
        square = _distance(_Box(np.array(light.position), np.array(light.position)), box) ** 2
        return max(light.intensity) / square if square > 0.0 else math.inf
    if isinstance(light, SphereLight):
        center = np.array(light.center)
        distance = max(light.radius, _distance(_Box(center, center), box))
        return max(light.radiance) * math.pi * (light.radius / distance) ** 2
    if not light.two_sided and _is_behind(light, box):
        return 0.0
    corners = np.array(light.corner) + [
        np.multiply(light.edge_u, u) + np.multiply(light.edge_v, v) for u in (0, 1) for v in (0, 1)
    ]
    square = _distance(_Box(corners.min(axis=0), corners.max(axis=0)), box) ** 2
    area = math.hypot(*light.edge_u) * math.hypot(*light.edge_v)
    return max(light.radiance) * (min(math.pi, area / square) if square > 0.0 else math.pi)


def _is_behind(light: RectangleLight, box: _Box) -> bool:
    """Whether the whole box is on the dark side of the rectangle's plane."""
    normal = np.cross(np.array(light.edge_u) / math.hypot(*light.edge_u), np.array(light.edge_v))
    nearest = np.where(normal > 0.0, box.high, box.low) - light.corner
    return bool(nearest @ normal < 0.0)


def _distance(one: _Box, other: _Box) -> float:
    """Distance between two boxes [m], 0 where they meet."""
    return math.hypot(*np.maximum(0.0, np.maximum(one.low - other.high, other.low - one.high)))
