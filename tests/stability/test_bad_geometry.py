"""Triangles without area or number, copies, faces in one plane, wrong indices, and rays that are no rays."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.area_light import area_light_table
from renderer.camera import Camera
from renderer.embree import EmbreeTriangles
from renderer.errors import SceneError
from renderer.intersection import Intersector
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.rays import vectors_of
from renderer.scene import Material, Mesh, RectangleLight, Scene
from renderer.sphere import build_sphere_tree
from tests.renderer.drawing import BLACK, WHITE, WHITE_LAMBERT, icosphere, lamp, light, shoot
from tests.renderer.model_files import SQUARE, load, refused
from tests.renderer.test_intersection import every_crossing, intersector, rays
from tests.stability.shapes import directions, sheet

TRIANGLE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
FRONT = Camera((0, 0, 4), (0, 0, 0))


def triangles(corners: object, material: Material = WHITE_LAMBERT) -> Mesh:
    vertices = np.array(corners, dtype=np.float64).reshape(-1, 3)
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), material)


# without area

LINE = [(-1113.45459, y, -56.2431908) for y in (-79.049614, -87.0922699, -79.2090149)]
DEGENERATE = {
    "a point": [(1, 1, 1)] * 3,
    "a line": [(-1, 0, 1), (0, 0, 1), (1, 0, 1)],
    "two equal corners": [(0, 0, 0), (0, 0, 0), (1, 2, 3)],
    "a line askew": LINE,
}


@pytest.mark.parametrize("corners", DEGENERATE.values(), ids=DEGENERATE.keys())
def test_h08_a_triangle_without_area_is_left_out(corners: list[tuple[float, float, float]]) -> None:
    middle = np.mean(corners, axis=0)
    prepared = prepare(Scene(meshes=(triangles(corners, lamp()), triangles(TRIANGLE + middle - (0, 0, 2)))))
    assert prepared.intersector.triangles == 1


@pytest.mark.parametrize("singly", [False, True], ids=["packets", "singly"])
@pytest.mark.parametrize("corners", DEGENERATE.values(), ids=DEGENERATE.keys())
def test_h08_the_search_itself_never_hits_one(corners: list[tuple[float, float, float]], singly: bool) -> None:
    """The ray of pbrt-v4's shapes_test.cpp, BadCases, with its limit, and 1,000 at points of each line."""
    made = EmbreeTriangles(np.array(corners, np.float32), np.int32([[0, 1, 2]]), singly=singly)
    rng = np.random.default_rng(8)
    target = rng.dirichlet((1, 1, 1), 1000) @ np.array(corners)
    origin = np.concatenate([target + 10 * directions(rng, 1000), [(-1081.47925, 99.9999542, 87.7701111)]])
    direction = np.concatenate([target - origin[:-1], [(-32.1072998, -183.355865, -144.607635)]])
    origin, direction = rays(origin, direction)
    assert (made.nearest(origin, direction)[0] == -1).all()
    blocked = np.zeros(1001, np.uint8)
    made.occluded(origin, direction, np.full(1001, 0.9999, np.float32), blocked)
    assert not blocked.any()


def test_h08_neighbours_of_a_triangle_without_area_are_unchanged(renderer: Renderer) -> None:
    good = triangles(TRIANGLE)
    bad = triangles([*TRIANGLE, (0, 0, 0), (0, 0, 0), (0, 0.5, 0), (-1, 0, 0), (0, 0, 0), (1, 0, 0)])
    lights = (light(1, 2, 3, 9.0),)
    alone = shoot(renderer, Scene(meshes=(good,), lights=lights, camera=FRONT), 32, 32)
    among = shoot(renderer, Scene(meshes=(bad,), lights=lights, camera=FRONT), 32, 32)
    np.testing.assert_array_equal(alone.pixels, among.pixels)


