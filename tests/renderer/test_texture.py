"""Textures seen on a square whose corners all have the same coordinates: one place of the picture fills it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SceneError, SettingsError
from renderer.pipeline import Renderer
from renderer.scene import Material, Scene, Sphere, Surroundings, Texture
from renderer.texture import srgb_to_linear, wrap
from renderer.tonemap import encode_srgb
from tests.renderer.drawing import WHITE, U, aim, quad, shoot

AMBIENT = Surroundings(ambient=WHITE)


def picture(rows: list[list[int]]) -> Texture:
    """A grey picture of codes."""
    return Texture(np.repeat(np.array(rows, dtype=np.uint8)[:, :, None], 3, axis=2))


def linear(code: float) -> float:
    return float(srgb_to_linear(np.array(code / 255)))


def look_up(renderer: Renderer, texture: Texture, u: float, v: float) -> NDArray[np.float32]:
    """Colour at (u, v) as a material of albedo 1 shows it under ambient light 1."""
    square = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), Material("picture", diffuse=WHITE, diffuse_texture=texture))
    square = dataclasses.replace(square, uvs=np.tile((u, v), (4, 1)).astype(np.float64))
    scene = Scene(meshes=(square,), surroundings=AMBIENT, camera=aim((0, 0, 2), (0.1, 0.1, 0)))
    return np.asarray(shoot(renderer, scene).pixels[0, 0], dtype=np.float32)


@pytest.mark.parametrize(
    ("coordinate", "part"),
    [
        (0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (-0.5, 0.5), (0.25, 0.25), (7.75, 0.75), (-0.0, 0.0),
        (1 - 2.0**-24, 1 - 2.0**-24), (16777217.0, 0.0), (1e9, 0.0), (1e300, 0.0),
        (math.inf, 0.0), (-math.inf, 0.0), (math.nan, 0.0),
    ],
)  # fmt: skip
def test_h46_wrapping(coordinate: float, part: float) -> None:
    assert wrap(coordinate) == part


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_h46_wrapping_never_leaves_the_picture(coordinate: float) -> None:
    assert 0.0 <= wrap(coordinate) < 1.0


@pytest.mark.parametrize("tiny", [-1e-9, -1e-17, -5e-324])
def test_h46_just_below_zero_is_the_end_of_the_picture(tiny: float) -> None:
    assert 1 - 1e-8 < wrap(tiny) < 1.0


@pytest.mark.parametrize(
    ("u", "share_of_b"), [(0.0, 0.5), (0.25, 0.0), (0.5, 0.5), (0.75, 1.0), (1.0, 0.5), (-0.25, 1.0), (0.375, 0.25)]
)
def test_h46_between_texels(renderer: Renderer, u: float, share_of_b: float) -> None:
    """Texture [a, b]: halfway at the border, in linear light."""
    a, b = 40, 200
    expected = (1 - share_of_b) * linear(a) + share_of_b * linear(b)
    np.testing.assert_allclose(look_up(renderer, picture([[a, b]]), u, 0.5), expected, rtol=4 * U)


def test_v_points_up(renderer: Renderer) -> None:
    upright = picture([[10], [100], [200]])
    for row, code in enumerate((10, 100, 200)):
        seen = look_up(renderer, upright, 0.5, 1 - (row + 0.5) / 3)
        np.testing.assert_allclose(seen, linear(code), rtol=1e-5)


@pytest.mark.parametrize(("width", "height"), [(1, 5), (5, 1), (3, 5), (7, 2)])
def test_h48_texel_centres_of_odd_pictures(renderer: Renderer, width: int, height: int) -> None:
    pixels = np.random.default_rng(3).integers(0, 256, (height, width, 3), dtype=np.uint8)
    for row in range(height):
        for column in range(width):
            seen = look_up(renderer, Texture(pixels), (column + 0.5) / width, 1 - (row + 0.5) / height)
            np.testing.assert_array_equal(encode_srgb(seen), pixels[row, column])


@pytest.mark.parametrize("u", [0.0, 0.3, 1.0, -0.5, -1e-9, 1 - 2.0**-24, 16777217.0, 1e9, 1e300, math.inf, math.nan])
def test_h48_one_texel_is_everywhere_the_same(renderer: Renderer, u: float) -> None:
    np.testing.assert_array_equal(look_up(renderer, picture([[137]]), u, u), np.float32(linear(137)))


@pytest.mark.parametrize("u", [math.inf, -math.inf, math.nan, 1e300])
def test_h46_coordinates_that_are_no_number_show_one_place(renderer: Renderer, u: float) -> None:
    texture = picture([[10, 60], [120, 250]])
    np.testing.assert_array_equal(look_up(renderer, texture, u, 0.25), look_up(renderer, texture, 0.0, 0.25))


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


def test_h47_the_seam_and_the_poles_of_a_sphere(renderer: Renderer) -> None:
    """A picture that runs smoothly round the sphere shows no seam, from behind as from the front; poles are finite."""
    around = (128 + 120 * np.cos(2 * np.pi * (np.arange(64) + 0.5) / 64)).astype(np.uint8)
    material = Material(diffuse=WHITE, diffuse_texture=picture([around.tolist()]))
    ball = Scene(spheres=(Sphere((0, 0, 0), 1.0, material),), surroundings=AMBIENT)
    for angle in range(0, 360, 45):
        x, z = 6 * math.sin(math.radians(angle)), 6 * math.cos(math.radians(angle))
        seen = shoot(renderer, ball, 101, 101, camera=Camera((x, 0, z), vertical_fov_deg=15)).pixels[50, :, 0]
        assert np.abs(np.diff(seen)).max() < 0.12
    for y in (6, -6):
        pole = shoot(renderer, ball, 21, 21, camera=Camera((0, y, 0), (0, 0, 0), (0, 0, 1), 5)).pixels
        assert np.isfinite(pole).all()
        assert (pole > 0).all()


def test_a_sphere_shows_its_picture_the_right_way_round(renderer: Renderer) -> None:
    """North is at the top; seen from outside, the picture runs from left to right."""
    quadrants = picture([[200, 150, 100, 50], [20, 15, 10, 5]])
    material = Material(diffuse=WHITE, diffuse_texture=quadrants)
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, material),), surroundings=AMBIENT, camera=Camera((0, 0, 9)))
    seen = shoot(renderer, scene, 65, 65).pixels[..., 0]
    assert seen[29, 32] > 2 * seen[35, 32]
    assert seen[31, 29] > seen[31, 35]


@pytest.mark.parametrize(
    "pixels",
    [
        np.zeros((2, 2), np.uint8),
        np.zeros((2, 2, 4), np.uint8),
        np.zeros((2, 2, 3), np.float32),
        np.zeros((0, 2, 3), np.uint8),
    ],
)
def test_h48_a_picture_of_a_wrong_shape_is_refused(pixels: NDArray[np.uint8]) -> None:
    with pytest.raises(SceneError, match=r"brick\.png: expected"):
        Texture(pixels, "brick.png")
