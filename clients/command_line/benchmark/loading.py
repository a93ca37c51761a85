"""Load a mesh file in a process of its own and print, as JSON, how long that took: `python -m ... FILE`."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from renderer.framing import frame_model
from renderer.mesh_file import load_model
from renderer.prepared import prepare


def main(path: Path) -> None:
    """Read, frame and prepare the file."""
    began = time.perf_counter()
    model = load_model(path)
    read = time.perf_counter()
    prepared = prepare(frame_model(model, path.stem))
    done = time.perf_counter()
    print(json.dumps({"triangles": prepared.scene.triangles, "read_s": read - began, "prepare_s": done - read}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
