"""Screens, eyes and gazes to try cell maps on, and the cell size computed again, slowly and plainly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.acuity import ECCENTRICITIES, MODELS, Acuity
from renderer.cellmap import CellMap, cell_sizes
from renderer.display import Display
from renderer.gaze import Gaze, GazeBucket

PAPER_SCREEN = Display(1920, 1080, 50.0, 35.0, 60.0)
PAPER_ACUITY = Acuity(eccentricity="paper")

WATSON_MERIDIANS = ((0.9851, 1.058, 22.14), (0.9935, 1.035, 16.35), (0.9729, 1.084, 7.633), (0.9960, 0.9932, 12.13))


def watson_cpd(e: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half of the midgets make a hexagonal lattice of density D that resolves sqrt(D / (2 sqrt(3)))."""
    midgets = [
        2 * 1.12 * 14804.6 * (a * (1 + e / r2) ** -2 + (1 - a) * np.exp(-e / re)) / 1.12 / (1 + e / 41.03)
        for a, r2, re in WATSON_MERIDIANS
    ]
    return np.sqrt(np.max(midgets, axis=0) / 2 / (2 * math.sqrt(3)))


def stela_cpd(e: NDArray[np.float64]) -> NDArray[np.float64]:
    """Read backwards: the eccentricity at which a frequency is just seen has a closed form."""
    cpd = np.geomspace(0.6, 2000, 400_001)
    peak = 1.565 * (1 + 51.19 / 100) ** -0.245
    parabola = 10 ** -(np.log10(cpd / peak) ** 2 / 2**1.12573)
    area = 270 / (1 + (cpd / 0.65) ** 2)
    seen = 65.40 * (1 + 29.83 / 100) ** -0.2038 * np.where(cpd < peak, np.maximum(parabola, 0.9164), parabola)
    seen_to = np.log10(seen * cpd * np.sqrt(area / (1 + area))) / (0.01351 + 0.01713 * cpd)
    falling = slice(np.argmax(seen_to), None)
    found = np.interp(np.minimum(e, 60.0), seen_to[falling][::-1], cpd[falling][::-1])
    return np.asarray(np.minimum(64.0, found))


CUT_OFF_CPD: Mapping[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "peli": lambda e: 43.1 * 3.118 / (3.118 + e),
    "geisler-perry": lambda e: math.log(64) * 2.3 / (0.106 * (e + 2.3)),
    "guenter": lambda e: 1 / (2 * (1.32 / 60 * e + 1 / 48)),
    "watson": watson_cpd,
    "stelacsf": stela_cpd,
}
"""Each model as its authors print it (Peli et al. as in Siekawa and Mantiuk 2014, eq. 2)."""


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


@st.composite
def displays(draw: st.DrawFn, max_width: int = 300, max_height: int = 200) -> Display:
    """Any screen: one pixel or many, tiny or huge, near or far, with pixels that need not be square."""
    odd_sizes = st.sampled_from([(1, 1), (1, 33), (47, 1), (3, 5), (17, 13), (48, 96), (49, 97)])
    sizes = odd_sizes | st.tuples(st.integers(1, max_width), st.integers(1, max_height))
    width, height = draw(sizes.filter(lambda size: size[0] <= max_width and size[1] <= max_height))
    width_cm = draw(st.just(50.0) | powers_of_ten(-3, 3))
    stretch = draw(st.none() | st.floats(0.5, 2) | powers_of_ten(-3, 3))
    height_cm = None if stretch is None else width_cm / width * height * stretch
    distance_cm = draw(powers_of_ten(-2, 2).map(lambda ratio: ratio * width_cm) | powers_of_ten(-8, 8))
    return Display(width, height, width_cm, height_cm, distance_cm)


@st.composite
def gazes(draw: st.DrawFn, display: Display) -> Gaze:
    """On the screen, beside it, or out of sight."""
    far = st.builds(math.copysign, powers_of_ten(0, 30).map(lambda size: min(size, 1e30)), st.sampled_from([-1.0, 1.0]))
    near = st.floats(-1, 2)
    x = draw(near.map(lambda part: part * display.width_px) | st.just(display.width_px / 2) | far)
    y = draw(near.map(lambda part: part * display.height_px) | st.just(display.height_px / 2) | far)
    return Gaze(x, y)


def acuities(margins: st.SearchStrategy[float] | None = None) -> st.SearchStrategy[Acuity]:
    return st.builds(
        Acuity,
        model=st.sampled_from(MODELS),
        eccentricity=st.sampled_from(ECCENTRICITIES),
        scale=st.just(1.0) | powers_of_ten(-3, 3).filter(lambda scale: 1e-3 <= scale <= 1e3),
        margin_deg=st.just(0.0) if margins is None else margins,
    )


