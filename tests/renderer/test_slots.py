"""Slots: a cell has one place whatever the gaze, and what is traced together lies side by side."""

from __future__ import annotations

import mmap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.cellmap import CellMap
from renderer.display import MAX_SIDE_PX, Display
from renderer.gather import entry, keep, lane_numbers
from renderer.gaze import Gaze, GazeBucket
from renderer.kernel import kernel
from renderer.lanes import LANES
from renderer.numbering import GROUP, STRIP
from renderer.pipeline import Renderer
from renderer.quality import Quality
from renderer.slots import (
    aligned_levels,
    aligned_sides,
    aligned_slots,
    at_slots,
    pixel_slots,
    place_in_level,
    slots_needed,
    slots_of,
)
from renderer.store import SampleStore
from renderer.workers import WorkerPool

NEAR = Display(96, 54, width_cm=5.0)
COARSE = Acuity(scale=15.0)
"""A screen and an eye that make cells of many sides."""


def cell_map(renderer: Renderer, kind: str, gaze: tuple[float, float], display: Display = NEAR) -> CellMap:
    return renderer.cell_map(display, Quality(map=kind, acuity=COARSE), Gaze(*gaze))[0]


def identities(cells: CellMap) -> list[tuple[int, int, int]]:
    return list(zip(cells.side.tolist(), cells.x.tolist(), cells.y.tolist(), strict=True))


def test_sides_are_powers_of_two_and_three_times_them() -> None:
    assert aligned_sides(1920, 1080).tolist()[:10] == [1, 2, 3, 4, 6, 8, 12, 16, 24, 32]
    assert aligned_sides(1920, 1080).max() <= 1080
    assert aligned_sides(1, 7).tolist() == [1]


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-50, 150), st.floats(-50, 100)), min_size=2, max_size=6))
def test_a_cell_has_the_same_place_for_every_gaze_and_no_other_cell_has_it(
    renderer: Renderer, pool: WorkerPool, gazes: list[tuple[float, float]]
) -> None:
    """Also where squares of one side could begin in the middle of those of another."""
    cell_of_slot: dict[int, tuple[int, int, int]] = {}
    for gaze in gazes:
        cells = cell_map(renderer, "aligned", gaze)
        slots = slots_of(cells, pool)
        assert slots.min() >= 0
        assert slots.max() < slots_needed(cells) == aligned_slots(96, 54)
        for slot, identity in zip(slots.tolist(), identities(cells), strict=True):
            assert cell_of_slot.setdefault(slot, identity) == identity
    assert len(set(cell_of_slot.values())) == len(cell_of_slot)


def test_the_maps_tried_here_have_cells_of_many_sides(renderer: Renderer) -> None:
    sides = [set(cell_map(renderer, "aligned", gaze).side.tolist()) for gaze in ((48, 27), (0, 0), (150, 100))]
    assert {1, 2, 3, 4, 6, 8} <= set.union(*sides)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (17, 13), (96, 54)])
def test_full_maps_share_the_places_of_single_pixels(
    renderer: Renderer, pool: WorkerPool, size: tuple[int, int]
) -> None:
    display = Display(*size, width_cm=5.0)
    cells = cell_map(renderer, "full", (0, 0), display)
    slots = slots_of(cells, pool)
    assert len(set(slots.tolist())) == cells.cells == display.pixels
    aligned = cell_map(renderer, "aligned", (size[0] / 2, size[1] / 2), display)
    place = dict(zip(identities(cells), slots.tolist(), strict=True))
    for identity, slot in zip(identities(aligned), slots_of(aligned, pool).tolist(), strict=True):
        assert identity[0] > 1 or place[identity] == slot


def test_scanline_cells_have_places_of_their_map_only(renderer: Renderer, pool: WorkerPool) -> None:
    cells = cell_map(renderer, "scanline", (10, 10))
    np.testing.assert_array_equal(slots_of(cells, pool), np.arange(cells.cells))
    assert slots_needed(cells) == cells.cells


