"""Scenes that must give the very same bits: larger or smaller, far away, with faces in one plane."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.scene import Material, PointLight, Rgb, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import ball_mesh, box, floor, glass, mirror, shoot


def moved(scene: Scene, factor: float, offset: Rgb) -> Scene:
    """The whole scene and its camera larger by `factor` and elsewhere; light falls as before."""

    def place(point: Rgb) -> Rgb:
        x, y, z = (factor * a + b for a, b in zip(point, offset, strict=True))
        return x, y, z

    return dataclasses.replace(
        scene,
        meshes=tuple(dataclasses.replace(m, vertices=m.vertices * factor + np.array(offset)) for m in scene.meshes),
        spheres=tuple(dataclasses.replace(s, center=place(s.center), radius=s.radius * factor) for s in scene.spheres),
        lights=tuple(
            dataclasses.replace(
                lamp,
                position=place(lamp.position),
                intensity=tuple(factor * factor * part for part in lamp.intensity),
            )
            for lamp in scene.lights
        ),
        camera=dataclasses.replace(
            scene.camera, position=place(scene.camera.position), look_at=place(scene.camera.look_at)
        ),
    )


def everything() -> Scene:
    """All effects at once; coordinates are multiples of 1/1024."""
    checks = Texture(np.uint8([[[220] * 3, [40] * 3], [[40] * 3, [220] * 3]]))
    tiles = Material("tiles", diffuse=(0.8, 0.7, 0.6), specular=(0.2, 0.2, 0.2), diffuse_texture=checks)
    brushed = Material("brushed", specular=(0.8,) * 3, base="ashikhmin-shirley", exponent_u=90.0, exponent_v=9.0)
    ground = floor(tiles, y=-0.5, half=2.0)
    ground = dataclasses.replace(ground, uvs=ground.uvs * 7 if ground.uvs is not None else None)
    ball = ball_mesh(Material("shiny", diffuse=(0.2, 0.4, 0.7), specular=(0.5,) * 3, reflection=(0.2,) * 3), 2, True)
    vertices = np.round((0.375 * ball.vertices + (0.5, 0, -0.25)) * 1024) / 1024
    return Scene(
        meshes=(
            ground,
            dataclasses.replace(ball, vertices=vertices),
            box((-1.5, -0.5, -1.5), (-1, 0.25, -1), mirror(0.9)),
        ),
        spheres=(
            Sphere((-0.375, 0, 0.25), 0.375, glass()),
            Sphere((0.125, -0.25, 0.75), 0.25, mirror(0.8)),
            Sphere((-0.75, -0.25, 0.75), 0.25, brushed),
        ),
        lights=(PointLight((1, 2, 1.5), (9e-8, 7e-8, 5e-8)), PointLight((-1.5, 1, 1), (2e-8, 3e-8, 4e-8))),
        surroundings=Surroundings((1e-9, 2e-9, 4e-9), (3e-9, 3e-9, 2e-9), (5e-10, 5e-10, 5e-10)),
        camera=Camera((0.25, 0.75, 3), (0, -0.125, 0), vertical_fov_deg=35),
        exposure=1e8,
    )


@pytest.mark.parametrize("power", [-20, -10, -1, 1, 10, 20, 38])
def test_h17_a_power_of_two_changes_no_bit(renderer: Renderer, power: int) -> None:
    scene = everything()
    plain, scaled = (shoot(renderer, s, 48, 36, samples=2) for s in (scene, moved(scene, 2.0**power, (0, 0, 0))))
    np.testing.assert_array_equal(scaled.pixels, plain.pixels)
    assert scaled.cost.rays == plain.cost.rays
    assert set(plain.cost.effects) == {"shadows", "specular", "textures", "reflection", "refraction"}


@pytest.mark.parametrize("distance", [1.0, 16.0, 256.0, 1024.0, 8192.0])
def test_h18_far_away_changes_no_bit(renderer: Renderer, distance: float) -> None:
    scene = everything()
    plain, far = (
        shoot(renderer, s, 48, 36, samples=2) for s in (scene, moved(scene, 1.0, (distance, -distance, distance)))
    )
    np.testing.assert_array_equal(far.pixels, plain.pixels)
