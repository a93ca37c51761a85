"""Smooth reconstruction: bilinear between cells, nothing invented, the fovea untouched."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.cellmap import CellMap, build_cell_map
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze, GazeBucket
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import MAPS, Quality
from renderer.reconstruction import reconstruct
from renderer.scenes import BUILT_IN
from renderer.smooth import reconstruct_smooth
from renderer.store import Samples
from renderer.texture import srgb_to_linear
from renderer.tonemap import encode_srgb
from renderer.workers import WorkerPool

SCREEN = Display(160, 90, 50.0, None, 20.0)


@pytest.fixture(scope="module")
def pool() -> Iterator[WorkerPool]:
    made = WorkerPool(2)
    yield made
    made.close()


def samples_of(means: NDArray[np.float64]) -> Samples:
    """One sample a cell with the given mean."""
    n = len(means)
    zeros = np.zeros(n, np.float32)
    return Samples(means.astype(np.float32), zeros, zeros, np.ones(n, np.int32), np.zeros(n, np.int32))


def grid(side: int, columns: int, rows: int) -> CellMap:
    """Cells of one size."""
    y, x = (side * part.ravel().astype(np.int32) for part in np.mgrid[0:rows, 0:columns])
    ids = np.arange(columns * rows, dtype=np.int32).reshape(rows, columns)
    mask = np.ascontiguousarray(np.kron(ids, np.ones((side, side), np.int32)))
    return CellMap("aligned", GazeBucket(0, 0, 0), x, y, np.full(len(x), side, np.int32), mask)


def smooth(cells: CellMap, means: NDArray[np.float64], pool: WorkerPool, *, linear: bool = True) -> NDArray[np.generic]:
    return reconstruct_smooth(cells, np.arange(cells.cells), samples_of(means), 1.0, linear, pool)


@pytest.mark.parametrize("side", [2, 3, 4, 7])
def test_cells_of_one_size_are_interpolated_between_their_centres(pool: WorkerPool, side: int) -> None:
    rng = np.random.default_rng(side)
    means = rng.random((5 * 6, 3))
    seen = smooth(grid(side, 6, 5), means, pool)
    picture = means.reshape(5, 6, 3)
    row, column = ((np.arange(side * n) + 0.5) / side - 0.5 for n in (5, 6))
    row, column = np.clip(row, 0, 4), np.clip(column, 0, 5)
    top, left = np.minimum(row.astype(int), 3), np.minimum(column.astype(int), 4)
    fy, fx = (row - top)[:, None, None], (column - left)[None, :, None]
    upper = picture[top][:, left] * (1 - fx) + picture[top][:, left + 1] * fx
    lower = picture[top + 1][:, left] * (1 - fx) + picture[top + 1][:, left + 1] * fx
    np.testing.assert_allclose(seen, upper * (1 - fy) + lower * fy, atol=2e-7)


@settings(max_examples=30)
@given(st.sampled_from(MAPS), st.floats(-50, 210), st.floats(-50, 140), st.floats(0.3, 12), st.integers(0, 2**32))
def test_nothing_is_invented(pool: WorkerPool, kind: str, x: float, y: float, scale: float, seed: int) -> None:
    """A pixel lies between its own cell and those that touch it (any, where cells overlap); one pixel's cell keeps
    its colour to the bit.
    """
    cells = build_cell_map(kind, SCREEN, Acuity(scale=scale), GazeBucket(x, y, 0), pool)
    means = np.random.default_rng(seed).random((cells.cells, 3))
    seen = smooth(cells, means, pool)
    nearest = reconstruct(cells, np.arange(cells.cells), samples_of(means), 1.0, True, pool)
    low, high = means.copy(), means.copy()
    mask = cells.mask
    for down, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = mask[: mask.shape[0] - down, max(0, -across) : mask.shape[1] - max(0, across)].ravel()
        b = mask[down:, max(0, across) : mask.shape[1] + min(0, across)].ravel()
        for one, other in ((a, b), (b, a)):
            np.minimum.at(low, one, means[other])
            np.maximum.at(high, one, means[other])
    if kind == "scanline":
        low[:], high[:] = means.min(axis=0), means.max(axis=0)
    assert (seen >= low[mask] - 1e-6).all()
    assert (seen <= high[mask] + 1e-6).all()
    alone = cells.side[mask] == 1
    np.testing.assert_array_equal(seen[alone], nearest[alone])
    even = smooth(cells, np.full((cells.cells, 3), 0.3), pool)
    np.testing.assert_array_equal(even, np.float32(0.3))


@pytest.mark.parametrize("kind", ["aligned", "scanline"])
def test_a_slope_has_no_steps(pool: WorkerPool, kind: str) -> None:
    """Where the light rises evenly, what is left of the cells' steps is less than a third of them."""
    cells = build_cell_map(kind, SCREEN, Acuity(scale=8.0), GazeBucket(30.0, 30.0, 0), pool)
    row, column = np.mgrid[0:90, 0:160] + 0.5
    slope = (0.2 + 0.004 * column + 0.001 * row)[..., None] * np.ones(3)
    size = np.bincount(cells.mask.ravel(), minlength=cells.cells)
    means = np.stack([np.bincount(cells.mask.ravel(), slope[..., 0].ravel(), cells.cells) / size] * 3, axis=1)
    inside = np.zeros((90, 160), bool)
    inside[10:-10, 10:-10] = True
    inside &= cells.side[cells.mask] > 2
    nearest = reconstruct(cells, np.arange(cells.cells), samples_of(means), 1.0, True, pool)
    steps = np.sqrt(np.mean((nearest - slope)[inside] ** 2))
    left = np.sqrt(np.mean((smooth(cells, means, pool) - slope)[inside] ** 2))
    assert left < steps / 3


