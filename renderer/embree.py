"""Embree: the nearest triangle along a ray, and whether one stands before a light. The only file that talks to it.

embreex asks Embree about one ray at a time. The library it ships also takes packets of 16, 8 or 4 rays, which is
three times as fast for rays that go the same way; so this file calls it directly. At the first use it traces known
rays both ways, and goes on with embreex's own queries where anything differs: another platform, another Embree.

Of two triangles at the very same distance, say along an edge they share or in one plane, the search would report
the one it comes to last, which depends on the other rays of a packet. A filter makes the lower number win, and keeps
the search from passing over boxes that begin where the nearest hit lies. So what a ray meets depends on nothing else.

A ray aimed at a corner that several triangles share may slip between them, even in Embree's robust mode, which only
edges are safe with (Woop, Benthin and Wald 2013): one in a hundred does. Rays that met nothing are therefore searched
once more, turned by a few roundings.
"""

from __future__ import annotations

import ctypes
import functools
import logging
import math
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import embreex
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from renderer.kernel import COMPILED, at, c_function, call, formula, kernel

log = logging.getLogger(__name__)

MAJOR_VERSION = 4
"""Embree 4.x: layouts and constants below are of its `rtcore_*.h`."""

WIDTHS = ((16, 34), (8, 33), (4, 32))
"""Packet widths and the device property that says whether the processor traces them natively."""

VERSION_PROPERTY = 0
TRIANGLE_GEOMETRY, INDEX_BUFFER, VERTEX_BUFFER, UINT3, FLOAT3 = 0, 0, 1, 0x5003, 0x9003
ROBUST, FILTER_IN_ARGUMENTS = 4, 8
"""Flags of a scene."""

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

FEWEST_AROUND = 3
"""Triangles that it takes to close around a corner: with fewer there is no gap to look for."""

CACHE_LINE = 64

DEVICE = EmbreeDevice()
"""Shared by all scenes: with about a thousand devices of their own Embree gives out null pointers."""


class Packets(NamedTuple):
    """The C library: its device, and the addresses of what kernels call.

    Attributes:
        library: the loaded library.
        device: of all scenes.
        width: rays of a packet.
        intersect, occluded: functions of that width.
        keep_nearest: the filter that settles ties.
    """

    library: ctypes.CDLL
    device: int
    width: int
    intersect: int
    occluded: int
    keep_nearest: int


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


