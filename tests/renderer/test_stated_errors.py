"""The error a frame states against the error it has, over the built-in scenes and the settings that decide it.

The error it has: of the same cells, by how much the means of their samples, each no brighter than white, differ from
those of very many samples with the same rays' widths.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.acuity import Acuity
from renderer.cellmap import build_cell_map
from renderer.display import Display
from renderer.gaze import Gaze, bucket_of
from renderer.growth import grow
from renderer.library import SceneLibrary
from renderer.quality import Quality
from renderer.slots import slots_needed, slots_of
from renderer.standard_error import stated_error
from renderer.store import SampleStore
from renderer.tracing import ThreadTracing
from renderer.whitted import view_of
from renderer.workers import WorkerPool

SCREEN = Display(80, 45, width_cm=5.0)
GAZE = Gaze(30.0, 20.0)
CONVERGED = 256
SCENES = ("matte", "spheres", "cornell", "atrium", "gallery")
library = SceneLibrary()


def ratio(scene: str, quality: Quality, pool: WorkerPool) -> float:
    """Stated error over true error."""
    prepared = library.load(scene)
    exposure = prepared.scene.exposure
    cell_map = build_cell_map(quality.map, SCREEN, quality.acuity, bucket_of(GAZE, quality.gaze_bucket_px), pool)
    slots = slots_of(cell_map, pool)
    view = view_of(prepared, prepared.scene.camera, SCREEN)

    def sampled(scheme: str, samples: int) -> SampleStore:
        store = SampleStore(slots_needed(cell_map), scheme == "adaptive", 1.0 / exposure)
        how = dataclasses.replace(quality, antialiasing=scheme)
        grow(prepared, view, cell_map, slots, store, how, samples, pool, ThreadTracing())
        return store

    def means(store: SampleStore) -> NDArray[np.float64]:
        mean: NDArray[np.float64] = np.float64(store.samples.shown[slots]) / store.samples.number[slots]
        return mean

    assert quality.samples_per_cell <= CONVERGED / 16
    few = sampled(quality.antialiasing, quality.samples_per_cell)
    off = exposure * (means(few) - means(sampled("stochastic", CONVERGED)))
    true = math.sqrt(np.average(off**2, weights=np.square(cell_map.side, dtype=np.float64)))
    stated = stated_error(SCREEN, GAZE, cell_map, slots, few.samples, exposure, pool)
    return stated.rms / true


def quality(samples: int, scheme: str = "stochastic", tiling: str = "aligned", shadow_samples: int = 4) -> Quality:
    return Quality(
        map=tiling,
        samples_per_cell=samples,
        antialiasing=scheme,
        acuity=Acuity(scale=6.0),
        shadow_samples=shadow_samples,
    )


SETTINGS = [quality(2), quality(4, tiling="full"), quality(8, tiling="scanline"), quality(16), quality(16, "adaptive")]


@pytest.mark.parametrize("scene", ["matte", "spheres", "atrium", "gallery"])
@pytest.mark.parametrize("how", SETTINGS, ids=lambda how: f"{how.map}-{how.antialiasing}-{how.samples_per_cell}")
def test_the_stated_error_is_the_true_one_within_a_fifth(scene: str, how: Quality, pool: WorkerPool) -> None:
    assert ratio(scene, how, pool) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("how", [*SETTINGS, quality(4, shadow_samples=64), quality(16, shadow_samples=1)])
def test_under_lights_with_a_size_the_stated_error_is_a_bound(how: Quality, pool: WorkerPool) -> None:
    """Points on the lamp are spread over it, so that they err less than independent ones would."""
    assert 0.85 < ratio("cornell", how, pool) < 1.6


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("samples", [4, 8, 16])
def test_the_error_of_regular_samples_is_a_bound(scene: str, samples: int, pool: WorkerPool) -> None:
    """A lattice errs less than independent samples would: up to three times less where all is edges."""
    assert 0.85 < ratio(scene, quality(samples, "regular"), pool) < 3.2


@pytest.mark.parametrize("scene", SCENES)
def test_the_guess_from_one_sample_is_good_to_a_factor_of_two(scene: str, pool: WorkerPool) -> None:
    for tiling in ("aligned", "full", "scanline"):
        assert 0.5 < ratio(scene, quality(1, tiling=tiling), pool) < 2.0
