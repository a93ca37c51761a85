"""Reflectance: huge exponents, energy, reciprocity and the white furnace."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.ashikhmin_shirley import ashikhmin_shirley, lobe_power
from renderer.camera import Camera
from renderer.kernel import roomy_kernel
from renderer.material_table import SPECULAR
from renderer.pipeline import Renderer
from renderer.reflectance import phong_lobe, towards_eye
from renderer.scene import Material, Scene, Sphere
from renderer.surface import Surface
from tests.renderer.drawing import (
    BLACK,
    DOWN,
    EVERYWHERE_1,
    FINE,
    WHITE,
    U,
    aim,
    ball_mesh,
    floor,
    glass,
    light,
    mirror,
    pixel,
    shoot,
)
from tests.renderer.lobe import (
    EXPONENTS,
    UP,
    Vector,
    angles,
    any_part,
    any_vectors,
    as_printed,
    brdf,
    directions,
    exponents,
    terms,
    turns,
)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 10.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("angle", [0.0, 0.01, 1.0, 30.0, 89.0])
def test_h41_the_highlight_is_a_power_of_the_cosine(renderer: Renderer, exponent: float, angle: float) -> None:
    """Eye above, light at an angle: R.V is its cosine. Tolerance: the eye's direction to the middle is exact."""
    ground = floor(Material(diffuse=BLACK, specular=(0.7, 0.7, 0.7), shininess=exponent))
    x, y = 2 * math.sin(math.radians(angle)), 2 * math.cos(math.radians(angle))
    seen = pixel(renderer, Scene(meshes=(ground,), lights=(light(x, y, 0, 4.0),), camera=DOWN))
    expected = 0.7 * math.cos(math.radians(angle)) ** exponent
    assert seen == pytest.approx(expected, rel=8 * U + 1e-15 * exponent, abs=1e-30)
    for n, value in ((10.0, 0.99847799), (1e3, 0.8587165), (1e6, 0.0)):
        if exponent == n and angle == 1.0:
            assert seen == pytest.approx(0.7 * value, rel=1e-7, abs=1e-30)


def test_h41_a_highlight_never_exceeds_its_peak(renderer: Renderer) -> None:
    shiny = Material(diffuse=BLACK, specular=WHITE, shininess=1e9)
    scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, shiny),), lights=(light(0, 0, 3, 4.0),), camera=Camera((0, 0, 3)))
    seen = shoot(renderer, scene, 65, 65).pixels
    assert np.isfinite(seen).all()
    assert seen.max() == pytest.approx(1.0, rel=8 * U)


@pytest.mark.parametrize(("nu", "nv"), [(0, 0), (1, 1), (10, 10), (10, 1000), (500, 3), (1e4, 1e4)])
def test_h42_it_is_the_papers(nu: float, nv: float) -> None:
    generator = np.random.default_rng(7)
    for _ in range(300):
        k1, k2 = (v / np.linalg.norm(v) for v in generator.normal(size=(2, 3)) * (1, 1, 0) + (0, 0, 0.3))
        for rs, rd in ((0.04, 0.7), (0.9, 0.1)):
            assert brdf(k1, k2, nu, nv, rs, rd) == pytest.approx(
                as_printed(k1, k2, nu, nv, rs, rd), rel=1e-9, abs=1e-30
            )


@pytest.mark.parametrize(
    ("nu", "nv", "fresnel", "peak"),
    [(10, 10, 0.04, 0.0175070437), (10, 1000, 1.0, 4.1751638), (1e6, 1e6, 1.0, 39788.7756)],
)
def test_h42_peaks(nu: float, nv: float, fresnel: float, peak: float) -> None:
    """Light and eye at the normal, where the exponent is 0/0."""
    assert brdf(UP, UP, nu, nv, fresnel, 0.0) == pytest.approx(peak, rel=1e-8)


@given(angles, turns, exponents, exponents)
def test_h42_the_lobe_keeps_its_digits(theta: float, phi: float, nu: float, nv: float) -> None:
    """cos^(nu cos^2 phi + nv sin^2 phi) of the angle between h and n, computed from the angle itself."""
    exponent = nu * math.cos(phi) ** 2 + nv * math.sin(phi) ** 2
    along, across = (math.sin(theta) * math.cos(phi)) ** 2, (math.sin(theta) * math.sin(phi)) ** 2
    got = lobe_power(along, across, math.cos(theta), nu, nv)
    if theta < 1e-3:
        logarithm = -(theta**2) / 2 - theta**4 / 12
        assert got == pytest.approx(math.exp(exponent * logarithm), rel=1e-9, abs=1e-300)
    assert 0.0 <= got <= 1.0


