"""Cell maps: the paper's counts, what makes a partition, what the eye allows, and what moves of the gaze keep."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.cellmap import CellMap, build_cell_map, cell_sizes
from renderer.display import Display
from renderer.gaze import Gaze, GazeBucket, bucket_of
from renderer.pipeline import Renderer
from renderer.quality import MAPS, MAX_BUCKET_PX, Quality
from renderer.workers import WorkerPool
from tests.renderer.viewing import PAPER_ACUITY, PAPER_SCREEN, acuities, displays, gazes, true_cell_size

SIDES = sorted({1, *(2**power for power in range(1, 16)), *(3 * 2**power for power in range(15))})
"""Sides an aligned cell can have [px]."""

ROUNDING = 1e-6
"""How far above alpha / beta a side may be, relative."""

MARGINS = st.just(0.0) | st.floats(0, 90)


@pytest.fixture(scope="module")
def pool() -> Iterator[WorkerPool]:
    workers = WorkerPool(2)
    yield workers
    workers.close()


@pytest.fixture
def fresh() -> Iterator[Renderer]:
    renderer = Renderer(threads=2)
    yield renderer
    renderer.close()


def identities(cells: CellMap) -> NDArray[np.int64]:
    """(n,) int64, one number for each (side, column, row)."""
    return (cells.side.astype(np.int64) * 65_536 + cells.x) * 65_536 + cells.y


def pixels_of_each(cells: CellMap) -> NDArray[np.int64]:
    """(n,) int64; fails if a label of the mask is no cell."""
    counts = np.bincount(cells.mask.ravel(), minlength=cells.cells)
    assert cells.mask.min() >= 0
    assert len(counts) == cells.cells
    return counts


def full_widths(cells: CellMap) -> NDArray[np.int32]:
    """(h, w) int32: the side of each pixel's cell [px]."""
    return cells.side[cells.mask]


def aligned_by_hand(sizes: NDArray[np.uint16]) -> set[tuple[int, int, int]]:
    """(side, x, y) of the aligned tiling as its definition says, one square after the other."""
    height, width = sizes.shape
    free = np.ones(sizes.shape, dtype=bool)
    taken = set()
    for side in reversed(SIDES):
        for y in range(0, height - side + 1, side):
            for x in range(0, width - side + 1, side):
                square = np.s_[y : y + side, x : x + side]
                if free[square].all() and (sizes[square] >= side).all():
                    free[square] = False
                    taken.add((side, x, y))
    return taken


def scanline_by_hand(sizes: NDArray[np.uint16]) -> tuple[list[tuple[int, int, int]], NDArray[np.int64]]:
    """(side, x, y) of the scanline tiling's cells in order, and its mask, as its definition says."""
    mask = np.full(sizes.shape, -1)
    seeds: list[tuple[int, int, int]] = []
    for y in range(sizes.shape[0]):
        for x in range(sizes.shape[1]):
            if mask[y, x] < 0:
                side = int(sizes[y, x])
                square = mask[y : y + side, x : x + side]
                square[square < 0] = len(seeds)
                seeds.append((side, x, y))
    return seeds, mask


# Counts


@pytest.mark.parametrize(
    ("kind", "width_px", "height_px", "gaze", "cells"),
    [
        ("scanline", 5400, 3900, Gaze(2700, 1950), 844_514),
        ("scanline", 1920, 1080, Gaze(1000, 500), 768_586),
        ("aligned", 1920, 1080, Gaze(1000, 500), 759_542),
    ],
)
def test_as_many_cells_as_in_the_paper(
    kind: str, width_px: int, height_px: int, gaze: Gaze, cells: int, pool: WorkerPool
) -> None:
    display = dataclasses.replace(PAPER_SCREEN, width_px=width_px, height_px=height_px)
    assert build_cell_map(kind, display, PAPER_ACUITY, bucket_of(gaze, 0), pool).cells == pytest.approx(cells, rel=0.01)


