"""What is rendered for a configuration and a gaze: pure functions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from renderer.acuity import MAX_SCALE
from renderer.frame import FrameCost, RayCounts, StageTimes
from renderer.gaze import GazeBucket
from renderer.prepared import prepare
from renderer.scenes.matte import matte
from service import protocol
from service.conditioning import Attention, observe
from service.plan import (
    DEADLINE_MS,
    EVERYWHERE_DEG,
    Configuration,
    Look,
    gaze_px,
    look_at,
    step_of,
    steps_done,
    steps_of,
)
from service.request import StreamBody


@pytest.fixture(scope="module")
def matte_scene() -> Any:
    return prepare(matte())


def configuration(scene: Any, **quality: Any) -> Configuration:
    display = {"width_px": 640, "height_px": 360, "width_cm": 50.0, "distance_cm": 60.0}
    body = StreamBody.model_validate({"scene": "matte", "display": display, "quality": quality})
    return Configuration(1, body, scene, body.order())


def live(x: float, y: float, **fields: Any) -> Attention:
    return observe(Attention(), protocol.Gaze(x, y, **fields), 0)


def cost(samples: float, scale: float = 1.0) -> FrameCost:
    """What a frame says it shows; the other fields do not matter here."""
    names = dict.fromkeys(FrameCost.__slots__)
    stated = {"mean_samples": samples, "acuity_scale": scale, "rays": RayCounts(), "time_ms": StageTimes(0, 0, 0)}
    return FrameCost(**{**names, **stated})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("samples", "wanted"), [(1, [1, 1]), (2, [1, 1, 2]), (5, [1, 1, 2, 4, 5]), (8, [1, 1, 2, 4, 8])]
)
def test_samples_double_until_all_are_there(matte_scene: Any, samples: int, wanted: list[int]) -> None:
    shown = configuration(matte_scene, samples_per_cell=samples)
    eye = live(100.0, 100.0)
    look = look_at(shown, eye, 0.0, None)
    steps = [step_of(shown, look, eye, index, 0.0) for index in range(steps_of(shown, look))]
    assert [step.request.samples for step in steps] == wanted
    assert [step.phase for step in steps] == ["moving", *["still"] * (len(steps) - 1)]
    assert [step.request.quality.deadline_ms for step in steps] == [DEADLINE_MS, *[None] * (len(steps) - 1)]
    assert [step.image_quality for step in steps] == [75, *[90] * (len(steps) - 1)]


def test_the_deadline_leaves_room_for_encoding(matte_scene: Any) -> None:
    shown = configuration(matte_scene, deadline_ms=50.0)
    eye = live(100.0, 100.0)
    look = look_at(shown, eye, 0.0, None)
    assert step_of(shown, look, eye, 0, 12.0).request.quality.deadline_ms == 38.0
    assert step_of(shown, look, eye, 0, 400.0).request.quality.deadline_ms == 25.0


def test_a_coarse_first_frame_is_followed_by_a_fine_one_and_no_step_is_taken_in_vain(matte_scene: Any) -> None:
    shown = configuration(matte_scene, samples_per_cell=8)
    eye = live(100.0, 100.0)
    look = look_at(shown, eye, 0.0, None)
    steps, first = steps_of(shown, look), step_of(shown, look, eye, 0, 0.0)
    assert steps_done(first, cost(1.0, scale=2.0), 0, steps) == 1
    assert steps_done(first, cost(1.0), 0, steps) == 2
    assert steps_done(first, cost(7.9), 0, steps) == 2
    assert steps_done(first, cost(8.0), 0, steps) == steps
    assert steps_done(first, cost(8.0, scale=2.0), 0, steps) == 1
    assert steps_done(first, replace(cost(2.0), error_met=True), 0, steps) == steps
    assert steps_done(first, replace(cost(2.0, scale=2.0), error_met=True), 0, steps) == 1
    assert steps_done(first, replace(cost(2.0), error_met=False), 0, steps) == 2
    assert steps_done(step_of(shown, look, eye, 3, 0.0), cost(4.0), 3, steps) == 4


def test_a_saccade_has_one_step_of_wider_cells(matte_scene: Any) -> None:
    for scale, wider in ((1.5, 3.0), (MAX_SCALE, MAX_SCALE)):
        shown = configuration(matte_scene, acuity={"scale": scale})
        eye = live(100.0, 100.0, phase="saccade")
        look = look_at(shown, eye, 0.0, None)
        assert steps_of(shown, look) == 1
        assert step_of(shown, look, eye, 0, 0.0).request.quality.acuity.scale == wider


def test_a_lost_eye_may_look_anywhere(matte_scene: Any) -> None:
    shown = configuration(matte_scene, map="scanline", acuity={"scale": 2.0})
    eye = replace(live(100.0, 100.0), state="lost")
    for attention in (eye, Attention()):
        look = look_at(shown, attention, 0.0, None)
        assert look == Look(None, 0.0, saccade=False)
        quality = step_of(shown, look, attention, 0, 0.0).request.quality
        assert (quality.map, quality.acuity.margin_deg, quality.acuity.scale) == ("aligned", EVERYWHERE_DEG, 2.0)


def test_the_full_map_is_the_same_for_every_gaze(matte_scene: Any) -> None:
    shown = configuration(matte_scene, map="full")
    looks = {look_at(shown, eye, 2.0, None) for eye in (live(0.0, 0.0), live(600.0, 300.0), Attention())}
    assert len(looks) == 1
    assert step_of(shown, looks.pop(), live(0.0, 0.0), 1, 0.0).request.quality == replace(
        shown.order.request.quality, deadline_ms=None
    )


def test_a_look_stays_while_its_gaze_is_about_its_bucket(matte_scene: Any) -> None:
    shown = configuration(matte_scene)
    look = look_at(shown, live(32.0, 32.0), 0.0, None)
    assert look.bucket == GazeBucket(32, 32, 16)
    near = live(43.0, 32.0)
    assert look_at(shown, near, 0.0, look) == look
    assert look_at(shown, near, 0.0, None) != look
    assert look_at(shown, live(44.5, 32.0), 0.0, look) != look
    assert look_at(shown, near, 1.0, look).margin_deg == look.margin_deg + 1.0
    rendered = step_of(shown, look, near, 0, 0.0).request.gaze
    assert 39.9 < rendered.x < 40.0


def test_a_fraction_is_of_the_display(matte_scene: Any) -> None:
    gaze = gaze_px(configuration(matte_scene), live(0.5, 0.25, unit="fraction"))
    assert gaze is not None
    assert (gaze.x, gaze.y) == (320.0, 90.0)
