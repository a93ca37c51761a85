"""PLY files: text and binary, and mistakes told with their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from renderer.framing import DEFAULT_MATERIAL
from tests.renderer.model_files import COLOURED, KINDS, area_vector, load, ply, refused


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "faces", [[[0, 1, 2], [0, 2, 3]], [[0, 1, 2, 3]], [[0, 1, 2], [0, 2, 3], [0, 1, 2, 3]], [[0, 1, 2, 3], [0, 1, 2]]]
)
def test_ply_of_every_kind(tmp_path: Path, kind: str, faces: list[list[int]]) -> None:
    (mesh,) = load(tmp_path, "a.ply", ply(kind, faces))
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    np.testing.assert_allclose(area_vector(mesh), [0, 0, sum((len(face) - 2) / 2 for face in faces)])
    assert mesh.material is DEFAULT_MATERIAL


@pytest.mark.parametrize("kind", KINDS)
def test_ply_colours_become_their_mean(tmp_path: Path, kind: str) -> None:
    (mesh,) = load(tmp_path, "a.ply", ply(kind, [[0, 1, 2]], COLOURED))
    assert mesh.material.diffuse == (1.0, 0.0, 0.0)


def test_ply_normals_and_texture_coordinates(tmp_path: Path) -> None:
    text = (
        "ply\nformat ascii 1.0\nelement vertex 3\n"
        + "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t"))
        + "element face 1\nproperty list uchar uint vertex_index\nend_header\n"
        + "0 0 0 0 0 1 0.25 0.5\n1 0 0 0 0 1 1 0\n0 1 0 0 1 0 0 1\n3 0 1 2\n"
    )
    (mesh,) = load(tmp_path, "a.ply", text)
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1], [0, 0, 1], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.uvs, [[0.25, 0.5], [1, 0], [0, 1]])


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply_agrees_with_another_writer(tmp_path: Path, encoding: str) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    (mesh,) = load(tmp_path, "a.ply", trimesh.exchange.ply.export_ply(ball, encoding=encoding, vertex_normal=True))
    np.testing.assert_allclose(mesh.vertices, ball.vertices, atol=1e-6)
    np.testing.assert_array_equal(mesh.faces, ball.faces)
    np.testing.assert_allclose(mesh.normals, ball.vertex_normals, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((b"3 0 2 3\n", b""), "a.ply: expected 2 rows of element face, found damage or the end of the file"),
        ((b"3 0 2 3", b"3 0 2"), "a.ply: expected 2 rows of element face"),
        ((b"3 0 2 3", b"2 0 2"), "a.ply: face 1: expected at least 3 corners, found 2"),
        ((b"3 0 2 3", b"3 0 2 4"), "a.ply: face 1: expected vertex indices from 0 to 3, found 4"),
        ((b"3 0 2 3", b"3 0 2 -1"), "a.ply: face 1: expected vertex indices from 0 to 3, found -1"),
        ((b"3 0 2 3", b"3 0 2 1.5"), "a.ply: face 1: expected vertex indices from 0 to 3, found 1.5"),
        ((b"3 0 2 3", b"nan 0 2 3"), "a.ply: expected 2 rows of element face"),
        ((b"3 0 2 3", b"3 0 two 3"), "a.ply: expected numbers after the header"),
        ((b"1 1 0", b"1 nan 0"), "a.ply: vertex 2: expected finite coordinates"),
        ((b"end_header", b"end"), "a.ply: expected a header from 'ply' to 'end_header'"),
        ((b"format ascii 1.0\n", b""), "a.ply: expected a format"),
        ((b"float y", b"banana y"), "a.ply: line 6: expected a statement of a PLY header, found 'property banana y'"),
        ((b"float z", b"float height"), "a.ply: expected x, y and z of each vertex, found x, y, height"),
        ((b"vertex_indices", b"corners"), "a.ply: expected a list vertex_indices of each face, found flag, corners"),
        ((b"element face", b"element tristrips"), "a.ply: expected elements vertex and face, found vertex, tristrips"),
        ((b"element vertex 4", b"element vertex 99999999999999999999"), "a.ply: expected 999999999999999999 rows"),
    ],
)
def test_ply_mistakes(tmp_path: Path, change: tuple[bytes, bytes], message: str) -> None:
    good = ply("ascii", [[0, 1, 2], [0, 2, 3]]).replace(b"7 3", b"0 3")
    good = good.replace(b"0 3 0 2 3", b"7 3 0 2 3")
    assert change[0] in good
    assert refused(tmp_path, "a.ply", good.replace(*change)).startswith(message)
