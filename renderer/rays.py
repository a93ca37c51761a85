"""The records that flow between the stages of the tracer: rays, hits and shadow rays.

Each part of them is a column of its own, of which kernels read and write as many as go side by side at once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.allocator import sparse
from renderer.kernel import shared
from renderer.lanes import LANES

PAGE, STAGGER = 4096, 320
"""Bytes after which places in a core's first cache recur, and by how many of them columns lie apart."""


class Vectors(NamedTuple):
    """Points, directions or colours.

    Attributes:
        x, y, z: (n,) float32, C-contiguous; of colours red, green and blue.
    """

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    z: NDArray[np.float32]


class Rays(NamedTuple):
    """Rays on their way, in scene units.

    Attributes:
        origin, direction: n of each; directions are of unit length.
        weight: share of what the ray sees that reaches the eye.
        sample: (n,) int32 camera sample of the block it belongs to; rising along the array.
        width, spread: (n,) float32 its width at the origin, and what it gains per scene unit; see `footprint`.
        around: (n,) int64 the media it is in, see `media`; only in scenes that have some.
    """

    origin: Vectors
    direction: Vectors
    weight: Vectors
    sample: NDArray[np.int32]
    width: NDArray[np.float32]
    spread: NDArray[np.float32]
    around: NDArray[np.int64]


class ShadowRays(NamedTuple):
    """Rays towards a light, with what arrives if nothing is in between.

    Attributes:
        origin, direction: n of each; directions lead right to the light, in scene units.
        reach: (n,) float32 where to stop looking, in lengths of the direction: just before 1.
        light: radiance that the sample gains if the light is seen.
        sample: (n,) int32 camera sample of the block.
    """

    origin: Vectors
    direction: Vectors
    reach: NDArray[np.float32]
    light: Vectors
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


def vectors_of(rows: NDArray[np.float32]) -> Vectors:
    """(n, 3) float32 as columns, copied.

    Raises:
        ValueError: if it is anything else.
    """
    if rows.dtype != np.float32 or rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"expected (n, 3) float32, found {rows.shape} {rows.dtype}")
    return Vectors(*(np.ascontiguousarray(rows[:, axis]) for axis in range(3)))


def columns(origin: Vectors | NDArray[np.float32], direction: Vectors | NDArray[np.float32]) -> tuple[Vectors, Vectors]:
    """Rays as columns, which they may be already.

    Raises:
        ValueError: if one is neither that nor (n, 3) float32, or if there are more of the one than of the other.
    """
    begin, towards = (given if isinstance(given, Vectors) else vectors_of(given) for given in (origin, direction))
    if len(begin.x) != len(towards.x):
        raise ValueError(f"expected as many directions as origins, found {len(towards.x)} and {len(begin.x)}")
    return begin, towards


def rows_of(vectors: Vectors) -> NDArray[np.float32]:
    """The same as (n, 3) float32, C-contiguous."""
    return np.stack(vectors, axis=1)


def some_vectors(vectors: Vectors, chosen: NDArray[np.integer]) -> Vectors:
    """Those that are chosen, copied."""
    return Vectors(vectors.x[chosen], vectors.y[chosen], vectors.z[chosen])


def copied(vectors: Vectors) -> Vectors:
    """A copy."""
    return Vectors(vectors.x.copy(), vectors.y.copy(), vectors.z.copy())


@shared
def span(vectors: Vectors, start: int, stop: int) -> Vectors:
    """Vectors start .. stop - 1, without a copy."""
    return Vectors(vectors.x[start:stop], vectors.y[start:stop], vectors.z[start:stop])


@shared
def some_rays(rays: Rays, start: int, stop: int) -> Rays:
    """Rays start .. stop - 1, without a copy."""
    return Rays(
        span(rays.origin, start, stop),
        span(rays.direction, start, stop),
        span(rays.weight, start, stop),
        rays.sample[start:stop],
        rays.width[start:stop],
        rays.spread[start:stop],
        rays.around[start:stop],
    )


@shared
def first_shadow_rays(rays: ShadowRays, count: int) -> ShadowRays:
    """The first `count` shadow rays, without a copy."""
    return ShadowRays(
        span(rays.origin, 0, count),
        span(rays.direction, 0, count),
        rays.reach[:count],
        span(rays.light, 0, count),
        rays.sample[:count],
    )


def _column_bytes(capacity: int, size: int) -> int:
    """From the first of `capacity` numbers of `size` bytes to that of the next column."""
    return -(-(capacity + LANES) * size // PAGE) * PAGE + STAGGER


def make_columns(count: int, capacity: int, kind: Any = np.float32, levels: int = 1) -> list[NDArray[Any]]:
    """`count` columns of (capacity,) zeros, with memory behind each that LANES numbers at once may run into.

    They lie STAGGER bytes apart but for whole pages: what stands in the same row of several would otherwise contend for
    the same few places in a core's first cache. Of more levels than one, each has its `capacity` rows, `level_rows`
    after those of the level before; between them are the other columns, so that what is written together lies together.
    """
    size = np.dtype(kind).itemsize
    apart = _column_bytes(capacity, size)
    room = sparse(levels * count * apart // size, kind)
    return [
        room[column * apart // size :][: (levels - 1) * count * apart // size + capacity] for column in range(count)
    ]


RAY_COLUMNS = 12
"""Columns of rays that are 4 bytes wide: all but one, that of the media."""


def level_rows(capacity: int) -> int:
    """Rows from the first of one level of rays to that of the next, where each has `capacity` of them."""
    return RAY_COLUMNS * _column_bytes(capacity, 4) // 4


def make_rays(capacity: int, levels: int = 1) -> Rays:
    """Room for `capacity` rays, or for so many in each of some levels."""
    columns = make_columns(RAY_COLUMNS, capacity, levels=levels)
    around = sparse((levels - 1) * level_rows(capacity) + capacity + LANES, np.int64)
    return Rays(
        Vectors(*columns[:3]), Vectors(*columns[3:6]), Vectors(*columns[6:9]), columns[9].view(np.int32),
        columns[10], columns[11], around,
    )  # fmt: skip


def make_shadow_rays(capacity: int) -> ShadowRays:
    """Room for `capacity` shadow rays."""
    columns = make_columns(11, capacity)
    return ShadowRays(
        Vectors(*columns[:3]), Vectors(*columns[3:6]), columns[6], Vectors(*columns[7:10]), columns[10].view(np.int32)
    )
