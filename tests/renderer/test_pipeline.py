"""Whole frames: the same bytes whatever happened before, only new cells traced, and costs that add up."""

from __future__ import annotations

import dataclasses
import gc
import threading
import weakref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.acuity import Acuity
from renderer.camera import Camera
from renderer.display import Display
from renderer.frame import Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, Quality
from renderer.scene import Material, Scene, Surroundings
from renderer.tonemap import encode_srgb
from tests.renderer.drawing import (
    BLACK,
    EVERYWHERE_1,
    WHITE_LAMBERT,
    floor,
    glass_and_mirror,
    light,
    shoot,
)

SCREEN = Display(96, 64, width_cm=8.0)
FOVEATED = Quality(acuity=Acuity(scale=16.0), samples_per_cell=3)
FULL_HD = Display(1920, 1080, 50.0, 35.0, 60.0)


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


@pytest.fixture(scope="module")
def matte() -> PreparedScene:
    """A scene without effects, quick to trace on a whole screen."""
    return prepare(Scene(meshes=(floor(WHITE_LAMBERT, casts_shadows=False),), surroundings=EVERYWHERE_1))


def request(gaze: tuple[float, float], quality: Quality = FOVEATED, display: Display = SCREEN) -> FrameRequest:
    return FrameRequest(Gaze(*gaze), display, None, quality, linear=True)


def test_the_frames_tried_here_have_cells_of_many_sides(renderer: Renderer) -> None:
    sides = np.unique(renderer.cell_map(SCREEN, FOVEATED, Gaze(20, 20))[0].side)
    assert len(sides) >= 4


@pytest.mark.parametrize("tiling", MAPS)
def test_what_was_rendered_before_changes_no_byte(scene: PreparedScene, tiling: str) -> None:
    quality = dataclasses.replace(FOVEATED, map=tiling)
    wanted = request((50, 30), quality)
    fresh, used = Renderer(threads=2), Renderer(threads=2)
    truth = fresh.render(scene, wanted)
    for gaze in ((20, 20), (75, 33), (90, 60), (-40, 500)):
        used.render(scene, request(gaze, dataclasses.replace(quality, samples_per_cell=5)))
        used.render(scene, request(gaze, dataclasses.replace(quality, antialiasing="regular")))
        used.render(scene, request(gaze, dataclasses.replace(quality, max_depth=1)))
        used.render(scene, dataclasses.replace(request(gaze, quality), camera=Camera((1, 1, 7), (0, 0, 0))))
        used.render(scene, request(gaze, dataclasses.replace(quality, acuity=Acuity(scale=3.0))))
        used.render(scene, request(gaze, quality))
    again = used.render(scene, wanted)
    np.testing.assert_array_equal(again.pixels, truth.pixels)
    assert again.cost.rms_error == truth.cost.rms_error
    assert again.cost.foveal_rms_error == truth.cost.foveal_rms_error
    if tiling == "aligned":
        assert again.cost.cells_traced < truth.cost.cells_traced / 2
    elif tiling == "full":
        assert again.cost.cells_traced == 0
    else:
        assert again.cost.cells_traced == truth.cost.cells_traced
    fresh.close()
    used.close()


@settings(max_examples=15)
@given(st.lists(st.tuples(st.floats(-20, 120), st.floats(-20, 90)), min_size=1, max_size=5))
def test_a_moving_gaze_gives_the_frames_of_fresh_renderers(
    scene: PreparedScene, gazes: list[tuple[float, float]]
) -> None:
    used = Renderer(threads=2)
    for gaze in gazes:
        seen = used.render(scene, request(gaze))
        fresh = Renderer(threads=1)
        np.testing.assert_array_equal(seen.pixels, fresh.render(scene, request(gaze)).pixels)
        fresh.close()
    used.close()


