"""Cut-outs against things that have the shape itself: straight, in mirrors, through glass, and by shadows."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.cutout import MOST_HOLES
from renderer.effects import plan_effects
from renderer.errors import SceneError
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.scene import Material, Mesh, Scene, Sphere, SphereLight, Surroundings, Texture
from tests.renderer.drawing import BLACK, WHITE, WHITE_LAMBERT, floor, glass, lamp, light, mirror, quad, shoot

RED = Material("red", (0.8, 0.1, 0.1))
LIGHTS = (light(0.3, 4.0, 0.4, 60.0),)
CAMERA = Camera((0.4, 2.5, 5.0), (0, 0.7, 0))
AROUND = Surroundings(zenith=(0.2, 0.3, 0.6), horizon=(0.5, 0.5, 0.5), ambient=(0.1, 0.1, 0.1))


def map_of(alpha: NDArray[np.uint8], wrap: str = "clamp") -> Texture:
    return Texture(np.full((*alpha.shape, 3), 77, np.uint8), "map", wrap, wrap, alpha)


LEFT = map_of(np.uint8([[0, 255]]))
"""Nothing left of the middle: between the texels' centres alpha rises evenly through one half."""


def pierced(material: Material, holes: Texture = LEFT) -> Material:
    return dataclasses.replace(material, alpha_texture=holes)


def card(material: Material, left: float = -1.0, y: float = 1.2) -> Mesh:
    """A card that lies in the air, from `left` to 1 across."""
    return quad((left, y, 0.6), (1.0 - left, 0.0, 0.0), (0.0, 0.2, -1.4), material)


def scenes(things: tuple[Mesh, ...] = (), spheres: tuple[Sphere, ...] = ()) -> tuple[Scene, Scene]:
    """With a card whose left half is cut out, and with the right half of a card."""
    ground = floor(WHITE_LAMBERT, half=8.0)
    made = tuple(
        Scene((ground, mesh, *things), spheres, LIGHTS, AROUND, CAMERA)
        for mesh in (card(pierced(RED)), card(RED, left=0.0))
    )
    return made[0], made[1]


def agree(a: NDArray[np.generic], b: NDArray[np.generic], share: float = 0.99) -> None:
    """All pixels but those on an edge, where the last bit of a coordinate decides."""
    same = np.isclose(np.asarray(a), np.asarray(b), rtol=1e-4, atol=1e-5).all(axis=2)
    assert same.mean() > share


def test_a_card_with_a_hole_is_half_a_card_and_so_is_its_shadow(renderer: Renderer) -> None:
    cut, half = scenes()
    a, b = (shoot(renderer, scene, 96, 64).pixels for scene in (cut, half))
    agree(a, b)
    whole = dataclasses.replace(cut, meshes=(cut.meshes[0], card(RED)))
    assert (np.abs(a - shoot(renderer, whole, 96, 64).pixels).max(axis=2) > 0.05).mean() > 0.05


def test_mirrors_and_glass_show_the_hole(renderer: Renderer) -> None:
    looking_glass = quad((-4, -0.1, -2.5), (8, 0, 0), (0, 5, 0), mirror())
    balls = (Sphere((-0.9, 1.2, 2.0), 0.6, glass()), Sphere((1.1, 1.0, 2.2), 0.5, mirror()))
    for extra in (((looking_glass,), ()), ((), balls)):
        agree(*(shoot(renderer, scene, 96, 64).pixels for scene in scenes(*extra)))


def test_soft_shadows_pass_holes(renderer: Renderer) -> None:
    wide = (SphereLight((0.3, 4.0, 0.4), 0.4, (40.0,) * 3),)
    a, b = (shoot(renderer, dataclasses.replace(scene, lights=wide), 64, 48, samples=4).pixels for scene in scenes())
    agree(a, b, 0.98)


