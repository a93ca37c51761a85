"""How accurate a frame is by its own account: the standard error of its cells' means.

The account is of the error that sampling makes: by how much a cell's mean differs from what endless samples of
that cell would give. What is lost since cells are wider than pixels is not in it.

It is of luminance times exposure, as a share of white, and each sample counts up to white: one ray that hits a
highlight of a thousand times white would otherwise outweigh the rest of the screen, the more samples the worse.
The samples' variance over their number is the squared error of `stochastic` samples, to some percent over some hundred
cells. It bounds that of `regular` ones, and of shadow rays to lights with a size, from above: these are spread so that
they err less.

One sample cannot tell how far off it is. Its cell is judged by its neighbours: by `NEIGHBOURS_SHARE` of the mean
squared difference from those beside, above and below. That is a guess, good to a factor of two, and of a large map
every few cells make it for all: looking around every cell would take a tenth of a frame of one sample each.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.cellmap import CellMap
from renderer.display import Display
from renderer.eccentricity import EyeGeometry, eye_geometry
from renderer.gather import keep, lane_numbers, stretch
from renderer.gaze import Gaze, GazeBucket
from renderer.kernel import formula, kernel
from renderer.lanes import LANES, anywhere, choose, most
from renderer.slots import at_slots
from renderer.store import Samples
from renderer.workers import Workers

FOVEA_DEG = 2.5
"""Half-angle of the fovea around the gaze [deg]."""

ROUNDING_DEG = 0.01
"""What a first, quick look adds to the fovea, so that it leaves out nothing of it."""

NEIGHBOURS_SHARE = 0.25
"""Squared error of a cell's central sample over its mean squared difference from the cells around it. It is 0.5 where
these have nothing to do with each other (each differs from its mean by their common variance, from each other by
twice that), and 0.14 where straight edges between flat areas pass through, of which the centres see all or nothing."""

GUESSED_CELLS = 16_384
"""How many cells of a map, about, make the guess: their mean is then off by some percent, in the fovea by a
tenth at worst of what was tried, and the guess is no better anyway."""

CHUNK_CELLS = 65_536
"""Cells summed together."""


class StatedError(NamedTuple):
    """Standard error of a frame by its own account, as shares of white.

    Attributes:
        rms: root mean square over the screen.
        foveal_rms: over the cells whose centre is within 2.5 deg of the gaze; None where there is none.
        guessed: share of the screen, 0 to 1, whose cells hold one sample and were judged by their neighbours.
    """

    rms: float
    foveal_rms: float | None
    guessed: float

    def within(self, bound: float) -> bool:
        """Whether both errors are known, not guessed, to be at most `bound`."""
        return self.guessed == 0.0 and self.greatest <= bound

    @property
    def greatest(self) -> float:
        """The greater one."""
        return self.rms if self.foveal_rms is None else max(self.rms, self.foveal_rms)


def stated_error(
    display: Display,
    gaze: Gaze,
    cell_map: CellMap,
    slots: NDArray[np.int32],
    samples: Samples,
    exposure: float,
    pool: Workers,
) -> StatedError:
    """The standard error of a frame's linear luminance, by its samples.

    Args:
        display, gaze: where the fovea is.
        cell_map, slots: the cells and their slots in `samples`.
        samples: sums and counts, every cell with at least one sample.
        exposure: factor from radiance to shares of white.
        pool: threads; the sums do not depend on their number.
    """
    eye = eye_geometry(display, Acuity(), GazeBucket(gaze.x, gaze.y, 0))
    chunks = -(-cell_map.cells // CHUNK_CELLS)
    every = 1 + cell_map.cells // GUESSED_CELLS
    sums = np.zeros((chunks, 5, LANES))

    def add(chunk: int) -> None:
        first = chunk * CHUNK_CELLS
        last = min(first + CHUNK_CELLS, cell_map.cells)
        cells = cell_map.x, cell_map.y, cell_map.side
        _sum_errors(eye, *cells, slots, samples, first, last, sums[chunk])
        _sum_guesses(eye, *cells, cell_map.mask, slots, samples, every, first, last, sums[chunk])

    pool.run(add, chunks)
    screen, area, fovea, foveal_area, guessed = (float(total) for total in sums.sum(axis=(0, 2)))
    return StatedError(
        exposure * math.sqrt(screen / area),
        exposure * math.sqrt(fovea / foveal_area) if foveal_area else None,
        guessed / area,
    )


class _Fovea(NamedTuple):
    """Where the fovea looks.

    Attributes:
        left, right, top, bottom: of a rectangle around it [px].
        limit: least squared cosine of its angle to the gaze, times the squared distance of that from the eye [cm2].
    """

    left: float
    right: float
    top: float
    bottom: float
    limit: float


@formula
def _fovea_of(eye: EyeGeometry) -> _Fovea:
    """The fovea on a screen. It reaches farthest outwards, away from where the eye is in front of the screen."""
    from_foot2 = eye.gaze_x * eye.gaze_x + eye.gaze_y * eye.gaze_y
    slant = math.atan(math.sqrt(from_foot2) / eye.distance)
    outer = slant + math.radians(FOVEA_DEG + ROUNDING_DEG)
    reach = eye.distance * (math.tan(outer) - math.tan(slant)) if outer < 0.5 * math.pi else math.inf
    column, row = eye.gaze_x / eye.pitch_x + eye.width_px / 2, eye.gaze_y / eye.pitch_y + eye.height_px / 2
    return _Fovea(
        column - reach / eye.pitch_x,
        column + reach / eye.pitch_x,
        row - reach / eye.pitch_y,
        row + reach / eye.pitch_y,
        math.cos(math.radians(FOVEA_DEG)) ** 2 * (from_foot2 + eye.distance * eye.distance),
    )


@formula
def _may_be_foveal(fovea: _Fovea, column: float, row: float) -> bool:
    """Whether a place of the screen [px] is in the rectangle around the fovea. Numbers or lanes."""
    return (column >= fovea.left) & (column <= fovea.right) & (row >= fovea.top) & (row <= fovea.bottom)


@formula
def _is_foveal(eye: EyeGeometry, fovea: _Fovea, column: float, row: float) -> bool:
    """Whether a place of the screen [px] that may be is within FOVEA_DEG of the gaze. Numbers or lanes."""
    x, y = (column - eye.width_px / 2) * eye.pitch_x, (row - eye.height_px / 2) * eye.pitch_y
    distance2 = eye.distance * eye.distance
    along = x * eye.gaze_x + y * eye.gaze_y + distance2
    return (along > 0.0) & (along * along >= fovea.limit * (x * x + y * y + distance2))


@formula
def _difference_around(
    x: int, y: int, side: int, mean: float, mask: NDArray[np.int32], slots: NDArray[np.int32], samples: Samples
) -> float:
    """Mean squared difference of a cell's mean from those of the cells beside, above and below; 0 if there is none."""
    height, width = mask.shape
    half, total, found = side // 2, 0.0, 0
    for px, py in ((x - 1, y + half), (x + side, y + half), (x + half, y - 1), (x + half, y + side)):
        if px >= 0 and py >= 0 and px < width and py < height:
            slot = slots[mask[py, px]]
            difference = np.float64(samples.shown[slot]) / samples.number[slot] - mean
            total += difference * difference
            found += 1
    return total / found if found > 0 else 0.0


