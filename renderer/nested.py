"""Media in and over each other: boundaries that another medium hides, and the media the camera is in.

A ray passes a hidden boundary as if it were not there: it keeps its origin, so that what it meets behind is
shaded to the last bit as without it. In scenes whose materials have no priority none of this runs.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.cutout import pass_holes
from renderer.intersection import Intersector
from renderer.kernel import kernel
from renderer.media import crossed, dominant, with_medium
from renderer.prepared import MATERIAL_COLUMN, OTHER_COLUMN, PreparedScene, Surfaces
from renderer.rays import Hits, Vectors, copied, some_vectors, vectors_of
from renderer.surface import go_on_behind, sphere_met, surface_met

MOST_HIDDEN = 64
"""Hidden boundaries that a ray passes, one behind the other; the next one counts as seen."""

MOST_CROSSED = 4096
"""Surfaces between the camera and the end of the scene that are looked at to tell what it is in."""

OUTWARDS = (0.53766714, 0.79129217, 0.29137745)
"""Where to look for what the camera is in: along no axis, plane or diagonal that a model is likely to have."""


@kernel
def find_hidden(
    surfaces: Surfaces,
    origin: Vectors,
    direction: Vectors,
    around: NDArray[np.int64],
    hits: Hits,
    rows: NDArray[np.int32],
    passed: NDArray[np.float32],
    everything: bool,
    entered: NDArray[np.int64],
) -> int:
    """Find the rays that met a boundary where their medium stays the same, and move them just behind it.

    Args:
        surfaces: of the hits.
        origin: of n rays; those of the rays found are moved.
        direction: theirs.
        around: (n,) int64 media of each ray; of the rays found, those behind the boundary.
        hits: what each ray met.
        rows: (k,) int32 rays to look at; those found are written to its front.
        passed: (n,) float32 distance of each ray's origin from where it began; added to.
        everything: whether to move rays that met any surface.
        entered: (media + 1,) int64, how often each was entered less how often it was left; added to.

    Returns:
        How many were found.
    """
    facets, materials = surfaces.facets, surfaces.materials
    sphere_material = surfaces.spheres.material
    primitives, distance = hits.primitive, hits.distance
    triangles = len(facets)
    found = 0
    for ray in rows:
        primitive = primitives[ray]
        if primitive < 0 or primitive >= triangles + len(sphere_material):
            continue
        k = primitive - triangles
        row = int(facets[primitive, MATERIAL_COLUMN]) if k < 0 else int(np.int64(sphere_material[k]))
        medium = int(np.int64(materials[row].medium))
        if medium == 0 and not everything:
            continue
        s = surface_met(facets, surfaces.spheres, primitive, origin, direction, ray)
        other = int(facets[primitive, OTHER_COLUMN]) if k < 0 else 0
        if medium > 0:
            before, behind = crossed(around[ray], medium, other, s.entering)
            if not everything and dominant(before) != dominant(behind):
                continue
            around[ray] = behind
            entered[medium] += 1 if s.entering else -1
            if other != 0:
                entered[abs(other)] += 1 if s.entering == (other > 0) else -1
        go_on_behind(s, origin, ray)
        passed[ray] += distance[ray]
        rows[found] = ray
        found += 1
    return found


@kernel
def keep_origins(
    surfaces: Surfaces,
    origin: Vectors,
    moved: Vectors,
    direction: Vectors,
    hits: Hits,
) -> None:
    """Move the rays that a sphere they are already through would otherwise take in: those that meet it again.

    Args:
        surfaces: of the hits.
        origin: where n rays began; some are replaced.
        moved: where they went on from.
        direction: theirs.
        hits: what they met in the end.
    """
    primitives, balls = hits.primitive, len(surfaces.spheres.radius)
    triangles = len(surfaces.facets)
    for ray in range(len(primitives)):
        k = primitives[ray] - triangles
        if k < 0 or k >= balls:
            continue
        begun = sphere_met(surfaces.spheres, k, origin, direction, ray)
        gone_on = sphere_met(surfaces.spheres, k, moved, direction, ray)
        if begun.entering != gone_on.entering:
            origin.x[ray], origin.y[ray], origin.z[ray] = moved.x[ray], moved.y[ray], moved.z[ray]


def pass_hidden(
    prepared: PreparedScene,
    origin: Vectors,
    direction: Vectors,
    around: NDArray[np.int64],
    hits: Hits,
) -> None:
    """Send the rays that met a hidden boundary on, until each has met something that can be seen, or nothing.

    Args:
        prepared: the scene.
        origin: of n rays; moved only where the ray could not be traced again from where it began.
        direction: theirs.
        around: (n,) int64 media of each ray, replaced by those where it meets something.
        hits: of the rays, replaced by those behind; distances still count from where a ray began.
    """
    surfaces, intersector = prepared.surfaces, prepared.intersector
    pierced = "cutouts" in prepared.plan.names
    rows = np.arange(len(hits.primitive), dtype=np.int32)
    passed, moved = np.zeros(len(rows), dtype=np.float32), copied(origin)
    entered = np.zeros(len(surfaces.indices), dtype=np.int64)
    gone_on = None
    for _ in range(MOST_HIDDEN):
        rows = rows[: find_hidden(surfaces, moved, direction, around, hits, rows, passed, False, entered)]
        if gone_on is None:
            gone_on = rows.copy()
        if len(rows) == 0:
            break
        start, towards = some_vectors(moved, rows), some_vectors(direction, rows)
        behind = intersector.nearest(start, towards)
        if pierced:
            pass_holes(surfaces, intersector, start, towards, behind)
            _replace(moved, rows, start)
        for known, new in zip(hits, behind, strict=True):
            known[rows] = new
    if gone_on is None or len(gone_on) == 0:
        return
    hits.distance[:] += passed
    if pierced:
        _replace(origin, gone_on, some_vectors(moved, gone_on))
        return
    begun, further, towards = (some_vectors(vectors, gone_on) for vectors in (origin, moved, direction))
    keep_origins(surfaces, begun, further, towards, Hits(hits.primitive[gone_on], hits.distance[gone_on]))
    _replace(origin, gone_on, begun)


def _replace(vectors: Vectors, rows: NDArray[np.int32], others: Vectors) -> None:
    """Put other vectors in the place of some."""
    for column, other in zip(vectors, others, strict=True):
        column[rows] = other


def media_at(prepared: PreparedScene, place: NDArray[np.float32]) -> int:
    """The media around a place: those that a ray from there leaves more often than it enters.

    Args:
        prepared: the scene.
        place: (3,) float32 in scene units.
    """
    surfaces = prepared.surfaces
    entered = np.zeros(len(surfaces.indices), dtype=np.int64)
    if len(entered) > 1:
        _look_outwards(surfaces, prepared.intersector.without_lights(), place, entered)
    around = 0
    for medium in range(len(entered) - 1, 0, -1):
        for _ in range(-int(entered[medium])):
            around = int(with_medium(around, medium))
    return around


def _look_outwards(
    surfaces: Surfaces, solids: Intersector, place: NDArray[np.float32], entered: NDArray[np.int64]
) -> None:
    """Follow one ray through all that there is, and count how often it enters each medium."""
    origin = vectors_of(np.array([place], dtype=np.float32))
    direction = vectors_of(np.array([OUTWARDS], dtype=np.float32) / np.float32(math.hypot(*OUTWARDS)))
    around, passed = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.float32)
    for _ in range(MOST_CROSSED):
        hits = solids.nearest(origin, direction)
        rows = np.zeros(1, dtype=np.int32)
        if find_hidden(surfaces, origin, direction, around, hits, rows, passed, True, entered) == 0:
            return
