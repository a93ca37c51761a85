"""Numbers by their bits, and everything else that may stand where a number should."""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
from hypothesis import strategies as st


def _double(bits: int) -> float:
    return float(struct.unpack("<d", struct.pack("<Q", bits))[0])


def _single(bits: int) -> float:
    return float(np.uint32(bits).view(np.float32))


EXTREMES = (
    math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, -5e-324, 2.0**-1022, 2.0**-149, 2.0**-126, 2.0**-150,
    1.7976931348623157e308, 3.4028234663852886e38, 3.5e38, 1e30, 1e16, 1e12, 1e9, 1.0, -1.0, 0.5,
    1.0 + 2.0**-52, 1.0 - 2.0**-53, 1.0 + 2.0**-23, 1.0 - 2.0**-24, 2.0**24 + 1, 2.0**31, 2.0**53, 2.0**63,
)  # fmt: skip

floats = (
    st.sampled_from(EXTREMES)
    | st.integers(0, 2**64 - 1).map(_double)
    | st.integers(0, 2**32 - 1).map(_single)
    | st.integers(1, 2**52 - 1).map(_double)  # below the normal numbers
    | st.integers(0x7FF0000000000001, 0x7FFFFFFFFFFFFFFF).map(_double)  # not a number, with any payload
)
"""Any float64 or float32 there is, the odd ones often."""

integers = st.integers() | st.sampled_from((2**31, -(2**31), 2**63, -(2**63), 2**64, 10**400, -(10**5000)))

anything: st.SearchStrategy[Any] = (
    floats
    | integers
    | st.none()
    | st.booleans()
    | st.text(max_size=4)
    | st.binary(max_size=4)
    | st.sampled_from((1j, object(), {}, {1.0, 2.0, 3.0}, range(3), float, np.bool_(True), np.int64(1), np.float32(1)))
    | st.lists(floats | integers | st.none() | st.text(max_size=1), max_size=4)
    | st.lists(floats, min_size=3, max_size=3).map(tuple)
    | st.lists(floats, min_size=3, max_size=3).map(np.array)
    | st.sampled_from((np.zeros(()), np.zeros((0, 3)), np.zeros((2, 3), dtype=complex), np.array([["a"] * 3] * 3)))
)
"""Whatever may be handed over for anything."""


def around(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of any magnitude within a range, its ends often; and, now and then, one of any bits."""
    within = floats.map(lambda number: number if low <= number <= high else low)
    return st.sampled_from((float(low), float(high))) | within | floats
