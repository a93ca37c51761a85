"""The seam: every sample of every frame goes through it, and what is behind it is told when to give up."""

from __future__ import annotations

import statistics
import threading
import time

import numpy as np
import pytest

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.frame import Abandoned, FrameRequest, RayCounts
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import ANTIALIASING, Quality
from renderer.store import SampleStore, add_samples
from renderer.tracing import Lack, ThreadTracing, Traced, block_starts, total_rays
from renderer.whitted import Cells, block_rays, trace_cells
from renderer.workers import WorkerPool, Workers
from tests.renderer.drawing import glass_and_mirror

SCREEN = Display(64, 36, width_cm=6.0)
SEAM_AIM = 1.02
"""Most that the seam may add to the time of tracing."""


class Counting:
    """Traces on threads, and counts."""

    def __init__(self) -> None:
        self.samples = 0
        self.abandon: list[threading.Event | None] = []

    def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
        self.abandon.append(pool.abandon)
        self.samples += int((lack.until - lack.first).sum())
        return ThreadTracing().trace(lack, store, pool)


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(antialiasing: str = "stochastic", samples: int = 6, gaze: tuple[float, float] = (30, 20)) -> FrameRequest:
    quality = Quality(samples_per_cell=samples, antialiasing=antialiasing, acuity=Acuity(scale=8.0), max_depth=3)
    return FrameRequest(Gaze(*gaze), SCREEN, None, quality, linear=True)


@pytest.mark.parametrize("antialiasing", ANTIALIASING)
def test_every_sample_of_a_frame_goes_through_the_seam(
    scene: PreparedScene, renderer: Renderer, antialiasing: str
) -> None:
    counting = Counting()
    through = Renderer(2, tracing=counting)
    for gaze in ((30.0, 20.0), (50.0, 30.0)):
        counting.samples = 0
        frame = through.render(scene, asked(antialiasing, gaze=gaze))
        assert frame.cost.samples_traced == counting.samples > 0
        np.testing.assert_array_equal(frame.pixels, renderer.render(scene, asked(antialiasing, gaze=gaze)).pixels)
    through.render(scene, asked(antialiasing, gaze=(50.0, 30.0)))
    assert counting.abandon == [None] * len(counting.abandon)
    through.close()


def test_what_traces_is_told_when_to_give_up(scene: PreparedScene) -> None:
    counting = Counting()
    through = Renderer(1, tracing=counting)
    abandon = threading.Event()
    through.render(scene, asked(), abandon)
    assert counting.abandon == [abandon]
    abandon.set()
    with pytest.raises(Abandoned):
        through.render(scene, asked(samples=7), abandon)
    through.close()


@pytest.mark.bench
def test_the_seam_adds_nothing_to_the_time_of_tracing() -> None:
    """In turn: through the seam, and the same blocks by the functions behind it."""
    prepared, pool = SceneLibrary().load("atrium"), WorkerPool(2)
    lacks: list[Lack] = []

    class Keeping:
        def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
            lacks.append(lack)
            return ThreadTracing().trace(lack, store, pool)

    keeping = Renderer(2, tracing=Keeping())
    keeping.render(prepared, FrameRequest(Gaze(480, 270), Display(960, 540), None, Quality(samples_per_cell=4)))
    keeping.close()
    (lack,) = lacks
    slots = int(lack.squares.slots.max()) + 1

    def directly(store: SampleStore) -> RayCounts:
        squares, starts = lack.squares, block_starts(lack.first, lack.until, block_rays(prepared, lack.quality))
        counts = [RayCounts()] * (len(starts) - 1)

        def block(number: int) -> None:
            part = slice(starts[number], starts[number + 1])
            first, until = lack.first[part], lack.until[part]
            some = Cells(squares.x, squares.y, squares.side, lack.chosen[part], first, until)
            radiance, counts[number] = trace_cells(prepared, lack.view, some, lack.quality)
            add_samples(store.samples, store.spread, store.white, squares.slots, some.chosen, until, radiance)

        pool.run(block, len(counts))
        return total_rays(counts)

    ratios = []
    for _ in range(15):
        took = []
        for way in (lambda store: ThreadTracing().trace(lack, store, pool).rays, directly):
            store = SampleStore(slots)
            began = time.process_time()
            rays = way(store)
            took.append(time.process_time() - began)
            assert rays.primary == int(lack.until.sum())
        ratios.append(took[0] / took[1])
    pool.close()
    assert statistics.median(ratios) < SEAM_AIM, ratios
