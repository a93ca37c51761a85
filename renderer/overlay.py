"""Drawings on top of a frame: its cells, the rays they cost, the rings around the gaze, the gaze itself.

Every function takes (h, w, 3) uint8 pixels and returns a new array of the same shape; the frame
itself is never changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.gaze import Gaze

SIDE_COLOURS = np.array(
    [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]],
    dtype=np.float64,
)
"""sRGB of cell sides 2, 4, 8, 16 and 32 px or more, blended in between: dark violet to yellow, which grows
in lightness all along, so it reads in grey too (five stops of viridis; Smith and van der Walt 2015)."""

CELL_TINT = 0.45
"""Share of the side's colour in the pixels of a cell."""

CELL_EDGE = 0.55
"""Factor on the pixels along a cell's left and upper edge."""

RAY_COLOURS = np.array(
    [[0, 0, 4], [87, 16, 110], [188, 55, 84], [249, 142, 9], [252, 255, 164]],
    dtype=np.float64,
)
"""sRGB of 1/64, 1/8, 1, 8 and 64 camera rays a pixel, blended in between (five stops of inferno; Smith and van der
Walt 2015)."""

RAY_STEP = 8.0
"""Factor in rays from one stop of `RAY_COLOURS` to the next; the middle one is one ray a pixel."""

RAY_TINT = 0.65
"""Share of the rays' colour in a pixel."""

SMALLEST_OUTLINED_PX = 4
"""Side from which a cell gets an outline; the outline of a smaller one would hide it."""

RINGS: tuple[tuple[float, tuple[int, int, int]], ...] = (
    (2.5, (255, 255, 255)),
    (5.0, (255, 200, 60)),
    (10.0, (255, 110, 40)),
)
"""Eccentricity [deg] and colour of each ring: the edge of the fovea, of the parafovea (about 5 deg) and
of the perifovea (about 10 deg)."""

CROSS_COLOUR = (255, 40, 40)
CROSS_BACKING = (0, 0, 0)

LINES_PER_PX = 540
"""Rows of the frame for each pixel of line width, so that drawings survive being shown smaller."""


def draw_cells(pixels: NDArray[np.uint8], cell_map: CellMap) -> NDArray[np.uint8]:
    """Tint each cell by its side and outline the larger ones; cells of one pixel stay as they are.

    Args:
        pixels: (h, w, 3) uint8 frame.
        cell_map: the cells of a screen of the same size.

    Raises:
        ValueError: if frame and map differ in size.
    """
    if pixels.shape != (*cell_map.mask.shape, 3):
        raise ValueError(f"expected pixels of shape {(*cell_map.mask.shape, 3)}, found {pixels.shape}")
    stops = np.arange(1, len(SIDE_COLOURS) + 1)
    colours = np.stack([np.interp(np.log2(cell_map.side), stops, channel) for channel in SIDE_COLOURS.T], axis=1)
    share = np.where(cell_map.side > 1, CELL_TINT, 0.0)
    added = np.rint(colours * share[:, None]).astype(np.uint8)
    kept = np.rint(256 * (1 - share)).astype(np.uint16)
    drawn: NDArray[np.uint8] = (pixels * kept[cell_map.mask][..., None] >> 8).astype(np.uint8) + added[cell_map.mask]
    edge = _cell_edges(cell_map)
    drawn[edge] = (drawn[edge] * CELL_EDGE).astype(np.uint8)
    return drawn


def draw_rays(pixels: NDArray[np.uint8], cell_map: CellMap, samples_per_cell: int) -> NDArray[np.uint8]:
    """Tint each cell by the camera rays it gets for each of its pixels.

    Args:
        pixels: (h, w, 3) uint8 frame.
        cell_map: the cells of a screen of the same size.
        samples_per_cell: camera rays a cell, 1 or more.

    Raises:
        ValueError: if frame and map differ in size.
    """
    if pixels.shape != (*cell_map.mask.shape, 3):
        raise ValueError(f"expected pixels of shape {(*cell_map.mask.shape, 3)}, found {pixels.shape}")
    rays = samples_per_cell / np.square(cell_map.side, dtype=np.float64)
    stops = np.arange(len(RAY_COLOURS)) - len(RAY_COLOURS) // 2
    steps = np.log(rays) / np.log(RAY_STEP)
    colours = np.stack([np.interp(steps, stops, channel) for channel in RAY_COLOURS.T], axis=1)
    added = np.rint(colours * RAY_TINT).astype(np.uint8)
    return (pixels * (1 - RAY_TINT)).astype(np.uint8) + added[cell_map.mask]


