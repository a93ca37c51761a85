"""`gazetrace bench`: how fast this machine is beside what bounds it, and how time grows."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clients.command_line.errors import OK, UsageError
from clients.command_line.frame_flags import add_frame_flags, frame_request
from clients.command_line.progress import counting, working
from clients.command_line.render import add_threads, check_threads, ready_renderer
from clients.command_line.scene_argument import SCENE_HELP, add_scenes_folder, load_scene
from renderer.camera import Camera

if TYPE_CHECKING:
    from clients.command_line.benchmark.growth import Series
    from clients.command_line.benchmark.row import Row
    from renderer.frame import FrameRequest
    from renderer.pipeline import Renderer
    from renderer.prepared import PreparedScene

DESCRIPTION = """\
Measure how fast frames are on this machine: each row a ratio of two things that are timed in turn within one run.

The yardstick is Embree alone on the rays of the frame: it finds what each ray hits and cannot be spared. Other rows
hold the frame's parts and variants against the whole, gaze-dependent frames against full ones, a large screen against
a small one, one thread against two, and other renderers, given the same scene, against ours."""

EXAMPLES = """\
examples:
  gazetrace bench
      The benchmark scene at 1920x1080, one sample a cell: all rows, in about two minutes.

  gazetrace bench --only frame,peers --repeats 15 -o bench.json
      Some rows, timed more often, and saved.

  gazetrace bench --growth growth
      Time against pixels, triangles, lights and depth, with fitted exponents.

  gazetrace bench gallery --effect-costs
      What each effect costs: the frame as planned, with every effect on, and without each."""

DEFAULT_SCENE = "atrium"
MOST_REPEATS = 1000
ROWS = ("frame", "stages", "samples", "paper", "pixels", "threads", "peers", "memory")

MANY = 8
MANY_OF_ALL = 32
"""Samples a cell where many are asked for, as the paper has them with `--all`."""

STREAM_FRAMES = 100
STREAM_FRAMES_OF_ALL = 1000
MOST_STREAM_FRAMES = 1_000_000

REPEATS = 7
SLOW_REPEATS = 3
"""How often things are timed unless asked otherwise; the fewer where each takes seconds."""

MOST_TRIANGLES = 1_000_000
LEAST_TRIANGLES = 10_000
ALL_TRIANGLES = 10_000_000


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "bench",
        help="measure how fast frames are, beside Embree alone and other renderers",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="SCENE", help=f"{SCENE_HELP} (default %(default)s)"
    )
    add_frame_flags(parser, samples=1)
    _add_what(parser)
    parser.add_argument(
        "--repeats",
        type=int,
        metavar="N",
        help=f"how often each is timed (default {REPEATS}; {SLOW_REPEATS} with --growth and --start). What takes "
        f"seconds is timed {SLOW_REPEATS} times at most",
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="save the figures as JSON too")
    parser.add_argument("--json", action="store_true", help="print JSON")
    add_threads(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def _add_what(parser: argparse.ArgumentParser) -> None:
    what = parser.add_argument_group("what is measured")
    kind = what.add_mutually_exclusive_group()
    kind.add_argument(
        "--only", type=row_groups, default=ROWS, metavar="ROWS", help=f"rows by name, of {','.join(ROWS)}"
    )
    kind.add_argument(
        "--growth", type=Path, metavar="DIR", help="time against pixels, triangles, lights and depth, into a folder"
    )
    kind.add_argument("--start", action="store_true", help="what new processes take, and an idle one")
    kind.add_argument("--effect-costs", action="store_true", help="the frame with its effects forced on and off")
    what.add_argument(
        "--all",
        action="store_true",
        help=f"{MANY_OF_ALL} samples where there are many, {STREAM_FRAMES_OF_ALL:,} frames of a stream; "
        f"with --growth up to {ALL_TRIANGLES:,} triangles",
    )
    what.add_argument(
        "--many", type=int, metavar="N", help=f"samples a cell of the rows samples and paper (default {MANY})"
    )
    what.add_argument(
        "--stream-frames", type=int, metavar="N", help=f"frames of the row memory (default {STREAM_FRAMES})"
    )
    what.add_argument(
        "--triangles", type=int, metavar="N", help=f"most triangles of --growth (default {MOST_TRIANGLES:,})"
    )


def row_groups(text: str) -> tuple[str, ...]:
    """Read `frame,peers`."""
    names = tuple(text.split(","))
    for name in names:
        if name not in ROWS:
            raise argparse.ArgumentTypeError(f"expected some of {','.join(ROWS)}, found {name!r}")
    return names


def run(arguments: argparse.Namespace) -> int:
    """Measure, print and save."""
    slow = arguments.start or arguments.growth is not None
    arguments.repeats = _within("--repeats", arguments.repeats, SLOW_REPEATS if slow else REPEATS, 1, MOST_REPEATS)
    check_threads(arguments.threads)
    frame_request(arguments, Camera())  # complain about a flag before a scene takes seconds to load
    if arguments.output is not None and not arguments.output.parent.is_dir():
        raise UsageError(f"--output: expected a file in an existing folder, found {str(arguments.output)!r}")
    if arguments.start:
        record, text = _start(arguments)
    elif arguments.growth is not None:
        record, text = _growth(arguments)
    elif arguments.effect_costs:
        record, text = _effects(arguments)
    else:
        record, text = _rows(arguments)
    if arguments.output is not None:
        arguments.output.write_text(json.dumps(record, indent=2) + "\n")
    print(json.dumps(record, indent=2) if arguments.json else text)
    return OK


def _rows(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    every = arguments.all
    many = _within("--many", arguments.many, MANY_OF_ALL if every else MANY, 1, 4096)
    default = STREAM_FRAMES_OF_ALL if every else STREAM_FRAMES
    frames = _within("--stream-frames", arguments.stream_frames, default, 2, MOST_STREAM_FRAMES)
    prepared, request, renderer = _ready(arguments)
    if prepared.scene.triangles == 0:
        raise UsageError(f"{arguments.scene}: expected a scene with triangles to time Embree on, found none")
    from clients.command_line.benchmark.job import Job
    from clients.command_line.benchmark.row import table_text
    from clients.command_line.benchmark.selection import GROUPS

    stated = {"--threads": arguments.threads, "--scenes-folder": arguments.scenes_folder}
    flags = tuple(word for flag, value in stated.items() if value is not None for word in (flag, str(value)))
    job = Job(arguments.scene, prepared, request, renderer, arguments.repeats, many, frames, flags)
    rows: list[Row] = []
    for name in arguments.only:
        with working(f"measuring {name}"):
            rows += GROUPS[name](job)
    renderer.close()
    record = _record(arguments, renderer.threads) | {
        "samples_per_cell": request.quality.samples_per_cell,
        "map": request.quality.map,
        "triangles": prepared.scene.triangles,
        "rows": [_row_record(row) for row in rows],
    }
    samples = request.quality.samples_per_cell
    head = f"{_heading(record)}, {request.quality.map} map, {samples} sample{'' if samples == 1 else 's'} a cell"
    return record, f"{head}\n{table_text(rows)}"


def _start(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from clients.command_line.benchmark.row import table_text
    from clients.command_line.benchmark.start import start_rows, steps
    from renderer.workers import available_cores

    width_px, height_px = arguments.size
    with counting("starting processes", steps(arguments.repeats)) as tick:
        rows = start_rows(arguments.scene, f"{width_px}x{height_px}", arguments.repeats, tick)
    record = _record(arguments, available_cores()) | {"rows": [_row_record(row) for row in rows]}
    return record, f"{_heading(record)}\n{table_text(rows)}"


def _growth(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    default = ALL_TRIANGLES if arguments.all else MOST_TRIANGLES
    triangles = _within("--triangles", arguments.triangles, default, LEAST_TRIANGLES, ALL_TRIANGLES)
    arguments.growth.mkdir(parents=True, exist_ok=True)
    prepared, _, renderer = _ready(arguments)
    from clients.command_line.benchmark.growth import measure_growth, steps
    from clients.report.growth_plot import draw_growth
    from clients.report.plotting import WANTED, can_plot

    with counting("measuring growth", steps(triangles, arguments.repeats)) as tick:
        series = tuple(measure_growth(renderer, prepared, triangles, arguments.repeats, tick))
    renderer.close()
    record = _record(arguments, renderer.threads) | {"series": [asdict(one) for one in series]}
    path = arguments.growth / "growth.json"
    path.write_text(json.dumps(record, indent=2) + "\n")
    files = [path, *(draw_growth(record["series"], arguments.growth / "growth") if can_plot() else ())]
    said = ", ".join(map(str, files)) + ("" if can_plot() else f"; plots want {WANTED}")
    return record, f"{growth_text(series)}\n{said}"


def growth_text(series: tuple[Series, ...]) -> str:
    """Time by size, and its exponents, for people."""
    lines = []
    for one in series:
        by_rays = "" if one.time_of_rays is None else f", {one.time_of_rays:.2f} by rays"
        lines.append(f"{one.name}: time grows with exponent {one.time.exponent:.2f} by size{by_rays} ({one.note})")
        for point in one.points:
            each_ns = 1e6 * point.ms / point.rays
            lines.append(f"  {point.x:>12,.0f} {point.ms:>12,.1f} ms {point.rays:>14,} rays {each_ns:>8.1f} ns a ray")
    return "\n".join(lines)


def _effects(arguments: argparse.Namespace) -> tuple[dict[str, Any], str]:
    from renderer.effect_benchmark import measure_effects

    prepared, request, renderer = _ready(arguments)
    with counting(f"measuring {arguments.scene}", arguments.repeats) as tick:
        costs = measure_effects(renderer, prepared, request, arguments.repeats, tick)
    renderer.close()
    record = _record(arguments, renderer.threads) | {"costs": [asdict(cost) for cost in costs]}
    return record, effect_text(record)


def effect_text(record: dict[str, Any]) -> str:
    """What effects cost, for people: a line for each choice of effects."""
    names = [
        "as planned",
        "every effect forced on",
        *(f"without {cost['choice'][0][1:]}" for cost in record["costs"][2:]),
    ]
    lines = [f"{record['scene']:<26}processor time   over planned     lowest    highest         rays"]
    for name, cost in zip(names, record["costs"], strict=True):
        ratios = f"{cost['ratio']:15.3f}{cost['low']:11.3f}{cost['high']:11.3f}"
        lines.append(f"{name:<26}{cost['ms']:11,.1f} ms{ratios}{cost['rays']:13,}")
    return "\n".join(lines)


def _ready(arguments: argparse.Namespace) -> tuple[PreparedScene, FrameRequest, Renderer]:
    """The scene, the frame and a renderer whose kernels are compiled."""
    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    return prepared, frame_request(arguments, prepared.scene.camera), ready_renderer(arguments.threads)


def _within(flag: str, value: int | None, default: int, low: int, high: int) -> int:
    """The value of a flag, or its default.

    Raises:
        UsageError: for a value out of range.
    """
    if value is None:
        return default
    if not low <= value <= high:
        raise UsageError(f"{flag}: expected an integer from {low} to {high}, found {value}")
    return value


def _record(arguments: argparse.Namespace, threads: int) -> dict[str, Any]:
    """What every measurement states."""
    from renderer.accuracy.machine import this_machine

    width_px, height_px = arguments.size
    return {
        "scene": arguments.scene,
        "width": width_px,
        "height": height_px,
        "repeats": arguments.repeats,
        "threads": threads,
        "machine": asdict(this_machine(threads)),
    }


def _row_record(row: Row) -> dict[str, Any]:
    return {**asdict(row), "met": row.met}


def _heading(record: dict[str, Any]) -> str:
    threads = "1 thread" if record["threads"] == 1 else f"{record['threads']} threads"
    return (
        f"{record['scene']}, {record['width']}x{record['height']}, {threads} of {record['machine']['processor']}, "
        f"median of {record['repeats']}"
    )
