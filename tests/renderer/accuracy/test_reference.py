"""The reference: the mean of samples that no setting has, with the standard error that it states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from renderer.accuracy.measures import shown
from renderer.accuracy.reference import DEPTH, ROUND, render_reference, rounds
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scenes.matte import matte
from renderer.store import LUMINANCE

VIEW = FrameRequest(Gaze(20.0, 18.0), Display(64, 36), None, Quality())
SPARED = 32


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(matte())


def test_steps_begin_with_the_spared_samples_and_end_with_all() -> None:
    assert rounds(40, 8) == (8, 24, 40, 48)
    assert rounds(ROUND, 32) == (32, 40, 48)
    assert rounds(2, 1) == (1, 2, 3)
    assert rounds(3, 1) == (1, 2, 3, 4)


def test_the_reference_is_the_mean_of_the_samples_after_the_spared_ones(
    renderer: Renderer, scene: PreparedScene
) -> None:
    steps: list[None] = []
    found = render_reference(renderer, scene, VIEW, 30, 10, lambda: steps.append(None))
    assert len(steps) == len(rounds(30, 10))
    quality = Quality(map="full", samples_per_cell=40, max_depth=DEPTH)
    request = replace(VIEW, quality=quality, linear=True)
    renderer.forget_samples()
    few = renderer.render(scene, replace(request, samples=10)).pixels.astype(np.float64)
    many = renderer.render(scene, request).pixels.astype(np.float64)
    np.testing.assert_allclose(found.radiance, (40 * many - 10 * few) / 30, rtol=1e-5, atol=1e-6)
    assert (found.radiance.dtype, found.radiance.shape) == (np.float32, (36, 64, 3))
    assert found.radiance.min() >= 0.0


def test_its_chance_is_none_of_a_settings_chance(renderer: Renderer, scene: PreparedScene) -> None:
    """Variances of independent errors add up: for n of N samples that it shared, they would be taken off."""
    first = render_reference(renderer, scene, VIEW, 64, SPARED, lambda: None).radiance @ LUMINANCE
    renderer.forget_samples()
    truth = render_reference(renderer, scene, VIEW, 512, SPARED + 64, lambda: None).radiance @ LUMINANCE
    quality = Quality(map="full", samples_per_cell=SPARED)
    frame = renderer.render(scene, replace(VIEW, quality=quality, linear=True)).pixels @ LUMINANCE
    error, its = frame - truth, first - truth
    correlation = float((error * its).mean() / np.sqrt((error**2).mean() * (its**2).mean()))
    # what both share is the chance of the truth, 1/576 of a sample's variance, beside 1/32 and 1/64
    assert correlation == pytest.approx(0.03, abs=0.1)


def test_it_is_off_the_truth_by_its_standard_error(renderer: Renderer, scene: PreparedScene) -> None:
    found = render_reference(renderer, scene, VIEW, 48, SPARED, lambda: None)
    renderer.forget_samples()
    truth = render_reference(renderer, scene, VIEW, 512, SPARED + 48, lambda: None)
    exposure = scene.scene.exposure
    off = (shown(found.radiance, exposure) - shown(truth.radiance, exposure)) @ LUMINANCE
    stated, its = found.standard_error.rms, truth.standard_error.rms
    assert stated is not None
    assert its is not None
    assert np.sqrt((off**2).mean()) == pytest.approx(np.hypot(stated, its), rel=0.1)
    assert its == pytest.approx(stated * np.sqrt(48 / 512), rel=0.1)
