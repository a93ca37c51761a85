"""The rays that surfaces send on: off them like a mirror, and through them (Whitted 1980)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.finish import Finish
from renderer.footprint import mirrored_spread, refracted_spread
from renderer.fresnel import fresnel, refracted_cosine
from renderer.gather import entry, held, keep
from renderer.group import Group
from renderer.kernel import formula
from renderer.lanes import LANES, anywhere, choose, most, root
from renderer.material_table import BOUNDARY, MIRROR, MIRROR_ANYWAY, REFRACTS, REFRACTS_ANYWAY
from renderer.media import crossed, dominant
from renderer.normal_map import mirroring
from renderer.places import (
    BEFORE,
    BEHIND,
    ENTERING,
    ETA,
    FROM,
    GOES,
    MATERIAL,
    MIRRORED,
    MIRRORED_ON,
    REFRACTED,
    SHARE,
    SPREAD,
    TOWARDS,
    WIDTH,
    Places,
    keep_three,
)
from renderer.prepared import OTHER_COLUMN, Surfaces
from renderer.rays import Rays
from renderer.surface import Surface

CHILDREN = 0
SHADOWS = 1
REFLECTIONS = 2
REFRACTIONS = 3
COUNTERS = 4
"""Slots of the counters that `shade` fills: rays spawned, shadow rays, and the former by kind."""


@formula
def _mirrored(s: Surface, dx: float, dy: float, dz: float) -> tuple[float, float, float]:
    """Unit direction of the mirror ray; where a bent normal would send it into the surface, the face's own is used."""
    d = 2.0 * (dx * s.nx + dy * s.ny + dz * s.nz)
    rx, ry, rz = dx - d * s.nx, dy - d * s.ny, dz - d * s.nz
    into = rx * s.gx + ry * s.gy + rz * s.gz <= 0.0
    d = 2.0 * (dx * s.gx + dy * s.gy + dz * s.gz)
    rx, ry, rz = choose(into, dx - d * s.gx, rx), choose(into, dy - d * s.gy, ry), choose(into, dz - d * s.gz, rz)
    inverse = 1.0 / root(rx * rx + ry * ry + rz * rz)
    return rx * inverse, ry * inverse, rz * inverse


@formula
def _bent(
    s: Surface, eta: float, cosine: float, refracted: float, dx: float, dy: float, dz: float
) -> tuple[float, float, float]:
    """Unit direction of the refracted ray (Snell's law in vector form); eta = 1 goes straight on."""
    bend = eta * cosine - refracted
    rx, ry, rz = eta * dx + bend * s.nx, eta * dy + bend * s.ny, eta * dz + bend * s.nz
    straight = (eta == 1.0) | (rx * s.gx + ry * s.gy + rz * s.gz >= 0.0)
    inverse = 1.0 / root(rx * rx + ry * ry + rz * rz)
    return (
        choose(straight, dx, rx * inverse),
        choose(straight, dy, ry * inverse),
        choose(straight, dz, rz * inverse),
    )


@formula
def _keep_child(
    children: NDArray[np.float64],
    kind: int,
    goes: Any,
    s: Surface,
    away: float,
    direction: tuple[Any, Any, Any],
    share: tuple[Any, Any, Any],
    spread: Any,
) -> None:
    """Write which rays of a kind go on, leaving a surface `away` times its offset along the geometric normal."""
    keep(children, kind + GOES, goes)
    keep_three(
        children, kind + FROM,
        s.px + away * s.offset * s.gx, s.py + away * s.offset * s.gy, s.pz + away * s.offset * s.gz,
    )  # fmt: skip
    keep_three(children, kind + TOWARDS, direction[0], direction[1], direction[2])
    keep_three(children, kind + SHARE, share[0], share[1], share[2])
    keep(children, kind + SPREAD, spread)


@formula
def _cross(surfaces: Surfaces, rays: Rays, primitive_of: NDArray[np.int32], first: int, places: Places) -> None:
    """Write the media before and behind the surfaces that a group met, and what becomes of their indices.

    Args:
        surfaces, rays: the scene and all rays.
        primitive_of: (n,) int32 what these met.
        first: number of the first ray of the group.
        places: with the surfaces.
    """
    facets, indices, rows, around = surfaces.facets, surfaces.indices, places.rows, places.around
    for lane in range(LANES):
        ray = min(first + lane, len(primitive_of) - 1)
        before = behind = int(rays.around[ray])
        primitive, medium = primitive_of[ray], 0
        if 0 <= primitive < len(facets) + len(surfaces.spheres.radius):
            material = surfaces.materials[int(rows[MATERIAL, lane])]
            if material.calls & (BOUNDARY | REFRACTS_ANYWAY) != 0:
                medium = int(np.int64(material.medium))
        if medium > 0:
            other = int(facets[primitive, OTHER_COLUMN]) if primitive < len(facets) else 0
            before, behind = crossed(before, medium, other, rows[ENTERING, lane] != 0.0)
            places.children[ETA, lane] = indices[dominant(before)] / indices[dominant(behind)]
        around[BEHIND, lane], around[BEFORE, lane] = behind, before


@formula
def _curvature(surfaces: Surfaces, group: Group, seen: Any, s: Surface) -> Any:
    """1 / radius of the spheres that a group met, above 0 where they bulge towards the ray; 0 of triangles."""
    triangles = len(surfaces.facets)
    round_ones = seen & (group.primitive >= triangles)
    bulge = choose(seen, 0.0, 0.0)
    if anywhere(round_ones):
        radius = entry(surfaces.spheres.radius, choose(round_ones, group.primitive - triangles, 0))
        bulge = choose(round_ones, choose(s.entering, 1.0, -1.0) / radius, 0.0)
    return bulge


