"""Linear tone mapping: exposure, clip, sRGB transfer, 8 bit (IEC 61966-2-1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.gather import entry
from renderer.kernel import formula
from renderer.lanes import bits, choose
from renderer.texture import srgb_to_linear

SMALLEST_STEP = 0.5 / 255 / 12.92
"""Half the smallest step of an 8-bit sRGB code, in linear light: the least that lifts black to code 1."""

LOWEST_EXPONENT = -13
"""2^-13 is below the first threshold, 0.5/255/12.92."""

FRACTION_BITS, EXPONENT_OF_ONE = 52, 1023
"""Of a float64."""

STEPS_PER_OCTAVE = 256
"""Entries of the table for each power of two: fine enough that none holds two thresholds."""


def _thresholds() -> NDArray[np.float32]:
    """(256,) float32: linear value from which on the code is at least i; code 0 has 0."""
    edges = srgb_to_linear((np.arange(256) - 0.5) / 255)
    edges[0] = 0.0
    return edges.astype(np.float32)


def _first_codes() -> NDArray[np.int32]:
    """Code at the lower end of each table entry; as int32, which lanes read at once."""
    octaves = -LOWEST_EXPONENT
    value = 2.0**LOWEST_EXPONENT * 2.0 ** (np.arange(octaves * STEPS_PER_OCTAVE) // STEPS_PER_OCTAVE)
    value *= 1 + (np.arange(octaves * STEPS_PER_OCTAVE) % STEPS_PER_OCTAVE) / STEPS_PER_OCTAVE
    return (np.searchsorted(THRESHOLDS, value.astype(np.float32), side="right") - 1).astype(np.int32)


THRESHOLDS = _thresholds()
FIRST_CODES = _first_codes()


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """8-bit sRGB codes of linear light, any shape; clipped to [0, 1], NaN becomes 0."""
    clipped = np.clip(np.nan_to_num(np.asarray(linear, dtype=np.float32), nan=0.0), 0.0, 1.0)
    return (np.searchsorted(THRESHOLDS, clipped, side="right") - 1).astype(np.uint8)


@formula
def srgb_code(value: Any, thresholds: NDArray[np.float32], first_codes: NDArray[np.int32]) -> Any:
    """8-bit sRGB code of one linear value: table entry by its exponent and leading bits, then the next threshold.

    Args:
        value: one that float32 can hold, or lanes of such; NaN and negative values become 0.
        thresholds, first_codes: THRESHOLDS and FIRST_CODES.
    """
    lit, white = value >= thresholds[1], value >= thresholds[255]
    between = choose(lit & (value < thresholds[255]), value, thresholds[1])
    code = entry(first_codes, (bits(between) >> FRACTION_BITS - 8) - ((LOWEST_EXPONENT + EXPONENT_OF_ONE) << 8))
    code = code + choose(between >= entry(thresholds, code + 1), 1, 0)
    return choose(white, 255, choose(lit, code, 0))