def test_without_room_for_samples_the_frames_are_the_same(renderer: Renderer, scene: PreparedScene) -> None:
    forgetful = Renderer(threads=2, map_cache_bytes=0, store_bytes=0)
    for _ in range(2):
        frame = forgetful.render(scene, request((50, 30)))
        assert frame.cost.cells_traced == frame.cost.cells
        assert not frame.cost.map_cached
        np.testing.assert_array_equal(frame.pixels, renderer.render(scene, request((50, 30))).pixels)
    assert forgetful.store_cache.entries == forgetful.map_cache.entries == 0
    forgetful.close()


def test_after_20_pixels_a_twentieth_of_the_cells_is_new(matte: PreparedScene) -> None:
    """On 1920x1080, 50x35 cm at 60 cm: 4.9 % without buckets of gaze; the frame is that of a fresh renderer."""
    quality = Quality(samples_per_cell=1, gaze_bucket_px=0)
    used = Renderer(threads=2)
    used.render(matte, request((1000, 500), quality, FULL_HD))
    moved = used.render(matte, request((1020, 500), quality, FULL_HD))
    assert 0.02 < moved.cost.cells_traced / moved.cost.cells < 0.08
    used.forget_samples()
    fresh = used.render(matte, request((1020, 500), quality, FULL_HD))
    assert fresh.cost.cells_traced == fresh.cost.cells
    np.testing.assert_array_equal(fresh.pixels, moved.pixels)
    used.close()


def test_a_resting_gaze_traces_nothing(renderer: Renderer, scene: PreparedScene) -> None:
    first = renderer.render(scene, request((33, 44)))
    again = renderer.render(scene, request((33, 44)))
    assert again.cost.cells_traced == again.cost.rays.total == 0
    assert again.cost.map_cached
    np.testing.assert_array_equal(again.pixels, first.pixels)


@pytest.mark.parametrize("tiling", MAPS)
@pytest.mark.parametrize("samples", [1, 2, 7])
def test_costs_add_up(scene: PreparedScene, tiling: str, samples: int) -> None:
    fresh = Renderer(threads=2)
    quality = dataclasses.replace(FOVEATED, map=tiling, samples_per_cell=samples)
    for gaze in ((20, 20), (40, 20), (40, 20)):
        frame = fresh.render(scene, request(gaze, quality))
        cost = frame.cost
        cells = fresh.cell_map(SCREEN, quality, Gaze(*gaze))[0]
        assert (cost.map, cost.samples_per_cell, cost.bucket_px) == (tiling, samples, 16)
        assert cost.cells == cells.cells == cost.cells_traced + cost.cells_reused
        assert cost.rays.primary == cost.samples_traced == samples * cost.cells_traced
        assert (cost.mean_samples, cost.acuity_scale, cost.deadline_met) == (samples, 16.0, None)
        assert cost.rays.total == sum(dataclasses.astuple(cost.rays))
        assert cost.rejected_samples.total == 0
        assert cost.effects == ("textures", "shadows", "reflection", "refraction")
        assert cost.guessed_error == (samples == 1)
        assert min(dataclasses.astuple(cost.time_ms)) >= 0
        if tiling == "full":
            assert cost.cells == SCREEN.pixels
            assert (cells.side == 1).all()
    fresh.close()


def test_the_picture_is_the_linear_frame_tone_mapped(renderer: Renderer, scene: PreparedScene) -> None:
    linear = renderer.render(scene, request((20, 20)))
    picture = renderer.render(scene, dataclasses.replace(request((20, 20)), linear=False))
    assert linear.pixels.dtype == np.float32
    assert picture.pixels.dtype == np.uint8
    np.testing.assert_array_equal(picture.pixels, encode_srgb(linear.pixels))


def test_exposure_brightens_the_picture_and_not_the_linear_frame(renderer: Renderer) -> None:
    one, four = (dataclasses.replace(glass_and_mirror(), spheres=(), exposure=exposure) for exposure in (1.0, 4.0))
    linear = shoot(renderer, one, 32, 24).pixels
    np.testing.assert_array_equal(shoot(renderer, four, 32, 24).pixels, linear)
    np.testing.assert_array_equal(shoot(renderer, four, 32, 24, linear=False).pixels, encode_srgb(4 * linear))


