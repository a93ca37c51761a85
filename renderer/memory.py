"""What is kept between frames: cell maps, and the samples of views."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from renderer.cache import ByteCache
from renderer.cellmap import CellMap, build_cell_map
from renderer.deadline import Work, ladder
from renderer.display import Display
from renderer.forecast import forecast_held
from renderer.frame import FrameRequest
from renderer.gaze import Gaze, GazeBucket, bucket_of
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.slots import pixel_slots, slots_needed, slots_of
from renderer.store import SampleStore, held_by_number
from renderer.workers import Workers

ENTRY_BYTES = 2 << 10
"""Objects about the arrays of a map, or of samples, and its key: 1.3 KB each were measured for screens of one pixel."""


@dataclass(frozen=True, eq=False, slots=True)
class NumberedMap:
    """A cell map and the store slot of each of its cells.

    Attributes:
        cells: the map.
        slots: (n,) int32.
        identity: stands for the map in other caches, so that they do not keep it in memory.
    """

    cells: CellMap
    slots: NDArray[np.int32]
    identity: object = field(default_factory=object)

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return self.cells.nbytes + self.slots.nbytes


class Memory:
    """Cell maps by screen, eye and bucket of gazes; samples by view and sampling. Safe for any number of threads.

    Attributes:
        maps, stores: the caches, each bounded in bytes.
    """

    def __init__(self, map_bytes: int, store_bytes: int) -> None:
        self.maps: ByteCache[Hashable, NumberedMap] = ByteCache(map_bytes, _size)
        self.stores: ByteCache[Hashable, SampleStore] = ByteCache(store_bytes, _size)

    def map(self, display: Display, quality: Quality, gaze: Gaze, pool: Workers) -> tuple[NumberedMap, bool]:
        """The map for a gaze, built on `pool` if it is not there, and whether it was there."""

        def build() -> NumberedMap:
            cells = build_cell_map(quality.map, display, quality.acuity, _bucket(quality, gaze), pool)
            return NumberedMap(cells, slots_of(cells, pool))

        return self.maps.get(_map_key(display, quality, gaze), build)

    def store(self, prepared: PreparedScene, request: FrameRequest, numbered: NumberedMap) -> SampleStore:
        """The samples of a view: shared by all its aligned and full maps, but a scanline map has its own.

        A frame that is to have no more samples than its error calls for starts without any.
        """
        quality = request.quality

        def make() -> SampleStore:
            white = 1.0 / prepared.scene.exposure
            cells = numbered.cells
            return SampleStore(slots_needed(cells), quality.antialiasing == "adaptive", white, cells.cells)

        if quality.max_error is not None and quality.deadline_ms is None and request.samples is None:
            return make()
        return self.stores.get(_store_key(prepared, request, numbered), make)[0]

    def works(self, prepared: PreparedScene, request: FrameRequest, wanted: int) -> Iterator[Work]:
        """What the frame takes with each acuity, finest first: maps that are there are counted, others forecast.

        Args:
            prepared, request: the frame.
            wanted: samples that each cell is to have at most.
        """
        display = request.display
        for acuity in ladder(request.quality):
            quality = replace(request.quality, acuity=acuity)
            numbered = self.maps.peek(_map_key(display, quality, request.gaze))
            store = self.stores.peek(_store_key(prepared, request, numbered))
            if store is None:
                store = SampleStore(0)
            number, settled = store.samples.number, store.spread.settled
            if numbered is None and quality.map == "full":
                slots = pixel_slots(display.width_px, display.height_px)
                yield Work(acuity, True, held_by_number(number, settled, slots, wanted))
            elif numbered is None:
                bucket = _bucket(quality, request.gaze)
                yield Work(acuity, True, forecast_held(display, acuity, bucket, number, settled, wanted))
            else:
                yield Work(acuity, False, held_by_number(number, settled, numbered.slots, wanted))


def _size(kept: NumberedMap | SampleStore) -> int:
    return kept.nbytes + ENTRY_BYTES


def _bucket(quality: Quality, gaze: Gaze) -> GazeBucket:
    return GazeBucket(0.0, 0.0, 0) if quality.map == "full" else bucket_of(gaze, quality.gaze_bucket_px)


def _map_key(display: Display, quality: Quality, gaze: Gaze) -> Hashable:
    """What decides a map."""
    return quality.map, display, None if quality.map == "full" else quality.acuity, _bucket(quality, gaze)


def _store_key(prepared: PreparedScene, request: FrameRequest, numbered: NumberedMap | None) -> Hashable:
    """What decides samples; no store has the key of a scanline map that is not there."""
    quality = request.quality
    return (
        prepared.identity,
        request.camera or prepared.scene.camera,
        request.display,
        quality.samples_per_cell,
        quality.antialiasing,
        quality.shadow_samples,
        quality.max_depth,
        quality.effects,
        None if quality.map != "scanline" else "none" if numbered is None else numbered.identity,
    )
