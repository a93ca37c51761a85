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
from renderer.quality import MAPS, Quality
from renderer.workers import WorkerPool
from tests.renderer.viewing import (
    MARGINS,
    PAPER_ACUITY,
    PAPER_SCREEN,
    ROUNDING,
    SIDES,
    acuities,
    displays,
    gazes,
    true_cell_size,
)


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
    opened = mask[scanline.y, scanline.x]
    assert sorted(opened.tolist()) == list(range(len(seeds)))
    squares = list(zip(scanline.side.tolist(), scanline.x.tolist(), scanline.y.tolist(), strict=True))
    assert squares == [seeds[number] for number in opened]
    assert_array_equal(opened[scanline.mask], mask)


# What the eye allows


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


@pytest.mark.parametrize(("kind", "most"), [("full", 2.0), ("aligned", 4.0), ("scanline", 4.0)])
def test_cells_that_follow_one_another_are_neighbours(kind: str, most: float, pool: WorkerPool) -> None:
    """Width and height around sixteen of them together, in roots of their area: 2 for a square, 4.25 for a row.

    The sixteen begin anywhere: where tiles of mixed sizes come between, they belong to two squares.
    """
    display = Display(640, 360, width_cm=50.0, height_cm=35.0, distance_cm=30.0)
    cells = build_cell_map(kind, display, Acuity(), GazeBucket(96.0, 96.0, 16), pool)
    whole = cells.cells // 16 * 16
    x, y, side = (array[:whole].reshape(-1, 16) for array in (cells.x, cells.y, cells.side))
    around = sum((near + side).max(axis=1) - near.min(axis=1) for near in (x, y))
    assert (around / np.sqrt((side * side).sum(axis=1))).mean() <= most


def test_a_full_map_serves_every_gaze(fresh: Renderer) -> None:
    display, quality = Display(160, 90), Quality(map="full")
    first, _ = fresh.cell_map(display, quality, Gaze(0.0, 0.0))
    again, cached = fresh.cell_map(display, quality, Gaze(1e30, -5.0))
    assert cached
    assert again is first
