"""Warming up compiles whatever frames need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[2]
PATIENCE_S = 300

FRAMES_AFTER = """
import gc
from itertools import product

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import prepare
from renderer.quality import MAPS, RECONSTRUCTIONS, Quality
from renderer.scenes import BUILT_IN


def compiled():
    kernels = [(k.py_func, k.overloads) for k in gc.get_objects() if type(k).__name__ == "CPUDispatcher"]
    return {(function.__module__, function.__name__, kinds) for function, known in kernels for kinds in known}


renderer = Renderer(2)
renderer.warm_up()
before = compiled()
assert before
qualities = [Quality(map=kind, reconstruction=way) for kind, way in product(MAPS, RECONSTRUCTIONS)]
qualities += [Quality(antialiasing=way, samples_per_cell=9) for way in ("regular", "stochastic", "adaptive")]
qualities += [Quality(deadline_ms=5.0), Quality(max_error=0.1), Quality(acuity=Acuity(model="watson"))]
for scene in BUILT_IN.values():
    prepared = prepare(scene())
    for quality, linear in product(qualities, (False, True)):
        renderer.render(prepared, FrameRequest(Gaze(20.0, 9.0), Display(48, 32), None, quality, linear))
for module, name, _ in sorted(compiled() - before, key=str):
    print(module, name)
"""


def test_warming_up_leaves_nothing_to_compile() -> None:
    """In a process of its own, where nothing else has been rendered."""
    command = (sys.executable, "-W", "error", "-c", FRAMES_AFTER)
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
