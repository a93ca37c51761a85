"""Dielectric boundaries: Fresnel and Snell at exact values, limits, slabs, balls and the eye inside glass."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.fresnel import fresnel, refracted_cosine
from renderer.kernel import roomy_kernel
from renderer.pipeline import Renderer
from renderer.scene import Material, Rgb, Scene, Sphere, Surroundings, Texture
from tests.renderer.drawing import (
    ABOVE,
    BELOW,
    BLACK,
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


@roomy_kernel
def count_shares(cosine: NDArray[np.float64], eta: NDArray[np.float64]) -> int:
    """How many of the shares mirrored lie in 0 .. 1; not a number lies nowhere."""
    good = 0
    for index in range(len(cosine)):
        share = fresnel(cosine[index], refracted_cosine(cosine[index], eta[index]), eta[index])
        good += 0.0 <= share <= 1.0
    return good


def test_h28_a_share_is_a_share() -> None:
    """1,000,000 random cosines, also a little out of range, and indices from 0.1 to 10: 0 are out of 0 .. 1."""
    rng = np.random.default_rng(28)
    n = 1_000_000
    assert count_shares(rng.uniform(-1e-7, 1 + 1e-7, n), 10 ** rng.uniform(-1, 1, n)) == n


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
    pixel_sr = (2 * half / pixels) ** 2 * np.cos(np.radians(angle)) ** 3
    edge_sr = 2 * math.pi * math.sin(math.radians(41.8103)) * math.radians(ring)
    assert pixel_sr[bright].sum() / (2 * math.pi) == pytest.approx(0.254644, abs=edge_sr / (2 * math.pi))
    assert bright[angle < 41.8103 - ring].all()
    assert not bright[angle > 41.8103 + ring].any()


@pytest.mark.parametrize(("incidence", "angle"), [(80.0, 41.0364105252033), (45.0, 28.1255057020557)])
def test_h27_a_ray_and_its_reverse_at_exact_values(incidence: float, angle: float) -> None:
    share, refracted = share_and_angle(incidence, 1 / GLASS)
    back, incident = share_and_angle(angle, GLASS)
    assert back == pytest.approx(share, abs=1e-12)
    assert (refracted, incident) == (pytest.approx(angle, abs=1e-9), pytest.approx(incidence, abs=1e-9))


@pytest.mark.parametrize(
    ("incidence", "share"),
    [
        (30.0, None),
        (45.0, 0.0502399110122359),
        (56.3099324740, 25 / 338),
        (80.0, 0.387704354691473),
        (85.0, 0.612799645),
    ],
)
def test_h27_a_picture_shows_the_share(renderer: Renderer, incidence: float, share: float | None) -> None:
    """A block of glass mirrors the sky, whose radiance is the height. Schlick's form, which is not offered, would be
    off by 0.008 to 0.036. Tolerance: ten roundings of float32.
    """
    sine, cosine = math.sin(math.radians(incidence)), math.cos(math.radians(incidence))
    block = box((-50, -9, -50), (50, 0, 50), glass())
    scene = Scene(meshes=(block,), surroundings=HEIGHT, exposure=FINE)
    seen = pixel(renderer, scene, depth=1, camera=aim((-3 * sine, 3 * cosine, 0), (0, 0, 0)))
    expected = share_and_angle(incidence, 1 / GLASS)[0] if share is None else share
    assert seen == pytest.approx(cosine * expected, abs=1e-6)


def test_h29_the_picture_fades_into_total_reflection(renderer: Renderer) -> None:
    """Across the critical angle, 400 pixels of 0.001 degrees: what is let through falls to 0 and stays there."""
    block = box((-99, -99, -99), (99, 0, 99), glass())
    angle = math.radians(41.810314895779)
    camera = Camera((-math.tan(angle), -1, 0), (0, 0, 0), (0, 0, 1), 0.001)
    scene = Scene(meshes=(block,), surroundings=ABOVE, exposure=FINE)
    across = shoot(renderer, scene, 400, 1, depth=1, camera=camera).pixels[0, :, 0]
    seen = across if across[0] > across[-1] else across[::-1]
    assert np.isfinite(seen).all()
    assert (np.diff(seen) <= 1e-6).all()
    assert seen[0] > 0.0
    assert (seen[210:] == 0.0).all()
    assert (seen[:190] > 0.0).all()


@pytest.mark.parametrize(("h", "crossing"), [(0.1, 1.4958270631), (0.3, 1.4619784374), (0.5, 1.3915729489)])
def test_h32_a_glass_ball_focuses(renderer: Renderer, h: float, crossing: float) -> None:
    """Where the ray crosses the axis: a lamp above the axis is seen just before that place, and not just behind it.

    Tolerance: 1e-5 of it, and the offset of rays at both faces, 16 units in the last place of 2, over the slope.
    """
    offset = 2 * 16 * 2.0**-23 * 2
    slack = 1e-5 * crossing + offset / math.tan(math.radians({0.1: 3.83, 0.3: 11.84, 0.5: 21.06}[h]))
    for z, lit in ((crossing - slack, True), (crossing + slack, False)):
        screen = quad((-1, 0, -z), (2, 0, 0), (0, 1, 0), lamp())
        scene = Scene(meshes=(screen,), spheres=(Sphere((0, 0, 0), 1.0, glass()),))
        assert (pixel(renderer, scene, depth=2, camera=aim((0, h, 5), (0, h, 0))) > 0) == lit


def test_h34_a_camera_under_water_sees_no_factor_of_the_index(renderer: Renderer) -> None:
    """Whitted's rays carry no n^2 of radiance, which Mitsuba's do: straight up the sky is 1 less what is mirrored."""
    water = Material("water", diffuse=BLACK, transmission=(1.0,) * 3, ior=1.33)
    scene = Scene(meshes=(box((-9, -9, -9), (9, 0, 9), water),), surroundings=ABOVE)
    seen = pixel(renderer, scene, depth=1, camera=aim((0, -1, 0), (0, 0, 0)))
    assert seen == pytest.approx(1 - 0.0200593122, abs=1e-6)
