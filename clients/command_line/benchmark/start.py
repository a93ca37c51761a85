"""What a new process takes: the first frame with and without compiled kernels, an idle service, a large file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from clients.command_line.benchmark.growth_scenes import hills
from clients.command_line.benchmark.row import Row, measured_row, missing_row
from clients.command_line.benchmark.stream_rows import memory_mib
from clients.command_line.errors import CommandFailed
from clients.command_line.own_service import PACKAGES, own_service_process

GROUP: Final = "start"
TRIANGLES: Final = 1_000_000

PATIENCE_S: Final = 1800
"""Longest that a process may take [s]."""

CACHE: Final = "NUMBA_CACHE_DIR"


def steps(repeats: int) -> int:
    """How often `start_rows` calls `tick`."""
    return 1 + 3 * repeats


def start_rows(
    scene: str, size: str, repeats: int, tick: Callable[[], None], triangles: int = TRIANGLES
) -> tuple[Row, ...]:
    """Time processes of their own, one after the other.

    Args:
        scene, size: of the first frame, as `gazetrace render` takes them.
        repeats: how often each but the cold start is timed, 1 or more.
        tick: called after each process.
        triangles: of the file that is loaded.

    Raises:
        CommandFailed: if a process fails.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        variables = {CACHE: str(folder / "kernels")}
        words = ["-m", "clients.command_line", "render", scene, "--gaze", "0,0", "--size", size]
        words += ["-o", str(folder / "frame.jpg")]

        def first_frame_s() -> float:
            began = time.perf_counter()
            _run(words, variables)
            tick()
            return time.perf_counter() - began

        cold = first_frame_s()
        warm = [first_frame_s() for _ in range(repeats)]
        ready, idle = zip(*(_service(variables, tick) for _ in range(repeats)), strict=True)
        mesh = folder / "hills.ply"
        written = _write_hills(mesh, triangles)
        loads = [_loaded(mesh, variables, tick) for _ in range(repeats)]
    frame = f"{scene}, {size}"
    memory = [mib for mib in idle if mib is not None]
    what = "memory of an idle service"
    return (
        measured_row(GROUP, "start to first frame, nothing compiled", [cold], "s", note=frame),
        measured_row(GROUP, "start to first frame, kernels on disk", warm, "s", note=frame),
        measured_row(GROUP, "start of a service until it is ready", ready, "s"),
        measured_row(GROUP, what, memory, "MiB")
        if memory
        else missing_row(GROUP, what, "needs /proc, as Linux has it"),
        measured_row(
            GROUP, "reading a PLY file", [load["read_s"] for load in loads], "s", note=f"{written:,} triangles"
        ),
        measured_row(GROUP, "preparing its scene", [load["prepare_s"] for load in loads], "s"),
    )


def _service(variables: Mapping[str, str], tick: Callable[[], None]) -> tuple[float, float | None]:
    """Seconds until a service is ready, and its memory then [MiB]."""
    began = time.perf_counter()
    with own_service_process((), variables) as service:
        found = time.perf_counter() - began, memory_mib(service.process)
    tick()
    return found


def _loaded(mesh: Path, variables: Mapping[str, str], tick: Callable[[], None]) -> dict[str, Any]:
    said = _run(["-m", "clients.command_line.benchmark.loading", str(mesh)], variables)
    tick()
    return dict(json.loads(said))


def _write_hills(path: Path, triangles: int) -> int:
    """A binary PLY file of about so many triangles; how many they are."""
    (mesh,) = hills(triangles).meshes
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(mesh.faces), dtype=[("corners", "u1"), ("vertices", "<i4", 3)])
    faces["corners"], faces["vertices"] = 3, mesh.faces
    path.write_bytes(header.encode() + mesh.vertices.astype("<f4").tobytes() + faces.tobytes())
    return len(mesh.faces)


def _run(words: Sequence[str], variables: Mapping[str, str]) -> str:
    """What a Python process prints."""
    environ = {**os.environ, **variables}
    environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(PACKAGES), environ.get("PYTHONPATH"))))
    command = (sys.executable, "-P", *words)
    done = subprocess.run(command, env=environ, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    if done.returncode != 0:
        raise CommandFailed(f"{' '.join(words)}: {done.stderr.strip() or 'it failed'}")
    return done.stdout
