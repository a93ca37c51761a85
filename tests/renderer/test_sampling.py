"""Where camera rays go: the centre first, then even over the cell, the same for every gaze and frame."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.rays import make_rays, rows_of
from renderer.sampling import camera_rays, lattice_step
from tests.renderer.cell_point import PIXEL_VIEW, SCREEN_PX, places

CHI_SQUARE_63 = 131.7
"""Exceeded by uniform numbers in 64 bins once in a million tests (Wilson and Hilferty)."""


def chi_square(u: NDArray[np.float64], v: NDArray[np.float64]) -> float:
    """Of points in [0, 1)^2 sorted into 8 x 8 bins."""
    counts = np.bincount((u * 8).astype(int) * 8 + (v * 8).astype(int), minlength=64)
    assert len(counts) == 64
    expected = len(u) / 64
    return float(((counts - expected) ** 2 / expected).sum())


@given(st.integers(0, 500), st.integers(0, 500), st.sampled_from([1, 2, 3, 8, 96]), st.integers(1, 40), st.booleans())
def test_the_first_sample_goes_to_the_centre(x: int, y: int, side: int, samples: int, regular: bool) -> None:
    np.testing.assert_allclose(places([(x, y, side)], samples, regular=regular)[0, 0], side / 2, rtol=1e-6)


@given(
    st.tuples(st.integers(0, 99), st.integers(0, 66), st.integers(1, 120)),
    st.integers(2, 64),
    st.booleans(),
)
def test_all_samples_lie_inside_the_cell_also_where_the_screen_ends(
    cell: tuple[int, int, int], samples: int, regular: bool
) -> None:
    x, y, side = cell
    inside = places([cell], samples, regular=regular, screen=(100, 67))[0]
    assert (inside >= 0).all()
    assert (inside[:, 0] <= min(side, 100 - x) * (1 + 1e-6)).all()
    assert (inside[:, 1] <= min(side, 67 - y) * (1 + 1e-6)).all()


def test_stochastic_samples_of_a_cell_are_uniform_over_it() -> None:
    inside = places([(7, 9, 1)], 65_537)[0, 1:]
    assert chi_square(inside[:, 0], inside[:, 1]) < CHI_SQUARE_63


def test_the_same_sample_of_many_cells_is_uniform() -> None:
    cells = [(x, y, 1) for y in range(256) for x in range(256)]
    second = places(cells, 1, first=1)[:, 0] % 1.0
    assert chi_square(second[:, 0], second[:, 1]) < CHI_SQUARE_63


def test_neighbouring_cells_and_following_samples_are_independent() -> None:
    cells = [(0, y, 1) for y in range(65_536 // 4)]
    two = places(cells, 2, first=1) % 1.0
    assert chi_square(two[:-1, 0, 0], two[1:, 0, 0]) < CHI_SQUARE_63
    assert chi_square(two[:, 0, 1], two[:, 1, 1]) < CHI_SQUARE_63


def test_cells_of_other_sides_at_the_same_place_get_other_samples() -> None:
    one, two = places([(8, 8, 1)], 9)[0, 1:], places([(8, 8, 2)], 9)[0, 1:] / 2
    assert np.abs(one - two).min() > 1e-6


@given(st.integers(2, 50), st.integers(1, 50), st.integers(1, 7))
def test_a_sample_does_not_depend_on_how_many_there_are(samples: int, more: int, first: int) -> None:
    cell = (40, 24, 8)
    few, many = places([cell], samples)[0], places([cell], samples + more)[0]
    np.testing.assert_array_equal(few, many[:samples])
    later = places([cell], samples, first=first)[0]
    np.testing.assert_array_equal(later, places([cell], first + samples)[0, first:])


def test_a_sample_does_not_depend_on_the_other_cells_of_the_frame() -> None:
    cells = [(0, 0, 1), (64, 64, 8), (16, 40, 4), (1, 0, 1)]
    together = places(cells, 5)
    for index in range(len(cells)):
        alone = places([(0, 0, 1), cells[index]], 5)[1]
        np.testing.assert_array_equal(together[index], alone)


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 7, 8, 9, 16, 25, 64, 100, 600])
def test_regular_samples_cover_the_cell(samples: int) -> None:
    """One in each of n columns, equally many in each row they use, no lean to a side beyond the first's."""
    inside = places([(0, 0, 1)], samples, regular=True)[0]
    shared = math.gcd(lattice_step(samples), samples)
    rows = samples // shared
    assert sorted((inside[:, 0] * samples + 1e-3).astype(int)) == list(range(samples))
    counts = np.bincount((inside[:, 1] * rows + 1e-3).astype(int), minlength=rows)
    assert (counts == shared).all()
    lean = np.abs(inside.mean(axis=0) - 0.5)
    assert lean[0] <= 0.5 / samples**2 + 1e-6
    assert lean[1] <= 0.5 * shared / samples**2 + 1e-6


def test_regular_samples_keep_apart() -> None:
    for samples in (16, 64, 256):
        inside = places([(0, 0, 1)], samples, regular=True)[0]
        apart = np.linalg.norm(inside[:, None] - inside[None], axis=2) + 9 * np.eye(samples)
        assert apart.min() > 0.5 / math.sqrt(samples)


@pytest.mark.parametrize("points", [2, 8, 13, 16, 32, 100])
def test_the_first_of_many_regular_samples_are_spread_over_the_cell(points: int) -> None:
    """No gap between the columns of the first n is wider than three times an even one."""
    for samples in range(1, points + 1):
        inside = np.sort(places([(0, 0, 1)], samples, regular=True, points=points)[0, :, 0])
        gaps = np.diff(np.append(inside, inside[0] + 1))
        assert gaps.max() <= 3 / samples + 1e-6


def test_regular_samples_taken_in_parts_are_those_taken_at_once() -> None:
    cell = [(5, 7, 3)]
    whole = places(cell, 12, regular=True)
    parts = [places(cell, n, first=first, regular=True, points=12) for first, n in ((0, 1), (1, 6), (7, 5))]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)


def test_cells_of_one_call_may_be_sampled_from_different_samples_on() -> None:
    x = y = np.array([0, 0], np.int32)
    side = np.array([4, 4], np.int32)
    rays, cells = make_rays(5), np.array([1, 0], np.int32)
    camera_rays(
        PIXEL_VIEW, np.zeros(3, np.float32), SCREEN_PX, SCREEN_PX, x, y, side, cells,
        np.array([2, 7], np.int32), np.array([5, 9], np.int32), 9, 0, 1, rays,
    )  # fmt: skip
    direction = rows_of(rays.direction)
    seen = direction[:, :2] / direction[:, 2:]
    np.testing.assert_allclose(seen, places([(0, 0, 4)], 9)[0, [2, 3, 4, 7, 8]], rtol=1e-5)
    assert rays.sample.tolist() == [0, 1, 2, 3, 4]


def test_a_lattice_of_one_or_two_points_exists() -> None:
    assert lattice_step(1) == lattice_step(2) == 1
