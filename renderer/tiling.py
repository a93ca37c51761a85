"""From cell sizes to cells: the tilings of the screen.

`aligned`: squares of sides 1, 2, 3, 4, 6, 8, 12, 16, ... whose corners lie on multiples of their side;
largest first, a square is taken where rho is at least its side everywhere in it and nothing covers it
yet. Sides 3g and 2g are decided on a grid of units of g pixels, g = ..., 4, 2, 1: all larger squares
cover whole units, so each level looks at one cell of the grid where it would look at g*g pixels.

`scanline` (Siekawa and Mantiuk 2014): in raster order each pixel still uncovered opens a square of side
rho, which takes the uncovered pixels in it.

A *corner* array says where cells begin: the side of the cell at its top-left pixel, 0 elsewhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula, kernel, roomy_kernel

TILE_PX = 32
"""Width of the columns in which cells are numbered, so that neighbours on the screen are near in memory [px]."""


def strip_rows(largest_side: int, height_px: int) -> int:
    """Rows of the horizontal strips that `aligned` can tile one by one, every square being inside one strip.

    A multiple of all sides up to `largest_side`, at least 48 where the screen is that high.
    """
    period = 1
    while period * 2 <= largest_side:
        period *= 2
    period *= 3
    return min(height_px, period * max(1, -(-48 // period)))


@roomy_kernel
def mark_aligned(sizes: NDArray[np.uint16], corners: NDArray[np.uint16]) -> int:
    """Tile one strip: write the corners of its aligned squares into `corners` and return how many there are.

    Args:
        sizes: (rows, w) uint16 rho of its pixels [px].
        corners: (rows, w) uint16, all 0 on entry.
    """
    rows, columns = sizes.shape
    largest = 1
    for row in range(rows):
        for column in range(columns):
            largest = max(largest, int(sizes[row, column]))
    largest = min(largest, rows, columns)
    levels = 1
    while 2 << levels <= largest:
        levels += 1
    floors = [sizes]
    for level in range(1, levels):
        floors.append(_halve(floors[level - 1]))
    covered = np.zeros((1, 1), dtype=np.uint8)
    count = 0
    for level in range(levels - 1, -1, -1):
        floor = floors[level]
        covered = _refine(covered, floor.shape[0], floor.shape[1])
        count += _take_squares(3, 1 << level, floor, covered, corners)
        count += _take_squares(2, 1 << level, floor, covered, corners)
    for row in range(rows):
        for column in range(columns):
            if covered[row, column] == 0:
                corners[row, column] = 1
                count += 1
    return count


@roomy_kernel
def _halve(floor: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Smallest rho of each 2x2 group; groups cut by the edge are left out."""
    rows, columns = floor.shape[0] // 2, floor.shape[1] // 2
    coarse = np.zeros((rows, columns), dtype=np.uint16)
    for row in range(rows):
        for column in range(columns):
            upper = min(floor[2 * row, 2 * column], floor[2 * row, 2 * column + 1])
            lower = min(floor[2 * row + 1, 2 * column], floor[2 * row + 1, 2 * column + 1])
            coarse[row, column] = min(upper, lower)
    return coarse


@roomy_kernel
def _refine(coarse: NDArray[np.uint8], rows: int, columns: int) -> NDArray[np.uint8]:
    """The same coverage on units of half the side; units beyond the coarse grid are uncovered."""
    fine = np.zeros((rows, columns), dtype=np.uint8)
    for row in range(min(coarse.shape[0], (rows + 1) // 2)):
        for column in range(min(coarse.shape[1], (columns + 1) // 2)):
            if coarse[row, column] != 0:
                fine[2 * row : 2 * row + 2, 2 * column : 2 * column + 2] = 1
    return fine


@formula
def _take_squares(
    units: int, unit_px: int, floor: NDArray[np.uint16], covered: NDArray[np.uint8], corners: NDArray[np.uint16]
) -> int:
    """Take every free square of `units` x `units` units whose smallest rho allows it; return their number."""
    side = units * unit_px
    count = 0
    for top in range(0, floor.shape[0] - units + 1, units):
        for left in range(0, floor.shape[1] - units + 1, units):
            free = True
            for row in range(top, top + units):
                for column in range(left, left + units):
                    if floor[row, column] < side or covered[row, column] != 0:
                        free = False
                        break
                if not free:
                    break
            if free:
                covered[top : top + units, left : left + units] = 1
                corners[top * unit_px, left * unit_px] = side
                count += 1
    return count


@kernel
def mark_scanline(sizes: NDArray[np.uint16], corners: NDArray[np.uint16], mask: NDArray[np.int32]) -> int:
    """Tile the whole screen in raster order; write corners, and the cell of each pixel in order of opening.

    Args:
        sizes: (h, w) uint16 rho [px].
        corners: (h, w) uint16, all 0 on entry.
        mask: (h, w) int32, all -1 on entry.

    Returns:
        The number of cells.
    """
    height, width = sizes.shape
    count = 0
    for row in range(height):
        for column in range(width):
            if mask[row, column] >= 0:
                continue
            side = int(sizes[row, column])
            corners[row, column] = side
            for below in range(row, min(height, row + side)):
                for beside in range(column, min(width, column + side)):
                    if mask[below, beside] < 0:
                        mask[below, beside] = count
            count += 1
    return count


@kernel
def number_cells(
    corners: NDArray[np.uint16],
    first_row: int,
    first_cell: int,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    mask: NDArray[np.int32],
) -> None:
    """Number the cells of one strip, column of tiles by column of tiles, and fill the mask.

    Args:
        corners: (rows, w) uint16 of the strip.
        first_row: of the strip on the screen.
        first_cell: number of the strip's first cell.
        x, y, side: (n,) int32 cell vector of the whole map, written from `first_cell` on.
        mask: (h, w) int32 of the whole map, the strip's rows written.
    """
    rows, columns = corners.shape
    cell = first_cell
    for left in range(0, columns, TILE_PX):
        for row in range(rows):
            for column in range(left, min(columns, left + TILE_PX)):
                length = int(corners[row, column])
                if length == 0:
                    continue
                x[cell] = column
                y[cell] = first_row + row
                side[cell] = length
                mask[first_row + row, column] = cell
                if length > 1:
                    for below in range(first_row + row, first_row + row + length):
                        for beside in range(column, column + length):
                            mask[below, beside] = cell
                cell += 1


@kernel
def number_scanline_cells(
    corners: NDArray[np.uint16], x: NDArray[np.int32], y: NDArray[np.int32], side: NDArray[np.int32]
) -> None:
    """Write the cell vector of a scanline map, in the order in which the cells were opened."""
    cell = 0
    for row in range(corners.shape[0]):
        for column in range(corners.shape[1]):
            if corners[row, column] > 0:
                x[cell] = column
                y[cell] = row
                side[cell] = corners[row, column]
                cell += 1