@pytest.mark.parametrize("radius", [0.2, 1.0])
def test_a_ball_that_is_all_hole_is_not_there(renderer: Renderer, radius: float) -> None:
    ghost = Sphere((0.0, 1.0, 0.0), radius, pierced(RED, map_of(np.zeros((1, 1), np.uint8))))
    ground = floor(WHITE_LAMBERT, half=8.0)
    a, b = (shoot(renderer, Scene((ground,), balls, LIGHTS, AROUND, CAMERA), 64, 48).pixels for balls in ((ghost,), ()))
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5)


def test_half_a_ball_shows_its_inside(renderer: Renderer) -> None:
    """Its picture's upper half is whole: from above one sees a cap, from below into it."""
    cap = pierced(Material("cap", BLACK, emission=(0.5,) * 3), map_of(np.uint8([[255], [0]])))
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, cap),), surroundings=Surroundings(horizon=WHITE, zenith=WHITE))
    for y in (3.0, -3.0):
        seen = shoot(renderer, scene, 33, 33, camera=Camera((0, y, 0), (0, 0, 0), (0, 0, 1), 60)).pixels
        np.testing.assert_allclose(seen[16, 16], 0.5)
    beside = shoot(renderer, scene, 33, 33, camera=Camera((0, 0, 4), (0, 0, 0), vertical_fov_deg=40)).pixels[..., 0]
    np.testing.assert_allclose(beside[12:15, 16], 0.5)
    np.testing.assert_allclose(beside[18:21, 16], 1.0)


@pytest.mark.parametrize(("layers", "seen"), [(1, 1.0), (MOST_HOLES, 1.0), (MOST_HOLES + 1, 0.25)])
def test_holes_behind_holes(renderer: Renderer, layers: int, seen: float) -> None:
    """A ray passes a bounded number of holes; the next one is whole."""
    veil = pierced(Material("veil", BLACK, emission=(0.25,) * 3), map_of(np.zeros((2, 2), np.uint8)))
    veils = tuple(quad((-1, -1, -0.01 * k), (2, 0, 0), (0, 2, 0), veil) for k in range(layers))
    glowing = quad((-9, -9, -5), (18, 0, 0), (0, 18, 0), lamp())
    scene = Scene((*veils, glowing), camera=Camera((0, 0, 3), (0, 0, 0), vertical_fov_deg=10))
    np.testing.assert_allclose(shoot(renderer, scene, 5, 5).pixels, seen)


@pytest.mark.parametrize(("cutoff", "hole"), [(0.0, False), (0.3, False), (0.7, True)])
def test_the_cutoff(renderer: Renderer, cutoff: float, hole: bool) -> None:
    """Alpha 128 everywhere, as alpha or as the green channel of a picture without."""
    for holes in (map_of(np.full((2, 2), 128, np.uint8)), Texture(np.uint8([[[255, 128, 0]]]))):
        veil = dataclasses.replace(pierced(lamp(0.25), holes), alpha_cutoff=cutoff)
        scene = Scene((quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), veil),), camera=Camera((0, 0, 3), vertical_fov_deg=10))
        assert plan_effects(scene).names == (("cutouts",) if hole else ())
        np.testing.assert_allclose(shoot(renderer, scene, 3, 3).pixels, 0.0 if hole else 0.25)


def test_a_scene_without_holes_is_prepared_without_them() -> None:
    cut, half = scenes()
    assert prepare(half).sieve is None
    sieve = prepare(cut).sieve
    assert sieve is not None
    assert len(sieve.surfaces.facets) == 2
    assert plan_effects(cut).effects[0].reason == "2 triangles of material 'red'"


def test_alpha_of_another_size_is_refused() -> None:
    with pytest.raises(SceneError, match=r"leaf: expected alpha as \(2, 3\) uint8, found \(3, 2\) uint8"):
        Texture(np.zeros((2, 3, 3), np.uint8), "leaf", alpha=np.zeros((3, 2), np.uint8))
