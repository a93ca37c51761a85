"""Gazes and screens of every size: the map is a partition, buckets are half open, frames are complete."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from renderer.acuity import Acuity
from renderer.cellmap import build_cell_map, cell_sizes
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg, eye_geometry, largest_cell_side
from renderer.errors import SettingsError
from renderer.frame import FrameRequest
from renderer.gaze import Gaze, GazeBucket, bucket_of
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import MAPS, MAX_BUCKET_PX, Quality
from renderer.workers import WorkerPool
from tests.renderer.drawing import glass_and_mirror
from tests.renderer.viewing import (
    MARGINS,
    PAPER_SCREEN,
    ROUNDING,
    SIDES,
    acuities,
    displays,
    full_widths,
    gazes,
    pixels_of_each,
    sizes_at,
    true_cell_size,
)

COORDINATES = st.floats(-1e30, 1e30)
BUCKET_SIDES = st.integers(1, 512)


@pytest.mark.parametrize(
    ("x", "y"), [(-5000, 540), (1e9, 1e9), (0, 0), (1920, 1080), (1919.5, 1079.5), (1e30, -1e30), (-0.0, 5e-324)]
)
def test_h57_the_gaze_may_lie_off_the_screen(x: float, y: float) -> None:
    assert (Gaze(x, y).x, Gaze(x, y).y) == (x, y)


@pytest.mark.parametrize("field", ["x", "y"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.1e30, 10**400, None, "960", True, [1.0]])
def test_h57_a_gaze_that_is_not_two_finite_numbers_is_refused(field: str, value: object) -> None:
    """Here, at the edge. A session counts a gaze that is not valid as lost: the last good one holds, then the whole
    screen is rendered as fine as the fovea (tests/service/test_conditioning.py).
    """
    with pytest.raises(SettingsError) as refused:
        Gaze(**({"x": 1.0, "y": 2.0} | {field: value}))  # type: ignore[arg-type]
    assert refused.value.field == f"gaze.{field}"


@pytest.mark.parametrize("gaze", [Gaze(-5000.0, 540.0), Gaze(1e9, 1e9), Gaze(-1e30, 1e30)])
def test_h57_a_gaze_off_the_screen_has_a_coarse_map(gaze: Gaze, pool: WorkerPool) -> None:
    beside = build_cell_map("aligned", PAPER_SCREEN, Acuity(), bucket_of(gaze, 16), pool)
    middle = build_cell_map("aligned", PAPER_SCREEN, Acuity(), bucket_of(Gaze(960.0, 540.0), 16), pool)
    assert 1 <= beside.cells < middle.cells / 5
    assert pixels_of_each(beside).sum() == PAPER_SCREEN.pixels


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (3, 5), (17, 13)])
@pytest.mark.parametrize("tiling", MAPS)
def test_h61_odd_screens(renderer: Renderer, size: tuple[int, int], tiling: str) -> None:
    display = Display(*size, width_cm=0.05 * size[0])
    quality = Quality(map=tiling, samples_per_cell=2, acuity=Acuity(scale=30.0))
    request = FrameRequest(Gaze(size[0] / 2, 1e6), display, None, quality, linear=True)
    frame = renderer.render(prepare(glass_and_mirror()), request)
    assert frame.pixels.shape == (size[1], size[0], 3)
    assert np.isfinite(frame.pixels).all()
    assert frame.cost.cells_traced + frame.cost.cells_reused == frame.cost.cells <= size[0] * size[1]


def test_h61_a_display_of_one_pixel_has_one_cell_size() -> None:
    for distance_cm in (1e-8, 60.0, 1e8):
        sizes = sizes_at(Display(1, 1, 50.0, 35.0, distance_cm), Acuity(scale=1000.0), Gaze(1e30, -1e30))
        assert sizes.tolist() == [[1]]


@given(data=st.data(), acuity=acuities(MARGINS), bucket_px=st.sampled_from([0, 1, 16, 100, MAX_BUCKET_PX]))
def test_h62_aligned_cells_tile_the_screen_with_squares_on_multiples_of_their_sides(
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
def test_h62_scanline_cells_share_the_screen_out(
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
def test_h62_a_full_map_has_a_cell_for_each_pixel(data: st.DataObject, pool: WorkerPool) -> None:
    display = data.draw(displays())
    bucket = bucket_of(data.draw(gazes(display)), 16)
    cells = build_cell_map("full", display, Acuity(), bucket, pool)
    assert cells.cells == display.pixels
    assert (cells.side == 1).all()
    rows, columns = np.indices(cells.mask.shape)
    assert_array_equal(cells.x[cells.mask], columns)
    assert_array_equal(cells.y[cells.mask], rows)
    assert_array_equal(pixels_of_each(cells), 1)


@given(data=st.data(), acuity=acuities(), bucket_px=st.sampled_from([0, 1, 16, 100, MAX_BUCKET_PX]))
def test_h62_no_aligned_cell_is_coarser_than_any_gaze_of_its_bucket_allows_at_any_of_its_pixels(
    data: st.DataObject, acuity: Acuity, bucket_px: int, pool: WorkerPool
) -> None:
    display = data.draw(displays(150, 150))
    bucket = bucket_of(data.draw(gazes(display)), bucket_px)
    cells = build_cell_map("aligned", display, acuity, bucket, pool)
    part = st.sampled_from([-0.5, 0.5]) | st.floats(-0.5, 0.5)
    gaze = Gaze(bucket.x + data.draw(part) * bucket_px, bucket.y + data.draw(part) * bucket_px)
    allowed = true_cell_size(display, acuity, gaze)
    assert (full_widths(cells) <= allowed * (1 + ROUNDING)).all(), gaze


def test_h63_buckets_are_half_open() -> None:
    for border, bucket in [(8.0, 1), (24.0, 2), (40.0, 3), (-8.0, 0), (-24.0, -1)]:
        below, above = math.nextafter(border, -math.inf), math.nextafter(border, math.inf)
        assert bucket_of(Gaze(border, border), 16) == GazeBucket(16 * bucket, 16 * bucket, 16)
        assert bucket_of(Gaze(above, below), 16) == GazeBucket(16 * bucket, 16 * (bucket - 1), 16)


@given(COORDINATES, COORDINATES, BUCKET_SIDES)
@example(0.49999999999999994, 1.5, 1)
@example(-1e-20, 1e16 - 2, 3)
def test_h63_every_gaze_lies_in_its_bucket_exactly(x: float, y: float, side: int) -> None:
    bucket = bucket_of(Gaze(x, y), side)
    assert bucket.side_px == side
    for centre, coordinate in ((bucket.x, x), (bucket.y, y)):
        assert centre % side == 0
        assert -Fraction(side, 2) <= Fraction(coordinate) - Fraction(centre) < Fraction(side, 2)


@given(
    st.integers(-4000, 4000),
    BUCKET_SIDES,
    st.floats(-0.5, 0.5, exclude_max=True),
    st.floats(-0.5, 0.5, exclude_max=True),
)
def test_h63_two_gazes_of_a_square_share_its_bucket(number: int, side: int, right: float, down: float) -> None:
    centre = number * side
    gaze = Gaze(centre + right * side, centre + down * side)
    if gaze.x - centre < side / 2 and gaze.y - centre < side / 2:
        assert bucket_of(gaze, side) == bucket_of(Gaze(centre, centre), side) == GazeBucket(centre, centre, side)


def test_h63_gazes_of_a_bucket_share_the_map_and_others_do_not() -> None:
    fresh = Renderer(threads=1)
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
    fresh.close()


@pytest.mark.parametrize("tiling", MAPS)
@pytest.mark.parametrize(("width", "height"), [(16_384, 24), (24, 16_384), (15_360, 9), (1, 16_384)])
def test_h61_screens_16384_wide_are_shared_out(tiling: str, width: int, height: int, pool: WorkerPool) -> None:
    """Strips of them: a whole one, 141 million pixels, takes 4 bytes a pixel for its mask, and is no other code."""
    display = Display(width, height, width_cm=width / 100)
    cells = build_cell_map(tiling, display, Acuity(scale=3.0), bucket_of(Gaze(width * 0.9, height / 2), 16), pool)
    owned = pixels_of_each(cells)
    assert owned.min() >= 1
    assert owned.sum() == width * height
    assert (cells.x + 1 <= width).all()
    assert (cells.y + 1 <= height).all()
    assert cells.x.max() < width
    assert cells.x[cells.mask].dtype == np.int32


@given(data=st.data(), acuity=acuities(MARGINS), bucket_px=st.sampled_from([0, 16, MAX_BUCKET_PX]))
def test_h62_no_cell_is_larger_than_the_strips_are_made_for(
    data: st.DataObject, acuity: Acuity, bucket_px: int
) -> None:
    """The bound that the tiles of the aligned tiling are sized by, for any screen and gaze."""
    display = data.draw(displays(120, 90))
    bucket = bucket_of(data.draw(gazes(display)), bucket_px)
    assert cell_sizes(display, acuity, bucket).max() <= largest_cell_side(eye_geometry(display, acuity, bucket))


@pytest.mark.parametrize("gaze", [Gaze(-1e6, 30.0), Gaze(1e30, 30.0), Gaze(-500.0, -500.0), Gaze(33.0, -9e3)])
@pytest.mark.parametrize("distance_cm", [0.01, 0.3, 1.25, 2.0])
def test_h62_the_bound_holds_beyond_a_right_angle(gaze: Gaze, distance_cm: float) -> None:
    """An eye so near a wide screen that gaze and pixel are more than 90 degrees apart: the greatest eccentricity, and
    with it the largest cell, is then in the middle of a side and not in a corner. Half a turn is taken for it.
    """
    display = Display(400, 60, 50.0, None, distance_cm)
    assert eccentricity_deg(display, gaze).max() > 90.0
    for scale in (0.1, 3.0):
        acuity, bucket = Acuity(scale=scale), GazeBucket(gaze.x, gaze.y, 0)
        assert cell_sizes(display, acuity, bucket).max() <= largest_cell_side(eye_geometry(display, acuity, bucket))