def test_h08_a_face_that_names_a_corner_twice(renderer: Renderer, tmp_path: Path) -> None:
    """OBJ `f 1 1 2`, with normals to be averaged over its corners: the picture is that of the good face."""
    pictures = []
    for faces in ("f 1 2 3\n", "f 1 1 2\nf 1 2 3\nf 2 2 2\n"):
        meshes = load(tmp_path, "a.obj", SQUARE + "s 1\n" + faces)
        camera = Camera((0.5, 0.5, 3), (0.5, 0.5, 0))
        frame = shoot(renderer, Scene(meshes=meshes, lights=(light(1, 2, 3, 9.0),), camera=camera), 32, 32)
        assert frame.cost.rejected_samples.total == 0
        pictures.append(frame.pixels)
    assert (pictures[0] > 0).any()
    np.testing.assert_array_equal(pictures[1], pictures[0])


# not a number, or far too large a one

BAD_CORNERS = {
    "all NaN": np.full((3, 3), np.nan),
    "one NaN": np.array([(0, 0, 1), (1, np.nan, 1), (0, 1, 1)]),
    "one infinity": np.array([(0, 0, 1), (1, -np.inf, 1), (0, 1, 1)]),
    "3e38": 3e38 * (TRIANGLE + (0, 0, 1)) / 2,
    "1e30": 1e30 * (TRIANGLE + (0, 0, 1)),
}


@pytest.mark.parametrize("corners", BAD_CORNERS.values(), ids=BAD_CORNERS.keys())
def test_h09_vertices_that_are_no_places_are_refused(corners: NDArray[np.float64]) -> None:
    with pytest.raises(SceneError, match=r"vertex [345]: expected finite coordinates up to 1e\+12 m, found"):
        triangles(np.concatenate([TRIANGLE, corners]))


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e999", "3e38", "1e30"])
def test_h09_the_file_and_the_line_are_named(tmp_path: Path, number: str) -> None:
    text = f"v 0 0 0\nv 1 0 0\n# a line between\nv {number} 1 0\nf 1 2 3\n"
    assert refused(tmp_path, "a.obj", text).startswith("a.obj: line 4: v: expected finite coordinates")


@pytest.mark.parametrize("singly", [False, True], ids=["packets", "singly"])
def test_h09_such_triangles_would_not_touch_the_others(singly: bool) -> None:
    """Should one reach the search all the same (Embree, verify.cpp, GarbageGeometry): 20,000 rays meet one good
    triangle as if it were alone. The last set is 10,000 triangles of random bits, each with a part that is not finite.
    """
    rng = np.random.default_rng(9)
    garbage = rng.integers(0, 2**32, (10_000, 3, 3), dtype=np.uint32)
    garbage[np.arange(10_000), rng.integers(0, 3, 10_000), rng.integers(0, 3, 10_000)] |= np.uint32(0x7F800000)
    origin, direction = rays(rng.uniform(-1.5, 1.5, (20_000, 3)) + (0, 0, 3), rng.normal(size=(20_000, 3)) - (0, 0, 2))
    good = TRIANGLE.astype(np.float32)
    truth, distance = EmbreeTriangles(good, np.int32([[0, 1, 2]]), singly=singly).nearest(origin, direction)
    assert 1000 < (truth == 0).sum() < 19_000
    with np.errstate(over="ignore"):
        others = [corners.astype(np.float32) for corners in BAD_CORNERS.values()][:3]
    denormal = np.float32([(0, 0, 1), (1e-40, 0, 1), (0, 1e-40, 1)])
    for bad in (*others, denormal, garbage.view(np.float32).reshape(-1, 3)):
        vertices = np.concatenate([good, bad])
        made = EmbreeTriangles(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3), singly=singly)
        found, length = made.nearest(origin, direction)
        np.testing.assert_array_equal(found, truth)
        np.testing.assert_array_equal(length, distance)


# indices and shapes


