"""Whitted's loop: mirrors, glass and depth against closed forms, and scenes that must look the same."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.fresnel import fresnel, refracted_cosine
from renderer.pipeline import Renderer
from renderer.scene import Material, Rgb, Scene, Sphere, Surroundings, Texture
from renderer.tonemap import SMALLEST_STEP
from tests.renderer.drawing import (
    BLACK,
    EVERYWHERE_1,
    FINE,
    WHITE,
    U,
    aim,
    ball_mesh,
    box,
    floor,
    glass,
    lamp,
    light,
    mirror,
    pixel,
    quad,
    shoot,
)

INSIDE = Camera((0, 0, 0), (0.3, 0.2, -1))
HEIGHT = Surroundings(zenith=WHITE)
"""Radiance is the height of the ray's direction: rays that go level or down see nothing."""


# mirrors


@pytest.mark.parametrize(
    ("depth", "shown"), [(0, 0.1), (1, 0.19), (2, 0.271), (5, 0.468559), (8, 0.612579511), (16, 0.8332281830)]
)
@pytest.mark.parametrize("look_at", [(1.0, 0.0, 0.0), (1.0, 0.05, 0.02)])
def test_h39_hall_of_mirrors(renderer: Renderer, depth: int, shown: float, look_at: Rgb) -> None:
    """Two mirrors of 0.9 that glow with 0.1 face each other."""
    wall = Material("wall", diffuse=BLACK, emission=(0.1,) * 3, reflection=(0.9,) * 3)
    hall = (
        quad((-1, -99, 99), (0, 0, -198), (0, 198, 0), wall),
        quad((1, -99, -99), (0, 0, 198), (0, 198, 0), wall),
    )
    frame = shoot(renderer, Scene(meshes=hall, camera=Camera((0, 0, 0), look_at)), depth=depth)
    assert frame.pixels[0, 0, 0] == pytest.approx(1 - 0.9 ** (depth + 1), rel=(depth + 1) * 2 * U + U)
    assert frame.pixels[0, 0, 0] == pytest.approx(shown, rel=1e-6)
    assert frame.cost.rays.reflection == depth


@pytest.mark.parametrize("depth", [1, 2, 7, 64])
def test_h44_mirrors_in_a_white_furnace_show_exactly_1(renderer: Renderer, depth: int) -> None:
    camera = Camera((0, 0, 6), (0, 0, 0))
    for scene in (
        Scene(spheres=(Sphere((0, 0, 0), 1.0, mirror()),), surroundings=EVERYWHERE_1),
        Scene(meshes=(ball_mesh(mirror(), 2),), surroundings=EVERYWHERE_1),
        Scene(meshes=(ball_mesh(mirror(), 2, smooth=True),), surroundings=EVERYWHERE_1),
    ):
        np.testing.assert_array_equal(shoot(renderer, scene, 64, 64, depth=depth, camera=camera).pixels, 1.0)


@pytest.mark.parametrize("depth", [0, 1, 2, 3])
def test_depth_counts_what_a_ray_may_meet(renderer: Renderer, depth: int) -> None:
    """A lamp seen in a mirror that is seen in a mirror needs depth 2."""
    periscope = (
        quad((-1, -1, -1), (2, 0, 0), (0, math.sqrt(2), -math.sqrt(2)), mirror()),
        quad((-1, 9, -1 - math.sqrt(2)), (2, 0, 0), (0, math.sqrt(2), math.sqrt(2)), mirror()),
        quad((-1, 8, 5), (2, 0, 0), (0, 4, 0), lamp()),
    )
    middle = -1 + math.sqrt(0.5)
    scene = Scene(meshes=periscope, camera=aim((0, middle, 5), (0, middle, 0)))
    assert pixel(renderer, scene, depth=depth) == (1.0 if depth >= 2 else 0.0)


# glass


@pytest.mark.parametrize("ior", [1.5, 1.33, 2.42])
def test_h44_glass_in_a_white_furnace_lacks_only_what_is_left_at_the_cap(renderer: Renderer, ior: float) -> None:
    """Seen through the middle: straight on, 1 less the light that still runs to and fro inside."""
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, glass(ior)),), surroundings=EVERYWHERE_1, exposure=FINE)
    share = ((ior - 1) / (ior + 1)) ** 2
    for depth in range(1, 9):
        left = (1 - share) * share ** (depth - 1)
        seen = pixel(renderer, scene, depth=depth, camera=aim((0, 0, 6), (0, 0, 0)))
        assert seen == pytest.approx(1 - left, abs=(depth + 2) * 2 * U)