@kernel
def _sum_errors(
    eye: EyeGeometry,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    sides: NDArray[np.int32],
    slots: NDArray[np.int32],
    samples: Samples,
    first: int,
    last: int,
    sums: NDArray[np.float64],
) -> None:
    """Squared error times area and area of cells `first` to `last` - 1, those of cells in the fovea, and the area of
    cells with one sample, whose error is left out, into `sums`, (5, LANES), each of every LANES-th cell.
    """
    shown, square, count = samples.shown, samples.square, samples.number
    fovea = _fovea_of(eye)
    nothing = 0.0 * lane_numbers(first)
    screen, screen_area, foveal, foveal_area, guessed_area = nothing, nothing, nothing, nothing, nothing
    for start in range(first, last, LANES):
        slot, side = stretch(slots, start, last - 1), stretch(sides, start, last - 1)
        number = at_slots(count, slot, slots[start])
        area = choose(lane_numbers(start) < last, 1.0 * side * side, 0.0)
        several = number > 1
        error = nothing
        if anywhere(several):
            mean = at_slots(shown, slot, slots[start]) / number
            variance = most(0.0, at_slots(square, slot, slots[start]) / number - mean * mean) / (number - 1.0)
            error = choose(several, area * variance, 0.0)
        screen = screen + error
        screen_area = screen_area + area
        guessed_area = guessed_area + choose(several, 0.0, area)
        column, row = stretch(x, start, last - 1) + 0.5 * side, stretch(y, start, last - 1) + 0.5 * side
        near = _may_be_foveal(fovea, column, row)
        if anywhere(near):
            near = near & _is_foveal(eye, fovea, column, row)
            foveal = foveal + choose(near, error, 0.0)
            foveal_area = foveal_area + choose(near, area, 0.0)
    keep(sums, 0, screen)
    keep(sums, 1, screen_area)
    keep(sums, 2, foveal)
    keep(sums, 3, foveal_area)
    keep(sums, 4, guessed_area)


@kernel
def _sum_guesses(
    eye: EyeGeometry,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    sides: NDArray[np.int32],
    mask: NDArray[np.int32],
    slots: NDArray[np.int32],
    samples: Samples,
    every: int,
    first: int,
    last: int,
    sums: NDArray[np.float64],
) -> None:
    """Add the squared error times area of cells with one sample. One cell in `every` speaks for the others."""
    fovea = _fovea_of(eye)
    for cell in range(-(-first // every) * every, last, every):
        slot, side = slots[cell], sides[cell]
        if samples.number[slot] > 1:
            continue
        around = _difference_around(x[cell], y[cell], side, np.float64(samples.shown[slot]), mask, slots, samples)
        error = every * NEIGHBOURS_SHARE * around * float(side) * float(side)
        sums[0, 0] += error
        column, row = x[cell] + 0.5 * side, y[cell] + 0.5 * side
        if _may_be_foveal(fovea, column, row) and _is_foveal(eye, fovea, column, row):
            sums[2, 0] += error