def test_one_map_for_a_bucket_costs_a_few_percent_more_cells(pool: WorkerPool) -> None:
    gaze = Gaze(1000.0, 500.0)
    for acuity in (Acuity(), PAPER_ACUITY):
        exact, shared = (
            build_cell_map("aligned", PAPER_SCREEN, acuity, bucket_of(gaze, side), pool).cells for side in (0, 16)
        )
        assert 1.02 < shared / exact < 1.05


@pytest.mark.parametrize(("move_px", "new_share"), [(8, 0.022), (20, 0.049), (100, 0.227)])
def test_a_move_of_the_gaze_renews_few_aligned_cells(move_px: int, new_share: float, pool: WorkerPool) -> None:
    before, after = (
        build_cell_map("aligned", PAPER_SCREEN, PAPER_ACUITY, bucket_of(Gaze(x, 500.0), 0), pool)
        for x in (1000.0, 1000.0 + move_px)
    )
    new = ~np.isin(identities(after), identities(before))
    assert new.mean() == pytest.approx(new_share, abs=0.01 if move_px < 100 else 0.02)


# A partition of the screen


@given(data=st.data(), acuity=acuities(MARGINS), bucket_px=st.sampled_from([0, 1, 16, 100, MAX_BUCKET_PX]))
def test_aligned_cells_tile_the_screen_with_squares_on_multiples_of_their_sides(
    data: st.DataObject, acuity: Acuity, bucket_px: int, pool: WorkerPool
) -> None:
    display = data.draw(displays())
    bucket = bucket_of(data.draw(gazes(display)), bucket_px)
    cells = build_cell_map("aligned", display, acuity, bucket, pool)
    assert (cells.kind, cells.bucket) == ("aligned", bucket)
    assert cells.mask.shape == (display.height_px, display.width_px)
    assert set(cells.side.tolist()) <= set(SIDES)
    assert not (cells.x % cells.side).any()
    assert not (cells.y % cells.side).any()
    assert cells.x.min() >= 0
    assert cells.y.min() >= 0
    assert (cells.x + cells.side).max() <= display.width_px
    assert (cells.y + cells.side).max() <= display.height_px
    assert_array_equal(pixels_of_each(cells), cells.side.astype(np.int64) ** 2)
    rows, columns = np.indices(cells.mask.shape)
    assert_array_equal(columns - columns % full_widths(cells), cells.x[cells.mask])
    assert_array_equal(rows - rows % full_widths(cells), cells.y[cells.mask])


@given(data=st.data(), acuity=acuities(MARGINS), bucket_px=st.sampled_from([0, 16]))
def test_scanline_cells_share_the_screen_out(
    data: st.DataObject, acuity: Acuity, bucket_px: int, pool: WorkerPool
) -> None:
    display = data.draw(displays())
    bucket = bucket_of(data.draw(gazes(display)), bucket_px)
    cells = build_cell_map("scanline", display, acuity, bucket, pool)
    assert (cells.kind, cells.bucket) == ("scanline", bucket)
    owned = pixels_of_each(cells)
    assert owned.min() >= 1
    assert (owned <= cells.side.astype(np.int64) ** 2).all()
    assert_array_equal(cells.mask[cells.y, cells.x], np.arange(cells.cells))
    rows, columns = np.indices(cells.mask.shape)
    right, down = columns - cells.x[cells.mask], rows - cells.y[cells.mask]
    assert min(right.min(), down.min()) >= 0
    assert (np.maximum(right, down) < full_widths(cells)).all()


@given(data=st.data())
def test_a_full_map_has_a_cell_for_each_pixel(data: st.DataObject, pool: WorkerPool) -> None:
    display = data.draw(displays())
    bucket = bucket_of(data.draw(gazes(display)), 16)
    cells = build_cell_map("full", display, Acuity(), bucket, pool)
    assert cells.cells == display.pixels
    assert (cells.side == 1).all()
    rows, columns = np.indices(cells.mask.shape)
    assert_array_equal(cells.x[cells.mask], columns)
    assert_array_equal(cells.y[cells.mask], rows)
    assert_array_equal(pixels_of_each(cells), 1)


