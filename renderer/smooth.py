"""Smooth reconstruction: cells blend into their neighbours, so that no cell edge shows in the periphery.

Within a cell the colour goes from its mean in the middle to the mean of two cells in the middle of an edge
and of four at a corner, bilinearly. Among cells of one size that is bilinear interpolation between their
centres; where sizes meet, both sides agree at corners and at the middles of edges. A cell of one pixel keeps
its colour, so the fovea is what `nearest` makes of it. All of it happens in linear light.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.kernel import formula, roomy_kernel
from renderer.reconstruction import STRIP_CELLS, mean_radiance
from renderer.store import Samples
from renderer.tonemap import FIRST_CODES, THRESHOLDS, srgb_code
from renderer.workers import Workers

DISPLAY_WHITE = np.float32(1.0)
"""Brightest exposed value: a cell that is clipped blends as white, else a lamp would swallow its surroundings."""


def reconstruct_smooth(
    cell_map: CellMap, slots: NDArray[np.int32], samples: Samples, exposure: float, linear: bool, pool: Workers
) -> NDArray[np.uint8] | NDArray[np.float32]:
    """The frame, the means of cells interpolated over the screen.

    Every pixel lies between the smallest and the largest mean of the cells around it.

    Args:
        cell_map: the cells.
        slots: (n,) int32 slot of each cell in `samples`.
        samples: sums and counts, every cell with at least one sample.
        exposure: factor from radiance to 0..1; not applied to a linear frame.
        linear: float32 radiance in place of 8-bit sRGB.
        pool: threads.

    Returns:
        (h, w, 3) uint8 sRGB, or float32 linear radiance.
    """
    height, width = cell_map.mask.shape
    means = np.empty((cell_map.cells, 3), dtype=np.float32)
    radiance = np.empty((height, width, 3) if linear else (0, 0, 3), dtype=np.float32)
    picture = np.empty((0, 0, 3) if linear else (height, width, 3), dtype=np.uint8)
    factor = np.float32(1.0 if linear else exposure)

    def average(chunk: int) -> None:
        part = slice(chunk * STRIP_CELLS, (chunk + 1) * STRIP_CELLS)
        mean_radiance(samples, slots[part], factor, means[part])
        if not linear:
            np.minimum(means[part], DISPLAY_WHITE, out=means[part])

    def paint(chunk: int) -> None:
        first = chunk * STRIP_CELLS
        last = min(first + STRIP_CELLS, cell_map.cells)
        _paint_cells(
            cell_map.x, cell_map.y, cell_map.side, cell_map.mask, means, first, last, linear, THRESHOLDS, FIRST_CODES,
            radiance, picture,
        )  # fmt: skip

    chunks = -(-cell_map.cells // STRIP_CELLS)
    pool.run(average, chunks)
    pool.run(paint, chunks)
    return radiance if linear else picture


@formula
def _flanks(start: int, length: int, limit: int, pixels: NDArray[np.int32]) -> None:
    """The two pixels at the start, the middle and the end of start .. start + length - 1, inside 0 .. limit - 1.

    Args:
        pixels: (3, 2) int32, written.
    """
    end = start + length
    pixels[0, 0], pixels[0, 1] = max(start - 1, 0), start
    pixels[1, 0], pixels[1, 1] = start + (length - 1) // 2, start + length // 2
    pixels[2, 0], pixels[2, 1] = end - 1, min(end, limit - 1)


@formula
def _set_controls(
    mask: NDArray[np.int32],
    means: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    cell: int,
    controls: NDArray[np.float32],
) -> None:
    """Colours at a cell's corners, the middles of its edges and its centre.

    Args:
        mask, means: the nearest picture.
        rows, columns: (3, 2) int32 of `_flanks`.
        controls: (3, 3, 3) float32 by row, column and channel, written.
    """
    for i in range(3):
        for j in range(3):
            a, b = mask[rows[i, 0], columns[j, 0]], mask[rows[i, 0], columns[j, 1]]
            c, d = mask[rows[i, 1], columns[j, 0]], mask[rows[i, 1], columns[j, 1]]
            for channel in range(3):
                around = (means[a, channel] + means[b, channel]) + (means[c, channel] + means[d, channel])
                controls[i, j, channel] = np.float32(0.25) * around
    for channel in range(3):
        controls[1, 1, channel] = means[cell, channel]


@formula
def _place(index: int, length: int) -> tuple[int, np.float32]:
    """Row of the controls on the near side of pixel `index` of `length`, and how far towards it, 0 to 1."""
    off_center = np.float32(2 * index + 1 - length) / np.float32(length)
    return (0, -off_center) if off_center < 0 else (2, off_center)


@roomy_kernel
def _paint_cells(
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    mask: NDArray[np.int32],
    means: NDArray[np.float32],
    first: int,
    last: int,
    linear: bool,
    thresholds: NDArray[np.float32],
    first_codes: NDArray[np.int32],
    radiance: NDArray[np.float32],
    picture: NDArray[np.uint8],
) -> None:
    """Paint the pixels of cells first .. last - 1 into `radiance` or `picture`."""
    height, width = mask.shape
    rows = np.zeros((3, 2), dtype=np.int32)
    columns = np.zeros((3, 2), dtype=np.int32)
    controls = np.zeros((3, 3, 3), dtype=np.float32)
    for cell in range(first, last):
        left, top = x[cell], y[cell]
        wide, high = min(side[cell], width - left), min(side[cell], height - top)
        blends = side[cell] > 1
        if blends:
            _flanks(left, wide, width, columns)
            _flanks(top, high, height, rows)
            _set_controls(mask, means, rows, columns, cell, controls)
        for i in range(high):
            above, down = _place(i, high)
            for j in range(wide):
                if mask[top + i, left + j] != cell:
                    continue
                beside, across = _place(j, wide)
                for channel in range(3):
                    value = means[cell, channel]
                    if blends:
                        edge = controls[above, 1, channel]
                        value += across * (controls[1, beside, channel] - value)
                        edge += across * (controls[above, beside, channel] - edge)
                        value += down * (edge - value)
                    if linear:
                        radiance[top + i, left + j, channel] = value
                    else:
                        picture[top + i, left + j, channel] = srgb_code(value, thresholds, first_codes)
