"""A real recording, where there is one, and what somebody saw in it."""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import pytest

from clients.bridge.sample import Point
from clients.bridge.screen import Screen
from clients.gaze_trace import GazeTrace, read_gaze_trace

SCREEN = Screen(1920, 1080, 53.3, 30.1, 56.5)
FILE = Path(__file__).parents[4] / "shared" / "data" / "gaze" / "irf_S1_500hz.csv"


class Labelled(NamedTuple):
    """A saccade that somebody marked [ms], and how large it is [deg]."""

    begin_ms: float
    end_ms: float
    amplitude_deg: float


@pytest.fixture(scope="session")
def recorded() -> GazeTrace:
    """The trace."""
    if not FILE.exists():
        pytest.skip(f"there is no recording {FILE.name} beside the checkout")
    return read_gaze_trace(FILE)


def angles(trace: GazeTrace) -> list[Point | None]:
    """Degrees from the screen's middle of each sample, None where the eye was lost."""
    return [
        SCREEN.degrees(sample.x / SCREEN.width_px, sample.y / SCREEN.height_px) if sample.valid else None
        for sample in (trace.sample(index) for index in range(len(trace)))
    ]


def labelled_saccades(trace: GazeTrace, least_deg: float) -> list[Labelled]:
    """Saccades of at least that amplitude."""
    found, at = [], angles(trace)
    for event, run in groupby(range(len(trace)), key=lambda index: trace.events[index]):
        indices = list(run)
        first, last = at[indices[0]], at[indices[-1]]
        if event == "saccade" and first is not None and last is not None:
            amplitude = math.dist(first, last)
            if amplitude >= least_deg:
                found.append(Labelled(trace.time_ms[indices[0]], trace.time_ms[indices[-1]], amplitude))
    return found
