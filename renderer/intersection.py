"""What a ray meets: triangles through Embree, spheres through their own tree, area lights one by one."""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray

from renderer.area_light import nearest_area_lights
from renderer.embree import EmbreeTriangles
from renderer.rays import Hits, Vectors, columns
from renderer.sphere import SphereTree, nearest_spheres, shade_spheres


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
            nearest_spheres(self._spheres, origin, direction, self.triangles, hits.distance, hits.primitive)
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
            shade_spheres(self._spheres, origin, direction, reach, blocked)
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
