"""What a frame costs beside what bounds it: bare Embree time for the same rays, on all cores.

Frame and yardstick are timed in turn within one run, so that a machine whose speed drifts does not
favour one of them; figures are medians with their range, and ratios are taken pair by pair.
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import build_cell_map
from renderer.frame import FrameRequest, RayCounts
from renderer.gaze import Gaze, bucket_of
from renderer.intersection import Intersector
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.rays import Hits, Vectors, copied, rows_of
from renderer.workers import WorkerPool

GAZE_STEP_PX = 20.0
"""Move of the gaze whose cost is measured [px]."""


FRAME = "whole frame"
BARE = "bare Embree"
PACKETS = "its rays in packets"
MAP = "cell map"
TRACE = "trace"
RECONSTRUCT = "reconstruct and tone map"
MOVED = "after a 20 px gaze move"
STORED = "everything stored"
"""What is timed: the frame traced anew with its map cached and without encoding; Embree alone on the same rays and as
many threads; these rays as the renderer has them traced, without shading; building the map; the frame's other stages;
and the frame with the sample store warm.
"""

_Result = TypeVar("_Result")


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured quantity.

    Attributes:
        name: what was measured.
        median, low, high: over the repeats.
        unit: `ms` or `ratio`.
    """

    name: str
    median: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, slots=True)
class Benchmark:
    """Figures for one frame of one scene.

    Attributes:
        cells: of its map.
        rays: traced for the whole frame.
        threads: used by frame and yardstick alike.
        figures: times and ratios.
    """

    cells: int
    rays: RayCounts
    threads: int
    figures: tuple[Figure, ...]


class RecordedRays(NamedTuple):
    """Batches of rays.

    Attributes:
        nearest: origin and direction of each batch, columns or (n, 3) float32.
        shadow: the same with the reach.
    """

    nearest: list[tuple[Any, Any]]
    shadow: list[tuple[Any, Any, NDArray[np.float32]]]

    @property
    def number(self) -> int:
        """How many they are."""
        return sum(len(origin.x) for origin, _ in self.nearest) + sum(len(reach) for _, _, reach in self.shadow)

    def rows(self) -> RecordedRays:
        """The same as (n, 3) float32, as embreex takes them."""
        return RecordedRays(
            [(rows_of(origin), rows_of(direction)) for origin, direction in self.nearest],
            [(rows_of(origin), rows_of(direction), reach) for origin, direction, reach in self.shadow],
        )


class _RecordingIntersector:
    """Answers like the intersector it stands for, and keeps the rays it was asked about."""

    def __init__(self, intersector: Intersector, every: int) -> None:
        """Record what `intersector` is asked, or one batch in `every` of nearest hits, and of shadows."""
        self._intersector = intersector
        self._every = every
        self._nearest, self._shadow = itertools.count(), itertools.count()
        self.rays = RecordedRays([], [])

    def nearest(self, origin: Vectors, direction: Vectors) -> Hits:
        """As `Intersector.nearest`."""
        if next(self._nearest) % self._every == 0:
            self.rays.nearest.append((copied(origin), copied(direction)))
        return self._intersector.nearest(origin, direction)

    def occluded(self, origin: Vectors, direction: Vectors, reach: NDArray[np.float32]) -> NDArray[np.uint8]:
        """As `Intersector.occluded`."""
        if next(self._shadow) % self._every == 0:
            self.rays.shadow.append((copied(origin), copied(direction), reach.copy()))
        return self._intersector.occluded(origin, direction, reach)


def recording(prepared: PreparedScene, every: int = 1) -> tuple[PreparedScene, RecordedRays]:
    """The same scene, and the rays that are traced in it from now on: all of them, or those of one batch in `every`."""
    recorder = _RecordingIntersector(prepared.intersector, every)
    return replace(prepared, intersector=recorder), recorder.rays  # type: ignore[arg-type]


