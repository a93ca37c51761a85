"""In which order the cells of a map are numbered: that in which they are traced.

The screen is walked tile by tile, a tile strip by strip and a strip group by group, column after column, a group being
GROUP x GROUP of the smallest cells of the tile and a strip STRIP groups high. Rays that are traced side by side then go
more alike than along a row, and what they meet is found in less time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.gather import lane_numbers
from renderer.kernel import formula, kernel
from renderer.lanes import LANES, whole
from renderer.scatter import put, put_stretch

GROUP_BITS = 2
GROUP = 1 << GROUP_BITS
"""Cells along the side of a group: as many in it as rays in a packet of Embree, and as there are lanes."""

STRIP = 3
"""Groups from the top of a strip to its bottom. The smallest tile has two strips of single pixels, and one of squares
of two: strips of a tile are parts of those of the screen, see `slots`."""


@kernel
def number_cells(
    top: int,
    first_cell: int,
    corners: NDArray[np.uint16],
    sides: NDArray[np.uint16],
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    mask: NDArray[np.int32],
) -> None:
    """Number the cells of one row of tiles, tile by tile, and fill the mask.

    Args:
        top: first row of the tiles on the screen.
        first_cell: number of their first cell.
        corners, sides: of `tile_strip`.
        x, y, side: (n,) int32 cell vector of the whole map, written from `first_cell` on.
        mask: (h, w) int32 of the whole map, the tiles' rows written.
    """
    height, width = mask.shape
    rows, columns = corners.shape[1:]
    bottom = min(height, top + rows)
    cell = first_cell
    for tile in range(len(sides)):
        left = tile * columns
        right = min(width, left + columns)
        if sides[tile] > 0:
            cell = _number_grid(top, left, bottom, right, int(sides[tile]), cell, x, y, side, mask)
            continue
        marked, first = corners[tile, : bottom - top, : right - left], cell
        cell = _number_marked(top, left, marked, first, x, y, side)
        for number in range(first, cell):
            mask[y[number] : y[number] + side[number], x[number] : x[number] + side[number]] = number


@formula
def _number_marked(
    top: int,
    left: int,
    corners: NDArray[np.uint16],
    cell: int,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
) -> int:
    """Number the squares of a tile that begin where `corners` say; return the number after the last."""
    rows, columns = corners.shape
    group_px = GROUP * _smallest_side(corners)
    strip_px = STRIP * group_px
    for strip in range(0, rows, strip_px):
        for group_column in range(0, columns, group_px):
            for group_row in range(strip, min(rows, strip + strip_px), group_px):
                for row in range(group_row, min(rows, group_row + group_px)):
                    for column in range(group_column, min(columns, group_column + group_px)):
                        length = int(corners[row, column])
                        if length > 0:
                            x[cell], y[cell], side[cell] = left + column, top + row, length
                            cell += 1
    return cell


@formula
def _smallest_side(corners: NDArray[np.uint16]) -> int:
    """Side of the smallest cell of a tile [px]."""
    smallest = int(corners.shape[0])
    for row in range(corners.shape[0]):
        for column in range(corners.shape[1]):
            if corners[row, column] > 0:
                smallest = min(smallest, int(corners[row, column]))
    return smallest


@formula
def _number_grid(
    top: int,
    left: int,
    bottom: int,
    right: int,
    length: int,
    cell: int,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    mask: NDArray[np.int32],
) -> int:
    """Number the squares of `length` pixels of a tile that is a plain grid; return the number after the last."""
    group_px = GROUP * length
    strip_px = STRIP * group_px
    for strip in range(top, bottom, strip_px):
        for column in range(left, right, group_px):
            across = (min(right, column + group_px) - column) // length
            for row in range(strip, min(bottom, strip + strip_px), group_px):
                down = (min(bottom, row + group_px) - row) // length
                if down == GROUP and across == GROUP:
                    _number_whole_group(row, column, length, cell, x, y, side, mask)
                else:
                    _number_group(row, column, down, across, length, cell, x, y, side, mask)
                cell += down * across
    return cell


@formula
def group_places() -> tuple[Any, Any]:
    """How far right and how far down the cells of a whole group are in it, as many of them as there are lanes."""
    return lane_numbers(0) & GROUP - 1, lane_numbers(0) >> GROUP_BITS


@formula
def _number_whole_group(
    top: int,
    left: int,
    length: int,
    first: int,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    mask: NDArray[np.int32],
) -> None:
    """Number GROUP rows of GROUP squares of `length` pixels."""
    across, down = group_places()
    put(x, first, left + across * length)
    put(y, first, top + down * length)
    put(side, first, length)
    right = left + GROUP * length - 1
    for start in range(left, right + 1, LANES):
        column = whole((lane_numbers(start - left) + 0.5) * (1.0 / length))
        for row in range(GROUP):
            numbers = column + (first + row * GROUP)
            for line in range(top + row * length, top + (row + 1) * length):
                put_stretch(mask[line], start, right, numbers)


@formula
def _number_group(
    top: int,
    left: int,
    down: int,
    across: int,
    length: int,
    first: int,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    mask: NDArray[np.int32],
) -> None:
    """Number `down` rows of `across` squares of `length` pixels."""
    for row in range(down):
        for column in range(across):
            cell = np.uint64(first + row * across + column)
            x[cell], y[cell], side[cell] = left + column * length, top + row * length, length
    for row in range(down):
        for below in range(length):
            line = mask[top + row * length + below]
            for column in range(across):
                for beside in range(length):
                    line[np.uint64(left + column * length + beside)] = first + row * across + column


@kernel
def number_scanline_cells(
    tile_px: int,
    top: int,
    first_cell: int,
    corners: NDArray[np.uint16],
    mask: NDArray[np.int32],
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    numbers: NDArray[np.int32],
) -> None:
    """Number the cells that begin in one row of tiles, tile by tile.

    Args:
        tile_px: side of a tile.
        top: first row of the tiles on the screen.
        first_cell: number of their first cell.
        corners: (h, w) uint16 where the cells of the map begin.
        mask: (h, w) int32 cell of each pixel, in the order in which they were opened.
        x, y, side: (n,) int32 cell vector of the whole map, written from `first_cell` on.
        numbers: (n,) int32 number of each cell, in the order in which they were opened; written.
    """
    cell = first_cell
    for left in range(0, corners.shape[1], tile_px):
        cell = _number_marked(top, left, corners[top : top + tile_px, left : left + tile_px], cell, x, y, side)
    for number in range(first_cell, cell):
        numbers[mask[y[number], x[number]]] = number


@kernel
def renumber(numbers: NDArray[np.int32], mask: NDArray[np.int32]) -> None:
    """Give every pixel of `mask`, (rows, columns) int32, the number of its cell in place of the cell."""
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            mask[row, column] = numbers[mask[row, column]]
