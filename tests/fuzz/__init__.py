"""Damaged and hostile input, for as long as one likes: `python -m tests.fuzz --minutes 10`.

What the readers of files, messages and requests execute guides it (atheris, from the extra `fuzz`). A finding ends as
a test of its own beside the others.
"""

from __future__ import annotations

MESHES = (
    "a.obj", "m.mtl", "a.gltf", "a.glb", "text.ply", "little.ply", "big.ply", "binary.stl", "text.stl", "a.3ds",
    "a.dae",
)  # fmt: skip
TRACKERS = ("smi", "asl", "iscan", "gazepoint", "eyetribe", "csv", "jsonl")
NAMES = (
    "scene", *(f"mesh:{name}" for name in MESHES), "picture", "message", "frame", "request", "query", "trace",
    *(f"tracker:{name}" for name in TRACKERS),
)  # fmt: skip
"""Targets, in the order they are run."""
