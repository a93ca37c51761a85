"""The sample store: what was traced for a cell, kept for later frames of the same view.

An aligned cell is known by its side, column and row, whatever the gaze, so a frame after a move of the
gaze finds most of its cells here. Sums are kept in the order of the samples: a cell that gets its samples
in two frames ends with the same bits as one that got them in one.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from renderer.allocator import HUGE_BYTES, apart, sparse
from renderer.frame import Abandoned
from renderer.kernel import kernel
from renderer.workers import Workers

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue (Rec. 709)."""

BRIGHTEST = np.float32(1e16)
"""Radiance beyond which a sample is cut, so that 4096 of their squares fit in float32."""

FIRST_ROUND = 4
"""Samples that every cell gets before it is decided which ones get more."""

THIN = 8
"""A store with more slots than so many for each cell it is made for is written thinly: a screen of 5400x3900 has 36 for
each cell of a gaze-dependent map. Huge pages would take five times the memory, whose first use made the view's first
frame take three times as long."""

CHUNK_CELLS = 65_536
"""Cells looked up together."""

ABANDON_POLL_S = 0.005
"""How often whoever waits for a store looks whether to go on waiting [s]."""


class Samples(NamedTuple):
    """What is known of cells, one slot each; the sums of a cell without samples are anything.

    Attributes:
        total: (n, 3) float32 sum of the radiance of its samples.
        shown: (n,) float32 sum of the luminance of its samples, of each no more than white.
        square: (n,) float32 sum of the squares of these.
        number: (n,) int32 how many samples.
        colour: (n,) int32 what the screen last showed for them, see `reconstruction`; 0 where that has to be made anew.
    """

    total: NDArray[np.float32]
    shown: NDArray[np.float32]
    square: NDArray[np.float32]
    number: NDArray[np.int32]
    colour: NDArray[np.int32]


class Spread(NamedTuple):
    """What decides whether cells get more samples, one slot each; without slots where all get equally many.

    Attributes:
        low, high: (n,) float32 least and greatest luminance among the first `FIRST_ROUND` samples.
        square: (n,) float32 sum of the squared luminance of its samples.
        settled: (n,) uint8: 1 for a cell that needs no more samples.
    """

    low: NDArray[np.float32]
    high: NDArray[np.float32]
    square: NDArray[np.float32]
    settled: NDArray[np.uint8]


class SampleStore:
    """Samples of one view, for one render at a time.

    Attributes:
        samples, spread: what is known of cells.
        white: luminance that the screen shows as white.
    """

    def __init__(self, slots: int, adaptive: bool = False, white: float = math.inf, cells: int | None = None) -> None:
        """Room for `slots` cells; memory is taken from the system only where it is written.

        Args:
            slots: how many there are.
            adaptive: whether it is decided for each cell how many samples it gets.
            white: luminance that the screen shows as white.
            cells: how many it is made for; None for all slots.
        """
        self.white = np.float32(min(white, float(BRIGHTEST)))
        self._lock = threading.Lock()
        thin = cells is not None and cells * THIN < slots
        decided = slots if adaptive else 0
        self.spread = Spread(
            low=_room(decided, np.float32, thin),
            high=_room(decided, np.float32, thin),
            square=_room(decided, np.float32, thin),
            settled=_room(decided, np.uint8, thin),
        )
        self.samples = Samples(
            total=_room(3 * slots, np.float32, thin, zeroed=False).reshape(slots, 3),
            shown=_room(slots, np.float32, thin, zeroed=False),
            square=_room(slots, np.float32, thin, zeroed=False),
            number=_room(slots, np.int32, thin),
            colour=_room(slots, np.int32, thin),
        )

    @contextmanager
    def held(self, abandon: threading.Event | None) -> Iterator[Samples]:
        """Keep other renders out from the first look at the samples to the last.

        Raises:
            Abandoned: if `abandon` is set before the others have left.
        """
        while not self._lock.acquire(timeout=-1 if abandon is None else ABANDON_POLL_S):
            if abandon is not None and abandon.is_set():
                raise Abandoned
        try:
            yield self.samples
        finally:
            self._lock.release()

    @property
    def nbytes(self) -> int:
        """Size in memory when every slot is in use."""
        return sum(array.nbytes for array in (*self.samples, *self.spread))


def _room(length: int, dtype: DTypeLike, thin: bool, zeroed: bool = True) -> NDArray[Any]:
    """(length,) numbers; `thin` if few will be written: then in small pages, as huge ones would mostly lie idle."""
    if thin and length * np.dtype(dtype).itemsize >= HUGE_BYTES:
        return sparse(length, dtype)
    return apart(length, dtype, zeroed)


class Missing(NamedTuple):
    """Cells that lack samples.

    Attributes:
        cells: (m,) int32, rising.
        first: (m,) int32 how many samples each of them has.
        held: samples of all cells that were looked at, missing or not.
        fewest: samples of the cell that has fewest.
    """

    cells: NDArray[np.int32]
    first: NDArray[np.int32]
    held: int
    fewest: int