@given(st.integers(1, 200), st.integers(1, 120))
def test_every_square_of_every_side_has_a_slot_of_its_own(width: int, height: int) -> None:
    sides, starts = aligned_levels(width, height)
    for side, start, end in zip(sides.tolist(), starts.tolist(), starts[1:].tolist(), strict=False):
        row, column = np.arange(-(-height // side)), np.arange(-(-width // side))
        places = start + place_in_level(width, side, row[:, None], column)
        assert len(np.unique(places)) == places.size
        assert places.min() == start
        assert places.max() < end
    assert starts[-1] == aligned_slots(width, height)


def test_the_slots_of_the_largest_screen_have_numbers_of_32_bits() -> None:
    assert aligned_slots(MAX_SIDE_PX, MAX_SIDE_PX) < 2**31


@given(st.integers(1, 200), st.integers(0, 50), st.integers(0, 50))
def test_a_group_has_its_slots_side_by_side_and_the_group_below_in_its_strip_the_next(
    width: int, row: int, column: int
) -> None:
    first = place_in_level(width, 1, GROUP * row, GROUP * column)
    for down in range(GROUP):
        for across in range(GROUP):
            place = place_in_level(width, 1, GROUP * row + down, GROUP * column + across)
            assert place == first + GROUP * down + across
    if (row + 1) % STRIP != 0:
        assert place_in_level(width, 1, GROUP * (row + 1), GROUP * column) == first + GROUP * GROUP


@settings(max_examples=30)
@given(
    st.sampled_from(["aligned", "full"]), st.integers(1, 130), st.integers(1, 90), st.floats(-50, 150), st.floats(2, 60)
)
def test_each_cell_has_the_slot_of_its_square(
    renderer: Renderer, pool: WorkerPool, kind: str, width: int, height: int, gaze: float, width_cm: float
) -> None:
    """Whether it is found alone or with its group, and whatever cells stand beside it."""
    cells = cell_map(renderer, kind, (gaze, 0.5 * gaze), Display(width, height, width_cm=width_cm))
    sides, starts = aligned_levels(width, height)
    row, column = cells.y // cells.side, cells.x // cells.side
    expected = starts[np.searchsorted(sides, cells.side)] + place_in_level(width, cells.side, row, column)
    np.testing.assert_array_equal(slots_of(cells, pool), expected)


@pytest.mark.parametrize("what", ["nothing", "x", "y", "side"])
def test_what_is_almost_a_group_is_none(pool: WorkerPool, what: str) -> None:
    """Sixteen cells of which two have changed columns or rows, or one is larger, have slots by their own squares."""
    across, down = np.meshgrid(np.arange(GROUP, dtype=np.int32), np.arange(GROUP, dtype=np.int32))
    x, y, side = 2 * (8 + across.ravel()), 2 * (4 + down.ravel()), np.full(LANES, 2, np.int32)
    if what == "x":
        x[[5, 6]] = x[[6, 5]]
    elif what == "y":
        y[[5, 9]] = y[[9, 5]]
    elif what == "side":
        side[5] = 1
    cells = CellMap("aligned", GazeBucket(0.0, 0.0, 16), x, y, side, np.zeros((54, 96), np.int32))
    sides, starts = aligned_levels(96, 54)
    expected = starts[np.searchsorted(sides, side)] + place_in_level(96, side, y // side, x // side)
    np.testing.assert_array_equal(slots_of(cells, pool), expected)


@kernel
def read_at(column: NDArray[np.float32], slots: NDArray[np.int32], found: NDArray[np.float64]) -> None:
    keep(found, 0, at_slots(column, entry(slots, lane_numbers(0)), slots[0]))


@given(st.sampled_from(["in a row", "with gaps", "turned"]), st.integers(0, 60))
def test_numbers_at_slots_are_those_of_each(order: str, first: int) -> None:
    """Nothing behind the last slot is read."""
    draw = np.random.default_rng(first)
    slots = first + np.arange(LANES, dtype=np.int32)
    if order == "with gaps":
        slots[draw.integers(1, LANES) :] += 1
    elif order == "turned":
        draw.shuffle(slots)
    column, found = draw.normal(size=slots.max() + 1).astype(np.float32), np.zeros((1, LANES))
    read_at(column, slots, found)
    np.testing.assert_array_equal(found[0], column[slots])


@pytest.mark.parametrize("size", [(1, 1), (17, 13), (96, 54), (5, 300)])
def test_pixel_slots_are_those_of_a_full_map(renderer: Renderer, pool: WorkerPool, size: tuple[int, int]) -> None:
    cells = cell_map(renderer, "full", (0, 0), Display(*size, width_cm=5.0))
    np.testing.assert_array_equal(pixel_slots(*size), slots_of(cells, pool)[cells.mask.ravel()])


def test_most_cells_have_the_slot_behind_that_of_the_cell_before(renderer: Renderer, pool: WorkerPool) -> None:
    """All of a strip of a tile do: of single pixels 72, of squares of two 36."""
    screen = Display(960, 540, width_cm=25.0)
    for kind, least in (("full", 0.98), ("aligned", 0.97)):
        slots = slots_of(renderer.cell_map(screen, Quality(map=kind), Gaze(480.0, 270.0))[0], pool)
        assert np.mean(np.diff(slots) == 1) > least


def test_a_large_screen_takes_memory_for_its_cells_and_little_more(renderer: Renderer, pool: WorkerPool) -> None:
    """Of 870 MB of slots 24 MB hold samples; huge pages would take 460."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        pytest.skip("needs /proc, as Linux has it")

    def resident() -> int:
        return int(statm.read_text().split()[1]) * mmap.PAGESIZE

    cells = renderer.cell_map(Display(5400, 3900), Quality(), Gaze(2700.0, 1950.0))[0]
    slots = slots_of(cells, pool)
    store = SampleStore(slots_needed(cells), cells=cells.cells)
    before = resident()
    for numbers in store.samples:
        numbers[slots] = 1
    assert resident() - before < 5 * cells.cells * store.nbytes / slots_needed(cells)
