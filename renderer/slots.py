"""Where the samples of a cell are kept: aligned squares have a slot each, by side, row and column, whatever the gaze.

The squares of one side have their slots in the order in which cells are numbered, strip by strip and group by group:
the samples of cells that are traced together lie side by side, and few pages of memory hold those of a map.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.allocator import apart
from renderer.cellmap import CellMap
from renderer.gather import along, entry, lane_numbers
from renderer.kernel import formula, kernel, shared
from renderer.lanes import LANES, anywhere
from renderer.numbering import GROUP, STRIP, group_places
from renderer.scatter import put
from renderer.workers import Workers

CHUNK_CELLS = 65_536
"""Cells numbered together."""


def aligned_sides(width: int, height: int) -> NDArray[np.int32]:
    """Sides an aligned square can have on a screen: 1, 2, 3, 4, 6, 8, 12, ... up to its shorter side; int32 [px]."""
    sides = [1]
    for power in range(1, 17):
        sides += [2**power, 3 * 2 ** (power - 1)]
    return np.array(sorted(side for side in sides if side <= min(width, height)), dtype=np.int32)


def aligned_levels(width: int, height: int) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Sides of aligned squares, (l,) int32 [px], and the slot of the first square of each, (l + 1,) int64."""
    sides = aligned_sides(width, height)
    group_px = GROUP * sides.astype(np.int64)
    slots = -(-width // group_px) * GROUP * -(-height // (STRIP * group_px)) * STRIP * GROUP
    return sides, np.concatenate(([0], np.cumsum(slots)))


def aligned_slots(width: int, height: int) -> int:
    """Slots for the aligned squares of all sides on a screen: for every strip of groups as many as it may hold."""
    return int(aligned_levels(width, height)[1][-1])


@shared
def place_in_level(width: int, side: Any, row: Any, column: Any) -> Any:
    """How many slots a square is behind the first of its side. Numbers or arrays.

    Args:
        width: of the screen [px].
        side: of the square [px].
        row, column: where it is among the squares of its side.
    """
    return _place(-(-width // (GROUP * side)), row, column)


@shared
def _place(groups: Any, row: Any, column: Any) -> Any:
    """The same on a screen of so many groups across."""
    strip = STRIP * GROUP
    group_column = row // strip * groups + column // GROUP
    return (group_column * strip + row % strip) * GROUP + column % GROUP


def slots_of(cell_map: CellMap, pool: Workers) -> NDArray[np.int32]:
    """(n,) int32 slot of each cell: by side, row and column for aligned and full maps, else its number."""
    slots = apart(cell_map.cells, np.int32)
    if cell_map.kind == "scanline":
        slots[:] = np.arange(cell_map.cells)
        return slots
    height, width = cell_map.mask.shape
    sides, starts = aligned_levels(width, height)
    first = np.zeros(int(sides[-1]) + 1, dtype=np.int64)
    groups = np.zeros_like(first)
    inverse = np.zeros(len(first), dtype=np.float64)
    first[sides], groups[sides], inverse[sides] = starts[:-1], -(-width // (GROUP * sides)), 1.0 / sides

    def find(chunk: int) -> None:
        part = slice(chunk * CHUNK_CELLS, (chunk + 1) * CHUNK_CELLS)
        _find_slots(cell_map.x[part], cell_map.y[part], cell_map.side[part], first, groups, inverse, slots[part])

    pool.run(find, -(-cell_map.cells // CHUNK_CELLS))
    return slots


def pixel_slots(width: int, height: int) -> NDArray[np.int32]:
    """(width * height,) int32 slots of all squares of one pixel, row by row."""
    column, row = np.arange(width, dtype=np.int32), np.arange(height, dtype=np.int32)
    return np.asarray(place_in_level(width, 1, row[:, None], column), dtype=np.int32).ravel()


@formula
def at_slots(column: NDArray[Any], slot: Any, first: int) -> Any:
    """What a column of a store has for slots in lanes, the first one being `first`: read at once if they follow it."""
    if anywhere(slot != lane_numbers(first)):
        return entry(column, slot)
    return along(column, first, first + LANES - 1)


def slots_needed(cell_map: CellMap) -> int:
    """Number of slots of a store that can hold `cell_map`."""
    if cell_map.kind == "scanline":
        return cell_map.cells
    height, width = cell_map.mask.shape
    return aligned_slots(width, height)


@kernel
def _find_slots(
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    first: NDArray[np.int64],
    groups: NDArray[np.int64],
    inverse: NDArray[np.float64],
    slots: NDArray[np.int32],
) -> None:
    """Write the slots of cells; tables by side hold the first slot, groups across the screen and 1 / side.

    Half a pixel keeps products with the rounded inverse clear of whole numbers, which divisions would be slower at.
    """
    cell = 0
    while cell < len(slots):
        length = int(side[cell])
        row, column = int((y[cell] + 0.5) * inverse[length]), int((x[cell] + 0.5) * inverse[length])
        slot = first[length] + _place(groups[length], row, column)
        if row % GROUP == 0 and column % GROUP == 0 and _is_group(x, y, side, cell):
            put(slots, cell, lane_numbers(slot))
            cell += GROUP * GROUP
        else:
            slots[cell] = slot
            cell += 1


@formula
def _is_group(x: NDArray[np.int32], y: NDArray[np.int32], side: NDArray[np.int32], cell: int) -> bool:
    """Whether the cells from `cell` on are all those of a whole group."""
    last = cell + LANES - 1
    if last >= len(x):
        return False
    across, down = group_places()
    length = int(side[cell])
    other = (along(side, cell, last) != length) | (along(x, cell, last) != x[cell] + across * length)
    return not anywhere(other | (along(y, cell, last) != y[cell] + down * length))
