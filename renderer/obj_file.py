"""Meshes of Wavefront OBJ files.

Read here rather than by a library, because what a file gets wrong must be said with its line: an index
out of range, a word where a number belongs, a material that no .mtl defines. Polygons of any size,
concave ones too, relative indices, several .mtl files, continued lines and comments are understood;
lines, points and curved surfaces are skipped. One mesh a material, in order of first use; objects,
groups and smoothing groups do not split it.

Source: Wavefront, Advanced Visualizer manual, appendix B1, Object files (.obj).
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError
from renderer.folder import Folder
from renderer.framing import DEFAULT_MATERIAL
from renderer.mtl import decode_text, read_mtl
from renderer.polygon import triangulate
from renderer.scene import MAX_COORDINATE_M, Material, Mesh

_COMPONENTS: Final = {"v": 3, "vt": 2, "vn": 3}
"""Numbers of a position, a texture coordinate and a normal; more on the line (weights, colours) are skipped."""

_NAMES: Final = {"v": "vertex", "vt": "texture coordinate", "vn": "normal"}

_LARGEST_INDEX: Final = 2**62


def read_obj(folder: Folder, data: bytes, inner: str, max_triangles: int) -> tuple[Mesh, ...]:
    """The meshes of an OBJ file, one a material; faces in file order, polygons cut into triangles.

    Args:
        folder: where its .mtl files and textures may lie.
        data: the file.
        inner: its path from the folder's root.
        max_triangles: refuse more.

    Raises:
        SceneError: naming the file and the line.
    """
    text = decode_text(data)
    reader = _Reader(folder, inner, max_triangles)
    for number, line in _logical_lines(text):
        reader.statement(line.split(), line, number)
    points = {key: np.array(reader.values[key]).reshape(-1, count) for key, count in _COMPONENTS.items()}
    label = folder.file_label(inner)
    _check_vertices(label, text, points["v"])
    corners = np.array(reader.corners, dtype=np.int64).reshape(-1, 3)
    _check_indices(label, corners, reader.corner_lines, points)
    return tuple(
        _mesh(label, name, group, corners, points) for name, group in reader.groups.items() if len(group.sizes) > 0
    )


@dataclass(slots=True)
class _Group:
    """The polygons of one material: ids of their corners, and how many each has, in file order."""

    material: Material
    corners: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)


@dataclass(slots=True)
class _Reader:
    """The state of reading one OBJ file.

    A corner is a combination of indices into v, vt and vn, counted from 0, -1 for none. Corners that are
    written alike share one id, which also makes each of them a single vertex of the mesh.
    """

    folder: Folder
    inner: str
    max_triangles: int
    values: dict[str, array[float]] = field(default_factory=lambda: {key: array("d") for key in _COMPONENTS})
    ids: dict[str, int] = field(default_factory=dict)
    corners: array[int] = field(default_factory=lambda: array("q"))
    corner_lines: array[int] = field(default_factory=lambda: array("q"))
    materials: dict[str, Material] | None = None
    groups: dict[str, _Group] = field(default_factory=dict)
    group: _Group | None = None
    triangles: int = 0

    def statement(self, words: list[str], line: str, number: int) -> None:
        """Take in one line, and its words."""
        if not words:
            return
        key = words[0]
        if key == "f":
            self._face(words, number)
        elif key in _COMPONENTS:
            self._value(key, words, number)
        elif key == "usemtl":
            self.group = self._group(" ".join(words[1:]), number)
        elif key == "mtllib":
            self._read_materials(line.strip()[len(key) :], words[1:], number)

    def _where(self, number: int) -> str:
        return f"{self.folder.file_label(self.inner)}: line {number}"

    def _value(self, key: str, words: list[str], number: int) -> None:
        end = _COMPONENTS[key] + 1
        if key == "vt" and len(words) == 2:
            words.append("0")
        try:
            if len(words) < end:
                raise ValueError
            self.values[key].extend(map(float, words[1:end]))
        except ValueError:
            found = " ".join(words[1:])
            raise SceneError(f"{self._where(number)}: {key}: expected {end - 1} numbers, found {found!r}") from None

    def _face(self, words: list[str], number: int) -> None:
        if "#" in words:
            words = words[: words.index("#")]
        size = len(words) - 1
        if size < 3:
            raise SceneError(f"{self._where(number)}: f: expected at least 3 corners, found {size}")
        self.triangles += size - 2
        if self.triangles > self.max_triangles:
            raise SceneError(f"{self._where(number)}: expected at most {self.max_triangles} triangles, found more")
        if self.group is None:
            self.group = self._group("", number)
        ids = self.ids
        self.group.corners.extend([ids[word] if word in ids else self._corner(word, number) for word in words[1:]])
        self.group.sizes.append(size)

    def _corner(self, word: str, number: int) -> int:
        """The new id of the corner written v, v/vt, v//vn or v/vt/vn."""
        try:
            v, vt, vn = (word + "/" * (2 - word.count("/"))).split("/")
            corner = (
                self._from_zero("v", int(v), number),
                self._from_zero("vt", int(vt), number) if vt else -1,
                self._from_zero("vn", int(vn), number) if vn else -1,
            )
        except ValueError:
            raise SceneError(
                f"{self._where(number)}: f: expected corners as v, v/vt, v//vn or v/vt/vn, found {word!r}"
            ) from None
        new = len(self.corner_lines)
        self.corners.extend(corner)
        self.corner_lines.append(number)
        if "-" not in word:
            self.ids[word] = new
        return new

    def _from_zero(self, key: str, index: int, number: int) -> int:
        """An index counted from 0, of one that counts from 1, or back from the last value read so far."""
        if 0 < index < _LARGEST_INDEX:
            return index - 1
        read = len(self.values[key]) // _COMPONENTS[key]
        if -read <= index < 0:
            return read + index
        raise SceneError(
            f"{self._where(number)}: f: expected a {_NAMES[key]} index from 1, or from -{read} to -1, found {index}"
        )

    def _group(self, name: str, number: int) -> _Group:
        if name not in self.groups:
            material = DEFAULT_MATERIAL
            if name and self.materials is not None:
                if name not in self.materials:
                    known = ", ".join(self.materials) or "none"
                    raise SceneError(f"{self._where(number)}: usemtl: expected one of {known}, found {name!r}")
                material = self.materials[name]
            self.groups[name] = _Group(material)
        return self.groups[name]

    def _read_materials(self, rest: str, words: list[str], number: int) -> None:
        """Read the .mtl file `rest`, whose name may hold blanks, or the several files `words`."""
        several = len(words) > 1 and all(word.lower().endswith(".mtl") for word in words)
        for name in words if several else [rest]:
            data, inner = self.folder.read(name, f"{self._where(number)}: mtllib", self.inner)
            self.materials = (self.materials or {}) | read_mtl(self.folder, data, inner)


