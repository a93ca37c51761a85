"""Shapes made in code: triangles with smooth normals and texture coordinates in metres.

A `Shape` has no material yet; `Shape.mesh` gives it one. Shapes are y up, in metres, and wind
counter-clockwise seen from outside. All are made from one thing, `surface`: a grid of points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.scene import Material, Mesh

Floats = NDArray[np.float64]

CREASE_DEG = 35.0
"""A profile that turns by more than this between two straight pieces has an edge there [deg]."""


@dataclass(frozen=True, eq=False, slots=True)
class Shape:
    """Triangles without a material.

    Attributes:
        vertices: (n, 3) float64 positions [m].
        normals: (n, 3) float64 unit normals.
        uvs: (n, 2) float64 texture coordinates, in metres along the surface.
        faces: (m, 3) int64 vertex indices, counter-clockwise seen from outside.
    """

    vertices: Floats
    normals: Floats
    uvs: Floats
    faces: NDArray[np.int64]

    def moved(self, x: float, y: float, z: float) -> Shape:
        """The shape shifted by (x, y, z) metres."""
        return Shape(self.vertices + np.array([x, y, z]), self.normals, self.uvs, self.faces)

    def stretched(self, x: float, y: float, z: float) -> Shape:
        """The shape scaled by positive factors along the axes; uvs stay."""
        normals = _unit(self.normals / (x, y, z))
        return Shape(self.vertices * (x, y, z), normals, self.uvs, self.faces)

    def turned(self, axis: str, angle_deg: float) -> Shape:
        """The shape turned about the axis `x`, `y` or `z`, counter-clockwise seen from its tip."""
        matrix = _rotation(axis, angle_deg)
        return Shape(_rotated(self.vertices, matrix), _rotated(self.normals, matrix), self.uvs, self.faces)

    def mesh(self, material: Material, tile_m: float = 1.0, *, name: str = "", casts_shadows: bool = True) -> Mesh:
        """The shape in `material`, whose texture repeats every `tile_m` metres."""
        uvs = self.uvs / tile_m
        return Mesh(self.vertices, self.faces, material, self.normals, uvs, casts_shadows, name or material.name)


def join(*shapes: Shape) -> Shape:
    """All shapes as one."""
    starts = np.cumsum([0] + [len(shape.vertices) for shape in shapes])
    return Shape(
        np.concatenate([shape.vertices for shape in shapes]),
        np.concatenate([shape.normals for shape in shapes]),
        np.concatenate([shape.uvs for shape in shapes]),
        np.concatenate([shape.faces + start for shape, start in zip(shapes, starts, strict=False)]),
    )


def repeat(shape: Shape, offsets: ArrayLike) -> Shape:
    """One copy of `shape` at each of the (k, 3) `offsets` [m]."""
    places = np.asarray(offsets, dtype=np.float64).reshape(-1, 3)
    count, n = len(places), len(shape.vertices)
    starts = n * np.arange(count, dtype=np.int64)
    return Shape(
        (places[:, None] + shape.vertices).reshape(-1, 3),
        np.tile(shape.normals, (count, 1)),
        np.tile(shape.uvs, (count, 1)),
        (starts[:, None, None] + shape.faces).reshape(-1, 3),
    )


def surface(points: Floats, uvs: Floats | None = None) -> Shape:
    """The surface through a grid of points, smooth inside.

    It stays smooth across a seam (first and last row or column at the same places) and over a pole
    (a row at one place).

    Args:
        points: (rows, columns, 3) positions [m]; seen from outside, columns run right and rows run up.
        uvs: (rows, columns, 2) texture coordinates [m]; None measures them along the grid.
    """
    rows, columns, _ = points.shape
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([first, first + 1, first + columns + 1], axis=1)
    upper = np.stack([first, first + columns + 1, first + columns], axis=1)
    at_pole = (points == points[:, :1]).all(axis=(1, 2))
    row_of = first // columns
    faces = np.concatenate([lower[~at_pole[row_of]], upper[~at_pole[row_of + 1]]])
    if uvs is None:
        uvs = np.stack([_lengths_along(points, 1), _lengths_along(points, 0)], axis=2)
    return Shape(
        points.reshape(-1, 3), _grid_normals(points, at_pole).reshape(-1, 3), uvs.reshape(-1, 2), faces.astype(np.int64)
    )


def lathe(profile: ArrayLike, segments: int = 48, swell: Floats | None = None, sweep_deg: float = 360.0) -> Shape:
    """A profile turned about the y axis; closed where it starts and ends at radius 0.

    Args:
        profile: (k, 2) radius and height [m], with the outside to its right: bottom to top on the outside.
            Corners sharper than `CREASE_DEG` become edges.
        segments: straight pieces around.
        swell: (segments + 1,) or (k, segments + 1) factors on the radius, for flutes and lobes.
        sweep_deg: how far round it goes, from +x towards -z [deg].
    """
    outline = np.asarray(profile, dtype=np.float64)
    angle = np.radians(sweep_deg) * np.arange(segments + 1) / segments
    around = np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=1)
    if sweep_deg == 360.0:
        around[-1] = around[0]
    factors = np.broadcast_to(1.0 if swell is None else swell, (len(outline), segments + 1))
    points = (outline[:, 0, None] * factors)[:, :, None] * around
    points[:, :, 1] = outline[:, 1, None]
    steps = np.hypot(*np.diff(outline, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    uvs = np.stack(np.broadcast_arrays(angle * outline[:, 0].max(), along[:, None]), axis=2)
    return _creased(outline, points, uvs)


def moulding(profile: ArrayLike, start: ArrayLike, end: ArrayLike, out_start: ArrayLike, out_end: ArrayLike) -> Shape:
    """A straight moulding from `start` to `end`, left to right seen from outside.

    Args:
        profile: (k, 2) distance out and height [m], drawn as for `lathe`.
        start: (3,) where the profile's origin begins its run [m].
        end: (3,) where it ends [m].
        out_start: (3,) the way out at the start; slanted where two mouldings meet in a mitre.
        out_end: (3,) the way out at the end.
    """
    outline = np.asarray(profile, dtype=np.float64)
    ends = np.asarray([start, end], dtype=np.float64)
    outward = np.asarray([out_start, out_end], dtype=np.float64)
    points = ends + outline[:, None, :1] * outward + outline[:, None, 1:] * (0.0, 1.0, 0.0)
    return _creased(outline, points, np.stack([_lengths_along(points, 1), _lengths_along(points, 0)], axis=2))


def tube(path: ArrayLike, width: ArrayLike, thickness: ArrayLike, side: ArrayLike, sides: int = 10) -> Shape:
    """A flat or round tube along a path: a closed ring where the path ends where it starts, else closed at its ends.

    Args:
        path: (k, 3) centre line [m].
        width: half-axis of the section along `side` [m], a scalar or (k,).
        thickness: half-axis of the section across `side` [m], a scalar or (k,).
        side: (3,) direction, or (k, 3), nowhere along the path.
        sides: straight pieces around.
    """
    line = np.asarray(path, dtype=np.float64)
    is_ring = np.array_equal(line[0], line[-1])
    extended = np.concatenate([line[-2:-1], line, line[1:2]]) if is_ring else line
    tangent = _unit(np.gradient(extended, axis=0)[1:-1] if is_ring else np.gradient(extended, axis=0))
    sideways = np.broadcast_to(np.asarray(side, dtype=np.float64), line.shape)
    across = _unit(sideways - (sideways * tangent).sum(axis=1, keepdims=True) * tangent)
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    cosine, sine = np.cos(angle), np.sin(angle)
    cosine[-1], sine[-1] = cosine[0], sine[0]
    wide = np.broadcast_to(width, len(line))[:, None, None] * across[:, None] * cosine[:, None]
    thick = np.broadcast_to(thickness, len(line))[:, None, None] * np.cross(tangent, across)[:, None] * sine[:, None]
    rings = line[:, None] + wide + thick
    if is_ring:
        rings[-1] = rings[0]
        return surface(rings)
    caps = [np.repeat(line[end][None, None], sides + 1, axis=1) for end in (0, -1)]
    return surface(np.concatenate([caps[0], rings, caps[1]]))


def quad(corner: ArrayLike, right: ArrayLike, up: ArrayLike) -> Shape:
    """A flat parallelogram from `corner` along `right` and `up` [m], seen from right x up."""
    start, u, v = (np.asarray(edge, dtype=np.float64) for edge in (corner, right, up))
    return surface(np.array([[start, start + u], [start + v, start + u + v]]))


def box(low: ArrayLike, high: ArrayLike) -> Shape:
    """The closed box between two opposite corners, the smaller coordinates first [m]."""
    x, y, z = np.asarray(high, dtype=np.float64) - np.asarray(low, dtype=np.float64)
    low_corner = np.asarray(low, dtype=np.float64)
    sides = (
        quad((0, 0, z), (x, 0, 0), (0, y, 0)),
        quad((x, 0, 0), (-x, 0, 0), (0, y, 0)),
        quad((x, 0, z), (0, 0, -z), (0, y, 0)),
        quad((0, 0, 0), (0, 0, z), (0, y, 0)),
        quad((0, y, z), (x, 0, 0), (0, 0, -z)),
        quad((0, 0, 0), (x, 0, 0), (0, 0, z)),
    )
    return join(*sides).moved(*low_corner)


def ball(radius: float, segments: int = 32) -> Shape:
    """A closed tessellated sphere around the origin."""
    return lathe(arc((0.0, 0.0), radius, -90.0, 90.0, segments // 2), segments)


def torus(radius: float, thickness: float, segments: int = 48, sides: int = 24) -> Shape:
    """A closed ring about the y axis: `radius` to the middle of a tube of radius `thickness` [m]."""
    return lathe(arc((radius, 0.0), thickness, -90.0, 270.0, sides), segments)


def arc(center: tuple[float, float], radius: float, start_deg: float, end_deg: float, pieces: int) -> Floats:
    """(pieces + 1, 2) points on a circle for a profile, counter-clockwise where end > start.

    Points on the lathe's axis and the end of a full turn are exact.
    """
    angle = np.radians(np.linspace(start_deg, end_deg, pieces + 1))
    points = np.stack([center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle)], axis=1)
    points[np.abs(points[:, 0]) < 1e-12 * radius, 0] = 0.0
    if abs(end_deg - start_deg) == 360.0:
        points[-1] = points[0]
    return points


def curve(*points: Sequence[float], pieces: int = 8) -> Floats:
    """A smooth curve through 2-D or 3-D points (Catmull-Rom), `pieces` straight pieces between two."""
    knots = np.asarray(points, dtype=np.float64)
    padded = np.concatenate([2 * knots[:1] - knots[1:2], knots, 2 * knots[-1:] - knots[-2:-1]])
    t = (np.arange(pieces) / pieces)[:, None]
    spans = [
        0.5 * ((2 * b) + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:], strict=False)
    ]
    return np.concatenate([*spans, knots[-1:]])


def _grid_normals(points: Floats, at_pole: NDArray[np.bool_]) -> Floats:
    """(rows, columns, 3) unit normals: the mean of the unit normals of the quads around each point."""
    facing = np.cross(points[1:, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, 1:])
    length = np.sqrt((facing * facing).sum(axis=2, keepdims=True))
    facing /= np.where(length > 0.0, length, 1.0)
    normals = np.zeros_like(points)
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            normals[rows, columns] += facing
    normals[at_pole] = normals[at_pole].sum(axis=1, keepdims=True)
    if np.array_equal(points[:, 0], points[:, -1]):
        normals[:, 0] = normals[:, -1] = normals[:, 0] + normals[:, -1]
    if np.array_equal(points[0], points[-1]):
        normals[0] = normals[-1] = normals[0] + normals[-1]
    return _unit(normals)


def _creased(outline: Floats, points: Floats, uvs: Floats) -> Shape:
    """The surface through `points`, one row a point of the profile, with edges where the profile turns sharply."""
    direction = _unit(np.diff(outline, axis=0))
    turn = (direction[1:] * direction[:-1]).sum(axis=1)
    sharp = np.flatnonzero(turn < math.cos(math.radians(CREASE_DEG))) + 1
    rows = [0, *sharp.tolist(), len(outline) - 1]
    return join(*(surface(points[a : b + 1], uvs[a : b + 1]) for a, b in pairwise(rows)))


def _lengths_along(points: Floats, axis: int) -> Floats:
    """(rows, columns) distance walked along the grid up to each point [m]."""
    steps = np.linalg.norm(np.diff(points, axis=axis), axis=2)
    return np.insert(np.cumsum(steps, axis=axis), 0, 0.0, axis=axis)


def _rotation(axis: str, angle_deg: float) -> Floats:
    quarter, rest = divmod(angle_deg, 90.0)
    exact = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    angle = math.radians(angle_deg)
    c, s = exact[int(quarter) % 4] if rest == 0.0 else (math.cos(angle), math.sin(angle))
    rows = {
        "x": ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)),
        "y": ((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)),
        "z": ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)),
    }[axis]
    return np.array(rows)


def _rotated(vectors: Floats, matrix: Floats) -> Floats:
    """`vectors @ matrix.T` by plain sums: the same bits whatever linear-algebra library is there."""
    return vectors[:, :1] * matrix[:, 0] + vectors[:, 1:2] * matrix[:, 1] + vectors[:, 2:] * matrix[:, 2]


def _unit(vectors: Floats) -> Floats:
    """Vectors of length one; a vector without length becomes +y or, in 2-D, its last axis."""
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    fallback = np.zeros(vectors.shape[-1])
    fallback[1] = 1.0
    return np.where(length > 0.0, vectors / np.where(length > 0.0, length, 1.0), fallback)
