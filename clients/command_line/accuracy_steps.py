"""The steps of a measurement: the reference, each setting held against it, each setting timed in turn."""

from __future__ import annotations

import argparse
import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from clients.command_line.accuracy_folder import REFERENCE_FRAME, AccuracyFolder
from clients.command_line.interrupt import heeding
from clients.command_line.progress import counting
from clients.command_line.render import ready_renderer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from renderer.accuracy.grid import Setting
    from renderer.accuracy.measurement import Measured
    from renderer.accuracy.record import Accuracy
    from renderer.frame import FrameRequest
    from renderer.pipeline import Renderer
    from renderer.prepared import PreparedScene
    from service.cluster.cluster import Cluster

STORE_BYTES: Final = 16 << 30
"""Room for the samples of the reference, of the largest frame even; memory is taken only where it is used."""


def measure_missing(
    arguments: argparse.Namespace,
    prepared: PreparedScene,
    view: FrameRequest,
    settings: Sequence[Setting],
    kept: AccuracyFolder,
    cluster: Cluster | None = None,
) -> None:
    """Render, compare and time what an earlier run has not, here or on the workers of a cluster."""
    todo = _todo(settings, arguments.repeats, kept)
    if todo.compare and not kept.holds_radiance:
        _render_reference(arguments, prepared, view, settings, kept, cluster)
    if not todo.compare and not todo.time:
        return
    if cluster is None:
        _measure_here(arguments, prepared, view, todo, kept)
    else:
        _measure_on(cluster, prepared, view, todo, kept)


@dataclass(frozen=True, slots=True)
class _Todo:
    """What is to be measured, and what an earlier run has not.

    Attributes:
        settings, repeats: all there are; each setting is timed so often.
        compare: those settings that are to be held against the reference.
        time: those repeats that are to be timed, in turn.
    """

    settings: int
    repeats: int
    compare: tuple[Setting, ...]
    time: tuple[tuple[int, Setting], ...]

    def comparing(self) -> AbstractContextManager[Callable[[], None]]:
        return counting("comparing settings", self.settings, done=self.settings - len(self.compare))

    def timing(self) -> AbstractContextManager[Callable[[], None]]:
        total = self.repeats * self.settings
        return counting("timing settings in turn", total, done=total - len(self.time))


def _todo(settings: Sequence[Setting], repeats: int, kept: AccuracyFolder) -> _Todo:
    from renderer.accuracy.timing import turn

    compare = tuple(setting for setting in settings if setting.id not in kept.measured)
    time = tuple(
        (repeat, setting)
        for repeat in range(repeats)
        for setting in turn(settings, repeat)
        if repeat not in kept.times.get(setting.id, {})
    )
    return _Todo(len(settings), repeats, compare, time)


def _measure_here(
    arguments: argparse.Namespace, prepared: PreparedScene, view: FrameRequest, todo: _Todo, kept: AccuracyFolder
) -> None:
    from renderer.accuracy.timing import timed_frame

    stop = threading.Event()
    renderer = ready_renderer(arguments.threads, keeps=False, abandon=stop)
    with heeding(stop):
        with todo.comparing() as tick:
            _measure(renderer, prepared, view, todo.compare, kept, tick)
        if todo.time and not todo.compare:
            timed_frame(renderer, prepared, view, todo.time[0][1])  # a first frame of a scene is slow
        with todo.timing() as tick:
            for repeat, setting in todo.time:
                kept.keep_time(setting.id, repeat, timed_frame(renderer, prepared, view, setting))
                tick()
    renderer.close()


def _measure_on(
    cluster: Cluster, prepared: PreparedScene, view: FrameRequest, todo: _Todo, kept: AccuracyFolder
) -> None:
    from clients.command_line.accuracy_cluster import Truth, compare_on, time_on

    with todo.comparing() as tick:
        if todo.compare:
            radiance = kept.radiance((view.display.height_px, view.display.width_px))
            truth = Truth(view, radiance, prepared.scene.exposure, judges())
            compare_on(cluster, prepared, todo.compare, truth, kept, tick)
    with todo.timing() as tick:
        time_on(cluster, prepared, view, todo.time, kept, tick)


