"""The samples that the cells of a frame still lack, and tracing them."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.frame import RayCounts
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.store import Samples, add_samples, missing_cells
from renderer.whitted import Cells, View, block_rays, trace_cells
from renderer.workers import Workers


class Growth(NamedTuple):
    """What was traced for a frame.

    Attributes:
        cells, samples: cells that got samples, and how many in all.
        rays: by kind.
        rejected: samples that were no light.
        held: samples that all cells of the frame have now.
        fewest: samples that every cell of the frame has at least.
        trace_ns: time for tracing them [ns].
    """

    cells: int
    samples: int
    rays: RayCounts
    rejected: int
    held: int
    fewest: int
    trace_ns: int


def grow(
    prepared: PreparedScene,
    view: View,
    cell_map: CellMap,
    slots: NDArray[np.int64],
    samples: Samples,
    quality: Quality,
    wanted: int,
    pool: Workers,
) -> Growth:
    """Trace what the cells of a map lack of `wanted` samples each, and add it to `samples`.

    Args:
        prepared, view: the scene and the camera.
        cell_map, slots: the cells and their slots in `samples`.
        samples: what was traced before; every block that was begun is added whole.
        quality: samples a cell gets in the end, antialiasing and depth.
        wanted: samples a cell is to have now.
        pool: threads; what is added does not depend on their number.

    Raises:
        Abandoned: if the pool's jobs end early.
    """
    found = np.zeros(cell_map.cells, dtype=np.int32)
    had = np.zeros(cell_map.cells, dtype=np.int32)
    missing, held, fewest = missing_cells(samples, slots, wanted, found, had)
    chosen, first = found[:missing], had[:missing]
    until = np.full(missing, wanted, dtype=np.int32)
    starts = block_starts(until - first, block_rays(prepared, quality))
    counts = [RayCounts()] * (len(starts) - 1)
    rejected = [0] * (len(starts) - 1)

    def trace(block: int) -> None:
        part = slice(starts[block], starts[block + 1])
        some = Cells(cell_map.x, cell_map.y, cell_map.side, chosen[part], first[part], until[part])
        radiance, counts[block] = trace_cells(prepared, view, some, quality)
        rejected[block] = add_samples(samples, slots, some.chosen, some.until, radiance)

    began = time.perf_counter_ns()
    pool.run(trace, len(counts))
    trace_ns = time.perf_counter_ns() - began
    traced = int((until - first).sum())
    return Growth(missing, traced, total_rays(counts), sum(rejected), held + traced, max(fewest, wanted), trace_ns)


def block_starts(samples: NDArray[np.int32], block: int) -> list[int]:
    """Where to cut a row of cells into blocks of at most `block` samples, or of a single cell of more.

    Args:
        samples: (c,) int32 samples of each cell, 1 or more.
        block: most samples of a block.

    Returns:
        the first cell of each block, and c.
    """
    ends = np.cumsum(samples, dtype=np.int64)
    starts = [0]
    while starts[-1] < len(samples):
        start = starts[-1]
        before = int(ends[start - 1]) if start else 0
        starts.append(max(start + 1, int(np.searchsorted(ends, before + block, side="right"))))
    return starts


def total_rays(counts: list[RayCounts]) -> RayCounts:
    """The sum of several counts."""
    return RayCounts(
        primary=sum(count.primary for count in counts),
        shadow=sum(count.shadow for count in counts),
        reflection=sum(count.reflection for count in counts),
        refraction=sum(count.refraction for count in counts),
    )
