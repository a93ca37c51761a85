"""`gazetrace watch`: a display client without a screen, that says how long frames take to follow the eye."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final, cast

from clients.command_line.errors import FAILED, OK, CommandFailed, UsageError
from clients.command_line.frame_flags import add_frame_flags, camera_changes, frame_request
from clients.command_line.gaze_trace_flags import Playback, add_gaze_trace_flags, playback_of
from clients.command_line.progress import counting
from clients.command_line.render import add_threads, check_threads
from clients.command_line.scene_argument import add_scenes_folder
from renderer.camera import Camera

if TYPE_CHECKING:
    from clients.display import Display
    from clients.latency import LatencyLog
    from service.protocol import EyePhase

DESCRIPTION = """\
Play a gaze back to a service, as a display with an eye tracker would, take in its frames, and say how long each took
from gaze to decoded picture, and where the time went.

Without --url it starts a service of its own. A frame counts when it is the first to show a newer gaze; those that
only add samples do not."""

EXAMPLES = """\
examples:
  gazetrace watch atrium --gaze-trace simulated
      Ten seconds of a simulated eye at 1920x1080, against a service of its own.

  gazetrace watch atrium --gaze-trace eye.csv --rate 120 --budget-ms p95=70 --json
      A recorded eye, 120 gazes a second; exit status 1 if one frame in twenty takes longer than 70 ms.

  gazetrace watch spheres --gaze-trace simulated --url http://lab:8321 --seconds 60 --size 1280x720
      Against a service that runs already; GAZETRACE_TOKEN holds its token."""

DEFAULT_SCENE: Final = "atrium"
DEFAULT_RATE_HZ: Final = 60.0
MOST_RATE_HZ: Final = 2000.0
FORMATS: Final = ("jpeg", "webp", "png", "raw")
BUDGETS: Final = ("p50", "p95", "p99", "max")
PATIENCE_S: Final = 10.0
"""How long to look for a service [s]."""

PHASE_OF_EVENT: Final = {"fixation": "fixation", "saccade": "saccade", "pursuit": "pursuit", "blink": "blink"}
"""What a trace's event is called on the wire; others are not told."""


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "watch",
        help="measure how fast frames follow the eye",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="SCENE", help="id of a scene (default %(default)s)"
    )
    parser.add_argument("--url", metavar="URL", help="a service that runs already, such as http://127.0.0.1:8321")
    parser.add_argument("--session", metavar="NAME", help="session to create or join (default: one's own)")
    add_gaze_trace_flags(parser)
    parser.add_argument(
        "--rate", type=float, default=DEFAULT_RATE_HZ, metavar="HZ", help="gazes sent a second (default %(default)g)"
    )
    parser.add_argument("--no-phases", action="store_true", help="do not tell the service of saccades in the trace")
    add_frame_flags(parser, gaze=False)
    stream = parser.add_argument_group("stream")
    stream.add_argument("--format", default=FORMATS[0], choices=FORMATS, help="of the frames (default %(default)s)")
    stream.add_argument("--image-quality", type=int, metavar="N", help="of JPEG and WebP, 1 to 100")
    stream.add_argument("--no-decode", action="store_true", help="a frame is there when it has come in")
    stream.add_argument(
        "--budget-ms",
        action="append",
        default=[],
        type=budget,
        metavar="P=MS",
        help="exit with status 1 past it: p95=70; p50, p95, p99 or max; may be repeated",
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    add_threads(parser)
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Watch, print the report, compare it with the budget."""
    check_threads(arguments.threads)
    frame_request(arguments, Camera())  # complain about a flag before a service takes seconds to start
    if not 0 < arguments.rate <= MOST_RATE_HZ:
        raise UsageError(f"--rate: expected a number in (0, {MOST_RATE_HZ:g}], found {arguments.rate:g}")
    playback = playback_of(arguments)
    from clients.command_line.watch_text import watch_record, watch_text

    with _service(arguments) as url:
        log, seconds = _watched(url, arguments, playback)
    width_px, height_px = arguments.size
    record = {
        "scene": arguments.scene,
        "width": width_px,
        "height": height_px,
        "format": arguments.format,
        "gazes_a_second": arguments.rate,
        "seconds": round(seconds, 3),
        **watch_record(log),
    }
    print(json.dumps(record, indent=2) if arguments.json else watch_text(record))
    return _compared(record["latency_ms"]["total"], dict(arguments.budget_ms))


def budget(text: str) -> tuple[str, float]:
    """Read `p95=70`."""
    found = re.fullmatch(r"(\w+)=(\d+(?:\.\d+)?)", text)
    if found is None or found[1] not in BUDGETS:
        expected = f"one of {', '.join(BUDGETS)} and milliseconds, such as p95=70"
        raise argparse.ArgumentTypeError(f"expected {expected}, found {text!r}")
    return found[1], float(found[2])


@contextlib.contextmanager
def _service(arguments: argparse.Namespace) -> Iterator[str]:
    """The service to watch."""
    stated = {"--threads": arguments.threads, "--scenes-folder": arguments.scenes_folder}
    flags = [word for flag, value in stated.items() if value is not None for word in (flag, str(value))]
    if arguments.url is not None:
        if arguments.threads is not None:
            raise UsageError("--threads: expected no --url, as that service has threads of its own")
        yield arguments.url
        return
    from clients.command_line.own_service import own_service

    with own_service(flags) as url:
        yield url


def _watched(url: str, arguments: argparse.Namespace, playback: Playback) -> tuple[LatencyLog, float]:
    """What was seen, and for how long [s].

    Raises:
        UsageError: for what the service refuses.
        CommandFailed: if there is no service.
    """
    from clients.connection import ServiceGone, ServiceRefused
    from clients.display import Display

    token = os.environ.get("GAZETRACE_TOKEN") if arguments.url else None
    try:
        display = Display(url, token, arguments.session, PATIENCE_S)
    except ValueError as error:
        raise UsageError(f"--url: {error}") from error
    ticks = math.floor(playback.seconds * arguments.rate) + 1
    try:
        with counting(f"watching {arguments.scene}", ticks) as tick:
            return asyncio.run(_watch(display, arguments, playback, tick))
    except ServiceRefused as error:
        raise UsageError(error.message) from error
    except ServiceGone as error:
        raise CommandFailed(str(error)) from error


async def _watch(
    display: Display, arguments: argparse.Namespace, playback: Playback, tick: Callable[[], None]
) -> tuple[LatencyLog, float]:
    from clients.latency import LatencyLog

    async with display:
        await _configure(display, arguments, playback)
        await display.next_frame()  # by now the scene is loaded
        log = LatencyLog(time.monotonic_ns())
        taking = asyncio.create_task(_take(display, log, decode=not arguments.no_decode))
        replay = asyncio.create_task(_replay(display, log, arguments, playback, tick))
        await asyncio.wait((taking, replay), return_when=asyncio.FIRST_COMPLETED)
        seconds = (time.monotonic_ns() - log.began_ns) / 1e9
        for task in (taking, replay):
            task.cancel()
        for ended in await asyncio.gather(taking, replay, return_exceptions=True):
            if isinstance(ended, Exception):
                raise ended
    return log, seconds


async def _configure(display: Display, arguments: argparse.Namespace, playback: Playback) -> None:
    request = frame_request(arguments, Camera())
    first = playback.trace.held((request.display.width_px / 2, request.display.height_px / 2)).sample(0)
    ready = await display.configure(
        arguments.scene,
        gaze={"x": first.x, "y": first.y},
        display=asdict(request.display),
        quality=asdict(request.quality),
        format=arguments.format,
        image_quality=arguments.image_quality,
    )
    changes = camera_changes(arguments)
    if changes and ready.camera is not None:
        await display.change_camera({**ready.camera, **changes})


async def _replay(
    display: Display, log: LatencyLog, arguments: argparse.Namespace, playback: Playback, tick: Callable[[], None]
) -> None:
    """Send each gaze at its time; one whose time has passed while we were busy is sent at once."""
    began_s = time.monotonic()
    for at_s, sample in playback.trace.played(arguments.rate, playback.seconds):
        await asyncio.sleep(max(0.0, began_s + at_s - time.monotonic()))
        looked_ns = time.monotonic_ns()
        if sample.valid:
            phase = None if arguments.no_phases else PHASE_OF_EVENT.get(sample.event)
            seq = display.look_at(sample.x, sample.y, phase=cast("EyePhase | None", phase))
            log.looked(seq, looked_ns)
        else:
            display.look_away()
        tick()


async def _take(display: Display, log: LatencyLog, *, decode: bool) -> None:
    async for frame in display.frames(decode=decode):
        offset_ns = display.clock.offset_ns
        if offset_ns is not None:
            log.shown(frame, offset_ns)


def _compared(total_ms: dict[str, float], budgets: dict[str, float]) -> int:
    """The exit status; each budget that was missed is said."""
    missed = [name for name, most_ms in budgets.items() if total_ms[name] > most_ms]
    for name in missed:
        said = f"{name} from gaze to frame: expected at most {budgets[name]:g} ms, found {total_ms[name]:g} ms"
        print(f"gazetrace: {said}", file=sys.stderr)
    return FAILED if missed else OK
