"""Light: Fresnel's equations near the critical angle, and sums of many samples, in either precision."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.fresnel import fresnel, refracted_cosine
from renderer.kernel import kernel
from renderer.numerics.comparison import Comparison, time_ratio

ANGLES = 200_000
CRITICAL_RAD = float(np.arcsin(1 / 1.5))
CELLS, SAMPLES = 2_000, 4_096


@kernel
def _reflected(cosine: NDArray[np.float64], share: NDArray[np.float64]) -> None:
    """Fresnel's share from within glass of index 1.5."""
    for k in range(len(cosine)):
        share[k] = fresnel(cosine[k], refracted_cosine(cosine[k], 1.5), 1.5)


@kernel
def _reflected_single(cosine: NDArray[np.float32], share: NDArray[np.float64]) -> None:
    """The same with every number a float32, and the radicand as Snell's law is written: 1 - eta^2 sin^2."""
    one, eta, half = np.float32(1.0), np.float32(1.5), np.float32(0.5)
    for k in range(len(cosine)):
        c = cosine[k]
        radicand = one - eta * eta * (one - c * c)
        if radicand <= 0.0:
            share[k] = 1.0
            continue
        bent = np.float32(math.sqrt(radicand))
        parallel = (c - eta * bent) / (c + eta * bent)
        perpendicular = (eta * c - bent) / (eta * c + bent)
        share[k] = half * (parallel * parallel + perpendicular * perpendicular)


@kernel
def _summed(samples: NDArray[np.float32], total: NDArray[Any]) -> None:
    """Sums of the samples of each cell, one after the other, in the precision of `total`."""
    for cell in range(len(total)):
        so_far = total.dtype.type(0.0)
        for k in range(samples.shape[1]):
            so_far += samples[cell, k]
        total[cell] = so_far


def compare_light() -> tuple[Comparison, ...]:
    """Errors of Fresnel's share within 1e-3 rad of the critical angle, and of the mean of 4096 samples."""
    rng = np.random.default_rng(29)
    near = CRITICAL_RAD - 10.0 ** rng.uniform(-7, -3, ANGLES)
    single = np.cos(near).astype(np.float32)
    c = single.astype(np.longdouble)
    bent = np.sqrt(np.maximum(0, 1 - np.longdouble(2.25) * (1 - c) * (1 + c)))
    parts = (c - 1.5 * bent) / (c + 1.5 * bent), (1.5 * c - bent) / (1.5 * c + bent)
    truth = np.where(bent > 0, (parts[0] ** 2 + parts[1] ** 2) / 2, 1)
    double, room = single.astype(np.float64), np.zeros((2, ANGLES))
    _reflected(double, room[0])
    _reflected_single(single, room[1])
    error, single_error = (float(np.abs(share - truth).max()) for share in room)
    ratio = time_ratio(
        functools.partial(_reflected, double, room[0]), functools.partial(_reflected_single, single, room[1])
    )
    boundary = Comparison(
        "glass, up to the critical angle", "largest error of the mirrored share",
        "float64", "float32", error, single_error, ratio,
    )  # fmt: skip
    return boundary, _sums(rng)


def _sums(rng: np.random.Generator) -> Comparison:
    """The sums that are kept are float32: half the memory, for an error far below that of sampling."""
    samples = rng.random((CELLS, SAMPLES), dtype=np.float32)
    exact = samples.astype(np.longdouble).mean(axis=1)
    single, double = np.zeros(CELLS, dtype=np.float32), np.zeros(CELLS)
    ratio = time_ratio(functools.partial(_summed, samples, single), functools.partial(_summed, samples, double))
    error, double_error = (float(np.abs(total / SAMPLES - exact).max()) for total in (single, double))
    return Comparison(
        f"mean of {SAMPLES:,} samples", "largest error of the mean", "float32", "float64", error, double_error, ratio
    )
