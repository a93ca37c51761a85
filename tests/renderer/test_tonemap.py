"""sRGB codes: values of the standard, every code there and back, and the kernel against the plain search."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from renderer.gather import entry, keep, lane_numbers
from renderer.kernel import kernel
from renderer.lanes import LANES, least
from renderer.texture import srgb_to_linear
from renderer.tonemap import FIRST_CODES, THRESHOLDS, encode_srgb, srgb_code
from tests.renderer.texel import srgb_of


@numba.njit
def kernel_codes(
    values: NDArray[np.float32], thresholds: NDArray[np.float32], first_codes: NDArray[np.int32]
) -> NDArray[np.int64]:
    codes = np.zeros(len(values), dtype=np.int64)
    for index in range(len(values)):
        codes[index] = srgb_code(values[index], thresholds, first_codes)
    return codes


@kernel
def codes_in_lanes(
    values: NDArray[np.float32],
    thresholds: NDArray[np.float32],
    first_codes: NDArray[np.int32],
    codes: NDArray[np.int32],
) -> None:
    for row in range(len(codes)):
        value = entry(values, least(lane_numbers(row * LANES), len(values) - 1))
        keep(codes, row, srgb_code(value, thresholds, first_codes))


def test_a_code_is_the_rounded_curve_everywhere() -> None:
    linear = np.random.default_rng(0).random(20_000).astype(np.float32)
    exact = np.array([255 * srgb_of(float(value)) for value in linear])
    assert np.abs(encode_srgb(linear) - exact).max() < 0.5 + 1e-4


def test_every_code_survives_the_way_to_linear_light_and_back() -> None:
    codes = np.arange(256)
    np.testing.assert_array_equal(encode_srgb(srgb_to_linear(codes / 255)), codes)
    np.testing.assert_array_equal(encode_srgb(srgb_to_linear(codes / 255).astype(np.float32)), codes)


def test_codes_are_of_any_shape() -> None:
    assert encode_srgb(np.zeros((3, 4, 3), np.float32)).shape == (3, 4, 3)
    assert encode_srgb(np.zeros((0, 3))).shape == (0, 3)


def test_the_kernel_is_the_plain_search() -> None:
    """A million random values of every size, all thresholds and their neighbours, and what is no number."""
    rng = np.random.default_rng(2)
    bits = rng.integers(0, 2**32, 400_000, dtype=np.uint64).astype(np.uint32).view(np.float32)
    spread = np.exp(rng.uniform(np.log(1e-5), np.log(2), 600_000)).astype(np.float32)
    inf = np.float32(np.inf)
    edges = np.concatenate([THRESHOLDS, np.nextafter(THRESHOLDS, inf), np.nextafter(THRESHOLDS, -inf)])
    octaves = np.float32(2.0) ** np.arange(-149, 128, dtype=np.float32)
    special = np.float32([0, -0.0, -1, np.nan, np.inf, -np.inf, 1, 3.4e38])
    values = np.concatenate([bits, spread, edges, octaves, np.nextafter(octaves, -inf), special])
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(kernel_codes(values, THRESHOLDS, FIRST_CODES), encode_srgb(values))
    codes = np.empty((-(-len(values) // LANES), LANES), dtype=np.int32)
    codes_in_lanes(values, THRESHOLDS, FIRST_CODES, codes)
    np.testing.assert_array_equal(codes.ravel()[: len(values)], encode_srgb(values))
