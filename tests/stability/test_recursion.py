"""Recursion: halls of mirrors, trees of glass, and what may be dropped of them."""

from __future__ import annotations

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.scene import Material, Rgb, Scene, Sphere
from renderer.tonemap import SMALLEST_STEP
from tests.renderer.drawing import (
    BLACK,
    EVERYWHERE_1,
    FINE,
    U,
    aim,
    glass,
    lamp,
    mirror,
    quad,
    shoot,
)


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
