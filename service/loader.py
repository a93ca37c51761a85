"""Scenes of a folder, read in a process of their own.

Readers of meshes and pictures run native code over files of unknown origin. What brings their process down, keeps it
busy or fills its memory is an error of that scene, and of nothing else.
"""

from __future__ import annotations

import json
import os
import pickle
import resource
import signal
import subprocess
import sys
import threading
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import BinaryIO

from renderer.errors import SceneError
from renderer.scene import Scene
from renderer.scene_file import load_scene_folder
from service.settings import Settings

PACKAGES = Path(__file__).parents[1]

AT_ONCE = 2
"""Scenes read at once; others wait, and so does the memory they take."""

CPU_S_PER_S = 2
"""Processor time a reader may take for each second it is granted: it ends although nobody is left to end it."""


@dataclass(frozen=True, slots=True)
class Task:
    """One scene to read.

    Attributes:
        place: its folder.
        label: what messages call it.
        max_bytes, max_triangles, max_texture_pixels: of each file, of the scene, of each picture.
        memory_bytes: that reading it may take.
        seconds: that it may take.
    """

    place: str
    label: str
    max_bytes: int
    max_triangles: int
    max_texture_pixels: int
    memory_bytes: int
    seconds: int


class Loader:
    """Reads scenes, each in a process of its own. Safe to use from several threads."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._places = threading.BoundedSemaphore(AT_ONCE)
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._closed = False

    @property
    def processes(self) -> tuple[int, ...]:
        """Ids of the processes that read a scene now."""
        with self._lock:
            return tuple(process.pid for process in self._running)

    def read(self, place: Path, label: str) -> Scene:
        """The scene of a folder.

        Raises:
            SceneError: for a mistake in it, and if its reader crashed, took too long or too much memory.
            MemoryError: if no process can be started.
            RuntimeError: if the loader is closed.
        """
        limits = self._settings
        task = Task(
            str(place),
            label,
            limits.max_scene_file_bytes,
            limits.max_triangles,
            limits.max_texture_pixels,
            limits.max_load_bytes,
            limits.max_load_s,
        )
        with self._places, self._start(task) as process:
            late = threading.Event()

            def end() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(task.seconds, end)
            timer.start()
            try:
                return _answer(process, task, late)
            finally:
                timer.cancel()
                process.kill()
                with self._lock:
                    self._running.discard(process)

    def close(self) -> None:
        """End the processes that still read."""
        with self._lock:
            self._closed = True
            for process in self._running:
                process.kill()

    def _start(self, task: Task) -> subprocess.Popen[bytes]:
        path = os.pathsep.join(filter(None, (str(PACKAGES), os.environ.get("PYTHONPATH"))))
        with self._lock:
            if self._closed:
                raise RuntimeError("the loader is closed")
            try:
                process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "service.loader", json.dumps(asdict(task))],
                    env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                )
            except OSError as error:
                raise MemoryError(f"no process can be started to read {task.label}: {error}") from error
            self._running.add(process)
            return process


def _answer(process: subprocess.Popen[bytes], task: Task, late: threading.Event) -> Scene:
    """What a reader says.

    Raises:
        SceneError: what is wrong with the scene, or what became of its reader.
    """
    assert process.stdout is not None
    try:
        said = pickle.load(process.stdout)
    except (EOFError, pickle.UnpicklingError):
        status = process.wait()
        if late.is_set() or status == -signal.SIGXCPU:
            message = f"expected to be read within {task.seconds} s, found that it takes more"
        else:
            end = signal.Signals(-status).name if status < 0 else f"status {status}"
            message = f"expected files that can be read, found that reading them ends in {end}"
        raise SceneError(f"{task.label}: {message}") from None
    if isinstance(said, Scene):
        return said
    raise SceneError(str(said))


def main(task: Task, out: BinaryIO) -> None:
    """Read a scene within its limits, and write it, or what is wrong with it, to `out`."""
    _limit(task)
    said: Scene | str
    try:
        said = load_scene_folder(
            Path(task.place),
            label=task.label,
            max_bytes=task.max_bytes,
            max_triangles=task.max_triangles,
            max_texture_pixels=task.max_texture_pixels,
        )
    except SceneError as error:
        said = str(error)
    except MemoryError:
        said = f"{task.label}: expected to be read in {task.memory_bytes:,} bytes of memory, found that it takes more"
    pickle.dump(said, out, protocol=pickle.HIGHEST_PROTOCOL)
    out.flush()


def _limit(task: Task) -> None:
    """Bound what this process may take of the machine from here on."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    memory = pages * resource.getpagesize() + task.memory_bytes
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    seconds = CPU_S_PER_S * task.seconds
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main(Task(**json.loads(sys.argv[1])), sys.stdout.buffer)
