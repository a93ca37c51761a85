"""The acuity models side by side on one display."""

from __future__ import annotations

import numpy as np
import pytest

from renderer.acuity import MODELS, Acuity, cut_off_cpd
from renderer.acuity_comparison import compare_models
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.quality import Quality
from renderer.workers import WorkerPool
from tests.renderer.viewing import true_cell_size

DESKTOP = Display(1920, 1080, 53.1, None, 60.0)


def test_every_model_has_its_curve_and_its_cost(pool: WorkerPool) -> None:
    display, gaze = Display(320, 180, 50.0, None, 60.0), Gaze(100.0, 60.0)
    quality = Quality(samples_per_cell=3, gaze_bucket_px=0, acuity=Acuity(scale=8.0))
    costs = compare_models(display, gaze, quality, pool)
    assert tuple(cost.model for cost in costs) == MODELS
    for cost in costs:
        np.testing.assert_array_equal(cost.cut_offs_cpd, cut_off_cpd(cost.eccentricities_deg, cost.model))
        assert cost.cells_per_pixel == cost.cells / (320 * 180)
        assert cost.camera_rays == 3 * cost.cells
        ideal = (1 / true_cell_size(display, Acuity(cost.model, scale=8.0), gaze) ** 2).sum()
        assert ideal <= cost.cells < 3 * ideal


def test_a_model_that_sees_finer_everywhere_costs_more_cells(pool: WorkerPool) -> None:
    """Of two models whose curves do not cross up to the corner of the screen, 28 deg away."""
    costs = compare_models(DESKTOP, Gaze(960.0, 540.0), Quality(), pool)
    seen = {cost.model: np.array(cost.cut_offs_cpd)[np.array(cost.eccentricities_deg) < 28.0] for cost in costs}
    cells = {cost.model: cost.cells for cost in costs}
    ordered = [(fine, coarse) for fine in MODELS for coarse in MODELS if (seen[fine] > seen[coarse]).all()]
    assert len(ordered) >= 6
    assert all(cells[fine] > cells[coarse] for fine, coarse in ordered)


@pytest.mark.parametrize(
    ("model", "ideal_share"), [("geisler-perry", 0.132), ("watson", 0.157), ("guenter", 0.014), ("stelacsf", 0.224)]
)
def test_cells_on_a_desktop_screen(pool: WorkerPool, model: str, ideal_share: float) -> None:
    """The least share that squares of exactly the unit angle would take, worked out apart; cells are up to twice it,
    and the models of two eyes see more than the one meridian that share is for.
    """
    (cost,) = (cost for cost in compare_models(DESKTOP, Gaze(960.0, 540.0), Quality(), pool) if cost.model == model)
    assert bucket_of(Gaze(960.0, 540.0), 16).x == 960
    assert 1.3 * ideal_share < cost.cells_per_pixel < 2.5 * ideal_share
