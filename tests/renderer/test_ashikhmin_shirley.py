"""The model of Ashikhmin and Shirley: the paper's formulas, closed forms of its energy, and what it must never do."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.camera import Camera
from renderer.pipeline import Renderer
from renderer.scene import Material, Scene, Sphere, Surroundings
from renderer.shapes import ball
from renderer.tangent import tangent_of_normal
from tests.renderer.drawing import BLACK, WHITE, U, aim, floor, light, pixel, quad, shoot
from tests.renderer.lobe import Vector, any_vectors, as_printed, directions, exponents, terms, turns


@given(directions, directions, exponents, turns)
def test_equal_exponents_make_a_lobe_without_grain(a: Vector, b: Vector, n: float, turn: float) -> None:
    """Nor is a tangent needed; nearly equal ones make nearly the same lobe along any."""
    turned = np.array([math.cos(turn), math.sin(turn), 0.0])
    assert terms(a, b, n, n, np.zeros(3)) == terms(a, b, n, n)
    grained = terms(a, b, n, n * (1 + 2.0**-52) + 5e-324, turned)
    assert grained[0] == pytest.approx(terms(a, b, n, n)[0], rel=1e-11 + n * 1e-13, abs=1e-300)
    assert terms(a, b, n, n, turned)[0] == pytest.approx(terms(a, b, n, n)[0], rel=1e-11 + n * 1e-13, abs=1e-300)


# energy


# in a picture

MICRO = Material("micro", (0.3, 0.5, 0.1), (0.5, 0.2, 0.9), base="ashikhmin-shirley", exponent_u=40.0, exponent_v=7.0)


@pytest.mark.parametrize("eye", [(0.0, 2.0, 0.0), (1.0, 1.5, 0.5), (-2.0, 0.2, 1.0)])
@pytest.mark.parametrize(("nu", "nv"), [(40.0, 7.0), (25.0, 25.0)])
@pytest.mark.parametrize("lamp", [(0.3, 1.0, 0.2), (2.0, 0.3, -1.0)])
def test_a_lit_floor_is_as_bright_as_the_model_says(
    renderer: Renderer, eye: Vector, lamp: Vector, nu: float, nv: float
) -> None:
    ground = floor(dataclasses.replace(MICRO, exponent_u=nu, exponent_v=nv), half=1.0)
    seen = shoot(renderer, Scene(meshes=(ground,), lights=(light(*lamp, 3.0),)), camera=aim(tuple(eye), (0, 0, 0)))
    to_light, to_eye = (np.array([x, -z, y]) for x, y, z in (lamp, eye))
    distance = float(np.linalg.norm(to_light))
    a, b = to_light / distance, to_eye / np.linalg.norm(to_eye)
    expected = [
        3.0 / distance**2 * a[2] * as_printed(a, b, nu, nv, rs, rd)
        for rs, rd in zip(MICRO.specular, MICRO.diffuse, strict=True)
    ]
    np.testing.assert_allclose(seen.pixels[0, 0], expected, rtol=2e-5)


def test_the_grain_follows_the_texture_coordinates(renderer: Renderer) -> None:
    """Turning u by a right angle is the same as exchanging the exponents, and it makes a difference."""
    swapped = dataclasses.replace(MICRO, exponent_u=7.0, exponent_v=40.0)
    ground, other = floor(MICRO, half=1.0), floor(swapped, half=1.0)
    assert ground.uvs is not None
    turned = dataclasses.replace(ground, uvs=ground.uvs @ np.array([[0.0, 2.0], [-2.0, 0.0]]))
    lamp, camera = (light(1.5, 1.0, 0.2, 3.0),), Camera((-1.5, 1.0, 0.5), (0, 0, 0))
    a, b, c = (
        shoot(renderer, Scene(meshes=(mesh,), lights=lamp), 24, 16, camera=camera).pixels
        for mesh in (turned, other, ground)
    )
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6)
    assert np.abs(a - c).max() > 0.1 * a.max()


def test_a_sphere_and_its_mesh_have_the_same_grain(renderer: Renderer) -> None:
    brushed = Material("brushed", BLACK, (0.9,) * 3, base="ashikhmin-shirley", exponent_u=300.0, exponent_v=4.0)
    lamp, camera = (light(2.0, 3.0, 4.0, 20.0),), Camera((0, 0.5, 4), (0, 0, 0), vertical_fov_deg=35)
    exact, mesh = (
        shoot(renderer, scene, 48, 48, samples=4, camera=camera).pixels
        for scene in (
            Scene(spheres=(Sphere((0, 0, 0), 1.0, brushed, casts_shadows=False),), lights=lamp),
            Scene(meshes=(ball(1.0, 128).mesh(brushed, casts_shadows=False),), lights=lamp),
        )
    )
    assert np.sqrt(((exact - mesh) ** 2).mean()) < 0.02 * exact.max()
    equal = Material("dull", BLACK, (0.9,) * 3, base="ashikhmin-shirley", exponent_u=300.0, exponent_v=300.0)
    plain = shoot(renderer, Scene(spheres=(Sphere((0, 0, 0), 1.0, equal, False),), lights=lamp), 48, 48, camera=camera)
    assert np.sqrt(((exact - plain.pixels) ** 2).mean()) > 0.05 * exact.max()


@given(any_vectors, st.floats(0.0, math.pi), turns)
def test_without_coordinates_the_grain_is_continuous_but_straight_down(v: Vector, turn: float, about: float) -> None:
    """A normal that turns by t turns the grain by no more than t times the stretch of the stereographic projection."""
    n = v / np.abs(v).max()
    n = n / np.linalg.norm(n)
    grain = np.array(tangent_of_normal(*n))
    assert np.linalg.norm(grain) == pytest.approx(1.0, abs=1e-9)
    assert grain @ n == pytest.approx(0.0, abs=1e-9)
    side = np.cross(n, [1.0, 0, 0] if abs(n[0]) < 0.7 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    step = 1e-4 * (turn / math.pi)
    other = n + step * (math.cos(about) * side + math.sin(about) * np.cross(n, side))
    other /= np.linalg.norm(other)
    room = 1.0 + min(n[1], other[1])
    if room > 1e-3:
        assert np.linalg.norm(np.array(tangent_of_normal(*other)) - grain) <= 2.0 * step * math.sqrt(2.0 / room) + 1e-9


def test_an_even_light_is_sent_back_by_its_integral(renderer: Renderer) -> None:
    """Rs of it mirrored, and of the rest the albedo of the diffuse term."""
    around = Surroundings(ambient=WHITE)
    camera = aim((0, 1, math.sqrt(3)), (0, 0, 0))
    seen = shoot(renderer, Scene(meshes=(floor(MICRO),), surroundings=around), camera=camera).pixels[0, 0]
    rs, rd = np.array(MICRO.specular), np.array(MICRO.diffuse)
    np.testing.assert_allclose(seen, rs + rd * (1 - rs) * 0.7626953125, rtol=8 * U)


def test_it_mirrors_and_lets_through_like_any_base(renderer: Renderer) -> None:
    """Effects are added to the base: half of a lamp is seen in a plane of either base."""
    for base in ("phong", "ashikhmin-shirley"):
        half = Material("half", BLACK, reflection=(0.5,) * 3, base=base)
        glowing = quad((-9, 4, -9), (18, 0, 0), (0, 0, 18), Material("lamp", BLACK, emission=WHITE))
        scene = Scene(meshes=(floor(half), glowing), camera=aim((0, 1, 0), (0, 0, 0)))
        assert pixel(renderer, scene) == pytest.approx(0.5, rel=4 * U)
