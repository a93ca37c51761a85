"""From pixels to angles at the eye: eccentricity E, pixel angle beta and cell size rho.

Lengths are centimetres on the screen, relative to its centre, y down. Angles come from atan2 of
lengths, never from acos of a rounded dot product, which is blind to small angles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import Acuity, acuity_model
from renderer.acuity_model import LARGEST_ECCENTRICITY_DEG, STEPS_PER_DEG, unit_angle_table
from renderer.display import Display
from renderer.gaze import Gaze, GazeBucket
from renderer.kernel import formula, kernel, roomy_kernel

DEG_PER_RAD = 180.0 / math.pi

LARGEST_BLOCK_PX = 32
SMALLEST_BLOCK_PX = 4
"""Sides of the blocks whose cell size is decided at once where it does not change [px]."""

LOOSE = 0.1
"""Largest block, relative to its distance, for which its angles are bounded instead of computed."""

ARCSINE_SLACK = 1.002
"""asin(t) <= 1.002 * t for t <= 0.1."""


class EyeGeometry(NamedTuple):
    """One eye, one screen and one bucket of gazes, as plain numbers for the kernels.

    Attributes:
        width_px, height_px: the screen [px].
        pitch_x, pitch_y: one pixel [cm].
        distance: from the eye to the screen [cm].
        gaze_x, gaze_y: centre of the bucket [cm].
        foot_x, foot_y: point of the screen the eye is in front of [cm]: the screen's centre, or the
            gaze in the paper's form (eq. 4).
        half_x, half_y: half the bucket where it moves the foot (paper's form) [cm], else 0.
        sway: how far the tracker's error may move the foot besides (paper's form) [cm], else 0.
        relief_deg: angle by which every eccentricity is understated, so that the cells serve every
            gaze of the bucket and the tracker's error.
        floor_deg, slope: the unit angle as a line in eccentricity, acuity scale included; or its least value, and 0.
        table: (n,) float64, the unit angle [deg] at every 1/64 deg of eccentricity, acuity scale included; None
            where it is a line.
        max_side: largest cell side [px].
    """

    width_px: int
    height_px: int
    pitch_x: float
    pitch_y: float
    distance: float
    gaze_x: float
    gaze_y: float
    foot_x: float
    foot_y: float
    half_x: float
    half_y: float
    sway: float
    relief_deg: float
    floor_deg: float
    slope: float
    table: NDArray[np.float64] | None
    max_side: float


def eye_geometry(display: Display, acuity: Acuity, bucket: GazeBucket) -> EyeGeometry:
    """The numbers the kernels need for `display`, `acuity` and any gaze of `bucket`."""
    pitch_x, pitch_y = display.pitch_x_cm, display.pitch_y_cm
    gaze_x = (bucket.x - display.width_px / 2) * pitch_x
    gaze_y = (bucket.y - display.height_px / 2) * pitch_y
    half_x, half_y = bucket.side_px / 2 * pitch_x, bucket.side_px / 2 * pitch_y
    floor_deg, slope, table = _unit_angles(acuity)
    paper = acuity.eccentricity == "paper"
    reach_deg = 0.0 if paper else _bucket_reach_deg(gaze_x, gaze_y, half_x, half_y, display.distance_cm)
    return EyeGeometry(
        width_px=display.width_px,
        height_px=display.height_px,
        pitch_x=pitch_x,
        pitch_y=pitch_y,
        distance=float(display.distance_cm),
        gaze_x=gaze_x,
        gaze_y=gaze_y,
        foot_x=gaze_x if paper else 0.0,
        foot_y=gaze_y if paper else 0.0,
        half_x=half_x if paper else 0.0,
        half_y=half_y if paper else 0.0,
        sway=display.distance_cm * math.tan(math.radians(acuity.margin_deg)) if paper else 0.0,
        relief_deg=reach_deg + acuity.margin_deg,
        floor_deg=floor_deg,
        slope=slope,
        table=table,
        max_side=float(max(display.width_px, display.height_px)),
    )


def eccentricity_deg(display: Display, gaze: Gaze, kind: str = "exact") -> NDArray[np.float64]:
    """Angle at the eye between the gaze and the centre of each pixel.

    Args:
        display: the screen.
        gaze: where the eye looks [px].
        kind: `exact` or `paper` (Siekawa and Mantiuk 2014, eq. 4).

    Returns:
        (h, w) float64 [deg], 0 to 180.
    """
    eye = eye_geometry(display, Acuity(eccentricity=kind), GazeBucket(gaze.x, gaze.y, 0))
    angles = np.zeros((display.height_px, display.width_px))
    _fill_eccentricities(eye, angles)
    return angles


def largest_cell_side(eye: EyeGeometry) -> int:
    """An upper bound of rho over the whole screen [px].

    The pixel angle is smallest in a corner of the screen. There eccentricity is greatest too, up to a right
    angle; beyond that it may be greater elsewhere, and half a turn is taken.
    """
    reach2 = angle = 0.0
    right, bottom = eye.width_px / 2 * eye.pitch_x, eye.height_px / 2 * eye.pitch_y
    for x in (-right, right):
        for y in (-bottom, bottom):
            angle = max(angle, _eccentricity(eye, x, y))
            reach2 = max(reach2, (x - eye.foot_x) ** 2 + (y - eye.foot_y) ** 2)
    unit = _unit_angle(eye.floor_deg, eye.slope, eye.table, angle if angle <= 90.0 else 180.0)
    beta = _pixel_angle(min(eye.pitch_x, eye.pitch_y), reach2, eye.distance)
    return int(max(1.0, min(eye.max_side, unit / max(beta, 1e-300))))


def _unit_angles(acuity: Acuity) -> tuple[float, float, NDArray[np.float64] | None]:
    """`floor_deg`, `slope` and `table` of an `EyeGeometry`."""
    model = acuity_model(acuity.model)
    if model.line is not None:
        floor_deg, slope = model.line
        return floor_deg * acuity.scale, slope * acuity.scale, None
    return 0.5 / model.limit_cpd * acuity.scale, 0.0, unit_angle_table(model) * acuity.scale


def _bucket_reach_deg(gaze_x: float, gaze_y: float, half_x: float, half_y: float, distance: float) -> float:
    """Largest angle between the bucket's centre and a point of it [deg].

    It is at a corner, since the directions at most a right angle or less away from another meet the screen
    in a convex region; beyond a right angle that fails, and half a turn is the answer.
    """
    reach = 0.0
    for sign_x in (-1, 1):
        for sign_y in (-1, 1):
            corner_x, corner_y = gaze_x + sign_x * half_x, gaze_y + sign_y * half_y
            reach = max(reach, _angle_between(gaze_x, gaze_y, corner_x, corner_y, distance))
    return reach if reach <= 90.0 else 180.0


@formula
def _arc(y: float, x: float) -> float:
    """atan2(y, x) for y >= 0, in radians, without calls or branches so that loops over it vectorise.

    Rational approximation on [0, tan(pi/8)] from Moshier's Cephes library (1984-2000), error below 2 ulp.
    """
    ax = abs(x)
    big = max(ax, y)
    small = min(ax, y)
    ratio = small / big if big > 0.0 else 0.0
    fold = ratio > 0.41421356237309503
    z = (small - big) / (small + big) if fold else ratio
    zz = z * z
    p = -8.750608600031904122785e-1
    p = p * zz - 1.615753718733365076637e1
    p = p * zz - 7.500855792314704667340e1
    p = p * zz - 1.228866684490136173410e2
    p = p * zz - 6.485021904942025371773e1
    q = zz + 2.485846490142306297962e1
    q = q * zz + 1.650270098316988542046e2
    q = q * zz + 4.328810604912902668951e2
    q = q * zz + 4.853903996359136964868e2
    q = q * zz + 1.945506571482613964425e2
    angle = z + z * zz * (p / q)
    angle = angle + 0.7853981633974483 if fold else angle
    angle = 1.5707963267948966 - angle if y > ax else angle
    return 3.141592653589793 - angle if x < 0.0 else angle


@formula
def _angle_between(ax: float, ay: float, bx: float, by: float, distance: float) -> float:
    """Angle at the eye between two points of the screen, both relative to the point it is in front of [deg]."""
    cross_x = (ay - by) * distance
    cross_y = (bx - ax) * distance
    cross_z = ax * by - ay * bx
    cross = math.sqrt(cross_x * cross_x + cross_y * cross_y + cross_z * cross_z)
    return _arc(cross, ax * bx + ay * by + distance * distance) * DEG_PER_RAD


@formula
def _eccentricity(eye: EyeGeometry, x: float, y: float) -> float:
    """Eccentricity of the screen point (x, y) [cm] from the centre of the gaze bucket, or, in the
    paper's form, from the nearest gaze of the bucket [deg].
    """
    near_x = max(0.0, abs(x - eye.foot_x) - eye.half_x)
    near_y = max(0.0, abs(y - eye.foot_y) - eye.half_y)
    in_front = eye.foot_x == eye.gaze_x and eye.foot_y == eye.gaze_y
    if in_front:
        return _arc(math.sqrt(near_x * near_x + near_y * near_y), eye.distance) * DEG_PER_RAD
    return _angle_between(x, y, eye.gaze_x, eye.gaze_y, eye.distance)


@formula
def _unit_angle(floor_deg: float, slope: float, table: NDArray[np.float64] | None, angle: float) -> float:
    """Smallest angle worth a ray at an eccentricity of 0 deg or more, times the acuity scale [deg]; never falls.

    Kernels are compiled once for a line and once for a table, since loops over a line vectorise.
    """
    if table is None:
        return floor_deg + slope * angle
    place = min(angle, LARGEST_ECCENTRICITY_DEG) * STEPS_PER_DEG
    node = min(int(place), len(table) - 2)
    below, above = float(table[node]), float(table[node + 1])
    return max(floor_deg, below + (place - node) * (above - below))


@formula
def _pixel_angle(pitch: float, reach2: float, distance: float) -> float:
    """beta: angle of a pixel of width `pitch`, seen along the line from the foot, sqrt(reach2) away [deg]."""
    return _arc(pitch * distance, distance * distance + reach2 - 0.25 * pitch * pitch) * DEG_PER_RAD


@formula
def cell_size(eye: EyeGeometry, x: float, y: float) -> float:
    """alpha / beta of the screen point (x, y) [cm], at least 1, whose floor is the cell size rho
    (Siekawa and Mantiuk 2014, eq. 5).

    Where pixels are not square, the pitch is the radius of the ellipse with the pixel's width and
    height as semi-axes, in the direction (in pixels) towards the foot of the eye. In the paper's form
    the foot moves with the gaze; of all feet the nearest and the longest pitch are taken.
    """
    away_x, away_y = abs(x - eye.foot_x), abs(y - eye.foot_y)
    half_x, half_y = eye.half_x + eye.sway, eye.half_y + eye.sway
    near_x, near_y = max(0.0, away_x - half_x), max(0.0, away_y - half_y)
    wide = eye.pitch_x >= eye.pitch_y
    u = (away_x + half_x if wide else near_x) / eye.pitch_x
    v = (near_y if wide else away_y + half_y) / eye.pitch_y
    uu, vv = u * u, v * v
    weight = uu / (eye.pitch_x * eye.pitch_x) + vv / (eye.pitch_y * eye.pitch_y)
    pitch = math.sqrt((uu + vv) / weight) if weight > 0.0 else max(eye.pitch_x, eye.pitch_y)
    beta = _pixel_angle(pitch, near_x * near_x + near_y * near_y, eye.distance)
    unit = _unit_angle(eye.floor_deg, eye.slope, eye.table, max(0.0, _eccentricity(eye, x, y) - eye.relief_deg))
    return max(1.0, min(eye.max_side, unit / beta))


@kernel
def _fill_eccentricities(eye: EyeGeometry, angles: NDArray[np.float64]) -> None:
    for row in range(eye.height_px):
        y = (row + 0.5 - eye.height_px / 2) * eye.pitch_y
        for column in range(eye.width_px):
            x = (column + 0.5 - eye.width_px / 2) * eye.pitch_x
            angles[row, column] = _eccentricity(eye, x, y)


@formula
def _cell_size_bounds(eye: EyeGeometry, x: float, y: float, reach: float) -> tuple[int, int]:
    """What rho is at least and at most of all screen points that are at most `reach` [cm] from (x, y).

    A point that is `reach` away lies at most asin(reach / distance to the eye) off in angle; its pixel
    angle is bounded by the nearest and farthest distance from the foot and by how fast the pitch turns
    with direction, or near the foot by the pixel's sides. Where the block is large for the eye the answer is all there
    is: look at each pixel.
    """
    off_x, off_y = x - eye.foot_x, y - eye.foot_y
    from_foot = math.sqrt(off_x * off_x + off_y * off_y)
    from_eye = math.sqrt(from_foot * from_foot + eye.distance * eye.distance)
    if eye.half_x + eye.sway > 0.0 or reach > LOOSE * from_eye:
        return 1, int(eye.max_side)
    shortest, longest = min(eye.pitch_x, eye.pitch_y), max(eye.pitch_x, eye.pitch_y)
    stretch = longest / shortest
    if stretch * reach <= LOOSE * from_foot:
        u, v = off_x / eye.pitch_x, off_y / eye.pitch_y
        uu, vv = u * u, v * v
        pitch = math.sqrt((uu + vv) / (uu / (eye.pitch_x * eye.pitch_x) + vv / (eye.pitch_y * eye.pitch_y)))
        turn = ARCSINE_SLACK * stretch * reach / from_foot
        wobble = 0.5 * (stretch - 1.0 / stretch) * turn
        if wobble <= LOOSE:
            longest = min(longest, pitch * (1.0 + wobble + wobble * wobble))
            shortest = max(shortest, pitch * (1.0 - wobble))
    near, far = max(0.0, from_foot - reach), from_foot + reach
    wide = _pixel_angle(longest, near * near, eye.distance)
    narrow = _pixel_angle(shortest, far * far, eye.distance)
    swing = ARCSINE_SLACK * DEG_PER_RAD * reach / from_eye
    angle = _eccentricity(eye, x, y) - eye.relief_deg
    low = _unit_angle(eye.floor_deg, eye.slope, eye.table, max(0.0, angle - swing)) / wide
    high = _unit_angle(eye.floor_deg, eye.slope, eye.table, max(0.0, angle + swing)) / narrow
    return int(max(1.0, min(eye.max_side, low))), int(max(1.0, min(eye.max_side, high)))


@formula
def block_size_bounds(eye: EyeGeometry, top: int, left: int, side_px: int) -> tuple[int, int]:
    """What rho is at least and at most, perhaps loosely, over the pixels of the square block at (left, top) [px]."""
    y = (top + 0.5 * side_px - eye.height_px / 2) * eye.pitch_y
    x = (left + 0.5 * side_px - eye.width_px / 2) * eye.pitch_x
    diagonal = math.sqrt(eye.pitch_x * eye.pitch_x + eye.pitch_y * eye.pitch_y)
    return _cell_size_bounds(eye, x, y, 0.5 * side_px * diagonal)


@formula
def aligned_side(size: int) -> int:
    """Largest aligned side, of 1, 2, 3, 4, 6, 8, ..., up to `size`, which is 1 or more [px]."""
    side = 1
    while 2 * side <= size:
        side *= 2
    return 3 * (side // 2) if side >= 2 and 3 * (side // 2) <= size else side


@roomy_kernel
def fill_cell_sizes(
    eye: EyeGeometry, first_row: int, first_column: int, aligned: bool, sizes: NDArray[np.uint16]
) -> None:
    """Write rho of the pixels from (first_column, first_row) on into `sizes`, (rows, columns) uint16 [px].

    Blocks over which rho provably does not change are filled at once; others are quartered, down to pixels. With
    `aligned`, what is written may be less than rho, but allows the same aligned squares, and far more blocks are filled
    at once.
    """
    pending = np.zeros((4 * LARGEST_BLOCK_PX, 3), dtype=np.int64)
    _fill_blocks(eye, first_row, first_column, aligned, pending, sizes)


@kernel
def _fill_blocks(
    eye: EyeGeometry,
    first_row: int,
    first_column: int,
    aligned: bool,
    pending: NDArray[np.int64],
    sizes: NDArray[np.uint16],
) -> None:
    """The same, with room in `pending` for the blocks that are yet to be looked at."""
    rows, columns = sizes.shape
    for block_top in range(0, rows, LARGEST_BLOCK_PX):
        for block_left in range(0, columns, LARGEST_BLOCK_PX):
            pending[0, 0], pending[0, 1], pending[0, 2] = block_top, block_left, LARGEST_BLOCK_PX
            count = 1
            while count > 0:
                count -= 1
                top, left, side = pending[count, 0], pending[count, 1], pending[count, 2]
                bottom, right = min(rows, top + side), min(columns, left + side)
                low, high = block_size_bounds(eye, first_row + top, first_column + left, side)
                if low == high or (aligned and aligned_side(low) == aligned_side(high)):
                    for row in range(top, bottom):
                        for column in range(left, right):
                            sizes[row, column] = low
                elif side > SMALLEST_BLOCK_PX:
                    half = side // 2
                    for part in range(4):
                        quarter_top, quarter_left = top + half * (part // 2), left + half * (part % 2)
                        if quarter_top < rows and quarter_left < columns:
                            pending[count, 0], pending[count, 1], pending[count, 2] = quarter_top, quarter_left, half
                            count += 1
                else:
                    for row in range(top, bottom):
                        y = (first_row + row + 0.5 - eye.height_px / 2) * eye.pitch_y
                        for column in range(left, right):
                            x = (first_column + column + 0.5 - eye.width_px / 2) * eye.pitch_x
                            sizes[row, column] = int(cell_size(eye, x, y))