def test_the_picture_is_the_linear_frame_in_srgb_on_any_number_of_threads(pool: WorkerPool) -> None:
    cells = build_cell_map("aligned", Display(500, 400), Acuity(scale=8.0), GazeBucket(30.0, 30.0, 0), pool)
    means = np.random.default_rng(1).random((cells.cells, 3)) ** 3
    linear, picture = smooth(cells, means, pool), smooth(cells, means, pool, linear=False)
    np.testing.assert_array_equal(picture, encode_srgb(linear))
    alone = WorkerPool(1)
    np.testing.assert_array_equal(picture, smooth(cells, means, alone, linear=False))
    alone.close()


def test_a_lamp_does_not_swallow_its_surroundings(pool: WorkerPool) -> None:
    """A cell a thousand times brighter than white blends as white does; linear frames keep what there is."""
    cells = grid(4, 5, 1)
    means = np.full((5, 3), 0.1)
    means[2] = 1000.0
    lamp = smooth(cells, means, pool, linear=False)
    means[2] = 1.0
    np.testing.assert_array_equal(lamp, smooth(cells, means, pool, linear=False))
    assert smooth(cells, np.where(means == 1.0, 1000.0, means), pool).max() > 800.0


@pytest.mark.parametrize(("scene", "share"), [("spheres", 0.8), ("atrium", 0.85)])
def test_a_frame_comes_nearer_to_the_full_one_with_the_same_rays(scene: str, share: float) -> None:
    """Squared error of the 8-bit frame, decoded, against full sampling: at 4 samples a cell a fifth smaller."""
    renderer = Renderer(threads=2)
    prepared = prepare(BUILT_IN[scene]())
    screen = Display(320, 180, 50.0, None, 60.0)

    def frame(quality: Quality) -> NDArray[np.float64]:
        picture = renderer.render(prepared, FrameRequest(Gaze(100.0, 60.0), screen, None, quality)).pixels
        return srgb_to_linear(picture / 255.0)

    truth = frame(Quality(map="full", samples_per_cell=16))
    nearest, blended = (
        np.mean((frame(Quality(acuity=Acuity(scale=4.0), reconstruction=name)) - truth) ** 2)
        for name in ("nearest", "smooth")
    )
    renderer.close()
    assert blended < share * nearest
