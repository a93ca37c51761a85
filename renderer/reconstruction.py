"""From cells to pixels: each pixel takes its cell's mean, exposed and tone-mapped once a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.gather import keep, pick, stretch
from renderer.kernel import kernel
from renderer.lanes import LANES, anywhere, single
from renderer.slots import at_slots
from renderer.store import Samples
from renderer.tonemap import FIRST_CODES, THRESHOLDS, srgb_code
from renderer.workers import Workers

STRIP_ROWS = 64
"""Rows gathered together [px]."""

STRIP_CELLS = 2048 * LANES
"""Cells averaged together."""

KNOWN = 1 << 24
"""Marks a colour that a cell has: red | green << 8 | blue << 16 is not 0 even where it is black."""


def reconstruct(
    cell_map: CellMap, slots: NDArray[np.int32], samples: Samples, exposure: float, linear: bool, pool: Workers
) -> NDArray[np.uint8] | NDArray[np.float32]:
    """The frame, each pixel the mean of its cell's samples (the paper's reconstruction, `nearest`).

    Args:
        cell_map: the cells.
        slots: (n,) int32 slot of each cell in `samples`.
        samples: sums and counts, every cell with at least one sample; the colours of cells that have none are added.
        exposure: factor from radiance to 0..1, always the same with these samples; not applied to a linear frame.
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
    colours = np.empty((-(-cell_map.cells // LANES), LANES), dtype=np.int32)
    picture = np.empty((height, width, 3), dtype=np.uint8)

    def expose(chunk: int) -> None:
        part = slice(chunk * STRIP_CELLS, (chunk + 1) * STRIP_CELLS)
        rows = slice(part.start // LANES, part.stop // LANES)
        _colours(samples, slots[part], np.float32(exposure), THRESHOLDS, FIRST_CODES, colours[rows])

    def paint(strip: int) -> None:
        part = slice(strip * STRIP_ROWS, (strip + 1) * STRIP_ROWS)
        _gather_colours(cell_map.mask[part], colours.ravel(), picture[part])

    pool.run(expose, chunks)
    pool.run(paint, strips)
    return picture


@kernel
def mean_radiance(samples: Samples, slots: NDArray[np.int32], exposure: np.float32, means: NDArray[np.float32]) -> None:
    """Exposed mean of each cell.

    Args:
        samples: the store.
        slots: (n,) int32 slots of the cells.
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
def _colours(
    samples: Samples,
    slots: NDArray[np.int32],
    exposure: np.float32,
    thresholds: NDArray[np.float32],
    first_codes: NDArray[np.int32],
    colours: NDArray[np.int32],
) -> None:
    """Exposed mean of each cell as KNOWN | red | green << 8 | blue << 16, LANES of them in a row of `colours`.

    After a move of the gaze most cells have theirs from the frame before.
    """
    total, count, held = samples.total, samples.number, samples.colour
    for row in range(len(colours)):
        first = row * LANES
        slot = stretch(slots, first, len(slots) - 1)
        colour = at_slots(held, slot, slots[first])
        if not anywhere(colour == 0):
            keep(colours, row, colour)
            continue
        share = single(np.float64(exposure) * single(1.0 / at_slots(count, slot, slots[first])))
        red = srgb_code(single(pick(total, slot, 0) * share), thresholds, first_codes)
        green = srgb_code(single(pick(total, slot, 1) * share), thresholds, first_codes)
        blue = srgb_code(single(pick(total, slot, 2) * share), thresholds, first_codes)
        keep(colours, row, red + (green + blue * 256) * 256 + KNOWN)
        for lane in range(min(LANES, len(slots) - first)):
            held[slots[first + lane]] = colours[row, lane]


@kernel
def _gather_radiance(mask: NDArray[np.int32], means: NDArray[np.float32], radiance: NDArray[np.float32]) -> None:
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            for channel in range(3):
                radiance[row, column, channel] = means[mask[row, column], channel]


@kernel
def _gather_colours(mask: NDArray[np.int32], colours: NDArray[np.int32], picture: NDArray[np.uint8]) -> None:
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            colour = colours[mask[row, column]]
            picture[row, column, 0] = colour & 0xFF
            picture[row, column, 1] = (colour >> 8) & 0xFF
            picture[row, column, 2] = (colour >> 16) & 0xFF
