"""Where on an area light each shadow ray goes: a scrambled Sobol sequence for each cell and light.

All shadow rays of a cell towards a light take successive points of one sequence, so they are stratified
over the light however many camera samples they are spread over, and whenever the cell gets them. Each
point alone is distributed evenly, which keeps every estimate unbiased.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.kernel import formula, kernel
from renderer.sampling import GOLDEN, TO_UNIT, cell_seed, mix

LOW_WORD = np.uint64(0xFFFFFFFF)


class LightSamples(NamedTuple):
    """What decides the shadow rays of a batch; the arrays may be empty where no area light shines.

    Attributes:
        seed: (samples,) uint64 seed of the cell of each camera sample.
        number: (samples,) int32 its number in the cell.
        each: shadow rays to each area light from what a camera ray meets; what other rays meet sends one.
        depth: mirrors and boundaries met so far.
    """

    seed: NDArray[np.uint64]
    number: NDArray[np.int32]
    each: int
    depth: int


@kernel
def seed_samples(
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    cells: NDArray[np.int32],
    first: NDArray[np.int32],
    until: NDArray[np.int32],
    seed: NDArray[np.uint64],
    number: NDArray[np.int32],
) -> None:
    """Write the seed of the cell of each camera sample and its number there, all samples of a cell in turn.

    Args:
        x, y, side: (n,) int32 cell vector.
        cells: (c,) int32 cells that are sampled.
        first, until: (c,) int32 samples first .. until - 1 of each.
        seed, number: room for all of them, written.
    """
    row = 0
    for index in range(len(cells)):
        cell = cells[index]
        of_cell = cell_seed(x[cell], y[cell], side[cell])
        for sample in range(first[index], until[index]):
            seed[row] = of_cell
            number[row] = sample
            row += 1


@formula
def light_seed(seed: np.uint64, light: int, depth: int) -> np.uint64:
    """Seed of a cell's sequence for one light, as seen from what rays meet after `depth` mirrors."""
    return mix(seed + (np.uint64(light) * np.uint64(64) + np.uint64(depth) + np.uint64(1)) * GOLDEN)


@formula
def light_sample(seed: np.uint64, index: int) -> tuple[float, float]:
    """Point `index` of the sequence: two numbers in (0, 1).

    The first two dimensions of Sobol's sequence, scrambled as Owen does by the hash of Laine and Karras
    (Burley, "Practical Hash-based Owen Scrambling", 2020).
    """
    number = np.uint64(index)
    sobol = np.uint64(0)
    bit = np.uint64(1 << 31)
    rest = number
    while rest != np.uint64(0):
        if rest & np.uint64(1) != np.uint64(0):
            sobol ^= bit
        bit ^= bit >> np.uint64(1)
        rest >>= np.uint64(1)
    u = _reversed(_scrambled(number, seed & LOW_WORD))
    v = _reversed(_scrambled(_reversed(sobol), seed >> np.uint64(32)))
    return (np.float64(u) + 0.5) * TO_UNIT, (np.float64(v) + 0.5) * TO_UNIT


@formula
def _scrambled(word: np.uint64, seed: np.uint64) -> np.uint64:
    """A permutation of 32-bit words in which each bit depends on lower ones alone (Laine and Karras 2011)."""
    word = (word + seed) & LOW_WORD
    word ^= (word * np.uint64(0x6C50B47C)) & LOW_WORD
    word ^= (word * np.uint64(0xB82F1E52)) & LOW_WORD
    word ^= (word * np.uint64(0xC7AFE638)) & LOW_WORD
    word ^= (word * np.uint64(0x8D22F6E6)) & LOW_WORD
    return word


@formula
def _reversed(word: np.uint64) -> np.uint64:
    """The 32 bits of `word` in reverse."""
    word = ((word >> np.uint64(1)) & np.uint64(0x55555555)) | ((word & np.uint64(0x55555555)) << np.uint64(1))
    word = ((word >> np.uint64(2)) & np.uint64(0x33333333)) | ((word & np.uint64(0x33333333)) << np.uint64(2))
    word = ((word >> np.uint64(4)) & np.uint64(0x0F0F0F0F)) | ((word & np.uint64(0x0F0F0F0F)) << np.uint64(4))
    word = ((word >> np.uint64(8)) & np.uint64(0x00FF00FF)) | ((word & np.uint64(0x00FF00FF)) << np.uint64(8))
    return (word >> np.uint64(16)) | ((word & np.uint64(0xFFFF)) << np.uint64(16))
