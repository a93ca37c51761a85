"""Closed meshes let no ray through: at random, and aimed at edges and at corners.

0 of N misses shows a rate below 3/N with 95 % confidence. Embree's own gate for random rays is 2e-5.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.embree import EmbreeTriangles
from renderer.kernel import kernel
from renderer.prepared import PreparedScene
from tests.renderer.drawing import icosphere
from tests.renderer.test_kernel import KERNELS
from tests.stability.shapes import Floats, prepared_mesh, ringed_ball, sheet, traced

BALLS = {9_800: (50, 100), 159_200: (200, 400)}
"""Rings and segments by the number of triangles."""

FAR = (148376.0, 1234.0, -223423.0)
"""Where Embree's own test puts its balls."""

MOST_SLIPPED = 0.03
"""Share of rays aimed at a corner that Embree's single search may miss: the README says up to 2 %."""


def missed(prepared: PreparedScene, origin: NDArray[np.float32], direction: NDArray[np.floating]) -> int:
    hits = prepared.intersector.nearest(origin, np.ascontiguousarray(direction, dtype=np.float32))
    return int((hits.primitive < 0).sum())


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), FAR], ids=["near", "far"])
@pytest.mark.parametrize("triangles", BALLS)
def test_h04_random_rays_from_inside_a_ball_all_hit(triangles: int, place: tuple[float, float, float]) -> None:
    """Embree, tutorials/verify/verify.cpp, WatertightTest: 400,000 rays, of which it lets 2e-5 through; here none."""
    vertices, faces = ringed_ball(*BALLS[triangles], 2.0)
    prepared = prepared_mesh(vertices + place, faces)
    assert prepared.intersector.triangles == triangles
    rng = np.random.default_rng(4)
    origin = traced(prepared, rng.uniform(-1, 1, (400_000, 3)) + place)
    assert missed(prepared, origin, rng.uniform(-1, 1, (400_000, 3))) == 0


