"""Damaged mesh files: an error or a scene, nothing else, in bounded time and memory."""

from __future__ import annotations

import base64
import json
import signal
import struct
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import trimesh

from renderer.errors import SceneError
from renderer.mesh_file import load_model
from renderer.model import Model
from tests.renderer.model_files import (
    COLOURED,
    DAE_TRIANGLES,
    SQUARE,
    chunk,
    dae,
    glb,
    gltf,
    ply,
    png,
    three_ds,
    three_ds_cube,
    three_ds_object,
)

MUTATIONS = 150
"""Damaged copies of each file."""

MAX_SECONDS = 10
"""Longest time for one file of a few kilobytes, on a busy machine; a good one takes milliseconds."""

MAX_BYTES = 64 << 20
"""Most memory for one file of a few kilobytes."""

TELLING = (0, 1, 9, 10, 32, 45, 57, 60, 127, 128, 255)
"""Bytes that hurt: null, line feed, minus, digit, angle bracket, the limits of signed and unsigned bytes."""


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
        "a.3ds": a_3ds(),
        "a.dae": a_dae().encode(),
        "text.stl": trimesh.exchange.stl.export_stl_ascii(box).encode(),
    }


def a_3ds() -> bytes:
    """A cube with everything that is read of a 3DS file."""
    picture = chunk(0xA200, chunk(0xA300, b"t.png\0"))
    spot = chunk(0x4610, struct.pack("<5f", 0, 0, 0, 30, 40))
    of_faces = chunk(0x4130, b"m\0", struct.pack("<3H", 2, 0, 5)) + chunk(0x4150, struct.pack("<12I", *range(12)))
    uvs = chunk(0x4140, struct.pack("<H16f", 8, *range(16)))
    matrix = chunk(0x4160, struct.pack("<12f", -1, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0, 0))
    return three_ds(
        chunk(0xAFFF, chunk(0xA000, b"m\0"), chunk(0xA020, chunk(0x0011, b"\1\2\3")), picture),
        three_ds_object("Lamp", chunk(0x4600, struct.pack("<3f", 1, 2, 3), spot)),
        three_ds_object("Eye", chunk(0x4700, struct.pack("<8f", 0, -5, 1, 0, 0, 1, 0, 40))),
        three_ds_object("Box", three_ds_cube(uvs, matrix, in_faces=of_faces)),
    )


def a_dae() -> str:
    """A square with everything that is read of a COLLADA file."""
    libraries = (
        '<library_images><image id="i"><init_from>t.png</init_from></image></library_images><library_effects>'
        '<effect id="e"><profile_COMMON><newparam sid="f"><surface><init_from>i</init_from></surface></newparam>'
        '<newparam sid="p"><sampler2D><source>f</source></sampler2D></newparam><technique><phong>'
        '<diffuse><texture texture="p" texcoord="UV"/></diffuse><specular><color>1 1 1 1</color></specular>'
        "<shininess><float>9</float></shininess><transparency><float>0.5</float></transparency></phong>"
        '</technique></profile_COMMON></effect></library_effects><library_materials><material id="look">'
        '<instance_effect url="#e"/></material></library_materials><library_lights><light id="l"><technique_common>'
        "<point><color>1 1 1</color><quadratic_attenuation>1</quadratic_attenuation></point></technique_common>"
        '</light></library_lights><library_cameras><camera id="c"><optics><technique_common><perspective>'
        "<xfov>50</xfov></perspective></technique_common></optics></camera></library_cameras>"
        '<library_controllers><controller id="k"><skin source="#g"><bind_shape_matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1'
        "</bind_shape_matrix></skin></controller></library_controllers>"
    )
    nodes = (
        '<node><lookat>0 0 5 0 0 0 0 1 0</lookat><instance_camera url="#c"/><instance_light url="#l"/></node>'
        '<node id="n"><rotate>0 0 1 30</rotate><scale>2 3 4</scale><instance_geometry url="#g"/></node>'
        '<node><translate>1 2 3</translate><instance_node url="#n"/><instance_controller url="#k"/></node>'
    )
    vertex = '<input semantic="VERTEX" source="#corners" offset="0"/>'
    primitives = (
        f"{DAE_TRIANGLES}<polylist>{vertex}<vcount>4 3</vcount><p>0 1 2 3 0 1 2</p></polylist>"
        f"<polygons>{vertex}<p>0 1 2 3</p></polygons><tristrips>{vertex}<p>0 1 3 2</p></tristrips>"
        f"<trifans>{vertex}<p>0 1 2 3</p></trifans>"
    )
    return dae(primitives, asset='<unit meter="0.5"/><up_axis>Z_UP</up_axis>', nodes=nodes, libraries=libraries)


