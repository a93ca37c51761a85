"""Where the cells of a frame are handed over to be traced: one seam, whatever traces them behind it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import Squares
from renderer.frame import RayCounts
from renderer.kernel import kernel
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.store import SampleStore, add_samples
from renderer.whitted import Cells, View, block_rays, samples_between, trace_cells
from renderer.workers import Workers

SHARES = 4
"""Parts, for each thread, of the samples that are left, of which a block gets one at most."""

SMALLEST_BLOCK = 4096
"""Samples that a block may always have: in smaller ones what goes before and after them is felt."""


class Lack(NamedTuple):
    """Samples that some squares of a screen lack.

    Attributes:
        prepared: the scene, with the effects that `quality` forces on or off.
        view: the camera.
        quality: samples a cell gets in the end, antialiasing, depth and effects.
        squares: of the screen.
        chosen: (c,) int32 which of them, no two with the same slot.
        first, until: (c,) int32 samples first .. until - 1 of each; `first` is what the store has.
    """

    prepared: PreparedScene
    view: View
    quality: Quality
    squares: Squares
    chosen: NDArray[np.int32]
    first: NDArray[np.int32]
    until: NDArray[np.int32]


class Traced(NamedTuple):
    """What tracing them took.

    Attributes:
        rays: by kind.
        rejected: (3,) int64 samples that were no light, as `RejectedSamples` has them.
    """

    rays: RayCounts
    rejected: NDArray[np.int64]


class Tracing(Protocol):
    """A way through which samples are traced.

    Frames do not depend on it: every way leaves the very same bits in the store.
    """

    def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
        """Trace what is lacking and add it to `store`, the samples of a square in their order.

        Args:
            lack: scene, camera and samples.
            store: held by the caller.
            pool: threads of this process, and when to give up.

        Raises:
            Abandoned: if `pool.abandon` is set before the end. A square then has all of its samples or none of them.
        """


class ThreadTracing:
    """Traces on the threads of this process."""

    def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
        """Trace block after block of the samples, each added to the store by the thread that traced it."""
        prepared, view, quality, squares, chosen, first, until = lack
        samples, spread, white = store.samples, store.spread, store.white
        starts = block_starts(first, until, block_rays(prepared, quality), SHARES * pool.threads)
        counts = [RayCounts()] * (len(starts) - 1)
        rejected = np.zeros((len(starts) - 1, 3), dtype=np.int64)

        def trace_block(block: int) -> None:
            part = slice(starts[block], starts[block + 1])
            some = Cells(squares.x, squares.y, squares.side, chosen[part], first[part], until[part])
            radiance, counts[block] = trace_cells(prepared, view, some, quality)
            rejected[block] = add_samples(samples, spread, white, squares.slots, some.chosen, some.until, radiance)

        pool.run(trace_block, len(counts))
        return Traced(total_rays(counts), rejected.sum(axis=0))


def block_starts(first: NDArray[np.int32], until: NDArray[np.int32], block: int, shares: int = 1) -> list[int]:
    """Where to cut a row of cells into blocks of at most `block` samples, or of a single cell of more.

    Args:
        first, until: (c,) int32 samples first .. until - 1 of each cell, 1 or more.
        block: most samples of a block.
        shares: a block gets no more than one part in `shares` of what is left, so that threads that take them one after
            another end together; but SMALLEST_BLOCK it may always have.

    Returns:
        the first cell of each block, and c.
    """
    starts = np.empty(len(first) + 1, dtype=np.int64)
    return [*starts[: _cut(first, until, block, shares, starts)].tolist(), len(first)]


@kernel
def _cut(first: NDArray[np.int32], until: NDArray[np.int32], block: int, shares: int, starts: NDArray[np.int64]) -> int:
    """Write the first cell of each block; how many these are."""
    left = samples_between(first, until)
    blocks, held, most = 0, block, 0
    for cell in range(len(first)):
        samples = until[cell] - first[cell]
        if held + samples > most:
            starts[blocks] = cell
            blocks, held, most = blocks + 1, 0, min(block, max(SMALLEST_BLOCK, left // shares))
        held += samples
        left -= samples
    return blocks


def total_rays(counts: list[RayCounts]) -> RayCounts:
    """The sum of several counts."""
    return RayCounts(
        primary=sum(count.primary for count in counts),
        shadow=sum(count.shadow for count in counts),
        reflection=sum(count.reflection for count in counts),
        refraction=sum(count.refraction for count in counts),
    )
