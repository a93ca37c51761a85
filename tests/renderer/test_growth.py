"""Frames that grow: whatever was traced before, given up or finished, the end is the frame of a fresh process."""

from __future__ import annotations

import dataclasses
import itertools
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import whitted
from renderer.acuity import Acuity
from renderer.display import Display
from renderer.errors import SettingsError
from renderer.frame import Abandoned, Frame, FrameRequest
from renderer.gaze import Gaze
from renderer.intersection import Intersector
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, Quality
from renderer.rays import Hits, Vectors
from renderer.tracing import SMALLEST_BLOCK, block_starts
from tests.renderer.drawing import glass_and_mirror

SCREEN = Display(64, 36, width_cm=6.0)
TARGET = 7
PATIENCE_S = 60.0
"""How long another thread may take; only a failing test waits that long."""


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(
    gaze: tuple[float, float] = (30, 20),
    samples: int | None = None,
    tiling: str = "aligned",
    antialiasing: str = "stochastic",
) -> FrameRequest:
    quality = Quality(
        map=tiling, samples_per_cell=TARGET, antialiasing=antialiasing, acuity=Acuity(scale=16.0), max_depth=3
    )
    return FrameRequest(Gaze(*gaze), SCREEN, None, quality, linear=True, samples=samples)


def fresh(scene: PreparedScene, request: FrameRequest) -> Frame:
    renderer = Renderer(threads=1)
    frame = renderer.render(scene, request)
    renderer.close()
    return frame


def same_picture(one: Frame, other: Frame) -> None:
    np.testing.assert_array_equal(one.pixels, other.pixels)
    assert one.cost.rms_error == other.cost.rms_error
    assert one.cost.foveal_rms_error == other.cost.foveal_rms_error
    assert one.cost.mean_samples == other.cost.mean_samples


@pytest.mark.parametrize("path", [(1, 2, 3, 4, 5, 6), (3,), (6, 2, 1), (1, 1, 4, 4)])
@pytest.mark.parametrize(("tiling", "threads"), [("aligned", 1), ("scanline", 2), ("full", 3), ("aligned", 3)])
@pytest.mark.parametrize("antialiasing", ["stochastic", "regular"])
def test_a_frame_grows_to_the_frame_of_a_fresh_process(
    scene: PreparedScene, path: tuple[int, ...], tiling: str, threads: int, antialiasing: str
) -> None:
    growing = Renderer(threads=threads)
    traced = 0
    for samples in path:
        cost = growing.render(scene, asked(samples=samples, tiling=tiling, antialiasing=antialiasing)).cost
        assert cost.samples_per_cell == samples
        traced += cost.samples_traced
        assert cost.mean_samples * cost.cells == traced == max(path[: path.index(samples) + 1]) * cost.cells
        assert cost.guessed_error == (cost.mean_samples == 1)
    grown = growing.render(scene, asked(tiling=tiling, antialiasing=antialiasing))
    same_picture(grown, fresh(scene, asked(tiling=tiling, antialiasing=antialiasing)))
    assert traced + grown.cost.samples_traced == TARGET * grown.cost.cells
    growing.close()


@settings(max_examples=15)
@given(
    path=st.lists(
        st.tuples(st.floats(-10, 70), st.floats(-10, 45), st.integers(1, TARGET), st.sampled_from(["aligned", "full"])),
        max_size=6,
    )
)
def test_whatever_grew_where_the_end_is_the_frame_of_a_fresh_process(
    scene: PreparedScene, path: list[tuple[float, float, int, str]]
) -> None:
    growing = Renderer(threads=2)
    for x, y, samples, tiling in path:
        growing.render(scene, asked((x, y), samples, tiling))
    same_picture(growing.render(scene, asked()), fresh(scene, asked()))
    growing.close()


def test_a_frame_of_few_samples_shows_those_that_are_there(scene: PreparedScene) -> None:
    """After a move of the gaze: the samples of old cells, one of each new cell; fresh, one of each."""
    growing = Renderer(threads=2)
    full = growing.render(scene, asked())
    again = growing.render(scene, asked(samples=1))
    same_picture(again, full)
    assert again.cost.samples_traced == again.cost.rays.total == 0
    moved = growing.render(scene, asked((56, 30), samples=1))
    cost = moved.cost
    assert 0 < cost.samples_traced == cost.cells_traced == cost.rays.primary < cost.cells
    assert cost.mean_samples * cost.cells == pytest.approx(TARGET * cost.cells_reused + cost.cells_traced)
    assert 0 < cost.guessed_error < 1
    growing.close()


@pytest.mark.parametrize("samples", [0, -1, TARGET + 1, 2.0, True])
def test_samples_out_of_range_are_refused(samples: int) -> None:
    with pytest.raises(SettingsError, match=f"samples: expected an integer from 1 to {TARGET}"):
        asked(samples=samples)


