"""Meshes of PLY files, text or binary, with polygons of any size.

Of the file's elements `vertex` (x y z, nx ny nz, a pair of texture coordinates, red green blue) and `face`
(vertex_indices or vertex_index) count; all others are skipped.

Source: G. Turk, The PLY polygon file format, 1994.
"""

from __future__ import annotations

import dataclasses
import re
import struct
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError
from renderer.framing import DEFAULT_MATERIAL
from renderer.polygon import triangulate
from renderer.scene import Material, Mesh
from renderer.texture import srgb_to_linear

_TYPES: Final = {
    "char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h", "ushort": "H", "uint16": "H",
    "int": "i", "int32": "i", "uint": "I", "uint32": "I", "int64": "q", "uint64": "Q",
    "float": "f", "float32": "f", "double": "d", "float64": "d",
}  # fmt: skip
"""Type names of the header and their `struct` codes."""

_ORDERS: Final = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_UV_NAMES: Final = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_INDEX_NAMES: Final = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, slots=True)
class _Property:
    """One value of an element, or a list of values where it has a counter; types are `struct` codes."""

    name: str
    code: str
    counter: str | None = None


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True, slots=True)
class _Table:
    """What the file holds of one element.

    Attributes:
        columns: (n,) values of each property; of a list all its values, one row after the other.
        sizes: (n,) lengths of each list.
    """

    columns: dict[str, NDArray[np.generic]]
    sizes: dict[str, NDArray[np.int64]]


def read_ply(data: bytes, label: str, max_triangles: int) -> Mesh:
    """The mesh of a PLY file, polygons cut into triangles; with vertex colours, of their mean colour.

    Args:
        data: the file.
        label: its name, for messages.
        max_triangles: refuse more.

    Raises:
        SceneError: naming the file, what was expected and what was found.
    """
    elements, body, order = _read_header(data, label)
    tables: dict[str, _Table] = {}
    at = 0
    for element in elements:
        if "vertex" in tables and "face" in tables:
            break
        tables[element.name], at = _read_table(element, body, at, order, label)
    vertex, face = tables.get("vertex"), tables.get("face")
    if vertex is None or face is None:
        raise SceneError(f"{label}: expected elements vertex and face, found {', '.join(tables) or 'none'}")
    vertices = _vectors(vertex, ("x", "y", "z"))
    if vertices is None:
        raise SceneError(f"{label}: expected x, y and z of each vertex, found {', '.join(vertex.columns)}")
    uvs = [found for names in _UV_NAMES if (found := _vectors(vertex, names)) is not None]
    return Mesh(
        vertices,
        _faces(face, vertices, label, max_triangles),
        _material(vertex),
        _vectors(vertex, ("nx", "ny", "nz")),
        uvs[0] if uvs else None,
        name=label,
    )


def _read_header(data: bytes, label: str) -> tuple[list[_Element], bytes, str]:
    """Elements, the bytes after the header, and their byte order. Text is turned into doubles."""
    end = re.search(rb"^end_header[ \t]*\r?\n", data, re.MULTILINE)
    if not data.startswith(b"ply") or end is None:
        raise SceneError(f"{label}: expected a header from 'ply' to 'end_header', found {data[:20]!r}")
    kind, elements = "", list[_Element]()
    for number, line in enumerate(data[: end.start()].decode("latin-1").splitlines(), start=1):
        match line.split():
            case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as kind, _]:
                pass
            case ["element", name, count] if count.isascii() and count.isdigit():
                elements.append(_Element(name, int(count[:18]), ()))
            case ["property", "list", counter, code, name] if elements and {counter, code} <= _TYPES.keys():
                elements[-1] = _with(elements[-1], _Property(name, _TYPES[code], _TYPES[counter]))
            case ["property", code, name] if elements and code in _TYPES:
                elements[-1] = _with(elements[-1], _Property(name, _TYPES[code]))
            case [] | ["ply"] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise SceneError(f"{label}: line {number}: expected a statement of a PLY header, found {line!r}")
    if not kind:
        raise SceneError(f"{label}: expected a format ({', '.join(_ORDERS)}), found none")
    body = data[end.end() :]
    if kind != "ascii":
        return elements, body, _ORDERS[kind]
    try:
        numbers = np.array(body.split(), dtype=np.bytes_).astype(np.float64)
    except ValueError as error:
        raise SceneError(f"{label}: expected numbers after the header, found damage: {error}") from None
    return [_all_doubles(element) for element in elements], numbers.astype("<f8").tobytes(), _ORDERS[kind]


def _with(element: _Element, new: _Property) -> _Element:
    return dataclasses.replace(element, properties=(*element.properties, new))


def _all_doubles(element: _Element) -> _Element:
    """The element as `_read_header` lays out text: every number a double, counters too."""
    properties = tuple(_Property(item.name, "d", item.counter and "d") for item in element.properties)
    return dataclasses.replace(element, properties=properties)


def _read_table(element: _Element, body: bytes, at: int, order: str, label: str) -> tuple[_Table, int]:
    """The rows of an element that begins at byte `at`, and where the next one begins."""
    try:
        return _equal_rows(element, body, at, order) or _unequal_rows(element, body, at, order)
    except (struct.error, ValueError, OverflowError):
        raise SceneError(
            f"{label}: expected {element.count} rows of element {element.name}, found damage or the end of the file"
        ) from None


