"""The rays of a block that wait to be traced, level by level: those of the camera, what these sent on, and so forth.

A level holds the children of one batch, and the deepest one is traced first, so memory is bounded by depth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import shared
from renderer.places import Places, make_places
from renderer.rays import Hits, Rays, ShadowRays, level_rows, make_rays, make_shadow_rays, some_rays
from renderer.spawning import CHILDREN, COUNTERS


class Levels(NamedTuple):
    """Room for the rays of a block, and for what becomes of a batch of them.

    Attributes:
        rays: those of each level `apart` rows after those of the level before, `capacity` of them at most.
        capacity, apart: see there.
        pending: (levels, 2) int64 those that wait: the first, and that after the last.
        hits: what the rays of a batch meet.
        shadows: their shadow rays.
        blocked: (n,) uint8, which of these are.
        places: what some of them meet.
        counters: (COUNTERS,) int64 of the batch.
        seed, number: of `LightSamples`, for each camera sample.
    """

    rays: Rays
    capacity: int
    apart: int
    pending: NDArray[np.int64]
    hits: Hits
    shadows: ShadowRays
    blocked: NDArray[np.uint8]
    places: Places
    counters: NDArray[np.int64]
    seed: NDArray[np.uint64]
    number: NDArray[np.int32]


def make_levels(samples: int, levels: int, shadow_rays: int, lights: int) -> Levels:
    """Room for a block; of most of it no page is touched before rays are written there.

    Args:
        samples: most camera samples, and most rays of a batch.
        levels: how many.
        shadow_rays: most of a batch.
        lights: point lights of the scene.
    """
    capacity = 2 * samples
    return Levels(
        rays=make_rays(capacity, levels),
        capacity=capacity,
        apart=level_rows(capacity),
        pending=np.zeros((levels, 2), dtype=np.int64),
        hits=Hits(np.empty(samples, dtype=np.int32), np.empty(samples, dtype=np.float32)),
        shadows=make_shadow_rays(shadow_rays),
        blocked=np.empty(shadow_rays, dtype=np.uint8),
        places=make_places(lights),
        counters=np.zeros(COUNTERS, dtype=np.int64),
        seed=np.empty(samples, dtype=np.uint64),
        number=np.empty(samples, dtype=np.int32),
    )


@shared
def next_batch(levels: Levels, depth: int, block: int) -> tuple[int, int, int]:
    """The next batch: its level, its first ray, and that after its last; the level is -1 when there is none left.

    Args:
        levels: the rays.
        depth: deepest level that rays may wait on.
        block: most rays of a batch.
    """
    pending = levels.pending
    while depth >= 0 and pending[depth, 0] == pending[depth, 1]:
        depth -= 1
    if depth < 0:
        return depth, 0, 0
    start, end = pending[depth, 0], pending[depth, 1]
    stop = batch_end(levels.rays.sample, start, end, block)
    pending[depth, 0] = stop
    return depth, start, stop


@shared
def batch_end(sample: NDArray[np.int32], start: int, end: int, block: int) -> int:
    """Where the batch that begins at `start` ends: after at most `block` rays, between two samples.

    A single sample of more than `block` rays is cut after `block` of them. So wherever a sample's rays fit in a batch,
    what they add up to, and in which order, does not depend on its neighbours in the block.

    Args:
        sample: rising sample numbers of the rays.
        start, end: rays start .. end - 1 are pending.
        block: most rays of a batch.
    """
    if end - start <= block:
        return end
    limit = start + block
    boundary = limit
    while boundary > start and sample[boundary - 1] == sample[limit]:
        boundary -= 1
    return boundary if boundary > start else limit


@shared
def room_for_children(levels: Levels, depth: int) -> Rays:
    """The next level, for the children of a batch of level `depth`."""
    first = (depth + 1) * levels.apart
    return some_rays(levels.rays, first, first + levels.capacity)


@shared
def wait_for_children(levels: Levels, depth: int) -> int:
    """Let the children of the batch of level `depth` wait on the next one; the deepest level that rays wait on now."""
    spawned = levels.counters[CHILDREN]
    if spawned == 0:
        return depth
    first = (depth + 1) * levels.apart
    levels.pending[depth + 1, 0], levels.pending[depth + 1, 1] = first, first + spawned
    return depth + 1
