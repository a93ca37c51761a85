"""Textures and pictures at their limits: coordinates, seams, odd sizes, extreme values, and no NaN in a frame."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SceneError
from renderer.pipeline import Renderer
from renderer.scene import Material, Scene, Sphere, Texture
from renderer.shapes import ball
from renderer.store import (
    BRIGHTEST,
    SampleStore,
    add_samples,
)
from renderer.surface import sphere_surface
from renderer.texture import srgb_to_linear, wrap
from renderer.tonemap import encode_srgb
from tests.renderer.drawing import WHITE, WHITE_LAMBERT, U, floor, light, shoot
from tests.renderer.texel import AMBIENT, linear, look_up, picture, srgb_of


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


@pytest.mark.parametrize("u", [math.inf, -math.inf, math.nan, 1e300])
def test_h46_coordinates_that_are_no_number_show_one_place(renderer: Renderer, u: float) -> None:
    """The corner, as if they were 0: never what lies outside the picture."""
    texture = picture([[10, 60], [120, 250]])
    np.testing.assert_array_equal(look_up(renderer, texture, u, 0.25), look_up(renderer, texture, 0.0, 0.25))


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


@pytest.mark.parametrize(("width", "height"), [(1, 5), (5, 1), (3, 5), (7, 2)])
def test_h48_texel_centres_of_odd_pictures(renderer: Renderer, width: int, height: int) -> None:
    """Of files of every kind, grey, 16 bits deep, with palettes, empty or missing: tests/renderer/test_codec.py and
    test_scene_file.py.
    """
    pixels = np.random.default_rng(3).integers(0, 256, (height, width, 3), dtype=np.uint8)
    for row in range(height):
        for column in range(width):
            seen = look_up(renderer, Texture(pixels), (column + 0.5) / width, 1 - (row + 0.5) / height)
            np.testing.assert_array_equal(encode_srgb(seen), pixels[row, column])


@pytest.mark.parametrize("u", [0.0, 0.3, 1.0, -0.5, -1e-9, 1 - 2.0**-24, 16777217.0, 1e9, 1e300, math.inf, math.nan])
def test_h48_one_texel_is_everywhere_the_same(renderer: Renderer, u: float) -> None:
    np.testing.assert_array_equal(look_up(renderer, picture([[137]]), u, u), np.float32(linear(137)))


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


@pytest.mark.parametrize(
    ("linear", "coded"), [(0.0031308, 0.04044994), (0.5, 0.73535698), (0.0, 0.0), (1.0, 1.0), (0.18, 0.46135613)]
)
def test_h49_values_of_the_standard(linear: float, coded: float) -> None:
    assert srgb_of(linear) == pytest.approx(coded, abs=1e-7)
    assert int(encode_srgb(np.array([linear]))[0]) == round(255 * coded)
    assert float(srgb_to_linear(np.array([coded]))[0]) == pytest.approx(linear, abs=1e-7)


def test_h49_extremes() -> None:
    values = np.float32([0, -0.0, 1e-45, 1e-30, -1, -np.inf, np.nan, 1, 1.0000001, 300, 1e30, 3.4e38, np.inf])
    np.testing.assert_array_equal(encode_srgb(values), [0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 255, 255])


def test_h49_brighter_is_never_darker() -> None:
    values = np.sort(np.exp(np.random.default_rng(1).uniform(-12, 3, 100_000))).astype(np.float32)
    assert (np.diff(encode_srgb(values).astype(int)) >= 0).all()


@pytest.mark.parametrize("bad", [np.nan, -1e-9, -np.inf])
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_h50_a_sample_that_is_no_light_counts_as_black_and_is_counted(bad: float, channel: int) -> None:
    radiance = np.ones((4, 3), np.float32)
    radiance[2, channel] = bad
    store = SampleStore(1)
    assert add_samples(
        store.samples,
        store.spread,
        store.white,
        np.array([0]),
        np.array([0], np.int32),
        np.array([4], np.int32),
        radiance,
    ) == ((1, 0, 0) if math.isnan(bad) else (0, 1, 0))
    np.testing.assert_array_equal(store.samples.total[0], 3.0)
    assert store.samples.number[0] == 4
    assert np.isfinite(store.samples.square).all()


@pytest.mark.parametrize("huge", [np.inf, 3.4e38, 1e30, 1e17])
def test_h50_endless_light_is_cut_where_its_squares_still_fit(huge: float) -> None:
    radiance = np.full((4096, 3), huge, np.float32)
    store = SampleStore(1)
    all_of_them = np.array([4096], np.int32)
    assert add_samples(
        store.samples, store.spread, store.white, np.array([0]), np.array([0], np.int32), all_of_them, radiance
    ) == (0, 0, 4096)
    np.testing.assert_allclose(store.samples.total[0] / 4096, BRIGHTEST, rtol=1e-3)
    assert np.isfinite(store.samples.square[0])


def coordinates(place: tuple[float, float, float]) -> tuple[float, float]:
    """(u, v) of the unit sphere where a ray to the centre meets it."""
    x, y, z = (9 * part for part in place)
    length = math.hypot(x, y, z)
    s = sphere_surface(0, 0, 0, 1.0, 0, x, y, z, -x / length, -y / length, -z / length, True)
    return s.u, s.v


@pytest.mark.parametrize("x", [1e-7, 1e-12, 5e-324, 0.0])
def test_h47_across_the_seam_a_sphere_shows_neighbouring_texels(x: float) -> None:
    """u goes from 1 to 0 at the meridian behind, where atan2(0, -1) and atan2(-0, -1) differ by a turn."""
    (right, _), (left, _) = coordinates((x, 0.2, -1.0)), coordinates((-x, 0.2, -1.0))
    step = abs(wrap(right) - wrap(left))
    assert min(step, 1 - step) <= 1.1e-7
    assert all(0.0 <= u <= 1.0 for u in (right, left))


@pytest.mark.parametrize("y", [1.0, -1.0])
@pytest.mark.parametrize("aside", [0.0, -0.0, 1e-300, 1e-9, 1e-7])
def test_h47_at_the_poles_coordinates_are_finite(y: float, aside: float) -> None:
    """Where rounding may make the height of the unit normal more than 1."""
    for x, z in ((aside, 0.0), (0.0, aside), (aside, aside)):
        u, v = coordinates((x, y, z))
        assert 0.0 <= u <= 1.0
        assert v == pytest.approx(0.5 + y / 2, abs=1e-6)


def test_h47_no_triangle_of_a_ball_runs_through_the_whole_picture() -> None:
    """Meshes show the coordinates their files state; those made here double the corners of their seam."""
    mesh = ball(1.0, 24).mesh(WHITE_LAMBERT)
    assert mesh.uvs is not None
    assert np.ptp(mesh.uvs[mesh.faces][:, :, 0], axis=1).max() <= 2 / 24 * np.ptp(mesh.uvs[:, 0])


def test_h49_exposure_scales_a_picture_by_powers_of_two_without_a_trace(renderer: Renderer) -> None:
    """Light times 2^k at an exposure of 2^-k is the same picture. There is no operator but exposure, clipping and the
    sRGB curve (Siekawa and Mantiuk 2014): no mean that black could make 0, or one bright pixel overturn.
    """
    scene = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(0, 2, 0, 5.0),), camera=Camera((0, 3, 4), (0, 0, 0)))
    truth = shoot(renderer, scene, 32, 24, linear=False).pixels
    assert len(np.unique(truth)) > 20
    for k in (-30, -7, 7, 30):
        scaled = dataclasses.replace(scene, lights=(light(0, 2, 0, 5.0 * 2.0**k),), exposure=2.0**-k)
        np.testing.assert_array_equal(shoot(renderer, scaled, 32, 24, linear=False).pixels, truth)


def test_h49_one_firefly_changes_no_other_pixel() -> None:
    values = np.linspace(0, 1, 10_000, dtype=np.float32)
    lit = values.copy()
    lit[5_000] = 1e30
    np.testing.assert_array_equal(np.delete(encode_srgb(lit), 5_000), np.delete(encode_srgb(values), 5_000))
    assert encode_srgb(lit)[5_000] == 255
