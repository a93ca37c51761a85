"""Mesh files: OBJ with MTL, glTF and GLB, PLY, STL, 3DS, COLLADA. The only file that knows trimesh.

trimesh reads STL. The others have readers of their own (`obj_file`, `gltf_file`, `ply_file`, `three_ds_file`,
`collada_file`), because trimesh 5.2 knows no 3DS, and reads some of the others' files as something else without
saying so. In OBJ: index 0, relative indices before the last vertex, texture coordinates or normals on some faces
only, concave polygons, a byte-order mark, a last line cut short. In glTF: normalised texture coordinates, sparse
accessors. In PLY: text cut short; and binary polygons of unlike sizes it refuses.
"""

from __future__ import annotations

import dataclasses
import io
import logging
from pathlib import Path
from typing import Final

import numpy as np

from renderer.collada_file import read_collada
from renderer.errors import SceneError
from renderer.folder import MAX_FILE_BYTES, Folder
from renderer.framing import DEFAULT_MATERIAL
from renderer.gltf_file import read_gltf
from renderer.model import Model
from renderer.obj_file import read_obj
from renderer.ply_file import read_ply
from renderer.scene import Mesh
from renderer.three_ds_file import read_three_ds

# trimesh logs what it cannot read, traceback and all; it is said once, in our own error.
logging.getLogger("trimesh").addHandler(logging.NullHandler())

SUFFIXES: Final = (".obj", ".glb", ".gltf", ".ply", ".stl", ".3ds", ".dae")
"""File name endings of mesh files, in lower case."""

MAX_TRIANGLES: Final = 20_000_000
"""Most triangles of a mesh file by default: about 8 GB once prepared."""

_LARGEST_UV: Final = 1e30
"""Texture coordinates beyond this, or not finite, count as 0: they leave float32."""


def load_model(path: Path, *, max_bytes: int = MAX_FILE_BYTES, max_triangles: int = MAX_TRIANGLES) -> Model:
    """What a file that stands alone holds; files it names must lie in its folder or below.

    Args:
        path: the file; its ending says what it is.
        max_bytes: refuse larger files.
        max_triangles: refuse more triangles.

    Raises:
        SceneError: naming the file and the line or field, what was expected and what was found.
    """
    real = path.resolve()
    label = "" if path.parent == Path() else str(path.parent)
    return read_model(Folder(real.parent, label, max_bytes), real.name, str(path), max_triangles)


def read_model(folder: Folder, name: str, wanted_by: str, max_triangles: int = MAX_TRIANGLES) -> Model:
    """What a file of `folder` holds: a mesh for each of its materials (OBJ) or primitives (glTF), else one.

    Vertices, faces, vertex normals and texture coordinates are the file's own; nothing is merged, repaired
    or turned, and without normals a mesh is flat. Meshes without a material get `DEFAULT_MATERIAL`; a PLY
    file with vertex colours gets their mean.

    Args:
        folder: the tree whose files may be read.
        name: the mesh file, from the folder's root.
        wanted_by: who asks, for messages.
        max_triangles: refuse more triangles.

    Raises:
        SceneError: naming the file and the line or field, what was expected and what was found.
    """
    suffix = Path(name).suffix.lower()
    if suffix not in SUFFIXES:
        raise SceneError(f"{wanted_by}: expected a mesh file ({', '.join(SUFFIXES)}), found {name!r}")
    data, inner = folder.read(name, wanted_by)
    label = folder.file_label(inner)
    if not data:
        raise SceneError(f"{label}: expected a mesh file, found an empty file")
    with np.errstate(all="ignore"):  # numbers that are none are told by our own checks, not by numpy's warnings
        model = _read(folder, data, inner, suffix, max_triangles)
    shown = tuple(_tamed(mesh) for mesh in model.meshes if len(mesh.faces))
    triangles = sum(len(mesh.faces) for mesh in shown)
    if not 0 < triangles <= max_triangles:
        raise SceneError(f"{label}: expected 1 to {max_triangles} triangles, found {triangles}")
    return dataclasses.replace(model, meshes=shown)


def _read(folder: Folder, data: bytes, inner: str, suffix: str, max_triangles: int) -> Model:
    """The content of a file, by the reader of its kind."""
    match suffix:
        case ".obj":
            return Model(read_obj(folder, data, inner, max_triangles))
        case ".ply":
            return Model((read_ply(data, folder.file_label(inner), max_triangles),))
        case ".stl":
            return Model((_read_stl(data, folder.file_label(inner)),))
        case ".dae":
            return read_collada(folder, data, inner, max_triangles)
        case ".3ds":
            return read_three_ds(folder, data, inner, max_triangles)
        case _:
            return read_gltf(folder, data, inner, max_triangles)


def _read_stl(data: bytes, label: str) -> Mesh:
    """A binary or text STL file: three vertices of its own for each triangle, flat.

    trimesh is imported here, as it takes most of a second and few scenes hold an STL file.
    """
    from trimesh.exchange.stl import load_stl

    try:
        loaded = load_stl(io.BytesIO(data))
        solids = loaded.get("geometry", {"": loaded}).values()
        corners = [np.asarray(solid["vertices"], dtype=np.float64).reshape(-1, 3) for solid in solids]
    except Exception as error:
        # damage surfaces in trimesh as ValueError, KeyError, its own HeaderError, and more
        found = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(f"{label}: expected an STL file, found damage: {found}") from error
    vertices = np.concatenate([np.zeros((0, 3)), *corners])
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), DEFAULT_MATERIAL, name=label)


def _tamed(mesh: Mesh) -> Mesh:
    """The mesh without normals and texture coordinates that are not finite; zero normals mean flat."""
    normals, uvs = mesh.normals, mesh.uvs
    if normals is not None and not np.isfinite(normals).all():
        normals = np.where(np.isfinite(normals).all(axis=1, keepdims=True), normals, 0.0)
    if uvs is not None and not (np.abs(uvs) <= _LARGEST_UV).all():
        uvs = np.where(np.abs(uvs) <= _LARGEST_UV, uvs, 0.0)
    return dataclasses.replace(mesh, normals=normals, uvs=uvs)
