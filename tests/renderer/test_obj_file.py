"""OBJ files: what a good one means, and that a bad one gives one error that names its line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from renderer.framing import DEFAULT_MATERIAL
from tests.renderer.model_files import SQUARE, load, refused


def test_obj_keeps_order_normals_and_texture_coordinates(tmp_path: Path) -> None:
    (mesh,) = load(
        tmp_path,
        "a.obj",
        SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\nf 1/1/1 2/2/1 3/3/2\nf 1/1/1 3/3/2 4/1/1\n",
    )
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 0, 1]])
    np.testing.assert_array_equal(mesh.uvs, [[0, 0], [1, 0], [1, 1], [0, 0]])
    assert mesh.material is DEFAULT_MATERIAL


def test_obj_without_normals_is_flat(tmp_path: Path) -> None:
    (mesh,) = load(tmp_path, "a.obj", SQUARE + "f 1 2 3\n")
    assert mesh.normals is None
    assert mesh.uvs is None


def test_obj_normals_on_some_faces_only(tmp_path: Path) -> None:
    (mesh,) = load(tmp_path, "a.obj", SQUARE + "vn 0 0 2\nf 1//1 2//1 3//1\nf 1 3 4\n")
    np.testing.assert_array_equal(mesh.normals[mesh.faces[0]], [[0, 0, 2]] * 3)
    np.testing.assert_array_equal(mesh.normals[mesh.faces[1]], np.zeros((3, 3)))


def test_obj_normals_that_are_not_numbers_count_as_missing(tmp_path: Path) -> None:
    (mesh,) = load(tmp_path, "a.obj", SQUARE + "vt nan 1e300\nvn nan 0 1\nf 1/1/1 2/1/1 3/1/1\n")
    np.testing.assert_array_equal(mesh.normals, np.zeros((3, 3)))
    np.testing.assert_array_equal(mesh.uvs, np.zeros((3, 2)))


def test_obj_relative_indices_count_from_where_they_stand(tmp_path: Path) -> None:
    (mesh,) = load(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 1 1 5\nf -3 -2 -1\n")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[0]][:, 2], [0, 0, 0])
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[1]][:, 2], [5, 5, 5])


@pytest.mark.parametrize(
    ("text", "triangles"),
    [
        ("f 1 2 3 4", 2),
        ("f 1 2 3 # a comment", 1),
        ("f 1 2 \\\n3", 1),
        ("  f\t1  2 3 ", 1),
        ("f 1 2 3\r\nf 1 3 4\r", 2),
        ("l 1 2\np 1\nf 1 2 3", 1),
        ("g wall\no box\ns 1\nf 1 2 3", 1),
    ],
)
def test_obj_ways_of_writing(tmp_path: Path, text: str, triangles: int) -> None:
    (mesh,) = load(tmp_path, "a.obj", SQUARE + text)
    assert len(mesh.faces) == triangles


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_obj_with_a_byte_order_mark_keeps_its_first_vertex(tmp_path: Path, encoding: str) -> None:
    (mesh,) = load(tmp_path, "a.obj", (SQUARE + "f 1 2 3\n").encode(encoding))
    np.testing.assert_array_equal(mesh.vertices[0], [0, 0, 0])


def test_obj_concave_polygon_is_covered_once(tmp_path: Path) -> None:
    arrow = [(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)]
    for turned in range(5):
        for sign in (1, -1):
            corners = (arrow[turned:] + arrow[:turned])[::sign]
            text = "".join(f"v {x} {y} 7\n" for x, y in corners) + "f 1 2 3 4 5\n"
            (mesh,) = load(tmp_path, "a.obj", text)
            a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
            areas = np.cross(b - a, c - a)[:, 2] / 2
            assert len(areas) == 3
            assert (areas * sign > 0).all()
            np.testing.assert_allclose(np.abs(areas).sum(), 10.0)


def test_obj_hexagon_among_textured_triangles(tmp_path: Path) -> None:
    hexagon = "".join(f"v {math.cos(k)} {math.sin(k)} 0\n" for k in np.arange(6) * math.pi / 3)
    (mesh,) = load(tmp_path, "a.obj", hexagon + "vt 0 0\nf 1/1 2/1 3/1\nf 1 2 3 4 5 6\n")
    assert len(mesh.faces) == 5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("f 1 2 0", "a.obj: line 5: f: expected a vertex index from 1, or from -4 to -1, found 0"),
        ("f 1 2 -5", "a.obj: line 5: f: expected a vertex index from 1, or from -4 to -1, found -5"),
        ("f 1 2 5", "a.obj: line 5: f: expected a vertex index up to 4, found 5"),
        ("\nf 1/1 2/1 3/1", "a.obj: line 6: f: expected a texture coordinate index up to 0, found 1"),
        ("f 1//1 2//1 3//1", "a.obj: line 5: f: expected a normal index up to 0, found 1"),
        (f"f 1 2 {2**80}", "a.obj: line 5: f: expected a vertex index from 1"),
        ("f 1 3", "a.obj: line 5: f: expected at least 3 corners, found 2"),
        ("f 1 2 x", "a.obj: line 5: f: expected corners as v, v/vt, v//vn or v/vt/vn, found 'x'"),
        ("f 1 2 3/1/1/1", "a.obj: line 5: f: expected corners"),
        ("v 1,5 0 0", "a.obj: line 5: v: expected 3 numbers, found '1,5 0 0'"),
        ("v 1 2", "a.obj: line 5: v: expected 3 numbers, found '1 2'"),
        ("v 0 nan 0\nf 1 2 3", "a.obj: line 5: v: expected finite coordinates up to 1e+12 m, found [0.0, nan, 0.0]"),
        ("v 1e300 0 0\nf 1 2 3", "a.obj: line 5: v: expected finite coordinates"),
        ("mtllib", "a.obj: line 5: mtllib: expected the name of a file, found ''"),
        ("mtllib none.mtl", "a.obj: line 5: mtllib: expected an existing file, found no file 'none.mtl'"),
        ("", "a.obj: expected 1 to 20000000 triangles, found 0"),
    ],
)
def test_obj_mistakes_are_told_with_their_line(tmp_path: Path, text: str, message: str) -> None:
    assert refused(tmp_path, "a.obj", SQUARE + text).startswith(message)