def _render_reference(
    arguments: argparse.Namespace,
    prepared: PreparedScene,
    view: FrameRequest,
    settings: Sequence[Setting],
    kept: AccuracyFolder,
    cluster: Cluster | None,
) -> None:
    from renderer.accuracy.grid import most_samples
    from renderer.accuracy.record import Reference
    from renderer.accuracy.reference import render_reference, rounds
    from renderer.pipeline import Renderer

    samples, spared = arguments.reference_samples, most_samples(settings)
    ready_renderer(arguments.threads).close()
    stop = threading.Event()
    renderer = Renderer(arguments.threads, store_bytes=STORE_BYTES, tracing=cluster, abandon=stop)
    with heeding(stop), counting("rendering the reference", len(rounds(samples, spared))) as tick:
        found = render_reference(renderer, prepared, view, samples, spared, tick)
    renderer.close()
    reference = Reference(samples, found.standard_error, round(found.seconds, 3), REFERENCE_FRAME)
    kept.keep_reference(reference, found.radiance, _picture(found.radiance, prepared.scene.exposure)[1])


def _measure(
    renderer: Renderer,
    prepared: PreparedScene,
    view: FrameRequest,
    settings: Sequence[Setting],
    kept: AccuracyFolder,
    tick: Callable[[], None],
) -> None:
    """Hold settings against the reference, by every metric there is."""
    if not settings:
        return
    reference = kept.radiance((view.display.height_px, view.display.width_px))
    metrics = metrics_of(view, reference, prepared.scene.exposure, judges())
    for setting in settings:
        kept.keep_measured(setting.id, *compared(renderer, prepared, view, setting, reference, metrics))
        tick()


def compared(
    renderer: Renderer,
    prepared: PreparedScene,
    view: FrameRequest,
    setting: Setting,
    reference: NDArray[np.float32],
    metrics: Sequence[Metric],
) -> tuple[Measured, bytes, bytes]:
    """What one setting is beside the reference, its picture, and the map of its error, both as PNG files."""
    from renderer.accuracy.error_map import error_map
    from renderer.accuracy.measurement import measure
    from renderer.codec import encode

    exposure = prepared.scene.exposure
    measured, radiance = measure(renderer, prepared, view, setting, reference)
    pixels, picture = _picture(radiance, exposure)
    for metric in metrics:
        measured = replace(measured, accuracy=metric(measured.accuracy, pixels))
    return measured, picture, encode(error_map(radiance, reference, exposure), "png")


Metric = Callable[["Accuracy", "NDArray[np.uint8]"], "Accuracy"]


def judges() -> tuple[str, ...]:
    """The optional packages that judge pictures, those that are here."""
    return tuple(package for package in ("flip_evaluator", "pyfvvdp") if find_spec(package) is not None)


def metrics_of(
    view: FrameRequest, radiance: NDArray[np.float32], exposure: float, packages: Sequence[str]
) -> list[Metric]:
    """What fills in the measures of some of these packages, beside the reference."""
    reference = _picture(radiance, exposure)[0]
    metrics: list[Metric] = []
    if "flip_evaluator" in packages:
        from renderer.accuracy.flip import flip_errors

        def flip(accuracy: Accuracy, pixels: NDArray[np.uint8]) -> Accuracy:
            found = flip_errors(pixels, reference, view.display)
            return replace(accuracy, flip_mean=found.mean, flip_p99=found.p99)

        metrics.append(flip)
    if "pyfvvdp" in packages:
        from renderer.accuracy.vdp import VisibilityMetric
        from renderer.eccentricity import eccentricity_deg

        metric = VisibilityMetric(view.display, view.gaze, eccentricity_deg(view.display, view.gaze))

        def visibility(accuracy: Accuracy, pixels: NDArray[np.uint8]) -> Accuracy:
            found = metric.judge(pixels, reference)
            return replace(accuracy, jod=found.jod, jod_heat_foveal_p99=found.heat_foveal_p99)

        metrics.append(visibility)
    return metrics


def _picture(radiance: NDArray[np.float32], exposure: float) -> tuple[NDArray[np.uint8], bytes]:
    """What the screen shows of linear radiance, as 8-bit pixels and as a PNG file."""
    from renderer.accuracy.measures import shown
    from renderer.codec import encode
    from renderer.tonemap import encode_srgb

    pixels = encode_srgb(shown(radiance, exposure))
    return pixels, encode(pixels, "png")
