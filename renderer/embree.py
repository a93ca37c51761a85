"""Embree: the nearest triangle along a ray, and whether one stands before a light. The only file that talks to it.

embreex asks Embree about one ray at a time. The library it ships also takes packets of 16, 8 or 4 rays, which is
three times as fast for rays that go the same way; so this file opens it, and `packets` calls it directly. At the first
use it traces known rays both ways, and goes on with embreex's own queries where anything differs: another platform,
another Embree.
"""

from __future__ import annotations

import ctypes
import functools
import logging
import threading
import weakref
from pathlib import Path
from typing import NamedTuple

import embreex
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from renderer.kernel import COMPILED, c_function
from renderer.packets import (
    COHERENT,
    INVOKE_FILTER,
    Packet,
    Search,
    empty_packet,
    keeper,
    query,
    trace_nearest,
    trace_occluded,
    turned,
)
from renderer.rays import Vectors, columns, rows_of, vectors_of

log = logging.getLogger(__name__)

MAJOR_VERSION = 4
"""Embree 4.x: layouts and constants below are of its `rtcore_*.h`."""

WIDTHS = ((16, 34), (8, 33), (4, 32))
"""Packet widths and the device property that says whether the processor traces them natively."""

VERSION_PROPERTY = 0
TRIANGLE_GEOMETRY, INDEX_BUFFER, VERTEX_BUFFER, UINT3, FLOAT3 = 0, 0, 1, 0x5003, 0x9003
ROBUST, FILTER_IN_ARGUMENTS = 4, 8
"""Flags of a scene."""

FEWEST_AROUND = 3
"""Triangles that it takes to close around a corner: with fewer there is no gap to look for."""

DEVICE = EmbreeDevice()
"""Shared by all scenes: with about a thousand devices of their own Embree gives out null pointers."""


class Library(NamedTuple):
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


class _Room(NamedTuple):
    """What a thread searches with: made once, since that takes as long as tracing some hundred rays.

    Attributes:
        library: it is for.
        packet: room for rays.
        nearest_singly, nearest_together, occluded_singly, occluded_together: queries of `Search`.
    """

    library: Library
    packet: Packet
    nearest_singly: NDArray[np.int64]
    nearest_together: NDArray[np.int64]
    occluded_singly: NDArray[np.int64]
    occluded_together: NDArray[np.int64]


_local = threading.local()


