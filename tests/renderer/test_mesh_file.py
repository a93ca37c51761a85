"""Mesh files: what a good file means, and that a bad one gives one error that names its place."""

from __future__ import annotations

import base64
import io
import json
import math
import os
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from renderer.errors import SceneError
from renderer.framing import DEFAULT_MATERIAL
from renderer.mesh_file import load_meshes
from renderer.scene import Material, Mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def load(folder: Path, name: str, content: str | bytes, **limits: int) -> tuple[Mesh, ...]:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_meshes(path, **limits)


def refused(folder: Path, name: str, content: str | bytes, **limits: int) -> str:
    with pytest.raises(SceneError) as caught:
        load(folder, name, content, **limits)
    message = str(caught.value)
    assert "\n" not in message
    assert "expected" in message
    return message.replace(str(folder) + "/", "")


def png(*colours: tuple[int, int, int]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.array([colours], dtype=np.uint8)).save(buffer, "png")
    return buffer.getvalue()


def area_vector(mesh: Mesh) -> np.ndarray:
    """Sum of the faces' area vectors: zero for a closed surface, area times normal for a flat one."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a).sum(axis=0) / 2


def volume(mesh: Mesh) -> float:
    """Volume of a closed mesh, above 0 where counter-clockwise is outside."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


# OBJ


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


def test_too_large_files_and_too_many_triangles(tmp_path: Path) -> None:
    text = SQUARE + "f 1 2 3\nf 1 2 3 4\n"
    assert "line 6: expected at most 2 triangles" in refused(tmp_path, "a.obj", text, max_triangles=2)
    assert "expected at most 20 bytes, found" in refused(tmp_path, "a.obj", text, max_bytes=20)


@pytest.mark.parametrize("suffix", ["obj", "glb", "gltf", "ply", "stl"])
def test_empty_files(tmp_path: Path, suffix: str) -> None:
    assert refused(tmp_path, f"a.{suffix}", b"") == f"a.{suffix}: expected a mesh file, found an empty file"


def test_missing_file_folder_and_unknown_ending(tmp_path: Path) -> None:
    (tmp_path / "folder.obj").mkdir()
    for name in ("none.obj", "folder.obj", "scene.blend", "noending"):
        with pytest.raises(SceneError, match="expected"):
            load_meshes(tmp_path / name)


def test_a_mesh_file_reached_through_a_link_is_the_users_own_choice(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "real.obj").write_text(SQUARE + "f 1 2 3\n")
    (tmp_path / "link.obj").symlink_to("elsewhere/real.obj")
    assert len(load_meshes(tmp_path / "link.obj")) == 1


# MTL


def material(folder: Path, statements: str) -> Material:
    (folder / "a.mtl").write_text(f"newmtl m\n{statements}\n")
    (mesh,) = load(folder, "a.obj", SQUARE + "mtllib a.mtl\nusemtl m\nf 1 2 3\n")
    return mesh.material