@given(any_vectors, any_vectors, any_part, any_part)
def test_h42_every_pattern_of_bits_gives_a_number(a: Vector, b: Vector, nu: float, nv: float) -> None:
    """Directions and exponents from random bits; the light above the horizon, the eye anywhere."""
    nu, nv = (min(abs(n), 1e9) if math.isfinite(n) else 1e9 for n in (nu, nv))
    to_light, to_eye = (v / np.abs(v).max() / np.linalg.norm(v / np.abs(v).max()) for v in (a, b))
    cosine = abs(float(to_light[2]))
    to_light[2] = cosine
    if cosine > 0.0:
        for eye in (to_eye, to_light, -to_light):
            for value in terms(to_light, eye, nu, nv):
                assert value >= 0.0
                assert math.isfinite(value)


@pytest.mark.parametrize("n", EXPONENTS)
def test_h42_at_grazing_angles_it_stays_finite(n: float) -> None:
    """The light right behind the eye's ray, and both in the surface."""
    for tilt in (0.0, 5e-324, 1e-300, 1e-16, 1e-8):
        for turn in (0.0, 1e-12, math.pi - 1e-12, math.pi):
            a, b = np.array([1.0, 0.0, 1e-300]), np.array([math.cos(turn), math.sin(turn), tilt])
            assert all(math.isfinite(value) for value in terms(a, b, n, n))


@roomy_kernel
def _albedo(to_eye: Vector, nu: float, nv: float, steps: int) -> Vector:
    """Integrals of highlight * cosine, highlight * schlick * cosine and matt * cosine over the hemisphere of lights.

    The midpoint rule over half vectors, whose lobe the integrand follows: their height is cos^s of a uniform number.
    """
    total = np.zeros(3)
    sharp = 1.0 / (math.sqrt((nu + 1.0) * (nv + 1.0)) + 1.0)
    ex, ey, ez = to_eye[0], to_eye[1], to_eye[2]
    for i in range(steps):
        q = (i + 0.5) / steps
        hz = q**sharp
        measure = 2.0 * math.pi / steps / steps * sharp * hz / q
        side = math.sqrt(max(0.0, 1.0 - hz * hz))
        for j in range(steps):
            phi = 2.0 * math.pi * (j + 0.5) / steps
            hx, hy = side * math.cos(phi), side * math.sin(phi)
            cosine = hx * ex + hy * ey + hz * ez
            lx, ly, lz = 2 * cosine * hx - ex, 2 * cosine * hy - ey, 2 * cosine * hz - ez
            if cosine > 0.0 and lz > 0.0:
                high, schlick, matt = ashikhmin_shirley(
                    0.0, 0.0, 1.0, 1.0, 0.0, 0.0, nu, nv, lx, ly, lz, ex, ey, ez
                )  # fmt: skip
                weight = measure * 4.0 * cosine
                total[0] += weight * high
                total[1] += weight * high * schlick
                total[2] += weight * matt
    return total


def albedo(cosine: float, nu: float, nv: float, turn: float = 0.3) -> Vector:
    sine = math.sqrt(1.0 - cosine * cosine)
    return _albedo(np.array([sine * math.cos(turn), sine * math.sin(turn), cosine]), nu, nv, 400)


@pytest.mark.parametrize(("cosine", "share"), [(1.0, 0.96875), (0.5, 0.7626953125), (0.1, 0.2262190625)])
def test_h43_energy_of_the_diffuse_term(cosine: float, share: float) -> None:
    assert albedo(cosine, 0.0, 0.0)[2] == pytest.approx(share, abs=1e-3)


@pytest.mark.parametrize(("n", "share"), [(1, 0.25), (10, 0.6957072), (100, 0.9611650), (1e4, 0.9996001)])
def test_h43_energy_of_the_highlight_head_on(n: float, share: float) -> None:
    assert albedo(1.0, n, n)[0] == pytest.approx(share, abs=1e-3)


@pytest.mark.parametrize(("nu", "nv"), [(0, 0), (3, 3), (10, 10), (1, 100), (1000, 10), (1e4, 1e4), (1e5, 1e5)])
def test_h43_it_sends_out_no_more_than_arrives(nu: float, nv: float) -> None:
    """A white furnace of radiance 1 around it: what it shows is the albedo, at most 1 for every Rs and Rd."""
    for cosine in (1.0, 0.7, 0.4, 0.2, 0.1, 0.05):
        for turn in (0.0, 0.8, math.pi / 2):
            highlight, grazing, matt = albedo(cosine, nu, nv, turn)
            for rs in (0.0, 0.04, 0.5, 1.0):
                total = rs * highlight + (1 - rs) * grazing + matt * (1 - rs)
                assert 0.0 < total < 1.001


def test_h44_the_unit_sphere_from_inside(renderer: Renderer) -> None:
    """Light of pi W/sr in the middle: direct light is exactly the albedo, in every direction."""
    half = Material(diffuse=(0.5, 0.5, 0.5))
    for casts in (True, False):
        scene = Scene(spheres=(Sphere((0, 0, 0), 1.0, half, casts),), lights=(light(0, 0, 0, math.pi),))
        seen = shoot(renderer, scene, 32, 32, camera=Camera((0.3, 0.2, 0.1), (1, 0.5, 0), vertical_fov_deg=120))
        np.testing.assert_allclose(seen.pixels, 0.5, rtol=4 * U)


