"""What accuracy costs on this machine: a small table for each scene that is asked for, measured in idle time.

Tables are kept in memory, until the scene changes or the service ends.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

from renderer.accuracy.grid import Setting, most_samples
from renderer.accuracy.machine import this_machine
from renderer.accuracy.measurement import Measured, measure, setting_result
from renderer.accuracy.record import DEFAULT, AccuracyReport, Reference
from renderer.accuracy.reference import render_reference, rounds
from renderer.accuracy.timing import timed_frame, turn
from renderer.acuity import MODELS, Acuity
from renderer.acuity_comparison import ModelCost, model_cost
from renderer.display import Display
from renderer.frame import Abandoned, Frame, FrameRequest, StageTimes
from renderer.gaze import Gaze
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.workers import WorkerPool
from service.idle import Closed
from service.jobs import Stopping
from service.openapi import package_version
from service.rendering import Studio

STORE_BYTES = 256 << 20
"""Room for the samples of the reference."""

log = logging.getLogger(__name__)


DISPLAY = Display(1280, 720, 33.3, None, 60.0)
"""Smaller than usual screens, so that a frame takes little time, but as fine."""

WIDTHS = ((1.0, (1, 2, 4, 8)), (2.0**0.5, (1, 4)), (2.0, (1, 4)), (4.0, (1, 4)))
"""Factors on the cells' width, and the camera rays a cell with each."""

FULL_SAMPLES = (1, 4)
"""Camera rays a pixel, with a cell for each."""


def _aligned(scale: float, samples: int) -> Setting:
    quality = Quality(samples_per_cell=samples, acuity=Acuity(scale=scale))
    marks = (DEFAULT,) if quality == Quality() else ()
    name = f"{samples} a cell, cells {scale:.2g} times as wide" if scale != 1.0 else f"{samples} a cell"
    group = "samples" if scale == 1.0 else "acuity_scale"
    return Setting(f"aligned-{samples}-{100 * scale:.0f}", name, group, quality, marks)


def _full(samples: int) -> Setting:
    return Setting(f"full-{samples}", f"{samples} a pixel", "map", Quality(map="full", samples_per_cell=samples))


SETTINGS = (
    *(_aligned(scale, samples) for scale, counts in WIDTHS for samples in counts),
    *(_full(samples) for samples in FULL_SAMPLES),
)
"""What a frame can be asked for where only time and error matter."""


