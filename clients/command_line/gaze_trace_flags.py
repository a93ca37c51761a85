"""The flags that say which gaze is played back: a recording, or the simulated eye."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from clients.command_line.errors import UsageError
from clients.command_line.frame_flags import size
from clients.gaze_trace import GazeTrace, read_gaze_trace

SIMULATED: Final = "simulated"
DEFAULT_SECONDS: Final = 10.0
"""How long the simulated eye looks unless told [s]."""

MAX_SECONDS: Final = 86_400.0
MAX_SEED: Final = 2**32 - 1


@dataclass(frozen=True, eq=False, slots=True)
class Playback:
    """A trace in pixels of the screen, and how long it is played."""

    trace: GazeTrace
    seconds: float


def add_gaze_trace_flags(
    parser: argparse.ArgumentParser,
    *,
    title: str = "gaze",
    required: bool = True,
    seconds: str = f"as long as the file, {DEFAULT_SECONDS:g} for {SIMULATED} gaze",
) -> None:
    """Add `--gaze-trace` and what belongs to it.

    Args:
        parser: of the command.
        title: of the group of flags.
        required: whether `--gaze-trace` must be given; None stands for it where it is not.
        seconds: what the default of `--seconds` is, for people.
    """
    gaze = parser.add_argument_group(title)
    gaze.add_argument(
        "--gaze-trace",
        required=required,
        metavar="FILE",
        help="CSV with columns t_ms, x_px, y_px and, if you like, valid and event (x_fraction and y_fraction are "
        f"shares of the screen); or the word {SIMULATED}: fixations, saccades and blinks made up",
    )
    gaze.add_argument(
        "--seconds",
        type=float,
        metavar="S",
        help=f"how long it is played (default: {seconds})",
    )
    gaze.add_argument(
        "--trace-size",
        type=size,
        metavar="WxH",
        help="the screen that pixels of the file are of, where it is not --size: gaze is scaled",
    )
    gaze.add_argument("--seed", type=int, default=0, metavar="N", help=f"another {SIMULATED} eye (default %(default)s)")


def playback_of(arguments: argparse.Namespace) -> Playback:
    """What the flags ask for, on the screen of `--size`.

    Raises:
        UsageError: naming the flag.
        GazeTraceError: for a file that cannot be read.
    """
    seconds: float | None = arguments.seconds
    if seconds is not None and not (0 < seconds <= MAX_SECONDS and math.isfinite(seconds)):
        raise UsageError(f"--seconds: expected a number in (0, {MAX_SECONDS:g}], found {seconds:g}")
    if not 0 <= arguments.seed <= MAX_SEED:
        raise UsageError(f"--seed: expected an integer from 0 to {MAX_SEED}, found {arguments.seed}")
    if arguments.trace_size is not None and 0 in arguments.trace_size:
        raise UsageError("--trace-size: expected sides of at least 1 pixel, found 0")
    if arguments.gaze_trace == SIMULATED:
        from clients.simulated_gaze import simulated_gaze

        trace = simulated_gaze(seconds or DEFAULT_SECONDS, arguments.seed)
    else:
        path = Path(arguments.gaze_trace)
        if not path.is_file():
            raise UsageError(f"--gaze-trace: expected a file or the word {SIMULATED}, found no file {str(path)!r}")
        trace = read_gaze_trace(path)
    width_px, height_px = arguments.size
    trace = trace.on_screen(width_px, height_px, arguments.trace_size)
    return Playback(trace, seconds or trace.seconds)
