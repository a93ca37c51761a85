"""How many cells a map will have, and how many samples they hold, told from some places of the screen.

Building a map to learn that takes a good part of a frame's time; a look at two thousand pixels does not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.eccentricity import EyeGeometry, cell_size, eye_geometry
from renderer.gaze import GazeBucket
from renderer.kernel import kernel
from renderer.slots import aligned_levels, place_in_level

PROBES_ACROSS = 64
PROBES_DOWN = 36
"""Places looked at: enough to count the cells of a map within some percent."""


def forecast_held(
    display: Display,
    acuity: Acuity,
    bucket: GazeBucket,
    number: NDArray[np.int32],
    settled: NDArray[np.uint8],
    wanted: int,
) -> NDArray[np.float64]:
    """Cells of an aligned map by the number of samples they hold; a scanline map has about as many.

    Args:
        display, acuity, bucket: the screen, the eye and where it looks.
        number: (slots,) int32 samples in each slot of the view's store, empty if nothing was traced yet.
        settled: (slots,) uint8, 1 for a cell that needs no more; empty if there is none.
        wanted: samples a cell needs unless it is settled, 1 or more.

    Returns:
        (wanted + 1,) float64.
    """
    held = np.zeros(wanted + 1)
    sides, starts = aligned_levels(display.width_px, display.height_px)
    eye = eye_geometry(display, acuity, bucket)
    across, down = min(PROBES_ACROSS, display.width_px), min(PROBES_DOWN, display.height_px)
    _probe(eye, sides, starts, number, settled, across, down, held)
    return held


@kernel
def _probe(
    eye: EyeGeometry,
    sides: NDArray[np.int32],
    starts: NDArray[np.int64],
    number: NDArray[np.int32],
    settled: NDArray[np.uint8],
    across: int,
    down: int,
    held: NDArray[np.float64],
) -> None:
    """Add each place's share of a cell, one over the cells' side squared, to `held`."""
    width, height = eye.width_px, eye.height_px
    area = width * height / (across * down)
    most = len(held) - 1
    for row in range(down):
        for column in range(across):
            px, py = (2 * column + 1) * width // (2 * across), (2 * row + 1) * height // (2 * down)
            x, y = (px + 0.5 - width / 2) * eye.pitch_x, (py + 0.5 - height / 2) * eye.pitch_y
            largest = int(cell_size(eye, x, y))
            level = len(sides) - 1
            while level > 0 and (sides[level] > largest or not _fits(eye, px, py, sides[level])):
                level -= 1
            side = int(sides[level])
            known = 0
            if len(number) > 0:
                slot = starts[level] + place_in_level(width, side, py // side, px // side)
                known = most if len(settled) > 0 and settled[slot] != 0 else min(most, number[slot])
            held[known] += area / (side * side)


@kernel
def _fits(eye: EyeGeometry, px: int, py: int, side: int) -> bool:
    """Whether the aligned square of `side` that holds the pixel is on the screen and rho at its corners allows it."""
    left, top = px // side * side, py // side * side
    if left + side > eye.width_px or top + side > eye.height_px:
        return False
    for corner in range(4):
        column = left + (side - 1) * (corner % 2)
        row = top + (side - 1) * (corner // 2)
        x = (column + 0.5 - eye.width_px / 2) * eye.pitch_x
        y = (row + 0.5 - eye.height_px / 2) * eye.pitch_y
        if cell_size(eye, x, y) < side:
            return False
    return True
