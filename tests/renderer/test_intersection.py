"""What rays meet: against brute force, for shapes that must be refused, and where things touch."""

from __future__ import annotations

import threading

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.area_light import AREA_LIGHT
from renderer.intersection import Intersector
from renderer.sphere import build_sphere_tree
from tests.renderer.drawing import icosphere

Floats = NDArray[np.float64]

TRIANGLE = np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])


def intersector(
    vertices: NDArray[np.floating],
    faces: NDArray[np.integer],
    casts: NDArray[np.bool_] | None = None,
    spheres: tuple[tuple[float, float, float, float], ...] = (),
) -> Intersector:
    table = np.array(spheres, dtype=np.float64).reshape(-1, 4)
    k = len(table)
    tree = build_sphere_tree(table[:, :3], table[:, 3], np.zeros(k, np.int32), np.ones(k, np.uint8))
    every = np.ones(len(faces), np.bool_)
    return Intersector(
        vertices.astype(np.float32),
        faces.astype(np.int32).reshape(-1, 3),
        every if casts is None else casts,
        tree,
        np.zeros(0, dtype=AREA_LIGHT),
    )


def rays(origin: object, direction: object) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    return np.array(origin, np.float32).reshape(-1, 3), np.array(direction, np.float32).reshape(-1, 3)


