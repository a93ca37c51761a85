"""The camera: the middle of the picture, its field of view, true proportions, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera, ViewFrame, view_frame
from renderer.display import Display
from renderer.errors import SettingsError
from renderer.pipeline import Renderer
from renderer.scene import Scene, Sphere
from tests.renderer.drawing import lamp, shoot

coordinates = st.floats(-100, 100)
points = st.tuples(coordinates, coordinates, coordinates)


def ray(view: ViewFrame, x: float, y: float) -> NDArray[np.float64]:
    along = view.corner + x * view.step_x + y * view.step_y
    return np.asarray(along / np.linalg.norm(along))


def angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b)))


@given(points, points, st.floats(0.001, 179))
def test_the_middle_of_the_picture_shows_look_at(
    position: tuple[float, float, float], look_at: tuple[float, float, float], fov: float
) -> None:
    along = np.subtract(look_at, position)
    if np.linalg.norm(along) < 1e-3 or np.linalg.norm(np.cross(along, (0, 1, 0))) < 1e-3 * np.linalg.norm(along):
        return
    display = Display(64, 48)
    middle = ray(view_frame(Camera(position, look_at, vertical_fov_deg=fov), display), 32, 24)
    np.testing.assert_allclose(middle, along / np.linalg.norm(along), atol=1e-12)


@given(st.floats(0.001, 179), st.integers(1, 500), st.integers(1, 500))
def test_the_field_of_view_spans_the_height_of_the_screen(fov: float, width: int, height: int) -> None:
    view = view_frame(Camera(vertical_fov_deg=fov), Display(width, height))
    assert angle_deg(ray(view, width / 2, 0), ray(view, width / 2, height)) == pytest.approx(fov, rel=1e-9)


def test_x_runs_right_and_y_runs_down() -> None:
    view = view_frame(Camera((0, 0, 5), (0, 0, 0)), Display(40, 30))
    assert ray(view, 39, 15)[0] > 0 > ray(view, 1, 15)[0]
    assert ray(view, 20, 1)[1] > 0 > ray(view, 20, 29)[1]


def test_up_need_not_be_square_to_the_view() -> None:
    level = view_frame(Camera((0, 3, 5), (0, 0, 0), (0, 1, 0)), Display(40, 30))
    leaning = view_frame(Camera((0, 3, 5), (0, 0, 0), (0, 7, -2)), Display(40, 30))
    np.testing.assert_allclose(np.array(leaning), np.array(level), atol=1e-15)


def test_pixels_that_are_not_square_keep_true_proportions(renderer: Renderer) -> None:
    """A ball is as wide in centimetres as it is high, on 60 x 40 pixels of 1 cm by 0.5 cm."""
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, lamp()),), camera=Camera((0, 0, 8), vertical_fov_deg=20))
    wide = Display(60, 40, width_cm=60, height_cm=20)
    view = view_frame(scene.camera, wide)
    assert np.linalg.norm(view.step_x) == pytest.approx(2 * float(np.linalg.norm(view.step_y)))
    shape = shoot(renderer, scene, 60, 60).pixels[..., 0] > 0
    assert abs(int(shape.any(axis=0).sum()) - int(shape.any(axis=1).sum())) <= 1


@pytest.mark.parametrize("length", [1e-300, 1e-20, 1.0, 1e15])
def test_the_view_may_be_of_any_length(length: float) -> None:
    view = view_frame(Camera((0, 0, 0), (0, 0, -length), (0, length, 0)), Display(16, 16))
    np.testing.assert_allclose(ray(view, 8, 8), (0, 0, -1), atol=1e-15)


@pytest.mark.parametrize(
    ("field", "arguments"),
    [
        ("camera.look_at", {"position": (1, 2, 3), "look_at": (1, 2, 3)}),
        ("camera.up", {"up": (0, 0, 1)}),
        ("camera.up", {"up": (0, 0, 0)}),
        ("camera.position.y", {"position": (0, math.nan, 0)}),
        ("camera.look_at.z", {"look_at": (0, 0, math.inf)}),
        ("camera.position", {"position": (0, 0)}),
        ("camera.up.x", {"up": ("up", 0, 0)}),
        ("camera.vertical_fov_deg", {"vertical_fov_deg": 0.0}),
        ("camera.vertical_fov_deg", {"vertical_fov_deg": 180.0}),
        ("camera.vertical_fov_deg", {"vertical_fov_deg": math.nan}),
    ],
)
def test_a_camera_that_sees_nothing_is_refused(field: str, arguments: dict[str, Any]) -> None:
    with pytest.raises(SettingsError) as refused:
        Camera(**arguments)
    assert refused.value.field == field
