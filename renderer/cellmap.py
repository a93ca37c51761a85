"""The cell map: which patch of the screen each ray stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.allocator import apart
from renderer.display import Display
from renderer.eccentricity import EyeGeometry, eye_geometry, fill_cell_sizes, largest_cell_side
from renderer.gaze import GazeBucket
from renderer.numbering import number_cells, number_scanline_cells, renumber
from renderer.tiling import mark_scanline, tile_side, tile_strip
from renderer.workers import Workers


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
        return _full_map(display, bucket, pool)
    eye = eye_geometry(display, acuity, bucket)
    if kind == "scanline":
        return _scanline_map(eye, bucket, pool)
    return _aligned_map(eye, bucket, pool)


def cell_sizes(display: Display, acuity: Acuity, bucket: GazeBucket) -> NDArray[np.uint16]:
    """rho of every pixel, (h, w) uint16 [px]: the largest cell side the eye allows there for any gaze of `bucket`."""
    sizes = np.zeros((display.height_px, display.width_px), dtype=np.uint16)
    fill_cell_sizes(eye_geometry(display, acuity, bucket), 0, 0, False, sizes)
    return sizes


def _full_map(display: Display, bucket: GazeBucket, pool: Workers) -> CellMap:
    width, height = display.width_px, display.height_px
    tile_px = tile_side(1)
    tops = range(0, height, tile_px)
    sides = np.ones(-(-width // tile_px), dtype=np.uint16)
    corners = np.zeros((len(sides), tile_px, tile_px), dtype=np.uint16)
    x, y, side = (apart(width * height, np.int32) for _ in range(3))
    mask = apart((height, width), np.int32)

    def number(strip: int) -> None:
        number_cells(tops[strip], tops[strip] * width, corners, sides, x, y, side, mask)

    pool.run(number, len(tops))
    return CellMap("full", bucket, x, y, side, mask)


def _aligned_map(eye: EyeGeometry, bucket: GazeBucket, pool: Workers) -> CellMap:
    tile_px = tile_side(largest_cell_side(eye))
    tops = range(0, eye.height_px, tile_px)
    tiles = -(-eye.width_px // tile_px)
    shape = (tiles, min(tile_px, eye.height_px), min(tile_px, eye.width_px))
    corners = [np.zeros(shape, dtype=np.uint16) for _ in tops]
    sides = np.zeros((len(tops), tiles), dtype=np.uint16)
    counts = np.zeros(len(tops), dtype=np.int64)

    def tile(strip: int) -> None:
        counts[strip] = tile_strip(eye, tile_px, tops[strip], corners[strip], sides[strip])

    pool.run(tile, len(tops))
    first = np.concatenate(([0], np.cumsum(counts)))
    x, y, side = (apart(int(first[-1]), np.int32) for _ in range(3))
    mask = apart((eye.height_px, eye.width_px), np.int32)

    def number(strip: int) -> None:
        number_cells(tops[strip], int(first[strip]), corners[strip], sides[strip], x, y, side, mask)

    pool.run(number, len(tops))
    return CellMap("aligned", bucket, x, y, side, mask)


def _scanline_map(eye: EyeGeometry, bucket: GazeBucket, pool: Workers) -> CellMap:
    shape = (eye.height_px, eye.width_px)
    tile_px = tile_side(largest_cell_side(eye))
    tops = range(0, eye.height_px, tile_px)
    sizes, corners = np.zeros(shape, dtype=np.uint16), np.zeros(shape, dtype=np.uint16)
    rows = [slice(top, top + tile_px) for top in tops]
    pool.run(lambda strip: fill_cell_sizes(eye, tops[strip], 0, False, sizes[rows[strip]]), len(tops))
    mask = apart(shape, np.int32)
    mask[:] = -1
    count = mark_scanline(sizes, corners, mask)
    first = np.cumsum([0, *(np.count_nonzero(corners[strip]) for strip in rows)])
    x, y, side, numbers = (apart(count, np.int32) for _ in range(4))

    def number(strip: int) -> None:
        number_scanline_cells(tile_px, tops[strip], int(first[strip]), corners, mask, x, y, side, numbers)

    pool.run(number, len(tops))
    pool.run(lambda strip: renumber(numbers, mask[rows[strip]]), len(tops))
    return CellMap("scanline", bucket, x, y, side, mask)