def pixel_centres(display: Display, number: type = np.float64) -> tuple[NDArray[Any], NDArray[Any]]:
    """x and y of every pixel's centre from the middle of the screen, (h, w) of type `number` [cm]."""
    x = (np.arange(display.width_px) + number(0.5) - number(display.width_px) / 2) * number(display.pitch_x_cm)
    y = (np.arange(display.height_px) + number(0.5) - number(display.height_px) / 2) * number(display.pitch_y_cm)
    return np.broadcast_arrays(x[None, :], y[:, None])


def point_of(display: Display, gaze: Gaze, number: type = np.float64) -> tuple[Any, Any]:
    """The gaze from the middle of the screen [cm]."""
    x = (number(gaze.x) - number(display.width_px) / 2) * number(display.pitch_x_cm)
    y = (number(gaze.y) - number(display.height_px) / 2) * number(display.pitch_y_cm)
    return x, y


def true_eccentricity(display: Display, gaze: Gaze, kind: str, number: type = np.float64) -> NDArray[Any]:
    """Angle between pixel and gaze, (h, w) of type `number` [deg]; `paper`: for an eye in front of the gaze."""
    x, y = pixel_centres(display, number)
    gaze_x, gaze_y = point_of(display, gaze, number)
    distance = number(display.distance_cm)
    if kind == "paper":
        return np.degrees(np.arctan2(np.hypot(x - gaze_x, y - gaze_y), distance))
    across = np.hypot((y - gaze_y) * distance, (x - gaze_x) * distance)
    turned = x * (gaze_y - y) - y * (gaze_x - x)
    return np.degrees(np.arctan2(np.hypot(across, turned), x * gaze_x + y * gaze_y + distance * distance))


def true_cell_size(display: Display, acuity: Acuity, gaze: Gaze) -> NDArray[np.float64]:
    """alpha / beta of every pixel before it is rounded down, between 1 and the longer side, (h, w) float64 [px].

    beta is the angle between two edges of the pixel on the line towards the point the eye is in front of,
    where a pixel that is not square is an ellipse; the tracker's margin is taken off the eccentricity.
    """
    x, y = pixel_centres(display)
    foot_x, foot_y = point_of(display, gaze) if acuity.eccentricity == "paper" else (0.0, 0.0)
    pitch_x, pitch_y, distance = display.pitch_x_cm, display.pitch_y_cm, display.distance_cm
    columns, rows = (x - foot_x) / pitch_x, (y - foot_y) / pitch_y
    pixels = np.hypot(columns, rows)
    away = np.where(pixels > 0, pixels, 1)
    pitch = 1 / np.where(
        pixels > 0, np.hypot(columns / away / pitch_x, rows / away / pitch_y), 1 / max(pitch_x, pitch_y)
    )
    reach = np.hypot(x - foot_x, y - foot_y)
    beta = np.degrees(np.arctan2(pitch * distance, distance * distance + (reach - pitch / 2) * (reach + pitch / 2)))
    angle = np.maximum(0, true_eccentricity(display, gaze, acuity.eccentricity) - acuity.margin_deg)
    alpha = acuity.scale / (2 * CUT_OFF_CPD[acuity.model](angle))
    return np.clip(alpha / beta, 1, max(display.width_px, display.height_px))


ROUNDING = 1e-6
"""How near alpha / beta may be to an integer for either of its neighbours to be right."""


def sizes_at(display: Display, acuity: Acuity, gaze: Gaze) -> NDArray[np.uint16]:
    return cell_sizes(display, acuity, GazeBucket(gaze.x, gaze.y, 0))


SIDES = sorted({1, *(2**power for power in range(1, 16)), *(3 * 2**power for power in range(15))})
"""Sides an aligned cell can have [px]."""


MARGINS = st.just(0.0) | st.floats(0, 90)


def pixels_of_each(cells: CellMap) -> NDArray[np.int64]:
    """(n,) int64; fails if a label of the mask is no cell."""
    counts = np.bincount(cells.mask.ravel(), minlength=cells.cells)
    assert cells.mask.min() >= 0
    assert len(counts) == cells.cells
    return counts


def full_widths(cells: CellMap) -> NDArray[np.int32]:
    """(h, w) int32: the side of each pixel's cell [px]."""
    return cells.side[cells.mask]
