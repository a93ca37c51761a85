"""What is kept between frames counts for what it takes."""

from __future__ import annotations

import gc
import tracemalloc

from renderer.display import Display
from renderer.frame import FrameRequest
from renderer.gaze import Gaze
from renderer.library import SceneLibrary
from renderer.memory import Memory
from renderer.quality import Quality
from renderer.workers import WorkerPool

SCREENS = 300


def test_screens_of_one_pixel_take_no_more_than_is_counted(pool: WorkerPool) -> None:
    """Whoever asks for ever other ones would else fill far more than the caches may hold."""
    prepared, memory = SceneLibrary().load("matte"), Memory(1 << 30, 1 << 30)

    def keep(number: int) -> None:
        display = Display(1, 1, width_cm=1.0 + number)
        request = FrameRequest(Gaze(0.5, 0.5), display, None, Quality())
        memory.store(prepared, request, memory.map(display, request.quality, request.gaze, pool)[0])

    keep(0)
    gc.collect()
    counted = memory.maps.nbytes + memory.stores.nbytes
    tracemalloc.start()
    try:
        for number in range(1, SCREENS):
            keep(number)
        gc.collect()
        taken = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert memory.maps.entries == memory.stores.entries == SCREENS
    assert taken < memory.maps.nbytes + memory.stores.nbytes - counted
