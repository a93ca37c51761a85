"""What preparing a scene keeps, drops and moves."""

from __future__ import annotations

import dataclasses

import numpy as np

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.scene import Material, Mesh, PointLight, Scene, Sphere, Texture
from tests.renderer.drawing import (
    BLACK,
    WHITE,
    WHITE_LAMBERT,
    ball_mesh,
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
