"""Rays in packets, as Embree takes them: up to 16 side by side, and what settles what they meet.

Of two triangles at the very same distance, say along an edge they share or in one plane, the search would report
the one it comes to last, which depends on the other rays of a packet. A filter makes the lower number win, and keeps
the search from passing over boxes that begin where the nearest hit lies. So what a ray meets depends on nothing else.

A ray aimed at a corner that several triangles share may slip between them, even in Embree's robust mode, which only
edges are safe with (Woop, Benthin and Wald 2013): one in a hundred does. Rays that met nothing are therefore searched
once more, turned by a few roundings.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import at, call, formula, kernel
from renderer.rays import Vectors

INVOKE_FILTER, COHERENT = 1 << 1, 1 << 16
"""Flags of a query."""

EVERY_FEATURE = 0xFFFFFFFF

ORIGIN, DIRECTION, FAR, MASK = 0, 4, 8, 9
HIT = 12
WEIGHT_1, WEIGHT_2, PRIMITIVE, GEOMETRY = 3, 4, 5, 6
"""Rows of a packet, each as wide as the packet; those of this line count from HIT."""

PACKET_ROWS = 24
"""Rows of room for a packet: 12 of the ray, up to 9 of the hit."""

DISTANCES, LANES = 8, 16
NUMBERS, MARGINS = DISTANCES + LANES, DISTANCES + 2 * LANES
CONTEXT_WORDS = DISTANCES + 3 * LANES
"""Words of a query's context: first Embree's own, then, for at most LANES rays, the nearest hit so far: its distance,
its number, and its smallest barycentric weight."""

BEYOND = np.float32(1.0 + 2.0**-18)
"""The search goes on a little beyond the nearest hit: 30 roundings of a box, so that no equal hit is passed over."""

PARALLEL = np.float32(2.0**-16)
"""A direction with a part this small beside its largest is parallel to a coordinate plane, for the search of packets:
a box with the ray in one of its sides is then entered or not as the other rays will; such rays are searched singly."""

NEAR_EDGE = np.float32(2.0**-9)
"""Smallest barycentric weight of a hit that needs no second look: nearer to an edge, rounding may decide whether a
packet enters the neighbour's box, and the ray, one in a hundred, is searched again singly."""

ASIDE = np.float32(2.0**-21)
"""By how much of its largest part a direction that met nothing is turned: four times the spacing of float32. Less
than that left 1 of 20,000 gaps open, and more could send a ray that leaves a flat triangle back into it."""

CACHE_LINE = 64


class Packet(NamedTuple):
    """Room for rays that are searched together, and for what they met.

    Attributes:
        width: how many.
        rows: (PACKET_ROWS * width,) float32 as Embree lays them out.
        words: the same memory read as int32.
        valid: (width,) int32, -1 for the lanes in use.
        distances: (CONTEXT_WORDS,) float32 context of their query.
        numbers: the same memory read as int32.
    """

    width: int
    rows: NDArray[np.float32]
    words: NDArray[np.int32]
    valid: NDArray[np.int32]
    distances: NDArray[np.float32]
    numbers: NDArray[np.int32]


class Search(NamedTuple):
    """What searches for what rays meet.

    Attributes:
        function: address of Embree's function for packets.
        scene: Embree's scene.
        singly, together: (8,) int64 queries, for rays that go each their own way, and for a packet of much the same.
    """

    function: int
    scene: int
    singly: NDArray[np.int64]
    together: NDArray[np.int64]


def query(flags: int, context: int, filter_address: int) -> NDArray[np.int64]:
    """RTCIntersectArguments or RTCOccludedArguments: flags and features, context, filter, nothing more.

    Args:
        flags: of the query.
        context, filter_address: addresses; 0 for none.

    Returns:
        (8,) int64, to be handed over by its address.
    """
    query = np.zeros(8, dtype=np.int64)
    query.view(np.uint32)[:2] = flags, EVERY_FEATURE
    query[1:3] = context, filter_address
    return query


def _aligned(words: int) -> NDArray[np.float32]:
    """(words,) float32 zeros that begin on a cache line."""
    raw = np.zeros(4 * words + CACHE_LINE, dtype=np.uint8)
    start = -raw.ctypes.data % CACHE_LINE
    return raw[start : start + 4 * words].view(np.float32)


def empty_packet(width: int) -> Packet:
    """An empty packet of `width` rays."""
    rows, valid, distances = _aligned(PACKET_ROWS * width), _aligned(width), _aligned(CONTEXT_WORDS)
    words = rows.view(np.int32)
    words[MASK * width : (MASK + 1) * width] = -1
    return Packet(width, rows, words, valid.view(np.int32), distances, distances.view(np.int32))


