"""The chunks of a 3DS file: each a number, its length, and data or further chunks within that length."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from renderer.errors import SceneError
from renderer.scene import Rgb
from renderer.texture import srgb_to_linear

_HEADER: Final = struct.Struct("<HI")

_COLOR_F, _COLOR_24, _LIN_COLOR_24, _LIN_COLOR_F = 0x0010, 0x0011, 0x0012, 0x0013
_INT_PERCENTAGE, _FLOAT_PERCENTAGE = 0x0030, 0x0031


@dataclass(frozen=True, eq=False, slots=True)
class Chunk:
    """One chunk, or the rest of one; everything read of it lies within its length.

    Attributes:
        file: the whole file.
        label: what messages call the file.
        kind: the chunk's number.
        start, end: where its content begins and ends in the file.

    Raises:
        SceneError: in every method, naming the file, the chunk and its place.
    """

    file: bytes
    label: str
    kind: int
    start: int
    end: int

    def __len__(self) -> int:
        return self.end - self.start

    def chunks(self) -> Iterator[Chunk]:
        """The chunks that make up its content."""
        at = self.start
        while at + _HEADER.size <= self.end:
            kind, length = _HEADER.unpack_from(self.file, at)
            if not _HEADER.size <= length <= self.end - at:
                raise SceneError(
                    f"{self.label}: chunk {kind:04x}, byte {at}: expected a length from {_HEADER.size} to "
                    f"{self.end - at}, found {length}"
                )
            yield Chunk(self.file, self.label, kind, at + _HEADER.size, at + length)
            at += length

    def numbers(self, dtype: str, count: int) -> tuple[NDArray[np.generic], Chunk]:
        """The next `count` numbers, and what follows them; the count is checked before anything is made."""
        size = count * np.dtype(dtype).itemsize
        if size > len(self):
            raise self.refuse(f"{size} bytes for {count} numbers", f"{len(self)}")
        return np.frombuffer(self.file, dtype, count, self.start), self.after(size)

    def floats(self, count: int) -> tuple[NDArray[np.float64], Chunk]:
        """The next `count` floats, which may be anything, and what follows them."""
        values, rest = self.numbers("<f4", count)
        return values.astype(np.float64), rest

    def count(self) -> tuple[int, Chunk]:
        """A 16-bit count, and what follows it."""
        values, rest = self.numbers("<u2", 1)
        return int(values[0]), rest

    def text(self) -> tuple[str, Chunk]:
        """Text up to its null byte, and what follows it."""
        end = self.file.find(b"\0", self.start, self.end)
        if end < 0:
            raise self.refuse("text that ends with a null byte", "none")
        return self.file[self.start : end].decode("latin-1"), self.after(end + 1 - self.start)

    def after(self, size: int) -> Chunk:
        """What follows the next `size` bytes."""
        return Chunk(self.file, self.label, self.kind, self.start + size, self.end)

    def color(self, default: Rgb) -> Rgb:
        """The colour in its chunks, in linear light, 0 to 1 each; the default where there is none."""
        for chunk in self.chunks():
            if chunk.kind in (_COLOR_24, _LIN_COLOR_24):
                coded = chunk.numbers("<u1", 3)[0].astype(np.float64) / 255.0
            elif chunk.kind in (_COLOR_F, _LIN_COLOR_F):
                coded = np.nan_to_num(chunk.floats(3)[0]).clip(0.0, 1.0)
            else:
                continue
            linear = srgb_to_linear(coded) if chunk.kind in (_COLOR_F, _COLOR_24) else coded
            red, green, blue = linear.tolist()
            return red, green, blue
        return default

    def share(self, default: float = 0.0) -> float:
        """The percentage in its chunks, as 0 to 1; the default where there is none."""
        for chunk in self.chunks():
            if chunk.kind == _INT_PERCENTAGE:
                return min(int(chunk.numbers("<u2", 1)[0][0]) / 100.0, 1.0)
            if chunk.kind == _FLOAT_PERCENTAGE:
                return float(np.nan_to_num(chunk.floats(1)[0][0]).clip(0.0, 1.0))
        return default

    def refuse(self, expected: str, found: str) -> SceneError:
        """The error for content that is not as expected; raise it."""
        return SceneError(f"{self.label}: chunk {self.kind:04x}, byte {self.start}: expected {expected}, found {found}")
