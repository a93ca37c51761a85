"""The error a frame states is the error it has."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.acuity import Acuity
from renderer.camera import Camera
from renderer.cellmap import build_cell_map
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.frame import FrameRequest
from renderer.gaze import Gaze, GazeBucket
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Material, Scene, Surroundings, Texture
from renderer.slots import pixel_slots, slots_needed, slots_of
from renderer.standard_error import stated_error
from renderer.store import SampleStore
from renderer.workers import WorkerPool
from tests.renderer.drawing import EVERYWHERE_1, WHITE, floor, shoot

SCREEN = Display(96, 64, width_cm=8.0)
FOVEA_DEG = 2.5


def request(gaze: tuple[float, float], quality: Quality, display: Display) -> FrameRequest:
    return FrameRequest(Gaze(*gaze), display, None, quality, linear=True)


@pytest.mark.parametrize("samples", [2, 4, 16])
@pytest.mark.parametrize("tiling", ["full", "aligned"])
def test_the_stated_error_is_the_error(renderer: Renderer, tiling: str, samples: int) -> None:
    """Against the frame of 1,024 samples, within a fifth, on a picture of edges everywhere."""
    checks = Texture(np.uint8([[[255] * 3, [0] * 3], [[0] * 3, [255] * 3]]))
    ground = floor(Material(diffuse=WHITE, diffuse_texture=checks), 0.0)
    ground = dataclasses.replace(ground, uvs=ground.uvs * 60 if ground.uvs is not None else None)
    prepared = prepare(
        Scene(meshes=(ground,), surroundings=Surroundings(ambient=WHITE), camera=Camera((0, 6, 0.1), (0, 0, 0)))
    )
    quality = Quality(map=tiling, acuity=Acuity(scale=8.0))
    few, many = (
        renderer.render(prepared, request((48, 32), dataclasses.replace(quality, samples_per_cell=n), SCREEN))
        for n in (samples, 1024)
    )
    weights = np.array((0.2126, 0.7152, 0.0722))
    error = math.sqrt((((few.pixels - many.pixels) @ weights) ** 2).mean())
    assert few.cost.rms_error == pytest.approx(error, rel=0.2)


def test_a_picture_without_noise_states_none(renderer: Renderer) -> None:
    frame = shoot(renderer, Scene(surroundings=EVERYWHERE_1), 64, 48, samples=16)
    assert frame.cost.rms_error == 0.0


def test_the_foveal_error_is_that_of_the_cells_around_the_gaze(renderer: Renderer) -> None:
    """Noise on the left half only: the fovea sees it there and not on the right."""
    checks = Texture(np.uint8([[[255] * 3, [0] * 3]]))
    ground = floor(Material(diffuse=WHITE, diffuse_texture=checks), 0.0)
    assert ground.uvs is not None
    left = dataclasses.replace(ground, vertices=ground.vertices - (5, 0, 0), uvs=ground.uvs * 300)
    around = Surroundings(ambient=WHITE)
    prepared = prepare(Scene(meshes=(left,), surroundings=around, camera=Camera((0, 6, 0.01), (0, 0, 0))))
    quality = Quality(map="full", samples_per_cell=8)
    display = Display(96, 64)
    noisy, calm = (renderer.render(prepared, request(gaze, quality, display)).cost for gaze in ((10, 32), (86, 32)))
    assert noisy.rms_error == calm.rms_error
    assert noisy.foveal_rms_error is not None
    assert calm.foveal_rms_error == 0.0
    assert noisy.foveal_rms_error > 0.05
    away = renderer.render(prepared, request((1e7, 0), quality, display)).cost
    assert away.foveal_rms_error is None


@given(
    st.tuples(st.floats(-300.0, 400.0), st.floats(-300.0, 400.0)),
    st.floats(1.0, 400.0),
    st.floats(1.0, 400.0),
    st.floats(1.0, 100.0),
)
def test_the_fovea_is_all_within_its_angle_of_the_gaze(
    pool: WorkerPool, gaze: tuple[float, float], width_cm: float, height_cm: float, distance_cm: float
) -> None:
    """However obliquely the eye looks: cells of a pixel, each with an error of its own, weighed as that angle says."""
    display = Display(47, 31, width_cm, height_cm, distance_cm)
    rng = np.random.default_rng(5)
    cells = build_cell_map("full", display, Acuity(), GazeBucket(0.0, 0.0, 16), pool)
    store, slots, pixels = SampleStore(slots_needed(cells)), slots_of(cells, pool), pixel_slots(47, 31)
    mean, error = rng.uniform(0.0, 1.0, (2, display.pixels))
    store.samples.number[pixels] = 2
    store.samples.shown[pixels], store.samples.square[pixels] = 2.0 * mean, 2.0 * (mean * mean + error)
    stated = stated_error(display, Gaze(*gaze), cells, slots, store.samples, 1.0, pool)
    angle = eccentricity_deg(display, Gaze(*gaze)).ravel()
    if np.abs(angle - FOVEA_DEG).min() < 1e-6:
        return
    within = error[angle < FOVEA_DEG]
    if len(within):
        assert stated.foveal_rms == pytest.approx(math.sqrt(within.mean()), rel=1e-4)
    else:
        assert stated.foveal_rms is None
    assert stated.rms == pytest.approx(math.sqrt(error.mean()), rel=1e-4)
    assert stated.guessed == 0.0


def test_the_share_that_was_guessed_is_that_of_cells_with_one_sample(pool: WorkerPool) -> None:
    """In pixels of a screen whose last cells fill no group."""
    display = Display(47, 31)
    cells = build_cell_map("full", display, Acuity(), GazeBucket(0.0, 0.0, 16), pool)
    store, slots = SampleStore(slots_needed(cells)), slots_of(cells, pool)
    number = np.random.default_rng(6).integers(1, 4, display.pixels)
    store.samples.number[slots] = store.samples.shown[slots] = store.samples.square[slots] = number
    stated = stated_error(display, Gaze(20.0, 10.0), cells, slots, store.samples, 1.0, pool)
    assert stated.guessed == (number == 1).mean()
