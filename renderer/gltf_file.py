"""Meshes, lights and cameras of glTF 2.0 files, binary (.glb) or text (.gltf).

Read here rather than by a library, so that normalised integers, sparse accessors and strides come out right,
textures pass through the limits of `codec`, and damage is said with the field's name. Of the default scene,
every triangle primitive becomes one mesh with its node's transform applied; lights and the first camera stand
where their nodes are. Lines, points, skins and animations are skipped; a file that requires compressed geometry
is refused.

Source: Khronos glTF 2.0 specification.
"""

from __future__ import annotations

import dataclasses
import json
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.codec import decode_texture
from renderer.errors import SceneError
from renderer.fields import Fields
from renderer.folder import Folder
from renderer.framing import DEFAULT_MATERIAL
from renderer.gltf_data import LARGEST_INDEX, GltfData
from renderer.gltf_material import GltfMaterial, read_material
from renderer.gltf_view import light_of, read_camera, read_light
from renderer.model import Model, StatedLight
from renderer.placement import placed
from renderer.scene import MAX_COORDINATE_M, Mesh, Texture

_TRIANGLES, _STRIP, _FAN = 4, 5, 6

_REPEAT: Final = 10497
_WRAPS: Final = {_REPEAT: "repeat", 33071: "clamp", 33648: "mirror"}
"""OpenGL's numbers for what a texture shows beyond its edges."""

_SUPPORTED: Final = re.compile(
    r"KHR_materials_\w+|KHR_lights_punctual|KHR_texture_transform|KHR_mesh_quantization|EXT_texture_webp"
)
"""Extensions that a file may require; the geometry of others could not be shown."""


def read_gltf(folder: Folder, data: bytes, inner: str, max_triangles: int) -> Model:
    """The content of a glTF file, its meshes in the order in which its nodes show them.

    Args:
        folder: where its buffers and images may lie.
        data: the file, of either kind.
        inner: its path from the folder's root.
        max_triangles: refuse more, counting a mesh each time it is shown.

    Raises:
        SceneError: naming the file and the field.
    """
    label = folder.file_label(inner)
    text, chunk = _unpack(data, label)
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{label}: expected JSON, found damage: {error}") from None
    top = Fields(tree, label)
    if not top.table("asset").text("version").startswith("2."):
        raise SceneError(f"{label}: asset.version: expected 2.0, found {top.table('asset').text('version')!r}")
    for extension in top.items("extensionsRequired"):
        if not isinstance(extension, str) or not _SUPPORTED.fullmatch(extension):
            raise top.refuse("extensionsRequired", "extensions that this renderer knows", extension)
    source = GltfData(folder, inner, top, chunk, max_items=4 * max_triangles)
    return _Reader(source, max_triangles).model()


