"""The geometry of COLLADA files: triangles, polygons, strips and fans as meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError
from renderer.framing import DEFAULT_MATERIAL
from renderer.polygon import triangulate
from renderer.scene import Mesh
from renderer.xml_tree import Element

PRIMITIVES: Final = ("triangles", "polylist", "polygons", "tristrips", "trifans")
"""Elements that hold faces; lines, line strips and splines are left out."""

_MAX_OFFSET: Final = 64
"""Largest offset of an input, and largest number of floats that belong to one vertex."""

Find = Callable[[str, Element], Element]
"""The element with an id, for an element that names it."""


@dataclass(frozen=True, eq=False, slots=True)
class Input:
    """A stream of indices of a primitive.

    Attributes:
        semantic: what it means: VERTEX, NORMAL, TEXCOORD, ...
        source: the element that holds the values.
        offset: its column in the indices.
        number: its set, of several alike.
    """

    semantic: str
    source: Element
    offset: int
    number: int


def read_primitive(primitive: Element, find: Find, texcoord: int | None, name: str, max_triangles: int) -> Mesh:
    """The faces of one primitive, cut into triangles.

    Args:
        primitive: one of `PRIMITIVES`.
        find: looks up what it refers to.
        texcoord: which set of texture coordinates; None for the first.
        name: for messages.
        max_triangles: refuse more.

    Returns:
        A mesh in the default material; corners alike in all their indices share a vertex.

    Raises:
        SceneError: naming the file, the line and the element.
    """
    inputs = [_input(element, find) for element in primitive.all("input")]
    vertex = next((found for found in inputs if found.semantic == "VERTEX"), None)
    if vertex is None:
        raise primitive.refuse("an input VERTEX", ", ".join(found.semantic for found in inputs) or "none")
    for element in vertex.source.all("input"):
        of_vertex = _input(element, find)
        inputs.append(Input(of_vertex.semantic, of_vertex.source, vertex.offset, of_vertex.number))
    streams = [
        _stream(inputs, "POSITION", None),
        _stream(inputs, "NORMAL", None),
        _stream(inputs, "TEXCOORD", texcoord),
    ]
    if streams[0] is None:
        raise vertex.source.refuse("an input POSITION", "none")
    rows, sizes = _corners(primitive, 1 + max(found.offset for found in inputs))
    if int((sizes - 2).sum()) > max_triangles:
        raise primitive.refuse(f"at most {max_triangles} triangles", "more")
    values = [None if stream is None else _values(stream.source, find) for stream in streams]
    columns = [
        _checked(primitive, stream, rows[:, stream.offset], len(held))
        for stream, held in zip(streams, values, strict=True)
        if stream is not None and held is not None
    ]
    corners, vertex_of_corner = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    positions, normals, uvs = values
    assert positions is not None
    own = iter(corners.T)
    vertices = _padded(positions, 3)[next(own)]
    shown_normals = None if normals is None else _padded(normals, 3)[next(own)]
    shown_uvs = None if uvs is None else _padded(uvs, 2)[next(own)]
    faces = vertex_of_corner.ravel()[_triangles(primitive, _padded(positions, 3)[columns[0]], sizes)]
    return Mesh(vertices, faces, DEFAULT_MATERIAL, shown_normals, shown_uvs, name=name)


def _input(element: Element, find: Find) -> Input:
    offset = element.index("offset", 0)
    if offset > _MAX_OFFSET:
        raise element.refuse(f"an offset up to {_MAX_OFFSET}", offset)
    source = find(element.attributes.get("source", ""), element)
    return Input(element.attributes.get("semantic", ""), source, offset, element.index("set", 0))


def _stream(inputs: list[Input], semantic: str, number: int | None) -> Input | None:
    """The input of a semantic and set, or else the first of that semantic."""
    alike = [found for found in inputs if found.semantic == semantic]
    return next((found for found in alike if found.number == number), alike[0] if alike else None)


def _values(source: Element, find: Find) -> NDArray[np.float64]:
    """(n, stride) values of a source."""
    accessor = source.first("technique_common/accessor")
    if accessor is None:
        raise source.refuse("an accessor", "none")
    held = find(accessor.attributes.get("source", ""), accessor).floats()
    stride, count, offset = accessor.index("stride", 1), accessor.index("count", 0), accessor.index("offset", 0)
    if not 1 <= stride <= _MAX_OFFSET:
        raise accessor.refuse(f"a stride from 1 to {_MAX_OFFSET}", stride)
    if offset + count * stride > len(held):
        raise accessor.refuse(f"at most {len(held)} numbers, as the source holds", offset + count * stride)
    return held[offset : offset + count * stride].reshape(-1, stride)


def _padded(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """(n, width) values: further columns dropped, missing ones 0."""
    kept = values[:, :width]
    return np.concatenate([kept, np.zeros((len(kept), width - kept.shape[1]))], axis=1)


def _checked(primitive: Element, stream: Input, indices: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    good = (indices >= 0) & (indices < count)
    if not good.all():
        found = int(indices[np.argmin(good)])
        raise primitive.refuse(f"{stream.semantic} indices from 0 to {count - 1}", found)
    return indices


def _corners(primitive: Element, width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(c, width) indices of all corners, polygon after polygon, and (p,) the corners of each polygon."""
    runs = [_rows(p, width) for p in _index_lists(primitive)]
    rows = np.concatenate([np.zeros((0, width), dtype=np.int64), *runs])
    match primitive.tag:
        case "polylist":
            counts = primitive.first("vcount")
            sizes = np.zeros(0, dtype=np.int64) if counts is None else counts.integers()
            if (len(sizes) and (sizes.min() < 0 or sizes.max() > len(rows))) or int(sizes.sum()) != len(rows):
                raise primitive.refuse(f"a vcount of {len(rows)} corners in all, as p holds", f"{sizes.sum()}")
        case "polygons":
            sizes = np.array([len(run) for run in runs], dtype=np.int64)
        case "triangles":
            if len(rows) % 3:
                raise primitive.refuse("corners in threes", len(rows))
            sizes = np.full(len(rows) // 3, 3)
        case _:
            strips = [_strip(run) if primitive.tag == "tristrips" else _fan(run) for run in runs]
            rows = np.concatenate([np.zeros((0, width), dtype=np.int64), *strips])
            sizes = np.full(len(rows) // 3, 3)
    # what has fewer than three corners is a point or a line
    faces = sizes >= 3
    return rows[np.repeat(faces, sizes)], sizes[faces]


def _index_lists(primitive: Element) -> list[Element]:
    """The index lists of a primitive; of polygons with holes the outline."""
    found = list(primitive.all("p"))
    found += [outline for holed in primitive.all("ph") for outline in holed.all("p")]
    return found


def _rows(p: Element, width: int) -> NDArray[np.int64]:
    indices = p.integers()
    if len(indices) % width:
        raise p.refuse(f"a multiple of {width} indices", len(indices))
    return indices.reshape(-1, width)


def _strip(run: NDArray[np.int64]) -> NDArray[np.int64]:
    """Corners of the triangles of a strip, every other one turned round."""
    triangles = (
        np.stack([run[:-2], run[1:-1], run[2:]], axis=1) if len(run) >= 3 else run[:0].reshape(0, 3, run.shape[1])
    )
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles.reshape(-1, run.shape[1])


def _fan(run: NDArray[np.int64]) -> NDArray[np.int64]:
    """Corners of the triangles of a fan."""
    if len(run) < 3:
        return run[:0]
    first = np.broadcast_to(run[0], (len(run) - 2, run.shape[1]))
    return np.stack([first, run[1:-1], run[2:]], axis=1).reshape(-1, run.shape[1])


def _triangles(primitive: Element, points: NDArray[np.float64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 3) triangles that cover the polygons, as rows of `points`."""
    if len(sizes) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    try:
        with np.errstate(all="ignore"):
            return triangulate(points, sizes)
    except ValueError as error:
        raise SceneError(f"{primitive.file}: line {primitive.line}: {primitive.tag}: {error}") from None
