"""Which rows there are, and those that are asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from clients.command_line.benchmark.frame_rows import frame_rows, sample_rows, thread_rows
from clients.command_line.benchmark.job import Job
from clients.command_line.benchmark.peer_rows import peer_rows
from clients.command_line.benchmark.row import Row
from clients.command_line.benchmark.screen_rows import paper_rows, screen_rows
from clients.command_line.benchmark.stage_rows import stage_rows
from clients.command_line.benchmark.stream_rows import stream_rows

GROUPS: Mapping[str, Callable[[Job], tuple[Row, ...]]] = MappingProxyType(
    {
        "frame": frame_rows,
        "stages": stage_rows,
        "samples": sample_rows,
        "paper": paper_rows,
        "pixels": screen_rows,
        "threads": thread_rows,
        "peers": peer_rows,
        "memory": stream_rows,
    }
)
"""What measures each group of rows, in the order of the table."""
