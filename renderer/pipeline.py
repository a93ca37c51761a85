"""The whole way: gaze to cells, cells to samples, samples to a frame."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.cache import ByteCache
from renderer.cellmap import CellMap, build_cell_map
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.frame import Frame, FrameCost, FrameRequest, RayCounts, StageTimes
from renderer.gaze import Gaze, GazeBucket, bucket_of
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, RECONSTRUCTIONS, Quality
from renderer.reconstruction import reconstruct
from renderer.smooth import reconstruct_smooth
from renderer.standard_error import standard_errors
from renderer.store import SampleStore, add_samples, missing_cells, slots_needed, slots_of
from renderer.warmup import every_effect
from renderer.whitted import Cells, block_rays, trace_cells, view_of
from renderer.workers import WorkerPool

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
        numbered, cached = self._map(display, quality, gaze)
        return numbered.cells, cached

    def render(self, prepared: PreparedScene, request: FrameRequest) -> Frame:
        """Render one frame.

        The same request gives the same bytes, on any number of threads and whatever was rendered before.
        """
        began = time.perf_counter()
        numbered, cached = self._map(request.display, request.quality, request.gaze)
        mapped = time.perf_counter()
        store = self._store(prepared, request, numbered)
        with store.lock:
            traced, rays, rejected = self._trace_missing(prepared, request, numbered, store)
            done = time.perf_counter()
            rebuild = reconstruct_smooth if request.quality.reconstruction == "smooth" else reconstruct
            pixels = rebuild(
                numbered.cells, numbered.slots, store.samples, prepared.scene.exposure, request.linear, self._pool
            )
            errors = standard_errors(
                request.display, request.gaze, numbered.cells, numbered.slots, store.samples, self._pool
            )
        finished = time.perf_counter()
        cost = FrameCost(
            map=request.quality.map,
            cells=numbered.cells.cells,
            bucket_px=request.quality.gaze_bucket_px,
            map_cached=cached,
            samples_per_cell=request.quality.samples_per_cell,
            cells_traced=traced,
            cells_reused=numbered.cells.cells - traced,
            rays=rays,
            effects=prepared.plan.names,
            rms_error=errors[0],
            foveal_rms_error=errors[1],
            rejected_samples=rejected,
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

    def _map(self, display: Display, quality: Quality, gaze: Gaze) -> tuple[NumberedMap, bool]:
        bucket = GazeBucket(0.0, 0.0, 0) if quality.map == "full" else bucket_of(gaze, quality.gaze_bucket_px)
        acuity = None if quality.map == "full" else quality.acuity

        def build() -> NumberedMap:
            cells = build_cell_map(quality.map, display, quality.acuity, bucket, self._pool)
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
            quality.max_depth,
            numbered.identity if quality.map == "scanline" else None,
        )
        return self.store_cache.get(key, lambda: SampleStore(slots_needed(numbered.cells)))[0]

    def _trace_missing(
        self, prepared: PreparedScene, request: FrameRequest, numbered: NumberedMap, store: SampleStore
    ) -> tuple[int, RayCounts, int]:
        """Trace the cells the store lacks: their number, the rays and the rejected samples."""
        quality = request.quality
        samples = quality.samples_per_cell
        cells = numbered.cells
        found = np.zeros(cells.cells, dtype=np.int32)
        missing = found[: missing_cells(store.samples, numbered.slots, samples, found)]
        view = view_of(prepared, request.camera or prepared.scene.camera, request.display)
        each = max(1, block_rays(prepared) // samples)
        blocks = -(-len(missing) // each)
        counts: list[RayCounts] = [RayCounts()] * blocks
        rejected = [0] * blocks

        def trace(block: int) -> None:
            chosen = missing[block * each : (block + 1) * each]
            radiance, counts[block] = trace_cells(
                prepared, view, Cells(cells.x, cells.y, cells.side, chosen), quality, 0, samples
            )
            rejected[block] = add_samples(store.samples, numbered.slots, chosen, radiance, samples)

        self._pool.run(trace, blocks)
        return len(missing), _total(counts), sum(rejected)


def _total(counts: list[RayCounts]) -> RayCounts:
    return RayCounts(
        primary=sum(count.primary for count in counts),
        shadow=sum(count.shadow for count in counts),
        reflection=sum(count.reflection for count in counts),
        refraction=sum(count.refraction for count in counts),
    )
