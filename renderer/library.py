"""The scenes that can be asked for by name: the built-in ones and those of a folder."""

from __future__ import annotations

import hashlib
import os
import re
from collections import OrderedDict
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from threading import Lock
from typing import Final

from renderer.errors import SceneError, UnknownScene
from renderer.prepared import PreparedScene, prepare
from renderer.scene import Scene
from renderer.scene_file import SCENE_FILE, load_scene_folder
from renderer.scenes import BUILT_IN
from renderer.version import source_hash

SCENE_ID: Final = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")
"""What the id of a scene looks like, in full; the same is the name of its folder."""

DEFAULT_MAX_BYTES: Final = 2 << 30
"""Prepared scenes kept by default: 2 GiB."""

MAX_FILES: Final = 10_000
"""Most files of a scene folder; more are more likely a wrong folder than a scene."""


class SceneLibrary:
    """Loads and prepares scenes, each once, and keeps those used last.

    Safe to use from several threads. A scene whose files changed is loaded anew; one that cannot be loaded
    raises until they change, and leaves the others alone. A folder named like a built-in scene takes its place.

    Args:
        folder: holds one folder for each scene, named by its id, with a scene.toml in it; None for none.
            Nothing outside it is opened.
        max_bytes: bound on all prepared scenes kept, by their `nbytes`; the last one used is always kept.
        read: reads the scene of a folder, which messages call by the name given; None: in this process.
        watch: entered while a scene of this id and version is prepared, after it was read; may refuse it by a
            `SceneError`.

    Raises:
        SceneError: for a folder that does not exist.
    """

    def __init__(
        self,
        folder: Path | None = None,
        max_bytes: int = DEFAULT_MAX_BYTES,
        read: Callable[[Path, str], Scene] | None = None,
        watch: Callable[[str, str], AbstractContextManager[None]] = lambda *_: nullcontext(),
    ) -> None:
        if folder is not None and not folder.is_dir():
            raise SceneError(f"{folder}: expected a folder of scenes, found none")
        self._folder = None if folder is None else folder.resolve()
        self._max_bytes = max_bytes
        self._read = read or _read_here
        self._watch = watch
        self._lock = Lock()
        self._ready: OrderedDict[str, tuple[str, PreparedScene]] = OrderedDict()
        self._broken: dict[str, tuple[str, str]] = {}
        self._loading: dict[tuple[str, str], Future[PreparedScene]] = {}

    @property
    def nbytes(self) -> int:
        """Size of the prepared scenes kept."""
        with self._lock:
            return sum(prepared.nbytes for _, prepared in self._ready.values())

    def ids(self) -> tuple[str, ...]:
        """Ids of all scenes: the built-in ones, then those of the folder by name."""
        return (*BUILT_IN, *(name for name in self._names() if name not in BUILT_IN and self._place(name)))

    def load(self, scene_id: str) -> PreparedScene:
        """The scene, from memory if its files have not changed.

        Raises:
            UnknownScene: if no scene has this id.
            SceneError: if it cannot be loaded.
        """
        version = self.version(scene_id)
        mine = Future[PreparedScene]()
        with self._lock:
            if scene_id in self._ready and self._ready[scene_id][0] == version:
                self._ready.move_to_end(scene_id)
                return self._ready[scene_id][1]
            if scene_id in self._broken and self._broken[scene_id][0] == version:
                raise SceneError(self._broken[scene_id][1])
            loading = self._loading.setdefault((scene_id, version), mine)
        if loading is mine:
            self._load(scene_id, version, mine)
        return loading.result()

    def version(self, scene_id: str) -> str:
        """A short text that changes with the scene's files and with the renderer's code.

        Raises:
            UnknownScene: if no scene has this id.
            SceneError: if its folder holds too many files.
        """
        place = self._place(scene_id)
        if place is None:
            if scene_id in BUILT_IN:
                return source_hash()
            raise UnknownScene(scene_id, self.ids())
        digest = hashlib.sha256(source_hash().encode())
        for line in _listing(place, scene_id):
            digest.update(line.encode("utf-8", "surrogateescape"))
        return digest.hexdigest()[:16]

    def _names(self) -> list[str]:
        """Names of what the folder holds; none if it is gone."""
        try:
            return [] if self._folder is None else sorted(os.listdir(self._folder))
        except OSError:
            return []

    def _place(self, scene_id: str) -> Path | None:
        """The folder of a scene, None unless it is there; a link that leaves the scenes folder is not."""
        if self._folder is None or not SCENE_ID.fullmatch(scene_id):
            return None
        place = Path(os.path.realpath(self._folder / scene_id))
        return place if place.is_relative_to(self._folder) and os.path.isfile(place / SCENE_FILE) else None

    def _load(self, scene_id: str, version: str, mine: Future[PreparedScene]) -> None:
        """Load a scene, for this thread and those that wait for `mine`."""
        try:
            scene = self._scene(scene_id)
            with self._watch(scene_id, version):
                prepared = prepare(scene)
        except BaseException as error:
            with self._lock:
                del self._loading[scene_id, version]
                if isinstance(error, SceneError):
                    self._broken[scene_id] = (version, str(error))
            mine.set_exception(error)
            return
        with self._lock:
            del self._loading[scene_id, version]
            self._broken.pop(scene_id, None)
            self._keep(scene_id, version, prepared)
        mine.set_result(prepared)

    def _scene(self, scene_id: str) -> Scene:
        place = self._place(scene_id)
        if place is not None:
            return self._read(place, scene_id)
        if scene_id not in BUILT_IN:
            raise UnknownScene(scene_id, self.ids())
        return BUILT_IN[scene_id]()

    def _keep(self, scene_id: str, version: str, prepared: PreparedScene) -> None:
        self._ready[scene_id] = (version, prepared)
        self._ready.move_to_end(scene_id)
        total = sum(kept.nbytes for _, kept in self._ready.values())
        while total > self._max_bytes and len(self._ready) > 1:
            _, (_, dropped) = self._ready.popitem(last=False)
            total -= dropped.nbytes


def _read_here(place: Path, label: str) -> Scene:
    return load_scene_folder(place, label=label)


def _listing(place: Path, scene_id: str) -> Iterator[str]:
    """A line for each file of a scene, that changes when the file does."""
    count = 0
    for folder, folders, names in os.walk(place):
        folders.sort()
        count += len(names)
        if count > MAX_FILES:
            raise SceneError(f"{scene_id}: expected at most {MAX_FILES} files in the folder of a scene, found more")
        for name in sorted(names):
            path = os.path.join(folder, name)
            try:
                found = os.stat(path)
            except OSError:
                continue
            yield f"{os.path.relpath(path, place)} {found.st_size} {found.st_mtime_ns} {found.st_ctime_ns}\n"