@pytest.mark.parametrize("index", [-1, 3, 2**31, 2**32, -(2**63)])
def test_h10_indices_out_of_range_are_refused(index: int) -> None:
    with pytest.raises(SceneError, match=rf"face 1: expected vertex indices from 0 to 2, found \[0, 1, {index}\]"):
        Mesh(TRIANGLE, np.array([[0, 1, 2], [0, 1, index]], dtype=np.int64), WHITE_LAMBERT)


@pytest.mark.parametrize(("index", "found"), [("0", "0"), ("5", "5"), ("-5", "-5"), ("2147483648", "2147483648")])
def test_h10_a_file_with_such_an_index_is_refused(tmp_path: Path, index: str, found: str) -> None:
    message = refused(tmp_path, "a.obj", SQUARE + f"f 1 2 3\nf 1 2 {index}\n")
    assert message.startswith("a.obj: line 6: f: expected")
    assert found in message


@pytest.mark.parametrize(
    ("origin", "direction"),
    [
        (np.zeros((4, 3), np.float32), np.ones((3, 3), np.float32)),
        (np.zeros((4, 3), np.float32), np.ones((1, 3), np.float32)),
        (np.zeros((4, 3), np.float64), np.ones((4, 3), np.float64)),
        (np.zeros((4, 3), np.float32), np.ones((4, 3), np.float64)),
        (np.zeros((3, 4), np.float32), np.ones((3, 4), np.float32)),
        (np.zeros(3, np.float32), np.ones(3, np.float32)),
    ],
)
def test_h10_rays_of_a_wrong_shape_are_refused(origin: NDArray[np.float32], direction: NDArray[np.float32]) -> None:
    """embreex would read outside the arrays."""
    made = intersector(TRIANGLE, np.array([[0, 1, 2]]))
    with pytest.raises(ValueError, match="expected"):
        made.nearest(origin, direction)
    with pytest.raises(ValueError, match="expected"):
        made.occluded(origin, direction, np.ones(len(origin), np.float32))


@pytest.mark.parametrize("singly", [False, True])
def test_h10_rays_may_lie_in_memory_as_they_like(singly: bool) -> None:
    rng = np.random.default_rng(8)
    vertices, faces = rng.uniform(-1, 1, (300, 3)).astype(np.float32), np.arange(300, dtype=np.int32).reshape(-1, 3)
    made = EmbreeTriangles(vertices, faces, singly=singly)
    origin, direction = (rng.uniform(-1, 1, (100, 3)).astype(np.float32) for _ in range(2))
    found, distance = made.nearest(origin, direction)
    assert 0 < (found >= 0).sum() < 100
    for order in (np.asfortranarray, lambda rows: np.repeat(rows, 2, axis=0)[::2], vectors_of):
        again, length = made.nearest(order(origin), order(direction))
        np.testing.assert_array_equal(again, found)
        np.testing.assert_array_equal(length, distance)


def test_h10_a_reach_of_a_wrong_shape_is_refused() -> None:
    made = intersector(TRIANGLE, np.array([[0, 1, 2]]))
    for reach in (np.ones(1, np.float32), np.ones(2), np.ones((2, 1), np.float32)):
        with pytest.raises(AssertionError):
            made.occluded(*rays([(0, 0, 1)] * 2, [(0, 0, -1)] * 2), reach)


# in the same place


@pytest.mark.parametrize("count", [1000, 100_000])
def test_h11_copies_of_a_triangle_count_once_and_cost_nothing(renderer: Renderer, count: int) -> None:
    """Under two seconds of processor time, where 100,000 copies in the tree would take 4 s for these 4,096 rays."""
    copies = np.tile(TRIANGLE, (count, 1))
    lights = (light(1, 2, 3, 9.0),)
    alone = shoot(renderer, Scene(meshes=(triangles(TRIANGLE),), lights=lights, camera=FRONT), 64, 64)
    began = time.process_time()
    many = prepare(Scene(meshes=(triangles(copies),), lights=lights, camera=FRONT))
    seen = shoot(renderer, many, 64, 64)
    assert time.process_time() - began < 2.0
    assert many.intersector.triangles == 1
    np.testing.assert_array_equal(seen.pixels, alone.pixels)


