"""How accurate a frame is by its own account: the standard error of its cells' means."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.cellmap import CellMap
from renderer.display import Display
from renderer.eccentricity import EyeGeometry, eye_geometry
from renderer.gaze import Gaze, GazeBucket
from renderer.kernel import kernel
from renderer.store import LUMINANCE, Samples
from renderer.workers import Workers

FOVEA_DEG = 2.5
"""Half-angle of the fovea around the gaze [deg]."""

CHUNK_CELLS = 65_536
"""Cells summed together."""


def standard_errors(
    display: Display, gaze: Gaze, cell_map: CellMap, slots: NDArray[np.int64], samples: Samples, pool: Workers
) -> tuple[float, float | None]:
    """Root mean square over area of the standard error of the cells' linear luminance.

    Args:
        display, gaze: where the fovea is.
        cell_map, slots: the cells and their slots in `samples`.
        samples: sums and counts, every cell with at least two samples.
        pool: threads; the sums do not depend on their number.

    Returns:
        Over the screen, and over cells whose centre is within 2.5 deg of the gaze; None where there is no
        such cell.
    """
    eye = eye_geometry(display, Acuity(), GazeBucket(gaze.x, gaze.y, 0))
    chunks = -(-cell_map.cells // CHUNK_CELLS)
    sums = np.zeros((chunks, 4))

    def add(chunk: int) -> None:
        part = slice(chunk * CHUNK_CELLS, (chunk + 1) * CHUNK_CELLS)
        _sum_errors(eye, cell_map.x[part], cell_map.y[part], cell_map.side[part], slots[part], samples, sums[chunk])

    pool.run(add, chunks)
    screen, area, fovea, foveal_area = (float(total) for total in sums.sum(axis=0))
    return math.sqrt(screen / area), math.sqrt(fovea / foveal_area) if foveal_area else None


@kernel
def _sum_errors(
    eye: EyeGeometry,
    x: NDArray[np.int32],
    y: NDArray[np.int32],
    side: NDArray[np.int32],
    slots: NDArray[np.int64],
    samples: Samples,
    sums: NDArray[np.float64],
) -> None:
    """Squared error times area and area, over all cells and over those in the fovea, into `sums`, (4,)."""
    total, square, count = samples.total, samples.square, samples.number
    distance2 = eye.distance * eye.distance
    limit = math.cos(math.radians(FOVEA_DEG)) ** 2
    reach = limit * (eye.gaze_x * eye.gaze_x + eye.gaze_y * eye.gaze_y + distance2)
    for cell in range(len(slots)):
        slot = slots[cell]
        n = float(count[slot])
        red, green, blue = total[slot, 0], total[slot, 1], total[slot, 2]
        mean = (LUMINANCE[0] * red + LUMINANCE[1] * green + LUMINANCE[2] * blue) / n
        area = float(side[cell]) * float(side[cell])
        error = max(0.0, square[slot] / n - mean * mean) / (n - 1.0) * area
        sums[0] += error
        sums[1] += area
        px = (x[cell] + 0.5 * side[cell] - eye.width_px / 2) * eye.pitch_x
        py = (y[cell] + 0.5 * side[cell] - eye.height_px / 2) * eye.pitch_y
        along = px * eye.gaze_x + py * eye.gaze_y + distance2
        if along > 0.0 and along * along >= reach * (px * px + py * py + distance2):
            sums[2] += error
            sums[3] += area
