"""Polygons into triangles: fans where the polygon is convex, ears clipped where it is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MAX_CONCAVE_CORNERS = 1000
"""Most corners of a polygon that is not convex: clipping its ears takes the square of that in steps."""

_FLAT = 1e-9
"""Sine of the turn below which a corner counts as straight."""


def triangulate(points: NDArray[np.float64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles that cover each polygon, in the polygons' order and winding.

    Args:
        points: (c, 3) corners of all polygons, one polygon after the other.
        sizes: (p,) corners of each polygon, at least 3, summing to c.

    Returns:
        (sum(sizes - 2), 3) int64 rows of `points`.

    Raises:
        ValueError: for a polygon that is not convex and has too many corners; says which.
    """
    ends = np.cumsum(sizes)
    starts = ends - sizes
    fans = sizes - 2
    fan_starts = np.cumsum(fans) - fans
    owner = np.repeat(np.arange(len(sizes)), fans)
    step = np.arange(len(owner)) - fan_starts[owner]
    first = starts[owner]
    triangles = np.stack([first, first + step + 1, first + step + 2], axis=1)
    for polygon in _concave(points, starts, sizes):
        start, size, at = starts[polygon], sizes[polygon], fan_starts[polygon]
        if size > MAX_CONCAVE_CORNERS:
            raise ValueError(
                f"polygon {polygon}: expected at most {MAX_CONCAVE_CORNERS} corners unless convex, found {size}"
            )
        triangles[at : at + size - 2] = start + _clip_ears(points[start : start + size])
    return triangles


def _concave(points: NDArray[np.float64], starts: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Indices of the polygons with a corner that turns against the polygon."""
    many = np.flatnonzero(sizes > 3)
    if len(many) == 0:
        return many
    sizes, starts = sizes[many], starts[many]
    ends = np.cumsum(sizes)
    begins = ends - sizes
    owner = np.repeat(np.arange(len(many)), sizes)
    corner = np.arange(ends[-1]) - begins[owner] + starts[owner]
    following = corner + 1
    following[ends - 1] = starts
    before = corner - 1
    before[begins] = starts + sizes - 1
    ahead = points[following] - points[corner]
    turn = np.cross(points[corner] - points[before], ahead)
    from_first = points[corner] - points[starts][owner]
    normal = np.add.reduceat(np.cross(from_first, ahead), begins)
    against = np.einsum("ij,ij->i", turn, normal[owner])
    length = np.linalg.norm(ahead, axis=1)
    straight = _FLAT * length * length[_previous(begins, ends)] * np.linalg.norm(normal, axis=1)[owner]
    return many[np.logical_or.reduceat(against < -straight, begins)]


def _previous(begins: NDArray[np.int64], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each of the corners of all polygons, the row of the corner before it."""
    rows = np.arange(-1, ends[-1] - 1)
    rows[begins] = ends - 1
    return rows


def _clip_ears(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n - 2, 3) triangles of one polygon of n corners.

    Source: Meisters, Polygons have ears, 1975. A polygon that crosses itself gets triangles too, but not
    a faithful cover.
    """
    flat = _flatten(points)
    rest = list(range(len(flat)))
    triangles: list[tuple[int, int, int]] = []
    while len(rest) > 3:
        at = next((i for i in range(len(rest)) if _is_ear(flat, rest, i)), 0)
        triangles.append((rest[at - 1], rest[at], rest[(at + 1) % len(rest)]))
        del rest[at]
    triangles.append((rest[0], rest[1], rest[2]))
    return np.array(triangles, dtype=np.int64)


def _flatten(points: NDArray[np.float64]) -> list[tuple[float, float]]:
    """The polygon in the plane, counter-clockwise: the axis that its normal follows most is dropped."""
    from_first = points - points[0]
    normal = np.cross(from_first, np.roll(points, -1, axis=0) - points).sum(axis=0)
    drop = int(np.argmax(np.abs(normal)))
    first, second = ((1, 2), (2, 0), (0, 1))[drop]
    if normal[drop] < 0:
        first, second = second, first
    return [(float(x), float(y)) for x, y in from_first[:, [first, second]]]


def _is_ear(flat: list[tuple[float, float]], rest: list[int], at: int) -> bool:
    a, b, c = (flat[rest[i % len(rest)]] for i in (at - 1, at, at + 1))
    if _turn(a, b, c) <= 0:
        return False
    for other in rest:
        p = flat[other]
        if p not in (a, b, c) and _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0:
            return False
    return True


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Above 0 where a, b, c turn left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
