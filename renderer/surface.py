"""The place a ray met: position, normals, texture coordinates and the offset that leaves it.

Positions come from barycentric weights (or lie on the sphere), never from origin + t * direction, whose
error grows with distance. The offset is a number of units in the last place of the largest coordinate
around, so it holds at every scale (Ize 2013; Waechter and Binder 2019 discuss why).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.gather import octet
from renderer.kernel import formula
from renderer.lanes import anywhere, arc_sine, arc_tangent, choose, least, most, root, size, whole
from renderer.prepared import MATERIAL_COLUMN
from renderer.rays import Vectors
from renderer.sphere import SphereTree, hit_distance

OFFSET_ULPS = 16.0 * 2.0**-23
"""How far a ray starts off its surface, in largest coordinates: twice what leaves no self-hit of 128,000."""


SPHERE_OFFSET = 16.0 * 2.0**-52
"""The same for the float64 rounding of a sphere's own numbers: the ground may be a sphere as large as the Earth."""


class Surface(NamedTuple):
    """One hit, in scene units; the normals face the side the ray came from.

    Attributes:
        px, py, pz: position.
        gx, gy, gz: geometric unit normal.
        nx, ny, nz: shading unit normal; near the outline of a smooth mesh it may lean away from the ray.
        u, v: texture coordinates.
        offset: distance along the geometric normal at which a leaving ray starts.
        lift: distance along the geometric normal by which shadow rays of smooth triangles start higher.
        material: row of the material table.
        entering: True where the ray comes from outside.
    """

    px: float
    py: float
    pz: float
    gx: float
    gy: float
    gz: float
    nx: float
    ny: float
    nz: float
    u: float
    v: float
    offset: float
    lift: float
    material: int
    entering: bool


@formula
def _farther(a: float, b: float, c: float, limit: float) -> float:
    return most(limit, most(size(a), most(size(b), size(c))))


@formula
def _lift(px: float, py: float, pz: float, cx: float, cy: float, cz: float, nx: float, ny: float, nz: float) -> float:
    """How far below the plane of a corner's normal the point lies, 0 if above (Hanika 2021, ch. 4)."""
    return least(0.0, (px - cx) * nx + (py - cy) * ny + (pz - cz) * nz)


@formula
def weights_at(
    f: NDArray[np.float32], t: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float
) -> tuple[float, float]:
    """Barycentric weights of the second and third corner of facet `t` where a ray that is known to hit it does.

    In float64 from the ray and the corners alone (Moller and Trumbore 1997), so that they do not depend on how
    the search found the triangle; cut off at its edges, which Embree's robust mode reaches a little beyond.
    Takes numbers or lanes.
    """
    ax, ay, az, _, _, _, _, _ = octet(f, t, 0)
    bx, by, bz, _, _, _, _, _ = octet(f, t, 8)
    cx, cy, cz, _, _, _, _, _ = octet(f, t, 16)
    bx, by, bz = bx - ax, by - ay, bz - az
    cx, cy, cz = cx - ax, cy - ay, cz - az
    hx, hy, hz = dy * cz - dz * cy, dz * cx - dx * cz, dx * cy - dy * cx
    volume = bx * hx + by * hy + bz * hz
    sx, sy, sz = ox - ax, oy - ay, oz - az
    qx, qy, qz = sy * bz - sz * by, sz * bx - sx * bz, sx * by - sy * bx
    inverse = 1.0 / volume
    flat = volume == 0.0
    b1 = choose(flat, 0.0, least(1.0, most(0.0, (sx * hx + sy * hy + sz * hz) * inverse)))
    b2 = choose(flat, 0.0, least(1.0, most(0.0, (dx * qx + dy * qy + dz * qz) * inverse)))
    beyond = b1 + b2 > 1.0
    if anywhere(beyond):
        inverse = choose(beyond, 1.0 / (b1 + b2), 1.0)
        b1, b2 = b1 * inverse, b2 * inverse
    return b1, b2


