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

from renderer.accuracy.measures import shown
from renderer.accuracy.record import StandardError
from renderer.accuracy.renders import Renders
from renderer.eccentricity import eccentricity_deg
from renderer.frame import FrameRequest
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.standard_error import FOVEA_DEG
from renderer.store import LUMINANCE

DEPTH: Final = 16
"""Mirrors and boundaries a ray may meet; by then hardly any weighs enough to change a pixel."""

ROUND: Final = 16
"""Samples a pixel between two steps of a progress bar."""


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceFrame:
    """The reference.

    Attributes:
        radiance: (h, w, 3) float32, linear.
        standard_error: of the luminance that the screen shows.
        seconds: that it took [s].
    """

    radiance: NDArray[np.float32]
    standard_error: StandardError
    seconds: float


def rounds(samples: int, spared: int) -> tuple[int, ...]:
    """How many samples a pixel has after each step, the spared ones first; two steps at least for the others."""
    step = min(ROUND, samples // 2)
    return (*range(spared, spared + samples, step), spared + samples)


def render_reference(
    renderer: Renders,
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
    quality = Quality(map="full", samples_per_cell=spared + samples, max_depth=DEPTH)
    request = replace(view, quality=quality, linear=True)
    numbers = rounds(samples, spared)
    middle = numbers[len(numbers) // 2]
    totals: dict[int, NDArray[np.float64]] = {}
    for number in numbers:
        frame = renderer.render(prepared, replace(request, samples=number))
        if number in (numbers[0], middle, numbers[-1]):
            totals[number] = number * frame.pixels.astype(np.float64)
        tick()
    first, half, last = totals[numbers[0]], totals[middle], totals[numbers[-1]]
    radiance = np.maximum((last - first) / samples, 0.0).astype(np.float32)
    early, late = middle - spared, numbers[-1] - middle
    parts = (half - first) / early, (last - half) / late
    error = _standard_error(parts, (early, late), view, prepared.scene.exposure)
    return ReferenceFrame(radiance, error, time.perf_counter() - began)


def _standard_error(
    parts: tuple[NDArray[np.float64], NDArray[np.float64]],
    samples: tuple[int, int],
    view: FrameRequest,
    exposure: float,
) -> StandardError:
    """Of the mean of all samples, by how far the means of its earlier and of its later samples lie apart."""
    earlier, later = (shown(part.astype(np.float32), exposure) @ LUMINANCE for part in parts)
    share = math.sqrt(samples[0] * samples[1]) / sum(samples)
    squares = (share * (earlier - later)) ** 2
    fovea = squares[eccentricity_deg(view.display, view.gaze) <= FOVEA_DEG]
    return StandardError(math.sqrt(float(squares.mean())), math.sqrt(float(fovea.mean())) if fovea.size else None)
