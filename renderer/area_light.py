"""Lights with a size: rectangles and spheres, hit by rays and sampled by the solid angle they fill.

A direction drawn evenly over the solid angle leaves no inverse square in the estimate, so a light that
touches a surface makes it no noisier than a far one. Their own shapes cast no shadow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula, kernel
from renderer.rays import Vectors
from renderer.scene import AreaLight, Light, SphereLight
from renderer.sphere import hit_distance

_FRAME = [f"{axis}{part}" for axis in ("corner_", "right_", "up_", "normal_") for part in "xyz"]

AREA_LIGHT = np.dtype(
    [
        *((name, np.float64) for name in (*_FRAME, "width", "height", "radius", "red", "green", "blue")),
        ("two_sided", np.int64),
        ("reaches", np.int64),
        ("casts", np.int64),
    ]
)
"""One area light in scene units; colours are radiance. A sphere has a radius above 0 and its centre for corner;
a rectangle has its unit edges `right` and `up`, their lengths, and the normal of the side that shines.
`reaches` is 0 for a light that can be seen but brightens nothing."""

SMALLEST_SPHERICAL = 3e-4
"""Solid angle below which a rectangle is sampled by its area [sr]: the difference of angles that makes the
solid angle has lost digits there, and both ways hardly differ (Pharr, Jakob and Humphreys 2023, ch. 6.5.2)."""

IN_PLANE = 16.0 * 2.0**-23
"""Share of its distance by which a light may lie behind a surface and still be seen: a lamp flush with its ceiling."""


def area_light_table(
    lights: Sequence[AreaLight], reaching: Sequence[Light], center: NDArray[np.float64], scale: float, shadows: bool
) -> NDArray[np.void]:
    """(l,) AREA_LIGHT: lights moved and scaled into scene units; radiance stays what it is.

    Args:
        lights: those that shine.
        reaching: those whose light can be noticed on something.
        center: (3,) float64 position of the origin of scene units [m].
        scale: scene units a metre.
        shadows: whether those that cast shadows do so.
    """
    table = np.zeros(len(lights), dtype=AREA_LIGHT)
    for row, light in enumerate(lights):
        if isinstance(light, SphereLight):
            _write(table[row], "corner", (np.array(light.center) - center) * scale)
            table[row]["radius"] = light.radius * scale
        else:
            right = np.array(light.edge_u, dtype=np.float64)
            width = math.hypot(*light.edge_u)
            right /= width
            up = np.array(light.edge_v, dtype=np.float64)
            up -= (up @ right) * right
            height = math.hypot(*up)
            up /= height
            _write(table[row], "corner", (np.array(light.corner) - center) * scale)
            for name, axis in (("right", right), ("up", up), ("normal", np.cross(right, up))):
                _write(table[row], name, axis)
            table[row]["width"], table[row]["height"] = width * scale, height * scale
            table[row]["two_sided"] = light.two_sided
        for channel, value in zip(("red", "green", "blue"), light.radiance, strict=True):
            table[row][channel] = value
        table[row]["reaches"] = light in reaching
        table[row]["casts"] = light.casts_shadows and shadows
    return table


def _write(row: Any, name: str, vector: NDArray[np.float64]) -> None:
    for part, value in zip("xyz", vector, strict=True):
        row[f"{name}_{part}"] = value


@kernel
def nearest_area_lights(
    lights: NDArray[np.void],
    origin: Vectors,
    direction: Vectors,
    first_id: int,
    distance: NDArray[np.float32],
    primitive: NDArray[np.int32],
) -> None:
    """Replace hits by nearer ones on the shining sides of area lights.

    Args:
        lights: (l,) AREA_LIGHT.
        origin, direction: of n rays.
        first_id: number of light 0 as a primitive.
        distance: (n,) float32 distance of the nearest hit so far, in lengths of the direction.
        primitive: (n,) int32 what was hit, -1 for nothing.
    """
    for ray in range(len(distance)):
        ox, oy, oz = np.float64(origin.x[ray]), np.float64(origin.y[ray]), np.float64(origin.z[ray])
        dx, dy, dz = np.float64(direction.x[ray]), np.float64(direction.y[ray]), np.float64(direction.z[ray])
        best = np.float64(distance[ray]) if primitive[ray] >= 0 else math.inf
        found = -1
        for index in range(len(lights)):
            t = _light_distance(lights[index], ox, oy, oz, dx, dy, dz)
            if t - t * IN_PLANE < best:
                best = t
                found = index
        if found >= 0:
            distance[ray] = best
            primitive[ray] = first_id + found


@formula
def _light_distance(light: Any, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    """Where a ray meets the shining side of a light, in lengths of its direction; infinity if it does not."""
    fx, fy, fz = light.corner_x - ox, light.corner_y - oy, light.corner_z - oz
    if light.radius > 0.0:
        if fx * fx + fy * fy + fz * fz <= light.radius * light.radius:
            return math.inf
        return hit_distance(
            ox, oy, oz, dx, dy, dz, light.corner_x, light.corner_y, light.corner_z, light.radius
        )  # fmt: skip
    slope = dx * light.normal_x + dy * light.normal_y + dz * light.normal_z
    if slope == 0.0 or (slope > 0.0 and light.two_sided == 0):
        return math.inf
    t = (fx * light.normal_x + fy * light.normal_y + fz * light.normal_z) / slope
    if not t > 0.0:
        return math.inf
    x, y, z = t * dx - fx, t * dy - fy, t * dz - fz
    a = x * light.right_x + y * light.right_y + z * light.right_z
    b = x * light.up_x + y * light.up_y + z * light.up_z
    return t if 0.0 <= a <= light.width and 0.0 <= b <= light.height else math.inf


class LightView(NamedTuple):
    """A light as a point sees it.

    Attributes:
        solid_angle: [sr]; 0 where none of its shining side is seen.
        x0, x1, y0, y1: a rectangle's extent along its edges from the point's foot on its plane.
        z: height of that plane over the point along the light's normal: below 0 on the side that shines.
        turn, low, high: a rectangle's angle k and the normals b0 and b1 of its lower and upper edge, in the
            terms of Urena, Fajardo and King (2013); for a sphere, the distance of its centre, 1 minus the
            cosine of the cone it fills, and its radius.
    """

    solid_angle: float
    x0: float
    x1: float
    y0: float
    y1: float
    z: float
    turn: float
    low: float
    high: float


@formula
def see_light(light: Any, px: float, py: float, pz: float) -> LightView:
    """What a point sees of a light, nothing being in between."""
    if light.radius > 0.0:
        return _see_sphere(light, px, py, pz)
    return _see_rectangle(light, px, py, pz)


@formula
def _see_sphere(light: Any, px: float, py: float, pz: float) -> LightView:
    fx, fy, fz = light.corner_x - px, light.corner_y - py, light.corner_z - pz
    distance = math.sqrt(fx * fx + fy * fy + fz * fz)
    if not distance > light.radius:
        return LightView(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sine = light.radius / distance
    cosine = math.sqrt((distance - light.radius) * (distance + light.radius)) / distance
    gap = sine * sine / (1.0 + cosine)
    return LightView(2.0 * math.pi * gap, 0.0, 0.0, 0.0, 0.0, 0.0, distance, gap, light.radius)


@formula
def _see_rectangle(light: Any, px: float, py: float, pz: float) -> LightView:
    """Urena, Fajardo and King, "An Area-Preserving Parametrization for Spherical Rectangles" (2013)."""
    fx, fy, fz = light.corner_x - px, light.corner_y - py, light.corner_z - pz
    z = fx * light.normal_x + fy * light.normal_y + fz * light.normal_z
    if not z < 0.0 and (light.two_sided == 0 or z == 0.0):
        return LightView(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    x0 = fx * light.right_x + fy * light.right_y + fz * light.right_z
    y0 = fx * light.up_x + fy * light.up_y + fz * light.up_z
    x1, y1 = x0 + light.width, y0 + light.height
    left, right = x0 / math.hypot(x0, z), x1 / math.hypot(x1, z)
    low, high = y0 / math.hypot(y0, z), y1 / math.hypot(y1, z)
    turn = 2.0 * math.pi - math.acos(high * left) - math.acos(-left * low)
    solid_angle = math.acos(low * right) + math.acos(-right * high) - turn
    if solid_angle < SMALLEST_SPHERICAL:
        # The difference may have rounded to nothing. Its area is sampled: that it is seen is all that counts.
        x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        square = x * x + y * y + z * z
        solid_angle = min(0.5 * SMALLEST_SPHERICAL, light.width * light.height * abs(z) / (square * math.sqrt(square)))
    return LightView(solid_angle, x0, x1, y0, y1, z, turn, -low, high)


@formula
def towards_light(
    light: Any, view: LightView, px: float, py: float, pz: float, u: float, v: float
) -> tuple[float, float, float, float]:
    """A point on what is seen of a light, and how much it stands for.

    Args:
        light: the light.
        view: what is seen of it, of a solid angle above 0.
        px, py, pz: from where.
        u, v: where on it, evenly distributed in [0, 1).

    Returns:
        The vector from (px, py, pz) to the point, and a solid angle [sr]: times the radiance it is, on
        average over u and v, the light that arrives. A solid angle of 0 stands for nothing.
    """
    if light.radius > 0.0:
        return _towards_sphere(light, view, px, py, pz, u, v)
    if view.solid_angle < SMALLEST_SPHERICAL:
        x, y = view.x0 + u * light.width, view.y0 + v * light.height
        square = x * x + y * y + view.z * view.z
        share = light.width * light.height * abs(view.z) / (square * math.sqrt(square))
    else:
        x, y = _on_spherical_rectangle(view, u, v)
        share = view.solid_angle
    tx = x * light.right_x + y * light.up_x + view.z * light.normal_x
    ty = x * light.right_y + y * light.up_y + view.z * light.normal_y
    tz = x * light.right_z + y * light.up_z + view.z * light.normal_z
    return tx, ty, tz, share


@formula
def _on_spherical_rectangle(view: LightView, u: float, v: float) -> tuple[float, float]:
    """The place on the rectangle's plane, along its edges from the point's foot (Urena et al. 2013, fig. 6)."""
    angle = u * view.solid_angle + view.turn
    f = (math.cos(angle) * view.low - view.high) / math.sin(angle)
    c = 1.0 / math.hypot(f, view.low)
    c = min(1.0, max(-1.0, c if f > 0.0 else -c))
    x = min(view.x1, max(view.x0, c * abs(view.z) / math.sqrt((1.0 - c) * (1.0 + c))))
    d = math.hypot(x, view.z)
    low, high = view.y0 / math.hypot(view.y0, d), view.y1 / math.hypot(view.y1, d)
    h = low + v * (high - low)
    y = min(view.y1, max(view.y0, h * d / math.sqrt((1.0 - h) * (1.0 + h))))
    return x, y


@formula
def _towards_sphere(
    light: Any, view: LightView, px: float, py: float, pz: float, u: float, v: float
) -> tuple[float, float, float, float]:
    """A point of the cap that is seen, evenly over the cone it fills."""
    distance, gap, radius = view.turn, view.low, view.high
    lower = u * gap
    sine = math.sqrt(lower * (2.0 - lower))
    across = min(radius, distance * sine)
    reach = distance * (1.0 - lower) - math.sqrt((radius - across) * (radius + across))
    inverse = 1.0 / distance
    wx, wy, wz = (light.corner_x - px) * inverse, (light.corner_y - py) * inverse, (light.corner_z - pz) * inverse
    # A frame around the axis without a square root (Duff et al. 2017).
    sign = math.copysign(1.0, wz)
    a = -1.0 / (sign + wz)
    b = wx * wy * a
    along, beside = sine * math.cos(2.0 * math.pi * v), sine * math.sin(2.0 * math.pi * v)
    tx = along * (1.0 + sign * wx * wx * a) + beside * b + (1.0 - lower) * wx
    ty = along * sign * b + beside * (sign + wy * wy * a) + (1.0 - lower) * wy
    tz = -along * sign * wx - beside * wy + (1.0 - lower) * wz
    return tx * reach, ty * reach, tz * reach, view.solid_angle
