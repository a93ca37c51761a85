"""One stream for long, of a gaze that is played over and over.

What the service holds is looked at every few seconds; after a quarter of the time a line is fitted to its memory,
beside what it says that it keeps, over the frames that it has rendered.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import httpx

from clients.display import Display
from clients.gaze_trace import GazeTrace
from tests.load.growth import BLOCKS, Growth, growth_of
from tests.load.kept import kept_bytes
from tests.service.conftest import PATIENCE_S
from tests.service.process import ServiceProcess

RATE_HZ = 60.0
"""Gazes a second."""

WARM_UP_SHARE = 0.25

LOOK_S = 2.0
"""Between two looks at what the service holds, at most."""

TELL_S = 60.0

MORE_DESCRIPTORS = 2
MORE_THREADS = 2
"""What may come and go: a connection that closes, a thread of a pool that begins late."""


@dataclass(frozen=True, slots=True)
class Held:
    """What the service holds at a moment.

    Attributes:
        seconds: since the stream's first frame.
        frames: rendered by then.
        memory_bytes: resident.
        kept_bytes: of that, what the service says that it keeps.
        descriptors, threads: of the process.
    """

    seconds: float
    frames: int
    memory_bytes: int
    kept_bytes: int
    descriptors: int
    threads: int


@dataclass
class Soak:
    """What was seen of a stream.

    Attributes:
        series: over the whole time.
        connections: how often the stream was opened: once, unless something broke it.
        rejected: samples that were no light.
    """

    series: list[Held] = field(default_factory=list)
    connections: int = 0
    rejected: int = 0

    @property
    def settled(self) -> list[Held]:
        """The series after the warm-up."""
        return [each for each in self.series if each.seconds >= WARM_UP_SHARE * self.series[-1].seconds]

    @property
    def growth(self) -> Growth:
        """Of the memory beside what is kept, after the warm-up."""
        besides = [each.memory_bytes - each.kept_bytes for each in self.settled]
        return growth_of([each.frames for each in self.settled], besides)

    def verdict(self) -> str:
        """The figures; raises AssertionError unless the stream held and nothing grew."""
        settled, last = self.settled, self.series[-1]
        descriptors = [each.descriptors for each in settled]
        threads = [each.threads for each in settled]
        memory = sorted(each.memory_bytes >> 20 for each in settled)
        figures = (
            f"frames    {last.frames:,} in {last.seconds / 60:.1f} minutes over {self.connections} connection(s)\n"
            f"memory    {self.growth} (frames)\n"
            f"          {memory[0]} to {memory[-1]} MiB after the warm-up\n"
            f"files     {min(descriptors)} to {max(descriptors)}\n"
            f"threads   {min(threads)} to {max(threads)}\n"
            f"rejected  {self.rejected} samples"
        )
        assert self.connections == 1, figures
        assert self.growth.flat, figures
        assert descriptors[-1] <= descriptors[0] + MORE_DESCRIPTORS, figures
        assert threads[-1] <= threads[0] + MORE_THREADS, figures
        assert not self.rejected, figures
        return figures


async def soak(
    service: ServiceProcess,
    scene: str,
    size_px: tuple[int, int],
    trace: GazeTrace,
    seconds: float,
    tell: Callable[[str], None],
) -> Soak:
    """Stream `scene` for so long to one viewer, whose gaze is `trace` over and over.

    Args:
        service: watched.
        scene: its id.
        size_px: of the screen.
        trace: in pixels of that screen, or in fractions.
        seconds: how long, from the first frame on.
        tell: receives a line a minute.
    """
    found = Soak()
    every_s = min(seconds / (4 * BLOCKS), LOOK_S)
    asking = httpx.AsyncClient(base_url=service.address, timeout=PATIENCE_S, trust_env=False)
    async with asking as client, Display(service.address) as display:
        await display.configure(
            scene,
            display={"width_px": size_px[0], "height_px": size_px[1]},
            quality={"samples_per_cell": 4},
            format="jpeg",
        )
        looking = asyncio.create_task(_look(display, trace))
        try:
            rendered = (await display.next_frame(decode=False)).header.frame
            began, looked, told = time.monotonic(), 0.0, 0.0
            while looked < seconds:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(every_s):
                        rendered = (await display.next_frame(decode=False)).header.frame
                now = time.monotonic() - began
                if now >= looked + every_s:
                    looked = now
                    found.series.append(_held(service, now, rendered, await kept_bytes(client)))
                if now >= told + TELL_S:
                    told = now
                    tell(_line(found.series[-1]))
        finally:
            looking.cancel()
        found.connections = display.connections
        found.rejected = 0 if display.status is None else display.status.rejected
    return found


async def _look(display: Display, trace: GazeTrace) -> None:
    """Play the gaze for ever; one whose time has passed while we were busy is sent at once."""
    while True:
        began = time.monotonic()
        for at_s, sample in trace.played(RATE_HZ):
            await asyncio.sleep(max(0.0, began + at_s - time.monotonic()))
            if sample.valid:
                display.look_at(sample.x, sample.y, "fraction" if trace.unit == "fraction" else "px")
            else:
                display.look_away()


def _held(service: ServiceProcess, seconds: float, frames: int, kept: int) -> Held:
    return Held(seconds, frames, service.resident_bytes, kept, service.descriptors, service.threads)


def _line(held: Held) -> str:
    return (
        f"{held.seconds / 60:6.1f} min  {held.frames:8,} frames  {held.memory_bytes / (1 << 20):7.1f} MiB, "
        f"{held.kept_bytes / (1 << 20):.1f} kept  "
        f"{held.descriptors} files  {held.threads} threads"
    )