def measure_frame(
    renderer: Renderer, prepared: PreparedScene, request: FrameRequest, repeats: int, tick: Callable[[], None]
) -> Benchmark:
    """Time one frame traced anew, its stages and its variants, against bare Embree time for its rays.

    Args:
        renderer: its caches are emptied.
        prepared: a scene with triangles.
        request: the frame.
        repeats: how often each is timed, 1 or more.
        tick: called after each repeat, for a progress bar.
    """
    recorded, columns = recording(prepared)
    renderer.forget_samples()
    first = renderer.render(recorded, request)
    pool = WorkerPool(renderer.threads)
    moved = replace(request, gaze=Gaze(request.gaze.x + GAZE_STEP_PX, request.gaze.y))
    times: dict[str, list[float]] = {
        name: [] for name in (FRAME, BARE, PACKETS, MAP, TRACE, RECONSTRUCT, MOVED, STORED)
    }

    def timed(name: str, action: Callable[[], _Result]) -> _Result:
        began = time.perf_counter()
        result = action()
        times[name].append(1e3 * (time.perf_counter() - began))
        return result

    renderer.render(prepared, moved)
    intersector = prepared.intersector
    bare, packets = (intersector.bare_nearest, intersector.bare_occluded), (intersector.nearest, intersector.occluded)
    rows = columns.rows()
    trace_rays(rows, pool, *bare)  # its search tree is built at the first use
    for _ in range(repeats):
        renderer.forget_samples()
        frame = timed(FRAME, lambda: renderer.render(prepared, request))
        times[TRACE].append(frame.cost.time_ms.trace)
        times[RECONSTRUCT].append(frame.cost.time_ms.reconstruct)
        timed(BARE, lambda: trace_rays(rows, pool, *bare))
        timed(PACKETS, lambda: trace_rays(columns, pool, *packets))
        timed(MOVED, lambda: renderer.render(prepared, moved))
        timed(STORED, lambda: renderer.render(prepared, request))
        timed(MAP, lambda: _build_map(request, pool))
        tick()
    pool.close()
    return Benchmark(first.cost.cells, first.cost.rays, renderer.threads, _figures(times))


def _build_map(request: FrameRequest, pool: WorkerPool) -> None:
    quality = request.quality
    bucket = bucket_of(request.gaze, quality.gaze_bucket_px)
    build_cell_map(quality.map, request.display, quality.acuity, bucket, pool)


def trace_rays(
    rays: RecordedRays,
    pool: WorkerPool,
    nearest: Callable[[Any, Any], object],
    occluded: Callable[[Any, Any, NDArray[np.float32]], object],
) -> None:
    """Trace recorded rays and do nothing else, batch by batch on all threads.

    Args:
        rays: the rays.
        pool: threads.
        nearest, occluded: what traces them, as the methods of `Intersector`.
    """
    seen, shadow = rays
    reaches = [reach.copy() for _, _, reach in shadow]

    def trace(batch: int) -> None:
        if batch < len(seen):
            nearest(*seen[batch])
        else:
            origin, direction, _ = shadow[batch - len(seen)]
            occluded(origin, direction, reaches[batch - len(seen)])

    pool.run(trace, len(seen) + len(shadow))


def _figures(times: dict[str, list[float]]) -> tuple[Figure, ...]:
    figures = [_figure(name, series, "ms") for name, series in times.items()]
    for part, whole in (
        (FRAME, BARE),
        (PACKETS, BARE),
        (MAP, BARE),
        (TRACE, BARE),
        (RECONSTRUCT, BARE),
        (MAP, FRAME),
        (RECONSTRUCT, FRAME),
        (MOVED, FRAME),
    ):
        ratios = [a / b for a, b in zip(times[part], times[whole], strict=True)]
        figures.append(_figure(f"{part} / {whole}", ratios, "ratio"))
    return tuple(figures)


def _figure(name: str, series: list[float], unit: str) -> Figure:
    return Figure(name, statistics.median(series), min(series), max(series), unit)
