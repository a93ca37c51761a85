"""Meshes, lights and the camera of 3D Studio files (.3ds).

Every length is checked against the chunk around it and every count against its chunk's length before
anything is read. The state of the editor is shown; the keyframer's animation is left out. 3DS is z-up and is
turned to y-up; its unit is not stated and counts as a metre. A spot lights to all sides, as bright as on its
axis, and every light lights the middle of the model as brightly as the file says: a white surface shows there as
the light's colour.

Source: 3D Studio File Toolkit, 1996; lib3ds (mirrored meshes, lens).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera
from renderer.errors import SceneError, SettingsError
from renderer.folder import Folder
from renderer.framing import DEFAULT_MATERIAL
from renderer.model import Model, StatedLight, vertical_fov
from renderer.scene import BLACK, MAX_COORDINATE_M, Mesh, Rgb
from renderer.smoothing import smoothed
from renderer.texture_search import TextureSearch
from renderer.three_ds_chunk import Chunk
from renderer.three_ds_material import ThreeDsMaterial, read_material

_MAIN, _EDITOR = 0x4D4D, 0x3D3D
_AMBIENT, _MATERIAL, _OBJECT = 0x2100, 0xAFFF, 0x4000
_MESH, _LIGHT, _CAMERA = 0x4100, 0x4600, 0x4700
_VERTICES, _FACES, _FACE_MATERIAL, _UVS, _SMOOTHING, _MATRIX = 0x4110, 0x4120, 0x4130, 0x4140, 0x4150, 0x4160
_SPOT, _LIGHT_OFF, _MULTIPLIER = 0x4610, 0x4620, 0x465B

LENS_DEG_MM: Final = 2400.0
"""Horizontal field of view [deg] times focal length [mm] of a 3D Studio camera (lib3ds)."""

ASPECT: Final = 4.0 / 3.0
"""Width over height of 3D Studio's pictures, which the horizontal field of view fills."""

MAX_MULTIPLIER: Final = 1e6
"""Largest factor on a light's colour."""

_Y_UP: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From 3DS coordinates, z up, to the renderer's."""


def read_three_ds(folder: Folder, data: bytes, inner: str, max_triangles: int) -> Model:
    """The content of a 3DS file, a mesh for each object and material, in file order.

    Args:
        folder: where its textures may lie.
        data: the file.
        inner: its path from the folder's root.
        max_triangles: refuse more.

    Raises:
        SceneError: naming the file, the chunk and its place.
    """
    label = folder.file_label(inner)
    main = next(Chunk(data, label, 0, 0, len(data)).chunks(), None)
    if main is None or main.kind != _MAIN:
        raise SceneError(f"{label}: expected a 3DS file, found something else")
    reader = _Reader(label, TextureSearch(folder, inner), max_triangles)
    for editor in main.chunks():
        if editor.kind == _EDITOR:
            reader.editor(editor)
    return reader.model()


@dataclass(slots=True)
class _Object:
    """A mesh as read so far, in the file's coordinates.

    Attributes:
        materials: material groups, each a name and the faces that have it.
    """

    vertices: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    faces: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))
    uvs: NDArray[np.float64] | None = None
    groups: NDArray[np.uint32] | None = None
    matrix: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    materials: list[tuple[str, NDArray[np.int64]]] = field(default_factory=list)


