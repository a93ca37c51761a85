"""The rays that a surface sends on: off it like a mirror, and through it (Whitted 1980)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.footprint import mirrored_spread, refracted_spread
from renderer.fresnel import fresnel, refracted_cosine
from renderer.kernel import formula
from renderer.material_table import BOUNDARY, MIRROR, MIRROR_ANYWAY, REFRACTS, REFRACTS_ANYWAY
from renderer.media import crossed, dominant
from renderer.normal_map import mirroring
from renderer.places import MIRRORED, WIDTH, finish_of, surface_of
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
    if rx * s.gx + ry * s.gy + rz * s.gz <= 0.0:
        d = 2.0 * (dx * s.gx + dy * s.gy + dz * s.gz)
        rx, ry, rz = dx - d * s.gx, dy - d * s.gy, dz - d * s.gz
    inverse = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
    return rx * inverse, ry * inverse, rz * inverse


@formula
def _bent(
    s: Surface, eta: float, cosine: float, refracted: float, dx: float, dy: float, dz: float
) -> tuple[float, float, float]:
    """Unit direction of the refracted ray (Snell's law in vector form); eta = 1 goes straight on."""
    if eta == 1.0:
        return dx, dy, dz
    bend = eta * cosine - refracted
    rx, ry, rz = eta * dx + bend * s.nx, eta * dy + bend * s.ny, eta * dz + bend * s.nz
    if rx * s.gx + ry * s.gy + rz * s.gz >= 0.0:
        return dx, dy, dz
    inverse = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
    return rx * inverse, ry * inverse, rz * inverse


@formula
def _send_child(
    s: Surface,
    away: float,
    dx: float,
    dy: float,
    dz: float,
    wr: float,
    wg: float,
    wb: float,
    sample: int,
    width: float,
    spread: float,
    children: Rays,
    n_children: int,
) -> None:
    """Write ray `n_children`, which leaves a surface `away` times its offset along the geometric normal."""
    origin, direction, weight, pencil = children.origin, children.direction, children.weight, children.pencil
    origin[n_children, 0] = s.px + away * s.offset * s.gx
    origin[n_children, 1] = s.py + away * s.offset * s.gy
    origin[n_children, 2] = s.pz + away * s.offset * s.gz
    direction[n_children, 0], direction[n_children, 1], direction[n_children, 2] = dx, dy, dz
    weight[n_children, 0], weight[n_children, 1], weight[n_children, 2] = wr, wg, wb
    children.sample[n_children] = sample
    pencil[n_children, 0], pencil[n_children, 1] = width, spread


@formula
def spawn_rays(
    surfaces: Surfaces,
    rays: Rays,
    ray: int,
    primitive: int,
    rows: NDArray[np.float64],
    lane: int,
    cutoff: float,
    children: Rays,
    n_children: int,
    counters: NDArray[np.int64],
) -> int:
    """Write the rays that a surface sends on, through it and off it; returns how many children there are now."""
    facets, radius, indices = surfaces.facets, surfaces.spheres.radius, surfaces.indices
    direction, weight, sample = rays.direction, rays.weight, rays.sample[ray]
    s, finish = surface_of(rows, lane), finish_of(rows, lane)
    material, triangles, nested = surfaces.materials[s.material], len(facets), len(indices) > 1
    dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
    wr, wg, wb = np.float64(weight[ray, 0]), np.float64(weight[ray, 1]), np.float64(weight[ray, 2])
    mr, mg, mb = rows[MIRRORED, lane], rows[MIRRORED + 1, lane], rows[MIRRORED + 2, lane]
    anyway = material.calls if max(wr, max(wg, wb)) >= cutoff else 0
    curvature = 0.0
    if primitive >= triangles:
        curvature = (1.0 if s.entering else -1.0) / radius[primitive - triangles]
    width, spread = rows[WIDTH, lane], np.float64(rays.pencil[ray, 1])
    before = int(rays.around[ray]) if nested else 0
    behind = before
    if material.calls & (BOUNDARY | REFRACTS_ANYWAY) != 0:
        eta = 1.0 / material.ior if s.entering else np.float64(material.ior)
        if material.medium > 0:
            other = int(facets[primitive, OTHER_COLUMN]) if primitive < triangles else 0
            before, behind = crossed(before, int(np.int64(material.medium)), other, s.entering)
            eta = indices[dominant(before)] / indices[dominant(behind)]
        cosine = -(dx * s.nx + dy * s.ny + dz * s.nz)
        refracted = refracted_cosine(cosine, eta)
        share = fresnel(cosine, refracted, eta)
        rest = 1.0 - share
        tr = wr * rest * (1.0 - mr) * material.transmission_red
        tg = wg * rest * (1.0 - mg) * material.transmission_green
        tb = wb * rest * (1.0 - mb) * material.transmission_blue
        if material.calls & BOUNDARY != 0:
            mr, mg, mb = share + rest * mr, share + rest * mg, share + rest * mb
        if (material.calls & REFRACTS != 0 and max(tr, max(tg, tb)) >= cutoff) or anyway & REFRACTS_ANYWAY != 0:
            rx, ry, rz = _bent(s, eta, cosine, refracted, dx, dy, dz)
            wider = refracted_spread(spread, width, curvature, eta)
            _send_child(s, -1.0, rx, ry, rz, tr, tg, tb, sample, width, wider, children, n_children)
            if nested:
                children.around[n_children] = behind
            n_children += 1
            counters[REFRACTIONS] += 1
    mr, mg, mb = wr * mr, wg * mg, wb * mb
    if (material.calls & MIRROR != 0 and max(mr, max(mg, mb)) >= cutoff) or anyway & MIRROR_ANYWAY != 0:
        if material.normal_picture >= 0:
            s = mirroring(s, finish.hx, finish.hy, finish.hz, dx, dy, dz)
        rx, ry, rz = _mirrored(s, dx, dy, dz)
        wider = mirrored_spread(spread, width, curvature)
        _send_child(s, 1.0, rx, ry, rz, mr, mg, mb, sample, width, wider, children, n_children)
        if nested:
            children.around[n_children] = before
        n_children += 1
        counters[REFLECTIONS] += 1
    return n_children
