"""Pieces: what is sent and comes back leaves the same bits in the store as tracing here does."""

from __future__ import annotations

import dataclasses
import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.acuity import Acuity
from renderer.display import Display
from renderer.forced import with_effects
from renderer.frame import FrameRequest, RayCounts
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene, prepare
from renderer.quality import ANTIALIASING, MAPS, Quality
from renderer.store import SampleStore
from renderer.tracing import Lack, Traced, total_rays
from renderer.workers import Workers
from service.cluster.piece import cheaper_as_sums, pack_cells, piece_of, take_in, trace_piece, unpack_cells
from service.cluster.worker import pack_scene
from tests.renderer.drawing import glass_and_mirror

SCREEN = Display(64, 36, width_cm=6.0)
PART = 97


class ByPieces:
    """Traces pieces here, each packed and unpacked as on its way to a worker, the last first."""

    def __init__(self, sums: bool | None = None) -> None:
        self._sums = sums
        self.sent: list[tuple[int, int, int]] = []

    def trace(self, lack: Lack, store: SampleStore, pool: Workers) -> Traced:
        scene, _ = pickle.loads(pack_scene(lack.prepared))
        there = with_effects(prepare(scene), lack.quality.effects)
        sums = cheaper_as_sums(lack, store) if self._sums is None else self._sums
        counts, rejected = [RayCounts()], np.zeros(3, dtype=np.int64)
        for start in reversed(range(0, len(lack.chosen), PART)):
            part = slice(start, start + PART)
            packed = pickle.dumps(piece_of(lack, store, part, sums=sums))
            colours = trace_piece(there, pickle.loads(packed), pool)
            self.sent.append((len(lack.chosen[part]), len(packed), len(colours.numbers)))
            found = take_in(lack, store, part, sums, colours)
            counts.append(found.rays)
            rejected += found.rejected
        return Traced(total_rays(counts), rejected)


@pytest.fixture(scope="module")
def scene() -> PreparedScene:
    return prepare(glass_and_mirror())


def asked(quality: Quality, gaze: tuple[float, float] = (30, 20), samples: int | None = None) -> FrameRequest:
    return FrameRequest(Gaze(*gaze), SCREEN, None, quality, linear=True, samples=samples)


@pytest.mark.parametrize("sums", [True, False, None], ids=["sums", "samples", "cheaper"])
@pytest.mark.parametrize("tiling", MAPS)
@pytest.mark.parametrize("antialiasing", ANTIALIASING)
def test_frames_by_pieces_are_the_frames_of_threads(
    scene: PreparedScene, renderer: Renderer, tiling: str, antialiasing: str, sums: bool | None
) -> None:
    """Fresh, grown sample by sample, after a move of the gaze, and without an effect."""
    quality = Quality(map=tiling, samples_per_cell=7, antialiasing=antialiasing, acuity=Acuity(scale=8.0), max_depth=3)
    plain = Quality(map=tiling, samples_per_cell=3, effects=(("-reflection"),))
    apart = Renderer(2, tracing=ByPieces(sums))
    here = Renderer(2)
    for request in (
        asked(quality, samples=1), asked(quality, samples=2), asked(quality), asked(quality, (50, 30)), asked(plain),
    ):  # fmt: skip
        one, other = apart.render(scene, request), here.render(scene, request)
        np.testing.assert_array_equal(one.pixels, other.pixels)
        for name in ("rays", "cells_traced", "samples_traced", "rms_error", "foveal_rms_error", "rejected_samples"):
            assert getattr(one.cost, name) == getattr(other.cost, name), name
        coded = dataclasses.replace(request, linear=False)
        np.testing.assert_array_equal(apart.render(scene, coded).pixels, here.render(scene, coded).pixels)
    apart.close()
    here.close()


def test_what_is_sent_is_less_than_what_is_shown(scene: PreparedScene) -> None:
    """One byte or two a cell out, beside some for the camera; 12 back for one sample, 20 for many."""
    for samples, back in ((1, 12), (16, 20)):
        apart = ByPieces()
        renderer = Renderer(1, tracing=apart)
        renderer.render(scene, asked(Quality(samples_per_cell=samples, max_depth=0)))
        renderer.close()
        cells = sum(cells for cells, _, _ in apart.sent)
        assert sum(numbers for _, _, numbers in apart.sent) == back * cells
        alone = len(pickle.dumps(apart.sent))
        assert sum(packed for _, packed, _ in apart.sent) < 2 * cells + len(apart.sent) * 2048 + alone


numbers = st.integers(0, 65_535)


@given(st.lists(st.tuples(numbers, numbers, st.integers(1, 64), numbers, numbers, st.integers(1, 5)), min_size=1))
def test_cells_are_unpacked_as_they_were(rows: list[tuple[int, int, int, int, int, int]]) -> None:
    """Rows of squares, anywhere and of any side."""
    cells = [
        (x + side * index, y, side, first, until)
        for x, y, side, first, until, count in rows
        for index in range(count)
        if x + side * index < 65_536
    ]
    columns = [np.array(column, dtype=np.int32) for column in zip(*cells, strict=True)]
    for stated, found in itertools.zip_longest(columns, unpack_cells(pack_cells(*columns))):
        np.testing.assert_array_equal(stated, found)
        assert found.dtype == np.int32