def test_h44_a_glass_ball_in_a_white_furnace_is_nowhere_brighter_than_1(renderer: Renderer) -> None:
    for scene in (
        Scene(spheres=(Sphere((0, 0, 0), 1.0, glass()),), surroundings=EVERYWHERE_1, exposure=FINE),
        Scene(meshes=(ball_mesh(glass(), 3),), surroundings=EVERYWHERE_1, exposure=FINE),
        Scene(meshes=(ball_mesh(glass(), 3, smooth=True),), surroundings=EVERYWHERE_1, exposure=FINE),
    ):
        seen = shoot(renderer, scene, 48, 48, depth=12, camera=Camera((0, 0, 6), (0, 0, 0))).pixels
        assert seen.max() <= 1 + 20 * U
        assert (seen > 0.99).mean() > 0.97


SLAB = box((-50, -1, -50), (50, 0, 50), glass())
ABOVE, BELOW = Surroundings(zenith=WHITE), Surroundings(horizon=WHITE)


@pytest.mark.parametrize(("depth", "through"), [(2, 0.9216), (4, 0.92307456), (6, 0.923076919), (20, 12 / 13)])
def test_h31_a_glass_slab_lets_12_of_13_through(renderer: Renderer, depth: int, through: float) -> None:
    """Looked at from above: what is reflected sees the zenith, what goes through the horizon."""
    camera = aim((0.3, 4, 0.2), (0.3, 0, 0.2))
    reflected, transmitted = (
        pixel(renderer, Scene(meshes=(SLAB,), surroundings=around, exposure=FINE), depth=depth, camera=camera)
        for around in (ABOVE, BELOW)
    )
    assert transmitted == pytest.approx(through, abs=1e-6)
    if depth == 20:
        assert reflected == pytest.approx(1 / 13, abs=1e-6)


def straight_share(angle_deg: float, *indices: float) -> float:
    """What a ray keeps that crosses parallel faces between media of these indices."""
    sine, share = math.sin(math.radians(angle_deg)) * indices[0], 1.0
    for before, behind in itertools.pairwise(indices):
        cosine, refracted = (math.sqrt(1 - (sine / n) ** 2) for n in (before, behind))
        share *= 1 - fresnel(cosine, refracted, before / behind)
    return share


@pytest.mark.parametrize("angle", [10.0, 45.0, 60.0])
def test_h31_a_ray_leaves_a_slab_as_it_came(renderer: Renderer, angle: float) -> None:
    """From below, so that it leaves upwards: its height is what it was."""
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    camera = aim((-3 * sine, -1 - 3 * cosine, 0), (0, -1, 0))
    seen = pixel(renderer, Scene(meshes=(SLAB,), surroundings=HEIGHT), depth=2, camera=camera)
    assert seen == pytest.approx(cosine * straight_share(angle, 1, 1.5, 1), abs=1e-6)


@pytest.mark.parametrize(("angle", "shift"), [(45.0, 0.3291423082), (60.0, 0.5124720132)])
def test_h31_a_slab_moves_a_ray_sideways(renderer: Renderer, angle: float, shift: float) -> None:
    """Found by halving: where the edge of a lamp behind the slab must be to be just seen. Tolerance: rays start
    16 units in the last place of the largest coordinate, 6 m, off the two faces.
    """
    slab = box((-4, -1, -4), (4, 0, 4), glass())
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    camera = aim((-3 * sine, 3 * cosine, 0), (0, 0, 0))
    unshifted = 3 * sine / cosine
    low, high = unshifted - 2.0, unshifted
    for _ in range(20):
        edge = (low + high) / 2
        screen = quad((-6, -3, 4), (6 + edge, 0, 0), (0, 0, -8), lamp())
        lit = pixel(renderer, Scene(meshes=(slab, screen)), depth=2, camera=camera) > 0
        low, high = (low, edge) if lit else (edge, high)
    assert (unshifted - low) * cosine == pytest.approx(shift, abs=2 * 16 * 2.0**-23 * 6)


