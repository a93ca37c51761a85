"""Flicker over walks of the gaze: what must not change, and what changes least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from renderer.accuracy.temporal import ALIGNED, SCANLINE, STEADY, WAYS, Flicker, flicker, flicker_steps
from renderer.acuity import Acuity
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze, bucket_of
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from renderer.scenes import BUILT_IN

SCREEN = Display(192, 108, 50.0, None, 60.0)
QUALITY = Quality(samples_per_cell=1, gaze_bucket_px=8, acuity=Acuity(scale=8.0))


def jitter(middle_x: float, middle_y: float, amplitude_px: float, steps: int) -> list[Gaze]:
    """A gaze that trembles around a place."""
    offsets = np.random.default_rng(3).normal(0, amplitude_px, (steps, 2))
    return [Gaze(middle_x + dx, middle_y + dy) for dx, dy in offsets.tolist()]


def drift(steps: int) -> list[Gaze]:
    """A gaze that follows something across the screen."""
    return [Gaze(40.0 + 3.0 * step, 30.0 + 1.5 * step) for step in range(steps)]


@pytest.fixture(scope="module")
def spheres() -> PreparedScene:
    return prepare(BUILT_IN["spheres"]())


def measured(
    renderer: Renderer, scene: PreparedScene, walk: Sequence[Gaze], way: str, quality: Quality = QUALITY
) -> Flicker:
    view = FrameRequest(walk[0], SCREEN, None, quality)
    return flicker(way, list(flicker_steps(renderer, scene, view, walk, way)))


@pytest.mark.parametrize("way", WAYS)
def test_a_pixel_that_keeps_its_cell_keeps_its_colour_exactly(
    renderer: Renderer, spheres: PreparedScene, way: str
) -> None:
    found = measured(renderer, spheres, drift(12), way)
    assert found.steps == 11 == len(found.step_changes)
    assert found.kept_cells_change == 0.0
    assert 0 < found.changed_pixels < 1
    assert found.change == pytest.approx(np.mean(found.step_changes))
    assert found.change > 0


def test_aligned_cells_flicker_less_than_scanline_ones(renderer: Renderer, spheres: PreparedScene) -> None:
    scanline, aligned = (measured(renderer, spheres, drift(16), way) for way in (SCANLINE, ALIGNED))
    assert scanline.map_changes == aligned.map_changes > 0
    assert aligned.changed_pixels < scanline.changed_pixels / 2
    assert aligned.change < scanline.change / 2
    assert aligned.peripheral_change is not None
    assert scanline.peripheral_change is not None
    assert aligned.peripheral_change < scanline.peripheral_change / 2


def test_hysteresis_spares_the_changes_of_a_trembling_gaze(renderer: Renderer, spheres: PreparedScene) -> None:
    edge = bucket_of(Gaze(92.0, 60.0), 8).x + 4.0
    walk = jitter(edge, 60.0, 0.5, 20)
    aligned, steady = (measured(renderer, spheres, walk, way) for way in (ALIGNED, STEADY))
    assert aligned.map_changes > 4
    assert aligned.change > 0
    assert steady.map_changes == 0
    assert steady.change == 0.0 == steady.changed_pixels
    assert aligned.cells < steady.cells < 1.3 * aligned.cells


def test_a_gaze_that_stays_in_its_bucket_changes_nothing(renderer: Renderer, spheres: PreparedScene) -> None:
    walk = jitter(96.0, 56.0, 0.5, 6)
    for way in WAYS:
        found = measured(renderer, spheres, walk, way)
        assert (found.map_changes, found.changed_pixels, found.change) == (0, 0.0, 0.0)


def test_where_every_pixel_is_a_cell_nothing_changes(renderer: Renderer, spheres: PreparedScene) -> None:
    near = Quality(samples_per_cell=1, gaze_bucket_px=8, acuity=Acuity(scale=0.01))
    for way in WAYS:
        found = measured(renderer, spheres, drift(5), way, near)
        assert found.map_changes > 0
        assert (found.cells, found.changed_pixels, found.change) == (SCREEN.pixels, 0.0, 0.0)


def test_the_change_is_that_of_two_frames(renderer: Renderer, spheres: PreparedScene) -> None:
    walk = [Gaze(40.0, 30.0), Gaze(90.0, 60.0)]
    quality = Quality(samples_per_cell=1, gaze_bucket_px=0, acuity=Acuity(scale=8.0))
    first, second = (
        renderer.render(spheres, FrameRequest(gaze, SCREEN, None, quality, linear=True)).pixels.astype(np.float64)
        for gaze in walk
    )
    exposure = spheres.scene.exposure
    light = [np.clip(pixels * exposure, 0, 1) @ (0.2126, 0.7152, 0.0722) for pixels in (first, second)]
    found = measured(renderer, spheres, walk, ALIGNED, quality)
    assert found.change == pytest.approx(np.abs(light[1] - light[0]).mean(), rel=1e-3)


def test_a_walk_needs_a_step(renderer: Renderer, spheres: PreparedScene) -> None:
    with pytest.raises(ValueError, match="expected one or more, found none: a walk has two gazes or more"):
        measured(renderer, spheres, [Gaze(0.0, 0.0)], ALIGNED)


@pytest.mark.parametrize("way", WAYS)
def test_a_walk_may_begin_at_any_step(renderer: Renderer, spheres: PreparedScene, way: str) -> None:
    """A gaze that goes back and forth over the edge of a bucket: with hysteresis, what is shown depends on where it
    came from.
    """
    edge = bucket_of(Gaze(92.0, 60.0), 8).x + 4.0
    walk = [*drift(4), *(Gaze(edge + offset, 60.0) for offset in (1.0, -1.0, 1.5, -3.0))]
    view = FrameRequest(walk[0], SCREEN, None, QUALITY)
    steps = list(flicker_steps(renderer, spheres, view, walk, way))
    assert len(steps) == 7
    for begin in (1, 5, 6):
        renderer.forget_samples()
        assert list(flicker_steps(renderer, spheres, view, walk, way, begin)) == steps[begin:]
    assert list(flicker_steps(renderer, spheres, view, walk, way, 7)) == []
