"""The benchmark: its figures belong together, and it times what it says."""

from __future__ import annotations

import numpy as np
import pytest

from renderer.benchmark import BARE, FRAME, MAP, PACKETS, Benchmark, measure_frame, recording
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scenes import BUILT_IN


def measured(renderer: Renderer, scene: str, display: Display, repeats: int) -> Benchmark:
    request = FrameRequest(
        Gaze(display.width_px / 2, display.height_px / 2), display, None, Quality(samples_per_cell=1)
    )
    ticks: list[None] = []
    result = measure_frame(renderer, prepare(BUILT_IN[scene]()), request, repeats, lambda: ticks.append(None))
    assert len(ticks) == repeats
    return result


def test_figures_belong_together(renderer: Renderer) -> None:
    result = measured(renderer, "cornell", Display(160, 90), 3)
    assert result.rays.primary == result.cells > 0
    assert result.rays.shadow > 0
    figures = {figure.name: figure for figure in result.figures}
    for figure in figures.values():
        assert 0.0 < figure.low <= figure.median <= figure.high
    for part in (FRAME, PACKETS):
        ratio = figures[f"{part} / {BARE}"]
        assert ratio.unit == "ratio"
        assert figures[part].low / figures[BARE].high <= ratio.median <= figures[part].high / figures[BARE].low


def test_all_rays_are_recorded_or_one_batch_in_many() -> None:
    """On one thread, whose batches come in their order; the frame is the one that it is without."""
    prepared, renderer = prepare(BUILT_IN["spheres"]()), Renderer(1)
    request = FrameRequest(Gaze(160.0, 90.0), Display(320, 180), None, Quality(map="full", samples_per_cell=2))
    alone = renderer.render(prepared, request)
    recorded = {}
    for every in (1, 3):
        recorder, recorded[every] = recording(prepared, every)
        renderer.forget_samples()
        np.testing.assert_array_equal(renderer.render(recorder, request).pixels, alone.pixels)
    assert recorded[1].number == alone.cost.rays.total
    for all_of_them, some in zip(recorded[1], recorded[3], strict=True):
        assert len(all_of_them) > 6
        assert len(some) == len(all_of_them[::3])
        for ours, theirs in zip(some, all_of_them[::3], strict=True):
            np.testing.assert_array_equal(ours[0].x, theirs[0].x)


@pytest.mark.bench
def test_a_cell_map_takes_well_under_a_tenth_of_its_frame(renderer: Renderer) -> None:
    result = measured(renderer, "atrium", Display(1920, 1080), 7)
    figures = {figure.name: figure.median for figure in result.figures}
    assert figures[f"{MAP} / {FRAME}"] < 0.1
