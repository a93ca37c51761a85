"""A simulated eye, for those who have no recording: fixations, saccades and blinks, the same for the same seed.

It looks at random places, mostly near the middle. Saccades follow the main sequence: those of A degrees
take 2.2 * A + 21 milliseconds (Carpenter 1988, "Movements of the Eyes", 2nd edition), along the smoothest
course between two points (minimum jerk, Flash and Hogan 1985), whose peak velocity is 1.875 times the mean.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clients.gaze_trace import GazeTrace

RATE_HZ: Final = 250.0
"""Samples a second."""

SCREEN_DEG: Final = (45.2, 26.4)
"""Angle that the simulated screen spans [deg]: 50 x 28.1 cm from 60 cm away."""

FIXATION_MEDIAN_MS: Final = 280.0
FIXATION_SPREAD: Final = 0.45
"""Fixations last 280 ms in the median, log-normally spread: two thirds from 180 to 440 ms, as in free viewing."""

SACCADE_MS_PER_DEG: Final = 2.2
SACCADE_MS: Final = 21.0

NOISE_DEG: Final = 0.02
DRIFT_DEG_PER_ROOT_S: Final = 0.15
"""A fixating eye trembles by 1.2 arc minutes and wanders a sixth of a degree in a second."""

BLINK_EVERY_MS: Final = 4000.0
BLINK_MS: Final = 150.0
"""Fifteen blinks a minute, on average."""

TARGET_SPREAD: Final = 0.18
TARGET_EDGE: Final = 0.04
"""Where it looks: around the middle with a standard deviation of 18 % of the screen, 4 % off its edges."""


def simulated_gaze(seconds: float, seed: int = 0) -> GazeTrace:
    """A trace of `seconds` seconds, in fractions of the screen."""
    generator = np.random.default_rng(seed)
    samples = math.floor(seconds * RATE_HZ) + 1
    gaze = np.empty((samples, 2))
    events = np.full(samples, "fixation", dtype=object)
    here, filled = np.array([0.5, 0.5]), 0
    while filled < samples:
        still = _fixation(generator, here)[: samples - filled]
        gaze[filled : filled + len(still)] = still
        filled += len(still)
        there = np.clip(generator.normal(0.5, TARGET_SPREAD, 2), TARGET_EDGE, 1 - TARGET_EDGE)
        moving = _saccade(still[-1], there)[: samples - filled]
        gaze[filled : filled + len(moving)] = moving
        events[filled : filled + len(moving)] = "saccade"
        filled += len(moving)
        here = there
    valid = _eyes_open(generator, samples)
    gaze[~valid] = np.nan
    events[~valid] = "blink"
    time_ms = np.arange(samples, dtype=np.float64) * (1e3 / RATE_HZ)
    return GazeTrace(time_ms, gaze[:, 0].copy(), gaze[:, 1].copy(), valid, tuple(events), "fraction")


def _fixation(generator: np.random.Generator, here: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) gaze around one place."""
    lasts_ms = generator.lognormal(math.log(FIXATION_MEDIAN_MS), FIXATION_SPREAD)
    n = max(1, round(lasts_ms * RATE_HZ / 1e3))
    steps = generator.normal(0.0, DRIFT_DEG_PER_ROOT_S / math.sqrt(RATE_HZ), (n, 2))
    tremor = generator.normal(0.0, NOISE_DEG, (n, 2))
    around: NDArray[np.float64] = here + (np.cumsum(steps, axis=0) + tremor) / np.array(SCREEN_DEG)
    return around


def _saccade(here: NDArray[np.float64], there: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) gaze on the way, without its two ends."""
    amplitude_deg = float(np.linalg.norm((there - here) * np.array(SCREEN_DEG)))
    steps = round((SACCADE_MS_PER_DEG * amplitude_deg + SACCADE_MS) * RATE_HZ / 1e3)
    s = np.arange(1, steps)[:, None] / steps
    course: NDArray[np.float64] = here + (there - here) * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return course


def _eyes_open(generator: np.random.Generator, samples: int) -> NDArray[np.bool_]:
    """(samples,) False during blinks."""
    valid = np.ones(samples, dtype=np.bool_)
    shut = round(BLINK_MS * RATE_HZ / 1e3)
    at = generator.exponential(BLINK_EVERY_MS) * RATE_HZ / 1e3
    while at < samples:
        valid[int(at) : int(at) + shut] = False
        at += shut + generator.exponential(BLINK_EVERY_MS) * RATE_HZ / 1e3
    return valid
