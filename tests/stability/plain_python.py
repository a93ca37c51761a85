"""Small frames of random scenes into a file, also where nothing is compiled.

    NUMBA_DISABLE_JIT=1 python -m tests.stability.plain_python frames.npy

Kernels are then plain Python, in which every index is checked. Embree is asked one ray at a time, by embreex.
"""

from __future__ import annotations

import dataclasses
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import Quality
from tests.stability.random_scenes import random_scene

SEEDS = (4, 5, 9, 12)
SIZE = (16, 9)


def with_readable_rows(record: Any) -> Any:
    """A record whose tables, within it too, have rows that are read by attribute in plain Python too."""
    parts = {
        name: part.view(np.recarray) if isinstance(part, np.ndarray) and part.dtype.names
        else with_readable_rows(part) if isinstance(part, tuple)
        else part
        for name, part in record._asdict().items()
    }  # fmt: skip
    return record._replace(**parts)


def readable(prepared: PreparedScene) -> PreparedScene:
    """A scene for plain Python."""
    surfaces = with_readable_rows(prepared.surfaces)
    prepared.intersector._area_lights = surfaces.area_lights
    return dataclasses.replace(prepared, surfaces=surfaces)


def frames(renderer: Renderer, *, plain: bool) -> NDArray[np.float32]:
    """(scenes, h, w, 3) float32 linear frames."""
    made = []
    for number, seed in enumerate(SEEDS):
        prepared = prepare(random_scene(seed))
        quality = Quality(
            map=("aligned", "scanline", "full", "aligned")[number],
            samples_per_cell=4,
            antialiasing=("stochastic", "regular", "stochastic", "adaptive")[number],
            reconstruction=("nearest", "smooth")[number % 2],
        )
        request = FrameRequest(Gaze(5.0, 4.0), Display(*SIZE, distance_cm=20.0), None, quality, linear=True)
        frame = renderer.render(readable(prepared) if plain else prepared, request)
        assert frame.cost.rejected_samples.total == 0
        made.append(np.float32(frame.pixels))
    return np.array(made)


if __name__ == "__main__":
    alone = Renderer(threads=1)
    np.save(sys.argv[1], frames(alone, plain=True))
    alone.close()
