"""What is drawn on a frame: where, in which colour, and that the frame itself stays as it was."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.gaze import Gaze, GazeBucket
from renderer.overlay import (
    CELL_TINT,
    CROSS_COLOUR,
    RAY_COLOURS,
    RAY_TINT,
    RINGS,
    SIDE_COLOURS,
    draw_cells,
    draw_gaze,
    draw_rays,
    draw_region_of_interest,
)

SMALL = Display(width_px=160, height_px=90, width_cm=50, distance_cm=60)


def grey(height: int, width: int, value: int = 128) -> NDArray[np.uint8]:
    return np.full((height, width, 3), value, dtype=np.uint8)


def squares(side: int, columns: int, rows: int) -> CellMap:
    """A map of equal square cells."""
    row, column = np.divmod(np.arange(rows * columns, dtype=np.int32), columns)
    ids = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    return CellMap(
        kind="aligned",
        bucket=GazeBucket(0.0, 0.0, 0),
        x=column * side,
        y=row * side,
        side=np.full(rows * columns, side, dtype=np.int32),
        mask=np.repeat(np.repeat(ids, side, axis=0), side, axis=1),
    )


def drawn_pixels(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> set[tuple[int, int]]:
    rows, columns = np.nonzero((before != after).any(axis=2))
    return set(zip(columns.tolist(), rows.tolist(), strict=True))


def test_cells_of_one_pixel_stay_as_they_are() -> None:
    rng = np.random.default_rng(1)
    frame = rng.integers(0, 256, (6, 8, 3), dtype=np.uint8)
    np.testing.assert_array_equal(draw_cells(frame, squares(1, 8, 6)), frame)


@pytest.mark.parametrize(("side", "stop"), [(2, 0), (4, 1), (8, 2), (16, 3), (32, 4), (256, 4)])
def test_a_cell_is_tinted_with_the_colour_of_its_side(side: int, stop: int) -> None:
    inside = draw_cells(grey(side, side, 0), squares(side, 1, 1))[side - 1, side - 1]
    np.testing.assert_allclose(inside, SIDE_COLOURS[stop] * CELL_TINT, atol=0.51)


def test_a_tinted_frame_never_wraps_around() -> None:
    white = draw_cells(grey(32, 32, 255), squares(32, 1, 1))
    assert white[16, 16, 0] >= 250, "yellow over white stays bright"


def test_large_cells_have_dark_edges_where_they_meet_and_small_ones_none() -> None:
    frame = grey(16, 16)
    large = draw_cells(frame, squares(8, 2, 2))
    inside = large[4, 4]
    for x, y in ((8, 3), (3, 8), (8, 8), (8, 12)):
        assert (large[y, x] < inside).all(), f"edge at {x}, {y}"
    for x, y in ((7, 3), (0, 0), (3, 0), (9, 9)):
        np.testing.assert_array_equal(large[y, x], inside, f"no edge at {x}, {y}")
    assert len(np.unique(draw_cells(frame, squares(2, 8, 8)).reshape(-1, 3), axis=0)) == 1


@pytest.mark.parametrize(
    ("samples", "side", "stop"),
    [(1, 16, 0), (1, 8, 0), (8, 8, 1), (1, 1, 2), (64, 8, 2), (8, 1, 3), (64, 1, 4), (256, 1, 4)],
)
def test_rays_a_pixel_are_samples_over_the_area_of_the_cell(samples: int, side: int, stop: int) -> None:
    drawn = draw_rays(grey(16, 16, 0), squares(side, 16 // side, 16 // side), samples)
    np.testing.assert_allclose(drawn, np.broadcast_to(RAY_COLOURS[stop] * RAY_TINT, drawn.shape), atol=0.51)
    assert draw_rays(grey(16, 16, 255), squares(side, 16 // side, 16 // side), samples).min() >= 89, (
        "never wraps around"
    )


def test_rings_lie_where_the_eccentricity_crosses_them() -> None:
    frame, gaze = grey(90, 160), Gaze(60.0, 40.0)
    rings = draw_region_of_interest(frame, SMALL, gaze)
    angles = eccentricity_deg(SMALL, gaze)
    pixel_deg = 0.35
    for ring_deg, colour in RINGS:
        on_ring = angles[(rings == colour).all(axis=2)]
        assert on_ring.size > 20
        assert on_ring.min() > ring_deg - pixel_deg * 1.5
        assert on_ring.max() < ring_deg


def test_rings_are_not_drawn_along_the_border_of_the_screen() -> None:
    near = Display(width_px=20, height_px=10, width_cm=1, distance_cm=60)
    frame = grey(10, 20)
    np.testing.assert_array_equal(draw_region_of_interest(frame, near, Gaze(10.0, 5.0)), frame)


def test_rings_follow_the_eye_position_that_is_asked_for() -> None:
    frame, gaze = grey(90, 160), Gaze(150.0, 10.0)
    exact = draw_region_of_interest(frame, SMALL, gaze, "exact")
    paper = draw_region_of_interest(frame, SMALL, gaze, "paper")
    assert drawn_pixels(exact, paper)


def test_lines_grow_with_the_frame() -> None:
    small, large = Display(width_px=192, height_px=108), Display(width_px=3840, height_px=2160)
    colour = RINGS[-1][1]

    def thickness(display: Display) -> int:
        gaze = Gaze(display.width_px / 2, display.height_px / 2)
        rings = draw_region_of_interest(grey(display.height_px, display.width_px), display, gaze)
        column = (rings[:, display.width_px // 2] == colour).all(axis=1)
        return int(column[: display.height_px // 2].sum())

    assert thickness(small) == 1
    assert thickness(large) == 5


def test_the_cross_is_centred_on_the_gaze_and_open_in_the_middle() -> None:
    frame = grey(90, 160)
    drawn = draw_gaze(frame, Gaze(80.5, 45.5))
    red = {place for place in drawn_pixels(frame, drawn) if tuple(drawn[place[1], place[0]]) == CROSS_COLOUR}
    assert (80, 45) not in red
    assert (80 + 10, 45) in red
    assert red == {(160 - x, y) for x, y in red} == {(x, 90 - y) for x, y in red}


def test_a_cross_at_the_rim_is_clipped_and_a_far_gaze_draws_nothing() -> None:
    frame = grey(90, 160)
    rim = drawn_pixels(frame, draw_gaze(frame, Gaze(0.5, 0.5)))
    assert rim
    assert max(x for x, _ in rim) < 20
    for far in (Gaze(-500.0, 45.0), Gaze(80.0, 1e30), Gaze(-1e30, -1e30)):
        np.testing.assert_array_equal(draw_gaze(frame, far), frame)


def test_the_frame_itself_is_never_changed() -> None:
    frame = grey(90, 160)
    frame.flags.writeable = False
    gaze = Gaze(80.0, 45.0)
    cells = CellMap(
        kind="full",
        bucket=GazeBucket(0.0, 0.0, 0),
        x=np.zeros(1, dtype=np.int32),
        y=np.zeros(1, dtype=np.int32),
        side=np.full(1, 160, dtype=np.int32),
        mask=np.zeros((90, 160), dtype=np.int32),
    )
    for drawn in (draw_cells(frame, cells), draw_gaze(frame, gaze), draw_region_of_interest(frame, SMALL, gaze)):
        assert drawn.dtype == np.uint8
        assert drawn_pixels(frame, drawn)
    np.testing.assert_array_equal(frame, 128)


def test_a_frame_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match=r"expected pixels of shape \(16, 16, 3\), found \(90, 160, 3\)"):
        draw_cells(grey(90, 160), squares(8, 2, 2))
    with pytest.raises(ValueError, match="expected pixels of shape"):
        draw_rays(grey(90, 160), squares(8, 2, 2), 1)
    with pytest.raises(ValueError, match="expected pixels of shape"):
        draw_region_of_interest(grey(16, 16), SMALL, Gaze(0.0, 0.0))
