"""The whole way: gaze to cells, cells to samples, samples to a frame."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.cache import ByteCache
from renderer.cellmap import CellMap, build_cell_map
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.frame import Frame, FrameCost, FrameRequest, StageTimes
from renderer.gaze import Gaze, GazeBucket, bucket_of
from renderer.growth import grow
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, RECONSTRUCTIONS, Quality
from renderer.reconstruction import reconstruct
from renderer.smooth import reconstruct_smooth
from renderer.standard_error import standard_errors
from renderer.store import SampleStore, slots_needed, slots_of
from renderer.warmup import every_effect
from renderer.whitted import view_of
from renderer.workers import WorkerPool, Workers

DEFAULT_MAP_CACHE_BYTES = 256 << 20
DEFAULT_STORE_BYTES = 512 << 20


@dataclass(frozen=True, eq=False, slots=True)
class NumberedMap:
    """A cell map and the store slot of each of its cells.

    Attributes:
        cells: the map.
        slots: (n,) int64.
        identity: stands for the map in other caches, so that they do not keep it in memory.
    """

    cells: CellMap
    slots: NDArray[np.int64]
    identity: object = field(default_factory=object)

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return self.cells.nbytes + self.slots.nbytes


class Renderer:
    """Renders frames on shared threads, keeping cell maps and samples between them.

    Any number of threads may render at once; the cores are shared fairly. Two renders of the same view
    and sampling wait for each other, since the second finds its cells traced.
    """

    def __init__(
        self,
        threads: int | None = None,
        map_cache_bytes: int = DEFAULT_MAP_CACHE_BYTES,
        store_bytes: int = DEFAULT_STORE_BYTES,
    ) -> None:
        self.map_cache: ByteCache[object, NumberedMap] = ByteCache(map_cache_bytes, lambda value: value.nbytes)
        self.store_cache: ByteCache[object, SampleStore] = ByteCache(store_bytes, lambda value: value.nbytes)
        self._pool = WorkerPool(threads)

    @property
    def threads(self) -> int:
        """Number of rendering threads."""
        return self._pool.threads

    def close(self, *, abandon: bool = False) -> None:
        """End the threads, once the frames that were begun are finished.

        Args:
            abandon: True to give up those frames; whoever waits for them gets a RuntimeError.
        """
        self._pool.close(abandon=abandon)

    def forget_samples(self) -> None:
        """Drop everything traced so far; the next frame is traced anew."""
        self.store_cache.clear()

    def cell_map(self, display: Display, quality: Quality, gaze: Gaze) -> tuple[CellMap, bool]:
        """The cell map for a gaze, and whether it came from the cache."""
        numbered, cached = self._map(display, quality, gaze, self._pool)
        return numbered.cells, cached

    def render(self, prepared: PreparedScene, request: FrameRequest, abandon: threading.Event | None = None) -> Frame:
        """Render one frame.

        The same request gives the same bytes, on any number of threads and whatever was rendered before; but
        one of a limited number of `samples` shows what further samples earlier frames have left.

        Args:
            prepared: the scene.
            request: the frame.
            abandon: set it, from another thread, to give up the frame.

        Raises:
            Abandoned: within about a block of rays after `abandon` is set. What was traced by then is kept.
        """
        began = time.perf_counter()
        quality = request.quality
        wanted = quality.samples_per_cell if request.samples is None else request.samples
        pool = self._pool.until(abandon)
        numbered, cached = self._map(request.display, quality, request.gaze, pool)
        cells, slots = numbered.cells, numbered.slots
        mapped = time.perf_counter()
        view = view_of(prepared, request.camera or prepared.scene.camera, request.display)
        with self._store(prepared, request, numbered).held(abandon) as samples:
            growth = grow(prepared, view, cells, slots, samples, quality, wanted, pool)
            done = time.perf_counter()
            rebuild = reconstruct_smooth if quality.reconstruction == "smooth" else reconstruct
            pixels = rebuild(cells, slots, samples, prepared.scene.exposure, request.linear, pool)
            rms, foveal_rms = (
                standard_errors(request.display, request.gaze, cells, slots, samples, pool)
                if growth.fewest >= 2
                else (None, None)
            )
        finished = time.perf_counter()
        cost = FrameCost(
            map=quality.map,
            cells=cells.cells,
            bucket_px=quality.gaze_bucket_px,
            map_cached=cached,
            samples_per_cell=wanted,
            samples_traced=growth.samples,
            mean_samples=growth.held / cells.cells,
            acuity_scale=quality.acuity.scale,
            deadline_met=None,
            cells_traced=growth.cells,
            cells_reused=cells.cells - growth.cells,
            rays=growth.rays,
            effects=prepared.plan.names,
            rms_error=rms,
            foveal_rms_error=foveal_rms,
            rejected_samples=growth.rejected,
            time_ms=StageTimes(1e3 * (mapped - began), 1e3 * (done - mapped), 1e3 * (finished - done)),
        )
        return Frame(pixels, cost)

    def warm_up(self) -> None:
        """Compile every kernel, or load it from disk, by rendering tiny frames that call for all of them.

        Takes tens of seconds the first time on a machine, a second or two afterwards.
        """
        display = Display(48, 32)
        scene = prepare(every_effect())
        for kind in MAPS:
            for linear in (False, True):
                for reconstruction in RECONSTRUCTIONS:
                    quality = Quality(map=kind, samples_per_cell=2, reconstruction=reconstruction)
                    self.render(scene, FrameRequest(Gaze(1e4, 16.0), display, None, quality, linear))
        eccentricity_deg(display, Gaze(0.0, 0.0))

    def _map(self, display: Display, quality: Quality, gaze: Gaze, pool: Workers) -> tuple[NumberedMap, bool]:
        bucket = GazeBucket(0.0, 0.0, 0) if quality.map == "full" else bucket_of(gaze, quality.gaze_bucket_px)
        acuity = None if quality.map == "full" else quality.acuity

        def build() -> NumberedMap:
            cells = build_cell_map(quality.map, display, quality.acuity, bucket, pool)
            return NumberedMap(cells, slots_of(cells))

        return self.map_cache.get((quality.map, display, acuity, bucket), build)

    def _store(self, prepared: PreparedScene, request: FrameRequest, numbered: NumberedMap) -> SampleStore:
        """The store of this view and sampling: shared by all aligned and full maps, one a scanline map."""
        quality = request.quality
        key = (
            prepared.identity,
            request.camera or prepared.scene.camera,
            request.display,
            quality.samples_per_cell,
            quality.antialiasing,
            quality.shadow_samples,
            quality.max_depth,
            numbered.identity if quality.map == "scanline" else None,
        )
        return self.store_cache.get(key, lambda: SampleStore(slots_needed(numbered.cells)))[0]
