"""The long forms: `python -m tests.load` (many viewers) and `python -m tests.load soak` (one, for long)."""

from __future__ import annotations

import argparse
import asyncio
import csv
from dataclasses import asdict
from pathlib import Path

from clients.gaze_trace import read_gaze_trace
from clients.simulated_gaze import simulated_gaze
from tests.load.soak import Held, soak
from tests.load.viewers import load
from tests.service.process import service_process

RECORDED_PX = (1920, 1080)
"""The screen that recordings are of."""

SIMULATED_S = 60.0
"""Of made-up gaze, before it begins again."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.load", description=__doc__)
    parser.add_argument("what", nargs="?", default="viewers", choices=("viewers", "soak"))
    parser.add_argument("--minutes", type=float, help="for how long (default 10, of a soak 60)")
    many = parser.add_argument_group("viewers")
    many.add_argument("--viewers", type=int, default=100, help="at once (default %(default)s)")
    many.add_argument("--sessions", type=int, default=20, help="they are spread over (default %(default)s)")
    one = parser.add_argument_group("soak")
    one.add_argument("--gaze-trace", type=Path, help="a recording, of a screen of 1920x1080 (default: made up)")
    one.add_argument("--scene", default="atrium", help="default %(default)s")
    one.add_argument("--size", default="640x360", help="of the screen (default %(default)s)")
    one.add_argument("-o", type=Path, dest="output", help="write what was held, every two seconds, as CSV")
    asked = parser.parse_args()
    if asked.what == "viewers":
        hold_viewers(asked.viewers, asked.sessions, 60 * (asked.minutes or 10))
    else:
        width_px, height_px = map(int, asked.size.split("x"))
        soak_stream(asked.gaze_trace, asked.scene, (width_px, height_px), 60 * (asked.minutes or 60), asked.output)


def hold_viewers(viewers: int, sessions: int, seconds: float) -> None:
    flags = ("--max-sessions", str(sessions), "--max-viewers", str(viewers))
    with service_process(*flags) as service:
        found = load(service, viewers, sessions, seconds)
    rate = found.frames.total() / found.seconds
    print(f"frames    {rate:.0f} a second to {viewers} viewers of {sessions} sessions")
    print(f"share     the session with the fewest frames had {found.least_share:.2f} of the mean")
    print(
        f"requests  a 64x36 frame over HTTP took {found.request_at(0.5):.0f} ms (median), "
        f"{found.request_at(0.99):.0f} ms (99 %), of {len(found.request_ms)}"
    )
    print(f"memory    {found.memory_mib[0]:.0f} MiB after the warm-up, then {found.memory_growth_mib:+.1f} MiB")
    print(f"          {found.growth} (frames)")
    print(f"files     {min(found.descriptors)} to {max(found.descriptors)}")
    print(f"threads   {min(found.threads)} to {max(found.threads)}")
    print(f"lost      {len(found.lost)} connections or requests {found.lost[:3] or ''}")


def soak_stream(
    recording: Path | None, scene: str, size_px: tuple[int, int], seconds: float, output: Path | None
) -> None:
    trace = simulated_gaze(SIMULATED_S) if recording is None else read_gaze_trace(recording)
    trace = trace.on_screen(*size_px, RECORDED_PX)
    with service_process() as service:
        found = asyncio.run(soak(service, scene, size_px, trace, seconds, lambda line: print(line, flush=True)))
    if output is not None:
        with output.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(Held.__slots__))
            writer.writeheader()
            writer.writerows(asdict(each) for each in found.series)
    print(found.verdict())


if __name__ == "__main__":
    main()
