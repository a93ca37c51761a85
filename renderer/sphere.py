"""Analytic spheres: a bounding-volume tree and the robust ray-sphere test, in float64.

The discriminant is taken from the distance between the ray and the centre instead of from b^2 - 4ac,
and the second root from the product of the roots (Haines, Gunther and Akenine-Moller, Ray Tracing
Gems, 2019, ch. 7), so that far and large spheres keep their shape.

LANES rays go down the tree together, to every node that one of them enters. Of two spheres at the very same distance
the lower number is met.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.gather import entry, held, keep, lane_numbers
from renderer.kernel import formula, kernel
from renderer.lanes import LANES, anywhere, choose, least, most, root
from renderer.rays import Vectors

LEAF_SPHERES = 4
"""Most spheres in a leaf of the tree."""

STACK_SIZE = 64
"""Pending nodes of a traversal: the tree halves its spheres, so 2^63 spheres would fit."""

BEYOND = 1.0 + 2.0**-30
"""The search goes on a little beyond the nearest hit: far more than the rounding of a box, so that no equal hit is
passed over, and what a ray meets does not depend on the rays beside it."""

NEAREST, FOUND = 0, 1
"""Rows of what LANES rays have met: how far away, and which sphere."""


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


class Stack(NamedTuple):
    """Room for a search.

    Attributes:
        nodes: (STACK_SIZE,) int32 that are still to be looked at.
        entries: (STACK_SIZE, LANES) float64 where each ray enters them.
        met: (2, LANES) float64, rows NEAREST and FOUND.
    """

    nodes: NDArray[np.int32]
    entries: NDArray[np.float64]
    met: NDArray[np.float64]


def make_stack() -> Stack:
    """Room for a search at a time."""
    return Stack(np.zeros(STACK_SIZE, dtype=np.int32), np.zeros((STACK_SIZE, LANES)), np.zeros((2, LANES)))


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
    """Smallest t > 0 at which o + t*d meets the sphere, infinity if none; d need not be of unit length.

    Args:
        ox, oy, oz, dx, dy, dz: the ray, in numbers or lanes.
        cx, cy, cz, radius: the sphere.
    """
    fx, fy, fz = ox - cx, oy - cy, oz - cz
    a = dx * dx + dy * dy + dz * dz
    b = -(fx * dx + fy * dy + fz * dz)
    step = b / a
    lx, ly, lz = fx + step * dx, fy + step * dy, fz + step * dz
    spare = radius * radius - (lx * lx + ly * ly + lz * lz)
    meets = spare >= 0.0
    if not anywhere(meets):
        return choose(meets, 0.0, math.inf)
    half = root(a * choose(meets, spare, 0.0))
    q = choose(b >= 0.0, b + half, b - half)
    far = root(fx * fx + fy * fy + fz * fz)
    c = (far - radius) * (far + radius)
    near, other = choose(q != 0.0, c / choose(q != 0.0, q, 1.0), math.inf), q / a
    low, high = least(near, other), most(near, other)
    return choose(meets, choose(low > 0.0, low, choose(high > 0.0, high, math.inf)), math.inf)


class _Group(NamedTuple):
    """LANES rays.

    Attributes:
        ox, oy, oz: origin.
        dx, dy, dz: direction.
        ix, iy, iz: its reciprocals.
    """

    ox: Any
    oy: Any
    oz: Any
    dx: Any
    dy: Any
    dz: Any
    ix: Any
    iy: Any
    iz: Any


@formula
def _group_of(origin: Vectors, direction: Vectors, row: Any) -> _Group:
    """The rays of some rows."""
    dx, dy, dz = entry(direction.x, row), entry(direction.y, row), entry(direction.z, row)
    return _Group(
        entry(origin.x, row), entry(origin.y, row), entry(origin.z, row), dx, dy, dz, 1.0 / dx, 1.0 / dy, 1.0 / dz
    )


@formula
def _between(box: NDArray[np.float64], node: int, axis: int, o: Any, i: Any, enter: Any, leave: Any) -> tuple[Any, Any]:
    """Where rays are between two sides of a node's box: no sooner than `enter`, no later than `leave`.

    A direction component of 0 has an infinite reciprocal; an origin on the face then gives NaN, which
    the comparisons take as inside.
    """
    one, other = (box[node, axis] - o) * i, (box[node, axis + 3] - o) * i
    near, far = choose(one > other, other, one), choose(one > other, one, other)
    return choose(near > enter, near, enter), choose(far < leave, far, leave)


@formula
def _box_entry(rays: _Group, box: NDArray[np.float64], node: int, limit: Any) -> Any:
    """Where rays enter a node's box, infinity if they miss it or enter beyond `limit`."""
    enter, leave = choose(limit >= 0.0, 0.0, 0.0), limit * BEYOND
    enter, leave = _between(box, node, 0, rays.ox, rays.ix, enter, leave)
    enter, leave = _between(box, node, 1, rays.oy, rays.iy, enter, leave)
    enter, leave = _between(box, node, 2, rays.oz, rays.iz, enter, leave)
    return choose(enter <= leave, enter, math.inf)