def _equal_rows(element: _Element, body: bytes, at: int, order: str) -> tuple[_Table, int] | None:
    """All rows at once, if each of their lists is as long as in the first row; else None."""
    sizes = _first_sizes(element, body, at, order) if element.count else [0] * len(element.properties)
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for i, (item, size) in enumerate(zip(element.properties, sizes, strict=True)):
        if item.counter is None:
            fields.append((f"{i}", order + item.code))
        else:
            fields += [(f"{i} size", order + item.counter), (f"{i}", order + item.code, (size,))]
    row = np.dtype(fields)
    end = at + element.count * row.itemsize
    if row.itemsize == 0 or end > len(body):
        return None
    rows = np.frombuffer(body, row, element.count, at)
    table = _Table({}, {})
    for i, (item, size) in enumerate(zip(element.properties, sizes, strict=True)):
        if item.counter is not None:
            if not (rows[f"{i} size"] == size).all():
                return None
            table.sizes[item.name] = np.full(element.count, size)
        table.columns[item.name] = rows[f"{i}"].ravel()
    return table, end


def _first_sizes(element: _Element, body: bytes, at: int, order: str) -> list[int]:
    """How many values each property has in the row at byte `at`."""
    sizes = []
    for item in element.properties:
        size = 1
        if item.counter is not None:
            size, at = _size(body, at, order + item.counter)
        sizes.append(size)
        at += size * struct.calcsize(order + item.code)
    return sizes


def _unequal_rows(element: _Element, body: bytes, at: int, order: str) -> tuple[_Table, int]:
    """Row by row."""
    columns: dict[str, list[float]] = {item.name: [] for item in element.properties}
    sizes: dict[str, list[int]] = {item.name: [] for item in element.properties if item.counter is not None}
    if not any(item.counter for item in element.properties) and element.properties:
        raise ValueError("fewer rows than stated")
    for _ in range(element.count if element.properties else 0):
        for item in element.properties:
            size = 1
            if item.counter is not None:
                size, at = _size(body, at, order + item.counter)
                sizes[item.name].append(size)
            layout = f"{order}{size}{item.code}"
            columns[item.name].extend(struct.unpack_from(layout, body, at))
            at += struct.calcsize(layout)
    return _Table(
        {name: np.array(values) for name, values in columns.items()},
        {name: np.array(values, dtype=np.int64) for name, values in sizes.items()},
    ), at


def _size(body: bytes, at: int, layout: str) -> tuple[int, int]:
    """The length of a list, and where its values begin."""
    (size,) = struct.unpack_from(layout, body, at)
    if size < 0 or size > len(body) or size != int(size):
        raise ValueError("not the length of a list")
    return int(size), at + struct.calcsize(layout)


def _vectors(table: _Table, names: tuple[str, ...]) -> NDArray[np.float64] | None:
    """(n, len(names)) columns side by side; None unless all are there."""
    if not all(name in table.columns and name not in table.sizes for name in names):
        return None
    return np.stack([table.columns[name].astype(np.float64) for name in names], axis=1)


def _faces(face: _Table, vertices: NDArray[np.float64], label: str, max_triangles: int) -> NDArray[np.int64]:
    """(m, 3) triangles of the file's polygons."""
    name = next((name for name in _INDEX_NAMES if name in face.sizes), None)
    if name is None:
        raise SceneError(f"{label}: expected a list vertex_indices of each face, found {', '.join(face.columns)}")
    sizes, stated = face.sizes[name], face.columns[name].astype(np.float64)
    if len(sizes) and sizes.min() < 3:
        bad = int(np.argmin(sizes))
        raise SceneError(f"{label}: face {bad}: expected at least 3 corners, found {sizes[bad]}")
    good = (stated >= 0) & (stated < len(vertices)) & (stated == np.floor(stated))
    if not good.all():
        at = int(np.argmin(good))
        bad = int(np.searchsorted(np.cumsum(sizes), at, side="right"))
        raise SceneError(
            f"{label}: face {bad}: expected vertex indices from 0 to {len(vertices) - 1}, found {stated[at]:g}"
        )
    if (triangles := int(np.sum(sizes - 2))) > max_triangles:
        raise SceneError(f"{label}: expected at most {max_triangles} triangles, found {triangles}")
    if len(sizes) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    corners = stated.astype(np.int64)
    try:
        with np.errstate(all="ignore"):
            return corners[triangulate(vertices[corners], sizes)]
    except ValueError as error:
        raise SceneError(f"{label}: {error}") from None


def _material(vertex: _Table) -> Material:
    """The default material, in the mean of the vertex colours where there are any: 0-255, or 0-1 as fractions."""
    colours = _vectors(vertex, ("red", "green", "blue"))
    if colours is None or len(colours) == 0:
        return DEFAULT_MATERIAL
    if colours.max() > 1.0 or vertex.columns["red"].dtype.kind in "iu":
        colours = colours / 255.0
    red, green, blue = srgb_to_linear(np.clip(np.nan_to_num(colours), 0.0, 1.0)).mean(axis=0).tolist()
    return dataclasses.replace(DEFAULT_MATERIAL, diffuse=(red, green, blue))