def aimed_rays(
    prepared: PreparedScene, target: Floats, spread: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """From random places, up to `spread` from the origin along each axis, exactly at the tracer's `target`."""
    origin = traced(prepared, np.random.default_rng(6).uniform(-spread, spread, target.shape))
    return origin, traced(prepared, target) - origin


@pytest.mark.parametrize("unit", [False, True], ids=["as aimed", "unit length"])
@pytest.mark.parametrize("triangles", BALLS)
def test_h05_edge_and_vertex_aimed_rays_from_inside_a_ball_all_hit(triangles: int, unit: bool) -> None:
    """200,000 each (pbrt-v4, shapes_test.cpp, Watertight; its authors had to switch theirs off).

    Embree alone lets 0.3 to 2 % of those at vertices through (its issues 174, 181, 381), and none at edges.
    """
    vertices, faces = ringed_ball(*BALLS[triangles], 2.0)
    prepared = prepared_mesh(vertices, faces)
    alone = EmbreeTriangles(traced(prepared, vertices), faces.astype(np.int32), singly=True).yardstick
    rng = np.random.default_rng(5)
    face, share = faces[rng.integers(0, len(faces), 200_000)], rng.random((200_000, 1))
    for name, target in (
        ("edges", share * vertices[face[:, 0]] + (1 - share) * vertices[face[:, 1]]),
        ("vertices", vertices[rng.integers(0, len(vertices), 200_000)]),
    ):
        origin, direction = aimed_rays(prepared, target, 1.0)
        if unit:
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        slipped = (alone.run(origin, direction, None, "INTERSECT") < 0).mean()
        left = missed(prepared, origin, direction)
        print(f"{triangles:>9,} triangles, {name:<8}: Embree alone misses {slipped:.2e}, the tracer {left} of 200,000")
        assert slipped <= MOST_SLIPPED
        assert left == 0


def test_h05_vertex_aimed_rays_at_a_sheet_in_perspective_all_hit() -> None:
    """64x64 squares of side 0.1 and their 3,969 inner vertices: Embree alone loses a few of them."""
    vertices, faces = sheet(64, 6.4)
    prepared = prepared_mesh(vertices, faces)
    inner = vertices[(np.abs(vertices[:, :2]) < 3.19).all(axis=1)]
    assert len(inner) == 63 * 63
    for eye in ((0.0, 0.0, 8.0), (0.3, 0.2, 8.0), (-2.5, 1.7, 3.3), (9.0, 1.0, 0.5)):
        origin = np.tile(traced(prepared, eye), (len(inner), 1))
        assert missed(prepared, origin, traced(prepared, inner) - origin) == 0


def test_h05_vertex_aimed_rays_at_fans_all_hit() -> None:
    """100,000 rays at the tips of 1,000 uneven rings of 3 to 9 triangles (Woop, Benthin and Wald, JCGT 2(1), 2013):
    Moller and Trumbore's test misses 10.8 % of such rays in float32.
    """
    rng = np.random.default_rng(9)
    vertices: list[Floats] = []
    faces: list[NDArray[np.int64]] = []
    tips = 3.0 * np.stack(np.unravel_index(np.arange(1000), (10, 10, 10)), axis=1) + rng.uniform(0, 0.3, (1000, 3))
    for tip in tips:
        spokes = int(rng.integers(3, 10))
        angle = 2 * np.pi * (np.arange(spokes) + rng.uniform(0, 0.9, spokes)) / spokes
        ring = np.stack([np.cos(angle), np.sin(angle), rng.uniform(-0.4, 0.4, spokes)], axis=1)
        first, this = sum(map(len, vertices)), np.arange(spokes)
        vertices.append(np.concatenate([[tip], tip + rng.uniform(0.3, 1.0, (spokes, 1)) * ring]))
        faces.append(first + np.stack([0 * this, 1 + this, 1 + (this + 1) % spokes], axis=1))
    prepared = prepared_mesh(np.concatenate(vertices), np.concatenate(faces))
    target = np.repeat(tips, 100, axis=0)
    lean = np.stack([*rng.uniform(-0.5, 0.5, (2, len(target))), np.ones(len(target))], axis=1)
    origin = traced(prepared, target + rng.uniform(0.2, 1.0, (len(target), 1)) * lean)
    assert missed(prepared, origin, traced(prepared, target) - origin) == 0


def test_h05_what_still_slips_through_a_vertex_is_as_rare_as_stated() -> None:
    """Shadow rays, and rays that find the far side of a ball behind its vertex: of those aimed at one, at most 3 %."""
    vertices, faces = icosphere(5)
    prepared = prepared_mesh(vertices, faces)
    rng = np.random.default_rng(10)
    target = vertices[rng.integers(0, len(vertices), 200_000)]
    origin, direction = aimed_rays(prepared, target, 0.5)
    blocked = prepared.intersector.occluded(origin, direction, np.full(len(origin), 2, np.float32))
    outside = traced(prepared, 3.0 * target + rng.uniform(-0.5, 0.5, target.shape))
    direction = np.ascontiguousarray(traced(prepared, target) - outside)
    deep = prepared.intersector.nearest(outside, direction).distance > 1.0 + 1e-3
    print(
        f"aimed at a vertex: {(blocked == 0).mean():.2e} of shadow rays pass, {deep.mean():.2e} of others see behind it"
    )
    assert 0.0 < (blocked == 0).mean() <= MOST_SLIPPED
    assert 0.0 < deep.mean() <= MOST_SLIPPED


@pytest.mark.parametrize("apart", [4.0 * 2.0**-20, 1e-3])
def test_h05_looking_again_finds_nothing_where_nothing_is(apart: float) -> None:
    """Rays that pass the outline of a sheet, at a distance of one, by twice of what they are turned."""
    vertices, faces = sheet(8, 2.0)
    prepared = prepared_mesh(vertices, faces)
    along = np.linspace(-1, 1, 2001)
    out = np.full(2001, 1.0 + apart)
    target = np.concatenate(
        [np.stack(two, axis=1) for two in ((out, along), (-out, along), (along, out), (along, -out))]
    )
    target = np.concatenate([target, np.zeros((len(target), 1))], axis=1)
    for eye in ((0.0, 0.0, 1.0), (0.25, -0.5, 1.0)):
        origin = np.tile(np.float32(eye), (len(target), 1))
        assert missed(prepared, origin, target.astype(np.float32) - origin) == len(target)


@pytest.mark.parametrize("singly", [False, True], ids=["packets", "singly"])
def test_h06_a_shared_diagonal_has_no_gap(singly: bool) -> None:
    """Mitsuba 3, test_scene.py: a unit square turned by 90 degrees about (1, 1, 1), and 32x32 rays spread by the cosine
    at its middle; a search that is not robust misses 24 of the 1,024. Then 255 more at points of the diagonal.
    """
    # Rodrigues' formula for a right angle: the part along the axis stays, the rest turns into the cross product.
    axis = np.ones(3) / math.sqrt(3.0)
    turn = np.outer(axis, axis) + np.cross(np.eye(3), axis).T
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]) @ turn.T
    u, v = (part.ravel() for part in (np.mgrid[0:32, 0:32] + 0.5) / 32)
    radius, angle = np.sqrt(u), 2 * np.pi * v
    away = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - u)], axis=1) @ turn.T
    steps = np.linspace(0, 1, 257)[1:-1, None]
    diagonal = steps * square[1] + (1 - steps) * square[2]
    target = np.concatenate([np.tile(square.mean(axis=0), (1024, 1)), diagonal])
    origin = target + np.concatenate([away, np.tile(turn @ (0.3, 0.4, 2.0), (255, 1))])
    made = EmbreeTriangles(square.astype(np.float32), np.int32([[0, 1, 2], [1, 3, 2]]), singly=singly)
    origin, target = origin.astype(np.float32), target.astype(np.float32)
    found, _ = made.nearest(origin, target - origin)
    assert (found >= 0).all()


def test_h07_no_kernel_takes_liberties_with_numbers() -> None:
    """Fast mathematics assumes that there is no NaN, and fuses products: a third of all edge tests then differ."""
    assert len(KERNELS) > 20
    for name, compiled in KERNELS.items():
        options = compiled.targetoptions
        assert not options.get("fastmath"), name
        assert options["error_model"] == "numpy", name
        assert options["nogil"], name


@kernel
def areas(a: NDArray[np.float64], b: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(len(out)):
        out[i] = a[i, 0] * b[i, 1] - a[i, 1] * b[i, 0]


def test_h07_an_edge_seen_from_both_sides_is_the_same_edge() -> None:
    """1,000,000 random pairs, bit for bit: with fused products 33 % would differ."""
    rng = np.random.default_rng(7)
    a, b = rng.normal(size=(2, 1_000_000, 2))
    there, back = np.zeros(len(a)), np.zeros(len(a))
    areas(a, b, there)
    areas(b, a, back)
    np.testing.assert_array_equal(there, -back)