def _room_of(library: Library) -> _Room:
    """This thread's room."""
    held: _Room | None = getattr(_local, "room", None)
    if held is None or held.library is not library:
        packet = empty_packet(library.width)
        nearest = (
            query(INVOKE_FILTER | flag, packet.distances.ctypes.data, library.keep_nearest) for flag in (0, COHERENT)
        )
        held = _Room(library, packet, *nearest, *(query(flag, 0, 0) for flag in (0, COHERENT)))
        _local.room = held
    return held


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
        self._library = None if singly else embree_library()
        if self._library is not None:
            self._scene = _packet_scene(self._library, self, vertices, faces)

    @functools.cached_property
    def yardstick(self) -> EmbreeScene:
        """The same triangles as embreex traces them, ready: the fallback, and what benchmarks compare with."""
        return plain_scene(self._vertices, self._faces, robust=True)

    def searches(self) -> tuple[Packet, Search, Search] | None:
        """This thread's room for a packet, and what searches with it for the nearest triangle, and for any; None where
        rays are traced singly.
        """
        return None if self._library is None else self._searches(self._library)

    def _searches(self, library: Library) -> tuple[Packet, Search, Search]:
        room, scene = _room_of(library), self._scene
        return (
            room.packet,
            Search(library.intersect, scene, room.nearest_singly, room.nearest_together),
            Search(library.occluded, scene, room.occluded_singly, room.occluded_together),
        )

    @property
    def look_twice(self) -> bool:
        """Whether rays that meet nothing are searched again: there are corners to slip through."""
        return len(self._faces) >= FEWEST_AROUND

    def nearest(
        self,
        origin: Vectors | NDArray[np.float32],
        direction: Vectors | NDArray[np.float32],
        coherent: bool = True,
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Number of the nearest triangle along each ray, -1 for none, and its distance; of two equally near the lower.

        Args:
            origin, direction: of n rays, finite; columns, or (n, 3) float32.
            coherent: whether they are searched together: faster if neighbouring rays go much the same way, as
                camera rays, shadow rays and mirror rays do. It does not change the answer.

        Returns:
            (n,) int32 and (n,) float32 in lengths of the direction; the distance of a miss is infinite.
        """
        origin, direction = columns(origin, direction)
        if self._library is None:
            begin, towards = rows_of(origin), rows_of(direction)
            primitive, distance = self._nearest_singly(begin, towards)
            missed = np.flatnonzero(primitive < 0)
            if self.look_twice and len(missed):
                primitive[missed], distance[missed] = self._nearest_singly(begin[missed], turned(towards[missed]))
            return primitive, distance
        primitive = np.empty(len(origin.x), dtype=np.int32)
        distance = np.empty(len(origin.x), dtype=np.float32)
        packet, search, _ = self._searches(self._library)
        trace_nearest(search, coherent, self.look_twice, packet, origin, direction, primitive, distance)
        return primitive, distance

    def _nearest_singly(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32]
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        found = self.yardstick.run(origin, direction, None, "INTERSECT", output=True)
        return found["primID"], np.where(found["primID"] < 0, np.float32(np.inf), found["tfar"])

    def occluded(
        self,
        origin: Vectors | NDArray[np.float32],
        direction: Vectors | NDArray[np.float32],
        reach: NDArray[np.float32],
        blocked: NDArray[np.uint8],
        coherent: bool = True,
    ) -> None:
        """Mark the rays that meet a triangle nearer than their reach.

        Args:
            origin, direction: of n rays, finite; columns, or (n, 3) float32.
            reach: (n,) float32 in lengths of the direction; its values are lost.
            blocked: (n,) uint8, written: 1 for a blocked ray, else 0.
            coherent: as above.
        """
        origin, direction = columns(origin, direction)
        if self._library is None:
            # Embree answers 0 for a blocked ray and -1 for a clear one.
            answers = self.yardstick.run(rows_of(origin), rows_of(direction), reach, "OCCLUDED")
            np.equal(answers, 0, out=blocked.view(np.bool_))
            return
        packet, _, search = self._searches(self._library)
        trace_occluded(search, coherent, packet, origin, direction, reach, blocked)


def plain_scene(vertices: NDArray[np.float32], faces: NDArray[np.int32], *, robust: bool) -> EmbreeScene:
    """Triangles for embreex's own queries, ready, searched by Embree's robust traversal or by its fast one."""
    scene = EmbreeScene(DEVICE, robust=robust)
    TriangleMesh(scene, np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    probe = np.zeros((1, 3), dtype=np.float32)
    scene.run(probe, np.array([[0, 0, 1]], dtype=np.float32), None, "INTERSECT")
    return scene


@functools.cache
def embree_library() -> Library | None:
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


def _open_library() -> Library:
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
            return Library(library, device, width, intersect, occluded, c_function(keeper(width)).address)
    raise ValueError("Embree traces no packets on this processor")


def _packet_scene(embree: Library, owner: object, vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> int:
    """An Embree scene of the triangles, released with its owner.

    Raises:
        MemoryError: if Embree cannot build it.
    """
    library = embree.library
    # Embree reads 16 bytes at each vertex, so the last one needs something behind it.
    points = np.concatenate((vertices, np.zeros((2, 3), dtype=np.float32)))
    corners = np.ascontiguousarray(faces, dtype=np.uint32)
    scene: int = library.rtcNewScene(embree.device)
    library.rtcSetSceneFlags(scene, ROBUST | FILTER_IN_ARGUMENTS)
    geometry = library.rtcNewGeometry(embree.device, TRIANGLE_GEOMETRY)
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
    error = library.rtcGetDeviceError(embree.device)
    if error:
        raise MemoryError(f"Embree cannot build a tree of {len(faces):,} triangles (its error {error})")
    return scene


def _release(library: ctypes.CDLL, scene: int, *_buffers: object) -> None:
    library.rtcReleaseScene(scene)


def _agree(found: Library) -> bool:
    """Whether packets get the answers that single rays get, for random rays among random triangles."""
    rng = np.random.default_rng(4)
    vertices = rng.uniform(-1, 1, (300, 3)).astype(np.float32)
    faces = np.arange(300, dtype=np.int32).reshape(-1, 3)
    origin, direction = (vectors_of(rng.uniform(-1, 1, (203, 3)).astype(np.float32)) for _ in range(2))
    reach = rng.uniform(0, 2, 203).astype(np.float32)
    singly, together = EmbreeTriangles(vertices, faces, singly=True), EmbreeTriangles(vertices, faces, singly=True)
    together._library = found
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
