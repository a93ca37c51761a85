"""Embree's robust traversal against its fast one: rays that slip between the triangles of a closed mesh.

The tests of Embree (verify.cpp, WatertightTest) and of pbrt-v4 (shapes_test.cpp): every ray from inside a closed
mesh hits it.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.embree import plain_scene
from renderer.numerics.comparison import Comparison, time_ratio

RINGS, SECTORS = 200, 400
"""Of the sphere: 159,200 triangles."""

RADIUS = 2.0
RAYS = 50_000
FAR = (148376.0, 1234.0, -223423.0)
"""Where Embree's own test puts the sphere."""


class _Rays(NamedTuple):
    origin: NDArray[np.float32]
    direction: NDArray[np.float32]


@functools.cache
def _closed_sphere() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices and faces of a sphere around the origin, closed, its poles one vertex each."""
    height = np.pi * np.arange(1, RINGS)[:, None] / RINGS
    turn = 2 * np.pi * np.arange(SECTORS)[None, :] / SECTORS
    ring = np.stack(np.broadcast_arrays(np.sin(height) * np.cos(turn), np.cos(height), np.sin(height) * np.sin(turn)))
    vertices = np.concatenate([ring.reshape(3, -1).T, [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]]) * RADIUS
    first = np.arange(SECTORS)
    second = (first + 1) % SECTORS
    rows = SECTORS * np.arange(RINGS - 2)[:, None]
    upper, lower = rows + first, rows + SECTORS + first
    upper_next, lower_next = rows + second, rows + SECTORS + second
    top, bottom = len(vertices) - 2, len(vertices) - 1
    last = SECTORS * (RINGS - 2)
    faces = [
        np.stack([upper, upper_next, lower], axis=-1).reshape(-1, 3),
        np.stack([upper_next, lower_next, lower], axis=-1).reshape(-1, 3),
        np.stack([np.full(SECTORS, top), second, first], axis=-1),
        np.stack([np.full(SECTORS, bottom), last + first, last + second], axis=-1),
    ]
    return vertices, np.concatenate(faces).astype(np.int32)


def _rays(place: NDArray[np.float64], targets: NDArray[np.float64] | None) -> _Rays:
    """Rays from within the sphere in random directions, or towards `targets`."""
    rng = np.random.default_rng(4)
    inside = rng.uniform(-1, 1, (RAYS, 3)) * RADIUS / 4
    direction = rng.uniform(-1, 1, (RAYS, 3)) if targets is None else targets[rng.integers(len(targets), size=RAYS)]
    origin = (inside + place).astype(np.float32)
    towards = direction if targets is None else (direction + place).astype(np.float32) - origin
    return _Rays(origin, np.ascontiguousarray(towards, dtype=np.float32))


def _met(scene: Any, rays: _Rays) -> NDArray[np.int32]:
    """Numbers of the triangles that are hit, -1 for none."""
    found: NDArray[np.int32] = scene.run(rays.origin, rays.direction, None, "INTERSECT", output=True)["primID"]
    return found


def compare_traversal() -> tuple[Comparison, ...]:
    """Shares of rays that miss a closed sphere of 159,200 triangles, near the origin and far away."""
    vertices, faces = _closed_sphere()
    lines = []
    for case, place, targets in (
        ("closed sphere at the origin", (0.0, 0.0, 0.0), None),
        ("the same 270 km away", FAR, None),
        ("the same at the origin, aimed at vertices", (0.0, 0.0, 0.0), vertices),
    ):
        there = (vertices + place).astype(np.float32)
        robust, fast = (plain_scene(there, faces, robust=robust) for robust in (True, False))
        rays = _rays(np.array(place), targets)
        trace_robust, trace_fast = (functools.partial(_met, scene, rays) for scene in (robust, fast))
        missed, missed_fast = (float((trace() < 0).mean()) for trace in (trace_robust, trace_fast))
        ratio = time_ratio(trace_robust, trace_fast)
        lines.append(Comparison(case, "rays that slip through", "robust", "fast", missed, missed_fast, ratio))
    return tuple(lines)
