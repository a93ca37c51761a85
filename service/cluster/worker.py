"""A worker: one for each node of the cluster, with all of its cores. Nothing here knows Ray.

It holds scenes and their search trees, traces pieces of frames, and does tasks: whole frames of a clip, settings of a
measurement. What goes wrong is told, not raised, so that whoever asked can tell a broken scene from a broken worker.
"""

from __future__ import annotations

import os
import pickle
import platform
import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, NamedTuple

from renderer.forced import with_effects
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.version import source_hash
from renderer.workers import WorkerPool
from service.cluster.piece import Colours, Piece, trace_piece

SCENE_BYTES_VARIABLE = "GAZETRACE_SCENE_BYTES"
DEFAULT_SCENE_BYTES = 1 << 30
"""Memory for scenes on a node, by the environment that its Ray was started in."""

LONGEST_TEXT = 300
"""Characters of an error that are told."""

DONE, MISSING, FAILED = "done", "missing", "failed"
"""What became of it; `MISSING`: the scene is not held, or no longer."""

Task = Callable[[Renderer, PreparedScene, Any], Any]
"""A whole piece of work, with what was packed beside its scene; it and its result can be pickled."""


class Presence(NamedTuple):
    """A worker that is ready.

    Attributes:
        host: name of its machine.
        process: number of its process there.
        threads: it renders on.
        source: hash of its renderer's code; workers with other code than the service's make other frames.
    """

    host: str
    process: int
    threads: int
    source: str


class Answer(NamedTuple):
    """What became of something that a worker was asked for.

    Attributes:
        kind: `DONE`, `MISSING` or `FAILED`.
        data: pickled `Colours`, or the pickled result of a task.
        text: what went wrong.
    """

    kind: str
    data: bytes = b""
    text: str = ""


class _Held(NamedTuple):
    prepared: PreparedScene
    beside: Any


class Worker:
    """Holds scenes, traces and does tasks; its methods may be called from several threads.

    Args:
        threads: to render on.
    """

    def __init__(self, threads: int) -> None:
        self._renderer = Renderer(threads)
        self._renderer.warm_up()
        self._pool = WorkerPool(threads)
        self._most_bytes = int(os.environ.get(SCENE_BYTES_VARIABLE) or DEFAULT_SCENE_BYTES)
        self._scenes: OrderedDict[str, _Held] = OrderedDict()
        self._lock = threading.Lock()
        self._one_task = threading.Lock()
        self._tracing = 0

    def presence(self) -> Presence:
        """Who this is."""
        return Presence(platform.node(), os.getpid(), self._renderer.threads, source_hash())

    def load(self, key: str, packed: Any) -> Answer:
        """Prepare a scene and hold it as `key`; scenes used longest ago make room for it.

        Args:
            key: any name.
            packed: buffer of `pack_scene`.
        """
        with self._lock:
            if key in self._scenes:
                return Answer(DONE)
        try:
            scene, beside = pickle.loads(packed)
            held = _Held(prepare(scene), beside)
            if held.prepared.nbytes > self._most_bytes:
                text = f"it takes {held.prepared.nbytes:,} bytes, more than {SCENE_BYTES_VARIABLE}={self._most_bytes:,}"
                return Answer(FAILED, text=text)
        except Exception as error:
            return Answer(FAILED, text=_told(error))
        with self._lock:
            self._scenes[key] = held
            total = sum(each.prepared.nbytes for each in self._scenes.values())
            while total > self._most_bytes and len(self._scenes) > 1:
                _, dropped = self._scenes.popitem(last=False)
                total -= dropped.prepared.nbytes
        return Answer(DONE)

    def trace(self, key: str, packed: bytes) -> Answer:
        """Trace a pickled `Piece` of scene `key`."""
        held = self._scene(key)
        if held is None:
            return Answer(MISSING)
        try:
            piece: Piece = pickle.loads(packed)
            with self._lock:
                self._tracing += 1
                beside = self._tracing
            try:
                colours = trace_piece(with_effects(held.prepared, piece.quality.effects), piece, self._pool)
            finally:
                with self._lock:
                    beside += self._tracing
                    self._tracing -= 1
            return Answer(DONE, pickle.dumps(_fairly(colours, beside / 2)))
        except Exception as error:
            return Answer(FAILED, text=_told(error))

    def run(self, key: str, packed: bytes) -> Answer:
        """Do a pickled `Task` with scene `key`, one at a time."""
        held = self._scene(key)
        if held is None:
            return Answer(MISSING)
        try:
            task: Task = pickle.loads(packed)
            with self._one_task:
                return Answer(DONE, pickle.dumps(task(self._renderer, held.prepared, held.beside)))
        except Exception as error:
            return Answer(FAILED, text=_told(error))

    def _scene(self, key: str) -> _Held | None:
        with self._lock:
            if key in self._scenes:
                self._scenes.move_to_end(key)
            return self._scenes.get(key)


def pack_scene(prepared: PreparedScene, beside: Any = None) -> bytes:
    """A scene as it is sent, with what tasks want beside it."""
    return pickle.dumps((prepared.scene, beside), protocol=pickle.HIGHEST_PROTOCOL)


def _fairly(colours: Colours, at_once: float) -> Colours:
    """With the time that it would have taken alone: pieces traced at once share the threads."""
    return colours._replace(trace_ns=int(colours.trace_ns / max(1.0, at_once)))


def _told(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:LONGEST_TEXT]
