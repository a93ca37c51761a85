"""The weighted mean of four texels."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderer.bilinear import SHIFTS, four_texels
from renderer.gather import entry, keep, lane_numbers
from renderer.kernel import kernel
from renderer.lanes import LANES


@kernel
def means_in_lanes(marks: Any, texels: Any, decoded: Any, places: Any, weights: Any, out: Any) -> None:
    lane = lane_numbers(0)
    a, b, c, d = entry(places[0], lane), entry(places[1], lane), entry(places[2], lane), entry(places[3], lane)
    wa, wb, wc, wd = entry(weights[0], lane), entry(weights[1], lane), entry(weights[2], lane), entry(weights[3], lane)
    means = four_texels(entry(marks, lane) != 0, texels, decoded, a, b, c, d, wa, wb, wc, wd)
    for channel in range(3):
        keep(out, channel, means[channel])


@given(st.integers(0, 2**32 - 1), st.lists(st.booleans(), min_size=LANES, max_size=LANES))
def test_it_is_the_sum_of_the_texels_by_their_weights_where_marked(seed: int, marked: list[bool]) -> None:
    """To the bit, in their order; an unmarked lane is 0 wherever it points, even out of the picture."""
    draw = np.random.default_rng(seed)
    texels = draw.integers(0, 2**32, 50, dtype=np.uint32)
    decoded, weights = draw.normal(size=256), draw.uniform(size=(4, LANES))
    places = np.where(marked, draw.integers(0, 50, (4, LANES)), 2**60)
    out = np.full((3, LANES), np.nan)
    means_in_lanes(np.array(marked, np.int32), texels, decoded, places, weights, out)
    for lane, mark in enumerate(marked):
        for channel, shift in enumerate(SHIFTS):
            codes = [int(texels[place]) >> shift & 255 for place in places[:, lane]] if mark else [0] * 4
            a, b, c, d = (weight * decoded[code] for weight, code in zip(weights[:, lane], codes, strict=True))
            assert out[channel, lane] == (a + b + c + d if mark else 0.0)
