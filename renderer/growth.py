"""The samples that the cells of a frame still lack, and having them traced."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import UNSURE, Squares, Verdicts, neighbours_lacking
from renderer.cellmap import CellMap
from renderer.frame import RayCounts, RejectedSamples
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.store import FIRST_ROUND, SampleStore, missing_cells
from renderer.tracing import Lack, Tracing, total_rays
from renderer.whitted import View, samples_between
from renderer.workers import Workers


class Growth(NamedTuple):
    """What was traced for a frame.

    Attributes:
        cells: cells of the frame that got samples.
        samples: samples traced, with those that only helped to decide about others.
        asked: samples that would have been traced if no cell had settled for less.
        rays: by kind.
        rejected: samples that were no light.
        held: samples that all cells of the frame have now.
        fewest: samples that every cell of the frame has at least.
        trace_ns: time for tracing them [ns].
    """

    cells: int
    samples: int
    asked: int
    rays: RayCounts
    rejected: RejectedSamples
    held: int
    fewest: int
    trace_ns: int


class _Tracer:
    """Has samples of cells traced and counts what that takes."""

    def __init__(
        self, prepared: PreparedScene, view: View, store: SampleStore, quality: Quality, pool: Workers, tracing: Tracing
    ) -> None:
        self._scene = (prepared, view, quality)
        self._store = store
        self._pool = pool
        self._tracing = tracing
        self.samples = 0
        self.trace_ns = 0
        self.rejected = np.zeros(3, dtype=np.int64)
        self.rays = RayCounts()

    def trace(
        self, squares: Squares, chosen: NDArray[np.int32], first: NDArray[np.int32], until: NDArray[np.int32]
    ) -> int:
        """Trace samples first .. until - 1 of each of the `chosen` squares; return how many these are."""
        if len(chosen) == 0:
            return 0
        began = time.perf_counter_ns()
        found = self._tracing.trace(Lack(*self._scene, squares, chosen, first, until), self._store, self._pool)
        self.trace_ns += time.perf_counter_ns() - began
        traced = found.rays.primary
        self.samples += traced
        self.rays = total_rays([self.rays, found.rays])
        self.rejected += found.rejected
        return traced


def grow(
    prepared: PreparedScene,
    view: View,
    cell_map: CellMap,
    slots: NDArray[np.int32],
    store: SampleStore,
    quality: Quality,
    wanted: int,
    pool: Workers,
    tracing: Tracing,
) -> Growth:
    """Trace what the cells of a map lack of `wanted` samples each, and add it to `store`.

    Args:
        prepared, view: the scene and the camera.
        cell_map, slots: the cells and their slots in `store`.
        store: what was traced before; every block that was begun is added whole.
        quality: samples a cell gets in the end, antialiasing and depth.
        wanted: samples a cell is to have now; `adaptive` lets it settle for less.
        pool: threads; what is added does not depend on their number.
        tracing: what traces; what is added does not depend on it either.

    Raises:
        Abandoned: if the pool's jobs end early.
    """
    chosen, first, held, fewest = missing_cells(store, slots, wanted, pool)
    until = np.full_like(first, wanted)
    tracer = _Tracer(prepared, view, store, quality, pool, tracing)
    squares = Squares(cell_map.x, cell_map.y, cell_map.side, slots)
    if quality.antialiasing == "adaptive":
        verdicts = Verdicts(cell_map, slots, store, prepared.scene.exposure, pool)
        cells, traced = _trace_rounds(tracer, verdicts, squares, chosen, wanted)
        asked, least = samples_between(first, until), min(wanted, FIRST_ROUND)
    else:
        cells, traced = len(chosen), tracer.trace(squares, chosen, first, until)
        asked, least = traced, wanted
    rejected = RejectedSamples(*tracer.rejected.tolist())
    return Growth(
        cells, tracer.samples, asked, tracer.rays, rejected, held + traced, max(fewest, least), tracer.trace_ns
    )


def _trace_rounds(
    tracer: _Tracer, verdicts: Verdicts, squares: Squares, chosen: NDArray[np.int32], wanted: int
) -> tuple[int, int]:
    """Trace round after round until every cell is settled or has `wanted` samples.

    Returns:
        how many of the `chosen` cells got samples, and how many samples these were.
    """
    number = verdicts.number
    begun = number[squares.slots[chosen]]
    fresh = begun < FIRST_ROUND
    once = np.full(np.count_nonzero(fresh), min(wanted, FIRST_ROUND), dtype=np.int32)
    traced = tracer.trace(squares, chosen[fresh], begun[fresh], once)
    got = np.zeros(len(squares.x), dtype=np.bool_)
    got[chosen[fresh]] = True
    while len(chosen := chosen[number[squares.slots[chosen]] < wanted]):
        until, unsure = verdicts.next_round(chosen, wanted)
        if len(unsure):
            beside = neighbours_lacking(squares, unsure, verdicts.shape, number)
            everyone = np.arange(len(beside.x), dtype=np.int32)
            tracer.trace(beside, everyone, number[beside.slots], np.full_like(everyone, FIRST_ROUND))
            until[until == UNSURE], _ = verdicts.next_round(unsure, wanted)
        first = number[squares.slots[chosen]]
        going_on = until > first
        chosen = chosen[going_on]
        traced += tracer.trace(squares, chosen, first[going_on], until[going_on])
        got[chosen] = True
    return int(got.sum()), traced
