"""Analytic spheres: the distance of a hit against extended precision, near, far, as the ground, and at their rim."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.kernel import kernel
from renderer.sphere import hit_distance
from renderer.surface import sphere_surface
from tests.renderer.drawing import U
from tests.renderer.test_sphere import every_distance, nearest, tree_of
from tests.stability.shapes import Floats, directions

COUNT = 100_000


@kernel
def meet(
    origin: NDArray[np.float64], direction: NDArray[np.float64], sphere: NDArray[np.float64], t: NDArray[np.float64]
) -> None:
    """Where rays meet a sphere of center and radius (4,)."""
    for ray in range(len(t)):
        t[ray] = hit_distance(
            origin[ray, 0], origin[ray, 1], origin[ray, 2], direction[ray, 0], direction[ray, 1], direction[ray, 2],
            sphere[0], sphere[1], sphere[2], sphere[3],
        )  # fmt: skip


def distances(origin: Floats, direction: Floats, center: Floats, radius: float) -> Floats:
    """Of rays that are float32 already; the tree finds the same, rounded."""
    t = np.zeros(len(origin))
    meet(origin, direction, np.array([*center, radius]), t)
    found, primitive = nearest(tree_of(center, np.array([radius])), origin, direction)
    np.testing.assert_array_equal(found, t.astype(np.float32))
    np.testing.assert_array_equal(primitive >= 0, np.isfinite(t))
    return t


def extended_distance(origin: Floats, direction: Floats, center: Floats, radius: float) -> NDArray[np.longdouble]:
    """Pythagoras in extended precision: to the point nearest the centre, less half the chord."""
    f = origin.astype(np.longdouble) - center.astype(np.longdouble)
    d = direction.astype(np.longdouble)
    length = np.sqrt((d * d).sum(axis=1))
    d /= length[:, None]
    to_middle = -(f * d).sum(axis=1)
    aside = f + to_middle[:, None] * d
    return np.asarray((to_middle - np.sqrt(np.longdouble(radius) ** 2 - (aside * aside).sum(axis=1))) / length)


NAIVE = {
    10.0: ("0", 1.7e-4),
    100.0: ("0", 1.8e-2),
    1_000.0: ("0.37 %", 0.56),
    4_100.0: ("8.2 %", 2.4),
    10_000.0: ("19.4 %", 5.5),
    100_000.0: ("23.8 %", 64.0),
}
"""Misses and largest error of b^2 - 4ac in float32, by distance over radius."""


@pytest.mark.parametrize("ratio", NAIVE)
def test_h20_a_sphere_far_away_keeps_its_shape(ratio: float) -> None:
    """100,000 rays that pass within 0.999 radii of the centre all hit (none of 100,000: a rate below 3e-5), to 64 steps
    of float64, since the rim is 22 times steeper than the middle (Ray Tracing Gems, 2019, ch. 7).
    """
    rng = np.random.default_rng(20)
    toward = directions(rng, COUNT)
    aside = np.cross(toward, rng.normal(size=(COUNT, 3)))
    aside *= (np.sqrt(rng.uniform(0, 0.998**2, COUNT)) / np.linalg.norm(aside, axis=1))[:, None]
    origin = (aside - ratio * toward).astype(np.float32).astype(np.float64)
    direction = toward.astype(np.float32).astype(np.float64)
    passing = np.linalg.norm(np.cross(origin, direction), axis=1) / np.linalg.norm(direction, axis=1)
    sound = passing < 0.999
    assert sound.sum() > (0.9 * COUNT if ratio <= 10_000 else 0.5 * COUNT)
    found = distances(origin[sound], direction[sound], np.zeros(3), 1.0)
    assert np.isfinite(found).all()
    error = np.abs(found - extended_distance(origin[sound], direction[sound], np.zeros(3), 1.0)).max()
    lost, off = NAIVE[ratio]
    print(f"{ratio:>9,.0f} radii away: 0 of {sound.sum():,} missed, off by {error:.1e} (naive: {lost} missed, {off:g})")
    assert error <= 64 * np.spacing(ratio)


def test_h21_a_sphere_as_large_as_the_ground() -> None:
    """A radius of 1e6 and an eye 1 above it, looking from straight down up to 1e-6 rad below the horizon: the distance
    to 1e-6 relative, and to 1e-9 where the view is steeper than 0.05.
    """
    rng = np.random.default_rng(21)
    horizon = math.acos(1e6 / (1e6 + 1.0))
    below = np.concatenate([horizon + 10.0 ** rng.uniform(-6, -0.1, COUNT // 2), rng.uniform(0.05, 1.57, COUNT // 2)])
    around = rng.uniform(0, 2 * math.pi, COUNT)
    flat = np.cos(below)
    direction = np.stack([flat * np.cos(around), -np.sin(below), flat * np.sin(around)], axis=1)
    direction = direction.astype(np.float32).astype(np.float64)
    rounded = np.arctan2(-direction[:, 1], np.hypot(direction[:, 0], direction[:, 2]))
    clear = rounded > horizon + 1e-6
    assert clear.sum() > 0.95 * COUNT
    origin, center = np.tile((0.0, 1.0, 0.0), (COUNT, 1)), np.array((0.0, -1e6, 0.0))
    found = distances(origin, direction, center, 1e6)
    truth = extended_distance(origin[clear], direction[clear], center, 1e6).astype(np.float64)
    np.testing.assert_allclose(found[clear], truth, rtol=1e-6)
    steep = rounded[clear] > 0.05
    np.testing.assert_allclose(found[clear][steep], truth[steep], rtol=1e-9)
    assert (found > 0).all()


def test_h22_on_in_and_beside_the_unit_sphere() -> None:
    """pbrt-v4, shapes_test.cpp, and Mitsuba 3, test_sphere.py; exact, or to 1e-10."""
    unit = (0.0, 0.0, 0.0, 1.0)
    assert hit_distance(1.0, 0.0, 0.0, 1.0, 0.0, 0.0, *unit) == math.inf
    assert hit_distance(1.0, 0.0, 0.0, 0.6, 0.8, 0.0, *unit) == math.inf
    assert hit_distance(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, *unit) == math.inf
    assert hit_distance(1.0, 0.0, 0.0, -1.0, 0.0, 0.0, *unit) == 2.0
    assert hit_distance(1.0, 0.0, 0.0, -0.6, 0.8, 0.0, *unit) == pytest.approx(1.2, abs=1e-15)
    assert hit_distance(0.0, 0.0, 0.0, 0.0, 0.0, 1.0, *unit) == 1.0
    assert hit_distance(0.0, 0.0, 0.0, 0.0, 0.0, 4.0, *unit) == 0.25
    for beside, half_chord in ((1e-3, 0.0447101778), (1e-6, 0.0014142132)):
        assert hit_distance(1 - beside, 0.0, 5.0, 0.0, 0.0, -1.0, *unit) == pytest.approx(5 - half_chord, abs=1e-10)
    assert hit_distance(1 + 1e-6, 0.0, 5.0, 0.0, 0.0, -1.0, *unit) == math.inf
    assert hit_distance(0.0, 0.0, -5.0, 0.0, 0.0, -1.0, *unit) == math.inf
    assert hit_distance(0.0, 0.0, -5.0, 0.0, 0.0, 0.0, *unit) == math.inf


def test_h22_a_grid_of_rays_hits_within_the_outline() -> None:
    """21x21 rays: a hit where x^2 + y^2 <= 1, but for the rounding of the square itself."""
    for x in np.linspace(-1, 1, 21):
        for y in np.linspace(-1, 1, 21):
            inside = x * x + y * y
            hit = hit_distance(x, y, 3.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0) < math.inf
            assert hit == (inside <= 1.0) or abs(inside - 1.0) < 1e-15


@pytest.mark.parametrize("radius", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("up", [1.0, -1.0])
@pytest.mark.parametrize("beside", [0.0, -0.0, 1e-30, 1e-12])
def test_h22_the_poles_have_a_normal_and_texture_coordinates(radius: float, up: float, beside: float) -> None:
    s = sphere_surface(0.0, 0.0, 0.0, radius, 0, beside * radius, 3.0 * up * radius, 0.0, 0.0, -up, 0.0, True)
    assert (s.px, s.py, s.pz) == pytest.approx((beside * radius, up * radius, 0.0), abs=4 * U * radius)
    assert (s.nx, s.ny, s.nz) == pytest.approx((beside, up, 0.0), abs=1e-15)
    assert 0.0 <= s.u <= 1.0
    assert s.v == (1.0 if up > 0 else 0.0)


@kernel
def leave_sphere(
    sphere: NDArray[np.float64],
    start: NDArray[np.float64],
    coming: NDArray[np.float64],
    out: NDArray[np.float64],
    again: NDArray[np.float64],
) -> None:
    """Distances at which rays meet a sphere again that leave it, outwards, where others met it."""
    cx, cy, cz, r = sphere[0], sphere[1], sphere[2], sphere[3]
    for ray in range(len(again)):
        s = sphere_surface(
            cx, cy, cz, r, 0, start[ray, 0], start[ray, 1], start[ray, 2],
            coming[ray, 0], coming[ray, 1], coming[ray, 2], True,
        )  # fmt: skip
        x, y, z = out[ray, 0], out[ray, 1], out[ray, 2]
        side = 1.0 if x * s.gx + y * s.gy + z * s.gz >= 0.0 else -1.0
        ox, oy, oz = s.px + s.offset * s.gx, s.py + s.offset * s.gy, s.pz + s.offset * s.gz
        again[ray] = hit_distance(
            np.float64(np.float32(ox)), np.float64(np.float32(oy)), np.float64(np.float32(oz)),
            np.float64(np.float32(side * x)), np.float64(np.float32(side * y)), np.float64(np.float32(side * z)),
            cx, cy, cz, r,
        )  # fmt: skip


def test_h22_a_ray_that_leaves_a_sphere_does_not_meet_it_again() -> None:
    """1,000 spheres of radius 10^-4 to 10^4, each at a place up to ten radii off, 100 rays each (pbrt-v4,
    shapes_test.cpp, FullSphere): 0 of 100,000.
    """
    rng = np.random.default_rng(22)
    for radius in 10.0 ** rng.uniform(-4, 4, 1000):
        center = radius * rng.uniform(-10, 10, 3)
        toward, again = directions(rng, 100), np.zeros(100)
        start = (center + 3 * radius * toward).astype(np.float32).astype(np.float64)
        coming = center + 0.9 * radius * directions(rng, 100) - start
        coming /= np.linalg.norm(coming, axis=1, keepdims=True)
        leave_sphere(np.array([*center, radius]), start, coming, directions(rng, 100), again)
        assert np.isinf(again).all()


@pytest.mark.parametrize("zero", [0.0, -0.0])
@pytest.mark.parametrize("x", [1.0, -1.0, 0.0])
def test_h14_rays_along_the_faces_of_boxes_around_spheres(zero: float, x: float) -> None:
    """Columns of balls whose boxes share faces; the ray runs in such a face, where it just touches (0 * infinity in a
    plain slab test; Williams et al. 2005).
    """
    center = np.array([(2.0 * i, 2.0 * j, 0.0) for i in range(-3, 4) for j in range(4)])
    radius = np.ones(len(center))
    origin, direction = np.array([[x, -5.0, 0.0], [x, -5.0, 0.25]]), np.array([[zero, 1.0, zero]] * 2)
    truth = every_distance(center, radius, origin, direction).min(axis=1)
    distance, _ = nearest(tree_of(center, radius), origin, direction)
    np.testing.assert_array_equal(distance, truth.astype(np.float32))
    assert distance[0] == (4.0 if x == 0.0 else 5.0)
