"""LANES rays at a time, and the surfaces they met."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.gather import along, entry, held, keep, lane_numbers, pick
from renderer.kernel import formula
from renderer.lanes import anywhere, choose, least
from renderer.places import DENSITY, WEIGHTS, WIDTH, keep_some_surfaces, keep_surfaces
from renderer.prepared import DENSITY_COLUMN, Surfaces
from renderer.rays import Hits, Rays
from renderer.surface import sphere_surface, triangle_surface, weights_at

SPHERE_DENSITY = 0.5 / math.sqrt(math.pi)
"""Texture coordinates per radius of a sphere, whose whole area one picture covers: the mean over all places."""


class Group(NamedTuple):
    """LANES rays and what they met, in lanes.

    Attributes:
        row: number of each.
        primitive: what each met, numbered as in `Hits`.
        ox, oy, oz: origin.
        dx, dy, dz: direction.
        wr, wg, wb: share of what it sees that reaches the eye.
        width: of the ray where it ends.
    """

    row: Any
    primitive: Any
    ox: Any
    oy: Any
    oz: Any
    dx: Any
    dy: Any
    dz: Any
    wr: Any
    wg: Any
    wb: Any
    width: Any


@formula
def group_of(rays: Rays, hits: Hits, first: int) -> Group:
    """Rays first, first + 1, ...; beyond the last one, that one again."""
    last = len(hits.primitive) - 1
    row = least(lane_numbers(first), last)
    origin, direction, weight = rays.origin, rays.direction, rays.weight
    return Group(
        row,
        entry(hits.primitive, row),
        along(origin.x, first, last), along(origin.y, first, last), along(origin.z, first, last),
        along(direction.x, first, last), along(direction.y, first, last), along(direction.z, first, last),
        along(weight.x, first, last), along(weight.y, first, last), along(weight.z, first, last),
        along(rays.width, first, last) + along(rays.spread, first, last) * entry(hits.distance, row),
    )  # fmt: skip


@formula
def meet(surfaces: Surfaces, group: Group, rows: NDArray[np.float64]) -> None:
    """Write the surfaces that the rays of a group met, and how wide it is there; where there is none, anything.

    Args:
        surfaces: the scene.
        group: the group.
        rows: of `Places`.
    """
    keep(rows, WIDTH, group.width)
    facets, radius = surfaces.facets, surfaces.spheres.radius
    triangles, solids = len(facets), len(facets) + len(radius)
    flat = (group.primitive >= 0) & (group.primitive < triangles)
    if anywhere(flat):
        t = choose(flat, group.primitive, 0)
        b1, b2 = weights_at(facets, t, group.ox, group.oy, group.oz, group.dx, group.dy, group.dz)
        keep_surfaces(rows, triangle_surface(facets, t, b1, b2, group.dx, group.dy, group.dz))
        keep(rows, WEIGHTS, b1)
        keep(rows, WEIGHTS + 1, b2)
        keep(rows, DENSITY, pick(facets, t, DENSITY_COLUMN))
    round_ones = (group.primitive >= triangles) & (group.primitive < solids)
    if anywhere(round_ones):
        _meet_spheres(surfaces, group, round_ones, rows)


@formula
def _meet_spheres(surfaces: Surfaces, group: Group, marked: Any, rows: NDArray[np.float64]) -> None:
    """Write the spheres that the marked rays of a group met."""
    materials, spheres = surfaces.materials, surfaces.spheres
    k = choose(marked, group.primitive - len(surfaces.facets), 0)
    material, radius = entry(spheres.material, k), entry(spheres.radius, k)
    drawn = entry(materials["picture"], material) >= 0
    drawn = drawn | (entry(materials["specular_picture"], material) >= 0)
    drawn = drawn | (entry(materials["normal_picture"], material) >= 0)
    s = sphere_surface(
        pick(spheres.center, k, 0), pick(spheres.center, k, 1), pick(spheres.center, k, 2), radius, material,
        group.ox, group.oy, group.oz, group.dx, group.dy, group.dz, marked & drawn,
    )  # fmt: skip
    keep_some_surfaces(rows, marked, s)
    keep(rows, DENSITY, choose(marked, SPHERE_DENSITY / radius, held(rows, DENSITY)))
