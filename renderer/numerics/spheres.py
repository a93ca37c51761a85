"""Spheres far away: the discriminant from the distance between ray and centre, in float64, against the others.

Cases of Haines, Gunther and Akenine-Moller (Ray Tracing Gems, 2019, ch. 7): a unit sphere at growing distances.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula, kernel
from renderer.numerics.comparison import Comparison, time_ratio
from renderer.sphere import hit_distance

RAYS = 100_000
RIM = 0.999
"""Largest distance of a ray from the centre, in radii."""


@formula
def _by_the_book(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, radius: float
) -> float:
    """The quadratic formula as it is taught: b^2 - 4ac."""
    fx, fy, fz = ox - cx, oy - cy, oz - cz
    a = dx * dx + dy * dy + dz * dz
    half_b = fx * dx + fy * dy + fz * dz
    c = fx * fx + fy * fy + fz * fz - radius * radius
    discriminant = half_b * half_b - a * c
    if not discriminant >= 0.0:
        return math.inf
    return (-half_b - math.sqrt(discriminant)) / a


@kernel
def _robust(origin: NDArray[Any], direction: NDArray[Any], distance: NDArray[np.float64]) -> None:
    """Unit sphere at the origin; in the precision of the rays."""
    zero = origin.dtype.type(0.0)
    for ray in range(len(distance)):
        distance[ray] = hit_distance(
            origin[ray, 0], origin[ray, 1], origin[ray, 2], direction[ray, 0], direction[ray, 1], direction[ray, 2],
            zero, zero, zero, origin.dtype.type(1.0),
        )  # fmt: skip


@kernel
def _taught(origin: NDArray[Any], direction: NDArray[Any], distance: NDArray[np.float64]) -> None:
    """The same by the book."""
    zero = origin.dtype.type(0.0)
    for ray in range(len(distance)):
        distance[ray] = _by_the_book(
            origin[ray, 0], origin[ray, 1], origin[ray, 2], direction[ray, 0], direction[ray, 1], direction[ray, 2],
            zero, zero, zero, origin.dtype.type(1.0),
        )  # fmt: skip


def _rays(away: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Rays that pass the origin at up to RIM, from `away`."""
    rng = np.random.default_rng(20)
    towards = rng.normal(size=(RAYS, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    across = np.cross(towards, rng.normal(size=(RAYS, 3)))
    across *= (RIM * np.sqrt(rng.random(RAYS)) / np.linalg.norm(across, axis=1))[:, None]
    origin = (-away * towards).astype(np.float32)
    return origin, (across - origin.astype(np.float64)).astype(np.float32) / np.float32(away)


def _truth(origin: NDArray[np.float32], direction: NDArray[np.float32]) -> NDArray[np.longdouble]:
    """The same on the same rays, in extended precision."""
    o, d = origin.astype(np.longdouble), direction.astype(np.longdouble)
    a, b = (d * d).sum(axis=1), -(o * d).sum(axis=1)
    nearest = o + (b / a)[:, None] * d
    spare = 1 - (nearest * nearest).sum(axis=1)
    q = b + np.sqrt(a * np.maximum(spare, 0))
    distance = ((o * o).sum(axis=1) - 1) / q
    return np.where(spare >= 0, distance, np.longdouble(np.nan))


def _errors(
    way: Callable[..., None], number: type, origin: NDArray[np.float32], direction: NDArray[np.float32]
) -> tuple[float, float]:
    """Share of rays that miss, and the largest error of the distance of the others, in radii."""
    truth = _truth(origin, direction)
    found = np.zeros(len(origin))
    way(origin.astype(number), direction.astype(number), found)
    sure = ~np.isnan(truth)
    missed = sure & ~np.isfinite(found)
    met = sure & np.isfinite(found)
    return float(missed.sum() / sure.sum()), float(np.abs(found[met] - truth[met]).max(initial=0.0))


def compare_spheres() -> tuple[Comparison, ...]:
    """Errors of the distance, and misses, of a unit sphere 100 and 10,000 radii away."""
    lines = []
    for other, way, number in (("the same, float32", _robust, np.float32), ("b^2 - 4ac, float32", _taught, np.float32),
                               ("b^2 - 4ac, float64", _taught, np.float64)):  # fmt: skip
        for away in (100.0, 10_000.0):
            origin, direction = _rays(away)
            room = np.zeros(len(origin))
            wide, narrow = ((origin.astype(kind), direction.astype(kind)) for kind in (np.float64, number))
            ratio = time_ratio(functools.partial(_robust, *wide, room), functools.partial(way, *narrow, room))
            (missed, error), (other_missed, other_error) = (
                _errors(w, n, origin, direction) for w, n in ((_robust, np.float64), (way, number))
            )
            chosen, case = "robust, float64", f"unit sphere {away:,.0f} radii away"
            lines.append(
                Comparison(case, "largest error of the distance [radii]", chosen, other, error, other_error, ratio)
            )
            if other_missed > 0.0 or missed > 0.0:
                lines.append(Comparison(case, "rays that miss it", chosen, other, missed, other_missed, None))
    return tuple(lines)
