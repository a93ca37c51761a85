"""Rows of a frame that follows the gaze: each stage beside what it cannot do without."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clients.command_line.benchmark.job import Job
from clients.command_line.benchmark.row import Row, measured_row
from renderer.benchmark import GAZE_STEP_PX, recording, trace_rays
from renderer.codec import encode
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.workers import WorkerPool

COPIED_TOGETHER = 1 << 20
"""Bytes that a thread copies at a time."""


@dataclass(frozen=True, slots=True)
class _Followed:
    """One frame after the gaze moved.

    Attributes:
        ms: time of each stage.
        over: of some stages, their time over that of what they cannot do without.
        rays: traced.
    """

    ms: dict[str, float]
    over: dict[str, float]
    rays: int


def stage_rows(job: Job) -> tuple[Row, ...]:
    """Stages of frames 20 px apart, one sample a cell: the map new, most samples stored, encoded as JPEG.

    The map is held against copying as many bytes as it has, tracing against the frame's rays in packets alone, and
    reconstruction against copying the mask and the picture, each on the same threads.
    """
    request = job.with_samples(1)
    twin, pool = Renderer(job.renderer.threads), WorkerPool(job.renderer.threads)
    job.renderer.forget_samples()
    for renderer in (job.renderer, twin):
        renderer.render(job.prepared, request)
    gazes = [Gaze(request.gaze.x + GAZE_STEP_PX * step, request.gaze.y) for step in range(1, job.repeats + 1)]
    frames = [_followed(job, twin, pool, replace(request, gaze=gaze)) for gaze in gazes]
    twin.close()
    pool.close()
    rays = sum(frame.rays for frame in frames) // len(frames)
    notes = {"trace": f"{rays:,} rays", "encode": "libjpeg-turbo alone"}
    times = (
        measured_row(
            "stages", f"{stage}, 20 px further", [frame.ms[stage] for frame in frames], "ms", note=notes.get(stage, "")
        )
        for stage in frames[0].ms
    )
    ratios = (measured_row("stages", stage, [frame.over[stage] for frame in frames]) for stage in frames[0].over)
    return (*times, *ratios)


def _followed(job: Job, twin: Renderer, pool: WorkerPool, request: FrameRequest) -> _Followed:
    """Render the next frame, on a twin once more for its rays, and time what its stages cannot do without."""
    frame = job.renderer.render(job.prepared, request)
    taken = frame.cost.time_ms
    encoded_ms = _timed_ms(partial(encode, frame.pixels, "jpeg"))
    intersector = job.prepared.intersector
    recorded, rays = recording(job.prepared)
    twin.render(recorded, request)
    packets_ms = _timed_ms(partial(trace_rays, rays, pool, intersector.nearest, intersector.occluded))
    cells, _ = job.renderer.cell_map(request.display, request.quality, request.gaze)
    map_ms = _copied_ms((cells.x, cells.y, cells.side, cells.mask), pool)
    picture_ms = _copied_ms((cells.mask, frame.pixels), pool)
    return _Followed(
        {"map": taken.map, "trace": taken.trace, "reconstruct": taken.reconstruct, "encode": encoded_ms},
        {
            "map / its bytes copied": taken.map / map_ms,
            "trace / its rays in packets": taken.trace / packets_ms,
            "reconstruct / mask and picture copied": taken.reconstruct / picture_ms,
        },
        frame.cost.rays.total,
    )


def _timed_ms(action: Callable[[], Any]) -> float:
    began = time.perf_counter()
    action()
    return 1e3 * (time.perf_counter() - began)


def _copied_ms(arrays: Sequence[NDArray[Any]], pool: WorkerPool) -> float:
    """Time to copy arrays to memory that is at hand [ms]."""
    parts = [
        (flat[start : start + COPIED_TOGETHER], np.zeros(min(COPIED_TOGETHER, len(flat) - start), dtype=np.uint8))
        for flat in (np.ascontiguousarray(array).reshape(-1).view(np.uint8) for array in arrays)
        for start in range(0, len(flat), COPIED_TOGETHER)
    ]
    return _timed_ms(lambda: pool.run(lambda part: np.copyto(parts[part][1], parts[part][0]), len(parts)))