class Held:
    """An intersector that waits, from some batch of rays on, until it is let go."""

    def __init__(self, intersector: Intersector, hold_at: int, let_go: threading.Event) -> None:
        self._intersector = intersector
        self._hold_at = hold_at
        self._let_go = let_go
        self.reached = threading.Event()
        self.batches = 0

    def nearest(self, origin: Vectors, direction: Vectors) -> Hits:
        self.batches += 1
        if self.batches >= self._hold_at:
            self.reached.set()
            assert self._let_go.wait(PATIENCE_S)
        return self._intersector.nearest(origin, direction)

    def __getattr__(self, name: str) -> object:
        return getattr(self._intersector, name)


def held(scene: PreparedScene, hold_at: int, let_go: threading.Event) -> tuple[PreparedScene, Held]:
    intersector = Held(scene.intersector, hold_at, let_go)
    return dataclasses.replace(scene, intersector=intersector), intersector  # type: ignore[arg-type]


@pytest.mark.parametrize("tiling", MAPS)
@pytest.mark.parametrize("threads", [1, 3])
def test_an_abandoned_frame_ends_soon_and_loses_and_doubles_nothing(
    scene: PreparedScene, tiling: str, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Given up in the middle of some blocks: those are finished, and no other is begun."""
    monkeypatch.setattr(whitted, "BLOCK_RAYS", 200)
    truth = fresh(scene, asked(tiling=tiling))
    renderer, abandon = Renderer(threads=threads), threading.Event()
    seen, intersector = held(scene, 12, abandon)
    with ThreadPoolExecutor(1) as other:
        frame = other.submit(renderer.render, seen, asked(tiling=tiling), abandon)
        assert intersector.reached.wait(PATIENCE_S)
        abandon.set()
        assert isinstance(frame.exception(PATIENCE_S), Abandoned)
    assert intersector.batches < 12 + 10 * threads
    finished = renderer.render(scene, asked(tiling=tiling))
    same_picture(finished, truth)
    assert truth.cost.samples_traced / 4 < finished.cost.samples_traced < truth.cost.samples_traced
    assert renderer.render(scene, asked(tiling=tiling)).cost.samples_traced == 0
    renderer.close()


def test_who_waits_for_another_render_of_the_view_can_give_up(scene: PreparedScene) -> None:
    renderer, abandon, go_on = Renderer(threads=2), threading.Event(), threading.Event()
    slow, intersector = held(scene, 1, go_on)
    with ThreadPoolExecutor(2) as others:
        first = others.submit(renderer.render, slow, asked())
        assert intersector.reached.wait(PATIENCE_S)
        second = others.submit(renderer.render, scene, asked(), abandon)
        abandon.set()
        assert isinstance(second.exception(PATIENCE_S), Abandoned)
        assert not first.done()
        go_on.set()
        same_picture(first.result(PATIENCE_S), fresh(scene, asked()))
    renderer.close()


def test_a_map_that_is_abandoned_is_built_by_whoever_comes_next(scene: PreparedScene) -> None:
    renderer, abandon = Renderer(threads=2), threading.Event()
    abandon.set()
    with pytest.raises(Abandoned):
        renderer.render(scene, asked(), abandon)
    assert renderer.map_cache.entries == 0
    same_picture(renderer.render(scene, asked(), threading.Event()), fresh(scene, asked()))
    renderer.close()


@given(st.lists(st.integers(1, 50), max_size=60), st.integers(1, 60))
def test_blocks_are_as_large_as_they_may_be(samples: list[int], block: int) -> None:
    first = np.arange(len(samples), dtype=np.int32)
    starts = block_starts(first, first + np.array(samples, np.int32), block)
    assert (starts[0], starts[-1]) == (0, len(samples))
    for start, end in itertools.pairwise(starts):
        size = sum(samples[start:end])
        assert size <= block or end == start + 1
        assert end == len(samples) or size + samples[end] > block


@given(st.lists(st.integers(1, 3000), min_size=1, max_size=60), st.integers(1, 8))
def test_blocks_become_smaller_as_little_is_left(samples: list[int], shares: int) -> None:
    first = np.arange(len(samples), dtype=np.int32)
    starts = block_starts(first, first + np.array(samples, np.int32), 32_768, shares)
    assert (starts[0], starts[-1]) == (0, len(samples))
    for start, end in itertools.pairwise(starts):
        size, most = sum(samples[start:end]), max(SMALLEST_BLOCK, sum(samples[start:]) // shares)
        assert size <= most or end == start + 1
        assert end == len(samples) or size + samples[end] > most
