"""Rows of one frame: beside bare Embree on its rays, its stages and its variants beside the whole, on one thread."""

from __future__ import annotations

import time
from dataclasses import replace

from clients.command_line.benchmark.job import Job
from clients.command_line.benchmark.row import Row, figure_row, measured_row, missing_row
from renderer.benchmark import BARE, FRAME, MAP, MOVED, PACKETS, RECONSTRUCT, measure_frame
from renderer.frame import FrameRequest
from renderer.pipeline import Renderer
from renderer.workers import available_cores

FRAME_AIM = 0.60
MANY_AIM = 0.50
MOVED_AIM = 0.12
MAP_AIM = 0.08
RECONSTRUCT_AIM = 0.10
THREADS_AIM = 1.85


def frame_rows(job: Job) -> tuple[Row, ...]:
    """The frame as asked for, its map cached, its samples new, not encoded."""
    result = measure_frame(job.renderer, job.prepared, job.request, job.repeats, lambda: None)
    figures = {figure.name: figure for figure in result.figures}
    note = f"{result.rays.total:,} rays of {result.cells:,} cells"
    return (
        figure_row("frame", FRAME, figures[FRAME], note=note),
        figure_row("frame", f"{BARE}, its rays", figures[BARE]),
        figure_row("frame", f"{FRAME} / {BARE}", figures[f"{FRAME} / {BARE}"], aim=FRAME_AIM),
        figure_row("frame", f"{PACKETS} / {BARE}", figures[f"{PACKETS} / {BARE}"], note="tracing alone"),
        figure_row("frame", f"{MOVED} / {FRAME}", figures[f"{MOVED} / {FRAME}"], aim=MOVED_AIM),
        figure_row("frame", f"new cell map / {FRAME}", figures[f"{MAP} / {FRAME}"], aim=MAP_AIM),
        figure_row("frame", f"{RECONSTRUCT} / {FRAME}", figures[f"{RECONSTRUCT} / {FRAME}"], aim=RECONSTRUCT_AIM),
    )


def sample_rows(job: Job) -> tuple[Row, ...]:
    """The same with many samples a cell."""
    result = measure_frame(job.renderer, job.prepared, job.with_samples(job.many), job.heavy_repeats, lambda: None)
    figures = {figure.name: figure for figure in result.figures}
    note = f"{result.rays.total:,} rays"
    whole, tracing = f"{FRAME} / {BARE}", f"{PACKETS} / {BARE}"
    return (
        figure_row("samples", f"{whole}, {job.many} samples", figures[whole], aim=MANY_AIM, note=note),
        figure_row("samples", f"{tracing}, {job.many} samples", figures[tracing], note="tracing alone"),
    )


def thread_rows(job: Job) -> tuple[Row, ...]:
    """The frame on one thread beside two."""
    what = "1 thread / 2 threads"
    if available_cores() < 2:
        return (missing_row("threads", what, "this process may run on one core alone"),)
    alone, pair = Renderer(1), Renderer(2)
    for renderer in (alone, pair):
        timed_frame_ms(renderer, job, job.request)  # its memory is new to it
    gains = []
    for _ in range(job.repeats):
        slow, fast = (timed_frame_ms(renderer, job, job.request) for renderer in (alone, pair))
        gains.append(slow / fast)
    alone.close()
    pair.close()
    return (measured_row("threads", what, gains, aim=THREADS_AIM, at_least=True),)


def timed_frame_ms(renderer: Renderer, job: Job, request: FrameRequest) -> float:
    """Time of one frame whose samples are new and whose map is cached [ms]."""
    renderer.cell_map(request.display, request.quality, request.gaze)
    renderer.forget_samples()
    began = time.perf_counter()
    renderer.render(job.prepared, replace(request, linear=False))
    return 1e3 * (time.perf_counter() - began)
