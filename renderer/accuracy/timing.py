"""Times of settings, measured in turn: every repeat has each of them once, in an order of its own.

A machine whose speed drifts, or which others use too, then slows all settings alike and not those that happened to
be measured last. Every frame is made anew, by a renderer that keeps neither maps nor samples.
"""

from __future__ import annotations

import random
import statistics
from collections.abc import Sequence
from dataclasses import astuple, replace
from typing import Final

from renderer.accuracy.grid import Setting
from renderer.accuracy.record import FrameTime
from renderer.accuracy.renders import Renders
from renderer.frame import FrameRequest, StageTimes
from renderer.prepared import PreparedScene

SEED: Final = 2014
"""Of the orders."""


def turn(settings: Sequence[Setting], repeat: int) -> tuple[Setting, ...]:
    """The settings in the order of one repeat, 0 or more; the same every time."""
    order = list(settings)
    random.Random(f"{SEED}/{repeat}").shuffle(order)
    return tuple(order)


def timed_frame(renderer: Renders, prepared: PreparedScene, view: FrameRequest, setting: Setting) -> StageTimes:
    """What the stages of one frame took, as 8-bit pixels, not encoded.

    Args:
        renderer: one without room for maps and samples, that has rendered before.
        prepared: the scene.
        view: gaze, display and camera.
        setting: the quality.

    Raises:
        ValueError: for a renderer that had some of the frame already.
    """
    cost = renderer.render(prepared, replace(view, quality=setting.quality, linear=False)).cost
    if cost.map_cached or cost.cells_reused:
        raise ValueError(f"{setting.id}: expected a frame made anew, found one that the renderer had in part")
    return cost.time_ms


def frame_time(runs: Sequence[StageTimes]) -> FrameTime:
    """The repeats of one setting, at least one, put together."""
    totals = tuple(sum(astuple(run)) for run in runs)
    return FrameTime(
        median=statistics.median(totals),
        low=min(totals),
        high=max(totals),
        repeats=totals,
        map=statistics.median(run.map for run in runs),
        trace=statistics.median(run.trace for run in runs),
        reconstruct=statistics.median(run.reconstruct for run in runs),
    )
