"""What a frame must not depend on: the number of threads, who compiled it, Python's development mode."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.pipeline import Renderer
from tests.renderer.drawing import shoot
from tests.stability.plain_python import frames
from tests.stability.random_scenes import random_scene

TOP = Path(__file__).parents[2]


@settings(max_examples=6)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["stochastic", "regular", "adaptive"]))
def test_the_number_of_threads_changes_no_bit(renderer: Renderer, seed: int, antialiasing: str) -> None:
    seen = []
    for threads in (1, 2, 8):
        fresh = Renderer(threads=threads)
        seen.append(shoot(fresh, random_scene(seed), 64, 36, samples=8, antialiasing=antialiasing).pixels)
        fresh.close()
    np.testing.assert_array_equal(seen[1], seen[0])
    np.testing.assert_array_equal(seen[2], seen[0])


@pytest.mark.slow
def test_plain_python_gives_the_same_frames(renderer: Renderer, tmp_path: Path) -> None:
    """In which an index out of range is an error, in development mode, and warnings are errors.

    Only those of arithmetic are not: it overflows in hashes, and divides by zero where a formula says so, as compiled
    code does without a word. What Embree calls back and what calls it cannot run so: embreex asks it instead. Plain
    Python leaves float32 times a constant in float32, where compiled code widens it: that is what `rtol` allows, and
    `FLIPS` pixels with a sample at an edge.
    """
    file = tmp_path / "frames.npy"
    command = [sys.executable, "-X", "dev", "-W", "error", "-W", "ignore::RuntimeWarning"]
    subprocess.run(
        [*command, "-m", "tests.stability.plain_python", str(file)],
        check=True, timeout=300, cwd=TOP, env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(TOP)},
    )  # fmt: skip
    plain, compiled = np.load(file), frames(renderer, plain=False)
    assert np.isfinite(plain).all()
    off = np.abs(plain - compiled) > RTOL * np.maximum(1.0, compiled)
    assert off.any(axis=-1).sum() <= FLIPS


RTOL = 1e-5
FLIPS = 4
