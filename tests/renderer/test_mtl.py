"""MTL files: what their statements mean, their textures, and mistakes told with their line."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.errors import SceneError
from renderer.framing import DEFAULT_MATERIAL
from renderer.scene import Material
from tests.renderer.model_files import KD, NONE, SQUARE, load, png, refused


def material(folder: Path, statements: str) -> Material:
    (folder / "a.mtl").write_text(f"newmtl m\n{statements}\n")
    (mesh,) = load(folder, "a.obj", SQUARE + "mtllib a.mtl\nusemtl m\nf 1 2 3\n")
    return mesh.material


BASE = "Kd 0.2 0.4 0.6\nKs 0.5 0.5 0.25\nNs 60\n"
KS = (0.5, 0.5, 0.25)
HIGHLIGHT = tuple(part / math.pi for part in KS)


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


def test_maps_of_highlights_and_maps_that_are_clamped(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png((10, 20, 30)))
    shiny = material(tmp_path, "illum 3\nmap_Ks -clamp on a.png\nmap_Kd a.png")
    assert shiny.specular_texture is not None
    assert shiny.diffuse_texture is not None
    assert (shiny.specular_texture.wrap_u, shiny.specular_texture.wrap_v) == ("clamp", "clamp")
    assert shiny.diffuse_texture.wrap_u == "repeat"
    assert shiny.reflection == (1.0, 1.0, 1.0)
    assert shiny.normal_texture is None
    for statement in ("norm -bm 1 a.png", "map_Kn a.png", "map_Bump none.png\nnorm a.png"):
        bumpy = material(tmp_path, statement)
        assert bumpy.normal_texture is not None
        assert bumpy.normal_texture.pixels.tolist() == [[[10, 20, 30]]]
    holes = material(tmp_path, "map_d a.png")
    assert holes.alpha_texture is not None
    assert holes.alpha_texture.opacity.tolist() == [[20]]
    assert material(tmp_path, "Ks 0.5 0.5 0.5\nmap_Ks a.png").specular == pytest.approx((0.5 / math.pi,) * 3)


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
