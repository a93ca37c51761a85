"""From cells to pixels: each pixel takes its cell's mean, exposed and tone-mapped once a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.gather import entry, keep, lane_numbers, pick
from renderer.kernel import kernel
from renderer.lanes import LANES, least, single
from renderer.store import Samples
from renderer.tonemap import FIRST_CODES, THRESHOLDS, srgb_code
from renderer.workers import Workers

STRIP_ROWS = 64
"""Rows gathered together [px]."""

STRIP_CELLS = 2048 * LANES
"""Cells averaged together."""


def reconstruct(
    cell_map: CellMap, slots: NDArray[np.int64], samples: Samples, exposure: float, linear: bool, pool: Workers
) -> NDArray[np.uint8] | NDArray[np.float32]:
    """The frame, each pixel the mean of its cell's samples (the paper's reconstruction, `nearest`).

    Args:
        cell_map: the cells.
        slots: (n,) int64 slot of each cell in `samples`.
        samples: sums and counts, every cell with at least one sample.
        exposure: factor from radiance to 0..1; not applied to a linear frame.
        linear: float32 radiance in place of 8-bit sRGB.
        pool: threads.

    Returns:
        (h, w, 3) uint8 sRGB, or float32 linear radiance.
    """
    height, width = cell_map.mask.shape
    strips = -(-height // STRIP_ROWS)
    chunks = -(-cell_map.cells // STRIP_CELLS)
    if linear:
        means = np.empty((cell_map.cells, 3), dtype=np.float32)
        radiance = np.empty((height, width, 3), dtype=np.float32)

        def average(chunk: int) -> None:
            part = slice(chunk * STRIP_CELLS, (chunk + 1) * STRIP_CELLS)
            mean_radiance(samples, slots[part], np.float32(1.0), means[part])

        def spread(strip: int) -> None:
            part = slice(strip * STRIP_ROWS, (strip + 1) * STRIP_ROWS)
            _gather_radiance(cell_map.mask[part], means, radiance[part])

        pool.run(average, chunks)
        pool.run(spread, strips)
        return radiance
    codes = np.empty((-(-cell_map.cells // LANES), LANES), dtype=np.int32)
    picture = np.empty((height, width, 3), dtype=np.uint8)

    def expose(chunk: int) -> None:
        part = slice(chunk * STRIP_CELLS, (chunk + 1) * STRIP_CELLS)
        rows = slice(part.start // LANES, part.stop // LANES)
        _mean_codes(samples, slots[part], np.float32(exposure), THRESHOLDS, FIRST_CODES, codes[rows])

    def paint(strip: int) -> None:
        part = slice(strip * STRIP_ROWS, (strip + 1) * STRIP_ROWS)
        _gather_codes(cell_map.mask[part], codes.ravel(), picture[part])

    pool.run(expose, chunks)
    pool.run(paint, strips)
    return picture


@kernel
def mean_radiance(samples: Samples, slots: NDArray[np.int64], exposure: np.float32, means: NDArray[np.float32]) -> None:
    """Exposed mean of each cell.

    Args:
        samples: the store.
        slots: (n,) int64 slots of the cells.
        exposure: factor.
        means: (n, 3) float32, written.
    """
    total, count = samples.total, samples.number
    for cell in range(len(slots)):
        slot = slots[cell]
        share = exposure * (np.float32(1.0) / np.float32(count[slot]))
        for channel in range(3):
            means[cell, channel] = total[slot, channel] * share


@kernel
def _mean_codes(
    samples: Samples,
    slots: NDArray[np.int64],
    exposure: np.float32,
    thresholds: NDArray[np.float32],
    first_codes: NDArray[np.int32],
    codes: NDArray[np.int32],
) -> None:
    """Exposed mean of each cell as red | green << 8 | blue << 16, LANES of them in a row of `codes`."""
    total, count = samples.total, samples.number
    for row in range(len(codes)):
        slot = entry(slots, least(lane_numbers(row * LANES), len(slots) - 1))
        share = single(np.float64(exposure) * single(1.0 / entry(count, slot)))
        red = srgb_code(single(pick(total, slot, 0) * share), thresholds, first_codes)
        green = srgb_code(single(pick(total, slot, 1) * share), thresholds, first_codes)
        blue = srgb_code(single(pick(total, slot, 2) * share), thresholds, first_codes)
        keep(codes, row, red + (green + blue * 256) * 256)


@kernel
def _gather_radiance(mask: NDArray[np.int32], means: NDArray[np.float32], radiance: NDArray[np.float32]) -> None:
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            for channel in range(3):
                radiance[row, column, channel] = means[mask[row, column], channel]


@kernel
def _gather_codes(mask: NDArray[np.int32], codes: NDArray[np.int32], picture: NDArray[np.uint8]) -> None:
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            code = codes[mask[row, column]]
            picture[row, column, 0] = code & 0xFF
            picture[row, column, 1] = (code >> 8) & 0xFF
            picture[row, column, 2] = code >> 16
