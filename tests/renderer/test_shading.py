"""What a surface sends to the eye: closed forms, shadows that must and must not be there, normals that disagree."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from renderer.pipeline import Renderer
from renderer.scene import Material, Mesh, PointLight, Rgb, Scene, Sphere, Surroundings
from tests.renderer.drawing import (
    BLACK,
    DOWN,
    WHITE,
    WHITE_LAMBERT,
    U,
    aim,
    ball_mesh,
    floor,
    icosphere,
    light,
    pixel,
    quad,
    shoot,
)


def moved(mesh: Mesh, factor: float, offset: Rgb = (0, 0, 0)) -> Mesh:
    return dataclasses.replace(mesh, vertices=factor * mesh.vertices + np.array(offset, dtype=np.float64))


# light


def test_a_sphere_under_a_light(renderer: Renderer) -> None:
    scene = Scene(spheres=(Sphere((0, -2, 0), 2.0, WHITE_LAMBERT),), lights=(light(1, 1, 0, 5.0),), camera=DOWN)
    assert pixel(renderer, scene) == pytest.approx(5 * 0.1125395395, rel=8 * U)


def test_light_adds_up_and_keeps_its_colour(renderer: Renderer) -> None:
    ground = Material(diffuse=(0.5, 0.25, 1.0), emission=(0.125, 0.0, 0.0))
    one, two = PointLight((0, 2, 0), (4.0, 2.0, 0.0)), PointLight((0, 1, 0), (0.0, 1.0, 3.0))
    around = Surroundings(ambient=(0.5, 0.5, 0.5))
    scene = Scene(meshes=(floor(ground),), lights=(one, two), surroundings=around, camera=DOWN)
    expected = np.array((0.5, 0.25, 1.0)) * (np.array((1.0, 0.5, 0.0)) + (0.0, 1.0, 3.0)) / math.pi
    expected += np.array((0.125, 0, 0)) + 0.5 * np.array((0.5, 0.25, 1.0))
    np.testing.assert_allclose(shoot(renderer, scene).pixels[0, 0], expected, rtol=8 * U)


def test_the_brightest_light_leaves_the_stated_error_finite(renderer: Renderer) -> None:
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(1, 1e-6, 0, 1e24),), camera=DOWN)
    cost = shoot(renderer, scene, 8, 8, samples=16).cost
    assert math.isfinite(cost.rms_error)
    # It sends back more than can be summed up; nothing else is wrong with it.
    assert dataclasses.replace(cost.rejected_samples, too_bright=0).total == 0


def test_surroundings_blend_with_height(renderer: Renderer) -> None:
    sky = Scene(surroundings=Surroundings(zenith=(0, 0, 1), horizon=(1, 0.5, 0)))
    for up in (-0.7, 0.0, 0.25, 1.0):
        direction = (math.sqrt(1 - up * up), up, 0.0)
        high = max(0.0, up)
        seen = shoot(renderer, sky, camera=aim((0, 0, 0), direction)).pixels[0, 0]
        np.testing.assert_allclose(seen, (1 - high, 0.5 * (1 - high), high), atol=4 * U)


# highlights


def test_a_highlight_lies_where_the_light_is_mirrored(renderer: Renderer) -> None:
    """Eye and light at 40 degrees on either side; no highlight with both on one side."""
    ground = floor(Material(diffuse=BLACK, specular=WHITE, shininess=50.0))
    x, y = 2 * math.sin(math.radians(40)), 2 * math.cos(math.radians(40))
    camera = aim((x, y, 0), (0, 0, 0))
    opposite, beside = (
        pixel(renderer, Scene(meshes=(ground,), lights=(light(s * x, y, 0, 4.0),)), camera=camera) for s in (-1, 1)
    )
    assert opposite == pytest.approx(1.0, rel=1e-5)
    assert beside < 1e-30


def test_a_light_behind_the_surface_makes_no_highlight(renderer: Renderer) -> None:
    ground = floor(Material(diffuse=BLACK, specular=WHITE, shininess=1.0), casts_shadows=False)
    camera = aim((-2, 0.5, 0), (0, 0, 0))
    above, below = (
        pixel(renderer, Scene(meshes=(ground,), lights=(light(2, y, 0),)), camera=camera) for y in (0.1, -0.1)
    )
    assert above > 0.1
    assert below == 0.0


# shadows


def test_what_stands_between_blocks_and_what_stands_behind_does_not(renderer: Renderer) -> None:
    lit = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(2, 2, 0),), camera=DOWN)
    bright = pixel(renderer, lit)
    assert bright > 0
    plate = quad((0.5, 1, -1), (1, 0, 0), (0, 0, 2), WHITE_LAMBERT)
    for blocker in (plate, moved(ball_mesh(WHITE_LAMBERT, 1), 0.2, (1, 1, 0))):
        assert pixel(renderer, dataclasses.replace(lit, meshes=(*lit.meshes, blocker))) == 0.0
        ghost = dataclasses.replace(blocker, casts_shadows=False)
        assert pixel(renderer, dataclasses.replace(lit, meshes=(*lit.meshes, ghost))) == bright
        behind = moved(blocker, 1.0, (1.5, 1.5, 0))
        assert pixel(renderer, dataclasses.replace(lit, meshes=(*lit.meshes, behind))) == bright
    for place, value in (((1, 1, 0), 0.0), ((2.5, 2.5, 0), bright)):
        assert pixel(renderer, dataclasses.replace(lit, spheres=(Sphere(place, 0.3, WHITE_LAMBERT),))) == value
    ghost_ball = Sphere((1, 1, 0), 0.3, WHITE_LAMBERT, casts_shadows=False)
    assert pixel(renderer, dataclasses.replace(lit, spheres=(ghost_ball,))) == bright


def test_a_light_without_shadows_shines_through_everything(renderer: Renderer) -> None:
    roof = floor(WHITE_LAMBERT, 1.5, 0.5)
    for casts in (True, False):
        scene = Scene(
            meshes=(floor(WHITE_LAMBERT), roof), lights=(light(0, 2, 0, 1.0, casts),), camera=aim((0, 1, 0), (0, 0, 0))
        )
        assert pixel(renderer, scene) == pytest.approx(0.0 if casts else 0.25 / math.pi, rel=8 * U)


def test_the_helper_makes_closed_balls() -> None:
    vertices, faces = icosphere(2)
    assert len(faces) == 320
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    outward = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    assert ((outward * vertices[faces].mean(axis=1)).sum(axis=1) > 0).all()
