"""What a mesh file holds: meshes, and where the file has them lights and a camera."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SceneError, SettingsError
from renderer.scene import BLACK, Mesh, PointLight, Rgb

Point = tuple[float, float, float]

NO_FALLOFF: Final = (1.0, 0.0, 0.0)
"""Falloff of a light that is as bright at every distance."""

INVERSE_SQUARE: Final = (0.0, 0.0, 1.0)
"""Falloff of a light whose `irradiance` is its intensity [W/sr]."""

DISTANCE: Final = 1e4
"""Distance in radii of the model from which a light counts as infinitely far: across the model its irradiance
then differs by 0.04 % and its direction by 0.01 degrees."""

LARGEST_FALLOFF: Final = 1e12
"""Largest term of a falloff."""


@dataclass(frozen=True, slots=True)
class StatedLight:
    """A light as its file states it.

    Attributes:
        irradiance: [W/m^2] on what faces it, 0 or more each, times `falloff`.
        position: [m].
        direction: where it shines from infinitely far away, any length; None: from `position` to all sides.
        falloff: c, l, q of 1 / (c + l d + q d^2) at distance d [m], each 0 to 1e12, not all 0.
    """

    irradiance: Rgb
    position: Point = (0.0, 0.0, 0.0)
    direction: Point | None = None
    falloff: tuple[float, float, float] = NO_FALLOFF


@dataclass(frozen=True, eq=False, slots=True)
class Model:
    """The content of one mesh file, y up, metres.

    Attributes:
        meshes: what is seen.
        lights: as stated; `point_lights` makes them this renderer's.
        ambient: radiance that lights every surface evenly.
        camera: the first one of the file; None for none.
        notes: what of the file is left out or shown differently, a line each, for people.
    """

    meshes: tuple[Mesh, ...]
    lights: tuple[StatedLight, ...] = ()
    ambient: Rgb = BLACK
    camera: Camera | None = None
    notes: tuple[str, ...] = ()


def point_lights(lights: tuple[StatedLight, ...], center: Point, radius: float, title: str) -> tuple[PointLight, ...]:
    """The lights of a model within a sphere, as lights whose brightness falls off with the square of the distance.

    A light that falls off differently lights the middle of the model (from nearer than its radius: what lies at
    that radius) as brightly as stated. One that is infinitely far away stands at `DISTANCE` radii.

    Args:
        lights: as the file states them.
        center, radius: the sphere around the model [m].
        title: names the model in messages.

    Raises:
        SceneError: for lights that leave the range of a scene.
    """
    try:
        return tuple(_point_light(light, center, radius) for light in lights)
    except SettingsError as error:
        raise SceneError(f"{title}: expected lights within the range of a scene, found {error}") from None


def _point_light(light: StatedLight, center: Point, radius: float) -> PointLight:
    if light.direction is not None:
        x, y, z = light.direction
        distance = DISTANCE * radius
        scale = -distance / math.hypot(x, y, z)
        position = (center[0] + x * scale, center[1] + y * scale, center[2] + z * scale)
        return PointLight(position, _scaled(light.irradiance, distance * distance))
    constant, linear, quadratic = light.falloff
    if constant == linear == 0.0:
        return PointLight(light.position, _scaled(light.irradiance, 1.0 / quadratic))
    distance = max(math.dist(light.position, center), radius)
    received = constant + linear * distance + quadratic * distance * distance
    return PointLight(light.position, _scaled(light.irradiance, distance * distance / received))


def camera_of(world_from_camera: NDArray[np.float64], vertical_fov_deg: float) -> Camera:
    """The camera at the origin of a coordinate system that looks along its -z with its y up.

    Args:
        world_from_camera: (4, 4) with last row 0 0 0 1; its scale does not matter.
        vertical_fov_deg: full vertical field of view [deg].

    Raises:
        SettingsError: for a transform that flattens the view, or a field of view out of range.
    """
    position = world_from_camera[:3, 3]
    forward = -world_from_camera[:3, 2]
    length = float(np.linalg.norm(forward))
    reach = max(1.0, float(np.abs(position).max()))
    ahead = position + (forward * (reach / length) if length > 0.0 else 0.0)
    return Camera(_point(position), _point(ahead), _point(world_from_camera[:3, 1]), vertical_fov_deg)


def vertical_fov(horizontal_fov_deg: float, aspect: float) -> float:
    """Vertical field of view [deg] of a picture `aspect` times as wide as high; 0 to 180 exclusive."""
    return math.degrees(2.0 * math.atan(math.tan(math.radians(horizontal_fov_deg) / 2.0) / aspect))


def _point(vector: NDArray[np.float64]) -> Point:
    x, y, z = vector.tolist()
    return x, y, z


def _scaled(colour: Rgb, factor: float) -> Rgb:
    red, green, blue = colour
    return red * factor, green * factor, blue * factor
