"""Where in its cell each camera ray goes.

The first sample is the cell's centre. The others are uniform over the cell (`stochastic`), hashed from
the cell's position and side and the sample's number, or lie on a lattice (`regular`), in an order in which
the first few are spread too. Neither knows the frame or the gaze, so the same cell always gets the same rays.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from renderer.camera import ViewFrame
from renderer.footprint import pencil_spread
from renderer.gather import held, lane_numbers
from renderer.kernel import formula, roomy_kernel
from renderer.lanes import LANES, root
from renderer.rays import Rays
from renderer.scatter import put

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
"""Constants of the splitmix64 generator (Steele, Lea and Flood 2014)."""

TO_UNIT = 2.0**-32
"""From a 32-bit integer to [0, 1)."""


@formula
def mix(word: np.uint64) -> np.uint64:
    """Finaliser of splitmix64: 64 well mixed bits of `word`."""
    word = (word ^ (word >> np.uint64(30))) * MIX_1
    word = (word ^ (word >> np.uint64(27))) * MIX_2
    return word ^ (word >> np.uint64(31))


@formula
def cell_seed(x: int, y: int, side: int) -> np.uint64:
    """Seed of a cell: its position and side, each below 2^16, side by side."""
    return mix((np.uint64(x) | (np.uint64(y) << np.uint64(20)) | (np.uint64(side) << np.uint64(40))) + GOLDEN)


@functools.cache
def lattice_step(samples: int) -> int:
    """Generator a of the rank-1 lattice (i/n, i*a/n) of n points that keeps them farthest apart.

    Args:
        samples: n, 1 or more.
    """
    index = np.arange(1, samples)
    if len(index) == 0:
        return 1
    candidates = np.arange(1, samples) if samples <= 512 else np.unique(np.linspace(1, samples - 1, 512).astype(int))
    best, widest = 1, -1.0
    across = np.minimum(index, samples - index)
    for step in candidates:
        down = index * step % samples
        down = np.minimum(down, samples - down)
        nearest = float((across * across + down * down).min())
        if nearest > widest:
            best, widest = int(step), nearest
    return best


@functools.cache
def lattice_order(samples: int) -> int:
    """Stride s that visits the points of a lattice, i*s mod n, so that any few in a row lie far apart.

    It is prime to n and as near to n over the golden ratio as can be (Knuth 1973, 6.4: the gaps that the
    points leave are of at most three sizes, and the next point falls into a widest one).

    Args:
        samples: n, 1 or more.
    """
    aim = samples * (math.sqrt(5.0) - 1.0) / 2.0
    return min(
        (stride for stride in range(1, samples + 1) if math.gcd(stride, samples) == 1), key=lambda s: abs(s - aim)
    )


@formula
def lattice_shift(step: int, points: int) -> float:
    """Shift, in steps of 1/points, that puts the lattice's coordinates i*step/points in the middle of
    their strata when counted from the cell's centre: half a stratum where there is an even number of
    them, else nothing. Without it the samples would lean to the cell's upper left.
    """
    shared = math.gcd(step, points)
    return 0.5 * shared if points // shared % 2 == 0 else 0.0


@roomy_kernel
def camera_rays(
    view: ViewFrame,
    origin: NDArray[np.float32],
    width: int,
    height: int,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    cells: NDArray[np.int32],
    first: NDArray[np.int32],
    until: NDArray[np.int32],
    points: int,
    step: int,
    order: int,
    rays: Rays,
) -> None:
    """Write the camera rays of some cells, the samples of a cell after one another.

    Args:
        view: the camera on the display.
        origin: (3,) float32 camera position in scene units.
        width, height: the screen [px].
        x, y, side: (n,) int32 cell vector.
        cells: (c,) int32 cells to sample.
        first, until: (c,) int32 samples first .. until - 1 of each.
        points: samples that a cell gets in the end.
        step: 0 for stochastic samples, else the generator of the regular lattice of `points` points.
        order: stride in which its points are visited.
        rays: room for all of them.
    """
    shift_u, shift_v = lattice_shift(1, points), lattice_shift(step, points)
    places = np.zeros((3, LANES))
    ray = 0
    for index in range(len(cells)):
        cell = cells[index]
        left, top = x[cell], y[cell]
        wide, high = min(side[cell], width - left), min(side[cell], height - top)
        seed = cell_seed(left, top, side[cell])
        for sample in range(first[index], until[index]):
            u, v = 0.5, 0.5
            if sample > 0 and step > 0:
                point = sample * order % points
                u = (0.5 + (point + shift_u) / points) % 1.0
                v = (0.5 + (point * step + shift_v) / points) % 1.0
            elif sample > 0:
                word = mix(seed + np.uint64(sample) * GOLDEN)
                u = (np.float64(word >> np.uint64(32)) + 0.5) * TO_UNIT
                v = (np.float64(word & np.uint64(0xFFFFFFFF)) + 0.5) * TO_UNIT
            lane = ray % LANES
            places[0, lane], places[1, lane], places[2, lane] = left + u * wide, top + v * high, side[cell]
            ray += 1
            if lane == LANES - 1:
                _aim(view, origin, points, places, ray - LANES, rays)
    if ray % LANES > 0:
        _aim(view, origin, points, places, ray - ray % LANES, rays)


@formula
def _aim(
    view: ViewFrame,
    origin: NDArray[np.float32],
    points: int,
    places: NDArray[np.float64],
    first: int,
    rays: Rays,
) -> None:
    """Write LANES rays, from `first` on, through places on the screen.

    Args:
        view, origin, points: of `camera_rays`.
        places: (3, LANES) float64 x and y of the places, and the sides of their cells [px].
        first: number of the first ray.
        rays: written.
    """
    corner, across, down = view.corner, view.step_x, view.step_y
    px, py, side = held(places, 0), held(places, 1), held(places, 2)
    dx = corner[0] + px * across[0] + py * down[0]
    dy = corner[1] + px * across[1] + py * down[1]
    dz = corner[2] + px * across[2] + py * down[2]
    inverse = 1.0 / root(dx * dx + dy * dy + dz * dz)
    wide = across[0] * across[0] + across[1] * across[1] + across[2] * across[2]
    high = down[0] * down[0] + down[1] * down[1] + down[2] * down[2]
    pixel = root(root(wide) * root(high))
    put(rays.origin.x, first, origin[0])
    put(rays.origin.y, first, origin[1])
    put(rays.origin.z, first, origin[2])
    put(rays.direction.x, first, dx * inverse)
    put(rays.direction.y, first, dy * inverse)
    put(rays.direction.z, first, dz * inverse)
    put(rays.weight.x, first, 1.0)
    put(rays.weight.y, first, 1.0)
    put(rays.weight.z, first, 1.0)
    put(rays.sample, first, lane_numbers(first))
    put(rays.width, first, 0.0)
    put(rays.spread, first, pencil_spread(side, points, pixel, inverse))
