"""Where a ray starts that leaves a surface: how many hit the triangle that they leave, and how far off they start.

The catalogue of Waechter and Binder (Ray Tracing Gems, 2019, ch. 6) and of pbrt-v4's shapes_test.cpp: single
triangles of all sizes, near the origin and far from it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.embree import EmbreeTriangles
from renderer.kernel import formula, kernel
from renderer.numerics.comparison import Comparison, time_ratio
from renderer.prepared import FACET, NORMAL_COLUMN, REACH_COLUMN
from renderer.surface import Surface, triangle_surface, weights_at

PLACES = ((0.0, 1.0), (1e3, 1.0), (1e5, 1.0), (10.0, 1e-3), (0.0, 1e-6), (0.0, 1e7))
"""Distance of the triangles from the origin, and their size."""

TRIANGLES, EACH = 150, 64
"""Triangles at each place, and rays at each."""

FIXED = 1e-4
"""The offset of many a renderer."""

INTEGER_SCALE, FLOAT_SCALE, NEAR_ORIGIN = np.float32(256.0), np.float32(1.0 / 65536.0), np.float32(1.0 / 32.0)
"""Of Waechter and Binder (2019), listing 6-1."""


class _Hits(NamedTuple):
    """Rays that met triangle `number` of `facets`, one facet each, and where.

    Attributes:
        facets: (t, FACET) float32.
        number: (n,) int64.
        origin, direction: (n, 3) float32.
        distance: (n,) float32, by Embree.
    """

    facets: NDArray[np.float32]
    number: NDArray[np.int64]
    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    distance: NDArray[np.float32]


@formula
def _surface(hits: _Hits, ray: int) -> Surface:
    """The surface of one hit, from barycentric weights in float64."""
    facets, origin, direction = hits.facets, hits.origin, hits.direction
    t = hits.number[ray]
    ox, oy, oz = np.float64(origin[ray, 0]), np.float64(origin[ray, 1]), np.float64(origin[ray, 2])
    dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
    b1, b2 = weights_at(facets, t, ox, oy, oz, dx, dy, dz)
    return triangle_surface(facets, t, b1, b2, dx, dy, dz)


@kernel
def _ours(hits: _Hits, leaving: NDArray[np.float32]) -> None:
    """16 units in the last place of the largest coordinate off."""
    for ray in range(len(leaving)):
        s = _surface(hits, ray)
        leaving[ray, 0] = s.px + s.offset * s.gx
        leaving[ray, 1] = s.py + s.offset * s.gy
        leaving[ray, 2] = s.pz + s.offset * s.gz


@kernel
def _fixed(hits: _Hits, offset: float, leaving: NDArray[np.float32]) -> None:
    """The same place, a fixed length off."""
    for ray in range(len(leaving)):
        s = _surface(hits, ray)
        leaving[ray, 0] = s.px + offset * s.gx
        leaving[ray, 1] = s.py + offset * s.gy
        leaving[ray, 2] = s.pz + offset * s.gz


@kernel
def _along(hits: _Hits, leaving: NDArray[np.float32]) -> None:
    """o + t*d in place of the barycentric weights, as far off as ours."""
    facets, origin, direction, distance = hits.facets, hits.origin, hits.direction, hits.distance
    for ray in range(len(leaving)):
        t = hits.number[ray]
        dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
        s = triangle_surface(facets, t, 0.0, 0.0, dx, dy, dz)
        leaving[ray, 0] = (origin[ray, 0] + distance[ray] * direction[ray, 0]) + s.offset * s.gx
        leaving[ray, 1] = (origin[ray, 1] + distance[ray] * direction[ray, 1]) + s.offset * s.gy
        leaving[ray, 2] = (origin[ray, 2] + distance[ray] * direction[ray, 2]) + s.offset * s.gz


@kernel
def _integer(hits: _Hits, leaving: NDArray[np.float32], bits: NDArray[np.int32], place: NDArray[np.float32]) -> None:
    """The place moved by its bits, read as an integer (Waechter and Binder 2019); `bits` is `place` read so."""
    facets, origin, direction = hits.facets, hits.origin, hits.direction
    for ray in range(len(leaving)):
        t = hits.number[ray]
        ox, oy, oz = np.float64(origin[ray, 0]), np.float64(origin[ray, 1]), np.float64(origin[ray, 2])
        dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
        b1, b2 = weights_at(facets, t, ox, oy, oz, dx, dy, dz)
        s = triangle_surface(facets, t, b1, b2, dx, dy, dz)
        place[0], place[1], place[2] = s.px, s.py, s.pz
        for axis in range(3):
            normal = np.float32(s.gx if axis == 0 else (s.gy if axis == 1 else s.gz))
            before = place[axis]
            if abs(before) < NEAR_ORIGIN:
                leaving[ray, axis] = before + FLOAT_SCALE * normal
                continue
            step = np.int32(INTEGER_SCALE * normal)
            bits[axis] += -step if before < 0.0 else step
            leaving[ray, axis] = place[axis]


def _facets(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    """(t, FACET) facets of (t, 3, 3) corners, as far as a position and its offset need them."""
    facets = np.zeros((len(corners), FACET), dtype=np.float32)
    for corner in range(3):
        facets[:, 8 * corner : 8 * corner + 3] = corners[:, corner]
    wide = corners.astype(np.float64)
    normal = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    facets[:, NORMAL_COLUMN : NORMAL_COLUMN + 3] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    facets[:, REACH_COLUMN] = np.abs(corners).max(axis=(1, 2))
    return facets


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _hits(away: float, size: float) -> tuple[_Hits, list[EmbreeTriangles]]:
    """Rays that hit triangles `away` from the origin, from ten sizes off, and a scene for each triangle."""
    rng = np.random.default_rng(1)
    middle = _unit(rng.normal(size=(TRIANGLES, 3))) * away
    corners = (middle[:, None] + rng.normal(size=(TRIANGLES, 3, 3)) * size).astype(np.float32)
    facets = _facets(corners)
    weights = rng.dirichlet((1.0, 1.0, 1.0), (TRIANGLES, EACH))
    target = np.einsum("tkc,tcx->tkx", weights, corners.astype(np.float64))
    origin = (target + 10 * size * _unit(rng.normal(size=target.shape))).astype(np.float32)
    direction = _unit(target - origin).astype(np.float32)
    scenes = [EmbreeTriangles(part, np.array([[0, 1, 2]], dtype=np.int32)) for part in corners]
    met = [scene.nearest(o, d, coherent=False) for scene, o, d in zip(scenes, origin, direction, strict=True)]
    found = np.concatenate([primitive for primitive, _ in met]) >= 0
    number = np.repeat(np.arange(TRIANGLES), EACH)[found]
    distance = np.concatenate([distance for _, distance in met])[found]
    return _Hits(facets, number, origin.reshape(-1, 3)[found], direction.reshape(-1, 3)[found], distance), scenes


def _hit_again(hits: _Hits, scenes: list[EmbreeTriangles], leaving: NDArray[np.float32]) -> float:
    """Share of rays from `leaving`, in all directions of the side they came from, that hit their own triangle."""
    rng = np.random.default_rng(2)
    out = _unit(rng.normal(size=leaving.shape))
    normal = hits.facets[hits.number, NORMAL_COLUMN : NORMAL_COLUMN + 3].astype(np.float64)
    side = -np.sign((normal * hits.direction).sum(axis=1, keepdims=True))
    out *= np.sign((out * normal * side).sum(axis=1, keepdims=True))
    again = 0
    for number, scene in enumerate(scenes):
        mine = hits.number == number
        if mine.any():
            origin, direction = np.ascontiguousarray(leaving[mine]), out[mine].astype(np.float32)
            again += int((scene.nearest(origin, direction, coherent=False)[0] >= 0).sum())
    return again / len(leaving)


def compare_leaving() -> tuple[Comparison, ...]:
    """Shares of rays that hit the triangle they leave, at the place where the other way is worst.

    Of a fixed offset and the integer one also the largest offset, in sizes of the triangle: light leaks through
    thinner walls.
    """
    bits = np.zeros(3, dtype=np.int32)
    ways: dict[str, Callable[[_Hits, NDArray[np.float32]], None]] = {
        "16 ulp, from u, v": _ours,
        "no offset": lambda hits, leaving: _fixed(hits, 0.0, leaving),
        "fixed 1e-4": lambda hits, leaving: _fixed(hits, FIXED, leaving),
        "16 ulp, from o + t*d": _along,
        "integer offset": lambda hits, leaving: _integer(hits, leaving, bits, bits.view(np.float32)),
    }
    again: dict[str, list[float]] = {way: [] for way in ways}
    off: dict[str, list[float]] = {way: [] for way in ways}
    for away, size in PLACES:
        hits, scenes = _hits(away, size)
        foot = np.zeros_like(hits.origin)
        _fixed(hits, 0.0, foot)
        for way, place in ways.items():
            leaving = np.zeros_like(hits.origin)
            place(hits, leaving)
            again[way].append(_hit_again(hits, scenes, leaving))
            off[way].append(float(np.linalg.norm(leaving.astype(np.float64) - foot, axis=1).max()) / size)
    (ours, _), *others = ways.items()
    lines = []
    room = np.zeros_like(hits.origin)
    for way, place in others:
        worst = int(np.argmax(again[way]))
        ratio = time_ratio(functools.partial(_ours, hits, room), functools.partial(place, hits, room))
        lines.append(
            Comparison(_named(*PLACES[worst]), "rays that hit what they leave", ours, way,
                       again[ours][worst], again[way][worst], ratio)
        )  # fmt: skip
        if way in ("fixed 1e-4", "integer offset"):
            widest = int(np.argmax(np.array(off[way]) / np.array(off[ours])))
            lines.append(
                Comparison(_named(*PLACES[widest]), "offset in sizes of the triangle", ours, way,
                           off[ours][widest], off[way][widest], None)
            )  # fmt: skip
    return tuple(lines)


def _named(away: float, size: float) -> str:
    return f"triangle of size {size:g}, {away:g} from the origin"
