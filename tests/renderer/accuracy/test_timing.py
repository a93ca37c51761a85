"""Settings are timed in turn, each frame anew."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from renderer.accuracy.grid import QUICK, Setting, grid
from renderer.accuracy.timing import frame_time, timed_frame, turn
from renderer.display import Display
from renderer.effects import EffectPlan
from renderer.frame import FrameRequest, StageTimes
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scenes.spheres import spheres

SETTINGS = grid(QUICK, EffectPlan(()))
VIEW = FrameRequest(Gaze(20.0, 10.0), Display(48, 27), None, Quality())


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(spheres())


@pytest.fixture(scope="module")
def forgetful() -> Iterator[Renderer]:
    made = Renderer(2, map_cache_bytes=0, store_bytes=0)
    yield made
    made.close()


def test_every_repeat_has_each_setting_once_in_an_order_of_its_own() -> None:
    orders = [turn(SETTINGS, repeat) for repeat in range(8)]
    assert all(sorted(order, key=SETTINGS.index) == list(SETTINGS) for order in orders)
    assert len({tuple(setting.id for setting in order) for order in orders}) == len(orders)
    assert orders == [turn(SETTINGS, repeat) for repeat in range(8)], "a run that goes on has the same"


def test_a_median_is_not_moved_by_one_slow_repeat() -> None:
    runs = [StageTimes(1.0, 10.0, 2.0), StageTimes(5.0, 900.0, 8.0), StageTimes(2.0, 12.0, 1.0)]
    found = frame_time(runs)
    assert found.repeats == (13.0, 913.0, 15.0)
    assert (found.median, found.low, found.high) == (15.0, 13.0, 913.0)
    assert (found.map, found.trace, found.reconstruct) == (2.0, 12.0, 2.0)


def test_a_frame_is_made_anew_each_time(forgetful: Renderer, scene: PreparedScene) -> None:
    for _ in range(2):
        for setting in SETTINGS[:4]:
            stages = timed_frame(forgetful, scene, VIEW, setting)
            assert stages.map > 0.0 < stages.trace


def test_a_renderer_that_keeps_frames_cannot_be_timed(renderer: Renderer, scene: PreparedScene) -> None:
    (setting,) = (some for some in SETTINGS if some.id == "aligned-2")
    renderer.forget_samples()
    timed_frame(renderer, scene, VIEW, Setting("x", "x", "map", Quality(map="scanline", samples_per_cell=3)))
    timed_frame(renderer, scene, VIEW, setting)
    with pytest.raises(ValueError, match="aligned-2: expected a frame made anew"):
        timed_frame(renderer, scene, VIEW, setting)
