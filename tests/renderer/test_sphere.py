"""Spheres: the distance of a hit against extended precision, and the tree against trying every sphere."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.rays import columns
from renderer.sphere import SphereTree, build_sphere_tree, hit_distance, make_stack, nearest_spheres, shade_spheres

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
    rays = columns(origin.astype(np.float32), direction.astype(np.float32))
    nearest_spheres(tree, make_stack(), *rays, 0, distance, primitive)
    found = primitive >= 0
    primitive[found] = tree.material[primitive[found]]
    return distance, primitive


def every_distance(center: Floats, radius: Floats, origin: Floats, direction: Floats) -> Floats:
    """(rays, spheres) distances, each sphere tried."""
    rays = np.concatenate([origin, direction], axis=1).astype(np.float32).astype(np.float64)
    spheres = np.concatenate([center.reshape(-1, 3), radius[:, None]], axis=1)
    table = [[hit_distance(*ray, *sphere) for sphere in spheres] for ray in rays]
    return np.array(table, dtype=np.float64).reshape(len(rays), len(spheres))


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


@given(st.integers(0, 2**32), st.integers(1, 80))
def test_a_ray_meets_the_same_sphere_whatever_goes_beside_it(seed: int, count: int) -> None:
    """Of spheres that coincide too: in any order of the rays, and each of them alone."""
    center, radius = random_spheres(seed, count)
    tree = tree_of(center, radius)
    rng = np.random.default_rng(seed + 3)
    origin, direction = rng.uniform(-5, 5, (40, 3)), rng.normal(size=(40, 3))
    origin[:8] = center[:1] + (0, 0, 9)
    direction[:8] = (0, 0, -1)
    distance, found = nearest(tree, origin, direction)
    order = rng.permutation(40)
    for some in (order, *np.arange(40).reshape(-1, 1)):
        at, met = nearest(tree, origin[some], direction[some])
        np.testing.assert_array_equal(met, found[some])
        np.testing.assert_array_equal(at, distance[some])


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
    shade_spheres(tree, make_stack(), *columns(origin.astype(np.float32), direction.astype(np.float32)), reach, blocked)
    truth = (every < reach[:, None]).any(axis=1)
    truth[3] = True
    np.testing.assert_array_equal(blocked, truth)


def test_a_hit_nearer_than_every_sphere_stays() -> None:
    tree = tree_of(np.zeros((1, 3)), np.ones(1))
    distance, primitive = np.array([1.5, 2.5], np.float32), np.array([7, 7], np.int32)
    origin, direction = np.float32([[0, 0, 3]] * 2), np.float32([[0, 0, -1]] * 2)
    nearest_spheres(tree, make_stack(), *columns(origin, direction), 100, distance, primitive)
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