@pytest.mark.parametrize("depth", [1, 2, 7, 64])
def test_h44_mirrors_in_a_white_furnace_show_exactly_1(renderer: Renderer, depth: int) -> None:
    camera = Camera((0, 0, 6), (0, 0, 0))
    for scene in (
        Scene(spheres=(Sphere((0, 0, 0), 1.0, mirror()),), surroundings=EVERYWHERE_1),
        Scene(meshes=(ball_mesh(mirror(), 2),), surroundings=EVERYWHERE_1),
        Scene(meshes=(ball_mesh(mirror(), 2, smooth=True),), surroundings=EVERYWHERE_1),
    ):
        np.testing.assert_array_equal(shoot(renderer, scene, 64, 64, depth=depth, camera=camera).pixels, 1.0)


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


@given(directions, directions, exponents, exponents, st.floats(0, 1), st.floats(0, 1))
def test_h45_it_is_the_same_both_ways(a: Vector, b: Vector, nu: float, nv: float, rs: float, rd: float) -> None:
    forth, back = brdf(a, b, nu, nv, rs, rd), brdf(b, a, nu, nv, rs, rd)
    assert forth == pytest.approx(back, rel=16 * 2.0**-53)


FLAT = Surface(0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, True)
"""A plane that faces z."""


def phong(to_light: Vector, to_eye: Vector, exponent: float) -> float:
    towards = towards_eye(SPECULAR, *(-float(part) for part in to_eye))
    return phong_lobe(True, FLAT, *(float(part) for part in to_light), *towards, exponent)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("angle_deg", [0.0, 1e-4, 0.01, 1.0, 60.0, 90.0])
@pytest.mark.parametrize("length", [1.0, 1.0 + 2.0**-23, 1.0 - 2.0**-24])
def test_h41_the_lobe_on_rounded_vectors(exponent: float, angle_deg: float, length: float) -> None:
    """Against long double on the same float32 vector to the eye, whose length is off by a rounding. The length is
    divided out in float64, so that the peak of an exponent of 1e9 is 1 and never 1.127 or infinite; the tolerance is
    a rounding of float64 times the exponent.
    """
    angle = math.radians(angle_deg)
    eye = (np.array([math.sin(angle), 0.0, math.cos(angle)]) * length).astype(np.float32)
    wide = eye.astype(np.longdouble)
    cosine = min(np.longdouble(1), wide[2] / np.sqrt((wide * wide).sum()))
    truth = float(cosine ** np.longdouble(exponent)) if cosine > 0 else 0.0
    found = phong(UP, eye.astype(np.float64), exponent)
    assert found == pytest.approx(truth, rel=1e-14 + exponent * 2.0**-52, abs=2.0**-150)
    assert 0.0 <= found <= 1.0


@given(exponents, st.floats(2.0**-40, 110.0))
def test_h41_the_foot_of_a_lobe_is_left_out_where_float32_has_nothing_of_it(exponent: float, height: float) -> None:
    """Light at such an angle that the lobe is about e^-height of its peak: 2^-150 is e^-104."""
    cosine = math.exp(-height / max(exponent, 1.0))
    found = phong((math.sqrt(1.0 - cosine * cosine), 0.0, cosine), (0.0, 0.0, 1.0), exponent)
    assert np.float32(found) == np.float32(cosine**exponent)
    assert found in (0.0, cosine**exponent)


def test_h41_a_mirrored_light_behind_the_eye_gives_nothing() -> None:
    for exponent in (0.0, 1.0, 1e9):
        for height in (0.0, -0.0, -1e-9, -1.0):
            assert phong(UP, np.array([1.0, 0.0, height]), exponent) == 0.0
    assert phong(UP, np.array([1.0, 0.0, 1e-9]), 0.0) == 1.0


@pytest.mark.parametrize("n", [0.0, 1.0, 10.0, 100.0])
def test_h43_phongs_lobe_does_not_conserve_energy(n: float) -> None:
    """Its integral over the hemisphere is 2 pi / (n + 1), which a highlight of 1 makes more than arrives for n < 5:
    what the formula says is checked here, and that scene files may say more is left to their authors.
    """
    steps = 2000
    heights = (np.arange(steps) + 0.5) / steps
    lobe = [phong(UP, np.array([math.sqrt(1 - z * z), 0.0, z]), n) for z in heights]
    assert 2 * math.pi * float(np.mean(lobe)) == pytest.approx(2 * math.pi / (n + 1), rel=1e-3)


def test_h45_mirroring_the_light_or_the_eye_is_the_same() -> None:
    """R(L).V = R(V).L, for 10,000 random pairs."""
    rng = np.random.default_rng(45)
    pairs = rng.normal(size=(10_000, 2, 3))
    pairs /= np.linalg.norm(pairs, axis=2, keepdims=True)
    pairs[:, :, 2] = np.abs(pairs[:, :, 2])
    for one, other in pairs:
        assert phong(one, other, 1.0) == pytest.approx(phong(other, one, 1.0), rel=0.0, abs=8 * 2.0**-53)
