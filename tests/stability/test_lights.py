"""Lights where they are awkward: on, in and behind surfaces, behind glass, without a size."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.errors import SettingsError
from renderer.pipeline import Renderer
from renderer.scene import (
    Light,
    Material,
    PointLight,
    RectangleError,
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
    aim,
    ball_mesh,
    box,
    floor,
    glass,
    light,
    pixel,
    quad,
    shoot,
)
from tests.renderer.test_area_light import panel_irradiance

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
    # The light in a sample may have no end, and is cut; nothing else is wrong with it.
    assert dataclasses.replace(frame.cost.rejected_samples, too_bright=0).total == 0
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


@pytest.mark.parametrize("where", ["inside a ball", "behind a ball", "behind a pane"])
@pytest.mark.parametrize("kind", ["point", "sphere", "rectangle"])
def test_h36_glass_is_one_rule_for_hard_and_soft_shadows(renderer: Renderer, where: str, kind: str) -> None:
    """It blocks all of a light, be it around the light or in between, and none of it if it casts no shadows. The
    stored pictures of POV-Ray and Mitsuba that ours are held against are made under the same rule.
    """
    lamp: Light = {
        "point": PointLight((0, 2, 0), (5.0,) * 3),
        "sphere": SphereLight((0, 2, 0), 0.1, (5.0,) * 3),
        "rectangle": RectangleLight((-0.1, 2, -0.1), (0.2, 0, 0), (0, 0, 0.2), (5.0,) * 3),
    }[kind]
    camera = aim((2, 0.5, 0), (0, 0, 0))
    bare = Scene(meshes=(floor(WHITE_LAMBERT, casts_shadows=False),), lights=(lamp,), camera=camera)
    for casts in (True, False):
        if where == "behind a pane":
            pane = quad((-3, 1, 3), (6, 0, 0), (0, 0, -6), glass(), casts)
            scene = dataclasses.replace(bare, meshes=(*bare.meshes, pane))
        else:
            ball = Sphere((0, 2.0 if where == "inside a ball" else 1.3, 0), 0.5, glass(), casts)
            scene = dataclasses.replace(bare, spheres=(ball,))
        assert pixel(renderer, scene) == (0.0 if casts else pixel(renderer, bare))


@pytest.mark.parametrize("size", [0.0, -1.0, math.nan, math.inf])
def test_h37_a_light_of_no_size_is_refused(size: float) -> None:
    """A given radiance on no area would send nothing; the message names the field."""
    with pytest.raises(SettingsError, match=r"light\.radius: expected a number in \(0, 1e\+12\]"):
        SphereLight((0, 1, 0), size, (1.0,) * 3)
    if size != -1.0:
        with pytest.raises((RectangleError, SettingsError), match=r"light\.edge_u"):
            RectangleLight((0, 1, 0), (size, 0, 0), (0, 0, 1), (1.0,) * 3)


@pytest.mark.parametrize("x", [-0.6, -0.5, -0.4, -0.2, 0.0, 0.2, 0.4, 0.5, 0.6])
def test_h38_behind_a_knife_edge_the_visible_part_of_the_light_counts(renderer: Renderer, x: float) -> None:
    """Square light of side 1 at height 2, edge at height 1 that covers x < 0: of the light clamp(0.5 + x, 0, 1) is
    seen from the floor at x. Its samples are even over the solid angle, not over the area, so that the truth is the
    irradiance of the visible part (Lambert 1760). 4,096 pixels of 4 rays each; tolerance 4.5 standard errors of their
    mean, which fails once in 150,000 runs; where nothing or everything is seen, none but rounding.
    """
    visible = min(1.0, max(0.0, 0.5 + x))
    roof = quad((-50, 1, -50), (50, 0, 0), (0, 0, 100), WHITE_LAMBERT)
    scene = Scene(
        meshes=(floor(WHITE_LAMBERT), roof),
        lights=(RectangleLight((-0.5, 2, -0.5), (1, 0, 0), (0, 0, 1), (1.0,) * 3),),
        camera=Camera((x, 0.5, 0), (x, 0, 0), (0, 0, -1), 1e-3),
    )
    seen = shoot(renderer, scene, 64, 64, shadow_samples=4).pixels[..., 0].astype(np.float64)
    if visible == 0.0:
        np.testing.assert_array_equal(seen, 0.0)
        return
    truth = panel_irradiance(0.5 - visible, 0.5, -0.5, 0.5, 2.0, (x, 0, 0)) / math.pi
    error = seen.std() / math.sqrt(seen.size)
    assert seen.mean() == pytest.approx(truth, abs=4.5 * error + 1e-5 * truth)
    assert error < 0.05 * truth