@formula
def send_on(
    surfaces: Surfaces,
    rays: Rays,
    primitive_of: NDArray[np.int32],
    first: int,
    group: Group,
    seen: Any,
    s: Surface,
    finish: Finish,
    cutoff: float,
    places: Places,
) -> None:
    """Write the rays that the surfaces that a group met send on, through them and off them.

    Args:
        surfaces, rays: the scene and all rays.
        primitive_of: (n,) int32 what these met.
        first: number of the first ray of the group.
        group: the group.
        seen: marks those that met a surface.
        s, finish: the surfaces, and what they are made of.
        cutoff: smallest weight worth a ray.
        places: with the same, and what they mirror; the rays are written there.
    """
    materials, rows, children, calls = surfaces.materials, places.rows, places.children, finish.calls
    row = choose(seen, s.material, 0)
    dx, dy, dz = group.dx, group.dy, group.dz
    mr, mg, mb = held(rows, MIRRORED), held(rows, MIRRORED + 1), held(rows, MIRRORED + 2)
    anyway = choose(most(group.wr, most(group.wg, group.wb)) >= cutoff, calls, 0)
    curvature, spread = _curvature(surfaces, group, seen, s), entry(rays.spread, group.row)
    ior = entry(materials["ior"], row)
    keep(children, ETA, choose(s.entering, 1.0 / ior, ior))
    if len(surfaces.indices) > 1:
        _cross(surfaces, rays, primitive_of, first, places)
    keep(children, REFRACTED + GOES, 0.0)
    through = calls & (BOUNDARY | REFRACTS_ANYWAY) != 0
    if anywhere(through):
        eta = held(children, ETA)
        cosine = -(dx * s.nx + dy * s.ny + dz * s.nz)
        refracted = refracted_cosine(cosine, eta)
        share = fresnel(cosine, refracted, eta)
        rest = 1.0 - share
        tr = group.wr * rest * (1.0 - mr) * entry(materials["transmission_red"], row)
        tg = group.wg * rest * (1.0 - mg) * entry(materials["transmission_green"], row)
        tb = group.wb * rest * (1.0 - mb) * entry(materials["transmission_blue"], row)
        bounds = calls & BOUNDARY != 0
        mr = choose(bounds, share + rest * mr, mr)
        mg = choose(bounds, share + rest * mg, mg)
        mb = choose(bounds, share + rest * mb, mb)
        wanted = (calls & REFRACTS != 0) & (most(tr, most(tg, tb)) >= cutoff)
        _keep_child(
            children, REFRACTED, through & (wanted | (anyway & REFRACTS_ANYWAY != 0)), s, -1.0,
            _bent(s, eta, cosine, refracted, dx, dy, dz), (tr, tg, tb),
            refracted_spread(spread, group.width, curvature, eta),
        )  # fmt: skip
    mr, mg, mb = group.wr * mr, group.wg * mg, group.wb * mb
    goes = (calls & MIRROR != 0) & (most(mr, most(mg, mb)) >= cutoff) | (anyway & MIRROR_ANYWAY != 0)
    keep(children, MIRRORED_ON + GOES, goes)
    if anywhere(goes):
        if anywhere(choose(seen, entry(materials["normal_picture"], row), -1) >= 0):
            s = mirroring(s, finish.hx, finish.hy, finish.hz, dx, dy, dz)
        _keep_child(
            children, MIRRORED_ON, goes, s, 1.0, _mirrored(s, dx, dy, dz), (mr, mg, mb),
            mirrored_spread(spread, group.width, curvature),
        )  # fmt: skip


@formula
def write_children(
    places: Places,
    sample_of: NDArray[np.int32],
    first: int,
    count: int,
    nested: bool,
    children: Rays,
    n_children: int,
    counters: NDArray[np.int64],
) -> int:
    """Write the rays that a group sends on, as `send_on` left them; returns how many children there are now.

    Args:
        places: of the group.
        sample_of: (n,) int32 camera samples of all rays.
        first, count: rays first .. first + count - 1 are of the group.
        nested: whether the rays carry the media they are in.
        children: room for another two of each.
        n_children: how many there are.
        counters: (COUNTERS,) int64, added to.
    """
    sent, origin, direction, weight = places.children, children.origin, children.direction, children.weight
    for lane in range(count):
        for kind in (REFRACTED, MIRRORED_ON):
            if sent[kind + GOES, lane] == 0.0:
                continue
            to = np.uint64(n_children)
            origin.x[to], origin.y[to], origin.z[to] = _three(sent, kind + FROM, lane)
            direction.x[to], direction.y[to], direction.z[to] = _three(sent, kind + TOWARDS, lane)
            weight.x[to], weight.y[to], weight.z[to] = _three(sent, kind + SHARE, lane)
            children.width[to], children.spread[to] = places.rows[WIDTH, lane], sent[kind + SPREAD, lane]
            children.sample[to] = sample_of[first + lane]
            if nested:
                children.around[to] = places.around[BEHIND if kind == REFRACTED else BEFORE, lane]
            counters[REFRACTIONS if kind == REFRACTED else REFLECTIONS] += 1
            n_children += 1
    return n_children


@formula
def _three(rows: NDArray[np.float64], row: int, lane: int) -> tuple[float, float, float]:
    return rows[row, lane], rows[row + 1, lane], rows[row + 2, lane]
