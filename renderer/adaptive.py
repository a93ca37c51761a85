"""Adaptive antialiasing: which cells have enough samples, and which get twice as many.

Every cell gets `FIRST_ROUND` samples. At 4, 8, 16, ... samples it goes on if the standard error of its mean can be
seen on the screen, or if something could have been missed: a feature as bright or as dark as any of the first samples
of the eight squares around it, and its own, which n samples just miss and which so covers up to 1/n of the cell, would
show. The squares around an aligned cell are those of its own side on its own grid, whether they are cells of this
frame or not, so that the decision, like the cell's samples, depends on nothing but the cell.

Stopping by a cell's own samples is biased (Kirk and Arvo 1991): where they happen to agree, it stops with them. What
is around keeps that small: n samples overlook a feature of share p with probability (1 - p)^n, and with the second
rule the mean error this leaves, p (1 - p)^n <= 1/(e n) of the contrast, is below `UNSEEN_CODES` / e codes. Only what
all of the 36 first samples in and around a cell overlook leaves more: p (1 - p)^36 of its contrast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.kernel import kernel
from renderer.slots import aligned_levels, place_in_level
from renderer.store import FIRST_ROUND, LUMINANCE, Samples, SampleStore, Spread
from renderer.tonemap import FIRST_CODES, THRESHOLDS, srgb_code
from renderer.workers import Workers

SEEN_CODES = 2
"""Standard error of a cell's mean, as a difference of 8-bit codes from one error below to one above it, that is
let pass: the mean is then good to a code or so."""

UNSEEN_CODES = 8
"""Change of a cell's 8-bit code by a feature that its samples could just have missed, that is let pass."""

CHUNK_CELLS = 32_768
"""Cells decided on together."""

UNSURE = -1
"""Verdict on a cell some of whose neighbours have not been sampled yet."""


class Squares(NamedTuple):
    """Squares of a screen, be they cells of a map or not.

    Attributes:
        x, y, side: (n,) int32 [px].
        slots: (n,) int32 their slots in a store.
    """

    x: NDArray[np.int32]
    y: NDArray[np.int32]
    side: NDArray[np.int32]
    slots: NDArray[np.int32]


