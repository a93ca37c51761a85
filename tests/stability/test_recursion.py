"""Recursion: halls of mirrors, trees of glass, and what may be dropped of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from renderer import levels, whitted
from renderer.camera import Camera
from renderer.errors import SettingsError
from renderer.pipeline import Renderer
from renderer.quality import Quality
from renderer.rays import Rays, make_rays
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

VIEW = Camera((0, 0, 6), (0, 0, 0), vertical_fov_deg=10)


@pytest.mark.parametrize(
    ("depth", "shown"),
    [(0, 0.1), (1, 0.19), (2, 0.271), (5, 0.468559), (8, 0.612579511), (16, 0.8332281830), (64, 1 - 0.9**65)],
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


def test_h39_a_depth_beyond_the_limit_is_refused() -> None:
    """There is no recursion to overflow: rays wait level by level, and 64 levels is the most there is."""
    with pytest.raises(SettingsError, match=r"max_depth: expected an integer from 0 to 64, found 10000"):
        Quality(max_depth=10_000)


def test_h40_rays_in_flight_are_bounded_by_depth_not_by_the_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    """Six glass balls in each other at depth 14 spawn more than 20,000 rays; levels hold two blocks of 64 each."""
    room = []

    def counted(capacity: int, levels: int) -> Rays:
        room.append(capacity * levels)
        return make_rays(capacity, levels)

    monkeypatch.setattr(whitted, "BLOCK_RAYS", 64)
    monkeypatch.setattr(levels, "make_rays", counted)
    balls = tuple(Sphere((0, 0, 0), 1.0 - i / 8, glass(1.5 if i % 2 == 0 else 1 / 1.5)) for i in range(6))
    scene = Scene(spheres=balls, surroundings=EVERYWHERE_1, exposure=1e12, camera=VIEW)
    fresh = Renderer(threads=1)
    frame = shoot(fresh, scene, 2, 2, depth=14)
    fresh.close()
    assert frame.cost.rays.total > 20_000
    assert room == [(14 + 2) * 2 * 64]


def flake(level: int, center: tuple[float, float, float] = (0, 0, 0), radius: float = 1.0) -> list[Sphere]:
    """Haines's sphereflake without its turns: nine spheres of a third of the radius on each."""
    spheres = [Sphere(center, radius, glass() if level % 2 else mirror(0.9))]
    if level:
        for turn in range(9):
            up, around = (0.0, math.tau * turn / 6) if turn < 6 else (0.9, math.tau * turn / 3)
            side = math.sqrt(1 - up * up)
            away = (side * math.cos(around), up, side * math.sin(around))
            x, y, z = (c + radius * 4 / 3 * a for c, a in zip(center, away, strict=True))
            spheres += flake(level - 1, (x, y, z), radius / 3)
    return spheres


@pytest.mark.parametrize(("level", "spheres"), [(0, 1), (1, 10), (2, 91), (3, 820)])
def test_h40_a_sphereflake_in_a_white_furnace_is_nowhere_brighter_than_1(
    renderer: Renderer, level: int, spheres: int
) -> None:
    """Of mirrors of 0.9 and glass that touch at points; depth 16."""
    scene = Scene(spheres=tuple(flake(level)), surroundings=EVERYWHERE_1, camera=Camera((0, 1, 7), (0, 0, 0)))
    assert len(scene.spheres) == spheres
    frame = shoot(renderer, scene, 24, 16, depth=16)
    assert np.isfinite(frame.pixels).all()
    assert frame.pixels.min() >= 0.0
    assert frame.pixels.max() <= 1 + 64 * U
    assert frame.cost.rejected_samples.total == 0
