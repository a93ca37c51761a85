"""Meshes that hard cases are made of, and rays in the units that a prepared scene is traced in."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.prepared import PreparedScene, prepare
from renderer.scene import Mesh, Scene
from tests.renderer.drawing import WHITE_LAMBERT

Floats = NDArray[np.float64]
Rays = tuple[NDArray[np.float32], NDArray[np.float32]]


def ringed_ball(rings: int, segments: int, radius: float) -> tuple[Floats, NDArray[np.int64]]:
    """A closed ball of 2 * segments * (rings - 1) triangles; each pole is one vertex that `segments` of them share."""
    polar = np.pi * np.arange(1, rings)[:, None] / rings
    around = 2 * np.pi * np.arange(segments) / segments
    ring = np.stack([np.sin(polar) * np.cos(around), np.cos(polar) + 0 * around, np.sin(polar) * np.sin(around)], 2)
    vertices = radius * np.concatenate([ring.reshape(-1, 3), [(0, 1, 0), (0, -1, 0)]])
    this = np.arange(segments)
    beside = (this + 1) % segments
    row = segments * np.arange(rings - 2)[:, None]
    a, b = (row + this).ravel(), (row + beside).ravel()
    c, d = a + segments, b + segments
    last, top = segments * (rings - 2), np.full(segments, len(vertices) - 2)
    faces = [(a, b, c), (b, d, c), (top, beside, this), (top + 1, last + this, last + beside)]
    return vertices, np.concatenate([np.stack(corners, axis=1) for corners in faces])


def sheet(columns: int, side: float) -> tuple[Floats, NDArray[np.int64]]:
    """A square of 2 * columns^2 triangles in the plane z = 0 around the origin, with shared corners."""
    place = (np.arange(columns + 1) - columns / 2) * side / columns
    vertices = np.stack([*np.meshgrid(place, place), np.zeros((columns + 1, columns + 1))], axis=2).reshape(-1, 3)
    corner = (np.arange(columns)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    along, up = corner + 1, corner + columns + 1
    return vertices, np.concatenate([np.stack([corner, along, up], 1), np.stack([along, up + 1, up], 1)])


def prepared_mesh(vertices: ArrayLike, faces: ArrayLike) -> PreparedScene:
    """A scene of nothing but this mesh."""
    mesh = Mesh(np.asarray(vertices, np.float64), np.asarray(faces, np.int64).reshape(-1, 3), WHITE_LAMBERT)
    return prepare(Scene(meshes=(mesh,)))


def traced(prepared: PreparedScene, points: ArrayLike) -> NDArray[np.float32]:
    """(n, 3) world positions as the tracer holds them."""
    return ((np.asarray(points, np.float64) - prepared.center) * prepared.scale).astype(np.float32)


def directions(rng: np.random.Generator, count: int) -> Floats:
    """(count, 3) unit vectors, evenly distributed."""
    vectors = rng.normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def rotation(rng: np.random.Generator) -> Floats:
    """A random rotation matrix."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.asarray(turn * np.sign(np.linalg.det(turn)))
