"""Where leaving rays start, and normals: no shadow of a surface on itself, no black triangles, no leaks."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera, view_frame
from renderer.display import Display
from renderer.pipeline import Renderer
from renderer.prepared import FACET, prepare
from renderer.scene import Material, Mesh, Scene, Sphere
from renderer.surface import weights_at
from tests.renderer.drawing import (
    EVERYWHERE_1,
    WHITE,
    WHITE_LAMBERT,
    U,
    aim,
    ball_mesh,
    box,
    glass,
    lamp,
    light,
    mirror,
    pixel,
    quad,
    shoot,
)


def hits_of(mesh: Mesh, camera: Camera, side_px: int) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which pixels of a square picture show the mesh, and the unit interpolated normals there."""
    prepared = prepare(Scene(meshes=(mesh,)))
    assert prepared.intersector.triangles == len(mesh.faces)
    assert mesh.normals is not None
    view = view_frame(camera, Display(side_px, side_px))
    y, x = np.mgrid[0:side_px, 0:side_px] + 0.5
    direction = view.corner + x[..., None] * view.step_x + y[..., None] * view.step_y
    direction = (direction / np.linalg.norm(direction, axis=2, keepdims=True)).astype(np.float32).reshape(-1, 3)
    position = ((np.array(camera.position) - prepared.center) * prepared.scale).astype(np.float32)
    hits = prepared.intersector.nearest(np.tile(position, (len(direction), 1)), direction)
    weights = np.zeros((len(direction), 3))
    for ray, (x, y, z) in enumerate(direction.astype(np.float64)):
        b1, b2 = weights_at(prepared.surfaces.facets, hits.primitive[ray], *position.astype(np.float64), x, y, z)
        weights[ray] = 1.0 - b1 - b2, b1, b2
    normals = (weights[:, :, None] * mesh.normals[mesh.faces[hits.primitive]]).sum(axis=1)
    return hits.primitive >= 0, normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("level", [1, 2, 3, 4])
@pytest.mark.parametrize("view", [1.2, 2.5, -0.4])
def test_h23_a_smooth_mesh_has_no_black_triangles(renderer: Renderer, level: int, view: float) -> None:
    """The shade is the sphere's own max(0, N.L) up to the terminator, on 80 to 5,120 triangles."""
    toward = np.array((1.0, 2.0, 3.0)) / math.sqrt(14)
    mesh = ball_mesh(WHITE_LAMBERT, level, smooth=True)
    camera = Camera((5 * math.sin(view), 0.5, 5 * math.cos(view)), (0, 0, 0), vertical_fov_deg=22)
    scene = Scene(meshes=(mesh,), lights=(light(*(1e6 * toward), 1e12 * math.pi),), camera=camera)
    shade = shoot(renderer, scene, 200, 200).pixels[..., 0].ravel()
    seen, normals = hits_of(mesh, camera, 200)
    truth = np.maximum(0.0, normals @ toward)
    lit = seen & (truth > 1e-5)
    assert lit.sum() > 5000
    assert (shade[lit] > 0).all()
    np.testing.assert_allclose(shade[seen], truth[seen], atol=1e-5)


def test_a_smooth_ball_from_inside(renderer: Renderer) -> None:
    """A light of pi W/sr in the middle: the albedo in every direction, but for the flatness of 5,120 triangles."""
    scene = Scene(meshes=(ball_mesh(WHITE_LAMBERT, 4, smooth=True),), lights=(light(0, 0, 0, math.pi),))
    seen = shoot(renderer, scene, 48, 48, camera=Camera((0.1, 0.2, 0.3), (1, 0.5, 0), vertical_fov_deg=100)).pixels
    np.testing.assert_allclose(seen, 1.0, atol=0.01)


# normals that disagree with the geometry


