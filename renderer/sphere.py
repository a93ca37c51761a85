"""Analytic spheres: a bounding-volume tree and the robust ray-sphere test, in float64.

The discriminant is taken from the distance between the ray and the centre instead of from b^2 - 4ac,
and the second root from the product of the roots (Haines, Gunther and Akenine-Moller, Ray Tracing
Gems, 2019, ch. 7), so that far and large spheres keep their shape.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula, roomy_kernel

LEAF_SPHERES = 4
"""Most spheres in a leaf of the tree."""

STACK_SIZE = 64
"""Pending nodes of a traversal: the tree halves its spheres, so 2^63 spheres would fit."""


class SphereTree(NamedTuple):
    """Spheres in the order of the leaves of a binary tree of boxes.

    Attributes:
        center: (k, 3) float64.
        radius: (k,) float64.
        material: (k,) int32.
        casts: (k,) uint8, 1 where the sphere casts shadows.
        box: (nodes, 6) float64 lower and upper corner of each node's box; node 0 is the root.
        first: (nodes,) int32 first sphere of a leaf, or the left child of an inner node, whose right
            child follows it.
        length: (nodes,) int32 spheres of a leaf, 0 for an inner node.
    """

    center: NDArray[np.float64]
    radius: NDArray[np.float64]
    material: NDArray[np.int32]
    casts: NDArray[np.uint8]
    box: NDArray[np.float64]
    first: NDArray[np.int32]
    length: NDArray[np.int32]


def build_sphere_tree(
    center: NDArray[np.float64], radius: NDArray[np.float64], material: NDArray[np.int32], casts: NDArray[np.uint8]
) -> SphereTree:
    """Sort spheres into a tree by halving them at the median of the longest axis.

    Args:
        center: (k, 3) float64; radius: (k,) float64; material: (k,) int32; casts: (k,) uint8. k may be 0.
    """
    lows: list[NDArray[np.float64]] = []
    highs: list[NDArray[np.float64]] = []
    first: list[int] = []
    count: list[int] = []

    def add_node(members: NDArray[np.int64]) -> None:
        reach = radius[members, None] * (1 + 4 * np.finfo(np.float64).eps)
        lows.append((center[members] - reach).min(axis=0) if len(members) else np.zeros(3))
        highs.append((center[members] + reach).max(axis=0) if len(members) else np.zeros(3))
        first.append(0)
        count.append(0)

    order: list[NDArray[np.int64]] = []
    placed = 0
    everything = np.arange(len(radius))
    add_node(everything)
    pending = [(0, everything)]
    while pending:
        node, members = pending.pop()
        if len(members) <= LEAF_SPHERES:
            first[node], count[node] = placed, len(members)
            placed += len(members)
            order.append(members)
            continue
        axis = int(np.argmax(np.ptp(center[members], axis=0)))
        members = members[np.argsort(center[members, axis], kind="stable")]
        halves = members[: len(members) // 2], members[len(members) // 2 :]
        first[node] = len(lows)
        for half in halves:
            add_node(half)
        pending += [(first[node] + 1, halves[1]), (first[node], halves[0])]
    sorted_spheres = np.concatenate(order)
    return SphereTree(
        center=np.ascontiguousarray(center[sorted_spheres]),
        radius=radius[sorted_spheres],
        material=material[sorted_spheres],
        casts=casts[sorted_spheres],
        box=np.concatenate((lows, highs), axis=1),
        first=np.array(first, dtype=np.int32),
        length=np.array(count, dtype=np.int32),
    )


@formula
def hit_distance(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, radius: float
) -> float:
    """Smallest t > 0 at which o + t*d meets the sphere, infinity if none; d need not be of unit length."""
    fx, fy, fz = ox - cx, oy - cy, oz - cz
    a = dx * dx + dy * dy + dz * dz
    b = -(fx * dx + fy * dy + fz * dz)
    step = b / a
    lx, ly, lz = fx + step * dx, fy + step * dy, fz + step * dz
    spare = radius * radius - (lx * lx + ly * ly + lz * lz)
    if not spare >= 0.0:
        return math.inf
    root = math.sqrt(a * spare)
    q = b + root if b >= 0.0 else b - root
    far = math.sqrt(fx * fx + fy * fy + fz * fz)
    c = (far - radius) * (far + radius)
    near, other = (c / q if q != 0.0 else math.inf), q / a
    low, high = min(near, other), max(near, other)
    if low > 0.0:
        return low
    return high if high > 0.0 else math.inf


@formula
def _box_entry(
    ox: float, oy: float, oz: float, ix: float, iy: float, iz: float, box: NDArray[np.float64], node: int, limit: float
) -> float:
    """Where a ray enters a node's box, infinity if it misses it or enters beyond `limit`.

    A direction component of 0 has an infinite reciprocal; an origin on the face then gives NaN, which
    the comparisons below take as inside.
    """
    enter, leave = 0.0, limit
    for axis in range(3):
        o = ox if axis == 0 else (oy if axis == 1 else oz)
        i = ix if axis == 0 else (iy if axis == 1 else iz)
        near, far = (box[node, axis] - o) * i, (box[node, axis + 3] - o) * i
        if near > far:
            near, far = far, near
        if near > enter:
            enter = near
        if far < leave:
            leave = far
    return enter if enter <= leave else math.inf


@formula
def _next_leaf(
    box: NDArray[np.float64],
    firsts: NDArray[np.int32],
    lengths: NDArray[np.int32],
    ox: float,
    oy: float,
    oz: float,
    ix: float,
    iy: float,
    iz: float,
    limit: float,
    nodes: NDArray[np.int32],
    entries: NDArray[np.float64],
    pending: int,
) -> tuple[int, int]:
    """Go on to the next leaf that a ray enters before `limit`, the nearer child of a node first.

    Args:
        box, firsts, lengths: of the tree.
        ox, oy, oz, ix, iy, iz: origin and reciprocal direction of the ray.
        limit: how far to look.
        nodes, entries: (STACK_SIZE,) nodes to be visited and where the ray enters them, the last one next.
        pending: how many there are.

    Returns:
        The leaf, or -1, and how many nodes are pending then.
    """
    while pending > 0:
        pending -= 1
        node = nodes[pending]
        if entries[pending] > limit:
            continue
        while lengths[node] == 0:
            near = firsts[node]
            far = near + 1
            entry = _box_entry(ox, oy, oz, ix, iy, iz, box, near, limit)
            other = _box_entry(ox, oy, oz, ix, iy, iz, box, far, limit)
            if other < entry:
                near, far, entry, other = far, near, other, entry
            if entry == math.inf:
                node = -1
                break
            if other < math.inf:
                nodes[pending], entries[pending] = far, other
                pending += 1
            node = near
        if node >= 0:
            return node, pending
    return -1, 0


@roomy_kernel
def nearest_spheres(
    tree: SphereTree,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    first_id: int,
    distance: NDArray[np.float32],
    primitive: NDArray[np.int32],
) -> None:
    """Replace hits by nearer ones on spheres.

    Args:
        tree: the spheres.
        origin, direction: (n, 3) float32 rays.
        first_id: number of sphere 0 as a primitive.
        distance: (n,) float32 distance of the nearest hit so far, in lengths of the direction.
        primitive: (n,) int32 what was hit, -1 for nothing.
    """
    box, firsts, lengths = tree.box, tree.first, tree.length
    centers, radii = tree.center, tree.radius
    nodes, entries = np.zeros(STACK_SIZE, dtype=np.int32), np.zeros(STACK_SIZE)
    for ray in range(len(distance)):
        ox, oy, oz = np.float64(origin[ray, 0]), np.float64(origin[ray, 1]), np.float64(origin[ray, 2])
        dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
        ix, iy, iz = 1.0 / dx, 1.0 / dy, 1.0 / dz
        best = np.float64(distance[ray]) if primitive[ray] >= 0 else math.inf
        found = -1
        nodes[0], entries[0] = 0, _box_entry(ox, oy, oz, ix, iy, iz, box, 0, best)
        leaf, pending = 0, min(1, len(radii))
        while True:
            leaf, pending = _next_leaf(box, firsts, lengths, ox, oy, oz, ix, iy, iz, best, nodes, entries, pending)
            if leaf < 0:
                break
            for sphere in range(firsts[leaf], firsts[leaf] + lengths[leaf]):
                cx, cy, cz = centers[sphere, 0], centers[sphere, 1], centers[sphere, 2]
                t = hit_distance(ox, oy, oz, dx, dy, dz, cx, cy, cz, radii[sphere])
                if t < best:
                    best = t
                    found = sphere
        if found >= 0:
            distance[ray] = best
            primitive[ray] = first_id + found


@roomy_kernel
def shade_spheres(
    tree: SphereTree,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    reach: NDArray[np.float32],
    blocked: NDArray[np.uint8],
) -> None:
    """Mark the shadow rays that a sphere blocks.

    Args:
        tree: the spheres; only those that cast shadows count.
        origin, direction: (n, 3) float32 rays.
        reach: (n,) float32 distance of the light, in lengths of the direction.
        blocked: (n,) uint8, set to 1 where a sphere stands before the light; rays already 1 are skipped.
    """
    box, firsts, lengths = tree.box, tree.first, tree.length
    centers, radii, casts = tree.center, tree.radius, tree.casts
    nodes, entries = np.zeros(STACK_SIZE, dtype=np.int32), np.zeros(STACK_SIZE)
    for ray in range(len(reach)):
        if blocked[ray] != 0:
            continue
        ox, oy, oz = np.float64(origin[ray, 0]), np.float64(origin[ray, 1]), np.float64(origin[ray, 2])
        dx, dy, dz = np.float64(direction[ray, 0]), np.float64(direction[ray, 1]), np.float64(direction[ray, 2])
        ix, iy, iz = 1.0 / dx, 1.0 / dy, 1.0 / dz
        limit = np.float64(reach[ray])
        nodes[0], entries[0] = 0, _box_entry(ox, oy, oz, ix, iy, iz, box, 0, limit)
        leaf, pending = 0, min(1, len(radii))
        while blocked[ray] == 0:
            leaf, pending = _next_leaf(box, firsts, lengths, ox, oy, oz, ix, iy, iz, limit, nodes, entries, pending)
            if leaf < 0:
                break
            for sphere in range(firsts[leaf], firsts[leaf] + lengths[leaf]):
                cx, cy, cz = centers[sphere, 0], centers[sphere, 1], centers[sphere, 2]
                t = hit_distance(ox, oy, oz, dx, dy, dz, cx, cy, cz, radii[sphere])
                if t < limit and casts[sphere] != 0:
                    blocked[ray] = 1
                    break