def keeper(width: int) -> Callable[[Any], None]:
    """The filter of packets of `width` rays."""

    def keep_nearest(arguments: Any) -> None:
        """Note the nearest hit of each ray, of two equally near the lower number (RTCFilterFunctionNArguments).

        Its distance is at hand in the ray; the ray is then given a reach a little beyond it. No lane goes its own
        way, so that the compiler takes them together. An Embree that hands over part of a packet gets no answer,
        which the comparison at the first use finds out.
        """
        if arguments[5] & 0xFFFFFFFF != width:
            return
        integer, real = np.int32(0), np.float32(0)
        valid, numbers = at(arguments[0], integer), at(arguments[2], integer)
        distances, ray = at(arguments[2], real), at(arguments[3], real)
        hit, weights = at(arguments[4], integer), at(arguments[4], real)
        for lane in range(width):
            distance, number = ray[FAR * width + lane], hit[PRIMITIVE * width + lane]
            held, held_number = distances[DISTANCES + lane], numbers[NUMBERS + lane]
            nearer = (distance < held) | ((distance == held) & (number <= held_number))
            keep = (valid[lane] != 0) & nearer
            b1, b2 = weights[WEIGHT_1 * width + lane], weights[WEIGHT_2 * width + lane]
            margin = min(min(b1, b2), np.float32(1.0) - b1 - b2)
            valid[lane] = -1 if keep else 0
            distances[DISTANCES + lane] = distance if keep else held
            numbers[NUMBERS + lane] = number if keep else held_number
            distances[MARGINS + lane] = margin if keep else distances[MARGINS + lane]
            ray[FAR * width + lane] = distance * BEYOND if keep else distance

    return keep_nearest


@formula
def _load_ray(packet: Packet, lane: int, origin: Vectors, direction: Vectors, ray: int, reach: np.float32) -> bool:
    """Put one ray into a lane of a packet; True if it is parallel to a coordinate plane."""
    width, rows = packet.width, packet.rows
    x, y, z = direction.x[ray], direction.y[ray], direction.z[ray]
    rows[ORIGIN * width + lane] = origin.x[ray]
    rows[(ORIGIN + 1) * width + lane] = origin.y[ray]
    rows[(ORIGIN + 2) * width + lane] = origin.z[ray]
    rows[DIRECTION * width + lane] = x
    rows[(DIRECTION + 1) * width + lane] = y
    rows[(DIRECTION + 2) * width + lane] = z
    rows[FAR * width + lane] = reach
    return _is_parallel(x, y, z)


@formula
def _is_parallel(x: np.float32, y: np.float32, z: np.float32) -> bool:
    x, y, z = abs(x), abs(y), abs(z)
    return bool(min(x, min(y, z)) < PARALLEL * max(x, max(y, z)))


@formula
def _load_lanes(width: int, rows: NDArray[np.float32], origin: Vectors, direction: Vectors, first: int) -> bool:
    """Put rays into the lanes of a packet whose `width` is known to the compiler, which takes them together.

    Returns:
        Whether one of them is parallel to a coordinate plane.
    """
    parallel = 0
    for lane in range(width):
        ray = np.uint64(first + lane)
        x, y, z = direction.x[ray], direction.y[ray], direction.z[ray]
        rows[ORIGIN * width + lane] = origin.x[ray]
        rows[(ORIGIN + 1) * width + lane] = origin.y[ray]
        rows[(ORIGIN + 2) * width + lane] = origin.z[ray]
        rows[DIRECTION * width + lane] = x
        rows[(DIRECTION + 1) * width + lane] = y
        rows[(DIRECTION + 2) * width + lane] = z
        parallel |= 1 if _is_parallel(x, y, z) else 0
    return parallel != 0


@formula
def _load_packet(packet: Packet, origin: Vectors, direction: Vectors, first: int, count: int) -> bool:
    """Put `count` rays into a packet, but for their reach; True if one is parallel to a coordinate plane."""
    rows, valid = packet.rows, packet.valid
    for lane in range(packet.width):
        valid[lane] = -1 if lane < count else 0
    if count == 16 and packet.width == 16:
        return _load_lanes(16, rows, origin, direction, first)
    if count == 8 and packet.width == 8:
        return _load_lanes(8, rows, origin, direction, first)
    parallel = False
    for lane in range(count):
        parallel |= _load_ray(packet, lane, origin, direction, first + lane, np.float32(0.0))
    return parallel


@formula
def _turn_aside(packet: Packet, lane: int) -> None:
    """Turn the direction in a lane of a packet by ASIDE, along the axis that it has least of."""
    width, rows = packet.width, packet.rows
    largest, smallest, across = np.float32(0.0), np.float32(np.inf), DIRECTION * width + lane
    for axis in range(3):
        row = (DIRECTION + axis) * width + lane
        part = abs(rows[row])
        largest = max(largest, part)
        if part < smallest:
            smallest, across = part, row
    rows[across] += math.copysign(ASIDE * largest, rows[across])


