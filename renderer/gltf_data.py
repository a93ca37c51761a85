"""The binary side of a glTF file: its buffers, and the numbers and images in them."""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError
from renderer.fields import Fields
from renderer.folder import Folder, percent_decoded

LARGEST_INDEX: Final = 2**40
"""Above every index, offset and length of a file that fits in memory."""

_COMPONENTS: Final = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_ITEMS: Final = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(slots=True)
class GltfData:
    """Reads what the entries of a file point at; each buffer is read once.

    Attributes:
        folder: where its files may lie.
        inner: the file's path from the folder's root.
        top: its JSON.
        chunk: the binary chunk, None for a text file.
        max_items: refuse accessors that state more.

    Raises:
        SceneError: in every method, naming the file and the field.
    """

    folder: Folder
    inner: str
    top: Fields
    chunk: bytes | None
    max_items: int
    buffers: dict[int, bytes] = field(default_factory=dict)

    def entry(self, kind: str, index: int) -> Fields:
        """Entry `index` of the top-level list `kind`."""
        entries = self.top.items(kind)
        if not 0 <= index < len(entries):
            raise SceneError(f"{self.top.file}: {kind}: expected at least {index + 1} entries, found {len(entries)}")
        return Fields(entries[index], self.top.file, f"{kind}[{index}]")

    def vectors(self, owner: Fields, key: str, kind: str) -> NDArray[np.float64]:
        """(n, items) values of the accessor that a field points at; normalised integers as fractions.

        `kind` is VEC2, VEC3 or VEC4.
        """
        accessor, values = self._values(owner, key, kind)
        wide = values.astype(np.float64)
        if accessor.flag("normalized", False) and values.dtype.kind in "iu":
            wide = np.maximum(wide / np.iinfo(values.dtype).max, -1.0)
        return wide

    def indices(self, owner: Fields, key: str) -> NDArray[np.int64]:
        """(n,) whole numbers of the accessor that a field points at."""
        accessor, values = self._values(owner, key, "SCALAR")
        if values.dtype.kind != "u":
            raise accessor.refuse("componentType", "unsigned integers", str(values.dtype))
        return values.ravel().astype(np.int64)

    def _values(self, owner: Fields, key: str, kind: str) -> tuple[Fields, NDArray[Any]]:
        """The accessor that a field points at, and its (n, items) values as they are stored."""
        accessor = self.entry("accessors", owner.integer(key, 0, LARGEST_INDEX))
        width = _ITEMS[accessor.choice("type", (kind,))]
        count = accessor.integer("count", 0, self.max_items)
        dtype = self._dtype(accessor)
        if "bufferView" in accessor:
            values = self._items(accessor, dtype, count, width)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._sparse(accessor.table("sparse"), values, dtype)
        return accessor, values

    def image(self, index: int) -> tuple[bytes, str]:
        """The file of an image, and what messages call it."""
        image = self.entry("images", index)
        if "bufferView" not in image:
            return self._uri(image)
        view = self.entry("bufferViews", image.integer("bufferView", 0, LARGEST_INDEX))
        return bytes(self._view(view)), f"{self.top.file}: {image.place}"

    def _dtype(self, accessor: Fields) -> str:
        component = accessor.integer("componentType", 0, LARGEST_INDEX)
        if component not in _COMPONENTS:
            raise accessor.refuse("componentType", f"one of {', '.join(map(str, _COMPONENTS))}", component)
        return _COMPONENTS[component]

    def _sparse(self, sparse: Fields, values: NDArray[Any], dtype: str) -> NDArray[Any]:
        """`values` with some of them replaced."""
        count = sparse.integer("count", 0, len(values))
        places, replacements = sparse.table("indices"), sparse.table("values")
        at = self._items(places, self._dtype(places), count, 1).ravel()
        if at.dtype.kind != "u" or (count and at.max() >= len(values)):
            raise sparse.refuse("indices", f"whole numbers from 0 to {len(values) - 1}", at.max())
        replaced = values.copy()
        replaced[at] = self._items(replacements, dtype, count, values.shape[1])
        return replaced

    def _items(self, source: Fields, dtype: str, count: int, width: int) -> NDArray[Any]:
        """(count, width) values that lie in a buffer view, from the offset that `source` states on."""
        view = self.entry("bufferViews", source.integer("bufferView", 0, LARGEST_INDEX))
        data = self._view(view)
        size = np.dtype(dtype).itemsize
        offset = source.integer("byteOffset", 0, LARGEST_INDEX, 0)
        stride = view.integer("byteStride", 1, 255, size * width)
        needed = offset + (count - 1) * stride + size * width if count else 0
        if needed > len(data) or stride < size * width:
            raise source.refuse("bufferView", f"{needed} bytes, {size * width} every {stride}", len(data))
        return np.ndarray((count, width), dtype, data, offset, (stride, size)) if count else np.zeros((0, width), dtype)

    def _view(self, view: Fields) -> memoryview:
        """The bytes of a buffer view, not copied."""
        data = memoryview(self._buffer(view.integer("buffer", 0, LARGEST_INDEX)))
        start = view.integer("byteOffset", 0, LARGEST_INDEX, 0)
        length = view.integer("byteLength", 0, LARGEST_INDEX)
        if start + length > len(data):
            raise view.refuse("byteLength", f"at most the {max(len(data) - start, 0)} bytes of its buffer", length)
        return data[start : start + length]

    def _buffer(self, index: int) -> bytes:
        if index not in self.buffers:
            buffer = self.entry("buffers", index)
            if "uri" in buffer:
                self.buffers[index] = self._uri(buffer)[0]
            elif index == 0 and self.chunk is not None:
                self.buffers[index] = self.chunk
            else:
                raise buffer.refuse("uri", "a file or data", "nothing")
        return self.buffers[index]

    def _uri(self, owner: Fields) -> tuple[bytes, str]:
        """The content that the field `uri` points at, and what messages call it."""
        uri = owner.text("uri")
        if uri.startswith("data:"):
            body = uri.partition(",")[2]
            try:
                return base64.b64decode(body, validate=True), f"{self.top.file}: {owner.place}"
            except (binascii.Error, ValueError) as error:
                raise SceneError(
                    f"{self.top.file}: {owner.where('uri')}: expected base64 data, found: {error}"
                ) from None
        where = f"{self.top.file}: {owner.where('uri')}"
        data, inner = self.folder.read(percent_decoded(uri), where, self.inner)
        return data, self.folder.file_label(inner)
