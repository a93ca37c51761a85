"""Dielectric boundaries: Fresnel and Snell at exact values, limits, slabs, balls and the eye inside glass."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.camera import Camera
from renderer.fresnel import fresnel, refracted_cosine
from renderer.pipeline import Renderer
from renderer.scene import Material, Rgb, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import (
    ABOVE,
    BELOW,
    EVERYWHERE_1,
    FINE,
    HEIGHT,
    U,
    aim,
    ball_mesh,
    box,
    floor,
    glass,
    lamp,
    light,
    pixel,
    quad,
    shoot,
    straight_share,
)

GLASS = 1.5


def share_and_angle(incidence_deg: float, eta: float) -> tuple[float, float]:
    """Share reflected, and the angle of refraction in degrees."""
    cosine = math.cos(math.radians(incidence_deg))
    refracted = refracted_cosine(cosine, eta)
    return fresnel(cosine, refracted, eta), math.degrees(math.acos(min(1.0, refracted)))


@pytest.mark.parametrize(
    ("incidence", "eta", "share", "angle"),
    [
        (0.0, 1 / GLASS, 0.04, 0.0),
        (45.0, 1 / GLASS, 0.0502399110122359, 28.1255057020557),
        (56.3099324740, 1 / GLASS, 25 / 338, 33.6900675260),
        (80.0, 1 / GLASS, 0.387704354691473, 41.0364105252033),
        (85.0, 1 / GLASS, 0.612799645264828, 41.6156005121),
        (10.0, GLASS, 0.0400829591550701, 15.0980866052),
        (30.0, GLASS, 0.0551901672953759, 48.5903778907),
    ],
)
def test_h27_exact_values(incidence: float, eta: float, share: float, angle: float) -> None:
    found_share, found_angle = share_and_angle(incidence, eta)
    assert found_share == pytest.approx(share, abs=1e-12)
    assert found_angle == pytest.approx(angle, abs=1e-6)
    assert math.sin(math.radians(incidence)) * eta == pytest.approx(math.sin(math.radians(found_angle)), abs=1e-12)


@given(st.floats(1e-3, 1.0), st.floats(0.1, 10.0))
def test_h27_the_reverse_ray_is_reflected_alike(cosine: float, eta: float) -> None:
    refracted = refracted_cosine(cosine, eta)
    if refracted > 1e-3:
        assert refracted_cosine(refracted, 1 / eta) == pytest.approx(cosine, abs=1e-9)
        assert fresnel(refracted, cosine, 1 / eta) == pytest.approx(fresnel(cosine, refracted, eta), abs=1e-9)


@pytest.mark.parametrize(
    ("index", "share", "tolerance"),
    [(1.33, 0.0200593122, 1e-9), (2.42, 0.1723949249, 1e-9), (1.0003, 2.2493e-8, 1e-11), (1e6, 0.999996, 1e-9)],
)
def test_h28_other_indices_at_normal_incidence(index: float, share: float, tolerance: float) -> None:
    assert fresnel(1.0, refracted_cosine(1.0, 1 / index), 1 / index) == pytest.approx(share, abs=tolerance)
    assert fresnel(1.0, refracted_cosine(1.0, index), index) == pytest.approx(share, abs=tolerance)


@pytest.mark.parametrize("eta", [1 / GLASS, GLASS])
def test_h28_limits(eta: float) -> None:
    for cosine in (1.0, 1.0 + 2.0**-23):
        assert fresnel(cosine, refracted_cosine(cosine, eta), eta) == pytest.approx(0.04, abs=1e-15)
    for cosine in (0.0, -0.0, 1e-8):
        assert fresnel(cosine, refracted_cosine(cosine, eta), eta) == pytest.approx(1.0, abs=1e-6)


def test_h28_a_share_is_a_share() -> None:
    rng = np.random.default_rng(28)
    for cosine, eta in zip(rng.uniform(-1e-7, 1 + 1e-7, 20_000), 10 ** rng.uniform(-1, 1, 20_000), strict=True):
        assert 0.0 <= fresnel(cosine, refracted_cosine(cosine, eta), eta) <= 1.0


@pytest.mark.parametrize(
    ("eta", "critical"), [(1.5, 41.810314895779), (1.33, 48.753466631327), (1.5 / 1.33, 62.457324845541)]
)
def test_h29_total_reflection_begins_at_the_critical_angle(eta: float, critical: float) -> None:
    for beyond in (0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3):
        for sign in (-1, 1):
            cosine = math.cos(math.radians(critical) + sign * beyond)
            refracted = refracted_cosine(cosine, eta)
            share = fresnel(cosine, refracted, eta)
            assert math.isfinite(share)
            assert math.isfinite(refracted)
            if beyond >= 1e-5:
                assert (share == 1.0) == (sign > 0)
                assert (refracted <= 0.0) == (sign > 0)


def test_h29_just_below_the_critical_angle() -> None:
    assert share_and_angle(41.80, GLASS)[0] == pytest.approx(0.890772, abs=1e-6)
    assert share_and_angle(41.81, GLASS)[0] == pytest.approx(0.979855, abs=1e-6)


@given(st.floats(0.0, 1.0))
def test_h30_the_same_index_on_both_sides_changes_nothing(cosine: float) -> None:
    refracted = refracted_cosine(cosine, 1.0)
    assert refracted <= 0.0 or fresnel(cosine, refracted, 1.0) == 0.0
    assert max(0.0, refracted) == pytest.approx(cosine, abs=5e-7)


SLAB = box((-50, -1, -50), (50, 0, 50), glass())


@pytest.mark.parametrize("eye", [(0.3, 0.4, 6.0), (0.1, 0.2, 0.0)])
@pytest.mark.parametrize("kind", ["sphere", "mesh"])
def test_h30_an_object_of_the_same_index_cannot_be_seen(renderer: Renderer, eye: Rgb, kind: str) -> None:
    """Bit for bit, and it costs nothing: what neither bends, colours nor mirrors light is not there. With a colour it
    is: then only its colour shows, to the offset at which rays start anew behind it.
    """
    ground = floor(Material(diffuse_texture=Texture(np.uint8([[[60] * 3, [180] * 3]]))), -1.2)
    around = Surroundings((0.1, 0.2, 0.5), (0.4, 0.3, 0.2))
    without = Scene(
        meshes=(ground,), lights=(light(3, 4, 5, 90.0),), surroundings=around, camera=Camera(eye, (0, -0.2, -1))
    )
    truth = shoot(renderer, without, 64, 64)
    for ghost, casts in ((glass(1.0), True), (dataclasses.replace(glass(1.0), transmission=(1.0, 1.0, 0.5)), False)):
        if kind == "sphere":
            scene = dataclasses.replace(without, spheres=(Sphere((0, 0, 0), 1.0, ghost, casts_shadows=casts),))
        else:
            shell = ball_mesh(ghost, 3, smooth=True, casts_shadows=casts)
            scene = dataclasses.replace(without, meshes=(ground, shell))
        frame = shoot(renderer, scene, 64, 64)
        if casts:
            np.testing.assert_array_equal(frame.pixels, truth.pixels)
            assert frame.cost.rays == truth.cost.rays
            assert frame.cost.effects == truth.cost.effects
        else:
            np.testing.assert_allclose(frame.pixels[..., :2], truth.pixels[..., :2], atol=2e-5)
            assert (frame.pixels[..., 2] < 0.6 * truth.pixels[..., 2]).any()
            assert frame.cost.rays.reflection == 0


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
