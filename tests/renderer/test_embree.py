"""Embree by packets: the same answers as its single rays, ties settled the same way whatever the company."""

from __future__ import annotations

import gc
import logging
import weakref

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer import embree
from renderer.embree import EmbreeTriangles
from tests.renderer.drawing import icosphere

Rays = tuple[NDArray[np.float32], NDArray[np.float32]]


@pytest.fixture(autouse=True)
def need_packets() -> None:
    if embree.embree_library() is None:
        pytest.skip("this processor or this Embree traces no packets")


def soup(seed: int, count: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    vertices = np.random.default_rng(seed).uniform(-1, 1, (3 * count, 3)).astype(np.float32)
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def crossing_rays(seed: int, count: int) -> Rays:
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 2, (count, 3)).astype(np.float32), rng.normal(size=(count, 3)).astype(np.float32)


def sheet(columns: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A plane of right triangles that share edges and corners, at integers."""
    y, x = (part.ravel() for part in np.mgrid[0 : columns + 1, 0 : columns + 1])
    vertices = np.stack([x, y, 0 * x], axis=1).astype(np.float32)
    corner = (np.arange(columns)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + columns + 1], axis=1),
            np.stack([corner + 1, corner + columns + 2, corner + columns + 1], axis=1),
        ]
    )
    return vertices, faces.astype(np.int32)


@pytest.mark.parametrize("coherent", [True, False])
@pytest.mark.parametrize("count", [1, 15, 16, 17, 4000])
def test_packets_find_what_single_rays_find(coherent: bool, count: int) -> None:
    """Bit for bit in the distance; any number of rays, the last packet filled or not."""
    vertices, faces = soup(1, 400)
    origin, direction = crossing_rays(2, count)
    together, singly = EmbreeTriangles(vertices, faces), EmbreeTriangles(vertices, faces, singly=True)
    found, distance = together.nearest(origin, direction, coherent)
    truth, length = singly.nearest(origin, direction, coherent)
    np.testing.assert_array_equal(found, truth)
    np.testing.assert_array_equal(distance[truth >= 0], length[truth >= 0])
    reach = np.random.default_rng(3).uniform(0, 2, count).astype(np.float32)
    blocked = np.full((2, count), 7, dtype=np.uint8)
    together.occluded(origin, direction, reach.copy(), blocked[0], coherent)
    singly.occluded(origin, direction, reach.copy(), blocked[1], coherent)
    np.testing.assert_array_equal(blocked[0], blocked[1])
    assert set(np.unique(blocked)) <= {0, 1}


def test_of_two_triangles_at_one_distance_the_lower_number_wins() -> None:
    """Rays straight at the middles of the edges of a sheet, where two triangles tie."""
    vertices, faces = sheet(40)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    order = np.lexsort(edges.T)
    owner = np.tile(np.arange(len(faces)), 3)[order]
    edges = edges[order]
    shared = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    target = vertices[edges[shared]].mean(axis=1)
    direction = np.tile(np.float32([0, 0, -1]), (len(target), 1))
    found, distance = EmbreeTriangles(vertices, faces).nearest(target + np.float32([0, 0, 8]), direction, True)
    np.testing.assert_array_equal(distance, 8.0)
    np.testing.assert_array_equal(found, np.minimum(owner[shared], owner[shared + 1]))


def assert_company_does_not_matter(made: EmbreeTriangles, origin: NDArray[np.float32], target: object) -> None:
    """Each ray meets the same alone, in order, shuffled, in part and amid others that go elsewhere."""
    origin, direction = origin.astype(np.float32), (np.asarray(target) - origin).astype(np.float32)
    rng = np.random.default_rng(6)
    found, distance = made.nearest(origin, direction, True)
    n = len(origin)
    for chosen in (rng.permutation(n), rng.permutation(n)[: n // 3], np.arange(3, n, 7)):
        for coherent in (True, False):
            again, length = made.nearest(origin[chosen], direction[chosen], coherent)
            np.testing.assert_array_equal(again, found[chosen])
            np.testing.assert_array_equal(length, distance[chosen])
    amid = np.repeat(direction, 2, axis=0)
    amid[1::2] += rng.normal(size=direction.shape).astype(np.float32)
    np.testing.assert_array_equal(made.nearest(np.repeat(origin, 2, axis=0), amid, True)[0][::2], found)
    for ray in range(0, n, n // 50):
        assert made.nearest(origin[ray : ray + 1], direction[ray : ray + 1], True)[0][0] == found[ray]


@pytest.mark.parametrize("seed", range(6))
def test_overlapping_triangles_in_one_plane(seed: int) -> None:
    """Nearly every ray has several hits at one distance."""
    rng = np.random.default_rng(seed)
    corners = (rng.integers(-4, 5, (600, 3, 3)) if seed % 2 else rng.uniform(-4, 4, (600, 3, 3))).astype(np.float32)
    corners[:, :, 2] = rng.integers(0, 3, 600)[:, None]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if seed % 3 == 0 else np.eye(3)
    corners = (corners @ turn.T).astype(np.float32)
    spread = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[(spread != 0).any(axis=1)]
    made = EmbreeTriangles(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))
    y, x = np.mgrid[-4:4:64j, -4:4:64j]
    target = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1) @ turn.T
    assert_company_does_not_matter(made, np.tile(turn @ [0.5, 0.25, 9.0], (len(target), 1)), target)


@pytest.mark.parametrize("start", ["straight", "aside", "scattered"])
def test_rays_at_edges_corners_and_the_outline(start: str) -> None:
    vertices, faces = sheet(20)
    rng = np.random.default_rng(7)
    rim = np.arange(0, 20.01, 0.125)
    outline = [np.stack([rim, side + 0 * rim, 0 * rim], axis=1) for side in (0.0, 20.0)]
    middles = 0.5 * (vertices[faces[:, 0]] + vertices[faces[:, 1]])
    target = np.concatenate([vertices, middles, *outline, *(part[:, [1, 0, 2]] for part in outline)])
    origin = {
        "straight": target + [0, 0, 8],
        "aside": np.tile([3.3, 7.1, 5.0], (len(target), 1)),
        "scattered": rng.uniform([-9, -9, 1], [30, 30, 9], target.shape),
    }[start]
    assert_company_does_not_matter(EmbreeTriangles(vertices, faces), origin, target)


@pytest.mark.parametrize("level", [3, 4])
def test_rays_at_the_edges_and_corners_of_a_ball(level: int) -> None:
    vertices, faces = icosphere(level)
    share = np.random.default_rng(8).random((len(faces), 1))
    edges = share * vertices[faces[:, 0]] + (1 - share) * vertices[faces[:, 1]]
    target = np.concatenate([vertices, edges])
    made = EmbreeTriangles(vertices.astype(np.float32), faces.astype(np.int32))
    for origin in ([0.0, 0.0, 0.0], [0.1, 0.2, -0.3], [3.0, 1.0, 2.0]):
        assert_company_does_not_matter(made, np.tile(origin, (len(target), 1)), target)


def test_a_scene_gives_its_memory_back() -> None:
    vertices, faces = icosphere(2)
    made = EmbreeTriangles(vertices.astype(np.float32), faces.astype(np.int32))
    gone = weakref.ref(made)
    del made
    gc.collect()
    assert gone() is None


def test_another_embree_means_single_rays_and_a_line_in_the_log(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A packet width that the library's functions do not have gets wrong answers, which is noticed."""
    known = embree.embree_library()
    assert known is not None
    wrong = known._replace(width=4 if known.width != 4 else 8)
    monkeypatch.setattr(embree, "_open_library", lambda: wrong)
    with caplog.at_level(logging.WARNING, "renderer.embree"):
        assert embree.embree_library.__wrapped__() is None
    assert "singly" in caplog.text
    caplog.clear()

    def absent() -> embree.Library:
        raise OSError("embreex comes without an Embree library of its own")

    monkeypatch.setattr(embree, "_open_library", absent)
    with caplog.at_level(logging.WARNING, "renderer.embree"):
        assert embree.embree_library.__wrapped__() is None
    assert "without an Embree library" in caplog.text
