"""LANES rays at a time, and the surfaces they met."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.gather import entry, keep, lane_numbers, pick
from renderer.kernel import formula
from renderer.lanes import LANES, anywhere, choose, least
from renderer.places import DENSITY, WEIGHTS, WIDTH, keep_surface, keep_surfaces
from renderer.prepared import DENSITY_COLUMN, Surfaces
from renderer.rays import Hits, Rays
from renderer.surface import sphere_met, triangle_surface, weights_at

SPHERE_DENSITY = 0.5 / math.sqrt(math.pi)
"""Texture coordinates per radius of a sphere, whose whole area one picture covers: the mean over all places."""


class Group(NamedTuple):
    """LANES rays and what they met, in lanes.

    Attributes:
        primitive: what each met, numbered as in `Hits`.
        ox, oy, oz: origin.
        dx, dy, dz: direction.
        wr, wg, wb: share of what it sees that reaches the eye.
        width: of the ray where it ends.
    """

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
    row = least(lane_numbers(first), len(hits.primitive) - 1)
    origin, direction, weight, pencil = rays.origin, rays.direction, rays.weight, rays.pencil
    return Group(
        entry(hits.primitive, row),
        pick(origin, row, 0), pick(origin, row, 1), pick(origin, row, 2),
        pick(direction, row, 0), pick(direction, row, 1), pick(direction, row, 2),
        pick(weight, row, 0), pick(weight, row, 1), pick(weight, row, 2),
        pick(pencil, row, 0) + pick(pencil, row, 1) * entry(hits.distance, row),
    )  # fmt: skip


@formula
def meet(surfaces: Surfaces, rays: Rays, hits: Hits, first: int, group: Group, rows: NDArray[np.float64]) -> None:
    """Write the surfaces that the rays of a group met, and how wide it is there; where there is none, anything.

    Args:
        surfaces, rays, hits: the scene, all rays and what they met.
        first: number of the first ray of the group.
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
    if anywhere((group.primitive >= triangles) & (group.primitive < solids)):
        for lane in range(LANES):
            ray = min(first + lane, len(hits.primitive) - 1)
            k = hits.primitive[ray] - triangles
            if 0 <= k < len(radius):
                keep_surface(rows, lane, sphere_met(surfaces.spheres, k, rays.origin, rays.direction, ray))
                rows[DENSITY, lane] = SPHERE_DENSITY / radius[k]
