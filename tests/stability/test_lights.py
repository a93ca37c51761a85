"""Lights where they are awkward: on, in and behind surfaces, behind glass, without a size."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.scene import (
    Light,
    Material,
    RectangleLight,
    Rgb,
    Scene,
    Sphere,
    SphereLight,
)
from tests.renderer.drawing import (
    DOWN,
    WHITE_LAMBERT,
    U,
    ball_mesh,
    box,
    floor,
    glass,
    light,
    pixel,
    shoot,
)

STEADY = Camera((0, 3, 0), (0, 0, 0), (0, 0, -1), 1e-3)
"""Looks straight down at the origin from 3 m: every pixel sees the same point."""


@pytest.mark.parametrize(("x", "h"), [(0.0, 1.0), (1.0, 1.0), (3.0, 2.0), (4.0, 0.01), (0.0, 4000.0)])
@pytest.mark.parametrize("casts", [True, False])
def test_h35_a_light_over_a_plane(renderer: Renderer, x: float, h: float, casts: bool) -> None:
    kd, intensity = 0.8, 7.0 * max(1.0, h * h)
    ground = floor(Material(diffuse=(kd,) * 3), casts_shadows=casts)
    seen = pixel(renderer, Scene(meshes=(ground,), lights=(light(x, h, 0, intensity),), camera=DOWN))
    assert seen == pytest.approx(kd / math.pi * intensity * h / (x * x + h * h) ** 1.5, rel=8 * U)
    if x == h == 1.0:
        assert seen == pytest.approx(0.1125395395 * kd * intensity, rel=8 * U)


@pytest.mark.parametrize(
    "place", [(1.0, 0.0, 0.0), (1.0, -0.0, 0.0), (1.0, -1e-6, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 0.0)]
)
def test_h35_in_the_plane_and_behind_it_there_is_no_light(renderer: Renderer, place: Rgb) -> None:
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(*place, 1e6),), camera=DOWN)
    assert pixel(renderer, scene) == 0.0


def test_h35_a_light_at_the_eye(renderer: Renderer) -> None:
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(0, 3, 0, 9.0),), camera=DOWN)
    assert pixel(renderer, scene) == pytest.approx(1 / math.pi, rel=8 * U)


@pytest.mark.parametrize("distance", [0.0, 1e-160, 1e-45, 1e-23, 1e-20, 1e-16, 1e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("solid", ["plane", "sphere", "mesh"])
def test_h35_a_light_on_a_surface_is_finite(renderer: Renderer, distance: float, solid: str) -> None:
    scene = Scene(lights=(light(0.0, distance, 0.0, 1.0),), camera=DOWN)
    if solid == "sphere":
        scene = dataclasses.replace(scene, spheres=(Sphere((0, -1, 0), 1.0, WHITE_LAMBERT),))
    else:
        ground = floor(WHITE_LAMBERT) if solid == "plane" else ball_mesh(WHITE_LAMBERT, 2, True)
        if solid == "mesh":
            ground = dataclasses.replace(ground, vertices=ground.vertices + np.array([0.0, -1.0, 0.0]))
        scene = dataclasses.replace(scene, meshes=(ground,))
    frame = shoot(renderer, scene, 5, 5, samples=4)
    assert np.isfinite(frame.pixels).all()
    assert (frame.pixels >= 0).all()
    assert frame.cost.rejected_samples == 0
    assert frame.cost.rms_error is not None
    assert math.isfinite(frame.cost.rms_error)


def test_h35_a_closed_ball_keeps_its_light_inside(renderer: Renderer) -> None:
    inside = (light(0.2, 0.1, 0.0, 1e6),)
    for ball in (
        Scene(spheres=(Sphere((0, 0, 0), 1.0, WHITE_LAMBERT),), meshes=(floor(WHITE_LAMBERT, -1.5),), lights=inside),
        Scene(meshes=(ball_mesh(WHITE_LAMBERT, 3, True), floor(WHITE_LAMBERT, -1.5)), lights=inside),
        Scene(meshes=(box((-1, -1, -1), (1, 1, 1), WHITE_LAMBERT), floor(WHITE_LAMBERT, -1.5)), lights=inside),
    ):
        seen = shoot(renderer, ball, 64, 64, camera=Camera((0, 1, 6), (0, 0, 0))).pixels
        np.testing.assert_array_equal(seen, 0.0)


def test_h36_glass_blocks_light_like_any_object(renderer: Renderer) -> None:
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT),),
        spheres=(Sphere((1, 1, 0), 0.3, glass()),),
        lights=(light(2, 2, 0),),
        camera=DOWN,
    )
    assert pixel(renderer, scene) == 0.0


@pytest.mark.parametrize("size", [1e-2, 1e-3, 1e-4, 1e-6, 1e-10, 1e-13, 6e-20])
def test_h37_a_tiny_light_is_a_point_light_of_the_same_power(renderer: Renderer, size: float) -> None:
    """To the square of its size over its distance, and its place to the size; the radiance is 1e12, the most there is,
    or less. At a side of 6e-20 m, whose square float32 cannot hold, such a light is too faint to change a pixel at
    any exposure, and is left out like the point light of its power.
    """
    power = 1e12 * size * size
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), camera=STEADY, exposure=1e12)
    point = shoot(renderer, dataclasses.replace(scene, lights=(light(1, 2, 0, power),)), 16, 16)
    corner, across = (1 - size, 2 + size / 2, -size / 2), power / (size * size * math.sqrt(5))
    lamps: tuple[Light, Light] = (
        SphereLight((1, 2, 0), size, (power / (math.pi * size**2),) * 3),
        RectangleLight(corner, (2 * size, -size, 0), (0, 0, size), (across,) * 3),
    )
    assert (point.pixels.max() > 0.0) == (size > 1e-15)
    for lamp in lamps:
        frame = shoot(renderer, dataclasses.replace(scene, lights=(lamp,)), 16, 16)
        np.testing.assert_allclose(frame.pixels, point.pixels, rtol=3 * size + 16 * U)
