"""The cell map: which patch of the screen each ray stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.eccentricity import EyeGeometry, eye_geometry, fill_cell_sizes, largest_cell_side
from renderer.gaze import GazeBucket
from renderer.tiling import (
    mark_aligned,
    mark_scanline,
    number_cells,
    number_scanline_cells,
    strip_rows,
)
from renderer.workers import Workers

FULL_STRIP_ROWS = 64
"""Rows of the strips in which work over whole pixels is divided."""


@dataclass(frozen=True, eq=False, slots=True)
class CellMap:
    """A partition of the screen into cells: every pixel is in exactly one.

    Attributes:
        kind: tiling, `aligned`, `scanline` or `full`.
        bucket: the gazes it serves.
        x, y: (n,) int32 left and top pixel of each cell.
        side: (n,) int32 side of its square [px]; a scanline cell owns only the pixels of its square that
            earlier ones left, and its square may hang over the screen's right and lower edge.
        mask: (h, w) int32 cell of each pixel, 0 .. n-1.
    """

    kind: str
    bucket: GazeBucket
    x: NDArray[np.int32]
    y: NDArray[np.int32]
    side: NDArray[np.int32]
    mask: NDArray[np.int32]

    def __post_init__(self) -> None:
        for array in (self.x, self.y, self.side):
            assert array.dtype == np.int32 and array.shape == self.x.shape
        assert self.mask.dtype == np.int32 and self.mask.ndim == 2
        for array in (self.x, self.y, self.side, self.mask):
            array.flags.writeable = False

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.x)

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return self.x.nbytes + self.y.nbytes + self.side.nbytes + self.mask.nbytes


def build_cell_map(kind: str, display: Display, acuity: Acuity, bucket: GazeBucket, pool: Workers) -> CellMap:
    """Tile `display` for every gaze of `bucket`.

    Args:
        kind: `aligned`, `scanline` or `full`.
        display, acuity, bucket: the screen, the eye and where it looks.
        pool: threads to build it on; the map does not depend on their number.
    """
    if kind == "full":
        return _full_map(display, bucket)
    eye = eye_geometry(display, acuity, bucket)
    if kind == "scanline":
        return _scanline_map(eye, bucket, pool)
    return _aligned_map(eye, bucket, pool)


def cell_sizes(display: Display, acuity: Acuity, bucket: GazeBucket) -> NDArray[np.uint16]:
    """rho of every pixel, (h, w) uint16 [px]: the largest cell side the eye allows there for any gaze of `bucket`."""
    sizes = np.zeros((display.height_px, display.width_px), dtype=np.uint16)
    fill_cell_sizes(eye_geometry(display, acuity, bucket), 0, sizes)
    return sizes


def _full_map(display: Display, bucket: GazeBucket) -> CellMap:
    width, height = display.width_px, display.height_px
    corners = np.ones((height, width), dtype=np.uint16)
    return _numbered("full", bucket, [corners], [width * height], height)


def _aligned_map(eye: EyeGeometry, bucket: GazeBucket, pool: Workers) -> CellMap:
    rows = strip_rows(largest_cell_side(eye), eye.height_px)
    tops = range(0, eye.height_px, rows)
    corners = [np.zeros((min(rows, eye.height_px - top), eye.width_px), dtype=np.uint16) for top in tops]
    counts = [0] * len(tops)

    def tile(strip: int) -> None:
        sizes = np.zeros_like(corners[strip])
        fill_cell_sizes(eye, tops[strip], sizes)
        counts[strip] = mark_aligned(sizes, corners[strip])

    pool.run(tile, len(tops))
    return _numbered("aligned", bucket, corners, counts, rows, pool)


def _scanline_map(eye: EyeGeometry, bucket: GazeBucket, pool: Workers) -> CellMap:
    shape = (eye.height_px, eye.width_px)
    sizes = np.zeros(shape, dtype=np.uint16)

    def measure(strip: int) -> None:
        top = strip * FULL_STRIP_ROWS
        fill_cell_sizes(eye, top, sizes[top : top + FULL_STRIP_ROWS])

    pool.run(measure, -(-eye.height_px // FULL_STRIP_ROWS))
    corners = np.zeros(shape, dtype=np.uint16)
    mask = np.full(shape, -1, dtype=np.int32)
    count = mark_scanline(sizes, corners, mask)
    x, y, side = (np.zeros(count, dtype=np.int32) for _ in range(3))
    number_scanline_cells(corners, x, y, side)
    return CellMap("scanline", bucket, x, y, side, mask)


def _numbered(
    kind: str,
    bucket: GazeBucket,
    corners: list[NDArray[np.uint16]],
    counts: list[int],
    rows: int,
    pool: Workers | None = None,
) -> CellMap:
    """Number the cells of strips of `rows` rows whose corners are marked."""
    first = np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))
    x, y, side = (np.zeros(int(first[-1]), dtype=np.int32) for _ in range(3))
    mask = np.zeros((sum(len(strip) for strip in corners), corners[0].shape[1]), dtype=np.int32)

    def number(strip: int) -> None:
        number_cells(corners[strip], strip * rows, int(first[strip]), x, y, side, mask)

    if pool is None:
        for strip in range(len(corners)):
            number(strip)
    else:
        pool.run(number, len(corners))
    return CellMap(kind, bucket, x, y, side, mask)