@given(data=st.data(), acuity=acuities(MARGINS), bucket_px=st.sampled_from([0, 16]))
def test_both_tilings_are_what_their_definitions_say(
    data: st.DataObject, acuity: Acuity, bucket_px: int, pool: WorkerPool
) -> None:
    display = data.draw(displays(max_width=60, max_height=120))
    bucket = bucket_of(data.draw(gazes(display)), bucket_px)
    sizes = cell_sizes(display, acuity, bucket)
    aligned = build_cell_map("aligned", display, acuity, bucket, pool)
    found = set(zip(aligned.side.tolist(), aligned.x.tolist(), aligned.y.tolist(), strict=True))
    assert found == aligned_by_hand(sizes)
    scanline = build_cell_map("scanline", display, acuity, bucket, pool)
    seeds, mask = scanline_by_hand(sizes)
    assert list(zip(scanline.side.tolist(), scanline.x.tolist(), scanline.y.tolist(), strict=True)) == seeds
    assert_array_equal(scanline.mask, mask)


# What the eye allows


@given(data=st.data(), acuity=acuities(), bucket_px=st.sampled_from([0, 1, 16, 100, MAX_BUCKET_PX]))
def test_no_aligned_cell_is_coarser_than_any_gaze_of_its_bucket_allows_at_any_of_its_pixels(
    data: st.DataObject, acuity: Acuity, bucket_px: int, pool: WorkerPool
) -> None:
    display = data.draw(displays(150, 150))
    bucket = bucket_of(data.draw(gazes(display)), bucket_px)
    cells = build_cell_map("aligned", display, acuity, bucket, pool)
    part = st.sampled_from([-0.5, 0.5]) | st.floats(-0.5, 0.5)
    gaze = Gaze(bucket.x + data.draw(part) * bucket_px, bucket.y + data.draw(part) * bucket_px)
    allowed = true_cell_size(display, acuity, gaze)
    assert (full_widths(cells) <= allowed * (1 + ROUNDING)).all(), gaze


@given(data=st.data(), acuity=acuities())
def test_no_scanline_cell_is_coarser_than_allowed_where_it_opens(
    data: st.DataObject, acuity: Acuity, pool: WorkerPool
) -> None:
    display = data.draw(displays(150, 150))
    gaze = data.draw(gazes(display))
    cells = build_cell_map("scanline", display, acuity, bucket_of(gaze, 0), pool)
    allowed = true_cell_size(display, acuity, gaze)[cells.y, cells.x]
    assert (cells.side <= allowed * (1 + ROUNDING)).all()
    assert (cells.side > allowed * (1 - ROUNDING) - 1).all()


def test_where_nothing_is_left_out_the_foveated_map_is_the_full_one(pool: WorkerPool) -> None:
    display, bucket = Display(64, 64, 100.0, 100.0, 30.0), GazeBucket(32.0, 32.0, 0)
    full = build_cell_map("full", display, Acuity(), bucket, pool)
    for kind in ("aligned", "scanline"):
        cells = build_cell_map(kind, display, Acuity(), bucket, pool)
        assert (cells.side == 1).all()
        assert set(identities(cells)) == set(identities(full))


@pytest.mark.parametrize("gaze", [Gaze(-5000.0, 540.0), Gaze(1e9, 1e9), Gaze(-1e30, 1e30)])
def test_a_gaze_off_the_screen_has_a_coarse_map(gaze: Gaze, pool: WorkerPool) -> None:
    beside = build_cell_map("aligned", PAPER_SCREEN, Acuity(), bucket_of(gaze, 16), pool)
    middle = build_cell_map("aligned", PAPER_SCREEN, Acuity(), bucket_of(Gaze(960.0, 540.0), 16), pool)
    assert 1 <= beside.cells < middle.cells / 5
    assert pixels_of_each(beside).sum() == PAPER_SCREEN.pixels


