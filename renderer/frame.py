"""A finished frame, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.display import Display
from renderer.errors import require_flag, require_integer, require_kind
from renderer.gaze import Gaze
from renderer.quality import Quality


class Abandoned(Exception):
    """A frame that was given up before it was finished; samples already traced are kept."""


@dataclass(frozen=True, slots=True)
class FrameRequest:
    """What to render, besides the scene itself.

    Attributes:
        gaze: where the eye looks [px].
        display: the screen.
        camera: the view; None for the scene's own.
        quality: what it may cost.
        linear: True for float32 linear radiance in place of the 8-bit picture.
        samples: how many of `quality.samples_per_cell` each cell needs by now, 1 or more; None for all of
            them. With fewer, the frame shows all samples that are there already, so that a frame grows from
            request to request and ends as the one that a fresh process would make at once.

    Raises:
        SettingsError: naming the field, for something else in its place or a number of samples out of range.
    """

    gaze: Gaze
    display: Display
    camera: Camera | None
    quality: Quality
    linear: bool = False
    samples: int | None = None

    def __post_init__(self) -> None:
        require_kind("gaze", self.gaze, Gaze)
        require_kind("display", self.display, Display)
        if self.camera is not None:
            require_kind("camera", self.camera, Camera)
        require_kind("quality", self.quality, Quality)
        require_flag("linear", self.linear)
        if self.samples is not None:
            require_integer("samples", self.samples, 1, self.quality.samples_per_cell)


@dataclass(frozen=True, slots=True)
class RayCounts:
    """Rays traced, by kind."""

    primary: int = 0
    shadow: int = 0
    reflection: int = 0
    refraction: int = 0

    @property
    def total(self) -> int:
        """All rays."""
        return self.primary + self.shadow + self.reflection + self.refraction


@dataclass(frozen=True, slots=True)
class RejectedSamples:
    """Samples that are no light, by what they are instead: all 0 unless something is broken.

    Attributes:
        not_a_number, negative: in one of its colours; they count as black.
        too_bright: infinite, or beyond what can be summed up; they count as that bright.
    """

    not_a_number: int = 0
    negative: int = 0
    too_bright: int = 0

    def __add__(self, other: RejectedSamples) -> RejectedSamples:
        """Both together."""
        return RejectedSamples(
            self.not_a_number + other.not_a_number, self.negative + other.negative, self.too_bright + other.too_bright
        )

    @property
    def total(self) -> int:
        """All of them."""
        return self.not_a_number + self.negative + self.too_bright


@dataclass(frozen=True, slots=True)
class StageTimes:
    """Wall-clock time of each stage [ms]."""

    map: float
    trace: float
    reconstruct: float


@dataclass(frozen=True, slots=True)
class FrameCost:
    """What a frame took.

    Attributes:
        map: tiling used.
        cells: cells of the map.
        bucket_px: side of the gaze bucket [px].
        map_cached: whether the map came from the cache.
        samples_per_cell: camera samples that each cell was to have by now.
        samples_traced: camera samples traced for this frame.
        mean_samples: camera samples that the frame shows, a cell on average.
        acuity_scale: factor on the cells' width that was used.
        deadline_ms: time that it was given [ms], None for as much as it takes.
        deadline_promised: whether it was expected to be finished in time when it was planned; None without a deadline.
        deadline_met: whether it was finished in time; None without a deadline.
        max_error: what its stated error was to be at most, None for no bound.
        error_met: whether it is; None without a bound.
        cells_traced, cells_reused: cells traced for this frame, and taken from the sample store as they were.
        rays: rays traced for this frame.
        effects: names of the effects that the scene calls for and that ran.
        effect_reasons: what in the scene calls for each, one line.
        rms_error, foveal_rms_error: estimated standard error of the linear frame, as a share of white, over the
            screen and within 2.5 deg of the gaze (None where no cell is there); see `standard_error`.
        guessed_error: share of the screen, 0 to 1, whose error is a guess, since its cells hold one sample.
        rejected_samples: samples that were no light.
        time_ms: stages.
    """

    map: str
    cells: int
    bucket_px: int
    map_cached: bool
    samples_per_cell: int
    samples_traced: int
    mean_samples: float
    acuity_scale: float
    deadline_ms: float | None
    deadline_promised: bool | None
    deadline_met: bool | None
    max_error: float | None
    error_met: bool | None
    cells_traced: int
    cells_reused: int
    rays: RayCounts
    effects: tuple[str, ...]
    effect_reasons: tuple[str, ...]
    rms_error: float
    foveal_rms_error: float | None
    guessed_error: float
    rejected_samples: RejectedSamples
    time_ms: StageTimes


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """A picture and its cost.

    Attributes:
        pixels: (h, w, 3), uint8 sRGB, or float32 linear Rec.709 radiance where the request says `linear`.
        cost: what it took.
    """

    pixels: NDArray[np.uint8] | NDArray[np.float32]
    cost: FrameCost
