"""The whole way: gaze to cells, cells to samples, samples to a frame."""

from __future__ import annotations

import threading
import time

from renderer.acuity import Acuity
from renderer.allocator import keep_freed_memory, keep_spare_pages
from renderer.cellmap import CellMap
from renderer.deadline import NS_PER_MS, affordable_samples, fitted, seen
from renderer.display import Display
from renderer.eccentricity import eccentricity_deg
from renderer.forced import with_effects
from renderer.frame import Frame, FrameCost, FrameRequest, StageTimes
from renderer.gaze import Gaze
from renderer.growth import Growth, grow
from renderer.memory import Memory
from renderer.pace import Pace
from renderer.prepared import PreparedScene, prepare
from renderer.quality import MAPS, RECONSTRUCTIONS, Quality
from renderer.reconstruction import reconstruct
from renderer.refinement import refine
from renderer.smooth import reconstruct_smooth
from renderer.standard_error import StatedError, stated_error
from renderer.tracing import ThreadTracing, Tracing
from renderer.warmup import every_effect, nothing_behind
from renderer.whitted import view_of
from renderer.workers import WorkerPool

DEFAULT_MAP_CACHE_BYTES = 256 << 20
DEFAULT_STORE_BYTES = 512 << 20

CACHES_TO_SPARE = 6
"""What the caches may hold over the pages that wait for what comes into them: by default room for a store of 1080p."""


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
        tracing: Tracing | None = None,
        abandon: threading.Event | None = None,
    ) -> None:
        """Start the threads.

        Args:
            threads: how many; None for all cores.
            map_cache_bytes, store_bytes: room for cell maps and for samples.
            tracing: what traces samples; None for the threads.
            abandon: set it to give up every frame that has no event of its own, this one and all after it.
        """
        keep_freed_memory()
        keep_spare_pages((map_cache_bytes + store_bytes) // CACHES_TO_SPARE)
        self._memory = Memory(map_cache_bytes, store_bytes)
        self.map_cache = self._memory.maps
        self.store_cache = self._memory.stores
        self._pool = WorkerPool(threads)
        self._tracing = tracing or ThreadTracing()
        self._abandon = abandon
        self._pace = Pace(self._pool.threads)

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
        numbered, cached = self._memory.map(display, quality, gaze, self._pool)
        return numbered.cells, cached

    def render(self, prepared: PreparedScene, request: FrameRequest, abandon: threading.Event | None = None) -> Frame:
        """Render one frame.

        The same request gives the same bytes, on any number of threads and whatever was rendered before; but
        one with a deadline or a limited number of `samples` shows what further samples earlier frames have left.
        One with a `max_error` and neither of these is traced anew: what others have left would change its error.

        Args:
            prepared: the scene.
            request: the frame.
            abandon: set it, from another thread, to give up the frame; None for the renderer's own.

        Raises:
            Abandoned: within about a block of rays after `abandon` is set. What was traced by then is kept.
        """
        return self._render(prepared, request, abandon or self._abandon, self._tracing)

    def _render(
        self, prepared: PreparedScene, request: FrameRequest, abandon: threading.Event | None, tracing: Tracing
    ) -> Frame:
        began = time.perf_counter_ns()
        prepared = with_effects(prepared, request.quality.effects)
        pool = self._pool.until(abandon)
        rates = self._pace.rates(prepared, request)
        most = request.quality.samples_per_cell if request.samples is None else request.samples
        request, promised = fitted(request, self._memory.works(prepared, request, most), rates)
        planned = time.perf_counter_ns()
        quality = request.quality
        numbered, cached = self._memory.map(request.display, quality, request.gaze, pool)
        cells, slots = numbered.cells, numbered.slots
        mapped = time.perf_counter_ns()
        view = view_of(prepared, request.camera or prepared.scene.camera, request.display)
        store = self._memory.store(prepared, request, numbered)
        with store.held(abandon) as samples:
            entered = time.perf_counter_ns()

            def grow_to(samples_each: int) -> Growth:
                return grow(prepared, view, cells, slots, store, quality, samples_each, pool, tracing)

            def judge() -> StatedError:
                return stated_error(request.display, request.gaze, cells, slots, samples, prepared.scene.exposure, pool)

            def affordable(growth: Growth) -> int:
                gone_ns = time.perf_counter_ns() - began
                return affordable_samples(request, slots, store, most, seen(rates, growth), gone_ns)

            growth, error, wanted = refine(
                grow_to, judge, affordable, most, quality.max_error, hurried=quality.deadline_ms is not None
            )
            done = time.perf_counter_ns()
            rebuild = reconstruct_smooth if quality.reconstruction == "smooth" else reconstruct
            pixels = rebuild(cells, slots, samples, prepared.scene.exposure, request.linear, pool)
        finished = time.perf_counter_ns()
        frame_ns = planned - began + finished - entered - growth.trace_ns
        map_ns = None if cached else mapped - planned
        self._pace.learn(prepared, request, map_ns, frame_ns, growth.trace_ns, growth.asked)
        cost = FrameCost(
            map=quality.map,
            cells=cells.cells,
            bucket_px=quality.gaze_bucket_px,
            map_cached=cached,
            samples_per_cell=wanted,
            samples_traced=growth.samples,
            mean_samples=growth.held / cells.cells,
            acuity_scale=quality.acuity.scale,
            deadline_ms=quality.deadline_ms,
            deadline_promised=promised,
            deadline_met=None if quality.deadline_ms is None else finished - began <= NS_PER_MS * quality.deadline_ms,
            max_error=quality.max_error,
            error_met=None if quality.max_error is None else error.within(quality.max_error),
            cells_traced=growth.cells,
            cells_reused=cells.cells - growth.cells,
            rays=growth.rays,
            effects=prepared.plan.names,
            effect_reasons=tuple(effect.reason for effect in prepared.plan.effects),
            rms_error=error.rms,
            foveal_rms_error=error.foveal_rms,
            guessed_error=error.guessed,
            rejected_samples=growth.rejected,
            time_ms=StageTimes(*(ns / NS_PER_MS for ns in (mapped - began, done - mapped, finished - done))),
        )
        return Frame(pixels, cost)

    def warm_up(self) -> None:
        """Compile every kernel, or load it from disk, by rendering tiny frames that call for all of them here.

        Takes tens of seconds the first time on a machine, a second or two afterwards.
        """
        display, here = Display(48, 32), ThreadTracing()
        scene = prepare(every_effect())
        for kind in MAPS:
            for linear in (False, True):
                for reconstruction in RECONSTRUCTIONS:
                    quality = Quality(map=kind, samples_per_cell=2, reconstruction=reconstruction)
                    self._render(scene, FrameRequest(Gaze(1e4, 16.0), display, None, quality, linear), None, here)
        tabulated = Acuity(model="watson")
        for quality in (
            Quality(deadline_ms=1.0),
            Quality(max_error=1.0),
            Quality(deadline_ms=1.0, acuity=tabulated),
            Quality(map="scanline", acuity=tabulated),
            Quality(antialiasing="adaptive", samples_per_cell=8),
        ):
            self._render(scene, FrameRequest(Gaze(0.0, 0.0), display, None, quality), None, here)
        self._render(prepare(nothing_behind()), FrameRequest(Gaze(0.0, 0.0), display, None, Quality()), None, here)
        eccentricity_deg(display, Gaze(0.0, 0.0))
        self._pace = Pace(self.threads)