class EmbreeTriangles:
    """Triangles and their search tree; any number of threads may ask at once."""

    def __init__(self, vertices: NDArray[np.float32], faces: NDArray[np.int32], *, singly: bool = False) -> None:
        """Build the tree, in Embree's robust mode.

        Args:
            vertices: (n, 3) float32 finite positions.
            faces: (m, 3) int32 vertex indices in range, m at least 1.
            singly: True to trace by embreex's own queries in any case.
        """
        self._vertices, self._faces = vertices, faces
        self._packets = None if singly else packets()
        if self._packets is not None:
            self._scene = _packet_scene(self._packets, self, vertices, faces)

    @functools.cached_property
    def yardstick(self) -> EmbreeScene:
        """The same triangles as embreex traces them, ready: the fallback, and what benchmarks compare with."""
        return plain_scene(self._vertices, self._faces, robust=True)

    def nearest(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], coherent: bool = True
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Number of the nearest triangle along each ray, -1 for none, and its distance; of two equally near the lower.

        Args:
            origin, direction: (n, 3) float32, C-contiguous, finite.
            coherent: whether they are searched together: faster if neighbouring rays go much the same way, as
                camera rays, shadow rays and mirror rays do. It does not change the answer.

        Returns:
            (n,) int32 and (n,) float32 in lengths of the direction; the distance of a miss is infinite.
        """
        again = len(self._faces) >= FEWEST_AROUND
        if self._packets is None:
            primitive, distance = self._nearest_singly(origin, direction)
            missed = np.flatnonzero(primitive < 0)
            if again and len(missed):
                primitive[missed], distance[missed] = self._nearest_singly(origin[missed], _turned(direction[missed]))
            return primitive, distance
        primitive = np.empty(len(origin), dtype=np.int32)
        distance = np.empty(len(origin), dtype=np.float32)
        packet = _packet(self._packets.width)
        singly, together = (
            _query(INVOKE_FILTER | flag, packet.distances.ctypes.data, self._packets.keep_nearest)
            for flag in (0, COHERENT)
        )
        _trace_nearest(
            self._packets.intersect, self._scene, singly, together, coherent, again, packet,
            origin, direction, primitive, distance,
        )  # fmt: skip
        return primitive, distance

    def _nearest_singly(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32]
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        found = self.yardstick.run(origin, direction, None, "INTERSECT", output=True)
        return found["primID"], np.where(found["primID"] < 0, np.float32(np.inf), found["tfar"])

    def occluded(
        self,
        origin: NDArray[np.float32],
        direction: NDArray[np.float32],
        reach: NDArray[np.float32],
        blocked: NDArray[np.uint8],
        coherent: bool = True,
    ) -> None:
        """Mark the rays that meet a triangle nearer than their reach.

        Args:
            origin, direction: (n, 3) float32, C-contiguous, finite.
            reach: (n,) float32 in lengths of the direction; its values are lost.
            blocked: (n,) uint8, written: 1 for a blocked ray, else 0.
            coherent: as above.
        """
        if self._packets is None:
            # Embree answers 0 for a blocked ray and -1 for a clear one.
            np.equal(self.yardstick.run(origin, direction, reach, "OCCLUDED"), 0, out=blocked.view(np.bool_))
            return
        singly, together = _query(0, 0, 0), _query(COHERENT, 0, 0)
        _trace_occluded(
            self._packets.occluded, self._scene, singly, together if coherent else singly,
            _packet(self._packets.width), origin, direction, reach, blocked,
        )  # fmt: skip


def plain_scene(vertices: NDArray[np.float32], faces: NDArray[np.int32], *, robust: bool) -> EmbreeScene:
    """Triangles for embreex's own queries, ready, searched by Embree's robust traversal or by its fast one."""
    scene = EmbreeScene(DEVICE, robust=robust)
    TriangleMesh(scene, np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    probe = np.zeros((1, 3), dtype=np.float32)
    scene.run(probe, np.array([[0, 0, 1]], dtype=np.float32), None, "INTERSECT")
    return scene


@functools.cache
def packets() -> Packets | None:
    """The C library if it answers known rays as embreex does; None, with a line in the log, if not.

    None too where nothing is compiled: only compiled code can call it.
    """
    if not COMPILED:
        return None
    try:
        found = _open_library()
    except (OSError, AttributeError, ValueError) as problem:
        log.warning("rays are traced singly, which takes longer: %s", problem)
        return None
    if _agree(found):
        return found
    log.warning("rays are traced singly, which takes longer: packets of %d rays get other answers", found.width)
    return None


def _open_library() -> Packets:
    """Load the Embree that embreex ships.

    Raises:
        OSError: if it is not where wheels put it.
        AttributeError: if it lacks a function.
        ValueError: if it is of another version, or traces no packets on this processor.
    """
    places = sorted(Path(embreex.__file__).parents[1].glob("embreex.libs/libembree*"))
    if not places:
        raise OSError("embreex comes without an Embree library of its own")
    library = ctypes.CDLL(str(places[0]))
    for name, result, arguments in (
        ("rtcNewDevice", ctypes.c_void_p, [ctypes.c_char_p]),
        ("rtcGetDeviceProperty", ctypes.c_ssize_t, [ctypes.c_void_p, ctypes.c_int]),
        ("rtcGetDeviceError", ctypes.c_int, [ctypes.c_void_p]),
        ("rtcNewScene", ctypes.c_void_p, [ctypes.c_void_p]),
        ("rtcReleaseScene", None, [ctypes.c_void_p]),
        ("rtcSetSceneFlags", None, [ctypes.c_void_p, ctypes.c_int]),
        ("rtcNewGeometry", ctypes.c_void_p, [ctypes.c_void_p, ctypes.c_int]),
        (
            "rtcSetSharedGeometryBuffer",
            None,
            [ctypes.c_void_p, ctypes.c_int, ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, *[ctypes.c_size_t] * 3],
        ),
        ("rtcCommitGeometry", None, [ctypes.c_void_p]),
        ("rtcAttachGeometry", ctypes.c_uint, [ctypes.c_void_p, ctypes.c_void_p]),
        ("rtcReleaseGeometry", None, [ctypes.c_void_p]),
        ("rtcCommitScene", None, [ctypes.c_void_p]),
    ):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    device = library.rtcNewDevice(None)
    version = library.rtcGetDeviceProperty(device, VERSION_PROPERTY)
    if version // 10_000 != MAJOR_VERSION:
        raise ValueError(f"expected Embree {MAJOR_VERSION}, found version number {version}")
    for width, native in WIDTHS:
        if library.rtcGetDeviceProperty(device, native):
            intersect, occluded = (
                ctypes.cast(getattr(library, f"{name}{width}"), ctypes.c_void_p).value or 0
                for name in ("rtcIntersect", "rtcOccluded")
            )
            return Packets(library, device, width, intersect, occluded, c_function(_keeper(width)).address)
    raise ValueError("Embree traces no packets on this processor")


def _packet_scene(packets: Packets, owner: object, vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> int:
    """An Embree scene of the triangles, released with its owner.

    Raises:
        MemoryError: if Embree cannot build it.
    """
    library = packets.library
    # Embree reads 16 bytes at each vertex, so the last one needs something behind it.
    points = np.concatenate((vertices, np.zeros((2, 3), dtype=np.float32)))
    corners = np.ascontiguousarray(faces, dtype=np.uint32)
    scene: int = library.rtcNewScene(packets.device)
    library.rtcSetSceneFlags(scene, ROBUST | FILTER_IN_ARGUMENTS)
    geometry = library.rtcNewGeometry(packets.device, TRIANGLE_GEOMETRY)
    for kind, layout, buffer, count in (
        (VERTEX_BUFFER, FLOAT3, points, len(vertices)),
        (INDEX_BUFFER, UINT3, corners, len(corners)),
    ):
        library.rtcSetSharedGeometryBuffer(geometry, kind, 0, layout, buffer.ctypes.data, 0, 12, count)
    library.rtcCommitGeometry(geometry)
    library.rtcAttachGeometry(scene, geometry)
    library.rtcReleaseGeometry(geometry)
    library.rtcCommitScene(scene)
    # The finalizer holds the buffers, which Embree goes on reading, until the scene is gone.
    weakref.finalize(owner, _release, library, scene, points, corners)
    error = library.rtcGetDeviceError(packets.device)
    if error:
        raise MemoryError(f"Embree cannot build a tree of {len(faces):,} triangles (its error {error})")
    return scene


def _release(library: ctypes.CDLL, scene: int, *_buffers: object) -> None:
    library.rtcReleaseScene(scene)


def _agree(found: Packets) -> bool:
    """Whether packets get the answers that single rays get, for random rays among random triangles."""
    rng = np.random.default_rng(4)
    vertices = rng.uniform(-1, 1, (300, 3)).astype(np.float32)
    faces = np.arange(300, dtype=np.int32).reshape(-1, 3)
    origin, direction = (rng.uniform(-1, 1, (203, 3)).astype(np.float32) for _ in range(2))
    reach = rng.uniform(0, 2, 203).astype(np.float32)
    singly, together = EmbreeTriangles(vertices, faces, singly=True), EmbreeTriangles(vertices, faces, singly=True)
    together._packets = found
    together._scene = _packet_scene(found, together, vertices, faces)
    truth, distance = singly.nearest(origin, direction, False)
    shade = np.zeros((2, 203), dtype=np.uint8)
    singly.occluded(origin, direction, reach.copy(), shade[0], False)
    for coherent in (False, True):
        primitive, length = together.nearest(origin, direction, coherent)
        together.occluded(origin, direction, reach.copy(), shade[1], coherent)
        met = truth >= 0
        same = (primitive == truth).all() and (length[met] == distance[met]).all() and (shade[0] == shade[1]).all()
        if not same:
            return False
    return True


def _query(flags: int, context: int, filter_address: int) -> NDArray[np.int64]:
    """RTCIntersectArguments or RTCOccludedArguments: flags and features, context, filter, nothing more."""
    query = np.zeros(8, dtype=np.int64)
    query.view(np.uint32)[:2] = flags, EVERY_FEATURE
    query[1:3] = context, filter_address
    return query


def _aligned(words: int) -> NDArray[np.float32]:
    """(words,) float32 zeros that begin on a cache line."""
    raw = np.zeros(4 * words + CACHE_LINE, dtype=np.uint8)
    start = -raw.ctypes.data % CACHE_LINE
    return raw[start : start + 4 * words].view(np.float32)


def _packet(width: int) -> Packet:
    """An empty packet of `width` rays."""
    rows, valid, distances = _aligned(PACKET_ROWS * width), _aligned(width), _aligned(CONTEXT_WORDS)
    words = rows.view(np.int32)
    words[MASK * width : (MASK + 1) * width] = -1
    return Packet(width, rows, words, valid.view(np.int32), distances, distances.view(np.int32))


def _keeper(width: int) -> Callable[[Any], None]:
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
def _load_ray(
    packet: Packet, lane: int, origin: NDArray[np.float32], direction: NDArray[np.float32], ray: int, reach: np.float32
) -> bool:
    """Put one ray into a lane of a packet; True if it is parallel to a coordinate plane."""
    width, rows = packet.width, packet.rows
    for axis in range(3):
        rows[(ORIGIN + axis) * width + lane] = origin[ray, axis]
        rows[(DIRECTION + axis) * width + lane] = direction[ray, axis]
    rows[FAR * width + lane] = reach
    return _is_parallel(direction[ray, 0], direction[ray, 1], direction[ray, 2])


@formula
def _is_parallel(x: np.float32, y: np.float32, z: np.float32) -> bool:
    x, y, z = abs(x), abs(y), abs(z)
    return bool(min(x, min(y, z)) < PARALLEL * max(x, max(y, z)))


@formula
def _load_lanes(
    width: int, rows: NDArray[np.float32], origin: NDArray[np.float32], direction: NDArray[np.float32], first: int
) -> bool:
    """Put rays into the lanes of a packet whose `width` is known to the compiler, which takes them together.

    Returns:
        Whether one of them is parallel to a coordinate plane.
    """
    parallel = 0
    for lane in range(width):
        ray = np.uint64(first + lane)
        x, y, z = direction[ray, 0], direction[ray, 1], direction[ray, 2]
        rows[ORIGIN * width + lane] = origin[ray, 0]
        rows[(ORIGIN + 1) * width + lane] = origin[ray, 1]
        rows[(ORIGIN + 2) * width + lane] = origin[ray, 2]
        rows[DIRECTION * width + lane] = x
        rows[(DIRECTION + 1) * width + lane] = y
        rows[(DIRECTION + 2) * width + lane] = z
        parallel |= 1 if _is_parallel(x, y, z) else 0
    return parallel != 0


@formula
def _load_packet(
    packet: Packet, origin: NDArray[np.float32], direction: NDArray[np.float32], first: int, count: int
) -> bool:
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


def _turned(direction: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same for (n, 3) directions, copied."""
    turned = direction.copy()
    rows, across = np.arange(len(direction)), np.abs(direction).argmin(axis=1)
    turned[rows, across] += np.copysign(ASIDE * np.abs(direction).max(axis=1), direction[rows, across])
    return turned