def test_h11_the_first_of_equal_triangles_is_kept(renderer: Renderer) -> None:
    red, green = Material(diffuse=BLACK, emission=(1, 0, 0)), Material(diffuse=BLACK, emission=(0, 1, 0))
    for first, second, colour in ((red, green, (1, 0, 0)), (green, red, (0, 1, 0))):
        both = (triangles(TRIANGLE, first), triangles(TRIANGLE + 0.0, second))
        seen = shoot(renderer, Scene(meshes=both, camera=FRONT), 9, 9)
        assert seen.pixels[4, 4].tolist() == list(colour)


def test_h11_minus_zero_is_zero() -> None:
    assert prepare(Scene(meshes=(triangles(TRIANGLE), triangles(TRIANGLE * (1, 1, -1))))).intersector.triangles == 1


def test_h11_triangles_that_differ_in_one_corner_are_both_kept() -> None:
    other = TRIANGLE.copy()
    other[2, 1] += 1e-6
    assert prepare(Scene(meshes=(triangles(TRIANGLE), triangles(other)))).intersector.triangles == 2


RED, GREEN = (Material(diffuse=BLACK, emission=colour) for colour in ((1, 0, 0), (0, 1, 0)))


@pytest.mark.parametrize("first", ["triangle", "square"])
def test_h12_of_two_faces_in_one_plane_the_first_is_seen(renderer: Renderer, first: str) -> None:
    """Where rounding gives both one distance the lower number wins; here it does everywhere, looking straight on."""
    square = Mesh(np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]]), RED)
    meshes = (square, triangles(TRIANGLE, GREEN))
    scene = Scene(meshes=meshes if first == "square" else meshes[::-1], camera=Camera((0, 0, 4), (0, 0, 0), (0, 1, 0)))
    seen = shoot(renderer, scene, 33, 33).pixels
    assert seen[16, 16].tolist() == ([1, 0, 0] if first == "square" else [0, 1, 0])
    assert set(map(tuple, seen.reshape(-1, 3).tolist())) <= {(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)}
    if first == "square":
        assert not seen[..., 1].any()


def test_h12_faces_in_one_plane_show_one_of_them_always_the_same(renderer: Renderer) -> None:
    """A grid twice, the second time shuffled, divided the other way and of another colour: any winner, one a pixel,
    and the same in every run, on any number of threads, for a part of the picture and in any order of the rays.
    """
    vertices, one = sheet(16, 16.0)
    two = np.random.default_rng(12).permutation(one)
    meshes = (Mesh(vertices, one, RED), Mesh(vertices * (-1, 1, 1), two, GREEN))
    scene = Scene(meshes=meshes, camera=Camera((0.3, -0.2, 30), (0, 0, 0)))
    prepared = prepare(scene)
    seen = shoot(renderer, prepared, 64, 64).pixels
    assert set(map(tuple, seen.reshape(-1, 3).tolist())) <= {(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)}
    for threads in (1, 3):
        fresh = Renderer(threads=threads)
        np.testing.assert_array_equal(shoot(fresh, scene, 64, 64).pixels, seen)
        fresh.close()
    rng = np.random.default_rng(13)
    target = np.concatenate([rng.uniform(-1, 1, (4000, 2)), rng.integers(-8, 9, (4000, 2)) / 8])
    origin = np.tile(np.float32([0.3, -0.2, 3.0]), (8000, 1))
    direction = np.concatenate([target, np.zeros((8000, 1))], axis=1).astype(np.float32) - origin
    straight = prepared.intersector.nearest(origin, direction).primitive
    order = rng.permutation(8000)
    np.testing.assert_array_equal(prepared.intersector.nearest(origin, direction[order]).primitive, straight[order])


# rays that are no rays

NUMBERS = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1e38, 1e-38, 1e-45)
REACHES = {np.nan: False, -1.0: False, 0.0: False, np.inf: True}


