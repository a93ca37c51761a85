"""What settings are held against: the scene at full resolution, from so many samples that little of it is chance.

A setting with n samples a pixel uses samples 0 .. n-1 of each, and so would a reference that began with them:
the error of the setting would come out too small, for 32 of 288 samples by 6 %. The reference therefore leaves out
as many samples as any setting has. (Against the frame of full resolution *with the same samples*, what is lost by
foveation alone would be found; that is the difference of two settings of the grid.)
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.accuracy.record import StandardError
from renderer.frame import Frame, FrameRequest
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality

DEPTH: Final = 16
"""Mirrors and boundaries a ray may meet; by then hardly any weighs enough to change a pixel."""

ROUND: Final = 16
"""Samples a pixel between two steps of a progress bar."""


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceFrame:
    """The reference.

    Attributes:
        radiance: (h, w, 3) float32, linear.
        standard_error: of its luminance.
        seconds: that it took [s].
    """

    radiance: NDArray[np.float32]
    standard_error: StandardError
    seconds: float


def rounds(samples: int, spared: int) -> tuple[int, ...]:
    """How many samples a pixel has after each step, the spared ones first."""
    return (*range(spared, spared + samples, ROUND), spared + samples)


def render_reference(
    renderer: Renderer,
    prepared: PreparedScene,
    view: FrameRequest,
    samples: int,
    spared: int,
    tick: Callable[[], None],
) -> ReferenceFrame:
    """Render the reference.

    Args:
        renderer: its store has to hold the frame (some 32 bytes a pixel), or each step begins anew.
        prepared: the scene.
        view: gaze, display and camera; its quality does not count.
        samples: camera rays a pixel that the reference is the mean of, 2 or more.
        spared: camera rays a pixel before them, which are left out, 1 or more.
        tick: called after each step of `rounds`.
    """
    began = time.perf_counter()
    total = spared + samples
    quality = Quality(map="full", samples_per_cell=total, max_depth=DEPTH)
    request = replace(view, quality=quality, linear=True)
    frames: list[Frame] = []
    for number in rounds(samples, spared):
        frame = renderer.render(prepared, replace(request, samples=number))
        frames = [*frames[:1], frame]
        tick()
    first, last = frames
    mean = (total * last.pixels.astype(np.float64) - spared * first.pixels.astype(np.float64)) / samples
    fewer = math.sqrt(total / samples)
    rms, foveal_rms = last.cost.rms_error, last.cost.foveal_rms_error
    error = StandardError(None if rms is None else rms * fewer, None if foveal_rms is None else foveal_rms * fewer)
    return ReferenceFrame(np.maximum(mean, 0.0).astype(np.float32), error, time.perf_counter() - began)
