"""3DS files: geometry, materials, smoothing groups, lights, cameras, and mistakes told with their chunk."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest

from renderer.framing import DEFAULT_MATERIAL
from renderer.mesh_file import load_model
from renderer.model import Model
from renderer.texture import srgb_to_linear
from tests.renderer.model_files import (
    CUBE,
    CUBE_FACES,
    area_vector,
    chunk,
    load,
    png,
    refused,
    three_ds,
    three_ds_cube,
    three_ds_object,
    volume,
)

CUBE_FILE = three_ds(three_ds_object("Box01", three_ds_cube()))


def read(folder: Path, *content: bytes) -> Model:
    (folder / "a.3ds").write_bytes(three_ds(*content))
    return load_model(folder / "a.3ds")


def percent(kind: int, value: int) -> bytes:
    return chunk(kind, chunk(0x0030, struct.pack("<H", value)))


def color(kind: int, *codes: int) -> bytes:
    return chunk(kind, chunk(0x0011, bytes(codes)))


def material(*content: bytes, name: str = "m") -> bytes:
    return chunk(0xAFFF, chunk(0xA000, name.encode() + b"\0"), *content)


def of_faces(name: str, *faces: int) -> bytes:
    return chunk(0x4130, name.encode() + b"\0", struct.pack(f"<H{len(faces)}H", len(faces), *faces))


def smoothing(*groups: int) -> bytes:
    return chunk(0x4150, struct.pack(f"<{len(groups)}I", *groups))


def test_a_cube_of_300_bytes_stands_upright(tmp_path: Path) -> None:
    assert len(CUBE_FILE) < 310
    vertices = [(x, y, 5 * z) for x, y, z in CUBE]
    (mesh,) = read(tmp_path, three_ds_object("Box01", three_ds_cube(vertices=vertices))).meshes
    np.testing.assert_array_equal(mesh.faces, CUBE_FACES)
    np.testing.assert_array_equal(np.ptp(mesh.vertices, axis=0), [1, 5, 1])
    assert volume(mesh) == pytest.approx(5.0)
    assert mesh.normals is None
    assert mesh.material is DEFAULT_MATERIAL
    # the file's y, away from the viewer, is the renderer's -z
    np.testing.assert_array_equal(mesh.vertices[2], [0, 0, -1])


def test_materials_and_face_groups(tmp_path: Path) -> None:
    (tmp_path / "Wood.PNG").write_bytes(png((10, 20, 30)))
    laid = chunk(0xA356, struct.pack("<f", 2)) + chunk(0xA35A, struct.pack("<f", 0.5))
    picture = chunk(0xA200, chunk(0xA300, b"C:\\MAPS\\WOOD.png\0"), laid)
    shine = chunk(0xA204, chunk(0xA300, b"wood.png\0"))
    uvs = chunk(0x4140, struct.pack("<H16f", 8, *([0.25, 1.0] * 8)))
    colors = color(0xA020, 255, 128, 0) + color(0xA030, 255, 255, 255)
    glassy = material(colors, percent(0xA040, 30), percent(0xA041, 50), percent(0xA050, 25))
    groups = of_faces("m", 0, 1, 2) + of_faces("wood", 3, 4) + of_faces("none", 5)
    model = read(
        tmp_path,
        glassy,
        three_ds_object("Box", three_ds_cube(uvs, in_faces=groups)),
        material(picture, shine, percent(0xA084, 50), name="wood"),
    )
    first, wood, unknown, rest = model.meshes
    assert [len(mesh.faces) for mesh in model.meshes] == [3, 2, 1, 6]
    orange = srgb_to_linear(np.array([255, 128, 0]) / 255)
    np.testing.assert_allclose(first.material.diffuse, 0.75 * orange)
    np.testing.assert_allclose(first.material.specular, 0.5 / math.pi)
    assert first.material.shininess == pytest.approx(8.0)
    assert first.material.transmission == (0.25, 0.25, 0.25)
    assert first.material.ior == 1.0
    assert wood.material.diffuse_texture is not None
    assert wood.material.diffuse == (1.0, 1.0, 1.0)
    assert wood.material.specular_texture is not None
    np.testing.assert_allclose(wood.material.specular, 1 / math.pi)
    assert wood.material.emission == (0.5, 0.5, 0.5)
    assert wood.uvs is not None
    np.testing.assert_allclose(wood.uvs, [[0.5, 1.5]] * len(wood.vertices))
    assert unknown.material is DEFAULT_MATERIAL
    assert rest.material is DEFAULT_MATERIAL
    np.testing.assert_allclose(sum(area_vector(mesh) for mesh in model.meshes), 0, atol=1e-12)


@pytest.mark.parametrize("name", ["missing.png", "../a.png", "/etc/passwd", "a.3ds"])
def test_textures_that_cannot_be_read_are_left_out_with_a_note(tmp_path: Path, name: str) -> None:
    look = material(chunk(0xA200, chunk(0xA300, name.encode() + b"\0")))
    model = read(tmp_path, look, three_ds_object("Box", three_ds_cube(in_faces=of_faces("m", *range(12)))))
    assert model.meshes[0].material.diffuse_texture is None
    assert len(model.notes) == 1
    assert model.notes[0].startswith("texture left out: ")


def test_smoothing_groups_round_the_edges_they_share(tmp_path: Path) -> None:
    (whole,) = read(tmp_path, three_ds_object("Box", three_ds_cube(in_faces=smoothing(*[4] * 12)))).meshes
    assert whole.normals is not None
    assert len(whole.vertices) == 8
    outward = whole.vertices - whole.vertices.mean(axis=0)
    assert (np.einsum("ij,ij->i", whole.normals, outward) > 0).all()
    # bottom and top flat, sides rounded into each other
    (sides,) = read(tmp_path, three_ds_object("Box", three_ds_cube(in_faces=smoothing(0, 0, 0, 0, *[1] * 8)))).meshes
    assert sides.normals is not None
    normals = sides.normals[sides.faces]
    assert (normals[:4] == 0).all()
    np.testing.assert_array_equal(normals[4:, :, 1], 0)
    assert (np.abs(normals[4:, :, 0]) > 0).all()
    # each side its own group: as flat faces are
    groups = [1 << (face // 2) for face in range(12)]
    (edged,) = read(tmp_path, three_ds_object("Box", three_ds_cube(in_faces=smoothing(*groups)))).meshes
    a, b, c = (edged.vertices[edged.faces[:, i]] for i in range(3))
    own = np.cross(b - a, c - a)
    shared = edged.normals[edged.faces]
    np.testing.assert_allclose(np.cross(shared, own[:, None]), 0, atol=1e-12)
    assert len(edged.vertices) == 24


def test_faces_smooth_by_way_of_a_third(tmp_path: Path) -> None:
    groups = [1, 1, 2, 2, 3, 3, 0, 0, 0, 0, 0, 0]
    (mesh,) = read(tmp_path, three_ds_object("Box", three_ds_cube(in_faces=smoothing(*groups)))).meshes
    assert mesh.normals is not None
    normals = mesh.normals[mesh.faces]
    edge = [(face, corner) for face in (0, 1, 4, 5) for corner in range(3) if CUBE_FACES[face][corner] == 0]
    first = normals[edge[0]]
    assert all((normals[place] == first).all() for place in edge)
    assert first[1] < 0
    assert first[2] > 0


def test_lights_and_the_camera(tmp_path: Path) -> None:
    def lamp(*more: bytes) -> bytes:
        return chunk(0x4600, struct.pack("<3f", 1, 2, 3), chunk(0x0010, struct.pack("<3f", 1, 0.5, 0)), *more)

    model = read(
        tmp_path,
        color(0x2100, 255, 0, 0),
        three_ds_object("Lamp", lamp(chunk(0x465B, struct.pack("<f", 2)))),
        three_ds_object("Spot", lamp(chunk(0x4610, struct.pack("<5f", 0, 0, 0, 30, 40)))),
        three_ds_object("Off", lamp(chunk(0x4620))),
        three_ds_object("Eye", chunk(0x4700, struct.pack("<8f", 0, -5, 1, 0, 0, 1, 0, 40))),
        three_ds_object("Box", three_ds_cube()),
    )
    point, spot = model.lights
    assert point.position == spot.position == (1.0, 3.0, -2.0)
    half = float(srgb_to_linear(np.array(0.5)))
    np.testing.assert_allclose(point.irradiance, [2 * math.pi, 2 * math.pi * half, 0])
    np.testing.assert_allclose(spot.irradiance, [math.pi, math.pi * half, 0])
    assert model.ambient == (1.0, 0.0, 0.0)
    assert model.camera is not None
    assert model.camera.position == (0.0, 1.0, 5.0)
    assert model.camera.look_at == (0.0, 1.0, 0.0)
    np.testing.assert_allclose(model.camera.up, (0, 1, 0))
    # 2400 / 40 mm: 60 degrees across a picture of 4:3
    assert math.tan(math.radians(model.camera.vertical_fov_deg) / 2) == pytest.approx(math.tan(math.radians(30)) * 0.75)
    assert len(model.notes) == 1


def test_a_camera_that_looks_straight_down_or_nowhere(tmp_path: Path) -> None:
    box = three_ds_object("Box", three_ds_cube())
    down = three_ds_object("Eye", chunk(0x4700, struct.pack("<8f", 0, 0, 9, 0, 0, 0, 0, 40)))
    assert read(tmp_path, box, down).camera is not None
    nowhere = three_ds_object("Eye", chunk(0x4700, struct.pack("<8f", 1, 1, 1, 1, 1, 1, 0, 40)))
    model = read(tmp_path, box, nowhere)
    assert model.camera is None
    assert len(model.notes) == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"\x4d\x4d", b"\x4d\x4e", "expected a 3DS file, found something else"),
        (b"\x10\x41\x68", b"\x10\x41\x00", "chunk 4110, byte 40: expected a length from 6 to 208, found 0"),
        (b"\x10\x41\x68", b"\x10\x41\xf0", "chunk 4110, byte 40: expected a length from 6 to 208, found 240"),
        (b"\x68\0\0\0\x08\0", b"\x68\0\0\0\x09\0", "chunk 4110, byte 48: expected 108 bytes for 27 numbers, found 96"),
        (b"\x0c\0\0\0\x02\0\x03", b"\x0d\0\0\0\x02\0\x03", "chunk 4120, byte 152: expected 104 bytes for 52 numbers"),
        (b"\x0c\0\0\0\x02\0\x03", b"\x0c\0\0\0\x09\0\x03", "object 'Box01': face 0: expected vertex indices from 0"),
        (b"Box01\0", b"Box01!", "chunk d641, byte 35: expected a length from 6 to 213"),
        (b"\0\0\x80?", b"\0\0\xc0\x7f", "object 'Box01': vertex 1: expected finite coordinates"),
    ],
)
def test_mistakes_are_told_with_their_chunk(tmp_path: Path, old: bytes, new: bytes, message: str) -> None:
    assert old in CUBE_FILE
    assert refused(tmp_path, "a.3ds", CUBE_FILE.replace(old, new, 1)).startswith(f"a.3ds: {message}")


def test_face_groups_and_texture_coordinates_must_fit(tmp_path: Path) -> None:
    bad = three_ds(three_ds_object("Box", three_ds_cube(in_faces=of_faces("m", 12))))
    assert "expected faces below 12, found 12" in refused(tmp_path, "a.3ds", bad)
    bad = three_ds(three_ds_object("Box", three_ds_cube(chunk(0x4140, struct.pack("<H2f", 1, 0, 0)))))
    assert "object 'Box': expected 8 texture coordinates, found 1" in refused(tmp_path, "a.3ds", bad)
    bad = three_ds(three_ds_object("Box", three_ds_cube(in_faces=smoothing(1, 1))))
    assert "expected 48 bytes for 12 numbers, found 8" in refused(tmp_path, "a.3ds", bad)


def test_triangles_of_all_objects_are_limited(tmp_path: Path) -> None:
    boxes = three_ds(*[three_ds_object("Box", three_ds_cube())] * 3)
    assert len(load(tmp_path, "a.3ds", boxes, max_triangles=36)) == 3
    assert "expected at most 35 triangles" in refused(tmp_path, "a.3ds", boxes, max_triangles=35)


def test_cut_short_anywhere_is_an_error(tmp_path: Path) -> None:
    for end in range(len(CUBE_FILE)):
        assert refused(tmp_path, "a.3ds", CUBE_FILE[:end])
