"""A view and light for models that come with none."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SceneError, SettingsError
from renderer.model import Model, point_lights
from renderer.scene import BLACK, Material, Mesh, PointLight, Rgb, Scene, Sphere, Surroundings

DEFAULT_MATERIAL: Final = Material("clay", diffuse=(0.62, 0.60, 0.57), specular=(0.10, 0.10, 0.10), shininess=40.0)
"""For meshes whose file states no material: warm light grey with a soft highlight."""

STUDIO: Final = Surroundings(zenith=(0.08, 0.11, 0.17), horizon=(0.42, 0.45, 0.49), ambient=(0.16, 0.17, 0.19))
"""Surroundings of a framed model: a mid-grey horizon, darker above."""

FIELD_OF_VIEW_DEG: Final = 35.0
"""Vertical field of view of a framed view [deg]: that of a 57 mm lens on 35 mm film, for little distortion."""

MARGIN: Final = 1.1
"""Distance of the camera over that from which the model just touches the picture's edges."""

ASPECT: Final = 4 / 3
"""Width over height of the screen that a framed model fits; on wider ones there is room at the sides."""

VIEW: Final = (0.62, 0.38, 0.85)
"""Direction from the model to the camera: three-quarter view from the right, a little above."""

LIGHT_DISTANCE: Final = 4.0
"""Distance of the lights from the model's middle, in radii."""

_LIGHTS: Final = (
    # from the model towards the light, irradiance at the model's middle, casts shadows
    ((-0.45, 0.95, 0.80), (2.30, 2.20, 2.05), True),
    ((1.00, 0.25, 0.45), (0.45, 0.50, 0.60), False),
    ((0.20, 0.55, -1.00), (1.10, 1.15, 1.25), False),
)
"""Key, fill and rim light. Irradiance E shows a white surface that faces the light as E/pi."""


DIMMEST: Final = 0.5
"""Least brightness of a white surface that faces all lights of a file; 1 is the brightest a screen shows."""

BRIGHTEST: Final = 2.0
"""Greatest brightness of the same; lights come from several sides, so what is seen is below it."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """A sphere around a model.

    Attributes:
        center: [m].
        radius: [m], above 0.
    """

    center: tuple[float, float, float]
    radius: float


def frame_model(model: Model, title: str) -> Scene:
    """A scene of a bare model: seen by its own camera and lit by its own lights where its file has them.

    Without a camera it is seen from a three-quarter view, without lights lit by three, at any scale. Files
    state lights in units of their own: the exposure is 1 unless a white surface in the middle that faces all
    the file's lights would show below `DIMMEST` or above `BRIGHTEST`, and else shows it as that.

    Args:
        model: what to show.
        title: one line for people; also names the model in messages.

    Raises:
        SceneError: for a model without triangles or without size, or lights out of range.
    """
    bounds = bounding_sphere(model.meshes, (), title)
    lights = point_lights(model.lights, bounds.center, bounds.radius, title)
    surroundings = STUDIO
    if model.ambient != BLACK:
        surroundings = dataclasses.replace(STUDIO, ambient=model.ambient)
    return Scene(
        meshes=model.meshes,
        lights=lights or framed_lights(bounds, title),
        surroundings=surroundings,
        camera=model.camera or framed_camera(model.meshes, (), bounds),
        exposure=_exposure(lights, bounds),
        title=title,
    )


def _exposure(lights: Sequence[PointLight], bounds: Bounds) -> float:
    """Exposure that shows what `lights` light; 1 without light."""
    white = sum(
        max(light.intensity) / max(math.dist(light.position, bounds.center), bounds.radius) ** 2 / math.pi
        for light in lights
    )
    return min(max(white, DIMMEST), BRIGHTEST) / white if white > 0.0 else 1.0


def bounding_sphere(meshes: Sequence[Mesh], spheres: Sequence[Sphere], title: str) -> Bounds:
    """A sphere around everything that is seen, centred on its bounding box.

    Only vertices that a face uses count.

    Raises:
        SceneError: for a model without anything or without size.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    seen = [_used_vertices(mesh) for mesh in meshes if len(mesh.faces) > 0]
    for points in seen:
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    for sphere in spheres:
        low = np.minimum(low, np.array(sphere.center) - sphere.radius)
        high = np.maximum(high, np.array(sphere.center) + sphere.radius)
    if not (low <= high).all():
        raise SceneError(f"{title}: expected something to show, found no triangle and no sphere")
    center = low + (high - low) / 2
    farthest = [float(np.linalg.norm(points - center, axis=1).max()) for points in seen]
    farthest += [float(np.linalg.norm(sphere.center - center)) + sphere.radius for sphere in spheres]
    radius = max(farthest)
    if radius <= 0.0:
        raise SceneError(f"{title}: expected a model with a size, found all vertices at {center.tolist()}")
    return Bounds(_tuple(center), radius)


def framed_camera(meshes: Sequence[Mesh], spheres: Sequence[Sphere], bounds: Bounds) -> Camera:
    """A camera that looks at the middle of `bounds` from where everything just fits into the picture."""
    back = _unit(VIEW)
    right = _unit((back[2], 0.0, -back[0]))
    axes = np.stack([right, np.cross(back, right), back])
    center = np.array(bounds.center)
    slope = np.array([ASPECT, 1.0]) * math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2)
    points = [_used_vertices(mesh) for mesh in meshes if len(mesh.faces) > 0]
    points += [np.array([sphere.center]) for sphere in spheres]
    radii = [0.0] * (len(points) - len(spheres)) + [sphere.radius for sphere in spheres]
    distance = 1.5 * bounds.radius
    for group, radius in zip(points, radii, strict=True):
        seen = (group - center) @ axes.T
        # a point is seen where its offset is at most slope times its depth, a sphere where its edge is
        needed = seen[:, 2:] + (np.abs(seen[:, :2]) + radius * np.hypot(1.0, slope)) / slope
        distance = max(distance, float(needed.max()))
    return Camera(_tuple(center + back * MARGIN * distance), bounds.center, vertical_fov_deg=FIELD_OF_VIEW_DEG)


def framed_lights(bounds: Bounds, title: str) -> tuple[PointLight, ...]:
    """Key, fill and rim light around the sphere `bounds`; alike at every size, as intensity grows with its square.

    Raises:
        SceneError: for a model so large that its lights leave the range of a scene.
    """
    distance = LIGHT_DISTANCE * bounds.radius
    try:
        return tuple(
            PointLight(
                _tuple(np.array(bounds.center) + _unit(direction) * distance),
                _scaled(irradiance, distance * distance),
                casts_shadows,
            )
            for direction, irradiance, casts_shadows in _LIGHTS
        )
    except SettingsError as error:
        raise SceneError(f"{title}: cannot be lit: {error}") from None


def _used_vertices(mesh: Mesh) -> NDArray[np.float64]:
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.faces.ravel()] = True
    return mesh.vertices[used]


def _unit(direction: Sequence[float]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = np.array(direction) / math.hypot(*direction)
    return unit


def _tuple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _scaled(colour: Rgb, factor: float) -> Rgb:
    red, green, blue = colour
    return red * factor, green * factor, blue * factor
