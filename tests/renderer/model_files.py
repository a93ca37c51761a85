"""Small files of every format, written by the tests, and what is asked of the meshes in them."""

from __future__ import annotations

import base64
import io
import json
import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from renderer.errors import SceneError
from renderer.mesh_file import load_model
from renderer.scene import Mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def load(folder: Path, name: str, content: str | bytes, **limits: int) -> tuple[Mesh, ...]:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_model(path, **limits).meshes


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


KD = (0.2, 0.4, 0.6)


NONE = (0.0, 0.0, 0.0)


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


def chunk(kind: int, *content: bytes) -> bytes:
    """A chunk of a 3DS file."""
    body = b"".join(content)
    return struct.pack("<HI", kind, 6 + len(body)) + body


CUBE = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
CUBE_QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
CUBE_FACES = [(q[0], q[i], q[i + 1]) for q in CUBE_QUADS for i in (1, 2)]


def three_ds_cube(*more: bytes, vertices: Sequence[tuple[float, ...]] = CUBE, in_faces: bytes = b"") -> bytes:
    """The mesh chunk of the unit cube, of edge 1 from the origin, outside counter-clockwise; about 300 bytes."""
    points = b"".join(struct.pack("<3f", *vertex) for vertex in vertices)
    faces = b"".join(struct.pack("<4H", *face, 0) for face in CUBE_FACES)
    return chunk(
        0x4100,
        chunk(0x4110, struct.pack("<H", len(vertices)), points),
        chunk(0x4120, struct.pack("<H", len(CUBE_FACES)), faces, in_faces),
        *more,
    )


def three_ds(*content: bytes) -> bytes:
    """A 3DS file whose editor holds `content`."""
    return chunk(0x4D4D, chunk(0x0002, struct.pack("<I", 3)), chunk(0x3D3D, *content), chunk(0xB000))


def three_ds_object(name: str, *content: bytes) -> bytes:
    return chunk(0x4000, name.encode() + b"\0", *content)


def dae_source(name: str, values: Sequence[float], stride: int) -> str:
    """A source of a COLLADA geometry."""
    numbers = " ".join(map(str, values))
    return (
        f'<source id="{name}"><float_array id="{name}-a" count="{len(values)}">{numbers}</float_array>'
        f'<technique_common><accessor source="#{name}-a" count="{len(values) // stride}" stride="{stride}"/>'
        "</technique_common></source>"
    )


DAE_SQUARE = (
    dae_source("square", (0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0), 3)
    + '<vertices id="corners"><input semantic="POSITION" source="#square"/></vertices>'
)
"""Sources of the unit square in the plane z = 0."""

DAE_TRIANGLES = (
    '<triangles count="2" material="look"><input semantic="VERTEX" source="#corners" offset="0"/>'
    "<p>0 1 2 0 2 3</p></triangles>"
)


def dae(
    primitives: str = DAE_TRIANGLES,
    *,
    sources: str = DAE_SQUARE,
    asset: str = "<up_axis>Y_UP</up_axis>",
    nodes: str = '<node><instance_geometry url="#g"/></node>',
    libraries: str = "",
) -> str:
    """A COLLADA file with one geometry `g`, and nodes that show it."""
    return (
        '<?xml version="1.0" encoding="utf-8"?>'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n'
        f"<asset>{asset}</asset>\n{libraries}\n"
        f'<library_geometries><geometry id="g" name="square"><mesh>\n{sources}\n{primitives}\n</mesh></geometry>'
        f'</library_geometries>\n<library_visual_scenes><visual_scene id="s">\n{nodes}\n</visual_scene>'
        '</library_visual_scenes>\n<scene><instance_visual_scene url="#s"/></scene></COLLADA>\n'
    )
