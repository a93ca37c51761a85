"""How far a frame is from its reference, by measures that need nothing but numpy, in linear light."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.accuracy.record import Accuracy
from renderer.store import LUMINANCE

DARKEST: Final = 1e-2
"""Squared luminance added to the reference's, so that dark pixels do not count for more than all others."""


def plain_measures(
    frame: NDArray[np.float32], reference: NDArray[np.float32], exposure: float, fovea: NDArray[np.bool_]
) -> Accuracy:
    """Every measure but those of other packages.

    Args:
        frame, reference: (h, w, 3) linear radiance.
        exposure: factor from radiance to what the screen shows, 0 to 1; beyond, it is clipped.
        fovea: (h, w), which pixels are in it; none where it is off the screen.

    Raises:
        ValueError: for pixels that are not finite: no metric may see them, as some hide them.
    """
    for name, pixels in (("frame", frame), ("reference", reference)):
        broken = int(np.count_nonzero(~np.isfinite(pixels).all(axis=2)))
        if broken:
            raise ValueError(f"{name}: expected finite pixels, found {broken} that are not")
    picture, true_picture = shown(frame, exposure), shown(reference, exposure)
    light, true_light = picture @ LUMINANCE, true_picture @ LUMINANCE
    error = light - true_light
    true_mean = float(true_light.mean())
    foveal_error = (picture - true_picture)[fovea]
    foveal_rms = _root_mean_square(foveal_error)
    return Accuracy(
        luminance_ratio=float(light.mean()) / true_mean if true_mean > 0.0 else None,
        relative_mse=float(np.mean(error**2 / (true_light**2 + DARKEST))),
        rms=_root_mean_square(error) or 0.0,
        foveal_psnr_db=-20.0 * math.log10(foveal_rms) if foveal_rms else None,
        foveal_max_error=float(np.abs(foveal_error).max()) if foveal_error.size else None,
        foveal_rms=_root_mean_square(error[fovea]),
    )


def shown(radiance: NDArray[np.float32], exposure: float) -> NDArray[np.float64]:
    """What the screen shows of (h, w, 3) linear radiance: float64 linear light, 0 to 1."""
    return np.clip(radiance.astype(np.float64) * exposure, 0.0, 1.0)


def _root_mean_square(values: NDArray[np.float64]) -> float | None:
    return math.sqrt(float(np.mean(values**2))) if values.size else None