BASE = "Kd 0.2 0.4 0.6\nKs 0.5 0.5 0.25\nNs 60\n"
KD = (0.2, 0.4, 0.6)
KS = (0.5, 0.5, 0.25)
HIGHLIGHT = tuple(part / math.pi for part in KS)
NONE = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        ("illum 0", {"diffuse": NONE, "emission": KD, "specular": NONE}),
        ("illum 0\nKe 1 1 1", {"diffuse": NONE, "emission": (1.2, 1.4, 1.6)}),
        ("illum 1", {"diffuse": KD, "specular": NONE, "emission": NONE}),
        ("illum 2", {"diffuse": KD, "specular": HIGHLIGHT, "shininess": 60.0, "reflection": NONE}),
        ("", {"diffuse": KD, "specular": HIGHLIGHT, "transmission": NONE}),
        ("Ke 2 3 4", {"emission": (2.0, 3.0, 4.0), "diffuse": KD}),
        ("illum 3", {"reflection": KS, "specular": HIGHLIGHT, "diffuse": KD}),
        ("illum 5", {"reflection": KS}),
        ("illum 8", {"reflection": KS}),
        ("illum 7\nNi 1.33", {"transmission": (1.0, 1.0, 1.0), "ior": 1.33, "diffuse": NONE, "reflection": NONE}),
        ("illum 6", {"transmission": (1.0, 1.0, 1.0), "ior": 1.5}),
        ("illum 6\nTf 0.5 0.25 1", {"transmission": (0.5, 0.25, 1.0), "diffuse": (0.1, 0.3, 0.0)}),
        ("illum 6\nTf 0.5 0.5 0.5\nd 0.1", {"transmission": (0.5, 0.5, 0.5)}),
        ("illum 7\nd 0.25", {"transmission": (0.75, 0.75, 0.75), "diffuse": (0.05, 0.1, 0.15)}),
        ("illum 4", {"transmission": (1.0, 1.0, 1.0), "ior": 1.0}),
        ("illum 9\nNi 1.0", {"ior": 1.0}),
        ("illum 9\nNi 1.4", {"ior": 1.4}),
        ("illum 2\nd 0.75\nNi 1.5", {"transmission": (0.25, 0.25, 0.25), "ior": 1.0, "diffuse": (0.15, 0.3, 0.45)}),
        ("Tr 0.25", {"transmission": (0.25, 0.25, 0.25), "ior": 1.0}),
        ("Tr 1\nd 1", {"transmission": NONE}),
        ("d -halo 0.5", {"transmission": (0.5, 0.5, 0.5)}),
        ("kd 0.5\nNS 10", {"diffuse": (0.5, 0.5, 0.5), "shininess": 10.0}),
        ("Kd 1.5 0 0\nKs 2 0 0\nillum 3", {"diffuse": (1.0, 0.0, 0.0), "reflection": (1.0, 0.0, 0.0)}),
        ("Pr 0.5\nmap_Bump missing.png\nsharpness 60\nKa 1 1 1", {"diffuse": KD}),
    ],
)
def test_mtl_statements(tmp_path: Path, statements: str, expected: dict[str, Any]) -> None:
    found = material(tmp_path, BASE + statements)
    for name, value in expected.items():
        np.testing.assert_allclose(getattr(found, name), value, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("Kd 0.1 0.2", "a.mtl: line 2: Kd: expected red, green and blue, found '0.1 0.2'"),
        ("Kd 0.1 red 0.3", "a.mtl: line 2: Kd: expected a number from 0 to 1e+12, found 'red'"),
        ("Kd -1 0 0", "a.mtl: line 2: Kd: expected a number"),
        ("Kd nan 0 0", "a.mtl: line 2: Kd: expected a number"),
        ("Kd xyz 0.1 0.1 0.1", "a.mtl: line 2: Kd: expected red, green and blue"),
        ("d 1.5", "a.mtl: line 2: d: expected a number from 0 to 1, found '1.5'"),
        ("Ns", "a.mtl: line 2: Ns: expected a number from 0 to 1e+09, found ''"),
        ("illum x", "a.mtl: line 2: illum: expected a number"),
        ("illum 7\nNi 0.01", "a.mtl: material 'm'.ior: expected"),
        ("map_Kd", "a.mtl: line 2: map_Kd: expected the name of a file, found ''"),
        ("map_Kd none.png", "a.mtl: line 2: map_Kd: expected an existing file, found no file 'none.png'"),
        ("map_Kd ../out.png", "a.mtl: line 2: map_Kd: expected a file inside the folder"),
        ("map_Kd /etc/passwd", "a.mtl: line 2: map_Kd: expected a file inside the folder"),
        ("map_Kd a.mtl", "a.mtl: expected an image that can be read"),
    ],
)
def test_mtl_mistakes_are_told_with_their_line(tmp_path: Path, statement: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        material(tmp_path, statement)
    assert str(caught.value).replace(str(tmp_path) + "/", "").startswith(message)


def test_mtl_statement_before_any_material(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("Kd 1 1 1\n")
    message = refused(tmp_path, "a.obj", SQUARE + "mtllib a.mtl\nf 1 2 3\n")
    assert message == "a.mtl: line 1: expected newmtl before any other statement, found 'Kd'"


def test_obj_one_mesh_a_material_in_order_of_first_use(tmp_path: Path) -> None:
    (tmp_path / "one.mtl").write_text("newmtl red #1\nKd 1 0 0\n")
    (tmp_path / "two.mtl").write_text("newmtl blue\nKd 0 0 1\n")
    meshes = load(
        tmp_path,
        "a.obj",
        "mtllib one.mtl two.mtl\n"
        + SQUARE
        + "usemtl blue\nf 1 2 3\nusemtl red #1\nf 1 3 4\nusemtl blue\nf 2 3 4\nusemtl red #1\n",
    )
    assert [mesh.material.diffuse for mesh in meshes] == [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]
    assert [len(mesh.faces) for mesh in meshes] == [2, 1]
    assert [len(mesh.vertices) for mesh in meshes] == [4, 3]


def test_obj_material_that_no_mtl_defines(tmp_path: Path) -> None:
    (tmp_path / "one.mtl").write_text("newmtl red\nnewmtl blue\n")
    message = refused(tmp_path, "a.obj", SQUARE + "mtllib one.mtl\nusemtl green\nf 1 2 3\n")
    assert message == "a.obj: line 6: usemtl: expected one of red, blue, found 'green'"
    (mesh,) = load(tmp_path, "b.obj", SQUARE + "usemtl green\nf 1 2 3\n")
    assert mesh.material is DEFAULT_MATERIAL


def test_textures_are_found_beside_the_mtl_and_shared(tmp_path: Path) -> None:
    (tmp_path / "looks" / "my pictures").mkdir(parents=True)
    (tmp_path / "looks" / "my pictures" / "wood.png").write_bytes(png((10, 20, 30), (200, 100, 50)))
    (tmp_path / "looks" / "a.mtl").write_text(
        "newmtl a\nmap_Kd -blendu on -s 2 2 -clamp off my pictures/wood.png\n"
        "newmtl b\nKd 0.5 0.5 0.5\nmap_Kd my pictures\\wood.png\n"
    )
    first, second = load(tmp_path, "a.obj", SQUARE + "mtllib looks/a.mtl\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n")
    assert first.material.diffuse_texture is not None
    assert first.material.diffuse_texture is second.material.diffuse_texture
    np.testing.assert_array_equal(first.material.diffuse_texture.pixels, [[[10, 20, 30], [200, 100, 50]]])
    assert first.material.diffuse == (1.0, 1.0, 1.0)
    assert second.material.diffuse == (0.5, 0.5, 0.5)


def test_links_out_of_the_folder_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(png((1, 2, 3)))
    inside = tmp_path / "model"
    inside.mkdir()
    (inside / "link.png").symlink_to("../secret.png")
    (inside / "own.png").write_bytes(png((1, 2, 3)))
    (inside / "fine.png").symlink_to("own.png")
    with pytest.raises(SceneError, match=r"line 2: map_Kd: expected a file inside the folder .*'link\.png'"):
        material(inside, "map_Kd link.png")
    assert material(inside, "map_Kd fine.png").diffuse_texture is not None


def test_a_pipe_is_no_texture(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(SceneError, match="expected an existing file"):
        material(tmp_path, "map_Kd pipe.png")


# PLY


def ply(kind: str, faces: list[list[int]], extra: str = "") -> bytes:
    """The unit square's corners and `faces`, in one of PLY's three kinds."""
    header = f"ply\nformat {kind} 1.0\ncomment made here\nelement vertex 4\nproperty float x\nproperty float y\n"
    header += f"property float z\n{extra}element face {len(faces)}\nproperty uchar flag\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    colour = ["255 0 0"] * 4 if extra else [""] * 4
    if kind == "ascii":
        rows = [f"{x} {y} {z} {c}" for (x, y, z), c in zip(vertices, colour, strict=True)]
        rows += [f"7 {len(face)} {' '.join(map(str, face))}" for face in faces]
        return (header + "\n".join(rows) + "\n").encode()
    order = "<" if "little" in kind else ">"
    body = b"".join(struct.pack(f"{order}3f", *vertex) + (bytes([255, 0, 0]) if extra else b"") for vertex in vertices)
    body += b"".join(struct.pack(f"{order}BB{len(face)}i", 7, len(face), *face) for face in faces)
    return header.encode() + body


KINDS = ("ascii", "binary_little_endian", "binary_big_endian")
COLOURED = "property uchar red\nproperty uchar green\nproperty uchar blue\n"


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


# STL


def test_stl_text_and_binary(tmp_path: Path) -> None:
    box = trimesh.creation.box()
    for data in (trimesh.exchange.stl.export_stl(box), trimesh.exchange.stl.export_stl_ascii(box).encode()):
        (mesh,) = load(tmp_path, "a.stl", data)
        assert len(mesh.faces) == 12
        np.testing.assert_allclose(mesh.vertices[mesh.faces], box.triangles, atol=1e-6)
        np.testing.assert_allclose(volume(mesh), 1.0, rtol=1e-6)
        assert mesh.normals is None


def test_stl_of_several_solids(tmp_path: Path) -> None:
    solid = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    (mesh,) = load(tmp_path, "a.stl", (solid + "endsolid s\n") * 3)
    assert len(mesh.faces) == 3


def test_stl_with_damaged_face_normals_is_read_in_silence(tmp_path: Path) -> None:
    text = trimesh.exchange.stl.export_stl_ascii(trimesh.creation.box()).replace("normal", "normal x", 1)
    (tmp_path / "a.stl").write_text(text)
    script = (
        "import sys, pathlib, renderer.mesh_file as m; print(m.load_meshes(pathlib.Path(sys.argv[1]))[0].faces.shape)"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "a.stl")]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert (run.stdout.strip(), run.stderr) == ("(12, 3)", "")


@pytest.mark.parametrize("data", [b"solid\nendsolid\n", b"\0" * 84, b"\0" * 80 + b"\5\0\0\0" + b"\0" * 100, b"hello"])
def test_stl_without_triangles_or_cut_short(tmp_path: Path, data: bytes) -> None:
    assert refused(tmp_path, "a.stl", data).startswith("a.stl: expected")


# glTF


def gltf(**changes: object) -> dict[str, Any]:
    """A triangle with normals and texture coordinates, its numbers embedded."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
    normals = np.array([[1, 1, 0]] * 3, dtype="<f4") / np.float32(math.sqrt(2))
    uvs = np.array([[0, 0], [65535, 0], [0, 65535]], dtype="<u2")
    indices = np.array([0, 1, 2], dtype="<u2")
    blob = positions.tobytes() + normals.tobytes() + uvs.tobytes() + indices.tobytes() + b"\0\0"
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}]}
        ],
        "materials": [{"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0.0}}],
        "buffers": [{"byteLength": len(blob), "uri": "data:;base64," + base64.b64encode(blob).decode()}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 36},
            {"buffer": 0, "byteOffset": 72, "byteLength": 12},
            {"buffer": 0, "byteOffset": 84, "byteLength": 6},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "normalized": True, "count": 3, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
    }
    return tree | changes


def glb(tree: dict[str, Any]) -> bytes:
    """A tree whose first buffer is embedded, as a binary file."""
    uri = tree["buffers"][0]["uri"]
    blob = base64.b64decode(uri.partition(",")[2])
    tree = tree | {"buffers": [{"byteLength": len(blob)}]}
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def load_gltf(folder: Path, **changes: object) -> tuple[Mesh, ...]:
    return load(folder, "a.gltf", json.dumps(gltf(**changes)))


def gltf_material(folder: Path, **fields: object) -> Material:
    (mesh,) = load_gltf(folder, materials=[fields])
    return mesh.material


def test_gltf_text_and_binary_are_the_same(tmp_path: Path) -> None:
    (text,) = load_gltf(tmp_path)
    (binary,) = load(tmp_path, "a.glb", glb(gltf()))
    for mesh in (text, binary):
        np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])
        np.testing.assert_allclose(mesh.normals, [[math.sqrt(0.5), math.sqrt(0.5), 0]] * 3, atol=1e-7)
        np.testing.assert_array_equal(mesh.uvs, [[0, 1], [1, 1], [0, 0]])
        assert mesh.material.name == "m"


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_gltf_unequal_scale_keeps_normals_square_to_the_surface(tmp_path: Path) -> None:
    (mesh,) = load_gltf(tmp_path, nodes=[{"mesh": 0, "scale": [1, 2, 1]}])
    np.testing.assert_allclose(unit(mesh.normals), [[0.894427191, 0.447213595, 0]] * 3, atol=1e-7)
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 2, 0]])


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -1, 1], [1, 1, -1], [-2, -3, -0.5]])
def test_gltf_mirrored_node_still_faces_outwards(tmp_path: Path, scale: list[float]) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    scene = trimesh.Scene()
    scene.add_geometry(ball, transform=np.diag([*scale, 1.0]))
    (mesh,) = load(tmp_path, "a.glb", scene.export(file_type="glb", include_normals=True))
    assert volume(mesh) == pytest.approx(ball.volume * abs(np.prod(scale)), rel=1e-5)
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    own = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", own, mesh.normals[mesh.faces[:, 0]]) > 0).all()


def test_gltf_nodes_multiply_from_the_root_down(tmp_path: Path) -> None:
    half = math.sqrt(0.5)
    nodes = [
        {"children": [1, 2], "translation": [10, 0, 0]},
        {"mesh": 0, "rotation": [0, 0, half, half]},
        {"mesh": 0, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 5, 0, 1]},
    ]
    turned, scaled = load_gltf(tmp_path, nodes=nodes)
    np.testing.assert_allclose(turned.vertices, [[10, 0, 0], [10, 1, 0], [9, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(scaled.vertices, [[10, 5, 0], [12, 5, 0], [10, 7, 0]], atol=1e-12)


def test_gltf_agrees_with_another_reader(tmp_path: Path) -> None:
    generator = np.random.default_rng(4)
    scene = trimesh.Scene()
    for index in range(4):
        transform = trimesh.transformations.random_rotation_matrix(num=1, rand=generator.random(3))
        transform = np.asarray(transform).reshape(4, 4) @ np.diag([*generator.uniform(-2, 2, 3), 1.0])
        transform[:3, 3] = generator.uniform(-5, 5, 3)
        scene.add_geometry(trimesh.creation.box(), node_name=f"n{index}", transform=transform)
    data = scene.export(file_type="glb")
    meshes = load(tmp_path, "a.glb", data)
    theirs = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False).dump()
    assert len(meshes) == len(theirs) == 4
    middles = sorted(mesh.vertices[mesh.faces].mean(axis=(0, 1)).round(4).tolist() for mesh in meshes)
    np.testing.assert_allclose(
        middles, sorted(m.triangles.mean(axis=(0, 1)).round(4).tolist() for m in theirs), atol=1e-3
    )
    assert all(volume(mesh) > 0 for mesh in meshes)


def test_gltf_sparse_strided_strips_and_fans(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")
    interleaved = np.zeros((4, 5), dtype="<f4")
    interleaved[:, :3] = points
    blob = interleaved.tobytes() + bytes([3, 0, 0, 0]) + np.array([[1, 1, 9]], dtype="<f4").tobytes()
    tree = gltf(
        buffers=[{"byteLength": len(blob), "uri": "data:;base64," + base64.b64encode(blob).decode()}],
        bufferViews=[
            {"buffer": 0, "byteLength": 80, "byteStride": 20},
            {"buffer": 0, "byteOffset": 80, "byteLength": 4},
            {"buffer": 0, "byteOffset": 84, "byteLength": 12},
        ],
        accessors=[
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "sparse": {
                    "count": 1,
                    "indices": {"bufferView": 1, "componentType": 5121},
                    "values": {"bufferView": 2},
                },
            }
        ],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 5, 6)]}],
    )
    strip, fan = load(tmp_path, "a.gltf", json.dumps(tree))
    np.testing.assert_array_equal(strip.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 9]])
    np.testing.assert_array_equal(strip.faces, [[0, 1, 2], [2, 1, 3]])
    np.testing.assert_array_equal(fan.faces, [[0, 1, 2], [0, 2, 3]])
    assert strip.material is DEFAULT_MATERIAL


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "metallicFactor": 0}},
            {"diffuse": KD, "reflection": NONE, "shininess": 0.0, "transmission": NONE},
        ),
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "roughnessFactor": 0}},
            {"diffuse": NONE, "reflection": KD, "shininess": 2e4 - 2},
        ),
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "roughnessFactor": 0.5}},
            {"diffuse": (0.15, 0.3, 0.45), "reflection": (0.05, 0.1, 0.15), "shininess": 30.0},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [1, 0.5, 0],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
            {"emission": (4.0, 2.0, 0.0)},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.5, 1, 1, 1]},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                            "KHR_materials_volume": {"thicknessFactor": 1}, "KHR_materials_ior": {"ior": 1.33}}},
            {"transmission": (0.5, 1.0, 1.0), "ior": 1.33, "diffuse": (0.25, 0.0, 0.0)},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}},
            {"transmission": (0.5, 0.5, 0.5), "ior": 1.0},
        ),
        (
            {"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [1, 1, 1, 0.25]}, "alphaMode": "BLEND"},
            {"transmission": (0.75, 0.75, 0.75), "ior": 1.0, "diffuse": (0.25, 0.25, 0.25)},
        ),
        (
            {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1]},
             "extensions": {"KHR_materials_unlit": {}}},
            {"emission": KD, "diffuse": NONE},
        ),
    ],
)  # fmt: skip
def test_gltf_materials(tmp_path: Path, fields: dict[str, Any], expected: dict[str, Any]) -> None:
    found = gltf_material(tmp_path, **fields)
    for name, value in expected.items():
        np.testing.assert_allclose(getattr(found, name), value, atol=1e-9, err_msg=name)


def test_gltf_highlight_of_a_rough_dielectric_sends_back_its_share(tmp_path: Path) -> None:
    found = gltf_material(tmp_path, pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 0.3})
    angle = np.linspace(0, math.pi / 2, 200_001)
    lobe = 2 * math.pi * np.trapezoid(np.cos(angle) ** found.shininess * np.sin(angle), angle)
    np.testing.assert_allclose(np.array(found.specular) * lobe, 0.04, rtol=1e-4)


def test_gltf_textures_from_files_and_buffers(tmp_path: Path) -> None:
    picture = png((255, 255, 255), (0, 0, 0))
    (tmp_path / "wood grain.png").write_bytes(picture)
    encoded = "data:image/png;base64," + base64.b64encode(picture).decode()
    for uri in ("wood%20grain.png", "./wood grain.png", encoded):
        (mesh,) = load_gltf(
            tmp_path,
            images=[{"uri": uri}],
            textures=[{"source": 0}],
            materials=[
                {
                    "pbrMetallicRoughness": {
                        "baseColorTexture": {
                            "index": 0,
                            "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 3]}},
                        },
                        "roughnessFactor": 0,
                    }
                }
            ],
        )
        assert mesh.material.diffuse_texture is not None
        np.testing.assert_array_equal(mesh.material.diffuse_texture.pixels, [[[255] * 3, [0] * 3]])
        np.testing.assert_allclose(mesh.material.reflection, (0.5, 0.5, 0.5))
        np.testing.assert_allclose(mesh.uvs, [[0.5, 1], [2.5, 1], [0.5, -2]])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"asset": {"version": "1.0"}}, "a.gltf: asset.version: expected 2.0, found '1.0'"),
        ({"asset": {}}, "a.gltf: asset.version: expected text, found nothing"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "a.gltf: extensionsRequired: expected extensions"),
        ({"nodes": []}, "a.gltf: nodes: expected at least 1 entries, found 0"),
        ({"nodes": [{"mesh": 7}]}, "a.gltf: meshes: expected at least 8 entries, found 1"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "a.gltf: nodes[0]: expected one parent, found more or a circle"),
        ({"nodes": [{"mesh": 0, "children": ["x"]}]}, "a.gltf: nodes[0].children: expected indices from 0"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1]}]}, "a.gltf: nodes[0].scale: expected 3 numbers, found [1, 1]"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1e99, 1]}]}, "a.gltf: nodes[0].scale[1]: expected a number"),
        ({"nodes": [{"mesh": 0, "rotation": [0, 0, 0, 0]}]}, "a.gltf: nodes[0].rotation: expected a quaternion"),
        ({"nodes": [{}]}, "a.gltf: expected 1 to 20000000 triangles, found 0"),
        ({"bufferViews": []}, "a.gltf: bufferViews: expected at least 1 entries, found 0"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 9999}]}, "a.gltf: bufferViews[0].byteLength: expected at most"),
        ({"buffers": [{"byteLength": 4}]}, "a.gltf: buffers[0].uri: expected a file or data"),
        ({"buffers": [{"uri": "none.bin"}]}, "a.gltf: buffers[0].uri: expected an existing file"),
        ({"buffers": [{"uri": "../../etc/passwd"}]}, "a.gltf: buffers[0].uri: expected a file inside the folder"),
        ({"buffers": [{"uri": "%2e%2e/x.bin"}]}, "a.gltf: buffers[0].uri: expected a file inside the folder"),
        ({"buffers": [{"uri": "data:;base64,???"}]}, "a.gltf: buffers[0].uri: expected base64 data"),
        ({"materials": []}, "a.gltf: materials: expected at least 1 entries, found 0"),
        ({"materials": [{"emissiveFactor": [2, 0, 0]}]}, "a.gltf: materials[0].emissiveFactor[0]: expected a number"),
        ({"accessors": [{"bufferView": 0, "componentType": 1, "count": 3, "type": "VEC3"}]}, "a.gltf: accessors[0].co"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}]}, "a.gltf: accessors[0]"),
        ({"accessors": "none"}, "a.gltf: accessors: expected a list, found 'none'"),
    ],
)
def test_gltf_mistakes_are_told_with_their_field(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    assert refused(tmp_path, "a.gltf", json.dumps(gltf(**changes))).startswith(message)


def test_gltf_indices_out_of_range_and_uneven(tmp_path: Path) -> None:
    tree = gltf()
    tree["accessors"][3]["count"] = 2
    assert "indices: expected a multiple of 3" in refused(tmp_path, "a.gltf", json.dumps(tree))
    tree = gltf()
    tree["accessors"][3]["bufferView"] = 2
    assert "expected vertex indices from 0 to 2, found [0, 0, 65535]" in refused(tmp_path, "a.gltf", json.dumps(tree))
    tree = gltf()
    tree["accessors"][3] = tree["accessors"][0] | {"type": "SCALAR"}
    assert "expected unsigned integers" in refused(tmp_path, "a.gltf", json.dumps(tree))


def test_gltf_that_is_not_json_or_nested_without_end(tmp_path: Path) -> None:
    assert refused(tmp_path, "a.gltf", b"{").startswith("a.gltf: expected JSON, found damage")
    assert refused(tmp_path, "a.gltf", b"[" * 100_000).startswith("a.gltf: expected JSON, found damage")
    assert refused(tmp_path, "a.gltf", b"[1]").startswith("a.gltf: top level: expected a table of fields, found [1]")
    assert "expected a JSON chunk" in refused(tmp_path, "a.glb", b"glTF\2\0\0\0\x0c\0\0\0")


def test_gltf_mesh_shown_many_times_counts_each_time(tmp_path: Path) -> None:
    nodes = [{"mesh": 0} for _ in range(5)]
    tree = json.dumps(gltf(nodes=nodes, scenes=[{"nodes": [0, 1, 2, 3, 4]}]))
    assert len(load(tmp_path, "a.gltf", tree, max_triangles=5)) == 5
    assert "expected at most 4 triangles" in refused(tmp_path, "a.gltf", tree, max_triangles=4)


# Damage


def good_files() -> dict[str, bytes]:
    box = trimesh.creation.box()
    textured = glb(
        gltf(
            images=[{"uri": "data:;base64," + base64.b64encode(png((9, 8, 7))).decode()}],
            textures=[{"source": 0}],
            materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        )
    )
    obj = "mtllib m.mtl\n" + SQUARE + "vt 0 0\nvn 0 0 1\nusemtl m\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1 -2 -3\n"
    return {
        "a.obj": obj.encode(),
        "m.mtl": b"newmtl m\nKd 0.2 0.4 0.6\nKs 0.5 0.5 0.5\nNs 60\nillum 7\nNi 1.5\nTf 0.5 0.5 0.5\nmap_Kd t.png\n",
        "a.gltf": json.dumps(gltf()).encode(),
        "a.glb": textured,
        "text.ply": ply("ascii", [[0, 1, 2], [0, 1, 2, 3]], COLOURED),
        "little.ply": ply("binary_little_endian", [[0, 1, 2], [0, 1, 2, 3]]),
        "big.ply": ply("binary_big_endian", [[0, 1, 2], [0, 2, 3]], COLOURED),
        "binary.stl": trimesh.exchange.stl.export_stl(box),
        "text.stl": trimesh.exchange.stl.export_stl_ascii(box).encode(),
    }


@pytest.mark.parametrize("name", list(good_files()))
def test_damaged_files_give_meshes_or_a_scene_error(tmp_path: Path, name: str) -> None:
    files = good_files()
    (tmp_path / "t.png").write_bytes(png((9, 8, 7)))
    (tmp_path / "m.mtl").write_bytes(files["m.mtl"])
    good = files[name]
    main = tmp_path / ("a.obj" if name == "m.mtl" else name)
    main.write_bytes(files[main.name])
    assert load_meshes(main)
    generator = np.random.default_rng(5)
    damaged = [good[:end] for end in np.linspace(0, len(good) - 1, 120).astype(int)]
    for _ in range(300):
        data = bytearray(good)
        for at in generator.integers(0, len(data), generator.integers(1, 4)):
            data[at] = generator.choice([generator.integers(0, 256), ord("9"), ord("-"), ord("\n"), 0, 255])
        damaged.append(bytes(data))
    for data in damaged:
        (tmp_path / name).write_bytes(data)
        meshes: tuple[Mesh, ...] = ()
        message = ""
        try:
            meshes = load_meshes(main, max_triangles=100_000)
        except SceneError as error:
            message = str(error)
        assert bool(meshes) != bool(message)
        assert "\n" not in message
        assert all(np.isfinite(mesh.vertices).all() and mesh.faces.max() < len(mesh.vertices) for mesh in meshes)