def test_from_far_away_there_are_as_few_cells_as_the_tilings_allow(pool: WorkerPool) -> None:
    display, bucket = Display(192, 108, 50.0, 35.0, 1e8), GazeBucket(96.0, 54.0, 0)
    assert (cell_sizes(display, Acuity(), bucket) == 192).all()
    assert build_cell_map("scanline", display, Acuity(), bucket, pool).cells == 1
    aligned = build_cell_map("aligned", display, Acuity(), bucket, pool)
    assert aligned.side.tolist().count(96) == 2
    assert aligned.side.tolist().count(12) == 16
    assert aligned.cells == 18


# The same map


@pytest.mark.parametrize("kind", MAPS)
@pytest.mark.parametrize("distance_cm", [60.0, 0.5])
def test_the_number_of_threads_changes_no_byte(kind: str, distance_cm: float) -> None:
    display = Display(701, 397, 50.0, 35.0, distance_cm)
    bucket = bucket_of(Gaze(200.0, 333.0), 16)
    maps = []
    for threads in (1, 2, 3, 8):
        pool = WorkerPool(threads)
        maps.append(build_cell_map(kind, display, Acuity(scale=3.0), bucket, pool))
        pool.close()
    for cells in maps[1:]:
        for name in ("x", "y", "side", "mask"):
            assert getattr(cells, name).tobytes() == getattr(maps[0], name).tobytes()


@pytest.mark.parametrize("kind", MAPS)
def test_a_map_is_int32_and_read_only(kind: str, pool: WorkerPool) -> None:
    cells = build_cell_map(kind, Display(64, 48), Acuity(), GazeBucket(0.0, 0.0, 16), pool)
    for array in (cells.x, cells.y, cells.side, cells.mask):
        assert array.dtype == np.int32
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    assert cells.x.shape == cells.y.shape == cells.side.shape == (cells.cells,)
    assert cells.nbytes == 4 * (3 * cells.cells + 64 * 48)


def test_gazes_of_a_bucket_share_the_map_and_others_do_not(fresh: Renderer) -> None:
    display, quality = Display(160, 90), Quality()
    first, cached = fresh.cell_map(display, quality, Gaze(8.0, 8.0))
    assert not cached
    for x, y in [(23.9, 8.0), (8.0, 23.9), (16.0, 16.0)]:
        again, cached = fresh.cell_map(display, quality, Gaze(x, y))
        assert cached
        assert again is first
    assert not fresh.cell_map(display, quality, Gaze(24.0, 8.0))[1]
    assert not fresh.cell_map(display, quality, Gaze(8.0, np.nextafter(8.0, 0.0)))[1]
    assert (fresh.map_cache.hits, fresh.map_cache.misses) == (3, 3)


def test_every_setting_that_shapes_the_map_is_part_of_its_key(fresh: Renderer) -> None:
    gaze, display, quality = Gaze(70.0, 40.0), Display(160, 90), Quality()
    other_maps = [
        (Display(160, 91), quality),
        (Display(160, 90, distance_cm=61.0), quality),
        (Display(160, 90, height_cm=20.0), quality),
        (display, Quality(map="scanline")),
        (display, Quality(map="full")),
        (display, Quality(gaze_bucket_px=0)),
        (display, Quality(acuity=Acuity(model="guenter"))),
        (display, Quality(acuity=Acuity(eccentricity="paper"))),
        (display, Quality(acuity=Acuity(scale=2.0))),
        (display, Quality(acuity=Acuity(margin_deg=1.0))),
    ]
    for other_display, other_quality in [(display, quality), *other_maps]:
        assert not fresh.cell_map(other_display, other_quality, gaze)[1]
    for same in (Quality(samples_per_cell=1), Quality(antialiasing="regular"), Quality(max_depth=0)):
        assert fresh.cell_map(display, same, gaze)[1]


def test_a_full_map_serves_every_gaze(fresh: Renderer) -> None:
    display, quality = Display(160, 90), Quality(map="full")
    first, _ = fresh.cell_map(display, quality, Gaze(0.0, 0.0))
    again, cached = fresh.cell_map(display, quality, Gaze(1e30, -5.0))
    assert cached
    assert again is first
