"""Counts of cells from a look at few places, against the maps themselves."""

from __future__ import annotations

import numpy as np
import pytest

from renderer.acuity import ECCENTRICITIES, Acuity
from renderer.display import Display
from renderer.forecast import forecast_held
from renderer.gaze import Gaze, bucket_of
from renderer.pipeline import Renderer
from renderer.quality import Quality
from renderer.slots import aligned_slots, slots_of
from renderer.store import held_by_number
from renderer.workers import WorkerPool

SCREEN = Display(960, 540, 50.0, 35.0, 60.0)
NOTHING, NO_FLAGS = np.zeros(0, np.int32), np.zeros(0, np.uint8)


@pytest.mark.parametrize("eccentricity", ECCENTRICITIES)
@pytest.mark.parametrize("scale", [1.0, 4.0, 12.0])
@pytest.mark.parametrize("gaze", [(480, 270), (100, 400), (-300, 900)])
def test_cells_are_counted_within_some_percent(
    renderer: Renderer, eccentricity: str, scale: float, gaze: tuple[float, float]
) -> None:
    acuity = Acuity(eccentricity=eccentricity, scale=scale)
    forecast = forecast_held(SCREEN, acuity, bucket_of(Gaze(*gaze), 16), NOTHING, NO_FLAGS, 3)
    assert forecast[1:].tolist() == [0, 0, 0]
    for tiling, slack in (("aligned", 0.2), ("scanline", 1.0)):
        cells = renderer.cell_map(SCREEN, Quality(map=tiling, acuity=acuity), Gaze(*gaze))[0].cells
        assert forecast.sum() == pytest.approx(cells, rel=slack)


@pytest.mark.parametrize("move_px", [0, 20, 100, 400])
def test_cells_that_are_there_after_a_move_are_found(renderer: Renderer, pool: WorkerPool, move_px: int) -> None:
    """Every cell of a map holds 2 samples, a third of them 9; then the gaze moves."""
    quality = Quality(acuity=Acuity(scale=2.0))
    number = np.zeros(aligned_slots(960, 540), np.int32)
    slots = slots_of(renderer.cell_map(SCREEN, quality, Gaze(300, 200))[0], pool)
    number[slots] = 2
    number[slots[np.random.default_rng(9).random(len(slots)) < 1 / 3]] = 9
    gaze = Gaze(300 + move_px, 200)
    truth = held_by_number(number, NO_FLAGS, slots_of(renderer.cell_map(SCREEN, quality, gaze)[0], pool), 4)
    forecast = forecast_held(SCREEN, quality.acuity, bucket_of(gaze, 16), number, NO_FLAGS, 4)
    np.testing.assert_allclose(forecast / forecast.sum(), truth / truth.sum(), atol=0.04)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (70, 3), (17, 40)])
def test_small_screens_are_counted_too(renderer: Renderer, size: tuple[int, int]) -> None:
    display = Display(*size, width_cm=0.5)
    cells = renderer.cell_map(display, Quality(), Gaze(0, 0))[0].cells
    forecast = forecast_held(display, Acuity(), bucket_of(Gaze(0, 0), 16), NOTHING, NO_FLAGS, 1)
    assert 0 < forecast.sum() <= size[0] * size[1]
    if min(size) > 1:
        assert forecast.sum() == pytest.approx(cells, rel=0.3)


def test_held_samples_are_counted() -> None:
    number = np.array([3, 0, 7, 3, 1], np.int32)
    assert held_by_number(number, NO_FLAGS, np.array([0, 1, 2, 3]), 3).tolist() == [1, 0, 0, 3]
    assert held_by_number(number, NO_FLAGS, np.array([2, 4]), 8).tolist() == [0, 1, 0, 0, 0, 0, 0, 1, 0]
    settled = np.array([0, 0, 1, 0, 1], np.uint8)
    assert held_by_number(number, settled, np.array([0, 1, 2, 4]), 9).tolist() == [1, 0, 0, 1, 0, 0, 0, 0, 0, 2]
    assert held_by_number(NOTHING, NO_FLAGS, np.array([2, 4, 5]), 2).tolist() == [3, 0, 0]