@pytest.mark.parametrize(("h", "deviation"), [(0.1, 3.833233496), (0.3, 11.841288182), (0.5, 21.057558731)])
def test_h32_a_glass_ball_bends_a_ray(renderer: Renderer, h: float, deviation: float) -> None:
    """A level ray that meets the lower half leaves it upwards."""
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, glass()),), surroundings=HEIGHT)
    seen = pixel(renderer, scene, depth=2, camera=aim((0, -h, 5), (0, -h, 0)))
    cosine = math.sqrt(1 - h * h)
    kept = (1 - fresnel(cosine, refracted_cosine(cosine, 1 / 1.5), 1 / 1.5)) ** 2
    assert math.degrees(math.asin(seen / kept)) == pytest.approx(deviation, rel=1e-5)


@pytest.mark.parametrize(("depth", "seen"), [(1, 0.96), (2, 0.9984), (3, 0.999936), (12, 1.0)])
def test_h34_the_eye_in_the_middle_of_a_glass_ball(renderer: Renderer, depth: int, seen: float) -> None:
    for ball in (
        Scene(spheres=(Sphere((0, 0, 0), 1.0, glass()),), surroundings=EVERYWHERE_1, exposure=FINE),
        Scene(meshes=(box((-1, -1, -1), (1, 1, 1), glass()),), surroundings=EVERYWHERE_1, exposure=FINE),
    ):
        assert pixel(renderer, ball, depth=depth, camera=aim((0, 0, 0), (0, 0, 1))) == pytest.approx(seen, abs=8 * U)


def test_h34_from_inside_glass_the_outside_fills_a_cone(renderer: Renderer) -> None:
    """41.8103 degrees around straight up; beyond it everything is mirrored."""
    pixels = 201
    block = box((-99, -99, -99), (99, 0, 99), glass())
    camera = Camera((0, -1, 0), (0, 0, 0), (0, 0, 1), 120)
    seen = shoot(renderer, Scene(meshes=(block,), surroundings=ABOVE), pixels, pixels, depth=1, camera=camera).pixels
    half = math.tan(math.radians(60))
    across = (np.arange(pixels) + 0.5 - pixels / 2) / (pixels / 2) * half
    angle = np.degrees(np.arctan(np.hypot(across[:, None], across[None])))
    ring = math.degrees(math.atan(math.tan(math.radians(41.8103)) + 2 * 2 * half / pixels)) - 41.8103
    bright = seen[..., 0] > 0
    assert bright[angle < 41.8103 - ring].all()
    assert not bright[angle > 41.8103 + ring].any()


def test_h33_layers_keep_n_sine(renderer: Renderer) -> None:
    """air | 1.5 | 1.33 | 1.5 | air at 45 degrees: the faces between glass and water state their ratio."""
    wet = Material("glass and water", diffuse=BLACK, transmission=WHITE, ior=1.33 / 1.5)
    layers = (box((-50, -3, -50), (50, 0, 50), glass()), box((-50, -2, -50), (50, -1, 50), wet))
    scene = Scene(meshes=layers, surroundings=HEIGHT, exposure=FINE)
    sine = math.sin(math.radians(45))
    seen = pixel(renderer, scene, depth=4, camera=aim((-3 * sine, -3 - 3 * sine, 0), (0, -3, 0)))
    assert seen == pytest.approx(sine * straight_share(45, 1, 1.5, 1.33, 1.5, 1), abs=1e-6)


def test_h33_a_ball_of_the_same_glass_inside_changes_nothing(renderer: Renderer) -> None:
    camera = Camera((0, 0.5, 6), (0, 0, 0), vertical_fov_deg=25)
    around = Surroundings(zenith=WHITE, horizon=(0.2, 0.4, 0.1))
    outer, inner = Sphere((0, 0, 0), 1.0, glass()), Sphere((0.1, 0, 0), 0.5, glass(1.0))
    one = Scene(spheres=(outer,), surroundings=around, exposure=1e3)
    two = dataclasses.replace(one, spheres=(outer, inner))
    seen = [shoot(renderer, scene, 32, 32, depth=64, camera=camera).pixels for scene in (one, two)]
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-4)


