"""`gazetrace accuracy --temporal`: what changes on the screen when only the gaze moves, measured and written down."""

from __future__ import annotations

import argparse
import math
import shlex
import threading
from dataclasses import asdict
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clients.command_line.errors import OK, UsageError
from clients.command_line.fingerprint import fingerprint
from clients.command_line.frame_flags import frame_request
from clients.command_line.gaze_trace_flags import playback_of
from clients.command_line.interrupt import heeding
from clients.command_line.journal import Journal
from clients.command_line.progress import counting, say
from clients.command_line.render import ready_renderer, write_whole
from clients.command_line.scene_argument import load_scene
from clients.command_line.temporal_text import temporal_text
from renderer.camera import Camera
from renderer.gaze import Gaze
from renderer.quality import Quality

if TYPE_CHECKING:
    from renderer.accuracy.temporal import FlickerStep
    from renderer.accuracy.temporal_record import TemporalReport
    from renderer.display import Display
    from renderer.frame import FrameRequest
    from renderer.prepared import PreparedScene

WALK_S: Final = 2.0
"""How long the gaze is played unless told [s]."""

FRAMES_PER_SECOND: Final = 25.0

MOST_GAZES: Final = 10_000

LOG: Final = "temporal.jsonl"
"""The steps that are measured, for the same command to go on after."""


def measure_flicker(arguments: argparse.Namespace) -> int:
    """Render the walk in each way, write what changed, print it; with a page where one measures the scene already."""
    view = frame_request(arguments, Camera(), quality=Quality())
    walk = walk_of(arguments, view.display)
    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    view = frame_request(arguments, prepared.scene.camera, quality=Quality())
    folder: Path = arguments.output
    folder.mkdir(exist_ok=True)
    with Journal(folder / LOG, _request(arguments, prepared, view, walk)) as journal:
        if journal.changed:
            say(f"{folder} held a walk of another request ({', '.join(journal.changed)}): starting over")
            journal.start_over()
        steps = _Steps(journal)
        try:
            report = _measured(arguments, prepared, view, walk, steps)
        except KeyboardInterrupt:
            say(f"stopped with {len(journal.records)} steps of the gaze measured; the same command goes on")
            raise
    from renderer.accuracy.record import report_json
    from renderer.accuracy.table import csv_text

    files = [folder / "temporal.json", folder / "temporal.csv"]
    for path, text in zip(files, (report_json(report), csv_text(report.ways)), strict=True):
        write_whole(path, text.encode())
    if not arguments.no_report:
        files = [*_draw(folder), *files]
    print(report_json(report) if arguments.json else temporal_text(report, files))
    return OK


def walk_of(arguments: argparse.Namespace, display: Display) -> list[Gaze]:
    """The newest gaze at the time of each frame; where the eye was lost, the last one.

    Raises:
        UsageError: for a walk without a step, or too long a one.
    """
    playback = playback_of(arguments)
    seconds = min(playback.seconds, WALK_S) if arguments.seconds is None else playback.seconds
    count = math.ceil(round(seconds * FRAMES_PER_SECOND, 6))
    if not 2 <= count <= MOST_GAZES:
        found = f"{count} in {seconds:g} s at {FRAMES_PER_SECOND:g} a second"
        raise UsageError(f"--seconds: expected time for 2 to {MOST_GAZES} gazes, found {found}")
    trace = playback.trace.held((display.width_px / 2, display.height_px / 2))
    samples = (trace.sample(trace.newest(frame / FRAMES_PER_SECOND)) for frame in range(count))
    return [Gaze(sample.x, sample.y) for sample in samples]


def _measured(
    arguments: argparse.Namespace, prepared: PreparedScene, view: FrameRequest, walk: list[Gaze], steps: _Steps
) -> TemporalReport:
    """Measure the steps that an earlier run has not, and put all of them together."""
    from renderer.accuracy.machine import this_machine
    from renderer.accuracy.temporal import WAYS, flicker, flicker_steps
    from renderer.accuracy.temporal_record import TemporalReport
    from renderer.workers import available_cores

    total, done = len(WAYS) * (len(walk) - 1), sum(len(steps.of(way)) for way in WAYS)
    if done < total:
        stop = threading.Event()
        renderer = ready_renderer(arguments.threads, abandon=stop)
        with heeding(stop), counting(f"moving the gaze over {arguments.scene}", total, done) as tick:
            for way in WAYS:
                for step in flicker_steps(renderer, prepared, view, walk, way, len(steps.of(way))):
                    steps.keep(way, step)
                    tick()
                renderer.forget_samples()
        renderer.close()
    return TemporalReport(
        version=metadata.version("gazetrace"),
        command=shlex.join(["gazetrace", *arguments.words]),
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        machine=this_machine(arguments.threads or available_cores()),
        scene=arguments.scene,
        display=view.display,
        camera=view.camera or prepared.scene.camera,
        quality=view.quality,
        gaze_trace=arguments.gaze_trace,
        frames_per_second=FRAMES_PER_SECOND,
        gazes=tuple(walk),
        ways=tuple(flicker(way, steps.of(way)) for way in WAYS),
    )


class _Steps:
    """The steps measured so far, by way, in the journal of a folder."""

    def __init__(self, journal: Journal) -> None:
        from renderer.accuracy.record import read_record
        from renderer.accuracy.temporal import FlickerStep

        self._journal = journal
        self._steps: dict[str, list[FlickerStep]] = {}
        for record in journal.records:
            if "step" in record:
                self.of(record["way"]).append(read_record(FlickerStep, record["step"]))

    def of(self, way: str) -> list[FlickerStep]:
        """Those of one way, in their order."""
        return self._steps.setdefault(way, [])

    def keep(self, way: str, step: FlickerStep) -> None:
        """Keep the next one."""
        self._journal.add({"way": way, "step": asdict(step)})
        self.of(way).append(step)


def _request(
    arguments: argparse.Namespace, prepared: PreparedScene, view: FrameRequest, walk: list[Gaze]
) -> dict[str, Any]:
    """What decides the result."""
    from renderer.version import source_hash

    return {
        "renderer": source_hash(),
        "scene": fingerprint(prepared.scene),
        "size": list(arguments.size),
        "screen": asdict(view.display),
        "camera": fingerprint(view.camera),
        "quality": asdict(view.quality),
        "gazes": fingerprint(walk),
    }


def _draw(folder: Path) -> list[Path]:
    """Make the page of the measurement in the folder again, if it has one that can be drawn; the page."""
    from clients.report.plotting import can_plot

    if not can_plot() or not (folder / "accuracy.json").is_file():
        return []
    from clients.report.accuracy_report import write_report

    page, *_ = write_report(folder)
    return [page]