class Verdicts:
    """Decides about the cells of one map in one store.

    Attributes:
        number: (slots,) int32 samples in each slot of the store.
        shape: height and width of the screen [px].
    """

    def __init__(
        self, cell_map: CellMap, slots: NDArray[np.int32], store: SampleStore, exposure: float, pool: Workers
    ) -> None:
        self._map = cell_map
        self._slots = slots
        self._store = store
        self._exposure = np.float32(exposure)
        self._pool = pool
        self.number = store.samples.number
        self.shape = cell_map.mask.shape

    def next_round(self, chosen: NDArray[np.int32], wanted: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """How many samples cells are to have after the next round.

        Args:
            chosen: (c,) int32 cells.
            wanted: most samples of a cell for now.

        Returns:
            (c,) int32 numbers of samples; no more than they have for cells that are settled, which is noted in
            the store; -1 for those whose neighbours have to be sampled first: (u,) int32.
        """
        until = np.zeros(len(chosen), dtype=np.int32)
        cell_map, store = self._map, self._store

        def decide(chunk: int) -> None:
            part = slice(chunk * CHUNK_CELLS, (chunk + 1) * CHUNK_CELLS)
            _decide(
                store.samples, store.spread, cell_map.x, cell_map.y, cell_map.side, self._slots, cell_map.mask,
                cell_map.kind == "scanline", chosen[part], wanted, self._exposure, THRESHOLDS, FIRST_CODES, until[part],
            )  # fmt: skip

        self._pool.run(decide, -(-len(chosen) // CHUNK_CELLS))
        return until, chosen[until == UNSURE]


def neighbours_lacking(
    squares: Squares, cells: NDArray[np.int32], shape: tuple[int, ...], number: NDArray[np.int32]
) -> Squares:
    """The aligned squares around some aligned cells that lack samples of the first round.

    Args:
        squares: the cells of a map.
        cells: (c,) int32 some of them.
        shape: height and width of the screen [px].
        number: (slots,) int32 samples in each slot.
    """
    height, width = shape
    steps = np.array([-1, 0, 1], dtype=np.int32)
    side = squares.side[cells][:, None, None]
    x, y, side = np.broadcast_arrays(
        squares.x[cells][:, None, None] + steps * side, squares.y[cells][:, None, None] + steps[:, None] * side, side
    )
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    x, y, side = x[inside], y[inside], side[inside]
    sides, starts = aligned_levels(width, height)
    level = np.searchsorted(sides, side)
    every_slot = (starts[level] + place_in_level(width, side, y // side, x // side)).astype(np.int32)
    slots, once = np.unique(every_slot, return_index=True)
    lacking = number[slots] < FIRST_ROUND
    return Squares(x[once][lacking], y[once][lacking], side[once][lacking], slots[lacking])


@kernel
def _decide(
    samples: Samples,
    spread: Spread,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    sides: NDArray[np.int32],
    slots: NDArray[np.int32],
    mask: NDArray[np.int32],
    by_mask: bool,
    chosen: NDArray[np.int32],
    wanted: int,
    exposure: np.float32,
    thresholds: NDArray[np.float32],
    first_codes: NDArray[np.int32],
    until: NDArray[np.int32],
) -> None:
    """Write how many samples each chosen cell is to have next; see `Verdicts.next_round`."""
    total, squares, count = samples.total, spread.square, samples.number
    lows, highs, settled = spread.low, spread.high, spread.settled
    height, width = mask.shape
    for index in range(len(chosen)):
        cell = chosen[index]
        slot = slots[cell]
        number = count[slot]
        boundary = FIRST_ROUND
        while boundary < number:
            boundary *= 2
        if number < boundary:
            until[index] = min(wanted, boundary)
            continue
        red, green, blue = total[slot, 0], total[slot, 1], total[slot, 2]
        mean = (LUMINANCE[0] * red + LUMINANCE[1] * green + LUMINANCE[2] * blue) / number
        error = np.sqrt(max(0.0, squares[slot] / number - mean * mean) / (number - 1.0))
        above = srgb_code(np.float32(mean + error) * exposure, thresholds, first_codes)
        below = srgb_code(np.float32(mean - error) * exposure, thresholds, first_codes)
        if above - below > SEEN_CODES:
            until[index] = min(wanted, 2 * boundary)
            continue
        side = sides[cell]
        low, high = lows[slot], highs[slot]
        first = slot - place_in_level(width, side, y[cell] // side, x[cell] // side)
        known = True
        for place in range(9):
            right, down = place % 3 - 1, place // 3 - 1
            if by_mask:
                px = x[cell] + (-1 if right < 0 else side // 2 if right == 0 else side)
                py = y[cell] + (-1 if down < 0 else side // 2 if down == 0 else side)
            else:
                px, py = x[cell] + right * side, y[cell] + down * side
            if px < 0 or py < 0 or px >= width or py >= height:
                continue
            beside = slots[mask[py, px]] if by_mask else first + place_in_level(width, side, py // side, px // side)
            if count[beside] < FIRST_ROUND:
                known = False
                break
            low, high = min(low, lows[beside]), max(high, highs[beside])
        now = srgb_code(np.float32(mean) * exposure, thresholds, first_codes)
        above = srgb_code(np.float32(mean + (high - mean) / number) * exposure, thresholds, first_codes)
        below = srgb_code(np.float32(mean - (mean - low) / number) * exposure, thresholds, first_codes)
        if not known:
            until[index] = UNSURE
        elif max(above - now, now - below) > UNSEEN_CODES:
            until[index] = min(wanted, 2 * boundary)
        else:
            until[index] = number
            settled[slot] = 1
