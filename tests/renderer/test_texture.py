"""Textures seen on a square whose corners all have the same coordinates: one place of the picture fills it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.errors import SettingsError
from renderer.pipeline import Renderer
from renderer.scene import Material, Scene, Sphere, Texture
from tests.renderer.drawing import WHITE, U, aim, quad, shoot
from tests.renderer.texel import AMBIENT, linear, look_up, picture


def test_v_points_up(renderer: Renderer) -> None:
    upright = picture([[10], [100], [200]])
    for row, code in enumerate((10, 100, 200)):
        seen = look_up(renderer, upright, 0.5, 1 - (row + 0.5) / 3)
        np.testing.assert_allclose(seen, linear(code), rtol=1e-5)


def test_a_picture_repeats(renderer: Renderer) -> None:
    texture = Texture(np.random.default_rng(4).integers(0, 256, (4, 4, 3), dtype=np.uint8))
    for u, v in ((0.125, 0.625), (0.3, 0.8), (0.97, 0.03)):
        for i, j in ((1, 0), (0, -1), (-3, 5)):
            np.testing.assert_allclose(
                look_up(renderer, texture, u + i, v + j), look_up(renderer, texture, u, v), atol=1e-5
            )


@pytest.mark.parametrize(
    ("coordinate", "wrap", "place"),
    [
        (-0.3, "clamp", 0.0), (1.3, "clamp", 1.0), (1e9, "clamp", 1.0), (-1e9, "clamp", 0.0), (0.4, "clamp", 0.4),
        (-0.3, "mirror", 0.3), (1.3, "mirror", 0.7), (2.3, "mirror", 0.3), (-1e-9, "mirror", 1e-9),
        (math.nan, "clamp", 0.0), (math.nan, "mirror", 0.0), (math.inf, "mirror", 0.0), (1e300, "mirror", 0.0),
    ],
)  # fmt: skip
def test_beyond_its_edges_a_picture_is_clamped_or_mirrored(
    renderer: Renderer, coordinate: float, wrap: str, place: float
) -> None:
    """As at the place inside; a clamped picture shows its edge texel alone within half a texel of the edge."""
    codes = picture([[10, 60, 110], [120, 190, 250]])
    beyond = dataclasses.replace(codes, wrap_u=wrap, wrap_v=wrap)
    inside = dataclasses.replace(codes, wrap_u="clamp", wrap_v="clamp")
    for u, v, iu, iv in ((coordinate, 0.25, place, 0.25), (0.5, coordinate, 0.5, place)):
        np.testing.assert_allclose(look_up(renderer, beyond, u, v), look_up(renderer, inside, iu, iv), atol=1e-6)
    np.testing.assert_allclose(look_up(renderer, inside, 0.0, 0.25), linear(120), rtol=4 * U)
    np.testing.assert_allclose(look_up(renderer, inside, 0.0, 1.0), linear(10), rtol=4 * U)
    np.testing.assert_allclose(look_up(renderer, inside, 1.0, 0.0), linear(250), rtol=4 * U)


def test_an_unknown_wrap_is_refused() -> None:
    with pytest.raises(SettingsError, match="wrap_v: expected one of repeat, clamp, mirror, found 'tile'"):
        Texture(np.zeros((1, 1, 3), np.uint8), wrap_v="tile")


def test_every_code_comes_out_of_a_picture_as_it_went_in(renderer: Renderer) -> None:
    """256 texels seen 1 : 1 by the pixels of a screen, tone-mapped."""
    codes = np.arange(256, dtype=np.uint8)
    square = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), Material(diffuse=WHITE, diffuse_texture=picture([codes.tolist()])))
    camera = Camera((0, 0, 1), (0, 0, 0), vertical_fov_deg=2 * math.degrees(math.atan(1 / 256)))
    scene = Scene(meshes=(square,), surroundings=AMBIENT, camera=camera)
    seen = shoot(renderer, scene, 256, 1, linear=False).pixels
    np.testing.assert_array_equal(seen[0, :, 0], codes)


def test_texture_multiplies_the_diffuse_colour(renderer: Renderer) -> None:
    square = quad(
        (-1, -1, 0), (2, 0, 0), (0, 2, 0), Material(diffuse=(0.5, 0.25, 0.0), diffuse_texture=picture([[99]]))
    )
    scene = Scene(meshes=(square,), surroundings=AMBIENT, camera=aim((0, 0, 2), (0, 0, 0)))
    expected = np.array([0.5, 0.25, 0.0]) * linear(99)
    np.testing.assert_allclose(shoot(renderer, scene).pixels[0, 0], expected, rtol=4 * U)


def test_two_pictures_do_not_mix(renderer: Renderer) -> None:
    left = quad((-2, -1, 0), (2, 0, 0), (0, 2, 0), Material("a", diffuse=WHITE, diffuse_texture=picture([[50] * 3])))
    right = quad((0, -1, 0), (2, 0, 0), (0, 2, 0), Material("b", diffuse=WHITE, diffuse_texture=picture([[220]] * 5)))
    scene = Scene(meshes=(left, right), surroundings=AMBIENT, camera=Camera((0, 0, 2), vertical_fov_deg=40))
    seen = shoot(renderer, scene, 8, 8, linear=False).pixels[..., 0]
    np.testing.assert_array_equal(seen, np.tile([50] * 4 + [220] * 4, (8, 1)))


def test_a_sphere_shows_its_picture_the_right_way_round(renderer: Renderer) -> None:
    """North is at the top; seen from outside, the picture runs from left to right."""
    quadrants = picture([[200, 150, 100, 50], [20, 15, 10, 5]])
    material = Material(diffuse=WHITE, diffuse_texture=quadrants)
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, material),), surroundings=AMBIENT, camera=Camera((0, 0, 9)))
    seen = shoot(renderer, scene, 65, 65).pixels[..., 0]
    assert seen[29, 32] > 2 * seen[35, 32]
    assert seen[31, 29] > seen[31, 35]