@pytest.mark.parametrize("eye", [(0.3, 0.4, 6.0), (0.1, 0.2, 0.0)])
@pytest.mark.parametrize("kind", ["sphere", "mesh"])
def test_h30_an_object_of_the_same_index_cannot_be_seen(renderer: Renderer, eye: Rgb, kind: str) -> None:
    ground = floor(Material(diffuse_texture=Texture(np.uint8([[[60] * 3, [180] * 3]]))), -1.2)
    lights = (light(3, 4, 5, 90.0),)
    around = Surroundings((0.1, 0.2, 0.5), (0.4, 0.3, 0.2))
    without = Scene(meshes=(ground,), lights=lights, surroundings=around, camera=Camera(eye, (0, -0.2, -1)))
    ghost = glass(1.0)
    if kind == "sphere":
        scene = dataclasses.replace(without, spheres=(Sphere((0, 0, 0), 1.0, ghost, casts_shadows=False),))
    else:
        scene = dataclasses.replace(without, meshes=(ground, ball_mesh(ghost, 3, smooth=True, casts_shadows=False)))
    seen, truth = (shoot(renderer, s, 64, 64).pixels for s in (scene, without))
    np.testing.assert_allclose(seen, truth, atol=2e-5)
    assert shoot(renderer, scene, 64, 64).cost.rays.reflection == 0


# what may be dropped


def test_h40_a_glass_tree_is_bounded(renderer: Renderer) -> None:
    """At most 2^(D+1) - 1 rays a pixel, and the weights that are followed and dropped add up to 1."""
    balls = tuple(Sphere((0, 0, 0), 1.0 - i / 8, glass(1.5 if i % 2 == 0 else 1 / 1.5)) for i in range(6))
    for depth in (0, 1, 5, 10):
        scene = Scene(spheres=balls, surroundings=EVERYWHERE_1, exposure=1e12)
        frame = shoot(renderer, scene, depth=depth, camera=aim((0.05, 0.03, 6), (0.05, 0.03, 0)))
        assert frame.cost.rays.total <= 2 ** (depth + 1) - 1
        assert frame.pixels.max() <= 1 + 4 * (depth + 1) * U


def test_h40_rays_too_faint_to_be_seen_are_dropped(renderer: Renderer) -> None:
    """The difference is at most what was dropped: here less than half a step of the darkest codes."""
    balls = (Sphere((0, 0, 0), 1.0, glass()), Sphere((0.2, 0.1, 0), 0.4, glass(1 / 1.5)))
    camera = Camera((0, 0, 6), (0, 0, 0), vertical_fov_deg=25)
    coarse, fine = (
        shoot(renderer, Scene(spheres=balls, surroundings=EVERYWHERE_1, exposure=e), 32, 32, depth=12, camera=camera)
        for e in (1.0, FINE)
    )
    assert coarse.cost.rays.total < fine.cost.rays.total / 2
    lost = fine.pixels - coarse.pixels
    assert lost.min() >= -32 * U
    assert np.median(lost) <= 4 * SMALLEST_STEP


def test_h40_what_is_bright_is_followed_although_its_share_is_small(renderer: Renderer) -> None:
    """A lamp of radiance 1,000 behind three weak mirrors still shows: 1,000 * 0.04^3 = 0.064."""
    weak = mirror(0.04)
    corridor = (
        quad((-9, -9, 0), (18, 0, 0), (0, 18, 0), weak),
        quad((9, -9, 4), (-18, 0, 0), (0, 18, 0), weak, casts_shadows=False),
    )
    target = quad((3.2, -1, 3.9), (-1, 0, 0), (0, 2, 0), lamp(1000.0))
    scene = Scene(meshes=(*corridor, target), camera=Camera((0, 0, 2), (0.4, 0, 0)))
    bounces = [shoot(renderer, scene, depth=depth).pixels[0, 0, 0] for depth in range(6)]
    level = next(depth for depth, seen in enumerate(bounces) if seen > 0)
    assert level == 3
    assert bounces[5] == pytest.approx(1000 * 0.04**3, rel=1e-5)