def missing_cells(store: SampleStore, slots: NDArray[np.int32], wanted: int, pool: Workers) -> Missing:
    """The cells that have fewer than `wanted` samples and are not settled.

    Args:
        store: what they have.
        slots: (n,) int32 slot of each cell, n at least 1.
        wanted: samples a cell.
        pool: threads; the result does not depend on their number.
    """
    cells = np.empty(len(slots), dtype=np.int32)
    first = np.empty(len(slots), dtype=np.int32)
    number, settled = store.samples.number, store.spread.settled
    starts = range(0, len(slots), CHUNK_CELLS)
    counts = np.zeros((len(starts), 3), dtype=np.int64)

    def find(chunk: int) -> None:
        start = starts[chunk]
        part = slice(start, start + CHUNK_CELLS)
        _find_missing(number, settled, slots[part], start, wanted, cells[part], first[part], counts[chunk])

    pool.run(find, len(starts))
    found = 0
    for start, count in zip(starts, counts[:, 0].tolist(), strict=True):
        if found < start:  # nothing to move where all cells lack samples
            for row in (cells, first):
                row[found : found + count] = row[start : start + count]
        found += count
    return Missing(cells[:found], first[:found], int(counts[:, 1].sum()), int(counts[:, 2].min()))


@kernel
def _find_missing(
    number: NDArray[np.int32],
    settled: NDArray[np.uint8],
    slots: NDArray[np.int32],
    first_cell: int,
    wanted: int,
    missing: NDArray[np.int32],
    first: NDArray[np.int32],
    counts: NDArray[np.int64],
) -> None:
    """Write the missing ones of the cells from `first_cell` on, their samples, and number, sum and minimum."""
    found = held = 0
    fewest = np.int32(2**31 - 1)
    for cell in range(len(slots)):
        known = number[slots[cell]]
        held += known
        fewest = min(fewest, known)
        if known < wanted and (len(settled) == 0 or settled[slots[cell]] == 0):
            missing[found] = first_cell + cell
            first[found] = known
            found += 1
    counts[0], counts[1], counts[2] = found, held, fewest


def held_by_number(
    number: NDArray[np.int32], settled: NDArray[np.uint8], slots: NDArray[np.int32], most: int
) -> NDArray[np.float64]:
    """Cells by the number of samples they hold, (most + 1,) float64; those with all they need count as of `most`.

    Args:
        number: (slots,) int32 samples in each slot; empty if nothing was traced yet.
        settled: (slots,) uint8, 1 for a cell that needs no more; empty if there is none.
        slots: (n,) int32 slot of each cell.
        most: samples a cell needs unless it is settled, 1 or more.
    """
    held = np.zeros(most + 1)
    if len(number) == 0:
        held[0] = len(slots)
    else:
        _count_held(number, settled, slots, held)
    return held


@kernel
def _count_held(
    number: NDArray[np.int32], settled: NDArray[np.uint8], slots: NDArray[np.int32], held: NDArray[np.float64]
) -> None:
    most = len(held) - 1
    for cell in range(len(slots)):
        slot = slots[cell]
        done = len(settled) > 0 and settled[slot] != 0
        held[most if done else min(most, number[slot])] += 1.0


@kernel
def add_samples(
    samples: Samples,
    spread: Spread,
    white: np.float32,
    slots: NDArray[np.int32],
    cells: NDArray[np.int32],
    until: NDArray[np.int32],
    radiance: NDArray[np.float32],
) -> tuple[int, int, int]:
    """Add the radiance of the next samples of some cells, in the order of the samples.

    Args:
        samples, spread, white: the store.
        slots: (n,) int32 slot of each cell of the map.
        cells: (c,) int32 cells that were sampled.
        until: (c,) int32 samples each of them has then.
        radiance: (samples, 3) float32, the samples of a cell after one another.

    Returns:
        How many samples were not a number or else negative, and count as black; and how many others were brighter
        than BRIGHTEST, and count as that.
    """
    total, shown, shown_squares, count = samples.total, samples.shown, samples.square, samples.number
    low, high, squares = spread.low, spread.high, spread.square
    decided = len(low) > 0
    not_a_number = negative = too_bright = 0
    row = 0
    for index in range(len(cells)):
        slot = slots[cells[index]]
        red = green = blue = bright = bright_square = np.float32(0.0)
        if count[slot] > 0:
            red, green, blue = total[slot, 0], total[slot, 1], total[slot, 2]
            bright, bright_square = shown[slot], shown_squares[slot]
        square = squares[slot] if decided else np.float32(0.0)
        for sample in range(count[slot], until[index]):
            r, g, b = radiance[row, 0], radiance[row, 1], radiance[row, 2]
            row += 1
            if not (r >= 0.0 and g >= 0.0 and b >= 0.0):
                if r == r and g == g and b == b:
                    negative += 1
                else:
                    not_a_number += 1
                r = g = b = np.float32(0.0)
            elif max(r, max(g, b)) > BRIGHTEST:
                too_bright += 1
                r, g, b = min(r, BRIGHTEST), min(g, BRIGHTEST), min(b, BRIGHTEST)
            luminance = np.float32(LUMINANCE[0]) * r + np.float32(LUMINANCE[1]) * g + np.float32(LUMINANCE[2]) * b
            if sample < FIRST_ROUND and decided:
                low[slot] = min(low[slot], luminance) if sample > 0 else luminance
                high[slot] = max(high[slot], luminance)
            red += r
            green += g
            blue += b
            square += luminance * luminance
            seen = min(luminance, white)
            bright += seen
            bright_square += seen * seen
        total[slot, 0], total[slot, 1], total[slot, 2] = red, green, blue
        shown[slot], shown_squares[slot] = bright, bright_square
        if decided:
            squares[slot] = square
        count[slot] = until[index]
        samples.colour[slot] = 0
    return not_a_number, negative, too_bright
