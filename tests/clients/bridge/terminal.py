"""A tracker's end of a serial line: a pseudo-terminal that can be unplugged, and plugged in again by the same name."""

from __future__ import annotations

import os
import select
import tty
from pathlib import Path

PATIENCE_S = 20.0
"""Longest wait for anything."""


class Terminal:
    """Goes by the name `path` while it is plugged in."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._ends: tuple[int, ...] = ()

    def plug(self) -> None:
        master, slave = os.openpty()
        tty.setraw(master)
        tty.setraw(slave)
        self._ends = (master, slave)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(slave))

    def unplug(self) -> None:
        for end in self._ends:
            os.close(end)
        self._ends = ()
        self.path.unlink(missing_ok=True)

    def write(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._ends[0], data) :]

    def read(self, count: int) -> bytes:
        """So many bytes that the other side has sent."""
        data = b""
        while len(data) < count:
            assert select.select(self._ends[:1], (), (), PATIENCE_S)[0], f"only {data!r} came"
            data += os.read(self._ends[0], count - len(data))
        return data
