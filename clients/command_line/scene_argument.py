"""What a person may write for a scene: a name, a folder with a scene.toml, or a mesh file."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from clients.command_line.errors import UsageError
from clients.command_line.progress import working
from renderer.errors import SceneError, UnknownScene

if TYPE_CHECKING:
    from renderer.library import SceneLibrary
    from renderer.prepared import PreparedScene

SCENE_HELP = "name of a scene, folder with a scene.toml, or mesh file"


def add_scenes_folder(parser: argparse.ArgumentParser) -> None:
    """Add `--scenes-folder`."""
    parser.add_argument(
        "--scenes-folder",
        type=Path,
        default=os.environ.get("GAZETRACE_SCENES") or None,
        metavar="DIR",
        help="folder whose NAME/scene.toml are scenes too (default: GAZETRACE_SCENES, or none)",
    )


def open_library(folder: Path | None) -> SceneLibrary:
    """The built-in scenes and those of `folder`.

    Raises:
        UsageError: if there is no such folder.
    """
    if folder is not None and not Path(folder).is_dir():
        raise UsageError(f"--scenes-folder: expected a folder, found {str(folder)!r}")
    from renderer.library import SceneLibrary

    return SceneLibrary(None if folder is None else Path(folder))


def load_scene(text: str, folder: Path | None) -> PreparedScene:
    """The scene that `text` names; a name of the library comes before a path. Says what a mesh file holds that
    is not shown.

    Raises:
        UnknownScene: if it is neither a name nor a path that exists.
        SceneError: if the scene cannot be loaded.
    """
    with working(f"loading {text}"):
        library = open_library(folder)
        if text in library.ids():
            return library.load(text)
        path = Path(text)
        if not path.exists():
            if path.suffix or len(path.parts) > 1:
                raise SceneError(f"{text}: expected a scene folder or a mesh file, found nothing there")
            raise UnknownScene(text, library.ids())

        from renderer.framing import frame_model
        from renderer.mesh_file import load_model
        from renderer.prepared import prepare
        from renderer.scene_file import load_scene_folder

        if path.is_dir():
            return prepare(load_scene_folder(path))
        model = load_model(path)
        prepared = prepare(frame_model(model, path.stem))
    for note in model.notes:
        print(f"gazetrace: note: {path}: {note}", file=sys.stderr)
    return prepared