@formula
def triangle_surface(f: NDArray[np.float32], t: int, b1: float, b2: float, dx: float, dy: float, dz: float) -> Surface:
    """The surface of facet `t` of the facets `f` at barycentric weights b1, b2 of its second and third corner.

    The shadow origin of a smooth triangle is lifted to the height of the curved surface its normals
    suggest, which removes the black triangles at the shadow terminator (Hanika, Ray Tracing Gems II, 2021,
    ch. 4); straight up, so that wild normals do not carry it through a neighbouring wall. Takes numbers or lanes.
    """
    b0 = 1.0 - b1 - b2
    ax, ay, az, n0x, n0y, n0z, u0, v0 = octet(f, t, 0)
    bx, by, bz, n1x, n1y, n1z, u1, v1 = octet(f, t, 8)
    cx, cy, cz, n2x, n2y, n2z, u2, v2 = octet(f, t, 16)
    material, smooth, gx, gy, gz, reach, _, _ = octet(f, t, MATERIAL_COLUMN)
    px, py, pz = b0 * ax + b1 * bx + b2 * cx, b0 * ay + b1 * by + b2 * cy, b0 * az + b1 * bz + b2 * cz
    entering = gx * dx + gy * dy + gz * dz <= 0.0
    face = choose(entering, 1.0, -1.0)
    gx, gy, gz = gx * face, gy * face, gz * face
    nx, ny, nz = gx, gy, gz
    smoothed = smooth != 0.0
    lift = choose(smoothed, 0.0, 0.0)
    if anywhere(smoothed):
        sx, sy, sz = b0 * n0x + b1 * n1x + b2 * n2x, b0 * n0y + b1 * n1y + b2 * n2y, b0 * n0z + b1 * n1z + b2 * n2z
        length = root(sx * sx + sy * sy + sz * sz)
        side = choose(sx * gx + sy * gy + sz * gz >= 0.0, 1.0, -1.0)
        inverse = side / length
        known = smoothed & (length > 0.0)
        nx, ny, nz = choose(known, sx * inverse, nx), choose(known, sy * inverse, ny), choose(known, sz * inverse, nz)
        n0x, n0y, n0z, n1x, n1y, n1z = side * n0x, side * n0y, side * n0z, side * n1x, side * n1y, side * n1z
        n2x, n2y, n2z = side * n2x, side * n2y, side * n2z
        d0 = b0 * _lift(px, py, pz, ax, ay, az, n0x, n0y, n0z)
        d1 = b1 * _lift(px, py, pz, bx, by, bz, n1x, n1y, n1z)
        d2 = b2 * _lift(px, py, pz, cx, cy, cz, n2x, n2y, n2z)
        up = -d0 * most(0.0, n0x * gx + n0y * gy + n0z * gz)
        up = up - d1 * most(0.0, n1x * gx + n1y * gy + n1z * gz)
        up = up - d2 * most(0.0, n2x * gx + n2y * gy + n2z * gz)
        lift = choose(smoothed, up, 0.0)
    u = b0 * u0 + b1 * u1 + b2 * u2
    v = b0 * v0 + b1 * v1 + b2 * v2
    return Surface(
        px, py, pz, gx, gy, gz, nx, ny, nz, u, v, reach * OFFSET_ULPS, lift, whole(material), entering
    )  # fmt: skip


@formula
def sphere_surface(
    cx: float, cy: float, cz: float, radius: float, material: int,
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, drawn: bool,
) -> Surface:  # fmt: skip
    """The surface of a sphere where a ray meets it; u is longitude, v latitude, from 0 to 1 each, where `drawn`.

    All are numbers or lanes. The direction is the very one that hit: after rounding it anew a ray along the rim could
    miss.
    """
    t = hit_distance(ox, oy, oz, dx, dy, dz, cx, cy, cz, radius)
    nx, ny, nz = ox + t * dx - cx, oy + t * dy - cy, oz + t * dz - cz
    length = root(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    u = 0.5 + arc_tangent(drawn, nx, nz) / (2.0 * math.pi)
    v = 0.5 + arc_sine(drawn, most(-1.0, least(1.0, ny))) / math.pi
    px, py, pz = cx + radius * nx, cy + radius * ny, cz + radius * nz
    entering = nx * dx + ny * dy + nz * dz <= 0.0
    face = choose(entering, 1.0, -1.0)
    nx, ny, nz = nx * face, ny * face, nz * face
    offset = _farther(px, py, pz, 0.0) * OFFSET_ULPS + _farther(cx, cy, cz, radius) * SPHERE_OFFSET
    lift = choose(entering, 0.0, 0.0)
    return Surface(px, py, pz, nx, ny, nz, nx, ny, nz, u, v, offset, lift, material, entering)


@formula
def sphere_met(spheres: SphereTree, k: int, origin: Vectors, direction: Vectors, ray: int) -> Surface:
    """The surface of sphere `k` where ray number `ray`, of n origins and directions, meets it."""
    center = spheres.center
    return sphere_surface(
        center[k, 0], center[k, 1], center[k, 2], spheres.radius[k], int(np.int64(spheres.material[k])),
        np.float64(origin.x[ray]), np.float64(origin.y[ray]), np.float64(origin.z[ray]),
        np.float64(direction.x[ray]), np.float64(direction.y[ray]), np.float64(direction.z[ray]), True,
    )  # fmt: skip


@formula
def surface_met(
    facets: NDArray[np.float32],
    spheres: SphereTree,
    primitive: int,
    origin: Vectors,
    direction: Vectors,
    ray: int,
) -> Surface:
    """The surface of a triangle, or else of a sphere, that a ray met.

    Args:
        facets, spheres: of the scene; triangles are counted first.
        primitive: which of them.
        origin, direction: of n rays.
        ray: which of them.
    """
    k = primitive - len(facets)
    if k >= 0:
        return sphere_met(spheres, k, origin, direction, ray)
    ox, oy, oz = np.float64(origin.x[ray]), np.float64(origin.y[ray]), np.float64(origin.z[ray])
    dx, dy, dz = np.float64(direction.x[ray]), np.float64(direction.y[ray]), np.float64(direction.z[ray])
    b1, b2 = weights_at(facets, primitive, ox, oy, oz, dx, dy, dz)
    return triangle_surface(facets, primitive, b1, b2, dx, dy, dz)


@formula
def go_on_behind(s: Surface, origin: Vectors, ray: int) -> None:
    """Move the origin of a ray just behind a surface that it goes through unbent."""
    origin.x[ray] = s.px - s.offset * s.gx
    origin.y[ray] = s.py - s.offset * s.gy
    origin.z[ray] = s.pz - s.offset * s.gz