def _logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers; one that ends in a backslash goes on in the next."""
    if "\\\n" not in text:
        yield from enumerate(text.split("\n"), start=1)
        return
    pending, first = "", 0
    for number, line in enumerate(text.split("\n"), start=1):
        if line.endswith("\\"):
            pending, first = pending + line[:-1] + " ", first or number
        elif pending:
            yield first, pending + line
            pending, first = "", 0
        else:
            yield number, line
    if pending:
        yield first, pending


def _check_vertices(label: str, text: str, vertices: NDArray[np.float64]) -> None:
    """Refuse positions that are not finite, naming the line; lines are only looked up for that."""
    good = (np.abs(vertices) <= MAX_COORDINATE_M).all(axis=1)
    if good.all():
        return
    bad = int(np.argmin(good))
    lines = [number for number, line in _logical_lines(text) if line.split(None, 1)[:1] == ["v"]]
    raise SceneError(
        f"{label}: line {lines[bad]}: v: expected finite coordinates up to {MAX_COORDINATE_M:g} m, "
        f"found {vertices[bad].tolist()}"
    )


def _check_indices(
    label: str, corners: NDArray[np.int64], lines: array[int], points: dict[str, NDArray[np.float64]]
) -> None:
    """Refuse indices beyond the last value of the file; a face may come before its vertices."""
    for slot, (key, name) in enumerate(_NAMES.items()):
        beyond = corners[:, slot] >= len(points[key])
        if beyond.any():
            bad = int(np.argmax(beyond))
            raise SceneError(
                f"{label}: line {lines[bad]}: f: expected a {name} index up to {len(points[key])}, "
                f"found {corners[bad, slot] + 1}"
            )


def _mesh(
    label: str, name: str, group: _Group, corners: NDArray[np.int64], points: dict[str, NDArray[np.float64]]
) -> Mesh:
    """The triangles of one material; vertices in order of first use."""
    used, first_use, which = np.unique(np.array(group.corners), return_index=True, return_inverse=True)
    order = np.argsort(first_use)
    rank = np.zeros(len(used), dtype=np.int64)
    rank[order] = np.arange(len(used))
    vertex_of_corner = rank[which]
    v, vt, vn = corners[used[order]].T
    vertices = points["v"][v]
    try:
        triangles = triangulate(vertices[vertex_of_corner], np.array(group.sizes))
    except ValueError as error:
        raise SceneError(f"{label}: material {name!r}: {error}") from None
    return Mesh(
        vertices,
        vertex_of_corner[triangles],
        group.material,
        normals=_optional(points["vn"], vn),
        uvs=_optional(points["vt"], vt),
        name=f"{label}: material {name!r}" if name else label,
    )


def _optional(values: NDArray[np.float64], indices: NDArray[np.int64]) -> NDArray[np.float64] | None:
    """Rows of `values`; zeros where a vertex has none, None where no vertex has one."""
    if (indices < 0).all():
        return None
    return np.where((indices >= 0)[:, None], values[np.maximum(indices, 0)], 0.0)