def every_crossing(corners: Floats, origin: Floats, direction: Floats) -> tuple[Floats, Floats, Floats]:
    """Distance (infinite for a miss) and weights of every ray with every triangle (Moller and Trumbore 1997)."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction[:, None], ac)
    volume = (p * ab).sum(axis=2)
    away = origin[:, None] - a
    with np.errstate(all="ignore"):
        u = (away * p).sum(axis=2) / volume
        q = np.cross(away, ab)
        v = (direction[:, None] * q).sum(axis=2) / volume
        t = (ac * q).sum(axis=2) / volume
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return np.where(hit, t, np.inf), u, v


@given(st.integers(0, 2**32), st.integers(1, 40))
def test_the_nearest_hit_is_what_trying_every_triangle_finds(seed: int, triangles: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-1, 1, (3 * triangles, 3)).astype(np.float32)
    faces = np.arange(3 * triangles).reshape(-1, 3)
    origin, direction = rays(rng.uniform(-2, 2, (64, 3)), rng.normal(size=(64, 3)))
    t, u, v = every_crossing(
        vertices.astype(np.float64)[faces], origin.astype(np.float64), direction.astype(np.float64)
    )
    clear = (np.minimum(np.minimum(np.abs(u), np.abs(v)), np.abs(1 - u - v)) > 1e-4) | ~np.isfinite(u)
    first = np.sort(t, axis=1)
    alone = True if triangles == 1 else (first[:, 1] > first[:, 0] * (1 + 1e-4)) | np.isinf(first[:, 0])
    sure = clear.all(axis=1) & alone & (first[:, 0] > 1e-4)

    hits = intersector(vertices, faces).nearest(origin, direction)
    found = np.where(np.isinf(first[:, 0]), -1, t.argmin(axis=1))
    np.testing.assert_array_equal(hits.primitive[sure], found[sure])
    met = np.flatnonzero(sure & (found >= 0))
    # A distance inherits the absolute rounding of the coordinates, however near the hit.
    np.testing.assert_allclose(hits.distance[met], t[met, found[met]], rtol=1e-4, atol=1e-5)

    reach = rng.uniform(0.05, 3, 64).astype(np.float32)
    sure &= ~(np.abs(first[:, 0] - reach) < 1e-4 * reach)
    blocked = intersector(vertices, faces).occluded(origin, direction, reach.copy())
    np.testing.assert_array_equal(blocked[sure], (first[:, 0] < reach)[sure])


def test_no_rays_and_nothing_to_hit() -> None:
    empty, one = intersector(np.zeros((0, 3)), np.zeros((0, 3))), intersector(TRIANGLE, np.array([[0, 1, 2]]))
    none = np.zeros((0, 3), np.float32)
    for made in (empty, one):
        assert made.nearest(none, none).primitive.shape == (0,)
        assert made.occluded(none, none, np.zeros(0, np.float32)).shape == (0,)
    origin, direction = rays([(0, 0, 1)], [(0, 0, -1)])
    assert empty.nearest(origin, direction).primitive.tolist() == [-1]
    assert empty.occluded(origin, direction, np.float32([9])).tolist() == [0]


def test_only_what_lies_before_the_light_blocks_it() -> None:
    made = intersector(TRIANGLE, np.array([[0, 1, 2]]))
    origin, direction = rays([(0, 0, 2)] * 4, [(0, 0, -1)] * 3 + [(0, 0, 1)])
    assert made.occluded(origin, direction, np.float32([1.999, 2.001, 9, 9])).tolist() == [0, 1, 1, 0]


def test_what_casts_no_shadow_is_seen_but_blocks_nothing() -> None:
    """Two triangles in a row, of which only the second casts; the number of a hit is that of the triangle."""
    vertices = np.concatenate([TRIANGLE + np.float32([0, 0, 1]), TRIANGLE])
    made = intersector(vertices, np.arange(6).reshape(2, 3), np.array([False, True]))
    origin, direction = rays([(0, 0, 2), (0, 0, -1)], [(0, 0, -1), (0, 0, 1)])
    assert made.nearest(origin, direction).primitive.tolist() == [0, 1]
    assert made.occluded(origin, direction, np.float32([1.5, 1.5])).tolist() == [0, 1]
    ghost = intersector(TRIANGLE, np.array([[0, 1, 2]]), np.array([False]))
    assert ghost.nearest(origin, direction).primitive.tolist() == [0, 0]
    assert ghost.occluded(origin, direction, np.float32([9, 9])).tolist() == [0, 0]


def test_spheres_and_triangles_hide_each_other() -> None:
    """Spheres are numbered after the triangles; whichever is nearer is met."""
    made = intersector(TRIANGLE, np.array([[0, 1, 2]]), spheres=((0, 0, 1, 0.5),))
    origin, direction = rays([(0, 0, 5), (0, 0, -5), (0.9, -0.95, 5)], [(0, 0, -1), (0, 0, 1), (0, 0, -1)])
    hits = made.nearest(origin, direction)
    assert hits.primitive.tolist() == [1, 0, 0]
    assert hits.distance.tolist() == [3.5, 5.0, 5.0]
    assert made.occluded(origin, direction, np.float32([3.6, 4.9, 4.9])).tolist() == [1, 0, 0]
    assert made.occluded(origin, direction, np.float32([3.4, 5.1, 5.1])).tolist() == [0, 1, 1]


def test_many_threads_get_the_answers_that_one_gets() -> None:
    vertices, faces = icosphere(3)
    made = intersector(vertices, faces, spheres=((0, 0, 0, 0.5), (2, 0, 0, 0.3)))
    rng = np.random.default_rng(10)
    origin, direction = rays(rng.uniform(-2, 2, (20_000, 3)), rng.normal(size=(20_000, 3)))
    truth = made.nearest(origin, direction)
    answers = [truth] * 6

    def ask(slot: int) -> None:
        answers[slot] = made.nearest(origin, direction)

    threads = [threading.Thread(target=ask, args=(slot,)) for slot in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for answer in answers:
        np.testing.assert_array_equal(answer.primitive, truth.primitive)
        met = truth.primitive >= 0
        np.testing.assert_array_equal(answer.distance[met], truth.distance[met])


def test_the_order_of_the_rays_changes_no_answer() -> None:
    vertices, faces = icosphere(3)
    made = intersector(vertices, faces)
    rng = np.random.default_rng(11)
    origin, direction = rays(rng.uniform(-2, 2, (5000, 3)), rng.normal(size=(5000, 3)))
    order = rng.permutation(5000)
    straight, shuffled = made.nearest(origin, direction), made.nearest(origin[order], direction[order])
    np.testing.assert_array_equal(straight.primitive[order], shuffled.primitive)
    np.testing.assert_array_equal(straight.distance[order], shuffled.distance)


def test_thousands_of_scenes_can_be_held_at_once() -> None:
    many = [intersector(TRIANGLE + np.float32(i), np.array([[0, 1, 2]])) for i in range(3000)]
    for i in (0, 1500, 2999):
        origin, direction = rays([(i, i, i + 2)], [(0, 0, -1)])
        assert many[i].nearest(origin, direction).distance.tolist() == [2.0]
