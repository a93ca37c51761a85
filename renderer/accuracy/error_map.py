"""Where a frame differs from its reference, as a picture."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.accuracy.measures import shown
from renderer.store import LUMINANCE

DECADES: Final = 3.0
"""Errors from 10^-3 of white to white itself are told apart."""

RAMP: Final = np.array([(0, 0, 0), (60, 15, 110), (185, 55, 120), (250, 140, 60), (255, 255, 190)], dtype=np.float64)
"""sRGB colours of errors up to 10^-3 and of 1, and evenly between in the logarithm: dark to bright for any eye."""


def error_map(frame: NDArray[np.float32], reference: NDArray[np.float32], exposure: float) -> NDArray[np.uint8]:
    """The absolute error of each pixel's luminance, as the screen shows it, in the colours of `RAMP`.

    Args:
        frame, reference: (h, w, 3) linear radiance.
        exposure: factor from radiance to what the screen shows.

    Returns:
        (h, w, 3) uint8 sRGB.
    """
    error = np.abs((shown(frame, exposure) - shown(reference, exposure)) @ LUMINANCE)
    place = np.clip(1.0 + np.log10(np.maximum(error, 1e-9)) / DECADES, 0.0, 1.0) * (len(RAMP) - 1)
    stops = np.arange(len(RAMP))
    colours = [np.interp(place, stops, RAMP[:, channel]) for channel in range(3)]
    return np.stack(colours, axis=2).round().astype(np.uint8)
