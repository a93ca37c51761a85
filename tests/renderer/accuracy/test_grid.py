"""The grid: the default with one thing varied, where the scene answers to it."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import asdict
from typing import Any

import pytest

from renderer.accuracy.grid import FULL, QUICK, Extent, grid, most_samples
from renderer.accuracy.record import DEFAULT, GROUPS, PAPER
from renderer.acuity import MODELS
from renderer.effect_choice import EFFECTS
from renderer.effects import Effect, EffectPlan
from renderer.quality import MAPS, Quality

NOTHING = EffectPlan(())
EVERYTHING = EffectPlan(tuple(Effect(name, "because") for name in EFFECTS))

VARIED = {
    "samples": {"samples_per_cell"},
    "map": {"map", "samples_per_cell", "gaze_bucket_px", "acuity"},
    "acuity_scale": {"acuity"},
    "acuity_model": {"acuity"},
    "antialiasing": {"antialiasing", "samples_per_cell"},
    "reconstruction": {"reconstruction", "samples_per_cell"},
    "shadow_samples": {"shadow_samples"},
    "max_depth": {"max_depth"},
    "effects": {"effects"},
}
"""What each group may change of the default."""


def changes(quality: Quality) -> set[str]:
    default: dict[str, Any] = asdict(Quality())
    return {name for name, value in asdict(quality).items() if value != default[name]}


@pytest.mark.parametrize("extent", [FULL, QUICK], ids=["full", "quick"])
@pytest.mark.parametrize("plan", [NOTHING, EVERYTHING], ids=["nothing", "everything"])
def test_each_setting_varies_what_its_group_says(extent: Extent, plan: EffectPlan) -> None:
    settings = grid(extent, plan)
    assert len({setting.id for setting in settings}) == len({setting.label for setting in settings}) == len(settings)
    assert len({setting.quality for setting in settings}) == len(settings), "nothing is measured twice"
    for setting in settings:
        assert re.fullmatch(r"[a-z0-9-]+", setting.id)
        assert changes(setting.quality) <= VARIED[setting.group]
    marks = Counter(mark for setting in settings for mark in setting.marks)
    assert marks == {DEFAULT: 1, PAPER: 1}
    assert (settings[0].quality, settings[0].marks) == (Quality(), (DEFAULT,))
    assert {setting.quality.map for setting in settings} == set(MAPS)
    assert {setting.quality.acuity.model for setting in settings} >= set(MODELS[:3])


def test_a_scene_that_calls_for_nothing_is_spared_what_it_does_not_answer_to() -> None:
    groups = {setting.group for setting in grid(FULL, NOTHING)}
    assert groups == set(GROUPS) - {"shadow_samples", "max_depth", "effects"}
    assert {setting.group for setting in grid(FULL, EVERYTHING)} == set(GROUPS)


def test_each_acuity_model_is_measured() -> None:
    assert {setting.quality.acuity.model for setting in grid(FULL, NOTHING)} == set(MODELS)


def test_each_effect_is_switched_off_once() -> None:
    off = [setting.quality.effects for setting in grid(QUICK, EVERYTHING) if setting.group == "effects"]
    assert off == [(f"-{name}",) for name in EFFECTS]


def test_every_number_of_shadow_samples_sends_other_rays() -> None:
    """Shadow rays a camera ray are rounded up: 1, 2 and 4 a cell of 4 camera rays would be the same."""
    numbers = {
        -(-setting.quality.shadow_samples // setting.quality.samples_per_cell)
        for setting in grid(FULL, EVERYTHING)
        if setting.group == "shadow_samples"
    }
    assert numbers == {2, 4, 8}


def test_the_papers_setting_is_the_papers() -> None:
    (paper,) = (setting for setting in grid(FULL, NOTHING) if PAPER in setting.marks)
    quality = paper.quality
    assert (quality.map, quality.samples_per_cell, quality.gaze_bucket_px) == ("scanline", 32, 0)
    assert (quality.acuity.model, quality.acuity.eccentricity) == ("peli", "paper")
    assert most_samples(grid(FULL, NOTHING)) == 32
