"""`gazetrace accuracy`: what accuracy costs in time, setting by setting, for one scene on this machine."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clients.command_line.accuracy_folder import AccuracyFolder
from clients.command_line.accuracy_steps import measure_missing
from clients.command_line.accuracy_temporal import WALK_S, measure_flicker
from clients.command_line.accuracy_text import accuracy_text
from clients.command_line.cluster import add_cluster, check_cluster, joined
from clients.command_line.errors import OK, UsageError
from clients.command_line.fingerprint import fingerprint
from clients.command_line.frame_flags import add_frame_flags, frame_request
from clients.command_line.gaze_trace_flags import SIMULATED, add_gaze_trace_flags
from clients.command_line.numerics_text import numerics_record, numerics_text
from clients.command_line.progress import counting, say
from clients.command_line.render import add_threads, check_threads, write_whole
from clients.command_line.scene_argument import SCENE_HELP, add_scenes_folder, load_scene
from renderer.camera import Camera
from renderer.display import Display
from renderer.quality import Quality

if TYPE_CHECKING:
    from renderer.accuracy.grid import Setting
    from renderer.accuracy.record import AccuracyReport, Machine
    from renderer.frame import FrameRequest
    from renderer.prepared import PreparedScene

DESCRIPTION = """\
Measure what accuracy costs in time: render SCENE at some fifty settings (samples, kind of map, acuity, anti-aliasing,
reconstruction, depth, each effect), time each, and hold each against a reference at full resolution.

DIR gets report.html with plots and pictures, accuracy.json, accuracy.csv, and in frames/ each picture with a map of its
error. Times are those of a frame whose cell map and samples are all made anew, in an order shuffled anew for each
repeat. What was measured is kept at once: the same command goes on where it was stopped."""

EXAMPLES = """\
examples:
  gazetrace accuracy atrium --quick -o atrium-quick
      Half as many settings of a smaller frame, in three minutes at most.

  gazetrace accuracy atrium --gaze 600,400 -o atrium
      All settings at 1920x1080, each timed five times; some 20 minutes on two cores.

  gazetrace accuracy atrium --temporal --gaze-trace eye.csv -o atrium
      What flickers when only the gaze moves, for a recorded eye, in a minute; a section of the page in the same DIR.

  gazetrace accuracy --numerics
      What numerical care costs and what it saves: robust or fast, float64 or float32, and more, in a minute."""

MOST_REPEATS: Final = 1000
REPEATS: Final = 5
QUICK_REPEATS: Final = 3
REFERENCE_SAMPLES: Final = 256
MOST_REFERENCE_SAMPLES: Final = 2048
QUICK_REFERENCE_SAMPLES: Final = 48
QUICK_SIZE: Final = (960, 540)


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "accuracy",
        help="measure what accuracy costs in time",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for what is found")
    parser.add_argument(
        "--numerics",
        action="store_true",
        help="instead, measure the renderer's numerical choices against others; needs no SCENE and no DIR",
    )
    parser.add_argument(
        "--temporal",
        action="store_true",
        help="instead, measure what changes on the screen when only the gaze moves; on a screen as with --quick",
    )
    width, height = QUICK_SIZE
    parser.add_argument(
        "--quick", action="store_true", help=f"fewer settings, repeats and samples; {width}x{height} unless --size"
    )
    parser.add_argument(
        "--repeats",
        type=int,
        metavar="N",
        help=f"how often each setting is timed (default {REPEATS}; {QUICK_REPEATS} with --quick)",
    )
    parser.add_argument(
        "--reference-samples",
        type=int,
        metavar="N",
        help="camera rays a pixel of the reference "
        f"(default {REFERENCE_SAMPLES}; {QUICK_REFERENCE_SAMPLES} with --quick)",
    )
    add_frame_flags(parser, detail=False)
    add_gaze_trace_flags(
        parser, title="gaze, with --temporal", required=False, seconds=f"{WALK_S:g}, or as long as a shorter file"
    )
    parser.set_defaults(size=None)
    parser.add_argument("--no-report", action="store_true", help="leave out the page and its plots")
    parser.add_argument("--json", action="store_true", help="print accuracy.json or temporal.json")
    add_threads(parser)
    add_cluster(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Measure what is missing, write it down, print it."""
    if arguments.numerics:
        return _numerics(as_json=arguments.json)
    _complete(arguments)
    if arguments.temporal:
        return measure_flicker(arguments)
    frame_request(arguments, Camera(), quality=Quality())  # complain about a flag before a scene takes seconds to load
    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    view = frame_request(arguments, prepared.scene.camera, quality=Quality())
    from renderer.accuracy.grid import FULL, QUICK, grid
    from renderer.accuracy.machine import this_machine
    from renderer.workers import available_cores

    settings = grid(QUICK if arguments.quick else FULL, prepared.plan)
    with ExitStack() as stack:
        cluster = None
        machine = this_machine(arguments.threads or available_cores())
        if arguments.cluster is not None:
            from clients.command_line.accuracy_cluster import machine_of

            cluster = stack.enter_context(joined(arguments.cluster, arguments.threads))
            machine = machine_of(cluster, prepared)
        request = _request(arguments, prepared, view, settings, machine)
        kept = stack.enter_context(AccuracyFolder(arguments.output, request))
        if kept.changed:
            say(f"{arguments.output} held a measurement of another request ({', '.join(kept.changed)}): starting over")
        try:
            measure_missing(arguments, prepared, view, settings, kept, cluster)
        except KeyboardInterrupt:
            say(f"stopped with {_progress(kept, settings, arguments.repeats)}; the same command goes on")
            raise
        kept.finish()
        report = _report(arguments, prepared, view, settings, machine, kept)
    from renderer.accuracy.record import report_json

    files = _write(arguments.output, report, draw=not arguments.no_report)

    print(report_json(report) if arguments.json else accuracy_text(report, files))
    return OK


