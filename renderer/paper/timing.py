"""The paper's time ratio: the full picture against gaze-dependent ones, timed in turn on this machine."""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.display import Display
from renderer.frame import FrameRequest, RayCounts
from renderer.gaze import Gaze
from renderer.paper import published
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality

FULL: Final = "full"
PAPER: Final = "paper's map"
OURS: Final = "our default"

QUALITIES: Final[Mapping[str, Quality]] = {
    FULL: replace(published.QUALITY, map="full"),
    PAPER: published.QUALITY,
    OURS: published.OUR_QUALITY,
}
"""What is timed, the full picture first."""

SHUFFLE_SEED: Final = 2014
"""Of the order in which pictures are timed in each round, so that a drift of the machine falls on none of them."""


@dataclass(frozen=True, eq=False, slots=True)
class TimedPicture:
    """One method's picture and what it took, whole frames with nothing kept from before and nothing encoded.

    Attributes:
        name: one of `QUALITIES`.
        cells: of its map.
        rays: traced for one frame.
        repeats_ms: time of each frame, the map with it [ms].
        map_ms: median time of the map [ms].
        rms, foveal_rms: standard error that the frame states; None where it cannot tell.
        pixels: (h, w, 3) uint8 sRGB.
    """

    name: str
    cells: int
    rays: RayCounts
    repeats_ms: tuple[float, ...]
    map_ms: float
    rms: float | None
    foveal_rms: float | None
    pixels: NDArray[np.uint8]

    @property
    def median_ms(self) -> float:
        """Median over the repeats [ms]."""
        return statistics.median(self.repeats_ms)


@dataclass(frozen=True, eq=False, slots=True)
class TimeComparison:
    """The full picture and the gaze-dependent ones of the same scene.

    Attributes:
        display, gaze, samples_per_cell: of all of them.
        threads: they were rendered on.
        full: the full picture.
        reduced: the gaze-dependent ones.
    """

    display: Display
    gaze: Gaze
    samples_per_cell: int
    threads: int
    full: TimedPicture
    reduced: tuple[TimedPicture, ...]

    def camera_ray_ratio(self, picture: TimedPicture) -> float:
        """Camera rays of the full picture over those of `picture`: the paper's ray ratio."""
        return self.full.rays.primary / picture.rays.primary

    def ray_ratio(self, picture: TimedPicture) -> float:
        """The same for rays of all kinds."""
        return self.full.rays.total / picture.rays.total

    def time_ratios(self, picture: TimedPicture) -> tuple[float, ...]:
        """Time of the full picture over that of `picture`, for the frames of each round."""
        return tuple(full / own for full, own in zip(self.full.repeats_ms, picture.repeats_ms, strict=True))


def compare_times(
    renderer: Renderer,
    prepared: PreparedScene,
    display: Display,
    gaze: Gaze,
    samples_per_cell: int,
    repeats: int,
    tick: Callable[[], None] = lambda: None,
) -> TimeComparison:
    """Time the full picture and the gaze-dependent ones in turn, in another order each round.

    Args:
        renderer: its caches are emptied before each frame.
        prepared: the scene.
        display, gaze: the picture.
        samples_per_cell: rays a cell, and a pixel of the full picture.
        repeats: rounds, 1 or more.
        tick: called after each frame.
    """
    requests = {
        name: FrameRequest(gaze, display, None, replace(quality, samples_per_cell=samples_per_cell))
        for name, quality in QUALITIES.items()
    }
    order = list(requests)
    shuffler = random.Random(SHUFFLE_SEED)
    total_ms: dict[str, list[float]] = {name: [] for name in order}
    map_ms: dict[str, list[float]] = {name: [] for name in order}
    frames = {}
    for _ in range(repeats):
        shuffler.shuffle(order)
        for name in order:
            renderer.forget_samples()
            renderer.map_cache.clear()
            began = time.perf_counter()
            frames[name] = renderer.render(prepared, requests[name])
            total_ms[name].append(1e3 * (time.perf_counter() - began))
            map_ms[name].append(frames[name].cost.time_ms.map)
            tick()
    pictures = {
        name: TimedPicture(
            name,
            frame.cost.cells,
            frame.cost.rays,
            tuple(total_ms[name]),
            statistics.median(map_ms[name]),
            frame.cost.rms_error,
            frame.cost.foveal_rms_error,
            np.asarray(frame.pixels, dtype=np.uint8),
        )
        for name, frame in frames.items()
    }
    reduced = tuple(pictures[name] for name in QUALITIES if name != FULL)
    return TimeComparison(display, gaze, samples_per_cell, renderer.threads, pictures[FULL], reduced)
