"""`gazetrace simulate`: how far frames would scale over the nodes of a cluster."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from clients.command_line.errors import OK, UsageError, blame_flag
from clients.command_line.frame_flags import FLAG_OF_FIELD, screen_cm, size
from clients.command_line.progress import counting
from clients.command_line.scaling.rates import Machine, Rates, read_rates
from clients.report.plotting import can_plot
from renderer.display import Display
from renderer.errors import SettingsError
from renderer.quality import Quality

DESCRIPTION = """\
Simulate a cluster of 2 to 1,000 nodes: one large display, whose frames all nodes trace together, and many viewers, each
with a session of their own. It says how long frames take, how many a viewer gets, and what keeps it from being faster.

Cells are counted with the real cell map; times are simulated from rates measured on one machine (README.md says how;
--rates takes your own). Nothing is rendered, and no cluster is needed. Written to DIR: simulation.json, and with the
extra 'report' simulation.png and .svg."""

EXAMPLES = """\
examples:
  gazetrace simulate -o simulation
      A wall of 15360x8640 at 60 Hz and 1,000 viewers, on nodes of 32 cores and 25 Gbit/s.

  gazetrace simulate --size 3840x2160 --screen-cm 120 --distance-cm 80 --cores 8 --gbit 10 --json
      A desk with a 4K screen and smaller nodes.

  gazetrace simulate --rates lab.json --viewers 30 --rate 30 --nodes 1,2,4,8
      With rates of your own, {"samples_per_s": 2.5e6}, for a lab of 30."""

NODES = (2, 4, 8, 16, 32, 64, 128, 250, 500, 1000)
MOST_NODES = 10_000
MOST_VIEWERS = 1_000_000
MOST_RATE_HZ = 1000.0
MOST_CORES = 4096
MOST_GBIT = 1e5
FINE_SAMPLES = 64
EVERY, MOVED, FINE = "every cell", "after a move of the gaze", f"every cell, {FINE_SAMPLES} samples"
WALL_PX, WALL_CM, WALL_DISTANCE_CM = (15360, 8640), (600.0, 337.5), 250.0


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "simulate",
        help="how far frames would scale over the nodes of a cluster",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for what is made, created if need be")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--rates", type=Path, metavar="FILE", help="rates of your own, a JSON object")
    parser.add_argument(
        "--nodes", type=node_counts, default=NODES, metavar="A,B", help="numbers of nodes (2,4,8, ... 1000)"
    )
    machine = parser.add_argument_group("each node")
    machine.add_argument("--cores", type=int, default=Machine().cores, metavar="N", help="(default %(default)s)")
    machine.add_argument(
        "--gbit", type=float, default=Machine().gbit_per_s, metavar="N", help="of its network (default %(default)s)"
    )
    what = parser.add_argument_group("what is shown")
    what.add_argument("--size", type=size, default=WALL_PX, metavar="WxH", help="pixels of the display (15360x8640)")
    what.add_argument("--screen-cm", type=screen_cm, default=WALL_CM, metavar="WxH", help="its size (600x337.5)")
    what.add_argument(
        "--distance-cm", type=float, default=WALL_DISTANCE_CM, metavar="D", help="from the eye (default %(default)s)"
    )
    what.add_argument("--samples", type=int, default=1, metavar="N", help="of a cell (default %(default)s)")
    what.add_argument("--rate", type=float, default=60.0, metavar="HZ", help="frames a second (default %(default)s)")
    what.add_argument(
        "--viewers", type=int, default=1000, metavar="N", help="with a screen of 1920x1080 each (default %(default)s)"
    )
    parser.set_defaults(run=run)


def node_counts(text: str) -> tuple[int, ...]:
    """Read `2,4,8`: rising."""
    expected = f"expected rising numbers from 1 to {MOST_NODES:,} such as 2,4,8, found {text!r}"
    try:
        counts = tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(expected) from None
    if not (counts[0] >= 1 and counts[-1] <= MOST_NODES and list(counts) == sorted(set(counts))):
        raise argparse.ArgumentTypeError(expected)
    return counts


def run(arguments: argparse.Namespace) -> int:
    """Count, simulate, draw and print."""
    for flag, value, most in (
        ("--cores", arguments.cores, MOST_CORES),
        ("--gbit", arguments.gbit, MOST_GBIT),
        ("--rate", arguments.rate, MOST_RATE_HZ),
        ("--viewers", arguments.viewers, MOST_VIEWERS),
    ):
        if not 0 < value <= most:
            raise UsageError(f"{flag}: expected a number above 0, to {most:,g}, found {value:g}")
    (width_px, height_px), (width_cm, height_cm) = arguments.size, arguments.screen_cm
    try:
        display = Display(width_px, height_px, width_cm, height_cm, arguments.distance_cm)
        quality = Quality(samples_per_cell=arguments.samples)
    except SettingsError as error:
        raise blame_flag(error, FLAG_OF_FIELD) from error
    rates = Rates() if arguments.rates is None else read_rates(arguments.rates)
    folder: Path | None = arguments.output
    if folder is not None and not folder.parent.is_dir():
        raise UsageError(f"--output: expected a folder in an existing one, found {str(folder)!r}")
    record = simulated(display, quality, rates, Machine(arguments.cores, arguments.gbit), arguments)
    text = json.dumps(record, indent=2)
    if folder is not None:
        folder.mkdir(exist_ok=True)
        (folder / "simulation.json").write_text(text + "\n")
        if can_plot():
            from clients.report.scaling_plot import draw_scaling

            draw_scaling(record, folder / "simulation")
    print(text if arguments.json else scaling_text(record))
    return OK


def simulated(
    display: Display, quality: Quality, rates: Rates, machine: Machine, arguments: argparse.Namespace
) -> dict[str, Any]:
    """Everything that was found, as simulation.json has it."""
    from clients.command_line.scaling.study import display_record, moving_work, viewers_record
    from renderer.workers import WorkerPool

    nodes: Sequence[int] = arguments.nodes
    screen = Display()
    pool = WorkerPool(None)
    (every, moved), (their_every, their_moved) = (moving_work(one, quality, pool) for one in (display, screen))
    pool.close()
    works = {EVERY: every, MOVED: moved, FINE: replace(every, samples=FINE_SAMPLES)}
    with counting("simulating", len(works) * len(nodes)) as tick:
        frames = [display_record(name, work, rates, machine, nodes, tick) for name, work in works.items()]
    viewers = [
        viewers_record(name, work, arguments.viewers, arguments.rate, rates, machine, nodes)
        for name, work in ((EVERY, their_every), (MOVED, their_moved))
    ]
    return {
        "rates": asdict(rates),
        "machine": asdict(machine),
        "display": {**asdict(display), "rate_hz": arguments.rate, "frames": frames},
        "viewers": {**asdict(screen), "count": arguments.viewers, "rate_hz": arguments.rate, "frames": viewers},
    }


def scaling_text(record: dict[str, Any]) -> str:
    """What was found, for people."""
    display, viewers, machine = record["display"], record["viewers"], record["machine"]
    lines = [
        f"simulated: nodes of {machine['cores']} cores and {machine['gbit_per_s']:g} Gbit/s, and one for the service"
    ]
    for frame in display["frames"]:
        lines += [
            "",
            f"one display of {display['width_px']}x{display['height_px']}, {frame['name']}: {frame['cells']:,} cells",
            "  nodes   frame [ms]   by itself:  workers   picture    encode    thread      wire",
        ]
        for point in frame["points"]:
            bound = [1e3 * point["bounds_s"][name] for name in ("trace", "picture", "encode", "hand", "wire")]
            times = "".join(f"{time:>10,.1f}" for time in bound)
            lines.append(f"{point['nodes']:>7,}{1e3 * point['frame_s']:>13,.1f}           {times}")
    for frame in viewers["frames"]:
        lines += [
            "",
            f"{viewers['count']:,} viewers of {viewers['width_px']}x{viewers['height_px']}, {frame['name']}: "
            f"{frame['cells']:,} cells, frames a second each",
            "  nodes  one service  its busiest part, in use   a service on each node",
        ]
        for point in frame["points"]:
            one, each, use = point["one_service_hz"], point["service_each_hz"], 100 * point["use"]
            lines.append(f"{point['nodes']:>7,}{one:>13.2f}  {point['busiest']:<22} {use:>3.0f} %{each:>14.2f}")
    return "\n".join(lines)
