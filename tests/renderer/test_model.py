"""Lights and cameras of mesh files: what arrives where, and what is seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from renderer.errors import SceneError, SettingsError
from renderer.framing import BRIGHTEST, DEFAULT_MATERIAL, DIMMEST, STUDIO, frame_model
from renderer.model import INVERSE_SQUARE, Model, StatedLight, camera_of, point_lights, vertical_fov
from renderer.placement import placed_camera, placed_light
from renderer.scene import PointLight
from renderer.shapes import ball

MIDDLE = (1.0, 2.0, 3.0)


def arriving(lights: tuple[PointLight, ...], point: tuple[float, float, float]) -> float:
    """Irradiance of what faces each light at `point` [W/m^2], summed."""
    return sum(light.intensity[0] / math.dist(light.position, point) ** 2 for light in lights)


@pytest.mark.parametrize("falloff", [(1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (1.0, 0.5, 0.25), (0.0, 0.0, 4.0)])
def test_the_middle_of_the_model_receives_what_the_file_states(falloff: tuple[float, float, float]) -> None:
    light = StatedLight((8.0, 4.0, 2.0), (1.0, 2.0, 13.0), falloff=falloff)
    (made,) = point_lights((light,), MIDDLE, 1.5, "a")
    c, linear, q = falloff
    assert arriving((made,), MIDDLE) == pytest.approx(8.0 / (c + 10 * linear + 100 * q))
    assert made.intensity[1] / made.intensity[0] == pytest.approx(0.5)


def test_a_light_within_the_model_is_as_stated_at_the_models_edge() -> None:
    (made,) = point_lights((StatedLight((8.0, 8.0, 8.0), MIDDLE),), MIDDLE, 2.0, "a")
    assert arriving((made,), (1.0, 2.0, 5.0)) == pytest.approx(8.0)
    (made,) = point_lights((StatedLight((8.0, 8.0, 8.0), MIDDLE, falloff=INVERSE_SQUARE),), MIDDLE, 2.0, "a")
    assert made.intensity == (8.0, 8.0, 8.0)


@pytest.mark.parametrize("radius", [1e-6, 1.0, 1e4])
def test_a_distant_light_is_alike_over_the_model(radius: float) -> None:
    (made,) = point_lights((StatedLight((3.0, 3.0, 3.0), direction=(0.0, -5.0, 0.0)),), MIDDLE, radius, "a")
    for offset in (-radius, 0.0, radius):
        x, y, z = MIDDLE
        assert arriving((made,), (x + offset, y + offset, z)) == pytest.approx(3.0, rel=5e-4)
    away = np.array(made.position) - MIDDLE
    np.testing.assert_allclose(away / np.linalg.norm(away), (0.0, 1.0, 0.0), atol=1e-12)


def test_lights_out_of_range_name_the_model() -> None:
    with pytest.raises(SceneError, match=r"^a\.dae: expected lights within the range of a scene"):
        point_lights((StatedLight((1.0, 1.0, 1.0), (1e13, 0.0, 0.0)),), MIDDLE, 1.0, "a.dae")


def test_a_camera_looks_along_its_minus_z() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = 2.0 * np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    matrix[:3, 3] = MIDDLE
    camera = camera_of(matrix, 30.0)
    assert camera.position == MIDDLE
    ahead = np.array(camera.look_at) - MIDDLE
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (-1.0, 0.0, 0.0))
    assert camera.up == (0.0, 2.0, 0.0)
    with pytest.raises(SettingsError):
        camera_of(np.diag([1.0, 1.0, 0.0, 1.0]), 30.0)


def test_field_of_view_of_a_square_picture_is_the_same_both_ways() -> None:
    assert vertical_fov(50.0, 1.0) == pytest.approx(50.0)
    assert math.tan(math.radians(vertical_fov(90.0, 2.0) / 2)) == pytest.approx(0.5)


def test_lights_and_camera_keep_their_effect_when_the_model_is_moved_and_scaled() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = 0.01 * np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    matrix[:3, 3] = (7.0, 8.0, 9.0)
    light = PointLight((1.0, 2.0, 13.0), (5.0, 5.0, 5.0))
    x, y, z = (matrix[:3, :3] @ MIDDLE + matrix[:3, 3]).tolist()
    moved = placed_light(light, matrix)
    assert arriving((moved,), (x, y, z)) == pytest.approx(arriving((light,), MIDDLE))
    camera = placed_camera(camera_of(np.eye(4), 30.0), matrix)
    np.testing.assert_allclose(camera.position, (7.0, 8.0, 9.0))
    ahead = np.array(camera.look_at) - camera.position
    np.testing.assert_allclose(ahead, (-0.01, 0.0, 0.0), atol=1e-12)


def test_a_models_own_view_and_light_come_before_the_framing() -> None:
    sphere = ball(1.0).mesh(DEFAULT_MATERIAL)
    camera = camera_of(np.eye(4), 30.0)
    light = StatedLight((math.pi, math.pi, math.pi), (0.0, 0.0, 9.0))
    scene = frame_model(Model((sphere,), (light,), (0.2, 0.1, 0.0), camera), "ball")
    assert scene.camera is camera
    assert [made.position for made in scene.lights] == [(0.0, 0.0, 9.0)]
    assert scene.surroundings.ambient == (0.2, 0.1, 0.0)
    assert scene.exposure == 1.0
    bare = frame_model(Model((sphere,)), "ball")
    assert len(bare.lights) == 3
    assert bare.surroundings is STUDIO
    assert bare.exposure == 1.0


@pytest.mark.parametrize("brightness", [0.0, 1e-6, 0.6, 1.7, 1e3])
def test_exposure_keeps_a_models_lights_in_the_range_of_a_screen(brightness: float) -> None:
    light = StatedLight((math.pi * brightness,) * 3, direction=(0.0, 0.0, -1.0))
    scene = frame_model(Model((ball(1.0).mesh(DEFAULT_MATERIAL),), (light,)), "ball")
    shown = scene.exposure * arriving(scene.lights, (0.0, 0.0, 0.0)) / math.pi
    assert shown == pytest.approx(min(max(brightness, DIMMEST), BRIGHTEST) if brightness else 0.0, rel=1e-6)
    assert scene.exposure == 1.0 or brightness not in (0.0, 0.6, 1.7)
