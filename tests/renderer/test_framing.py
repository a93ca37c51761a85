"""A model that comes alone fills the picture and is lit alike at every size."""

from __future__ import annotations

import math

import numpy as np
import pytest

from renderer.camera import view_frame
from renderer.display import Display
from renderer.errors import SceneError
from renderer.framing import (
    DEFAULT_MATERIAL,
    FIELD_OF_VIEW_DEG,
    MARGIN,
    STUDIO,
    bounding_sphere,
    frame_model,
    framed_camera,
)
from renderer.model import Model
from renderer.scene import BLACK, Mesh, Scene, Sphere


def ball(radius: float = 1.0, center: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    """A sphere of triangles: the vertices of a cube grid, pushed out."""
    line = np.linspace(-1, 1, 9)
    u, v = (grid.ravel() for grid in np.meshgrid(line, line))
    one = np.ones_like(u)
    points = np.concatenate([np.stack(p, axis=1) for s in (one, -one) for p in ((s, u, v), (u, s, v), (u, v, s))])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    faces = np.arange(len(points) // 3 * 3).reshape(-1, 3)
    return Mesh(points * radius + center, faces, DEFAULT_MATERIAL)


def on_screen(scene: Scene, points: np.ndarray, display: Display) -> np.ndarray:
    """(n, 2) pixels at which points are seen."""
    frame = view_frame(scene.camera, display)
    columns = np.stack([frame.step_x, frame.step_y, frame.corner], axis=1)
    x, y, depth = np.linalg.solve(columns, (points - np.array(scene.camera.position)).T)
    assert (depth > 0).all()
    return np.stack([x / depth, y / depth], axis=1)


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("offset", [0.0, 50.0])
def test_the_model_fills_the_picture_at_every_size(size: float, offset: float) -> None:
    center = (offset * size, -2 * offset * size, offset * size)
    display = Display(1920, 1080)
    scene = frame_model(Model((ball(size, center),)), "ball")
    seen = on_screen(scene, scene.meshes[0].vertices, display)
    assert seen.min() > 0
    assert seen[:, 0].max() < 1920
    assert seen[:, 1].max() < 1080
    height = seen[:, 1].max() - seen[:, 1].min()
    assert 0.85 * 1080 / MARGIN < height < 1080
    np.testing.assert_allclose(on_screen(scene, np.array([center]), display), [[960, 540]], atol=0.5)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_light_that_arrives_is_the_same_at_every_size(size: float) -> None:
    def arriving(scene: Scene, at: np.ndarray) -> np.ndarray:
        return np.array(
            [np.array(light.intensity) / np.sum((np.array(light.position) - at) ** 2) for light in scene.lights]
        )

    expected = arriving(frame_model(Model((ball(),)), "ball"), np.zeros(3))
    scene = frame_model(Model((ball(size, (size, 0.0, 0.0)),)), "ball")
    np.testing.assert_allclose(arriving(scene, np.array([size, 0, 0])), expected, rtol=1e-9)
    key, fill, rim = expected.sum(axis=1)
    assert key > rim > fill


def test_the_brightest_place_does_not_clip_and_only_the_key_casts_shadows() -> None:
    scene = frame_model(Model((ball(),)), "ball")
    points = ball().vertices
    light = np.array(STUDIO.ambient) * np.ones((len(points), 3))
    for source in scene.lights:
        to_light = np.array(source.position) - points
        distance = np.linalg.norm(to_light, axis=1)
        facing = np.maximum(np.einsum("ij,ij->i", points, to_light) / distance, 0.0)
        light += (facing / distance**2)[:, None] * np.array(source.intensity) / math.pi
    assert 0.6 < (light * DEFAULT_MATERIAL.diffuse).max() < 1.0
    assert [source.casts_shadows for source in scene.lights] == [True, False, False]


def test_the_view_is_from_the_front_right_and_above() -> None:
    camera = frame_model(Model((ball(),)), "ball").camera
    x, y, z = camera.position
    assert z > x > y > 0
    assert camera.vertical_fov_deg == FIELD_OF_VIEW_DEG


def test_only_vertices_that_are_seen_count() -> None:
    model = ball()
    stray = Mesh(np.concatenate([model.vertices, [[1e6, 0, 0]]]), model.faces, DEFAULT_MATERIAL)
    assert frame_model(Model((stray,)), "a").camera == frame_model(Model((model,)), "b").camera


@pytest.mark.parametrize("stretch", [(20, 1, 1), (1, 20, 1), (1, 1, 20), (9, 0, 9)])
def test_long_and_flat_models_touch_an_edge_of_a_4_to_3_screen_and_stay_inside(stretch: tuple[int, int, int]) -> None:
    model = ball()
    scene = frame_model(Model((Mesh(model.vertices * stretch, model.faces, DEFAULT_MATERIAL),)), "long")
    seen = on_screen(scene, scene.meshes[0].vertices, Display(1200, 900)) / (1200, 900)
    assert seen.min() > 0
    assert seen.max() < 1
    assert np.abs(seen - 0.5).max() > 0.4


def test_spheres_are_framed_whole() -> None:
    sphere = Sphere((3.0, 0.0, 0.0), 2.0, DEFAULT_MATERIAL)
    camera = framed_camera([], [sphere], bounding_sphere([], [sphere], "sphere"))
    seen = on_screen(Scene(camera=camera), ball(2.0, (3.0, 0.0, 0.0)).vertices, Display(1200, 900)) / (1200, 900)
    assert 0.03 < seen[:, 1].min() < 0.1
    assert 0.9 < seen[:, 1].max() < 0.97


def test_meshes_and_spheres_are_bounded_together() -> None:
    sphere = Sphere((10.0, 0.0, 0.0), 1.0, DEFAULT_MATERIAL)
    bounds = bounding_sphere([ball()], [sphere], "both")
    np.testing.assert_allclose(bounds.center, (5.0, 0.0, 0.0), atol=0.01)
    assert bounds.radius == pytest.approx(6.0, abs=0.01)


def test_title_and_surroundings() -> None:
    scene = frame_model(Model((ball(),)), "A ball")
    assert scene.title == "A ball"
    assert scene.surroundings is STUDIO
    assert DEFAULT_MATERIAL.transmission == DEFAULT_MATERIAL.reflection == BLACK


def test_nothing_to_frame() -> None:
    point = Mesh(np.ones((3, 3)), np.array([[0, 1, 2]]), DEFAULT_MATERIAL)
    none = Mesh(np.ones((3, 3)), np.zeros((0, 3), dtype=np.int64), DEFAULT_MATERIAL)
    for meshes in ([], [none]):
        with pytest.raises(SceneError, match=r"a\.stl: expected something to show, found no triangle and no sphere"):
            frame_model(Model(meshes), "a.stl")
    with pytest.raises(SceneError, match=r"a\.stl: expected a model with a size"):
        frame_model(Model((point,)), "a.stl")


@pytest.mark.parametrize("center", [(1e12 - 1, 0.0, 0.0), (1e11, -1e11, 1e11)])
def test_a_model_as_small_as_its_place_allows_is_still_seen_from_outside(center: tuple[float, float, float]) -> None:
    camera = frame_model(Model((ball(1e-4, center),)), "far").camera
    assert camera.position != camera.look_at


def test_a_model_too_large_for_its_lights() -> None:
    with pytest.raises(SceneError, match=r"a\.stl: cannot be lit"):
        frame_model(Model((ball(9e11),)), "a.stl")
