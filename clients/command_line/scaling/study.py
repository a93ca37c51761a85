"""What is asked of the simulation: one large display, and many viewers, on more and more nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from clients.command_line.scaling.frame_on_nodes import bounds, frame_s
from clients.command_line.scaling.rates import Machine, Rates, Work
from clients.command_line.scaling.viewers_on_nodes import flow_at, one_service, own_service
from renderer.cellmap import CellMap, build_cell_map
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.quality import Quality
from renderer.workers import Workers

AVERAGED = 10
"""Frames whose times are averaged."""

GAZE_STEP_SHARE = 1 / 96
"""Move of the gaze between frames, as a share of the screen's width: 20 px of 1920."""


def moving_work(display: Display, quality: Quality, pool: Workers) -> tuple[Work, Work]:
    """A frame of which every cell is traced, and one after a move of the gaze, which traces new cells only.

    Args:
        display: its cells are counted, for a gaze in the middle.
        quality: its map.
        pool: threads.
    """
    middle = Gaze(display.width_px / 2, display.height_px / 2)
    step = Gaze(middle.x + display.width_px * GAZE_STEP_SHARE, middle.y)
    before, after = (
        build_cell_map(quality.map, display, quality.acuity, bucket_of(gaze, quality.gaze_bucket_px), pool)
        for gaze in (middle, step)
    )
    everything = Work(display.pixels, before.cells, quality.samples_per_cell)
    return everything, replace(everything, cells=new_cells(before, after))


def new_cells(before: CellMap, after: CellMap) -> int:
    """Cells of a map that another one has not."""
    names = [(one.side.astype(np.int64) << 32) | (one.x.astype(np.int64) << 16) | one.y for one in (before, after)]
    return int(np.isin(names[1], names[0], assume_unique=True, invert=True).sum())


def display_record(
    name: str, work: Work, rates: Rates, machine: Machine, nodes: Sequence[int], tick: Callable[[], None]
) -> dict[str, Any]:
    """One display: how long a frame takes on so many nodes, and what bounds it.

    Args:
        name: of the kind of frame.
        work: a frame.
        rates, machine: what was measured, and what each node is.
        nodes: that trace, beside the one of the service.
        tick: called after each point.
    """
    points = []
    for count in nodes:
        least = asdict(bounds(work, rates, machine, count))
        took_s = frame_s(work, rates, machine, count, AVERAGED)
        points.append({"nodes": count, "frame_s": took_s, "bounds_s": least})
        tick()
    return {"name": name, "cells": work.cells, "samples": work.samples, "points": points}


def viewers_record(
    name: str, work: Work, viewers: int, rate_hz: float, rates: Rates, machine: Machine, nodes: Sequence[int]
) -> dict[str, Any]:
    """Viewers with a session each: frames a second that each gets of one service, and of a service on each node.

    Args:
        name: of the kind of frame.
        work: a frame of theirs.
        viewers, rate_hz: how many, and the frames a second that each wants.
        rates, machine, nodes: as above.
    """
    points = []
    for count in nodes:
        stations = one_service(work, rates, machine, count)
        one = flow_at(viewers, rate_hz, stations)
        share = -(-viewers // count)
        each = flow_at(share, rate_hz, own_service(work, rates, machine))
        points.append(
            {
                "nodes": count,
                "one_service_hz": one.frames_per_s / viewers,
                "busiest": stations[one.use.index(max(one.use))].name,
                "use": max(one.use),
                "service_each_hz": each.frames_per_s / share,
            }
        )
    return {"name": name, "cells": work.cells, "points": points}
