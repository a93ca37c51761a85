"""Rows of gaze-dependent frames beside full ones, and of a larger screen beside a smaller one."""

from __future__ import annotations

from dataclasses import replace

from clients.command_line.benchmark.job import Job
from clients.command_line.benchmark.row import Row, measured_row
from renderer.gaze import Gaze
from renderer.paper import published
from renderer.paper.timing import compare_times

PAPER_AIM = 0.97
LARGE_AIM = 1.4


def paper_rows(job: Job) -> tuple[Row, ...]:
    """How much of what is saved in rays is saved in time: the paper's figure, for its map and for our default."""
    display, gaze = job.request.display, job.request.gaze
    compared = compare_times(job.renderer, job.prepared, display, gaze, job.many, job.heavy_repeats)
    return tuple(
        measured_row(
            "paper",
            f"(full / {picture.name}) time over rays",
            [ratio / compared.ray_ratio(picture) for ratio in compared.time_ratios(picture)],
            aim=PAPER_AIM,
            at_least=True,
            note=f"{job.many} samples; {compared.ray_ratio(picture):.2f} times fewer rays; map built anew",
        )
        for picture in compared.reduced
    )


def screen_rows(job: Job) -> tuple[Row, ...]:
    """The tracing stage on a screen of the same size in centimetres with ten times the pixels."""
    display, gaze = job.request.display, job.request.gaze
    across, down = (
        published.LARGE_SCREEN.width_px / published.SCREEN.width_px,
        published.LARGE_SCREEN.height_px / published.SCREEN.height_px,
    )
    height_cm = display.pitch_y_cm * display.height_px
    large = replace(
        display,
        width_px=round(display.width_px * across),
        height_px=round(display.height_px * down),
        height_cm=height_cm,
    )
    requests = (job.request, replace(job.request, display=large, gaze=Gaze(gaze.x * across, gaze.y * down)))
    ratios, rays = [], []
    for _ in range(job.heavy_repeats):
        trace_ms = []
        for request in requests:
            job.renderer.forget_samples()
            cost = job.renderer.render(job.prepared, request).cost
            trace_ms.append(cost.time_ms.trace)
            rays.append(cost.rays.total)
        ratios.append(trace_ms[1] / trace_ms[0])
    what = f"trace at {large.width_px}x{large.height_px} / {display.width_px}x{display.height_px}"
    note = f"{large.pixels / display.pixels:.1f} times the pixels, {rays[1] / rays[0]:.2f} times the rays"
    return (measured_row("pixels", what, ratios, aim=LARGE_AIM, note=note),)
