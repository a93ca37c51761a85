"""Whether frames are done when they were to be, while a gaze is played back. Measures time: ask for it with -m bench.

`pytest -m bench -s tests/clients/test_deadlines.py` prints a line for each scene, screen and deadline. A frame that
says from the outset that it cannot be done in time (`deadline_promised`) breaks no promise when it is late, and is
counted by itself.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from clients.simulated_gaze import simulated_gaze
from renderer.acuity import Acuity
from renderer.display import Display
from renderer.frame import FrameCost, FrameRequest
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality

FRAMES = 150
LEARNING = 10
"""Frames at the beginning that do not count: nothing is known of the machine then."""

LATE = 1.1
"""Share of the deadline beyond which a frame is late."""

IN_TIME = 0.95
"""Share of the frames that promised to be in time which are not to be late."""

FEW = 20
"""Fewer promises than this are no sample to judge by."""

SCREENS = {"1080p": Display(1920, 1080), "360p": Display(640, 360)}


class Played(NamedTuple):
    """A frame of a replay.

    Attributes:
        time_ms: from the request to the picture.
        cost: as it states it.
    """

    time_ms: float
    cost: FrameCost


def played(renderer: Renderer, scene: PreparedScene, display: Display, deadline_ms: float) -> Iterator[Played]:
    """Frames for a simulated eye; each begins when the last is done, or a deadline after that began."""
    trace = simulated_gaze(FRAMES * max(deadline_ms, 100.0) / 1000 * 2, seed=3)
    quality = Quality(samples_per_cell=16, deadline_ms=deadline_ms)
    now_ms = 0.0
    for _ in range(FRAMES):
        index = min(int(np.searchsorted(trace.time_ms, now_ms)), len(trace.time_ms) - 1)
        if not trace.valid[index]:
            index = int(np.flatnonzero(trace.valid[: index + 1])[-1])
        gaze = Gaze(float(trace.x[index]) * display.width_px, float(trace.y[index]) * display.height_px)
        began = time.perf_counter()
        cost = renderer.render(scene, FrameRequest(gaze, display, None, quality)).cost
        time_ms = 1000 * (time.perf_counter() - began)
        yield Played(time_ms, cost)
        now_ms += max(time_ms, deadline_ms)


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    made = Renderer()
    made.warm_up()
    yield made
    made.close()


@pytest.mark.bench
@pytest.mark.parametrize("deadline_ms", [33.0, 60.0, 120.0])
@pytest.mark.parametrize("screen", SCREENS)
@pytest.mark.parametrize("scene", ["spheres", "atrium", "gallery"])
def test_frames_are_in_time(renderer: Renderer, scene: str, screen: str, deadline_ms: float) -> None:
    renderer.forget_samples()
    frames = list(played(renderer, SceneLibrary().load(scene), SCREENS[screen], deadline_ms))[LEARNING:]
    share = np.array([frame.time_ms for frame in frames]) / deadline_ms
    scale = np.mean([frame.cost.acuity_scale for frame in frames])
    samples = np.mean([frame.cost.mean_samples for frame in frames])
    promised = np.array([frame.cost.deadline_promised for frame in frames], dtype=np.bool_)
    in_time = float(np.mean(share[promised] <= LATE)) if promised.any() else 1.0
    late = np.count_nonzero(share[~promised] > LATE)
    sys.stdout.write(
        f"\n{scene} {screen} {deadline_ms:g} ms: {100 * in_time:.1f} % of {promised.sum()} promised in time; "
        f"{np.count_nonzero(~promised)} not promised, {late} of them late; share of the deadline: "
        f"median {np.median(share):.2f}, p95 {np.percentile(share, 95):.2f}, most {share.max():.2f}; "
        f"cells x {scale:.2f}, {samples:.1f} samples",
    )
    assert in_time >= IN_TIME or promised.sum() < FEW


@pytest.mark.bench
@pytest.mark.parametrize("scene", ["spheres", "atrium", "gallery"])
def test_what_a_deadline_chooses_is_on_the_front(renderer: Renderer, scene: str) -> None:
    """No neighbour on the ladder, finer or coarser and with as many samples as fit its time, is nearer the truth.

    The truth is the frame of a cell a pixel and 256 samples; the distance is over the whole screen, up to white.
    """
    prepared, display, gaze = SceneLibrary().load(scene), SCREENS["360p"], Gaze(220.0, 150.0)
    exposure = prepared.scene.exposure

    def shown(quality: Quality) -> tuple[float, np.ndarray, FrameCost]:
        renderer.forget_samples()
        began = time.perf_counter()
        frame = renderer.render(prepared, FrameRequest(gaze, display, None, quality, linear=True))
        return 1000 * (time.perf_counter() - began), np.minimum(exposure * frame.pixels, 1.0), frame.cost

    truth = shown(Quality(map="full", samples_per_cell=256))[1]
    for _ in range(LEARNING):
        chosen = shown(Quality(samples_per_cell=64, deadline_ms=60.0))[2]
    rows = []
    for factor in (0.67, 1.0, 1.5, 2.0):
        scale, samples = chosen.acuity_scale * factor, chosen.samples_per_cell
        plain = Quality(samples_per_cell=samples, acuity=Acuity(scale=scale))
        cells = renderer.cell_map(display, plain, gaze)[0].cells
        samples = max(1, round(samples * chosen.cells / cells))
        plain = replace(plain, samples_per_cell=samples)
        taken = [shown(plain) for _ in range(5)]
        off = float(np.sqrt(np.mean((taken[0][1] - truth) ** 2)))
        rows.append((factor, samples, float(np.median([time_ms for time_ms, *_ in taken])), off))
    sys.stdout.write(
        f"\n{scene}: " + "; ".join(f"x {f:g}: {n} samples, {t:.1f} ms, off {e:.4f}" for f, n, t, e in rows)
    )
    _, _, time_ms, off = rows[1]
    assert not [row for row in rows if row[2] < 0.9 * time_ms and row[3] < 0.98 * off]
