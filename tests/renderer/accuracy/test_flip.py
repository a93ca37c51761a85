"""FLIP is asked with our pixels per degree, the reference in its place."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.display import Display

flip = pytest.importorskip("renderer.accuracy.flip", reason="the extra 'report' is not installed")

NEAR = Display(64, 36, 10.0, None, 60.0)


def noise(strength: int) -> NDArray[np.uint8]:
    """Grey with noise from pixel to pixel, (36, 64, 3)."""
    random = np.random.default_rng(1)
    return (128 + strength * random.integers(-1, 2, (36, 64, 1)) + np.zeros(3)).astype(np.uint8)


def test_equal_pictures_differ_in_nothing_and_opposite_ones_in_all() -> None:
    black, white = np.zeros((36, 64, 3), dtype=np.uint8), np.full((36, 64, 3), 255, dtype=np.uint8)
    assert flip.flip_errors(noise(20), noise(20), NEAR) == (0.0, 0.0)
    assert flip.flip_errors(white, black, NEAR).mean > 0.9


def test_more_noise_is_more_visible_and_from_afar_less() -> None:
    weak, strong = (flip.flip_errors(noise(strength), noise(0), NEAR) for strength in (5, 40))
    assert weak.mean < strong.mean < strong.p99 <= 1.0
    far = Display(64, 36, 10.0, None, 300.0)
    assert flip.flip_errors(noise(40), noise(0), far).mean < 0.8 * strong.mean


def test_a_small_bright_spot_is_seen_in_the_99th_percentile() -> None:
    spoiled = noise(0)
    spoiled[16:22, 30:36] = 255
    found = flip.flip_errors(spoiled, noise(0), NEAR)
    assert found.mean < 0.05 < 0.5 < found.p99
