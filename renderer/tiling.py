"""From cell sizes to cells: the tilings of the screen.

`aligned`: squares of sides 1, 2, 3, 4, 6, 8, 12, 16, ... whose corners lie on multiples of their side;
largest first, a square is taken where rho is at least its side everywhere in it and nothing covers it
yet. Sides 3g and 2g are decided on a grid of units of g pixels, g = ..., 4, 2, 1: all larger squares
cover whole units, so each level looks at one cell of the grid where it would look at g*g pixels.

`scanline` (Siekawa and Mantiuk 2014): in raster order each pixel still uncovered opens a square of side
rho, which takes the uncovered pixels in it.

A *corner* array says where cells begin: the side of the cell at its top-left pixel, 0 elsewhere.

The screen is tiled tile by tile, each a square of the screen that no aligned square crosses. Where rho allows the same
squares all over a tile, or a part of it that none crosses, that is a plain grid, and no pixel of it is looked at.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.eccentricity import EyeGeometry, aligned_side, block_size_bounds, fill_cell_sizes
from renderer.kernel import formula, kernel, roomy_kernel

LEAST_TILE_PX = 24
"""Least side of a tile or a part of one [px]: nine tenths of such tiles of a desktop screen are plain grids."""


def tile_side(largest_side: int) -> int:
    """Side of the tiles that can be tiled one by one [px]: a multiple of all aligned sides up to `largest_side`."""
    period = period_of(largest_side)
    return int(period * max(1, -(-LEAST_TILE_PX // period)))


@formula
def period_of(largest_side: int) -> int:
    """Least common multiple of all aligned sides up to `largest_side` (for one or two, a multiple of it) [px]."""
    period = 1
    while period * 2 <= largest_side:
        period *= 2
    return 3 * period


@roomy_kernel
def tile_strip(eye: EyeGeometry, tile_px: int, top: int, corners: NDArray[np.uint16], sides: NDArray[np.uint16]) -> int:
    """Tile one row of tiles and return how many cells it has.

    Args:
        eye: screen and eye.
        tile_px: side of a tile.
        top: first row of the tiles on the screen.
        corners: (tiles, rows, columns) uint16, all 0 on entry, a tile's size or the screen's where that is smaller;
            corners of the tiles that are no plain grid.
        sides: (tiles,) uint16, all 0 on entry; side of the squares of a tile that is a plain grid.
    """
    rows = min(tile_px, eye.height_px - top)
    count = 0
    for tile in range(len(sides)):
        left = tile * tile_px
        columns = min(tile_px, eye.width_px - left)
        whole = rows == tile_px and columns == tile_px
        low, high = block_size_bounds(eye, top, left, tile_px)
        if whole and aligned_side(low) == aligned_side(high):
            sides[tile] = aligned_side(low)
            across = tile_px // sides[tile]
            count += across * across
        else:
            count += _tile_in_parts(eye, tile_px, top, left, corners[tile, :rows, :columns])
    return count


@roomy_kernel
def _tile_in_parts(eye: EyeGeometry, tile_px: int, top: int, left: int, corners: NDArray[np.uint16]) -> int:
    """Tile one tile that is no plain grid and return how many cells it has.

    It is quartered as long as no square of it is so large that it might cross a quarter's edge.

    Args:
        eye, tile_px: of `tile_strip`.
        top, left: first row and column of the tile on the screen.
        corners: (rows, columns) uint16, all 0 on entry.
    """
    rows, columns = corners.shape
    pending = np.zeros((tile_px, 3), dtype=np.int64)
    pending[0, 2] = tile_px
    waiting, count = 1, 0
    while waiting > 0:
        waiting -= 1
        first_row, first_column, side_px = pending[waiting, 0], pending[waiting, 1], pending[waiting, 2]
        last_row, last_column = min(rows, first_row + side_px), min(columns, first_column + side_px)
        whole = last_row - first_row == side_px and last_column - first_column == side_px
        low, high = block_size_bounds(eye, top + first_row, left + first_column, side_px)
        half = side_px // 2
        if whole and aligned_side(low) == aligned_side(high):
            length = aligned_side(low)
            for row in range(first_row, last_row, length):
                for column in range(first_column, last_column, length):
                    corners[row, column] = length
            count += (side_px // length) * (side_px // length)
        elif side_px % 2 == 0 and half >= LEAST_TILE_PX and half % period_of(high) == 0:
            for part in range(4):
                part_row, part_column = first_row + half * (part // 2), first_column + half * (part % 2)
                if part_row < last_row and part_column < last_column:
                    pending[waiting, 0], pending[waiting, 1], pending[waiting, 2] = part_row, part_column, half
                    waiting += 1
        else:
            sizes = np.zeros((last_row - first_row, last_column - first_column), dtype=np.uint16)
            fill_cell_sizes(eye, top + first_row, left + first_column, True, sizes)
            count += mark_aligned(sizes, corners[first_row:last_row, first_column:last_column])
    return count


@roomy_kernel
def mark_aligned(sizes: NDArray[np.uint16], corners: NDArray[np.uint16]) -> int:
    """Tile one tile: write the corners of its aligned squares into `corners` and return how many there are.

    Args:
        sizes: (rows, columns) uint16 rho of its pixels [px].
        corners: (rows, columns) uint16, all 0 on entry.
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