@formula
def _next_leaf(
    tree: SphereTree, rays: _Group, limit: Any, nodes: NDArray[np.int32], entries: NDArray[np.float64], pending: int
) -> int:
    """Go on to the next leaf that one of some rays enters before its `limit`, the nearer child of a node first.

    Args:
        tree: the spheres.
        rays: LANES of them.
        limit: how far each looks.
        nodes, entries: (STACK_SIZE,) nodes to be visited, and (STACK_SIZE, LANES) where the rays enter them, the last
            one next.
        pending: how many there are.

    Returns:
        How many nodes are pending then, the leaf among them as the last; 0 if there is none.
    """
    box, firsts, lengths = tree.box, tree.first, tree.length
    while pending > 0:
        node, enter = nodes[pending - 1], held(entries, pending - 1)
        if not anywhere((enter < math.inf) & (enter <= limit * BEYOND)):
            pending -= 1
        elif lengths[node] > 0:
            return pending
        else:
            near, far = firsts[node], firsts[node] + 1
            enter, other = _box_entry(rays, box, near, limit), _box_entry(rays, box, far, limit)
            if anywhere(other < enter):
                near, far, enter, other = far, near, other, enter
            nodes[pending - 1], nodes[pending] = far, near
            keep(entries, pending - 1, other)
            keep(entries, pending, enter)
            pending += 1
    return 0


@formula
def _within(tree: SphereTree, rays: _Group, sphere: int) -> Any:
    """Where rays meet a sphere, infinity if they do not."""
    center = tree.center
    cx, cy, cz = center[sphere, 0], center[sphere, 1], center[sphere, 2]
    return hit_distance(rays.ox, rays.oy, rays.oz, rays.dx, rays.dy, rays.dz, cx, cy, cz, tree.radius[sphere])


@kernel
def nearest_spheres(
    tree: SphereTree,
    stack: Stack,
    origin: Vectors,
    direction: Vectors,
    first_id: int,
    distance: NDArray[np.float32],
    primitive: NDArray[np.int32],
) -> None:
    """Replace hits by nearer ones on spheres.

    Args:
        tree: the spheres.
        stack: room.
        origin, direction: of n rays.
        first_id: number of sphere 0 as a primitive.
        distance: (n,) float32 distance of the nearest hit so far, in lengths of the direction.
        primitive: (n,) int32 what was hit, -1 for nothing.
    """
    firsts, lengths, n = tree.first, tree.length, len(distance) if len(tree.radius) > 0 else 0
    nodes, entries, met = stack
    for first in range(0, n, LANES):
        row = least(lane_numbers(first), n - 1)
        rays = _group_of(origin, direction, row)
        best = choose(entry(primitive, row) >= 0, entry(distance, row), math.inf)
        found = choose(best >= 0.0, -1, -1)
        nodes[0] = 0
        keep(entries, 0, _box_entry(rays, tree.box, 0, best))
        pending = _next_leaf(tree, rays, best, nodes, entries, 1)
        while pending > 0:
            leaf = nodes[pending - 1]
            enters = held(entries, pending - 1) < math.inf
            for sphere in range(firsts[leaf], firsts[leaf] + lengths[leaf]):
                t = _within(tree, rays, sphere)
                nearer = enters & ((t < best) | ((t == best) & (sphere < found)))
                best, found = choose(nearer, t, best), choose(nearer, sphere, found)
            pending = _next_leaf(tree, rays, best, nodes, entries, pending - 1)
        if anywhere(found >= 0):
            keep(met, NEAREST, best)
            keep(met, FOUND, found)
            for ray in range(first, min(first + LANES, n)):
                if met[FOUND, ray - first] >= 0.0:
                    distance[ray], primitive[ray] = met[NEAREST, ray - first], first_id + int(met[FOUND, ray - first])


@kernel
def shade_spheres(
    tree: SphereTree,
    stack: Stack,
    origin: Vectors,
    direction: Vectors,
    reach: NDArray[np.float32],
    blocked: NDArray[np.uint8],
) -> None:
    """Mark the shadow rays that a sphere blocks.

    Args:
        tree: the spheres; only those that cast shadows count.
        stack: room.
        origin, direction: of n rays.
        reach: (n,) float32 distance of the light, in lengths of the direction.
        blocked: (n,) uint8, set to 1 where a sphere stands before the light; rays already 1 are skipped.
    """
    firsts, lengths, casts, n = tree.first, tree.length, tree.casts, len(reach) if len(tree.radius) > 0 else 0
    nodes, entries, met = stack
    for first in range(0, n, LANES):
        row = least(lane_numbers(first), n - 1)
        rays = _group_of(origin, direction, row)
        limit = choose(entry(blocked, row) == 0, entry(reach, row), -math.inf)
        hidden = choose(limit >= 0.0, 0, 0)
        nodes[0] = 0
        keep(entries, 0, _box_entry(rays, tree.box, 0, limit))
        pending = _next_leaf(tree, rays, limit, nodes, entries, 1)
        while pending > 0:
            leaf = nodes[pending - 1]
            enters = held(entries, pending - 1) < math.inf
            for sphere in range(firsts[leaf], firsts[leaf] + lengths[leaf]):
                if casts[sphere] != 0:
                    hits = enters & (_within(tree, rays, sphere) < limit)
                    hidden, limit = choose(hits, 1, hidden), choose(hits, -math.inf, limit)
            pending = _next_leaf(tree, rays, limit, nodes, entries, pending - 1)
        if anywhere(hidden > 0):
            keep(met, 0, hidden)
            for ray in range(first, min(first + LANES, n)):
                if met[0, ray - first] != 0.0:
                    blocked[ray] = 1
