"""Spheres: the distance of a hit against extended precision, and the tree against trying every sphere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.sphere import SphereTree, build_sphere_tree, hit_distance, nearest_spheres, shade_spheres

Floats = NDArray[np.float64]


def tree_of(center: Floats, radius: Floats, casts: NDArray[np.uint8] | None = None) -> SphereTree:
    k = len(radius)
    return build_sphere_tree(
        center.reshape(-1, 3), radius, np.arange(k, dtype=np.int32), np.ones(k, np.uint8) if casts is None else casts
    )


def nearest(tree: SphereTree, origin: Floats, direction: Floats) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Distances and the numbers the spheres had before they were sorted; -1 for a miss."""
    n = len(origin)
    distance, primitive = np.full(n, np.inf, np.float32), np.full(n, -1, np.int32)
    nearest_spheres(tree, origin.astype(np.float32), direction.astype(np.float32), 0, distance, primitive)
    found = primitive >= 0
    primitive[found] = tree.material[primitive[found]]
    return distance, primitive


def every_distance(center: Floats, radius: Floats, origin: Floats, direction: Floats) -> Floats:
    """(rays, spheres) distances, each sphere tried."""
    rays = np.concatenate([origin, direction], axis=1).astype(np.float32).astype(np.float64)
    spheres = np.concatenate([center.reshape(-1, 3), radius[:, None]], axis=1)
    table = [[hit_distance(*ray, *sphere) for sphere in spheres] for ray in rays]
    return np.array(table, dtype=np.float64).reshape(len(rays), len(spheres))


def extended_distance(origin: Floats, direction: Floats, center: Floats, radius: float) -> NDArray[np.longdouble]:
    """Pythagoras in extended precision: to the point nearest the centre, less half the chord."""
    f = origin.astype(np.longdouble) - center.astype(np.longdouble)
    d = direction.astype(np.longdouble)
    length = np.sqrt((d * d).sum(axis=1))
    d /= length[:, None]
    to_middle = -(f * d).sum(axis=1)
    aside = f + to_middle[:, None] * d
    return np.asarray((to_middle - np.sqrt(np.longdouble(radius) ** 2 - (aside * aside).sum(axis=1))) / length)


def distances(origin: Floats, direction: Floats, center: Floats, radius: float) -> Floats:
    tree = tree_of(center, np.array([radius]))
    found, primitive = nearest(tree, origin, direction)
    exact = [hit_distance(*o, *d, *center, radius) for o, d in zip(origin, direction, strict=True)]
    np.testing.assert_array_equal(found[primitive >= 0], np.array(exact, np.float32)[primitive >= 0])
    assert (np.isfinite(exact) == (primitive >= 0)).all()
    return np.array(exact)


@pytest.mark.parametrize("ratio", [10.0, 100.0, 1_000.0, 4_100.0, 10_000.0, 100_000.0])
def test_h20_a_sphere_far_away_keeps_its_shape(ratio: float) -> None:
    """Rays that pass within 0.999 radii of the centre all hit, at the right distance: to 64 steps of float64,
    since the outline is 22 times steeper than the middle.
    """
    rng = np.random.default_rng(20)
    toward = rng.normal(size=(2000, 3))
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    aside = np.cross(toward, rng.normal(size=(2000, 3)))
    aside *= (np.sqrt(rng.uniform(0, 0.998**2, 2000)) / np.linalg.norm(aside, axis=1))[:, None]
    origin = (aside - ratio * toward).astype(np.float32).astype(np.float64)
    direction = toward.astype(np.float32).astype(np.float64)
    miss_distance = np.linalg.norm(np.cross(origin, direction), axis=1) / np.linalg.norm(direction, axis=1)
    sound = miss_distance < 0.999
    assert sound.sum() > (1900 if ratio <= 10_000 else 1000)
    found = distances(origin[sound], direction[sound], np.zeros(3), 1.0)
    truth = extended_distance(origin[sound], direction[sound], np.zeros(3), 1.0)
    assert np.abs(found - truth).max() <= 64 * np.spacing(ratio)


def test_h21_a_sphere_as_large_as_the_ground() -> None:
    rng = np.random.default_rng(21)
    direction = rng.normal(size=(2000, 3))
    direction[:, 1] = -np.abs(direction[:, 1]) - 0.05
    direction = direction.astype(np.float32).astype(np.float64)
    origin = np.tile((0.0, 1.0, 0.0), (2000, 1))
    center = np.array((0.0, -1e6, 0.0))
    truth = extended_distance(origin, direction, center, 1e6)
    np.testing.assert_allclose(distances(origin, direction, center, 1e6), truth.astype(np.float64), rtol=1e-6)


