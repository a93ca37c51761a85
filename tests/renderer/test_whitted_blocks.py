"""Blocks of rays: how large they are decides nothing but speed and memory."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from renderer import whitted
from renderer.camera import Camera
from renderer.levels import batch_end
from renderer.pipeline import Renderer
from renderer.scene import Scene, Sphere, Surroundings
from tests.renderer.drawing import WHITE_LAMBERT, floor, glass, light, shoot


def russian_dolls(balls: int) -> Scene:
    """Glass balls in glass balls over a textured floor under two lights."""
    layers = tuple(
        Sphere((0.03 * i, 0.02 * i, 0), 1.0 - 0.15 * i, glass(1.5 if i % 2 == 0 else 0.8)) for i in range(balls)
    )
    return Scene(
        meshes=(floor(WHITE_LAMBERT, -1.2),),
        spheres=layers,
        lights=(light(3, 4, 5, 60.0), light(-3, 2, 1, 30.0)),
        surroundings=Surroundings((0.2, 0.4, 0.9), (0.8, 0.7, 0.6)),
        camera=Camera((0, 0.5, 6), (0, 0, 0), vertical_fov_deg=25),
        exposure=30.0,
    )


def test_small_blocks_give_the_bits_that_large_blocks_give(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Glass in glass at depth 12; no level of one sample holds more than 270 rays."""
    scene = russian_dolls(4)
    large = shoot(renderer, scene, 24, 18, samples=3, depth=12)
    assert large.cost.rays.total > 40 * large.cost.rays.primary
    for block in (300, 500, 1000):
        monkeypatch.setattr(whitted, "BLOCK_RAYS", block)
        renderer.forget_samples()
        small = shoot(renderer, scene, 24, 18, samples=3, depth=12)
        np.testing.assert_array_equal(small.pixels, large.pixels)
        assert small.cost.rays == large.cost.rays


def test_a_sample_of_more_rays_than_a_block_is_traced_all_the_same(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cut into parts its light is added up in another order, but nothing is lost, and memory stays bounded."""
    scene = dataclasses.replace(russian_dolls(6), exposure=1e6)
    large = shoot(renderer, scene, 2, 2, depth=14)
    assert large.cost.rays.total > 4 * 4 * 64
    monkeypatch.setattr(whitted, "BLOCK_RAYS", 64)
    renderer.forget_samples()
    small = shoot(renderer, scene, 2, 2, depth=14)
    np.testing.assert_allclose(small.pixels, large.pixels, rtol=1e-5)
    assert small.cost.rays == large.cost.rays


def test_many_lights_make_blocks_smaller_and_change_nothing(renderer: Renderer) -> None:
    """1,500 lights of which each gives a 1,500th are one light."""
    few = Scene(meshes=(floor(WHITE_LAMBERT),), lights=(light(0, 2, 0, 15.0),), camera=Camera((0, 3, 4), (0, 0, 0)))
    many = dataclasses.replace(few, lights=(light(0, 2, 0, 0.01),) * 1500)
    one, all_of_them = (shoot(renderer, scene, 16, 12, samples=2) for scene in (few, many))
    np.testing.assert_allclose(all_of_them.pixels, one.pixels, rtol=1e-4)
    assert all_of_them.cost.rays.shadow == 1500 * one.cost.rays.shadow


@pytest.mark.parametrize(
    ("samples", "start", "block", "end"),
    [
        ([0, 0, 1, 1, 2], 0, 5, 5),
        ([0, 0, 1, 1, 2], 0, 4, 4),
        ([0, 0, 1, 1, 2], 0, 3, 2),
        ([0, 0, 1, 1, 2], 2, 2, 4),
        ([7, 7, 7, 7, 8], 0, 2, 2),
        ([7, 7, 7, 7, 8], 2, 2, 4),
        ([7, 7, 7, 7, 8], 3, 1, 4),
        ([3, 3, 3], 1, 9, 3),
    ],
)
def test_a_batch_ends_between_samples(samples: list[int], start: int, block: int, end: int) -> None:
    assert batch_end(np.array(samples, np.int32), start, len(samples), block) == end