def bad_rays() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """4,000 good rays, then each of them with one part replaced by each of NUMBERS, and with the direction 0."""
    rng = np.random.default_rng(13)
    good = np.concatenate([rng.uniform(-2, 2, (4000, 3)), rng.normal(size=(4000, 3))], axis=1).astype(np.float32)
    bad = [good]
    for number in NUMBERS:
        changed = good.copy()
        changed[np.arange(4000), rng.integers(0, 6, 4000)] = number
        bad.append(changed)
    still = good.copy()
    still[:, 3:] = 0.0
    both = np.concatenate([*bad, still])
    return np.ascontiguousarray(both[:, :3]), np.ascontiguousarray(both[:, 3:])


@pytest.mark.parametrize("shape", ["triangles", "spheres", "lights"])
def test_h13_rays_with_parts_that_are_no_numbers(shape: str) -> None:
    """A miss, or a hit that is there in float64; never a hang. Rays beside them meet what they meet alone.

    The tracer makes no such ray: cameras and meshes are finite and bounded, and directions have a length.
    """
    vertices, faces = icosphere(2)
    center, radius = np.array([(0.2, 0, 0), (1, 1, -1)]), np.array([0.9, 0.5])
    tree = build_sphere_tree(center, radius, np.zeros(2, np.int32), np.ones(2, np.uint8))
    none = build_sphere_tree(center[:0], radius[:0], np.zeros(0, np.int32), np.zeros(0, np.uint8))
    rectangle = RectangleLight((-1, 0, -1), (2, 0, 0), (0, 0, 2), WHITE, two_sided=True)
    table = area_light_table([rectangle], [], np.zeros(3), 1.0, False)
    some = faces.astype(np.int32) if shape == "triangles" else faces[:0].astype(np.int32)
    made = Intersector(
        vertices.astype(np.float32), some, np.ones(len(some), np.bool_),
        tree if shape == "spheres" else none, table if shape == "lights" else table[:0],
    )  # fmt: skip
    origin, direction = bad_rays()
    began = time.process_time()
    hits = made.nearest(origin, direction)
    assert time.process_time() - began < 5.0
    alone = made.nearest(origin[:4000], direction[:4000])
    np.testing.assert_array_equal(hits.primitive[:4000], alone.primitive)
    np.testing.assert_array_equal(hits.distance[:4000], alone.distance)
    finite = np.isfinite(origin).all(axis=1) & np.isfinite(direction).all(axis=1) & direction.any(axis=1)
    assert (hits.primitive[~finite] == -1).all()
    assert (hits.primitive >= 0).sum() > 1000
    assert np.isfinite(hits.distance[hits.primitive >= 0]).all()
    assert (hits.distance[hits.primitive >= 0] >= 0).all()  # a light 5e-46 away is 0 away in float32
    if shape != "triangles":
        return
    met = np.flatnonzero(finite & (hits.primitive >= 0))
    with np.errstate(invalid="ignore"):  # a direction of 1e38 leaves the reference with infinities to add
        t, _, _ = every_crossing(vertices[faces], origin[met].astype(np.float64), direction[met].astype(np.float64))
    truth = t.min(axis=1)
    sure = np.isfinite(truth)
    assert (~sure).sum() <= 2  # rays along an edge, which the reference may miss
    np.testing.assert_allclose(hits.distance[met][sure], truth[sure], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("reach", REACHES)
def test_h13_a_reach_that_is_no_number(reach: float) -> None:
    """Nothing stands nearer than a reach that is no number, below 0 or 0; an infinite one has no end."""
    made = intersector(TRIANGLE, np.array([[0, 1, 2]]), spheres=((0, 0, 5, 0.5),))
    origin, direction = rays([(0, 0, 1), (0, 0, 8), (0, 9, 1)], [(0, 0, -1), (0, 0, -1), (0, 0, -1)])
    blocked = made.occluded(origin, direction, np.full(3, reach, np.float32))
    assert blocked.tolist() == [REACHES[reach], REACHES[reach], 0]