def turned(direction: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same for (n, 3) directions, copied."""
    turned = direction.copy()
    rows, across = np.arange(len(direction)), np.abs(direction).argmin(axis=1)
    turned[rows, across] += np.copysign(ASIDE * np.abs(direction).max(axis=1), direction[rows, across])
    return turned


@kernel
def trace_nearest(
    search: Search,
    coherent: bool,
    again: bool,
    packet: Packet,
    origin: Vectors,
    direction: Vectors,
    primitive: NDArray[np.int32],
    distance: NDArray[np.float32],
) -> None:
    """Trace rays a packet at a time, those that met nothing `again`, turned aside."""
    width, distances, numbers = packet.width, packet.distances, packet.numbers
    for first in range(0, len(primitive), width):
        count = min(width, len(primitive) - first)
        parallel = _load_packet(packet, origin, direction, first, count)
        _forget(packet)
        _search(search, coherent and not parallel, packet, origin, direction, first, False)
        missed = 0
        for lane in range(count):
            missed |= 1 if numbers[NUMBERS + lane] < 0 else 0
        if again and missed != 0:
            _search_again(search, coherent, packet, origin, direction, first, count)
        for lane in range(count):
            primitive[first + lane] = numbers[NUMBERS + lane]
            distance[first + lane] = distances[DISTANCES + lane]


@formula
def _forget(packet: Packet) -> None:
    """Leave the rays of a packet with nothing met."""
    width, rows, words = packet.width, packet.rows, packet.words
    distances, numbers = packet.distances, packet.numbers
    for lane in range(width):
        rows[FAR * width + lane] = np.inf
        words[(HIT + GEOMETRY) * width + lane] = -1
    for lane in range(LANES):
        distances[DISTANCES + lane], distances[MARGINS + lane] = np.inf, np.inf
        numbers[NUMBERS + lane] = -1


@kernel
def _search(
    search: Search,
    packed: bool,
    packet: Packet,
    origin: Vectors,
    direction: Vectors,
    first: int,
    turned: bool,
) -> None:
    """Search along the valid rays of a packet, which are loaded; near an edge, packed ones once more, singly."""
    width, valid, distances, numbers = packet.width, packet.valid, packet.distances, packet.numbers
    query = search.together if packed else search.singly
    call(search.function, valid.ctypes.data, search.scene, packet.rows.ctypes.data, query.ctypes.data)
    doubtful = 0
    for lane in range(LANES):
        doubtful |= 1 if distances[MARGINS + lane] < NEAR_EDGE else 0
    if not packed or doubtful == 0:
        return
    for lane in range(width):
        near_edge = valid[lane] != 0 and distances[MARGINS + lane] < NEAR_EDGE
        valid[lane] = -1 if near_edge else 0
        if near_edge:
            _load_ray(packet, lane, origin, direction, first + lane, np.float32(np.inf))
            if turned:
                _turn_aside(packet, lane)
            distances[DISTANCES + lane], numbers[NUMBERS + lane] = np.inf, -1
    call(search.function, valid.ctypes.data, search.scene, packet.rows.ctypes.data, search.singly.ctypes.data)


@kernel
def _search_again(
    search: Search,
    coherent: bool,
    packet: Packet,
    origin: Vectors,
    direction: Vectors,
    first: int,
    count: int,
) -> None:
    """Search along the rays of a packet that have met nothing, turned aside."""
    parallel = False
    for lane in range(packet.width):
        packet.valid[lane] = -1 if lane < count and packet.numbers[NUMBERS + lane] < 0 else 0
        packet.distances[MARGINS + lane] = np.inf
        if packet.valid[lane] != 0:
            parallel |= _load_ray(packet, lane, origin, direction, first + lane, np.float32(np.inf))
            _turn_aside(packet, lane)
    _search(search, coherent and not parallel, packet, origin, direction, first, True)


@kernel
def trace_occluded(
    search: Search,
    coherent: bool,
    packet: Packet,
    origin: Vectors,
    direction: Vectors,
    reach: NDArray[np.float32],
    blocked: NDArray[np.uint8],
) -> None:
    """Trace shadow rays a packet at a time; Embree sets the reach of a blocked one to minus infinity."""
    width, valid, rows = packet.width, packet.valid, packet.rows
    for first in range(0, len(blocked), width):
        count = min(width, len(blocked) - first)
        parallel = _load_packet(packet, origin, direction, first, count)
        query = search.together if coherent and not parallel else search.singly
        for lane in range(count):
            rows[FAR * width + lane] = reach[first + lane]
        call(search.function, valid.ctypes.data, search.scene, rows.ctypes.data, query.ctypes.data)
        for lane in range(count):
            blocked[first + lane] = 1 if rows[FAR * width + lane] == -np.inf else 0
