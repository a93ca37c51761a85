"""FLIP: how different two pictures look when one takes the other's place (Andersson et al. 2020).

It sees colour and contrast faults and single bright pixels; it knows no gaze, so a foveated frame scores worse than
it looks, and it hides pixels that are not finite. The only file that knows flip-evaluator, of the extra `report`.
"""

from __future__ import annotations

from typing import NamedTuple

import flip_evaluator
import numpy as np
from numpy.typing import NDArray

from renderer.accuracy.pixels_per_degree import pixels_per_degree
from renderer.display import Display


class FlipErrors(NamedTuple):
    """Over the screen, 0 to 1: mean, and 99th percentile of the pixels."""

    mean: float
    p99: float


def flip_errors(frame: NDArray[np.uint8], reference: NDArray[np.uint8], display: Display) -> FlipErrors:
    """Hold a picture against its reference.

    Args:
        frame, reference: (h, w, 3) uint8 sRGB.
        display: whose pixels per degree decide what the eye blurs.
    """
    found, mean, _ = flip_evaluator.evaluate(
        *(np.ascontiguousarray(pixels, dtype=np.float32) / np.float32(255) for pixels in (reference, frame)),
        "LDR",
        inputsRGB=True,
        applyMagma=False,
        parameters={"ppd": pixels_per_degree(display)},
    )
    return FlipErrors(float(mean), float(np.percentile(found, 99)))