def test_h22_on_in_and_beside_the_unit_sphere() -> None:
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
    for x in np.linspace(-1, 1, 21):
        for y in np.linspace(-1, 1, 21):
            inside = x * x + y * y
            hit = hit_distance(x, y, 3.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0) < math.inf
            assert hit == (inside <= 1.0) or abs(inside - 1.0) < 1e-15


def random_spheres(seed: int, count: int) -> tuple[Floats, Floats]:
    """Spheres of which some lie inside others, share a centre or coincide."""
    rng = np.random.default_rng(seed)
    center = rng.uniform(-3, 3, (count, 3))
    radius = 10 ** rng.uniform(-2, 0.5, count)
    same_center, same_sphere = rng.random(count) < 0.2, rng.random(count) < 0.1
    center[same_center | same_sphere] = center[:1]
    radius[same_sphere] = radius[:1]
    return center, radius


@given(st.integers(0, 2**32), st.integers(0, 200))
def test_the_tree_finds_what_trying_every_sphere_finds(seed: int, count: int) -> None:
    center, radius = random_spheres(seed, count)
    rng = np.random.default_rng(seed + 1)
    origin = rng.uniform(-5, 5, (16, 3))
    direction = rng.normal(size=(16, 3))
    direction[:6] = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (-0.0, -1, 0.0), (0, 0, 1), (0.0, -0.0, -1)]
    every = every_distance(center, radius, origin, direction)
    truth = every.min(axis=1, initial=math.inf)
    distance, found = nearest(tree_of(center, radius), origin, direction)
    np.testing.assert_array_equal(distance, truth.astype(np.float32))
    for ray in np.flatnonzero(found >= 0):
        assert every[ray, found[ray]] == truth[ray]


@given(st.integers(0, 2**32), st.integers(0, 60))
def test_shadows_of_spheres_are_what_trying_every_sphere_finds(seed: int, count: int) -> None:
    center, radius = random_spheres(seed, count)
    rng = np.random.default_rng(seed + 2)
    casts = (rng.random(count) < 0.5).astype(np.uint8)
    origin, direction = rng.uniform(-5, 5, (16, 3)), rng.normal(size=(16, 3))
    reach = rng.uniform(0.1, 6, 16).astype(np.float32)
    every = every_distance(center, radius, origin, direction)
    every[:, casts == 0] = math.inf
    blocked = np.zeros(16, np.uint8)
    blocked[3] = 1
    tree = tree_of(center, radius, casts)
    shade_spheres(tree, origin.astype(np.float32), direction.astype(np.float32), reach, blocked)
    truth = (every < reach[:, None]).any(axis=1)
    truth[3] = True
    np.testing.assert_array_equal(blocked, truth)


@pytest.mark.parametrize("zero", [0.0, -0.0])
@pytest.mark.parametrize("x", [1.0, -1.0, 0.0])
def test_h14_rays_along_the_faces_of_boxes(zero: float, x: float) -> None:
    """Columns of balls whose boxes share faces; the ray runs in such a face, where it just touches."""
    center = np.array([(2.0 * i, 2.0 * j, 0.0) for i in range(-3, 4) for j in range(4)])
    radius = np.ones(len(center))
    origin, direction = np.array([[x, -5.0, 0.0], [x, -5.0, 0.25]]), np.array([[zero, 1.0, zero]] * 2)
    truth = every_distance(center, radius, origin, direction).min(axis=1)
    distance, _ = nearest(tree_of(center, radius), origin, direction)
    np.testing.assert_array_equal(distance, truth.astype(np.float32))
    assert distance[0] == (4.0 if x == 0.0 else 5.0)


def test_a_hit_nearer_than_every_sphere_stays() -> None:
    tree = tree_of(np.zeros((1, 3)), np.ones(1))
    distance, primitive = np.array([1.5, 2.5], np.float32), np.array([7, 7], np.int32)
    origin, direction = np.float32([[0, 0, 3]] * 2), np.float32([[0, 0, -1]] * 2)
    nearest_spheres(tree, origin, direction, 100, distance, primitive)
    assert primitive.tolist() == [7, 100]
    assert distance.tolist() == [1.5, 2.0]


def test_small_spheres_far_from_each_other_are_all_found() -> None:
    """A tiny ball far out, where its box is a few float64 steps wide."""
    center = np.array([(1e6 + 17 * i, 0.0, 0.0) for i in range(40)])
    radius = np.full(40, 1e-9)
    origin, direction = center + (0, 1, 0), np.tile((0.0, -1.0, 0.0), (40, 1))
    _, found = nearest(tree_of(center, radius), origin, direction)
    np.testing.assert_array_equal(found, np.arange(40))


def test_no_sphere_at_all() -> None:
    distance, found = nearest(tree_of(np.zeros((0, 3)), np.zeros(0)), np.zeros((2, 3)), np.ones((2, 3)))
    assert (found == -1).all()
    assert np.isinf(distance).all()