@dataclass(slots=True)
class _Reader:
    """What is read of one file; materials may follow the meshes that have them."""

    label: str
    textures: TextureSearch
    max_triangles: int
    materials: dict[str, ThreeDsMaterial] = field(default_factory=dict)
    objects: list[tuple[str, _Object]] = field(default_factory=list)
    lights: list[StatedLight] = field(default_factory=list)
    ambient: Rgb = BLACK
    camera: Camera | None = None
    triangles: int = 0

    def editor(self, chunk: Chunk) -> None:
        """Take in the editor's state."""
        for part in chunk.chunks():
            if part.kind == _MATERIAL:
                look = read_material(part, self.textures)
                self.materials.setdefault(look.material.name, look)
            elif part.kind == _AMBIENT:
                self.ambient = part.color(BLACK)
            elif part.kind == _OBJECT:
                self._object(part)

    def model(self) -> Model:
        """What was read."""
        meshes = tuple(mesh for name, found in self.objects for mesh in self._meshes(name, found))
        return Model(meshes, tuple(self.lights), self.ambient, self.camera, tuple(self.textures.notes))

    def _object(self, chunk: Chunk) -> None:
        name, rest = chunk.text()
        for part in rest.chunks():
            if part.kind == _MESH:
                self.objects.append((name, self._mesh(part)))
            elif part.kind == _LIGHT:
                self._light(part)
            elif part.kind == _CAMERA and self.camera is None:
                self.camera = self._camera(part)

    def _mesh(self, chunk: Chunk) -> _Object:
        found = _Object()
        for part in chunk.chunks():
            if part.kind == _VERTICES:
                count, rest = part.count()
                found.vertices = rest.floats(3 * count)[0].reshape(-1, 3)
            elif part.kind == _UVS:
                count, rest = part.count()
                found.uvs = rest.floats(2 * count)[0].reshape(-1, 2)
            elif part.kind == _MATRIX:
                found.matrix[:3] = part.floats(12)[0].reshape(4, 3).T
            elif part.kind == _FACES:
                self._faces(found, part)
        return found

    def _faces(self, found: _Object, chunk: Chunk) -> None:
        count, rest = chunk.count()
        self.triangles += count
        if self.triangles > self.max_triangles:
            raise SceneError(f"{self.label}: expected at most {self.max_triangles} triangles, found more")
        corners, rest = rest.numbers("<u2", 4 * count)
        found.faces = corners.reshape(-1, 4)[:, :3].astype(np.int64)
        for part in rest.chunks():
            if part.kind == _FACE_MATERIAL:
                name, tail = part.text()
                listed, tail = tail.count()
                rows = tail.numbers("<u2", listed)[0].astype(np.int64)
                if len(rows) and rows.max() >= count:
                    raise part.refuse(f"faces below {count}", f"{rows.max()}")
                found.materials.append((name, rows))
            elif part.kind == _SMOOTHING:
                found.groups = part.numbers("<u4", count)[0].astype(np.uint32)

    def _meshes(self, name: str, found: _Object) -> Iterator[Mesh]:
        """The meshes of an object, one a material, y up."""
        title = f"{self.label}: object {name!r}"
        whole = Mesh(_unmirrored(found) @ _Y_UP.T, found.faces, DEFAULT_MATERIAL, name=title)
        vertices, faces, uvs, normals = whole.vertices, whole.faces, found.uvs, None
        if uvs is not None and len(uvs) != len(vertices):
            raise SceneError(f"{title}: expected {len(vertices)} texture coordinates, found {len(uvs)}")
        if found.groups is not None and len(found.groups) == len(faces) and found.groups.any():
            shaded = smoothed(vertices, faces, found.groups)
            vertices, faces, normals = vertices[shaded.rows], shaded.faces, shaded.normals
            uvs = None if uvs is None else uvs[shaded.rows]
        for look, rows in self._by_material(found):
            used, corners = np.unique(faces[rows], return_inverse=True)
            yield Mesh(
                vertices[used],
                corners.reshape(-1, 3),
                look.material,
                None if normals is None else normals[used],
                None if uvs is None else uvs[used] * look.uv_scale + look.uv_offset,
                name=title,
            )

    def _by_material(self, found: _Object) -> Iterator[tuple[ThreeDsMaterial, NDArray[np.int64]]]:
        """The object's materials, each with its faces, in order of the material groups."""
        group_of_face = np.full(len(found.faces), len(found.materials))
        for group, (_, rows) in enumerate(found.materials):
            group_of_face[rows] = group
        order = np.argsort(group_of_face, kind="stable")
        groups, starts = np.unique(group_of_face[order], return_index=True)
        for group, rows in zip(groups.tolist(), np.split(order, starts[1:]), strict=True):
            name = found.materials[group][0] if group < len(found.materials) else ""
            yield self.materials.get(name, ThreeDsMaterial(DEFAULT_MATERIAL)), rows

    def _light(self, chunk: Chunk) -> None:
        position, rest = chunk.floats(3)
        multiplier = 1.0
        for part in rest.chunks():
            if part.kind == _LIGHT_OFF:
                return
            if part.kind == _MULTIPLIER:
                multiplier = float(part.floats(1)[0][0])
            elif part.kind == _SPOT:
                self.textures.notes.append("a spot light is shown as one that lights to all sides")
        if not 0.0 <= multiplier <= MAX_MULTIPLIER:
            raise chunk.refuse(f"a multiplier from 0 to {MAX_MULTIPLIER:g}", f"{multiplier}")
        color = rest.color((1.0, 1.0, 1.0))
        red, green, blue = (math.pi * multiplier * part for part in color)
        x, y, z = self._place(chunk, position)
        self.lights.append(StatedLight((red, green, blue), (x, y, z)))

    def _camera(self, chunk: Chunk) -> Camera | None:
        values, _ = chunk.floats(8)
        position, target = self._place(chunk, values[:3]), self._place(chunk, values[3:6])
        bank_deg, lens_mm = values[6:].tolist()
        fov_deg = LENS_DEG_MM / lens_mm if lens_mm > 0.0 else 0.0
        try:
            return Camera(
                position, target, _rolled(position, target, bank_deg), vertical_fov(min(fov_deg, 179.0), ASPECT)
            )
        except SettingsError as error:
            self.textures.notes.append(f"a camera is left out: {error}")
            return None

    def _place(self, chunk: Chunk, point: NDArray[np.float64]) -> tuple[float, float, float]:
        """A point of the file in the renderer's coordinates."""
        if not (np.abs(point) <= MAX_COORDINATE_M).all():
            raise chunk.refuse(f"finite coordinates up to {MAX_COORDINATE_M:g}", f"{point.tolist()}")
        x, y, z = (_Y_UP @ point).tolist()
        return x, y, z


def _unmirrored(found: _Object) -> NDArray[np.float64]:
    """(n, 3) vertices as the editor shows them: where the object's own axes are mirrored, the file holds them
    mirrored along its own x (lib3ds).
    """
    linear, origin = found.matrix[:3, :3], found.matrix[:3, 3]
    with np.errstate(all="ignore"):
        if not np.linalg.det(linear) < 0.0:
            return found.vertices
        own = np.linalg.solve(linear, (found.vertices - origin).T)
        own[0] = -own[0]
        return (linear @ own).T + origin


def _rolled(
    position: tuple[float, float, float], target: tuple[float, float, float], bank_deg: float
) -> tuple[float, float, float]:
    """The direction that is up in the picture of a camera, turned about its view; any, where it looks straight up."""
    view = np.subtract(target, position)
    length = float(np.linalg.norm(view))
    if length == 0.0 or not math.isfinite(bank_deg):
        return 0.0, 1.0, 0.0
    view /= length
    right = np.cross(view, (0.0, 1.0, 0.0))
    if float(np.linalg.norm(right)) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    roll = math.radians(bank_deg)
    x, y, z = (math.cos(roll) * np.cross(right, view) + math.sin(roll) * right).tolist()
    return x, y, z
