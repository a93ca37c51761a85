"""Cut-outs: surfaces whose alpha map lets rays through, as for leaves, fences and lace.

A ray that meets a hole goes on from just behind it, as a refracted ray would. Alpha is looked up in the picture
as it is, never in its smaller copies: whether there is a hole is a question of yes or no, and the mean over a
cell comes from its samples. Where nothing is cut out, none of this runs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.intersection import Intersector
from renderer.kernel import kernel
from renderer.prepared import MATERIAL_COLUMN, Sieve, Surfaces
from renderer.rays import Hits, ShadowRays, Vectors, some_vectors
from renderer.surface import go_on_behind, surface_met
from renderer.texture import opacity

MOST_HOLES = 64
"""Holes that a ray passes, one behind the other; the next cut-out counts as whole."""


@kernel
def find_holes(
    surfaces: Surfaces,
    origin: Vectors,
    direction: Vectors,
    hits: Hits,
    rows: NDArray[np.int32],
    passed: NDArray[np.float32],
) -> int:
    """Find the rays that met a hole, and move their origins just behind it.

    Args:
        surfaces: of the hits.
        origin: of n rays; those of the rays found are moved.
        direction: theirs.
        hits: what each ray met.
        rows: (k,) int32 rays to look at; those found are written to its front.
        passed: (n,) float32 distance of each ray's origin from where it began; added to.

    Returns:
        How many were found.
    """
    facets, materials = surfaces.facets, surfaces.materials
    sphere_material = surfaces.spheres.material
    texels, pictures = surfaces.textures.texels, surfaces.textures.pictures
    primitives, distance = hits.primitive, hits.distance
    triangles = len(facets)
    found = 0
    for ray in rows:
        primitive = primitives[ray]
        if primitive < 0 or primitive >= triangles + len(sphere_material):
            continue
        k = primitive - triangles
        row = int(facets[primitive, MATERIAL_COLUMN]) if k < 0 else int(np.int64(sphere_material[k]))
        material = materials[row]
        if material.alpha_picture < 0:
            continue
        s = surface_met(facets, surfaces.spheres, primitive, origin, direction, ray)
        if opacity(texels, pictures, material.alpha_picture, s.u, s.v) >= material.alpha_cutoff:
            continue
        go_on_behind(s, origin, ray)
        passed[ray] += distance[ray]
        rows[found] = ray
        found += 1
    return found


def pass_holes(
    surfaces: Surfaces,
    intersector: Intersector,
    origin: Vectors,
    direction: Vectors,
    hits: Hits,
) -> None:
    """Send the rays that met a hole on, until each has met something whole, or nothing.

    Args:
        surfaces, intersector: what the rays met.
        origin: of n rays; for those that passed a hole, it becomes the last place they went on from.
        direction: theirs.
        hits: of the rays, replaced by those behind the holes; distances still count from where a ray began.
    """
    rows = np.arange(len(hits.primitive), dtype=np.int32)
    passed = np.zeros(len(rows), dtype=np.float32)
    for _ in range(MOST_HOLES):
        rows = rows[: find_holes(surfaces, origin, direction, hits, rows, passed)]
        if len(rows) == 0:
            break
        behind = intersector.nearest(some_vectors(origin, rows), some_vectors(direction, rows))
        for known, new in zip(hits, behind, strict=True):
            known[rows] = new
    hits.distance[:] += passed


def cast_through(sieve: Sieve, shadows: ShadowRays, reach: NDArray[np.float32], blocked: NDArray[np.uint8]) -> None:
    """Mark the shadow rays that meet something whole of a cut-out thing.

    Args:
        sieve: the cut-out things that cast shadows.
        shadows: n shadow rays; their `reach` may have been lost.
        reach: (n,) float32 theirs.
        blocked: (n,) uint8, set to 1 where they are blocked; rays already 1 are skipped.
    """
    rows = np.flatnonzero(blocked == 0)
    if len(rows) == 0:
        return
    origin, direction = some_vectors(shadows.origin, rows), some_vectors(shadows.direction, rows)
    hits = sieve.intersector.nearest(origin, direction)
    pass_holes(sieve.surfaces, sieve.intersector, origin, direction, hits)
    blocked[rows] = (hits.primitive >= 0) & (hits.distance < reach[rows])
