"""`gazetrace bench`: how long a frame takes on this machine, and Embree alone for its rays."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from clients.command_line.errors import OK, UsageError
from clients.command_line.frame_flags import add_frame_flags, frame_request
from clients.command_line.progress import counting
from clients.command_line.render import add_threads, check_threads, ready_renderer
from clients.command_line.scene_argument import SCENE_HELP, add_scenes_folder, load_scene
from renderer.camera import Camera

if TYPE_CHECKING:
    from renderer.benchmark import Benchmark
    from renderer.frame import FrameRequest

DESCRIPTION = """\
Time one frame on this machine, and Embree alone on the same rays.

The frame's cell map is cached, its samples are all new, and it is not encoded. Embree finds what each ray hits and
cannot be spared, so the frame over it says what everything around it costs. The frame after a gaze move traces only
the cells that are new."""

EXAMPLES = """\
examples:
  gazetrace bench
      The benchmark scene at 1920x1080, one sample a cell.

  gazetrace bench spheres --samples 4 --size 1280x720 --repeats 15
      Another scene and frame, everything timed 15 times.

  gazetrace bench gallery --effect-costs
      What each effect costs: the frame as planned, with every effect on, and without each.

  gazetrace bench --full --threads 1 --json
      Full resolution on one core, as JSON."""

DEFAULT_SCENE = "atrium"
MOST_REPEATS = 1000


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "bench",
        help="time one frame against bare Embree",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="SCENE", help=f"{SCENE_HELP} (default %(default)s)"
    )
    add_frame_flags(parser, samples=1)
    parser.add_argument(
        "--repeats", type=int, default=7, metavar="N", help="how often everything is timed (default %(default)s)"
    )
    parser.add_argument(
        "--effect-costs", action="store_true", help="time the frame with its effects forced on and off instead"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    add_threads(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    if not 1 <= arguments.repeats <= MOST_REPEATS:
        raise UsageError(f"--repeats: expected an integer from 1 to {MOST_REPEATS}, found {arguments.repeats}")
    check_threads(arguments.threads)
    frame_request(arguments, Camera())  # complain about a flag before a scene takes seconds to load
    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    if prepared.scene.triangles == 0 and not arguments.effect_costs:
        raise UsageError(f"{arguments.scene}: expected a scene with triangles to time Embree on, found none")
    request = frame_request(arguments, prepared.scene.camera)
    renderer = ready_renderer(arguments.threads)
    with counting(f"measuring {arguments.scene}", arguments.repeats) as tick:
        if arguments.effect_costs:
            from renderer.effect_benchmark import measure_effects

            costs = measure_effects(renderer, prepared, request, arguments.repeats, tick)
            record = {"costs": [asdict(cost) for cost in costs]}
        else:
            from renderer.benchmark import measure_frame

            record = bench_record(measure_frame(renderer, prepared, request, arguments.repeats, tick), request)
    renderer.close()
    record = {"scene": arguments.scene, "repeats": arguments.repeats, **record}
    text = effect_text if arguments.effect_costs else bench_text
    print(json.dumps(record, indent=2) if arguments.json else text(record))
    return OK


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


def bench_record(result: Benchmark, request: FrameRequest) -> dict[str, Any]:
    """The measurement as `--json` prints it."""
    return {
        "width": request.display.width_px,
        "height": request.display.height_px,
        "threads": result.threads,
        "map": {"kind": request.quality.map, "cells": result.cells},
        "samples_per_cell": request.quality.samples_per_cell,
        "rays": asdict(result.rays),
        "figures": [asdict(figure) for figure in result.figures],
    }


def bench_text(record: dict[str, Any]) -> str:
    """The same for people: medians, and how far the repeats lie apart."""
    threads = "1 thread" if record["threads"] == 1 else f"{record['threads']} threads"
    rays = sum(record["rays"].values())
    samples = record["samples_per_cell"]
    lines = [
        f"{record['scene']}, {record['width']}x{record['height']}, {record['map']['cells']:,} {record['map']['kind']} "
        f"cells, {samples} sample{'' if samples == 1 else 's'} each: {rays:,} rays on {threads}",
        f"{'median of ' + str(record['repeats']):>53}    lowest   highest",
    ]
    for figure in record["figures"]:
        digits = 3 if figure["unit"] == "ratio" else 1
        numbers = (f"{figure[part]:10.{digits}f}" for part in ("median", "low", "high"))
        unit = "" if figure["unit"] == "ratio" else " " + figure["unit"]
        lines.append(f"{figure['name']:<43}{''.join(numbers)}{unit}")
    return "\n".join(lines)
