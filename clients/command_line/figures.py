"""`gazetrace figures`: the paper's figures and numbers, made again on this machine."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clients.command_line.errors import OK, UsageError, blame_flag
from clients.command_line.figures_record import differences, figures_text, models_record, rays_record, time_record
from clients.command_line.frame_flags import size
from clients.command_line.progress import counting
from clients.command_line.render import add_threads, check_threads, ready_renderer, write_whole
from clients.command_line.scene_argument import SCENE_HELP, add_scenes_folder, load_scene
from clients.report.plotting import WANTED, can_plot
from renderer.errors import SettingsError
from renderer.gaze import Gaze
from renderer.paper import published

if TYPE_CHECKING:
    from renderer.acuity_comparison import ModelCost
    from renderer.display import Display
    from renderer.paper.timing import TimeComparison

DESCRIPTION = """\
Make the figures and the tables of "Gaze-dependent Ray Tracing" (Siekawa and Mantiuk, CESCG 2014) again, each number
beside the paper's, with what differs named.

Written to DIR: figures.html (everything on one page), figures.json, figures.txt, figure-1 (contrast sensitivity) and
figure-2 (region of interest), figure-5 (cell maps), figure-7 (full and gaze-dependent pictures) as PNG, the curves
as SVG too; beyond the paper, acuity-models (other models of acuity, and the rays that each costs). The pictures are
timed in turn: expect five minutes on two cores, half a minute with --quick. Figures and page want the extra 'report';
the tables are written without it."""

EXAMPLES = """\
examples:
  gazetrace figures paper/
      Everything, with 32 rays a cell as in the paper.

  gazetrace figures paper/ --quick
      The same with 4 rays a cell, timed once.

  gazetrace figures paper/ --scene gallery --json
      Pictures and times of another scene; the tables as JSON on standard output."""

DEFAULT_SCENE = "atrium"
DEFAULT_REPEATS = 3
QUICK_SAMPLES = 4
MOST_REPEATS = 100


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "figures",
        help="make the paper's figures and numbers again",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("output", type=Path, metavar="DIR", help="folder for what is made; created if it is not there")
    parser.add_argument(
        "--scene", default=DEFAULT_SCENE, metavar="SCENE", help=f"of pictures and times: {SCENE_HELP} (%(default)s)"
    )
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_SAMPLES} rays a cell, timed once")
    parser.add_argument(
        "--samples", type=int, metavar="N", help=f"rays a cell of pictures and times ({published.SAMPLES_PER_CELL})"
    )
    parser.add_argument("--repeats", type=int, metavar="N", help=f"how often they are timed ({DEFAULT_REPEATS})")
    parser.add_argument(
        "--size",
        type=size,
        default=(published.SCREEN.width_px, published.SCREEN.height_px),
        metavar="WxH",
        help="pixels of pictures and times (1920x1080)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    add_threads(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Count, time, draw, write and print."""
    samples, repeats = _effort(arguments)
    display, gaze = _view(arguments.size, samples)
    check_threads(arguments.threads)
    folder: Path = arguments.output
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"DIR: expected a folder, found the file {str(folder)!r}")
    if not folder.parent.is_dir():
        raise UsageError(f"DIR: expected a folder in an existing one, found {str(folder)!r}")
    prepared = load_scene(arguments.scene, arguments.scenes_folder)
    folder.mkdir(exist_ok=True)
    renderer = ready_renderer(arguments.threads)

    from renderer.accuracy.machine import this_machine
    from renderer.acuity_comparison import compare_models
    from renderer.paper.rays import CASES, count_all
    from renderer.paper.timing import QUALITIES, compare_times
    from renderer.workers import WorkerPool

    pool = WorkerPool(renderer.threads)
    with counting("counting rays", len(CASES)) as tick:
        counts = count_all(pool, tick)
    models = compare_models(display, gaze, replace(published.OUR_QUALITY, samples_per_cell=samples), pool)
    pool.close()
    with counting(f"rendering {arguments.scene}", repeats * len(QUALITIES)) as tick:
        times = compare_times(renderer, prepared, display, gaze, samples, repeats, tick)
    renderer.close()
    record: dict[str, Any] = {
        "version": metadata.version("gazetrace"),
        "command": shlex.join(["gazetrace", *sys.argv[1:]]),
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": asdict(this_machine(renderer.threads)),
        "source": published.SOURCE,
        "complete": samples >= published.SAMPLES_PER_CELL and repeats >= DEFAULT_REPEATS,
        "rays": rays_record(counts),
        "time": time_record(arguments.scene, times),
        "models": models_record(models),
    }
    record["differences"] = differences(record)
    text = json.dumps(record, indent=2)
    write_whole(folder / "figures.json", text.encode() + b"\n")
    write_whole(folder / "figures.txt", figures_text(record).encode() + b"\n")
    if can_plot():
        _draw_page(folder, record, times, models)
    print(text if arguments.json else figures_text(record))
    if not can_plot():
        print(f"gazetrace: note: figures and page are left out; they want {WANTED}", file=sys.stderr)
    return OK


def _effort(arguments: argparse.Namespace) -> tuple[int, int]:
    """Rays a cell and repeats that the flags ask for.

    Raises:
        UsageError: for repeats out of range.
    """
    samples = QUICK_SAMPLES if arguments.quick else published.SAMPLES_PER_CELL
    repeats = 1 if arguments.quick else DEFAULT_REPEATS
    samples = samples if arguments.samples is None else arguments.samples
    repeats = repeats if arguments.repeats is None else arguments.repeats
    if not 1 <= repeats <= MOST_REPEATS:
        raise UsageError(f"--repeats: expected an integer from 1 to {MOST_REPEATS}, found {repeats}")
    return samples, repeats


def _view(pixels: tuple[int, int], samples: int) -> tuple[Display, Gaze]:
    """The paper's screen with other pixels, and the gaze at the same place of it.

    Raises:
        UsageError: naming the flag whose value is out of range.
    """
    screen, gaze = published.SCREEN, published.OFF_CENTRE_GAZE
    try:
        replace(published.QUALITY, samples_per_cell=samples)
        display = replace(screen, width_px=pixels[0], height_px=pixels[1])
    except SettingsError as error:
        flags = {"quality.samples_per_cell": "--samples", "display": "--size"}
        raise blame_flag(error, flags) from error
    x, y = gaze.x * display.width_px / screen.width_px, gaze.y * display.height_px / screen.height_px
    return display, Gaze(x, y)


def _draw_page(folder: Path, record: dict[str, Any], times: TimeComparison, models: Sequence[ModelCost]) -> None:
    """Draw the figures and put everything on one page."""
    from clients.command_line.figures_drawing import FIGURES, draw_figures
    from clients.report.paper_page import paper_page

    with counting("drawing", FIGURES) as tick:
        figures = draw_figures(folder, times, models, tick)
    write_whole(folder / "figures.html", paper_page(record, figures).encode())