def _unpack(data: bytes, label: str) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a file; a text file has no chunk."""
    if not data.startswith(b"glTF"):
        return data, None
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + length > len(data):
            raise SceneError(f"{label}: expected {length} bytes from byte {at + 8} on, found {len(data) - at - 8}")
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    if b"JSON" not in chunks:
        raise SceneError(f"{label}: expected a JSON chunk, found none in {len(data)} bytes")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


@dataclass(slots=True)
class _Reader:
    """What is read of one file; textures, materials and meshes are each read once."""

    data: GltfData
    max_triangles: int
    textures: dict[tuple[int, str, str], Texture] = field(default_factory=dict)
    materials: dict[int, GltfMaterial] = field(default_factory=dict)
    primitives: dict[int, list[Mesh]] = field(default_factory=dict)
    triangles: int = 0
    notes: list[str] = field(default_factory=list)

    def model(self) -> Model:
        """The content of all nodes of the scene."""
        meshes: list[Mesh] = []
        lights: list[StatedLight] = []
        cameras: list[Camera] = []
        for node, world_from_node in self._nodes():
            if "mesh" in node:
                meshes.extend(placed(mesh, world_from_node) for mesh in self._shown(node))
            light = light_of(node)
            if light is not None:
                lights.append(read_light(self.data.top, light, world_from_node))
            if "camera" in node and not cameras:
                camera = read_camera(
                    self.data.entry("cameras", node.integer("camera", 0, LARGEST_INDEX)), world_from_node
                )
                if camera is None:
                    self.notes.append(f"{node.place}: an orthographic camera is left out")
                else:
                    cameras.append(camera)
        return Model(tuple(meshes), tuple(lights), camera=cameras[0] if cameras else None, notes=tuple(self.notes))

    def _shown(self, node: Fields) -> list[Mesh]:
        """The meshes of a node, not yet placed."""
        index = node.integer("mesh", 0, LARGEST_INDEX)
        if index not in self.primitives:
            self.primitives[index] = list(self._primitives(self.data.entry("meshes", index)))
        self.triangles += sum(len(mesh.faces) for mesh in self.primitives[index])
        if self.triangles > self.max_triangles:
            raise SceneError(f"{self.data.top.file}: expected at most {self.max_triangles} triangles, found more")
        return self.primitives[index]

    def _nodes(self) -> Iterator[tuple[Fields, NDArray[np.float64]]]:
        """All nodes of the scene, depth first, with their (4, 4) transforms to the world."""
        if self.data.top.items("scenes"):
            roots = _indices(self.data.entry("scenes", self.data.top.integer("scene", 0, LARGEST_INDEX, 0)), "nodes")
        else:
            children = {child for node in self.data.top.tables("nodes") for child in _indices(node, "children")}
            roots = [index for index in range(len(self.data.top.items("nodes"))) if index not in children]
        seen: set[int] = set()
        waiting = [(index, np.eye(4)) for index in reversed(roots)]
        while waiting:
            index, world_from_parent = waiting.pop()
            node = self.data.entry("nodes", index)
            if index in seen:
                raise SceneError(f"{self.data.top.file}: nodes[{index}]: expected one parent, found more or a circle")
            seen.add(index)
            world_from_node = world_from_parent @ _parent_from_node(node)
            if not (np.abs(world_from_node) <= MAX_COORDINATE_M).all():
                raise SceneError(
                    f"{self.data.top.file}: nodes[{index}]: expected a transform up to {MAX_COORDINATE_M:g}"
                )
            yield node, world_from_node
            waiting.extend((child, world_from_node) for child in reversed(_indices(node, "children")))

    def _primitives(self, mesh: Fields) -> Iterator[Mesh]:
        """The triangle primitives of a mesh, not yet placed."""
        name = mesh.text("name", mesh.place)
        for primitive in mesh.tables("primitives"):
            mode = primitive.integer("mode", 0, 6, _TRIANGLES)
            attributes = primitive.table("attributes")
            if mode < _TRIANGLES or "POSITION" not in attributes:
                continue
            vertices = self.data.vectors(attributes, "POSITION", "VEC3")
            if "indices" in primitive:
                indices = self.data.indices(primitive, "indices")
            else:
                indices = np.arange(len(vertices))
            look = GltfMaterial(DEFAULT_MATERIAL)
            if "material" in primitive:
                look = self._material(primitive.integer("material", 0, LARGEST_INDEX))
            stated = look.material.normal_texture is not None and look.uv_transform is None
            yield Mesh(
                vertices,
                _faces(primitive, mode, indices),
                look.material,
                self._matching(attributes, "NORMAL", "VEC3", len(vertices)),
                _texture_coordinates(
                    self._matching(attributes, f"TEXCOORD_{look.texcoord}", "VEC2", len(vertices)), look
                ),
                name=f"{self.data.top.file}: {name!r}",
                tangents=self._matching(attributes, "TANGENT", "VEC4", len(vertices)) if stated else None,
            )

    def _matching(self, attributes: Fields, key: str, kind: str, count: int) -> NDArray[np.float64] | None:
        """An attribute with a value for each of `count` vertices; None where it is absent."""
        if key not in attributes:
            return None
        values = self.data.vectors(attributes, key, kind)
        if len(values) != count:
            raise attributes.refuse(key, f"{count} values, one for each vertex", len(values))
        return values

    def _material(self, index: int) -> GltfMaterial:
        if index not in self.materials:
            fields = self.data.entry("materials", index)
            self.materials[index] = read_material(fields, fields.text("name", fields.place), self._texture)
            self.notes.extend(self.materials[index].notes)
        return self.materials[index]

    def _texture(self, info: Fields) -> Texture:
        """The image of the texture that a textureInfo object points at."""
        texture = self.data.entry("textures", info.integer("index", 0, LARGEST_INDEX))
        webp = texture.table("extensions").table("EXT_texture_webp")
        index = (webp if "source" in webp else texture).integer("source", 0, LARGEST_INDEX)
        wrap_u, wrap_v = self._wraps(texture)
        if (index, wrap_u, wrap_v) not in self.textures:
            plain = decode_texture(*self.data.image(index), self.data.folder.max_texture_pixels)
            self.textures[index, wrap_u, wrap_v] = dataclasses.replace(plain, wrap_u=wrap_u, wrap_v=wrap_v)
        return self.textures[index, wrap_u, wrap_v]

    def _wraps(self, texture: Fields) -> tuple[str, str]:
        """What the sampler of a texture shows beyond its edges, across and up."""
        if "sampler" not in texture:
            return "repeat", "repeat"
        sampler = self.data.entry("samplers", texture.integer("sampler", 0, LARGEST_INDEX))
        stated = [sampler.integer(key, 0, LARGEST_INDEX, _REPEAT) for key in ("wrapS", "wrapT")]
        for key, code in zip(("wrapS", "wrapT"), stated, strict=True):
            if code not in _WRAPS:
                raise sampler.refuse(key, f"one of {', '.join(map(str, _WRAPS))}", code)
        return _WRAPS[stated[0]], _WRAPS[stated[1]]


def _indices(owner: Fields, key: str) -> list[int]:
    """A list of indices; empty where it is absent."""
    values = owner.items(key)
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise owner.refuse(key, "indices from 0", value)
    return [value for value in values if isinstance(value, int)]


def _parent_from_node(node: Fields) -> NDArray[np.float64]:
    """(4, 4) transform of a node: its matrix, or translation * rotation * scale."""
    limit = MAX_COORDINATE_M
    if "matrix" in node:
        stated = np.array(node.numbers("matrix", 16, -limit, limit)).reshape(4, 4).T
        if not np.allclose(stated[3], (0.0, 0.0, 0.0, 1.0)):
            raise node.refuse("matrix", "a last row of 0 0 0 1", stated[3].tolist())
        return stated
    matrix = np.eye(4)
    x, y, z, w = node.numbers("rotation", 4, -limit, limit, (0.0, 0.0, 0.0, 1.0))
    length = (x * x + y * y + z * z + w * w) ** 0.5
    if length == 0.0:
        raise node.refuse("rotation", "a quaternion of unit length", [x, y, z, w])
    x, y, z, w = x / length, y / length, z / length, w / length
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix[:3, :3] = rotation * np.array(node.numbers("scale", 3, -limit, limit, (1.0, 1.0, 1.0)))
    matrix[:3, 3] = node.numbers("translation", 3, -limit, limit, (0.0, 0.0, 0.0))
    return matrix


def _faces(primitive: Fields, mode: int, indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) faces of a list, strip or fan of triangles."""
    if mode == _TRIANGLES:
        if len(indices) % 3:
            raise primitive.refuse("indices", "a multiple of 3", f"{len(indices)} indices")
        return indices.reshape(-1, 3)
    if len(indices) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if mode == _FAN:
        return np.stack([np.full(len(indices) - 2, indices[0]), indices[1:-1], indices[2:]], axis=1)
    strip = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip


def _texture_coordinates(values: NDArray[np.float64] | None, look: GltfMaterial) -> NDArray[np.float64] | None:
    """uvs of a mesh, v up, from texture coordinates of the file, v down."""
    if values is None:
        return None
    if look.uv_transform is not None:
        with np.errstate(all="ignore"):
            values = values @ look.uv_transform[:, :2].T + look.uv_transform[:, 2]
    return np.stack([values[:, 0], 1.0 - values[:, 1]], axis=1)
