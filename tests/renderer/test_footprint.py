"""What a ray covers: the share of a cell, mirrors and lenses, and textures that do not alias where cells are large."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera, view_frame
from renderer.display import Display
from renderer.footprint import mirrored_spread, pencil_spread, refracted_spread
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import Quality
from renderer.scene import Material, Mesh, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import BLACK, WHITE, U, aim, mirror, pixel, quad, shoot

AMBIENT = Surroundings(ambient=WHITE)
SCREEN = Display(192, 108, 5.0, 2.8)


def grey(codes: NDArray[np.uint8]) -> Texture:
    return Texture(np.repeat(codes[:, :, None], 3, axis=2))


NOISE = grey(np.random.default_rng(5).integers(0, 256, (128, 128), dtype=np.uint8))
CHECKS = grey(np.uint8(255 * (np.indices((128, 128)).sum(axis=0) % 2)))
SMOOTH = grey((128 + 100 * np.sin(np.indices((128, 128)) * (2 * np.pi / 32)).prod(axis=0)).astype(np.uint8))


def wall(texture: Texture, repeats: float = 1.5) -> Mesh:
    """A square 8 m wide before the camera, with `repeats` of a texture on it."""
    square = quad((-4, -4, 0), (8, 0, 0), (0, 8, 0), Material("wall", WHITE, diffuse_texture=texture))
    assert square.uvs is not None
    return dataclasses.replace(square, uvs=repeats * square.uvs)


def lit(*meshes: Mesh, camera: Camera | None = None) -> Scene:
    return Scene(meshes=meshes, surroundings=AMBIENT, camera=camera or Camera((0, 0, 5), (0, 0, 0)))


def frame(renderer: Renderer, scene: Scene, gaze: Gaze, samples: int, done: int | None = None) -> NDArray[np.float32]:
    """Linear red of a frame, with samples in the middle of all cells first."""
    request = FrameRequest(gaze, SCREEN, None, Quality(samples_per_cell=samples), True, done)
    return np.asarray(renderer.render(prepare(scene), request).pixels[..., 0], dtype=np.float32)


def rms(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    return float(np.sqrt(((a - b) ** 2).mean()))


@pytest.mark.parametrize(
    ("texture", "factor"), [(NOISE, 4.0), (CHECKS, 8.0), (SMOOTH, 1.0)], ids=["noise", "checks", "smooth"]
)
def test_a_large_cell_shows_the_mean_of_a_fine_texture(renderer: Renderer, texture: Texture, factor: float) -> None:
    """One sample a cell of 6 x 6 pixels, far from the gaze, against the mean of 1024. A cell that is to get
    4096 samples filters its first one as for a 64th of its side: not at all."""
    scene, far_away = lit(wall(texture)), Gaze(-1800, 54)
    mean = frame(renderer, scene, far_away, 1024)
    filtered, not_filtered = frame(renderer, scene, far_away, 1), frame(renderer, scene, far_away, 4096, 1)
    assert rms(filtered, mean) * factor < rms(not_filtered, mean)


@pytest.mark.parametrize("samples", [1, 4])
def test_texels_as_large_as_pixels_stay_sharp(renderer: Renderer, samples: int) -> None:
    """At one cell a pixel: the same bits as without any filter."""
    display = Display(192, 108)
    width = 2 * 5 * math.tan(math.radians(20)) * display.aspect
    scene = lit(wall(NOISE, 8 / 128 * display.width_px / width))
    sharp = shoot(renderer, scene, 192, 108, samples=samples).pixels
    quality = Quality(map="full", samples_per_cell=4096)
    request = FrameRequest(Gaze(96, 54), display, None, quality, True, samples)
    np.testing.assert_array_equal(sharp, renderer.render(prepare(scene), request).pixels)


def test_one_colour_is_the_same_at_every_size(renderer: Renderer) -> None:
    plain = grey(np.full((37, 20), 188, np.uint8))
    near, far = (frame(renderer, lit(wall(plain, repeats)), Gaze(-1800, 54), 1) for repeats in (0.01, 900.0))
    np.testing.assert_array_equal(near, far)


def test_a_texture_far_away_is_its_mean(renderer: Renderer) -> None:
    scene = lit(wall(CHECKS, 4000.0))
    np.testing.assert_allclose(shoot(renderer, scene, 16, 9).pixels, 0.5, atol=0.005)


def test_a_flat_mirror_shows_a_texture_as_large_as_it_is(renderer: Renderer) -> None:
    """By way of a mirror 5 m away, a wall 2 m behind the eye; and the same wall straight ahead, at 12 m."""
    repeats = 20.0
    straight = lit(wall(NOISE, repeats), camera=Camera((0, 0, 12), (0, 0, 0), vertical_fov_deg=20))
    behind = dataclasses.replace(wall(NOISE, repeats), vertices=wall(NOISE).vertices + (0, 0, 7))
    glass = quad((-4, -4, 0), (8, 0, 0), (0, 8, 0), mirror())
    by_mirror = lit(glass, behind, camera=Camera((0, 0, 5), (0, 0, 0), vertical_fov_deg=20))
    a, b = (shoot(renderer, scene, 48, 27).pixels for scene in (straight, by_mirror))
    np.testing.assert_allclose(a, b, atol=2e-3)
    assert a.std() < 0.1


@pytest.mark.parametrize("fov_deg", [20.0, 100.0])
def test_pixels_share_the_screen(fov_deg: float) -> None:
    """The squares of all spreads are the solid angle of the screen, as seen from the camera."""
    display = Display(80, 60, 40.0, 40.0)
    view = view_frame(Camera(vertical_fov_deg=fov_deg), display)
    x, y = np.meshgrid(np.arange(80) + 0.5, np.arange(60) + 0.5)
    length = np.linalg.norm(view.corner + x[..., None] * view.step_x + y[..., None] * view.step_y, axis=2)
    side = math.sqrt(float(np.linalg.norm(view.step_x) * np.linalg.norm(view.step_y)))
    total = sum(pencil_spread(1, 1, side, 1.0 / away) ** 2 for away in length.ravel())
    a, b = math.tan(math.radians(fov_deg / 2)) * np.array([1.0, display.aspect])
    assert total == pytest.approx(4 * math.asin(a * b / math.sqrt((1 + a * a) * (1 + b * b))), rel=1e-3)


def test_the_samples_of_a_cell_share_it() -> None:
    assert pencil_spread(6, 4, 0.01, 1.0) == pytest.approx(pencil_spread(3, 1, 0.01, 1.0))
    assert pencil_spread(1, 1, 0.01, 1.0) == 0.01


@pytest.mark.parametrize("radius", [0.5, -3.0])
def test_round_mirrors_focus_at_half_their_radius(radius: float) -> None:
    """Above 0 they bulge out: parallel light comes from a point behind them."""
    width, spread = 0.01, mirrored_spread(0.0, 0.01, 1.0 / radius)
    assert width - spread * radius / 2 == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("ior", [1.3, 1.5, 2.0])
def test_a_ball_of_glass_is_a_lens(ior: float) -> None:
    """Its focus lies n D / (4 (n - 1)) from its middle, D its diameter."""
    radius, width = 0.5, 0.01
    inside = refracted_spread(0.0, width, 1.0 / radius, 1.0 / ior)
    behind = width + inside * 2 * radius
    outside = refracted_spread(inside, behind, -1.0 / radius, ior)
    assert -behind / outside + radius == pytest.approx(ior * 2 * radius / (4 * (ior - 1)), rel=1e-9)


def test_a_ball_that_mirrors_shows_its_surroundings_small(renderer: Renderer) -> None:
    """Checks on a wall behind the eye, in a small ball: their mean, as they are far finer than a pixel there."""
    behind = dataclasses.replace(wall(CHECKS, 20.0), vertices=20 * wall(CHECKS).vertices * (-1, 1, 1) + (0, 0, 12))
    ball = Scene(
        meshes=(behind,),
        spheres=(Sphere((0, 0, 0), 0.25, mirror()),),
        surroundings=AMBIENT,
        camera=Camera((0, 0, 5), (0, 0, 0), vertical_fov_deg=1),
    )
    np.testing.assert_allclose(shoot(renderer, ball, 16, 16).pixels, 0.5, atol=0.02)


def test_a_specular_texture_multiplies_highlight_and_mirror(renderer: Renderer) -> None:
    half = grey(np.full((2, 2), 188, np.uint8))
    shiny = Material("shiny", BLACK, reflection=(0.8,) * 3, specular_texture=half)
    ground = quad((-4, 0, 4), (8, 0, 0), (0, 0, -8), shiny)
    glowing = Scene(meshes=(ground,), surroundings=Surroundings(zenith=WHITE, horizon=WHITE))
    assert pixel(renderer, glowing, camera=aim((0, 2, 0), (0, 0, 0))) == pytest.approx(0.8 * 0.50289, rel=1e-4)
    assert pixel(
        renderer,
        dataclasses.replace(
            glowing,
            surroundings=AMBIENT,
            meshes=(
                dataclasses.replace(
                    ground, material=dataclasses.replace(shiny, base="ashikhmin-shirley", specular=(0.6,) * 3)
                ),
            ),
        ),
        camera=aim((0, 2, 0), (0, 0, 0)),
        depth=0,
    ) == pytest.approx(0.6 * 0.50289, rel=1e-4 + 8 * U)
