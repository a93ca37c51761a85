"""From cells to pixels: each pixel is its cell's mean, exposed and tone-mapped."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.cellmap import CellMap
from renderer.gaze import GazeBucket
from renderer.reconstruction import reconstruct
from renderer.store import Samples, SampleStore, add_samples
from renderer.tonemap import encode_srgb
from renderer.workers import WorkerPool


@pytest.fixture(scope="module")
def pool() -> Iterator[WorkerPool]:
    made = WorkerPool(2)
    yield made
    made.close()


def random_cells(seed: int, width: int, height: int) -> tuple[CellMap, NDArray[np.int64], Samples]:
    """A mask of scattered cells, their slots in another order, and samples of 1 to 9 rays."""
    rng = np.random.default_rng(seed)
    cells = int(rng.integers(1, width * height + 1))
    mask = rng.integers(0, cells, (height, width)).astype(np.int32)
    zeros = np.zeros(cells, np.int32)
    slots = rng.permutation(2 * cells)[:cells]
    count = rng.integers(1, 10, 2 * cells).astype(np.int32)
    total = (10 ** rng.uniform(-4, 1, (2 * cells, 3)) * count[:, None]).astype(np.float32)
    total[rng.random(2 * cells) < 0.1] = 0.0
    cell_map = CellMap("aligned", GazeBucket(0, 0, 0), zeros, zeros.copy(), zeros + 1, mask)
    unused = np.zeros(2 * cells, np.float32)
    return cell_map, slots, Samples(total, unused, unused, count, np.zeros(2 * cells, np.int32))


def fresh(samples: Samples) -> Samples:
    """The same, never shown."""
    return samples._replace(colour=np.zeros_like(samples.colour))


@given(st.integers(0, 2**32), st.integers(1, 40), st.integers(1, 150))
def test_each_pixel_is_the_mean_of_its_cell(pool: WorkerPool, seed: int, width: int, height: int) -> None:
    cell_map, slots, samples = random_cells(seed, width, height)
    seen = reconstruct(cell_map, slots, samples, 3.0, True, pool)
    slot = slots[cell_map.mask]
    assert seen.dtype == np.float32
    assert seen.shape == (height, width, 3)
    np.testing.assert_allclose(seen, samples.total[slot] / samples.number[slot][..., None], rtol=2e-7)


@given(st.integers(0, 2**32), st.sampled_from([1e-3, 0.25, 1.0, 3.0, 1e4]))
def test_the_picture_is_the_exposed_linear_frame_in_srgb(pool: WorkerPool, seed: int, exposure: float) -> None:
    """Bit for bit with an exposure that is a power of two, else but for a rounding at the edge of a code."""
    cell_map, slots, samples = random_cells(seed, 37, 23)
    linear = reconstruct(cell_map, slots, samples, exposure, True, pool)
    picture = reconstruct(cell_map, slots, samples, exposure, False, pool)
    assert picture.dtype == np.uint8
    difference = np.abs(picture.astype(int) - encode_srgb(linear * np.float32(exposure)))
    assert difference.max() <= (0 if exposure in (0.25, 1.0) else 1)
    assert (difference > 0).mean() < 0.001


def test_threads_change_nothing(pool: WorkerPool) -> None:
    cell_map, slots, samples = random_cells(7, 300, 500)
    alone = WorkerPool(1)
    for linear in (False, True):
        together = reconstruct(cell_map, slots, fresh(samples), 1.5, linear, pool)
        np.testing.assert_array_equal(together, reconstruct(cell_map, slots, fresh(samples), 1.5, linear, alone))
    alone.close()


@given(st.integers(0, 2**32), st.integers(1, 40), st.integers(1, 150))
def test_what_was_shown_before_changes_nothing(pool: WorkerPool, seed: int, width: int, height: int) -> None:
    """Some cells seen before, and some of these with further samples since: as if all were seen for the first time."""
    cell_map, slots, samples = random_cells(seed, width, height)
    store, rng = SampleStore(len(samples.number)), np.random.default_rng(seed)
    for mine, theirs in zip(store.samples, samples, strict=True):
        mine[:] = theirs
    half = -(-cell_map.cells // 2)
    zeros = np.zeros(half, np.int32)
    seen = CellMap("aligned", cell_map.bucket, zeros, zeros, zeros + 1, cell_map.mask % half)
    reconstruct(seen, slots[:half], store.samples, 2.0, False, pool)
    chosen = np.flatnonzero(rng.random(cell_map.cells) < 0.3).astype(np.int32)
    until = store.samples.number[slots[chosen]] + 1
    light = rng.random((len(chosen), 3), dtype=np.float32)
    add_samples(store.samples, store.spread, store.white, slots, chosen, until, light)
    np.testing.assert_array_equal(
        reconstruct(cell_map, slots, store.samples, 2.0, False, pool),
        reconstruct(cell_map, slots, fresh(store.samples), 2.0, False, pool),
    )


@pytest.mark.parametrize("exposure", [1e-12, 1e12])
def test_extreme_exposures_are_black_and_white(pool: WorkerPool, exposure: float) -> None:
    cell_map, slots, samples = random_cells(3, 20, 20)
    picture = reconstruct(cell_map, slots, samples, exposure, False, pool)
    lit = samples.total[slots[cell_map.mask]] > 0
    np.testing.assert_array_equal(picture[~lit], 0)
    np.testing.assert_array_equal(picture[lit], 0 if exposure < 1 else 255)
