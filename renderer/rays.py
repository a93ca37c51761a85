"""The records that flow between the stages of the tracer: rays, hits and shadow rays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Rays(NamedTuple):
    """Rays on their way, in scene units.

    Attributes:
        origin, direction: (n, 3) float32; directions are of unit length.
        weight: (n, 3) float32 share of what the ray sees that reaches the eye.
        sample: (n,) int32 camera sample of the block it belongs to; rising along the array.
        pencil: (n, 2) float32 its width at the origin, and what it gains per scene unit; see `footprint`.
        around: (n,) int64 the media it is in, see `media`; only in scenes that have some.
    """

    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    weight: NDArray[np.float32]
    sample: NDArray[np.int32]
    pencil: NDArray[np.float32]
    around: NDArray[np.int64]


class ShadowRays(NamedTuple):
    """Rays towards a light, with what arrives if nothing is in between.

    Attributes:
        origin, direction: (n, 3) float32; directions lead right to the light, in scene units.
        reach: (n,) float32 where to stop looking, in lengths of the direction: just before 1.
        light: (n, 3) float32 radiance that the sample gains if the light is seen.
        sample: (n,) int32 camera sample of the block.
    """

    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    reach: NDArray[np.float32]
    light: NDArray[np.float32]
    sample: NDArray[np.int32]


class Hits(NamedTuple):
    """Nearest hits of rays.

    Attributes:
        primitive: (n,) int32: a triangle, a sphere (numbered after the triangles), an area light (numbered after
            the spheres) or -1 for nothing.
        distance: (n,) float32 in lengths of the direction; meaningless for a miss.
    """

    primitive: NDArray[np.int32]
    distance: NDArray[np.float32]


def some_rays(rays: Rays, start: int, stop: int) -> Rays:
    """Rays start .. stop - 1, without a copy."""
    part = slice(start, stop)
    return Rays(
        rays.origin[part],
        rays.direction[part],
        rays.weight[part],
        rays.sample[part],
        rays.pencil[part],
        rays.around[part],
    )


def first_shadow_rays(rays: ShadowRays, count: int) -> ShadowRays:
    """The first `count` shadow rays, without a copy."""
    return ShadowRays(
        rays.origin[:count], rays.direction[:count], rays.reach[:count], rays.light[:count], rays.sample[:count]
    )


def make_rays(capacity: int) -> Rays:
    """Room for `capacity` rays."""
    return Rays(
        origin=np.zeros((capacity, 3), dtype=np.float32),
        direction=np.zeros((capacity, 3), dtype=np.float32),
        weight=np.zeros((capacity, 3), dtype=np.float32),
        sample=np.zeros(capacity, dtype=np.int32),
        pencil=np.zeros((capacity, 2), dtype=np.float32),
        around=np.zeros(capacity, dtype=np.int64),
    )


def make_shadow_rays(capacity: int) -> ShadowRays:
    """Room for `capacity` shadow rays."""
    return ShadowRays(
        origin=np.zeros((capacity, 3), dtype=np.float32),
        direction=np.zeros((capacity, 3), dtype=np.float32),
        reach=np.zeros(capacity, dtype=np.float32),
        light=np.zeros((capacity, 3), dtype=np.float32),
        sample=np.zeros(capacity, dtype=np.int32),
    )
