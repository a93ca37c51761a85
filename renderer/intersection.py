"""What a ray meets: triangles through Embree, spheres through their own tree, area lights one by one."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.area_light import nearest_area_lights
from renderer.embree import EmbreeTriangles
from renderer.kernel import kernel
from renderer.packets import Packet, Search, trace_nearest, trace_occluded
from renderer.rays import Hits, Vectors, columns
from renderer.sphere import SphereTree, Stack, make_stack, nearest_spheres, shade_spheres


class Solids(NamedTuple):
    """What rays meet, as compiled code asks it.

    Attributes:
        packet: the thread's room for rays.
        nearest, occluded: searches of the triangles that are seen, and of those that cast shadows.
        look_twice: whether rays that meet no triangle are searched again.
        triangles_cast, spheres_cast: whether any of them casts shadows.
        spheres, stack: the spheres, and the thread's room for a search of them.
        lights: (l,) AREA_LIGHT.
        triangles: how many are seen.
    """

    packet: Packet
    nearest: Search
    occluded: Search
    look_twice: bool
    triangles_cast: bool
    spheres_cast: bool
    spheres: SphereTree
    stack: Stack
    lights: NDArray[np.void]
    triangles: int


@kernel
def find_nearest(solids: Solids, origin: Vectors, direction: Vectors, hits: Hits) -> None:
    """Write the nearest hit of each ray."""
    primitive, distance = hits.primitive, hits.distance
    trace_nearest(solids.nearest, True, solids.look_twice, solids.packet, origin, direction, primitive, distance)
    if len(solids.spheres.radius) > 0:
        nearest_spheres(solids.spheres, solids.stack, origin, direction, solids.triangles, distance, primitive)
    if len(solids.lights) > 0:
        first = solids.triangles + len(solids.spheres.radius)
        nearest_area_lights(solids.lights, origin, direction, first, distance, primitive)


@kernel
def find_blocked(
    solids: Solids, origin: Vectors, direction: Vectors, reach: NDArray[np.float32], blocked: NDArray[np.uint8]
) -> None:
    """Write 1 for each shadow ray that something which casts shadows blocks, else 0."""
    blocked[:] = 0
    if solids.triangles_cast:
        trace_occluded(solids.occluded, True, solids.packet, origin, direction, reach, blocked)
    if solids.spheres_cast:
        shade_spheres(solids.spheres, solids.stack, origin, direction, reach, blocked)


class Intersector:
    """Nearest-hit and occlusion queries against triangles and spheres; any number of threads may ask at once."""

    def __init__(
        self,
        vertices: NDArray[np.float32],
        faces: NDArray[np.int32],
        casts: NDArray[np.bool_],
        spheres: SphereTree,
        area_lights: NDArray[np.void],
    ) -> None:
        """Build the search structures.

        Args:
            vertices: (n, 3) float32 finite positions.
            faces: (m, 3) int32 vertex indices in range.
            casts: (m,) bool, True where the triangle casts shadows.
            spheres: the spheres.
            area_lights: (l,) AREA_LIGHT, seen but in nobody's way.
        """
        assert vertices.dtype == np.float32 and vertices.ndim == 2 and vertices.shape[1] == 3
        assert faces.dtype == np.int32 and faces.ndim == 2 and faces.shape[1] == 3 and len(casts) == len(faces)
        self.triangles = len(faces)
        self._spheres = spheres
        self._area_lights = area_lights
        self._seen = EmbreeTriangles(vertices, faces) if len(faces) else None
        self._casting = self._seen
        if not casts.all():
            self._casting = EmbreeTriangles(vertices, faces[casts]) if casts.any() else None
        self._sphere_casts = bool(spheres.casts.any())

    def all_casting(self) -> Intersector:
        """The same, but with everything casting shadows."""
        other = copy.copy(self)
        other._casting = self._seen
        other._spheres = self._spheres._replace(casts=np.ones_like(self._spheres.casts))
        other._sphere_casts = len(self._spheres.radius) > 0
        return other

    def without_lights(self) -> Intersector:
        """The same, but blind to area lights."""
        other = copy.copy(self)
        other._area_lights = self._area_lights[:0]
        return other

    def solids(self) -> Solids | None:
        """What rays meet, for this thread's compiled code; None where there are no triangles, or no packets."""
        searches = None if self._seen is None else self._seen.searches()
        if self._seen is None or searches is None:
            return None
        packet, nearest, occluded = searches
        if self._casting is not None:
            _, _, occluded = self._casting.searches() or searches
        return Solids(
            packet, nearest, occluded, self._seen.look_twice, self._casting is not None, self._sphere_casts,
            self._spheres, make_stack(), self._area_lights, self.triangles,
        )  # fmt: skip

    def nearest(self, origin: Vectors | NDArray[np.float32], direction: Vectors | NDArray[np.float32]) -> Hits:
        """Nearest hit of each ray.

        Args:
            origin, direction: of n rays, finite; columns, or (n, 3) float32.
        """
        origin, direction = columns(origin, direction)
        n = len(origin.x)
        if self._seen is None:
            hits = Hits(np.full(n, -1, dtype=np.int32), np.full(n, np.inf, dtype=np.float32))
        else:
            hits = Hits(*self._seen.nearest(origin, direction))
        if len(self._spheres.radius):
            nearest_spheres(
                self._spheres, make_stack(), origin, direction, self.triangles, hits.distance, hits.primitive
            )  # fmt: skip
        if len(self._area_lights):
            first = self.triangles + len(self._spheres.radius)
            nearest_area_lights(self._area_lights, origin, direction, first, hits.distance, hits.primitive)
        return hits

    def occluded(
        self,
        origin: Vectors | NDArray[np.float32],
        direction: Vectors | NDArray[np.float32],
        reach: NDArray[np.float32],
    ) -> NDArray[np.uint8]:
        """Which shadow rays are blocked: (n,) uint8, 1 where something that casts shadows is nearer than `reach`.

        Args:
            origin, direction: of n rays, finite; columns, or (n, 3) float32.
            reach: (n,) float32; its values are lost.
        """
        origin, direction = columns(origin, direction)
        n = len(origin.x)
        assert reach.dtype == np.float32 and reach.shape == (n,)
        blocked = np.zeros(n, dtype=np.uint8)
        limit = reach.copy() if self._sphere_casts and self._casting is not None else reach
        if self._casting is not None:
            self._casting.occluded(origin, direction, limit, blocked)
        if self._sphere_casts:
            shade_spheres(self._spheres, make_stack(), origin, direction, reach, blocked)
        return blocked

    def bare_nearest(self, origin: NDArray[np.float32], direction: NDArray[np.float32]) -> None:
        """embreex's own nearest-hit query for (n, 3) rays and nothing else: the yardstick of the benchmark."""
        if self._seen is not None:
            self._seen.yardstick.run(origin, direction, None, "INTERSECT", output=True)

    def bare_occluded(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], reach: NDArray[np.float32]
    ) -> None:
        """embreex's own occlusion query and nothing else; the values of `reach` are lost."""
        if self._casting is not None:
            self._casting.yardstick.run(origin, direction, reach, "OCCLUDED")
