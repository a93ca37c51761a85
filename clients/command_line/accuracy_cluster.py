"""Steps of `gazetrace accuracy` as tasks of a cluster's workers: the same pictures and errors, and their own times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from clients.command_line.accuracy_steps import Metric, compared, metrics_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from clients.command_line.accuracy_folder import AccuracyFolder
    from renderer.accuracy.grid import Setting
    from renderer.accuracy.record import Machine
    from renderer.frame import FrameRequest, StageTimes
    from renderer.pipeline import Renderer
    from renderer.prepared import PreparedScene
    from service.cluster.cluster import Cluster


@dataclass(frozen=True, eq=False)
class Truth:
    """What a worker holds settings against.

    Attributes:
        view: the frame.
        radiance: (h, w, 3) float32, the reference.
        exposure: of the scene.
        packages: that judge pictures, and that the other workers use too.
    """

    view: FrameRequest
    radiance: NDArray[np.float32]
    exposure: float
    packages: tuple[str, ...]

    @cached_property
    def metrics(self) -> list[Metric]:
        """Made where they are used, once."""
        return metrics_of(self.view, self.radiance, self.exposure, self.packages)


def machine_of(cluster: Cluster, prepared: PreparedScene) -> Machine:
    """What one of the workers runs on."""
    ((_, machine),) = cluster.run(prepared, [_machine])
    found: Machine = machine
    return found


def compare_on(
    cluster: Cluster,
    prepared: PreparedScene,
    settings: Sequence[Setting],
    truth: Truth,
    kept: AccuracyFolder,
    tick: Callable[[], None],
) -> None:
    """Hold settings against the reference, each on any worker."""
    tasks = [partial(_compared, setting) for setting in settings]
    for number, found in cluster.run(prepared, tasks, truth) if tasks else ():
        kept.keep_measured(settings[number].id, *found)
        tick()


def time_on(
    cluster: Cluster,
    prepared: PreparedScene,
    view: FrameRequest,
    untimed: Sequence[tuple[int, Setting]],
    kept: AccuracyFolder,
    tick: Callable[[], None],
) -> None:
    """Time frames, each worker one after another and a row of them in turn."""
    tasks = [partial(_timed, view, setting) for _, setting in untimed]
    for number, times in cluster.run(prepared, tasks, set()) if tasks else ():
        repeat, setting = untimed[number]
        kept.keep_time(setting.id, repeat, times)
        tick()


def _machine(renderer: Renderer, _: PreparedScene, __: object) -> Machine:
    from renderer.accuracy.machine import this_machine

    return this_machine(renderer.threads)


def _compared(setting: Setting, renderer: Renderer, prepared: PreparedScene, truth: Truth) -> Any:
    from renderer.pipeline import Renderer

    alone = Renderer(renderer.threads, map_cache_bytes=0, store_bytes=0)
    try:
        return compared(alone, prepared, truth.view, setting, truth.radiance, truth.metrics)
    finally:
        alone.close()


def _timed(
    view: FrameRequest, setting: Setting, renderer: Renderer, prepared: PreparedScene, begun: set[bool]
) -> StageTimes:
    from renderer.accuracy.timing import timed_frame
    from renderer.pipeline import Renderer

    alone = Renderer(renderer.threads, map_cache_bytes=0, store_bytes=0)
    try:
        if not begun:
            timed_frame(alone, prepared, view, setting)  # a first frame of a scene is slow
            begun.add(True)
        return timed_frame(alone, prepared, view, setting)
    finally:
        alone.close()
