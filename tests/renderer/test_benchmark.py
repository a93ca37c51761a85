"""The benchmark: its figures belong together, and it times what it says."""

from __future__ import annotations

import pytest

from renderer.benchmark import BARE, FRAME, MAP, PACKETS, Benchmark, measure_frame
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


@pytest.mark.bench
def test_a_cell_map_takes_well_under_a_tenth_of_its_frame(renderer: Renderer) -> None:
    result = measured(renderer, "atrium", Display(1920, 1080), 7)
    figures = {figure.name: figure.median for figure in result.figures}
    assert figures[f"{MAP} / {FRAME}"] < 0.1