@kernel
def _trace_nearest(
    intersect: int,
    scene: int,
    singly: NDArray[np.int64],
    together: NDArray[np.int64],
    coherent: bool,
    again: bool,
    packet: Packet,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    primitive: NDArray[np.int32],
    distance: NDArray[np.float32],
) -> None:
    """Trace rays a packet at a time, those that met nothing `again`, turned aside."""
    width, distances, numbers = packet.width, packet.distances, packet.numbers
    for first in range(0, len(primitive), width):
        count = min(width, len(primitive) - first)
        parallel = _load_packet(packet, origin, direction, first, count)
        _forget(packet)
        _search(intersect, scene, singly, together, coherent and not parallel, packet, origin, direction, first, False)
        missed = 0
        for lane in range(count):
            missed |= 1 if numbers[NUMBERS + lane] < 0 else 0
        if again and missed != 0:
            _search_again(intersect, scene, singly, together, coherent, packet, origin, direction, first, count)
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
    intersect: int,
    scene: int,
    singly: NDArray[np.int64],
    together: NDArray[np.int64],
    packed: bool,
    packet: Packet,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    first: int,
    turned: bool,
) -> None:
    """Search along the valid rays of a packet, which are loaded; near an edge, packed ones once more, singly."""
    width, valid, distances, numbers = packet.width, packet.valid, packet.distances, packet.numbers
    query = together if packed else singly
    call(intersect, valid.ctypes.data, scene, packet.rows.ctypes.data, query.ctypes.data)
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
    call(intersect, valid.ctypes.data, scene, packet.rows.ctypes.data, singly.ctypes.data)


@kernel
def _search_again(
    intersect: int,
    scene: int,
    singly: NDArray[np.int64],
    together: NDArray[np.int64],
    coherent: bool,
    packet: Packet,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
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
    _search(intersect, scene, singly, together, coherent and not parallel, packet, origin, direction, first, True)


@kernel
def _trace_occluded(
    occluded: int,
    scene: int,
    singly: NDArray[np.int64],
    together: NDArray[np.int64],
    packet: Packet,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    reach: NDArray[np.float32],
    blocked: NDArray[np.uint8],
) -> None:
    """Trace shadow rays a packet at a time; Embree sets the reach of a blocked one to minus infinity."""
    width, valid, rows = packet.width, packet.valid, packet.rows
    for first in range(0, len(blocked), width):
        count = min(width, len(blocked) - first)
        query = singly if _load_packet(packet, origin, direction, first, count) else together
        for lane in range(count):
            rows[FAR * width + lane] = reach[first + lane]
        call(occluded, valid.ctypes.data, scene, rows.ctypes.data, query.ctypes.data)
        for lane in range(count):
            blocked[first + lane] = 1 if rows[FAR * width + lane] == -np.inf else 0
