"""The folder tree that a scene may read, and nothing outside it."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from renderer.codec import MAX_TEXTURE_PIXELS
from renderer.errors import SceneError

MAX_FILE_BYTES = 1 << 30
"""Largest mesh, texture or scene file that is read by default: 1 GiB."""


@dataclass(frozen=True, slots=True)
class Folder:
    """A folder whose files may name each other.

    Attributes:
        root: the tree that may be read, without links in it (`Path.resolve`).
        label: what messages call it; may be empty, for the folder the user is in.
        max_bytes: larger files are refused.
        max_texture_pixels: images of more pixels are refused, each.
    """

    root: Path
    label: str
    max_bytes: int = MAX_FILE_BYTES
    max_texture_pixels: int = MAX_TEXTURE_PIXELS

    def read(self, name: str, wanted_by: str, beside: str = "") -> tuple[bytes, str]:
        """The content of a file, and its path from the root.

        Args:
            name: path as a file of this folder states it, with slashes or backslashes between its parts.
            wanted_by: who asks, for messages: "vase.mtl: line 3".
            beside: the asking file's path from the root; `name` is relative to where that file lies.

        Raises:
            SceneError: for a file that is missing, too large, not a file, or outside the tree, be it by
                "..", by an absolute path or by a symbolic link.
        """
        path = self._inside(name, wanted_by, beside)
        inner = path.relative_to(self.root).as_posix()
        try:
            if not path.is_file():
                raise SceneError(f"{wanted_by}: expected an existing file, found no file {inner!r}")
            size = path.stat().st_size
            if size > self.max_bytes:
                raise SceneError(f"{wanted_by}: {inner!r}: expected at most {self.max_bytes} bytes, found {size} bytes")
            return path.read_bytes(), inner
        except OSError as error:
            raise SceneError(
                f"{wanted_by}: expected a readable file, found {inner!r}: {error.strerror or type(error).__name__}"
            ) from error

    def file_label(self, inner: str) -> str:
        """What messages call the file with path `inner` from the root."""
        return f"{self.label}/{inner}" if self.label else inner

    def _inside(self, name: str, wanted_by: str, beside: str) -> Path:
        stated = name.strip().replace("\\", "/")
        if not stated or not stated.isprintable():
            raise SceneError(f"{wanted_by}: expected the name of a file, found {name!r}")
        path = Path(os.path.realpath(((self.root / beside).parent if beside else self.root) / stated))
        if not path.is_relative_to(self.root) or path == self.root:
            raise SceneError(f"{wanted_by}: expected a file inside the folder {self.label or '.'}, found {name!r}")
        return path


def percent_decoded(uri: str) -> str:
    """A relative URI as a path: %20 is a blank."""
    plain = re.sub(rb"%([0-9a-fA-F]{2})", lambda match: bytes([int(match[1], 16)]), uri.encode("utf-8", "replace"))
    return plain.decode("utf-8", "replace")