def draw_region_of_interest(
    pixels: NDArray[np.uint8], display: Display, gaze: Gaze, eccentricity: str = "exact"
) -> NDArray[np.uint8]:
    """Draw the lines of equal eccentricity of `RINGS`: as the eye sees them circles, on the screen not quite.

    Args:
        pixels: (h, w, 3) uint8 frame of `display`.
        display: the screen.
        gaze: where the eye looks [px]; may lie off the screen.
        eccentricity: `exact` or `paper` (Siekawa and Mantiuk 2014, eq. 4).

    Raises:
        ValueError: if frame and display differ in size.
    """
    if pixels.shape != (display.height_px, display.width_px, 3):
        raise ValueError(f"expected pixels of shape {(display.height_px, display.width_px, 3)}, found {pixels.shape}")
    angles = eccentricity_deg(display, gaze, eccentricity)
    drawn = pixels.copy()
    for ring_deg, colour in RINGS:
        drawn[_thicken(_outline(angles < ring_deg), _line_width(pixels) // 2)] = colour
    return drawn


def draw_gaze(pixels: NDArray[np.uint8], gaze: Gaze) -> NDArray[np.uint8]:
    """Draw a cross at the gaze, open in the middle; nothing where the gaze is far off the screen.

    Args:
        pixels: (h, w, 3) uint8 frame.
        gaze: where the eye looks [px].
    """
    height, width = pixels.shape[:2]
    line = _line_width(pixels)
    away_x = np.abs(np.arange(width) + 0.5 - gaze.x)
    away_y = np.abs(np.arange(height) + 0.5 - gaze.y)
    drawn = pixels.copy()
    for colour, grow in ((CROSS_BACKING, line), (CROSS_COLOUR, 0.0)):
        thin, opening, arm = 0.51 * line + grow, 4.0 * line - grow, 14.0 * line + grow
        drawn[np.ix_(away_y <= thin, (away_x >= opening) & (away_x <= arm))] = colour
        drawn[np.ix_((away_y >= opening) & (away_y <= arm), away_x <= thin)] = colour
    return drawn


def _cell_edges(cell_map: CellMap) -> NDArray[np.bool_]:
    """(h, w): pixels of a large enough cell whose left or upper neighbour is in another cell."""
    mask = cell_map.mask
    edge = np.zeros(mask.shape, dtype=np.bool_)
    edge[:, 1:] |= mask[:, 1:] != mask[:, :-1]
    edge[1:, :] |= mask[1:, :] != mask[:-1, :]
    return edge & (cell_map.side >= SMALLEST_OUTLINED_PX)[mask]


def _outline(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(h, w): pixels inside with a neighbour outside; the border of the image is no outline."""
    outline = np.zeros_like(inside)
    outline[:, 1:] |= inside[:, 1:] & ~inside[:, :-1]
    outline[:, :-1] |= inside[:, :-1] & ~inside[:, 1:]
    outline[1:, :] |= inside[1:, :] & ~inside[:-1, :]
    outline[:-1, :] |= inside[:-1, :] & ~inside[1:, :]
    return outline


def _thicken(drawn: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    """(h, w): `drawn` and the pixels at most `steps` up, down, left or right of it."""
    for _ in range(steps):
        wider = drawn.copy()
        wider[1:] |= drawn[:-1]
        wider[:-1] |= drawn[1:]
        wider[:, 1:] |= drawn[:, :-1]
        wider[:, :-1] |= drawn[:, 1:]
        drawn = wider
    return drawn


def _line_width(pixels: NDArray[np.uint8]) -> int:
    """Width of a drawn line for a frame of this height [px]."""
    height: int = pixels.shape[0]
    return max(1, round(height / LINES_PER_PX))
