"""What preparing a scene keeps, drops and moves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.scene import Material, Mesh, PointLight, Scene, Sphere, Texture
from tests.renderer.drawing import (
    BLACK,
    WHITE,
    WHITE_LAMBERT,
    ball_mesh,
    box,
    floor,
    lamp,
    light,
    mirror,
    quad,
    shoot,
)

TRIANGLE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
FRONT = Camera((0, 0, 4), (0, 0, 0))


def triangles(corners: object, material: Material = WHITE_LAMBERT) -> Mesh:
    vertices = np.array(corners, dtype=np.float64).reshape(-1, 3)
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), material)


@pytest.mark.parametrize("place", [0.0, 1e3, -1e9])
@pytest.mark.parametrize("size", [1e-9, 0.3, 1.0, 7.0, 1e11])
def test_h16_geometry_is_brought_to_about_unit_size(place: float, size: float) -> None:
    if abs(place) > 1e6 * size:
        return
    scene = Scene(meshes=(triangles(size * TRIANGLE + place),))
    prepared = prepare(scene)
    extent = size * 2 * prepared.scale
    assert 1.0 <= extent < 2.0
    assert np.log2(prepared.scale) == round(np.log2(prepared.scale))
    np.testing.assert_allclose(prepared.center, (place, place, place), atol=1e-9 * (abs(place) + size))


def test_a_vertex_that_no_triangle_uses_moves_nothing() -> None:
    mesh = triangles(TRIANGLE)
    stray = dataclasses.replace(mesh, vertices=np.concatenate([mesh.vertices, [[1e11, 0, 0]]]))
    np.testing.assert_array_equal(prepare(Scene(meshes=(stray,))).center, prepare(Scene(meshes=(mesh,))).center)


def test_a_ball_on_the_ground_keeps_its_digits(renderer: Renderer) -> None:
    """The ground is a sphere as large as the Earth; the shadow of a ball on it meets the ball."""
    earth, ball = Sphere((0, -6.4e6, 0), 6.4e6, WHITE_LAMBERT), Sphere((0, 1, 0), 1.0, lamp())
    camera = Camera((0.0, 0.3, 6.0), (0.0, 0.0, 0.0), vertical_fov_deg=10)
    scene = Scene(spheres=(earth, ball), lights=(light(0.0, 9.0, 0.0, 900.0),), camera=camera)
    seen = shoot(renderer, scene, 1, 400).pixels[:, 0, 0]
    drop = np.flatnonzero(seen == 1.0).max()
    assert drop < 399
    assert (seen[drop + 1 : drop + 6] == 0).all()
    assert seen[-1] > 0


def test_without_geometry_the_world_stays_where_it_is() -> None:
    prepared = prepare(Scene())
    assert prepared.scale == 1.0
    np.testing.assert_array_equal(prepared.center, 0.0)


NO_NORMALS = {
    "zero": np.zeros((3, 3)),
    "NaN": np.full((3, 3), np.nan),
    "infinite": np.full((3, 3), np.inf),
    "partly NaN": np.array([[0, 0, np.nan], [np.nan, 0, 1], [0, np.inf, 0]]),
}


@pytest.mark.parametrize("normals", NO_NORMALS.values(), ids=NO_NORMALS.keys())
def test_h24_missing_vertex_normals_are_the_triangles_own(renderer: Renderer, normals: np.ndarray) -> None:
    lights = (light(1, 2, 3, 9.0),)
    flat = triangles(TRIANGLE)
    pictures = [
        shoot(renderer, Scene(meshes=(mesh,), lights=lights, camera=FRONT), 32, 32).pixels
        for mesh in (flat, dataclasses.replace(flat, normals=normals))
    ]
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_h24_opposite_normals_that_cancel_leave_the_picture_finite(renderer: Renderer) -> None:
    mesh = dataclasses.replace(triangles(TRIANGLE), normals=np.array([[0, 0, 1.0], [0, 0, -1.0], [0, 0, 1.0]]))
    frame = shoot(renderer, Scene(meshes=(mesh,), lights=(light(0, 0, 3, 9.0),), camera=FRONT), 64, 64)
    assert np.isfinite(frame.pixels).all()
    assert frame.cost.rejected_samples == 0


@pytest.mark.parametrize("length", [1e-23, 1e-20, 1e-300, 1e300])
def test_h24_normals_of_any_length_keep_their_direction(renderer: Renderer, length: float) -> None:
    normals = np.array([[0.3, 0, 1], [-0.3, 0, 1], [0, 0.3, 1]])
    lights = (light(1, 2, 3, 9.0),)
    pictures = [
        shoot(
            renderer,
            Scene(
                meshes=(dataclasses.replace(triangles(TRIANGLE), normals=scale * normals),), lights=lights, camera=FRONT
            ),
            32,
            32,
        ).pixels
        for scale in (1.0, length)
    ]
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=1e-6)


@pytest.mark.parametrize("smooth", [False, True])
def test_h25_winding_the_other_way_shows_the_same_picture(renderer: Renderer, smooth: bool) -> None:
    mesh = ball_mesh(WHITE_LAMBERT, 2, smooth)
    turned = dataclasses.replace(mesh, faces=mesh.faces[:, ::-1])
    lights = (light(3, 4, 5, 90.0),)
    one, two = (shoot(renderer, Scene(meshes=(m,), lights=lights, camera=FRONT), 64, 64).pixels for m in (mesh, turned))
    np.testing.assert_allclose(two, one, rtol=1e-5, atol=1e-6)


def test_materials_and_lights_that_nothing_uses_are_left_out() -> None:
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64), mirror())
    dark = PointLight((0, 5, 0), BLACK)
    prepared = prepare(Scene(meshes=(floor(WHITE_LAMBERT), empty), lights=(dark, light(0, 5, 0))))
    assert len(prepared.surfaces.materials) == 1
    assert len(prepared.surfaces.lights) == 1


def test_a_material_used_twice_is_one() -> None:
    same = Material("white", diffuse=WHITE)
    scene = Scene(meshes=(floor(WHITE_LAMBERT), floor(same, 1.0)), spheres=(Sphere((0, 3, 0), 1.0, same),))
    assert len(prepare(scene).surfaces.materials) == 1


def test_a_larger_scene_is_said_to_be_larger() -> None:
    sizes = [prepare(Scene(meshes=(ball_mesh(WHITE_LAMBERT, level),))).nbytes for level in (0, 2, 4)]
    assert sizes == sorted(sizes)
    texture = Texture(np.zeros((512, 512, 3), np.uint8))
    plain, textured = (
        prepare(Scene(meshes=(quad((0, 0, 0), (1, 0, 0), (0, 1, 0), material),))).nbytes
        for material in (WHITE_LAMBERT, Material(diffuse_texture=texture))
    )
    assert textured - plain >= 512 * 512 * 3


@pytest.mark.parametrize("size", [5e-324, 1e-300, 1e-100, 1e-20])
def test_h15_an_absurdly_small_scene_is_a_finite_picture(renderer: Renderer, size: float) -> None:
    """Nothing of it can be seen from metres away; it must not turn coordinates into infinities."""
    for scene in (
        Scene(spheres=(Sphere((0, 0, 0), size, WHITE_LAMBERT),), lights=(light(1, 1, 1),), camera=FRONT),
        Scene(meshes=(triangles(size * TRIANGLE),), lights=(light(1, 1, 1),), camera=FRONT),
        Scene(meshes=(box((0, 0, 0), (size, size, size), mirror()),), lights=(light(1, 1, 1),), camera=FRONT),
    ):
        frame = shoot(renderer, scene, 5, 5)
        assert np.isfinite(frame.pixels).all()
        assert frame.cost.rejected_samples == 0


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e6, 1e11])
def test_h15_h16_any_size_looks_the_same(renderer: Renderer, size: float) -> None:
    """Not a power of two: the input is rounded anew, so to 1e-4 but for a pixel of the outline."""
    pictures = []
    for s in (1.0, size):
        mesh = dataclasses.replace(ball_mesh(WHITE_LAMBERT, 2), vertices=ball_mesh(WHITE_LAMBERT, 2).vertices * s)
        lights = (light(2 * s, 3 * s, 4 * s, 90.0 * s * s),)
        scene = Scene(meshes=(mesh,), lights=lights, camera=Camera((0, 0, 4 * s), (0, 0, 0)))
        pictures.append(shoot(renderer, scene, 64, 64).pixels[..., 0])
    different = np.abs(pictures[1] - pictures[0]) > 1e-4 * pictures[0].max()
    assert different.sum() <= 4
