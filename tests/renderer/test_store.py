"""The sample store: sums do not remember how they were gathered."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.store import (
    CHUNK_CELLS,
    LUMINANCE,
    SampleStore,
    add_samples,
    missing_cells,
)
from renderer.workers import WorkerPool


def sample(radiance: NDArray[np.float32], *parts: int) -> SampleStore:
    """Two cells in slots 5 and 2; `radiance` is (2, n, 3), added in parts of these lengths."""
    store, slots, cells = SampleStore(7), np.array([5, 2]), np.array([0, 1], np.int32)
    for sums in (store.samples.total, store.samples.shown, store.samples.square):
        sums[:] = np.nan  # what a new store finds in its memory is nobody's sample
    start = 0
    for length in parts:
        part = np.ascontiguousarray(radiance[:, start : start + length]).reshape(-1, 3)
        start += length
        assert add_samples(
            store.samples, store.spread, store.white, slots, cells, np.full(2, start, np.int32), part
        ) == (0, 0, 0)
    return store


def test_sums_do_not_depend_on_the_parts_they_were_added_in() -> None:
    radiance = np.random.default_rng(0).random((2, 9, 3)).astype(np.float32)
    at_once, in_parts = sample(radiance, 9), sample(radiance, 1, 3, 5)
    for one, two in zip(at_once.samples, in_parts.samples, strict=True):
        np.testing.assert_array_equal(one[[5, 2]], two[[5, 2]])
    np.testing.assert_allclose(at_once.samples.total[[5, 2]], radiance.sum(axis=1), rtol=1e-6)
    luminance = radiance @ np.array(LUMINANCE)
    np.testing.assert_allclose(at_once.samples.square[[5, 2]], (luminance**2).sum(axis=1), rtol=1e-5)
    assert at_once.samples.number.tolist() == [0, 0, 9, 0, 0, 9, 0]


def test_cells_get_different_numbers_of_samples() -> None:
    radiance = np.random.default_rng(1).random((7, 3)).astype(np.float32)
    store, slots, both = SampleStore(2), np.array([1, 0]), np.array([0, 1], np.int32)
    assert add_samples(
        store.samples, store.spread, store.white, slots, both, np.array([2, 1], np.int32), radiance[[0, 1, 4]]
    ) == (0, 0, 0)
    assert add_samples(
        store.samples, store.spread, store.white, slots, both, np.array([4, 3], np.int32), radiance[[2, 3, 5, 6]]
    ) == (0, 0, 0)
    assert store.samples.number.tolist() == [3, 4]
    np.testing.assert_allclose(store.samples.total[1], radiance[:4].sum(axis=0), rtol=1e-6)
    np.testing.assert_allclose(store.samples.total[0], radiance[4:].sum(axis=0), rtol=1e-6)


def test_cells_with_too_few_samples_are_missing(pool: WorkerPool) -> None:
    store = sample(np.ones((2, 4, 3), np.float32), 4)
    store.samples.number[1] = 3
    slots = np.array([5, 1, 2, 0])

    def missing(some: NDArray[np.int64], wanted: int) -> tuple[list[int], list[int], int, int]:
        found = missing_cells(store, some, wanted, pool)
        return found.cells.tolist(), found.first.tolist(), found.held, found.fewest

    assert missing(slots, 4) == ([1, 3], [3, 0], 11, 0)
    assert missing(slots, 1) == ([3], [0], 11, 0)
    assert missing(slots, 5) == ([0, 1, 2, 3], [4, 3, 4, 0], 11, 0)
    assert missing(slots[:3], 2) == ([], [], 11, 3)


def test_settled_cells_are_not_missing(pool: WorkerPool) -> None:
    store = SampleStore(3, adaptive=True)
    store.samples.number[:] = (4, 4, 8)
    store.spread.settled[:] = (0, 1, 0)
    found = missing_cells(store, np.array([2, 1, 0]), 9, pool)
    assert (found.cells.tolist(), found.first.tolist(), found.held, found.fewest) == ([0, 2], [8, 4], 16, 4)


def test_what_is_missing_is_found_in_parts_and_in_order(pool: WorkerPool) -> None:
    """Several chunks, against a look at all cells at once."""
    cells = 3 * CHUNK_CELLS + 17
    rng = np.random.default_rng(0)
    store, slots = SampleStore(cells), rng.permutation(cells)
    store.samples.number[:] = rng.integers(0, 4, cells)
    found = missing_cells(store, slots, 3, pool)
    number = store.samples.number[slots]
    np.testing.assert_array_equal(found.cells, np.flatnonzero(number < 3))
    np.testing.assert_array_equal(found.first, number[number < 3])
    assert (found.held, found.fewest) == (number.sum(), 0)


def test_a_store_states_its_size() -> None:
    assert SampleStore(1000).nbytes == sum(array.nbytes for array in SampleStore(1000).samples)