def bent_box(bend: float, seed: int) -> Mesh:
    """A closed box whose triangles have corner normals up to `bend` away from their own."""
    shape = box((-1, -1, -1), (1, 1, 1), WHITE_LAMBERT)
    corners = shape.vertices[shape.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    own = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
    own /= np.linalg.norm(own, axis=1)[:, None]
    normals = np.repeat(own, 3, axis=0) + np.random.default_rng(seed).uniform(-bend, bend, (len(corners), 3))
    return Mesh(corners, faces, WHITE_LAMBERT, normals)


@pytest.mark.parametrize("bend", [0.1, 0.5, 3.0])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_h25_no_light_leaks_into_a_closed_box(renderer: Renderer, bend: float, seed: int) -> None:
    lights = (light(4, 5, 6, 1e3), light(-3, 0.2, 0.1, 1e3), light(0, -1.5, 0, 1e3))
    scene = Scene(meshes=(bent_box(bend, seed),), lights=lights)
    for look_at in ((1, 0.2, 0), (-1, 0, 0.3), (0.1, 1, 0), (0, -1, 0.1)):
        seen = shoot(renderer, scene, 48, 48, camera=Camera((0, 0, 0), look_at, (0, 0.3, 1), 90)).pixels
        np.testing.assert_array_equal(seen, 0.0)


def test_h25_a_mirror_ray_stays_above_the_face(renderer: Renderer) -> None:
    """View at 85 degrees, normal bent 3 degrees away from it: the plain mirror ray would dip below the face."""
    bend, view = math.radians(3), math.radians(85)
    sheet = quad((-50, -50, 0), (100, 0, 0), (0, 100, 0), mirror())
    sheet = dataclasses.replace(sheet, normals=np.tile((-math.sin(bend), 0, math.cos(bend)), (4, 1)))
    below = quad((-50, -50, -1), (100, 0, 0), (0, 100, 0), lamp(5.0))
    scene = Scene(meshes=(sheet, below), surroundings=EVERYWHERE_1)
    assert pixel(renderer, scene, camera=aim((math.sin(view), 0, math.cos(view)), (0, 0, 0))) == 1.0


def test_h25_normals_that_face_away_from_the_eye_are_finite(renderer: Renderer) -> None:
    view = math.radians(85)
    for bend_deg in (-10, -5.000001, -5, -4.999999, 10):
        bend = math.radians(bend_deg)
        for material in (WHITE_LAMBERT, mirror(), glass(), Material(specular=WHITE, shininess=100.0)):
            sheet = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), material)
            sheet = dataclasses.replace(sheet, normals=np.tile((math.sin(bend), 0, math.cos(bend)), (4, 1)))
            scene = Scene(meshes=(sheet,), lights=(light(-1, 0, 0.2),), surroundings=EVERYWHERE_1)
            frame = shoot(renderer, scene, 9, 9, camera=aim((math.sin(view), 0, math.cos(view)), (0, 0, 0)))
            assert np.isfinite(frame.pixels).all()
            assert (frame.pixels >= 0).all()
            assert frame.cost.rejected_samples == 0


def test_the_poles_of_a_ball_are_no_special_place(renderer: Renderer) -> None:
    for up in (1.0, -1.0):
        scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, WHITE_LAMBERT),), lights=(light(0, up * 3, 0, math.pi * 4),))
        assert pixel(renderer, scene, camera=aim((0, up * 3, 0), (0, 0, 0))) == pytest.approx(1.0, rel=8 * U)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_weights_are_those_of_the_point_the_ray_goes_to(size: float) -> None:
    """And stay inside the triangle for a ray that passes it by; a triangle without area has its first corner."""
    rng = np.random.default_rng(8)
    for _ in range(200):
        corners = (size * rng.uniform(-1, 1, (3, 3))).astype(np.float32)
        facet = np.zeros((1, FACET), dtype=np.float32)
        facet[0, :24].reshape(3, 8)[:, :3] = corners
        weights = rng.dirichlet((1, 1, 1))
        origin = size * rng.uniform(-9, 9, 3)
        direction = weights @ corners.astype(np.float64) - origin
        direction /= np.linalg.norm(direction)
        grazing = abs(np.linalg.det([*(corners[1:].astype(np.float64) - corners[0]), direction * size]))
        b1, b2 = weights_at(facet, 0, *origin, *direction)
        np.testing.assert_allclose((b1, b2), weights[1:], atol=1e-13 * size**3 * 20 / grazing)
        b1, b2 = weights_at(facet, 0, *origin, *rng.normal(size=3))
        assert 0.0 <= b1 <= 1.0
        assert 0.0 <= b2 <= 1.0
        assert b1 + b2 <= 1.0 + 1e-15
    facet[:] = 1.0
    assert weights_at(facet, 0, 0.0, 0.0, 9.0, 0.0, 0.0, -1.0) == (0.0, 0.0)
