"""Whether two pictures of one scene agree, and what is left behind where they do not."""

from __future__ import annotations

import os
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.codec import encode
from renderer.tonemap import encode_srgb

BRIGHTENED = 50.0
"""How much brighter than it is the difference is shown."""

SMALLEST_VARIANCE = 1e-4
"""Of one sample: where a few samples happen to agree, their variance says nothing."""

LEVEL = 0.01
"""Chance that two pictures of the same light differ somewhere more than is allowed."""

LARGEST_Z_OF_MEAN = 4.0


def require(found: bool, peer: str) -> None:
    """Skip the test where there is no such renderer; fail it where there has to be one."""
    if found:
        return
    if os.environ.get("GAZETRACE_REQUIRE_PEERS") == "1":
        pytest.fail(f"GAZETRACE_REQUIRE_PEERS is set, and {peer} is not installed")
    pytest.skip(f"{peer} is not installed")


def assert_equal_light(
    ours: NDArray[np.floating], theirs: NDArray[np.float64], within: float, share: float, folder: Path
) -> None:
    """At least `share` of the pixels differ by at most `within` in every channel.

    Args:
        ours, theirs: (h, w, 3) radiance.
        within: largest difference of a pixel that agrees.
        share: of the pixels.
        folder: for pictures, if they differ.
    """
    difference = np.abs(ours - theirs).max(axis=2)
    found = float((difference <= within).mean())
    if not found >= share:
        y, x = np.unravel_index(int(difference.argmax()), difference.shape)
        pytest.fail(
            f"{found:.3%} of the pixels agree to {within:g}, expected {share:.3%}; they differ most in pixel "
            f"({x}, {y}): ours {ours[y, x]}, theirs {theirs[y, x]}; {_pictures(ours, theirs, folder)}"
        )


def assert_consistent(
    ours: NDArray[np.floating],
    theirs: NDArray[np.float64],
    standard_error: NDArray[np.float64],
    samples: int,
    share: float,
    folder: Path,
) -> None:
    """Pixel by pixel, and channel by channel on average, `ours` is what the noisy picture `theirs` may stand for.

    Each value is put to a z-test whose level is spread over all of them (Sidak 1967), which `share` of the
    pixels have to pass. Noise hides a small difference that they all share: the mean of each channel is tested too.

    Args:
        ours, theirs, standard_error: (h, w, 3).
        samples: that the mean `theirs` is of.
        share: of the pixels.
        folder: for pictures, if they differ.
    """
    error = np.sqrt(np.maximum(standard_error**2, SMALLEST_VARIANCE / samples))
    limit = NormalDist().inv_cdf(1.0 - (1.0 - (1.0 - LEVEL) ** (1.0 / error.size)) / 2.0)
    found = float((np.abs(ours - theirs) < limit * error).all(axis=2).mean())
    z_of_mean = (ours - theirs).sum(axis=(0, 1)) / np.sqrt((error**2).sum(axis=(0, 1)))
    if not (found >= share and np.abs(z_of_mean).max() < LARGEST_Z_OF_MEAN):
        pytest.fail(
            f"{found:.3%} of the pixels agree, expected {share:.3%}; the channels differ on average by {z_of_mean} "
            f"standard errors, expected less than {LARGEST_Z_OF_MEAN}; {_pictures(ours, theirs, folder)}"
        )


def _pictures(ours: NDArray[np.floating], theirs: NDArray[np.float64], folder: Path) -> str:
    """Write both and their difference; where they are."""
    shown = {"ours": ours, "theirs": theirs, "difference": BRIGHTENED * np.abs(ours - theirs)}
    for name, picture in shown.items():
        (folder / f"{name}.png").write_bytes(encode(encode_srgb(picture), "png"))
    return f"see ours.png, theirs.png and difference.png (times {BRIGHTENED:g}) in {folder}"
