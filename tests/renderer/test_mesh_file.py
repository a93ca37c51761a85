"""Mesh files: what holds for every format, and STL."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from renderer.errors import SceneError
from renderer.mesh_file import load_model
from tests.renderer.model_files import SQUARE, load, refused, volume


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
            load_model(tmp_path / name)


def test_a_mesh_file_reached_through_a_link_is_the_users_own_choice(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "real.obj").write_text(SQUARE + "f 1 2 3\n")
    (tmp_path / "link.obj").symlink_to("elsewhere/real.obj")
    assert len(load_model(tmp_path / "link.obj").meshes) == 1


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
    script = "import sys, pathlib, renderer.mesh_file as m\n"
    script += "print(m.load_model(pathlib.Path(sys.argv[1])).meshes[0].faces.shape)"
    command = [sys.executable, "-c", script, str(tmp_path / "a.stl")]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert (run.stdout.strip(), run.stderr) == ("(12, 3)", "")


@pytest.mark.parametrize("data", [b"solid\nendsolid\n", b"\0" * 84, b"\0" * 80 + b"\5\0\0\0" + b"\0" * 100, b"hello"])
def test_stl_without_triangles_or_cut_short(tmp_path: Path, data: bytes) -> None:
    assert refused(tmp_path, "a.stl", data).startswith("a.stl: expected")
