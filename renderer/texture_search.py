"""Textures that a mesh file names by the path they had on its author's machine."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from renderer.codec import decode_texture
from renderer.errors import SceneError
from renderer.folder import Folder, percent_decoded
from renderer.scene import Texture


@dataclass(slots=True)
class TextureSearch:
    """Finds and decodes the textures of one mesh file, each once.

    A texture that is missing or cannot be read does not spoil the model: it is left out with a note.

    Attributes:
        folder: nothing outside it is opened.
        inner: the mesh file's path from the folder's root.
        notes: what was left out, for people.
    """

    folder: Folder
    inner: str
    notes: list[str] = field(default_factory=list)
    found: dict[str, Texture | None] = field(default_factory=dict)

    def load(self, stated: str) -> Texture | None:
        """The texture at a path, or else the one of that name in any case of letters beside the mesh file.

        Args:
            stated: relative or not, with slashes or backslashes, or a file URI.
        """
        if stated not in self.found:
            self.found[stated] = self._load(stated)
        return self.found[stated]

    def _load(self, stated: str) -> Texture | None:
        path = re.sub(r"^file:/*", "", percent_decoded(stated).strip(), flags=re.IGNORECASE).replace("\\", "/")
        name = self._beside(PurePosixPath(path).name)
        for candidate in (path, name):
            if not candidate:
                continue
            try:
                data, inner = self.folder.read(candidate, self.folder.file_label(self.inner), self.inner)
            except SceneError:
                continue
            try:
                return decode_texture(data, self.folder.file_label(inner), self.folder.max_texture_pixels)
            except SceneError as error:
                self.notes.append(f"texture left out: {error}")
                return None
        self.notes.append(f"texture left out: found no file {stated[:200]!r} in the folder of the model")
        return None

    def _beside(self, name: str) -> str:
        """The file beside the mesh file that is called `name` but for the case of letters; empty for none."""
        try:
            names = os.listdir((self.folder.root / self.inner).parent)
        except OSError:
            return ""
        wanted = name.casefold()
        return min((found for found in names if found.casefold() == wanted), default="")