def test_a_cell_is_one_colour(renderer: Renderer, scene: PreparedScene) -> None:
    frame = renderer.render(scene, request((20, 20)))
    cells = renderer.cell_map(SCREEN, FOVEATED, Gaze(20, 20))[0]
    first = np.zeros(cells.cells, np.int64)
    first[cells.mask.ravel()[::-1]] = np.arange(cells.mask.size)[::-1]
    np.testing.assert_array_equal(frame.pixels, frame.pixels.reshape(-1, 3)[first[cells.mask]])


def test_many_frames_at_once_are_the_frames_one_by_one(scene: PreparedScene, matte: PreparedScene) -> None:
    shared, alone = Renderer(threads=2), Renderer(threads=1)
    asked = [(s, request((10.0 * i, 50 - 5.0 * i), FOVEATED)) for i in range(6) for s in (scene, matte)]
    frames: list[Frame | None] = [None] * len(asked)

    def render(index: int) -> None:
        frames[index] = shared.render(*asked[index])

    threads = [threading.Thread(target=render, args=(index,)) for index in range(len(asked))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for frame, (prepared, wanted) in zip(frames, asked, strict=True):
        assert frame is not None
        np.testing.assert_array_equal(frame.pixels, alone.render(prepared, wanted).pixels)
    shared.close()
    alone.close()


def test_the_same_view_asked_twice_at_once_is_traced_once(scene: PreparedScene) -> None:
    shared = Renderer(threads=2)
    frames: list[Frame] = []

    def render() -> None:
        frames.append(shared.render(scene, request((60, 20))))

    threads = [threading.Thread(target=render) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(frame.cost.cells_traced for frame in frames)[:3] == [0, 0, 0]
    for frame in frames:
        np.testing.assert_array_equal(frame.pixels, frames[0].pixels)
    shared.close()


@pytest.mark.parametrize("tiling", MAPS)
def test_kept_samples_do_not_keep_the_scene(tiling: str) -> None:
    fresh = Renderer(threads=2)
    prepared = prepare(glass_and_mirror())
    fresh.render(prepared, request((20, 20), dataclasses.replace(FOVEATED, map=tiling)))
    watched = weakref.ref(prepared.intersector)
    del prepared
    gc.collect()
    assert watched() is None
    fresh.close()


def test_samples_of_one_scene_are_not_given_to_another(renderer: Renderer) -> None:
    """Scenes made one after another in the same place of memory."""
    for brightness in (0.25, 0.5, 1.0):
        frame = shoot(renderer, Scene(surroundings=Surroundings(horizon=(brightness,) * 3, zenith=(brightness,) * 3)))
        assert frame.pixels[0, 0, 0] == brightness


def test_the_caches_count(scene: PreparedScene) -> None:
    fresh = Renderer(threads=2)
    for gaze in ((20, 20), (20, 20), (60, 20)):
        fresh.render(scene, request(gaze))
    assert (fresh.map_cache.misses, fresh.map_cache.hits, fresh.map_cache.entries) == (2, 1, 2)
    assert (fresh.store_cache.misses, fresh.store_cache.hits, fresh.store_cache.entries) == (1, 2, 1)
    assert fresh.map_cache.nbytes > 0
    assert fresh.store_cache.nbytes > 0
    fresh.forget_samples()
    assert fresh.store_cache.nbytes == 0
    fresh.close()


def test_a_black_scene_is_black(renderer: Renderer) -> None:
    for scene in (Scene(), Scene(meshes=(floor(Material(diffuse=BLACK)),), lights=(light(0, 3, 0),))):
        frame = shoot(renderer, scene, 8, 8, linear=False)
        np.testing.assert_array_equal(frame.pixels, 0)
