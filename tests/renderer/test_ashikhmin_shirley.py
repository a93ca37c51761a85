"""The model of Ashikhmin and Shirley: the paper's formulas, closed forms of its energy, and what it must never do."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.ashikhmin_shirley import ashikhmin_shirley, lobe_power
from renderer.camera import Camera
from renderer.kernel import roomy_kernel
from renderer.pipeline import Renderer
from renderer.scene import Material, Scene, Sphere, Surroundings
from renderer.shapes import ball
from renderer.tangent import tangent_of_normal
from tests.renderer.drawing import BLACK, WHITE, U, aim, floor, light, pixel, quad, shoot

Vector = NDArray[np.float64]
UP: Vector = np.array([0.0, 0.0, 1.0])
ALONG: Vector = np.array([1.0, 0.0, 0.0])
EXPONENTS = (0.0, 1.0, 10.0, 300.0, 1e4, 1e6, 1e8)

exponents = st.sampled_from(EXPONENTS) | st.floats(0.0, 1e9)
angles = st.floats(0.0, math.pi / 2) | st.sampled_from([0.0, 1e-9, 1e-4, math.pi / 2 - 1e-9])
turns = st.floats(0.0, 2 * math.pi)
directions = st.builds(
    lambda theta, phi: np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]),
    angles,
    turns,
)


def terms(to_light: Vector, to_eye: Vector, nu: float, nv: float, along: Vector = ALONG) -> tuple[float, float, float]:
    """The model's terms on the plane z = 0, which include the cosine of the light."""
    return ashikhmin_shirley(*UP, *along, nu, nv, *to_light, *to_eye)


def brdf(to_light: Vector, to_eye: Vector, nu: float, nv: float, rs: float, rd: float) -> float:
    highlight, schlick, matt = terms(to_light, to_eye, nu, nv)
    return (highlight * (rs + (1 - rs) * schlick) + matt * rd * (1 - rs)) / float(to_light[2])


def as_printed(k1: Vector, k2: Vector, nu: float, nv: float, rs: float, rd: float) -> float:
    """Equations 4 and 5 of the paper, symbol by symbol; loses its digits where h is near n."""
    n, u, v = UP, ALONG, np.array([0.0, 1.0, 0.0])
    h = (k1 + k2) / np.linalg.norm(k1 + k2)
    fresnel = rs + (1 - rs) * (1 - k1 @ h) ** 5
    exponent = (nu * (h @ u) ** 2 + nv * (h @ v) ** 2) / (1 - (h @ n) ** 2)
    specular = math.sqrt((nu + 1) * (nv + 1)) / (8 * math.pi) * (n @ h) ** exponent / ((h @ k1) * max(n @ k1, n @ k2))
    diffuse = 28 * rd / (23 * math.pi) * (1 - rs) * (1 - (1 - (n @ k1) / 2) ** 5) * (1 - (1 - (n @ k2) / 2) ** 5)
    return float(specular * fresnel + diffuse)


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


@given(directions, directions, exponents, exponents, st.floats(0, 1), st.floats(0, 1))
def test_h45_it_is_the_same_both_ways(a: Vector, b: Vector, nu: float, nv: float, rs: float, rd: float) -> None:
    forth, back = brdf(a, b, nu, nv, rs, rd), brdf(b, a, nu, nv, rs, rd)
    assert forth == pytest.approx(back, rel=16 * 2.0**-53)


@given(directions, directions, exponents, turns)
def test_equal_exponents_make_a_lobe_without_grain(a: Vector, b: Vector, n: float, turn: float) -> None:
    """Nor is a tangent needed; nearly equal ones make nearly the same lobe along any."""
    turned = np.array([math.cos(turn), math.sin(turn), 0.0])
    assert terms(a, b, n, n, np.zeros(3)) == terms(a, b, n, n)
    grained = terms(a, b, n, n * (1 + 2.0**-52) + 5e-324, turned)
    assert grained[0] == pytest.approx(terms(a, b, n, n)[0], rel=1e-11 + n * 1e-13, abs=1e-300)
    assert terms(a, b, n, n, turned)[0] == pytest.approx(terms(a, b, n, n)[0], rel=1e-11 + n * 1e-13, abs=1e-300)


any_part = st.integers(0, 2**32 - 1).map(lambda word: float(np.uint32(word).view(np.float32)))
any_vectors = (
    st.tuples(any_part, any_part, any_part).map(np.array).filter(lambda v: bool(np.isfinite(v).all() and v.any()))
)


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


# energy


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