def _numerics(*, as_json: bool) -> int:
    """Measure and print the numerical choices."""
    from renderer.numerics import CHAPTERS

    with counting("measuring numerical choices", len(CHAPTERS)) as tick:
        chapters = {}
        for subject, measure in CHAPTERS.items():
            chapters[subject] = measure()
            tick()
    print(json.dumps(numerics_record(chapters), indent=2) if as_json else numerics_text(chapters))
    return OK


def _complete(arguments: argparse.Namespace) -> None:
    """Fill in what depends on `--quick`, and check what no record does.

    Raises:
        UsageError: naming the flag.
    """
    missing = [name for name, value in (("SCENE", arguments.scene), ("-o/--output", arguments.output)) if value is None]
    if missing:
        raise UsageError(f"the following arguments are required: {', '.join(missing)}")
    check_threads(arguments.threads)
    check_cluster(arguments.cluster)
    if arguments.temporal and arguments.cluster is not None:
        raise UsageError("--cluster: expected none with --temporal, whose frames follow one another")
    display = Display()
    small = arguments.quick or arguments.temporal
    arguments.size = arguments.size or (QUICK_SIZE if small else (display.width_px, display.height_px))
    if arguments.temporal and arguments.gaze is not None:
        raise UsageError("--gaze: expected none with --temporal, whose gaze is that of --gaze-trace")
    if arguments.gaze_trace is not None and not arguments.temporal:
        raise UsageError("--gaze-trace: expected --temporal with it")
    arguments.gaze_trace = arguments.gaze_trace or SIMULATED
    if arguments.repeats is None:
        arguments.repeats = QUICK_REPEATS if arguments.quick else REPEATS
    if arguments.reference_samples is None:
        arguments.reference_samples = QUICK_REFERENCE_SAMPLES if arguments.quick else REFERENCE_SAMPLES
    if not 1 <= arguments.repeats <= MOST_REPEATS:
        raise UsageError(f"--repeats: expected an integer from 1 to {MOST_REPEATS}, found {arguments.repeats}")
    most, samples = MOST_REFERENCE_SAMPLES, arguments.reference_samples
    if not 2 <= samples <= most:
        raise UsageError(f"--reference-samples: expected an integer from 2 to {most}, found {samples}")
    if arguments.output.exists() and not arguments.output.is_dir():
        raise UsageError(f"--output: expected a folder, found the file {str(arguments.output)!r}")
    if not arguments.output.absolute().parent.is_dir():
        raise UsageError(f"--output: expected a place in an existing folder, found {str(arguments.output)!r}")


def _request(
    arguments: argparse.Namespace,
    prepared: PreparedScene,
    view: FrameRequest,
    settings: Sequence[Setting],
    machine: Machine,
) -> dict[str, Any]:
    """What decides the result, but for the number of repeats: more of them go on from fewer."""
    from renderer.version import source_hash

    return {
        "renderer": source_hash(),
        "scene": fingerprint(prepared.scene),
        "size": list(arguments.size),
        "screen": asdict(view.display),
        "gaze": asdict(view.gaze),
        "camera": fingerprint(view.camera),
        "settings": fingerprint(settings),
        "reference": arguments.reference_samples,
        "machine": asdict(machine),
    }


def _report(
    arguments: argparse.Namespace,
    prepared: PreparedScene,
    view: FrameRequest,
    settings: Sequence[Setting],
    machine: Machine,
    kept: AccuracyFolder,
) -> AccuracyReport:
    from renderer.accuracy.measurement import setting_result
    from renderer.accuracy.record import AccuracyReport
    from renderer.acuity_comparison import compare_models
    from renderer.workers import WorkerPool

    pool = WorkerPool(machine.threads)
    models = compare_models(view.display, view.gaze, view.quality, pool)
    pool.close()
    scene = prepared.scene
    assert kept.reference is not None
    results = [
        setting_result(
            setting,
            kept.measured[setting.id],
            [times for _, times in sorted(kept.times[setting.id].items())],
            kept.frame(setting.id),
            kept.error_map(setting.id),
        )
        for setting in settings
    ]
    return AccuracyReport(
        version=metadata.version("gazetrace"),
        command=shlex.join(["gazetrace", *arguments.words]),
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        machine=machine,
        scene=arguments.scene,
        triangles=scene.triangles,
        spheres=len(scene.spheres),
        effects=prepared.plan.names,
        display=view.display,
        gaze=view.gaze,
        camera=view.camera or scene.camera,
        reference=kept.reference,
        settings=tuple(results),
        acuity_models=models,
    )


def _write(folder: Path, report: AccuracyReport, *, draw: bool) -> list[Path]:
    """Write what was found into its folder, with plots and a page if they can be drawn; the main files."""
    from clients.report.plotting import can_plot
    from renderer.accuracy.record import report_json
    from renderer.accuracy.table import csv_text

    files = [folder / "accuracy.json", folder / "accuracy.csv"]
    for path, text in zip(files, (report_json(report), csv_text(report.settings)), strict=True):
        write_whole(path, text.encode())
    if draw and can_plot():
        from clients.report.accuracy_report import write_report

        with counting("writing the report", len(report.settings)) as tick:
            page, *_ = write_report(folder, tick)
        files.insert(0, page)
    return files


def _progress(kept: AccuracyFolder, settings: Sequence[Setting], repeats: int) -> str:
    timed = sum(len(times) for times in kept.times.values())
    return f"{len(kept.measured)} of {len(settings)} settings compared and {timed} of {repeats * len(settings)} timed"
