"""Rays that leave a surface do not meet it again, and rays to a light do not meet what the light hangs on.

0 of N shows a rate below 3/N with 95 % confidence. `pytest -rP` shows the table beside those of other rules.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.kernel import kernel
from renderer.pipeline import Renderer
from renderer.prepared import NORMAL_COLUMN, PreparedScene
from renderer.scene import Material, Mesh, Rgb, Scene, Sphere
from renderer.surface import triangle_surface, weights_at
from tests.renderer.drawing import BLACK, WHITE_LAMBERT, aim, ball_mesh, floor, light, pixel, shoot
from tests.stability.shapes import Floats, directions, prepared_mesh, rotation

SPREAD, LONE, EACH = 50_000, 50, 1000
"""Triangles of a row, spread out in one scene or each in a scene of its own, and how many rays leave each of the latter
on either side."""

MOST_OFFSET = 16.0 * 2.0**-23
"""Largest offset, in largest coordinates of the triangle: a larger one would let light through thin walls."""

ROWS = {
    (0.0, 1.0): ("44 %", "0 (1e-4)", "0 (1e-5)", "1.1e-3 (4e-7)", "0 (2e-4)", "3.7e-4 (5e-7)"),
    (1e3, 1.0): ("50 %", "6.7e-4", "0 (1e-2)", "0 (4e-4)", "0 (7e-2)", "0 (4e-4)"),
    (1e5, 1.0): ("49 %", "49 %", "0 (1.0)", "0 (4e-2)", "0 (7)", "0 (4e-2)"),
    (10.0, 1e-3): ("50 %", "0 (0.1)", "0 (0.1)", "0 (4e-3)", "0 (0.8)", "0 (4e-3)"),
    (0.0, 1e-6): ("44 %", "0 (100)", "0 (20)", "5e-4", "0 (90)", "4e-4 (5e-7)"),
    (0.0, 1e7): ("44 %", "44 %", "0", "9e-4", "0", "3e-4"),
}
"""Share of 100,000 rays that meet their own triangle again (offset in sizes s) under other rules, for triangles of size
s around a point at distance c: no offset, 1e-4, integer offset (Waechter and Binder, Ray Tracing Gems, 2019,
ch. 6), 4 steps of |p|, 1500 roundings (Mitsuba 3), error bounds (pbrt-v4, ray.h; Physically Based Rendering, 4th ed.,
6.8)."""

HEADS = ("c", "s", "none", "fixed 1e-4", "integer", "4 ulp", "Mitsuba", "pbrt", "gazetrace", "its offset / s")


def scenes_of(distance: float, size: float) -> Iterator[tuple[PreparedScene, NDArray[np.int32]]]:
    """Triangles of random shape as in pbrt-v4's shapes_test.cpp, Reintersect, and those that rays are to leave.

    Scenes are centred before they are traced, so a distance counts only where the triangles share a scene.
    """
    rng = np.random.default_rng(1)
    if distance == 0.0:
        for _ in range(LONE):
            yield prepared_mesh(size * rng.normal(size=(3, 3)), np.arange(3)), np.zeros(EACH, np.int32)
        return
    corners = distance * directions(rng, SPREAD)[:, None] + size * rng.normal(size=(SPREAD, 3, 3))
    prepared = prepared_mesh(corners.reshape(-1, 3), np.arange(3 * SPREAD))
    yield prepared, np.arange(prepared.intersector.triangles, dtype=np.int32)


@kernel
def leave(
    facets: NDArray[np.float32],
    triangle: NDArray[np.int32],
    weights: NDArray[np.float64],
    coming: NDArray[np.float64],
    behind: bool,
    origin: NDArray[np.float32],
    offset: NDArray[np.float64],
) -> None:
    """Where rays start that leave their triangles at barycentric `weights`, on the side of the eye or `behind`."""
    for ray in range(len(triangle)):
        s = triangle_surface(
            facets, triangle[ray], weights[ray, 0], weights[ray, 1], coming[ray, 0], coming[ray, 1], coming[ray, 2]
        )
        away = -s.offset if behind else s.offset
        origin[ray, 0] = s.px + away * s.gx
        origin[ray, 1] = s.py + away * s.gy
        origin[ray, 2] = s.pz + away * s.gz
        offset[ray] = s.offset


@kernel
def weigh(
    facets: NDArray[np.float32],
    triangle: NDArray[np.int32],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> None:
    """Barycentric weights where rays meet their triangles."""
    for ray in range(len(triangle)):
        weights[ray, 0], weights[ray, 1] = weights_at(
            facets, triangle[ray], origin[ray, 0], origin[ray, 1], origin[ray, 2],
            direction[ray, 0], direction[ray, 1], direction[ray, 2],
        )  # fmt: skip


def met_again(
    prepared: PreparedScene, triangle: NDArray[np.int32], weights: Floats, coming: Floats, rng: np.random.Generator
) -> tuple[int, Floats]:
    """How many of the rays that leave triangles on both sides, in random directions, meet them; their offsets."""
    facets = prepared.surfaces.facets
    normal = facets[triangle, NORMAL_COLUMN : NORMAL_COLUMN + 3].astype(np.float64)
    facing = -np.sign((coming * normal).sum(axis=1, keepdims=True))
    origin, offset, again = np.zeros((len(triangle), 3), np.float32), np.zeros(len(triangle)), 0
    for behind in (False, True):
        leave(facets, triangle, weights, coming, behind, origin, offset)
        out = directions(rng, len(triangle))
        side = (-facing if behind else facing) * np.sign((out * normal).sum(axis=1, keepdims=True))
        hits = prepared.intersector.nearest(origin, (side * out).astype(np.float32))
        again += int((hits.primitive == triangle).sum())
    return again, offset


def test_h01_a_spawned_ray_never_hits_its_own_triangle() -> None:
    """0 of 100,000 in every row, and no offset beyond what leaves thin walls closed."""
    print(" | ".join(f"{head:>13}" for head in HEADS))
    total = 0
    for (distance, size), others in ROWS.items():
        rng = np.random.default_rng(2)
        again = count = 0
        shares = []
        for prepared, triangle in scenes_of(distance, size):
            facets = prepared.surfaces.facets
            weights = rng.dirichlet((1, 1, 1), len(triangle))[:, 1:]
            met, offset = met_again(prepared, triangle, weights, directions(rng, len(triangle)), rng)
            corners = np.abs(facets[triangle, :24].reshape(-1, 3, 8)[:, :, :3]).max(axis=(1, 2))
            assert (offset <= MOST_OFFSET * corners).all()
            again, count = again + met, count + 2 * len(triangle)
            shares.append(float(np.median(offset)) / (size * prepared.scale))
        assert count >= 99_000
        row = (f"{distance:g}", f"{size:g}", *others, f"{again} of {count:,}", f"{np.median(shares):.0e}")
        print(" | ".join(f"{cell:>13}" for cell in row))
        total += again
    assert total == 0


@pytest.mark.parametrize("away", [10.0, 1e4])
@pytest.mark.parametrize("row", ROWS, ids=str)
def test_h02_a_ray_that_came_from_far_leaves_its_triangle(row: tuple[float, float], away: float) -> None:
    """The whole way through Embree, as shading goes it: found from `away` sizes, weights, surface, leaving ray.

    From origin + t * direction instead, 0.2 % of rays that came from 10 sizes away would meet their triangle again.
    """
    _, size = row
    rng = np.random.default_rng(3)
    again = count = 0
    for prepared, triangle in scenes_of(*row):
        facets = prepared.surfaces.facets
        corners = facets[triangle, :24].reshape(-1, 3, 8)[:, :, :3].astype(np.float64)
        middle = np.einsum("ij,ijk->ik", rng.dirichlet((1, 1, 1), len(triangle)), corners)
        start = middle - away * size * prepared.scale * directions(rng, len(triangle))
        origin = start.astype(np.float32)
        coming = (middle - origin).astype(np.float32)
        hits = prepared.intersector.nearest(origin, coming)
        seen = hits.primitive >= 0
        found, start, ways = hits.primitive[seen], origin[seen].astype(np.float64), coming[seen].astype(np.float64)
        weights = np.zeros((len(found), 2))
        weigh(facets, found, start, ways, weights)
        met, _ = met_again(prepared, found, weights, ways, rng)
        again, count = again + met, count + 2 * len(found)
    assert count > 50_000
    assert again == 0


def test_h02_nothing_else_stands_near_a_lone_triangle() -> None:
    """Any-hit searches, without a limit, for rays that leave 200 lone triangles: 0 of 100,000 are blocked."""
    rng = np.random.default_rng(4)
    for size in 10.0 ** rng.uniform(-8, 8, 200):
        prepared = prepared_mesh(size * (rng.normal(size=(3, 3)) + 100.0 * rng.normal(size=3)), np.arange(3))
        triangle = np.zeros(250, np.int32)
        weights = rng.dirichlet((1, 1, 1), 250)[:, 1:]
        coming, origin, offset = directions(rng, 250), np.zeros((250, 3), np.float32), np.zeros(250)
        normal = prepared.surfaces.facets[0, NORMAL_COLUMN : NORMAL_COLUMN + 3].astype(np.float64)
        facing = -np.sign(coming @ normal)[:, None]
        for behind in (False, True):
            leave(prepared.surfaces.facets, triangle, weights, coming, behind, origin, offset)
            out = directions(rng, 250)
            out *= (-facing if behind else facing) * np.sign(out @ normal)[:, None]
            reach = np.full(250, 3e38, np.float32)
            assert not prepared.intersector.occluded(origin, out.astype(np.float32), reach).any()


def moved(mesh: Mesh, factor: float, offset: Rgb = (0, 0, 0)) -> Mesh:
    return dataclasses.replace(mesh, vertices=factor * mesh.vertices + np.array(offset, dtype=np.float64))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("away", [0.0, 1e3])
@pytest.mark.parametrize("kind", ["flat", "smooth", "sphere"])
def test_h01_a_convex_body_casts_no_shadow_on_itself(renderer: Renderer, size: float, away: float, kind: str) -> None:
    """The picture is the same whether it casts shadows or not, but where the light only grazes."""
    offset = (away * size, -away * size, 0.0)
    camera = Camera(tuple(np.add((0, 0, 5 * size), offset)), offset, vertical_fov_deg=25)
    lights = (light(*np.add((4 * size, 3 * size, 5 * size), offset), math.pi * 50 * size * size),)
    pictures = []
    for casts in (False, True):
        if kind == "sphere":
            scene = Scene(spheres=(Sphere(offset, size, WHITE_LAMBERT, casts),), lights=lights)
        else:
            mesh = moved(ball_mesh(WHITE_LAMBERT, 3, kind == "smooth", casts), size, offset)
            scene = Scene(meshes=(mesh,), lights=lights)
        pictures.append(shoot(renderer, scene, 128, 128, camera=camera).pixels[..., 0])
    assert (pictures[0] > 0.1).mean() > 0.3
    grazing = pictures[0] < 1e-5
    np.testing.assert_array_equal(pictures[1][~grazing], pictures[0][~grazing])


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e5])
def test_h03_a_shadow_ray_does_not_hit_the_emitter_its_light_is_on(renderer: Renderer, offset: float) -> None:
    """40 lights on a turned triangle, 4,096 places below: 163,840 shadow rays, none of them blocked by the triangle.

    If they reached all the way to the light, 75 % would be, and half of them still at 1,000 if they ended 4 roundings
    before it.
    """
    rng = np.random.default_rng(3)
    turn, place = rotation(rng), np.full(3, offset)
    corners = np.array([(-1.0, 5.0, -1.0), (1.0, 5.0, -1.0), (0.0, 5.0, 1.0)])
    plate = Mesh(corners @ turn.T + place, np.array([[0, 1, 2]]), Material(diffuse=BLACK))
    ground = floor(WHITE_LAMBERT, 0.0, 1.0)
    ground = dataclasses.replace(ground, vertices=ground.vertices @ turn.T + place)
    lights = tuple(light(*(weights @ plate.vertices), 1.0) for weights in rng.dirichlet((1, 1, 1), 40))
    eye, middle, north = (turn @ point + place for point in ((0.0, 4.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    camera = Camera(tuple(eye), tuple(middle), tuple(north - place), vertical_fov_deg=24)
    bare, under = (
        shoot(renderer, Scene(meshes=(ground, hung), lights=lights), 64, 64, camera=camera)
        for hung in (dataclasses.replace(plate, casts_shadows=False), plate)
    )
    assert under.cost.rays.shadow == 40 * 64 * 64
    assert (bare.pixels > 0).all()
    np.testing.assert_array_equal(under.pixels, bare.pixels)


@pytest.mark.parametrize("gap", [1e-3, 1e-4])
def test_h03_a_blocker_just_before_the_light_or_the_floor_blocks(renderer: Renderer, gap: float) -> None:
    for height in (gap, 2.0 - gap):
        roof = floor(WHITE_LAMBERT, height, 1.0)
        camera = aim((0, height / 2, 0), (0, 0, 0))
        assert pixel(renderer, Scene(meshes=(floor(WHITE_LAMBERT), roof), lights=(light(0, 2, 0),), camera=camera)) == 0