def damaged(good: bytes, generator: np.random.Generator) -> Iterator[bytes]:
    """Copies of `good`, each damaged in one of five ways."""
    for index in range(MUTATIONS):
        data = bytearray(good)
        at, until = sorted(int(place) for place in generator.integers(0, len(good), 2))
        match index % 5:
            case 0:
                for place in generator.integers(0, len(good), generator.integers(1, 4)):
                    data[place] = generator.choice([generator.integers(0, 256), *TELLING])
            case 1:
                data[at] ^= 1 << int(generator.integers(0, 8))
            case 2:
                del data[at:]
            case 3:
                data[at:at] = generator.integers(0, 256, generator.integers(1, 9), dtype=np.uint8).tobytes()
            case _:
                data[at:at] = data[at:until] * int(generator.integers(1, 4))
        yield bytes(data)


@contextmanager
def bounded(seconds: int) -> Iterator[None]:
    """Raise TimeoutError in a block that runs for longer."""

    def ring(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def read(path: Path) -> Model | str:
    """The model, or the message of the SceneError."""
    try:
        with bounded(MAX_SECONDS):
            return load_model(path, max_triangles=100_000)
    except SceneError as error:
        return str(error)


@pytest.mark.parametrize("name", list(good_files()))
def test_damaged_files_give_a_model_or_a_scene_error(tmp_path: Path, name: str) -> None:
    files = good_files()
    (tmp_path / "t.png").write_bytes(png((9, 8, 7)))
    (tmp_path / "m.mtl").write_bytes(files["m.mtl"])
    main = tmp_path / ("a.obj" if name == "m.mtl" else name)
    main.write_bytes(files[main.name])
    assert isinstance(read(main), Model)
    results: list[Model | str] = []
    tracemalloc.start()
    try:
        for data in damaged(files[name], np.random.default_rng(5)):
            (tmp_path / name).write_bytes(data)
            tracemalloc.reset_peak()
            before, _ = tracemalloc.get_traced_memory()
            results.append(read(main))
            assert tracemalloc.get_traced_memory()[1] - before < MAX_BYTES
    finally:
        tracemalloc.stop()
    models = [result for result in results if isinstance(result, Model)]
    messages = [result for result in results if isinstance(result, str)]
    assert messages
    assert all("expected" in message and "\n" not in message for message in messages)
    for model in models:
        assert model.meshes
        for mesh in model.meshes:
            assert np.isfinite(mesh.vertices).all()
            assert mesh.faces.max() < len(mesh.vertices)


@pytest.mark.parametrize("name", ["a.glb", "little.ply", "big.ply", "binary.stl", "a.3ds"])
@pytest.mark.parametrize("bits", ["7fa00000", "7fc00000", "7f800000", "ff800000", "7f7fffff"])
def test_numbers_that_are_none_are_told_by_an_error_and_not_by_a_warning(tmp_path: Path, name: str, bits: str) -> None:
    """Signalling and quiet NaN, both infinities and the largest float in place of each 1.0."""
    one, number = (bytes.fromhex(part)[:: 1 if name == "big.ply" else -1] for part in ("3f800000", bits))
    if name == "binary.stl":
        one = bytes.fromhex("0000003f")
    good = good_files()[name]
    assert one in good
    (tmp_path / "t.png").write_bytes(png((9, 8, 7)))
    (tmp_path / name).write_bytes(good.replace(one, number))
    message = read(tmp_path / name)
    assert isinstance(message, str)
    assert "expected finite coordinates" in message