@dataclass(frozen=True, slots=True)
class Survey:
    """What is measured of every scene: its own view, the gaze in the middle of the screen.

    Attributes:
        display: the screen.
        settings: the grid.
        reference_samples: camera rays a pixel of the reference, 2 or more.
        repeats: how often each setting is timed.
    """

    display: Display = DISPLAY
    settings: tuple[Setting, ...] = SETTINGS
    reference_samples: int = 32
    repeats: int = 3

    @property
    def steps(self) -> int:
        """Steps of a measurement."""
        reference = rounds(self.reference_samples, most_samples(self.settings))
        return len(reference) + len(self.settings) * (1 + self.repeats) + len(MODELS)


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a measurement has come: `done` steps `of` so many."""

    scene: str
    done: int
    of: int


class Surveyor:
    """Measures scenes one after the other on a thread of its own, in idle time only. Any thread may ask.

    Args:
        studio: whose scenes and limits count, and whose frames come first.
        survey: what is measured.
        threads: to render on.
    """

    def __init__(self, studio: Studio, survey: Survey, threads: int) -> None:
        self._studio = studio
        self._survey = survey
        self._threads = threads
        self._changed = threading.Condition()
        self._wanted: dict[str, int] = {}
        self._tables: dict[str, tuple[str, AccuracyReport]] = {}
        self._failed: dict[str, Exception] = {}
        self._closed = False
        self._thread: threading.Thread | None = None

    def table(self, scene_id: str) -> AccuracyReport | Progress:
        """The table of a scene as it is now, or how far it is; to ask is to want it measured.

        Raises:
            UnknownScene, SceneError: for a scene that is not there or cannot be loaded.
            OverLimit: where this service grants no frame of the kind that is measured.
        """
        library, survey = self._studio.library, self._survey
        full = Quality(map="full", samples_per_cell=survey.reference_samples + most_samples(survey.settings))
        self._studio.check(survey.display, full)
        version = library.version(scene_id)
        library.load(scene_id)
        with self._changed:
            if scene_id in self._failed:
                raise self._failed.pop(scene_id)
            if scene_id in self._tables and self._tables[scene_id][0] == version:
                return self._tables[scene_id][1]
            done = self._wanted.setdefault(scene_id, 0)
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._work, name="gazetrace-survey", daemon=True)
                self._thread.start()
            self._changed.notify_all()
        return Progress(scene_id, done, survey.steps)

    def close(self) -> None:
        """Give up what is being measured, and wait for that."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._studio.idle.close()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        while (scene_id := self._next()) is not None:
            try:
                version = self._studio.library.version(scene_id)
                table = self._measured(scene_id, self._studio.library.load(scene_id))
            except (Closed, Stopping):
                return
            except Exception as error:
                log.exception("what accuracy costs could not be measured for %s", scene_id)
                with self._changed:
                    self._failed[scene_id] = error
                    del self._wanted[scene_id]
                continue
            with self._changed:
                self._tables[scene_id] = (version, table)
                del self._wanted[scene_id]

    def _next(self) -> str | None:
        """The scene that was asked for first; None when the service stops."""
        with self._changed:
            while not self._wanted and not self._closed:
                self._changed.wait()
            return None if self._closed else next(iter(self._wanted))

    def _tick(self, scene_id: str) -> None:
        with self._changed:
            self._wanted[scene_id] += 1

    def _measured(self, scene_id: str, prepared: PreparedScene) -> AccuracyReport:
        """Everything of a scene, from the start: what a scene was that has changed since is of no use."""
        survey = self._survey
        display = survey.display
        view = FrameRequest(Gaze(display.width_px / 2, display.height_px / 2), display, None, Quality())

        def tick() -> None:
            self._tick(scene_id)

        with self._changed:
            self._wanted[scene_id] = 0
        keeping, fresh = Renderer(self._threads, 0, STORE_BYTES), Renderer(self._threads, 0, 0)
        try:
            patient = _Patient(keeping, self._studio, scene_id)
            samples, spared = survey.reference_samples, most_samples(survey.settings)
            reference = render_reference(patient, prepared, view, samples, spared, tick)
            keeping.forget_samples()
            patient = _Patient(fresh, self._studio, scene_id)
            measured: dict[str, Measured] = {}
            for setting in survey.settings:
                measured[setting.id] = measure(patient, prepared, view, setting, reference.radiance)[0]
                tick()
            times = self._times(patient, prepared, view, tick)
            models = self._models(view, tick)
        finally:
            keeping.close(abandon=True)
            fresh.close(abandon=True)
        results = (setting_result(each, measured[each.id], times[each.id], "", "") for each in survey.settings)
        scene = prepared.scene
        return AccuracyReport(
            version=package_version(),
            command="gazetrace serve",
            made=datetime.now(UTC).isoformat(timespec="seconds"),
            machine=this_machine(self._threads),
            scene=scene_id,
            triangles=scene.triangles,
            spheres=len(scene.spheres),
            effects=prepared.plan.names,
            display=display,
            gaze=view.gaze,
            camera=scene.camera,
            reference=Reference(samples, reference.standard_error, round(reference.seconds, 3), ""),
            settings=tuple(sorted(results, key=lambda result: DEFAULT not in result.marks)),
            acuity_models=models,
        )

    def _models(self, view: FrameRequest, tick: Callable[[], None]) -> tuple[ModelCost, ...]:
        """What each acuity model costs; each begins in idle time and takes as long as a cell map."""
        pool = WorkerPool(self._threads)
        costs = []
        try:
            for name in MODELS:
                self._studio.idle.wait()
                costs.append(model_cost(name, view.display, view.gaze, view.quality, pool))
                tick()
        finally:
            pool.close()
        return tuple(costs)

    def _times(
        self, patient: _Patient, prepared: PreparedScene, view: FrameRequest, tick: Callable[[], None]
    ) -> dict[str, list[StageTimes]]:
        times: dict[str, list[StageTimes]] = {setting.id: [] for setting in self._survey.settings}
        for repeat in range(self._survey.repeats):
            for setting in turn(self._survey.settings, repeat):
                times[setting.id].append(timed_frame(patient, prepared, view, setting))
                tick()
        return times


class _Patient:
    """Renders in idle time: a frame that somebody else's interrupts is begun again when there is time."""

    def __init__(self, renderer: Renderer, studio: Studio, scene_id: str) -> None:
        self._renderer = renderer
        self._studio = studio
        self._scene_id = scene_id

    def render(self, prepared: PreparedScene, request: FrameRequest) -> Frame:
        """Render one frame.

        Raises:
            Closed, Stopping: if there will be no more time.
        """
        while True:
            interrupt = self._studio.idle.wait()
            try:
                with self._studio.watch.tracing(self._scene_id, interrupt):
                    return self._renderer.render(prepared, request, interrupt)
            except Abandoned:
                continue
