"""Rows of a long stream: what memory the service takes, and whether it grows."""

from __future__ import annotations

import asyncio
from dataclasses import asdict
from pathlib import Path

from clients.command_line.benchmark.job import Job
from clients.command_line.benchmark.row import Row, measured_row, missing_row
from clients.command_line.own_service import OwnService, own_service_process
from clients.display import Display

FLAT_AIM = 1.05
"""Memory at the end of a stream over that half way through."""

STRIDE = (0.7548776662466927, 0.5698402909980532)
"""Shares of the screen between a gaze and the next: they cover it evenly and are far apart (Roberts 2018, R2)."""

KIB_PER_MIB = 1024.0


def memory_mib(process: int, what: str = "VmRSS") -> float | None:
    """Memory that a process holds now (`VmRSS`) or held at most (`VmHWM`) [MiB]; None where Linux does not tell."""
    status = Path(f"/proc/{process}/status")
    if not status.exists():
        return None
    lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
    return int(lines[what].split()[0]) / KIB_PER_MIB


def stream_rows(job: Job) -> tuple[Row, ...]:
    """Memory of a service of its own that streams the frame to one viewer whose gaze moves."""
    with own_service_process(job.service_flags, {}) as service:
        held = asyncio.run(_watched(service, job))
        peak = memory_mib(service.process, "VmHWM")
    what = "memory of the service at most"
    if peak is None:
        return (missing_row("memory", what, "needs /proc, as Linux has it"),)
    note = f"streams {job.stream_frames} JPEG frames, a new gaze for each"
    growth = held[-1] / held[len(held) // 2]
    return (
        measured_row("memory", what, [peak], "MiB", note=note),
        measured_row("memory", "memory at the end / half way", [growth], aim=FLAT_AIM, note=f"{held[-1]:,.0f} MiB"),
    )


async def _watched(service: OwnService, job: Job) -> list[float]:
    """Memory after each frame [MiB]; zeros where it is not told."""
    held = []
    async with Display(service.url) as display:
        await display.configure(
            job.scene,
            display=asdict(job.request.display),
            quality=asdict(job.request.quality),
            format="jpeg",
        )
        await display.next_frame(decode=False)
        for number in range(1, job.stream_frames + 1):
            display.look_at(number * STRIDE[0] % 1.0, number * STRIDE[1] % 1.0, "fraction")
            await display.next_frame(decode=False)
            held.append(memory_mib(service.process) or 0.0)
    return held
