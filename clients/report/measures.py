"""The measures of accuracy that a report may show: how each is read, and what it does not see."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Final

BEST_JOD: Final = 10.0
"""FovVideoVDP's quality of a frame that equals its reference."""

JOD_SIGMA: Final = 1.4826
"""Standard deviation of a difference of two JODs, so that a drop of 1 is preferred against by 75 % (Perez-Ortiz and
Mantiuk 2017)."""

JND_JOD: Final = 1.0
TARGET_JOD: Final = 0.25
"""A drop that counts as just noticeable in a two-way choice, and the one that we aim below."""


@dataclass(frozen=True, slots=True)
class Measure:
    """One measure of accuracy.

    Attributes:
        key: of the field in a setting's `accuracy`.
        name: for people.
        axis: of its loss, which is plotted: less is better, 0 is equal to the reference.
        sees: what it answers to, and what it is blind to.
    """

    key: str
    name: str
    axis: str
    sees: str

    def loss(self, accuracy: Mapping[str, Any]) -> float | None:
        """What is plotted for a setting; None where it was not measured."""
        found = accuracy.get(self.key)
        if found is None:
            return None
        value = float(found)
        if self.key == "luminance_ratio":
            return abs(value - 1.0)
        if self.key == "jod":
            return max(0.0, BEST_JOD - value)
        if self.key == "foveal_psnr_db":
            return math.pow(10, -value / 20)
        return value


MEASURES: Final = (
    Measure(
        "foveal_rms",
        "error where you look",
        "rms error of luminance within 2.5° of the gaze",
        "Root mean square of the difference from the reference in linear light, where the eye looks. Blind to the rest "
        "of the screen.",
    ),
    Measure(
        "rms",
        "error over the screen",
        "rms error of luminance over the screen",
        "Root mean square of the difference in linear light. It knows no gaze: what the eye cannot see far from the "
        "gaze counts in full.",
    ),
    Measure(
        "relative_mse",
        "relative squared error",
        "mean squared error relative to luminance",
        "Like the error over the screen, but dark places count as much as bright ones. It does not say where the error "
        "is.",
    ),
    Measure(
        "foveal_max_error",
        "largest error where you look",
        "largest difference of a colour within 2.5° of the gaze",
        "The worst pixel where the eye looks; one pixel decides it.",
    ),
    Measure(
        "foveal_psnr_db",
        "PSNR where you look",
        "rms error of colours within 2.5° of the gaze",
        "Peak signal-to-noise ratio where the eye looks, in linear light from 0 to 1, drawn as the error behind it. "
        "Blind to the rest of the screen.",
    ),
    Measure(
        "luminance_ratio",
        "brightness",
        "mean luminance off by (share)",
        "Light that is lost or made up over the whole screen, which metrics of visibility hardly notice. Blind to "
        "where.",
    ),
    Measure(
        "flip_mean",
        "FLIP, mean",
        "FLIP over the screen, mean",
        "What someone sees who flips between both pictures and looks everywhere at once. It knows no gaze, so cells "
        "far from it count against a setting.",
    ),
    Measure(
        "flip_p99",
        "FLIP, worst hundredth",
        "FLIP over the screen, 99th percentile",
        "As the mean, for the worst hundredth of the pixels: single bright pixels, faults of colour and contrast.",
    ),
    Measure(
        "jod",
        "JOD (FovVideoVDP)",
        "JOD lost, of 10",
        "Which of two frames people would prefer, given the true gaze. Blind to brightness and hue, nearly to a wrong "
        "gaze, and to small glaring faults: read it beside the next one.",
    ),
    Measure(
        "jod_heat_foveal_p99",
        "visible difference where you look",
        "FovVideoVDP heat within 5° of the gaze, 99th percentile",
        "The strongest differences that FovVideoVDP expects to be seen near the gaze.",
    ),
)
"""In the order in which they are offered."""

WANTED_FOR: Final[Mapping[str, str]] = {
    "flip_mean": "FLIP wants the package flip-evaluator: pip install 'gazetrace[report]'",
    "jod": "JOD wants the package pyfvvdp (licence CC BY-NC 4.0, non-commercial): pip install 'gazetrace[quality]'",
}
"""What to say where a metric's measures are missing everywhere."""


def jod_words(jod: float) -> str:
    """What a JOD means, as far as it is known: preference against the reference, with the true gaze, not detection."""
    drop = max(0.0, BEST_JOD - jod)
    share = 100 * NormalDist().cdf(drop / JOD_SIGMA)
    said = f"JOD {jod:.3f}: {share:.1f} % would choose the full frame over this one (50 % is guessing)"
    if drop <= TARGET_JOD:
        return f"{said}; below {TARGET_JOD:g} lost, our own target, not a law."
    if drop <= JND_JOD:
        return f"{said}; below one just-noticeable difference in a two-way choice (75 % rule)."
    return f"{said}; more than one just-noticeable difference in a two-way choice (75 % rule)."
