"""`gazetrace serve` as a process of its own: its address, its log, and what it holds of the machine."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from tests.service.conftest import PATIENCE_S

SERVES = "gazetrace serves on "


class ServiceProcess:
    """A service that runs; what it says is kept in `lines`.

    Attributes:
        address: its URL.
        lines: of standard output and, unless it goes elsewhere, of standard error.
    """

    def __init__(self, *flags: str, stderr: int | IO[bytes] = subprocess.STDOUT, **variables: str) -> None:
        self.lines: list[str] = []
        self.address = ""
        self._ready = threading.Event()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "clients.command_line", "serve", "--port", "0", *flags],
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            env={**os.environ, **variables},
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def wait_ready(self) -> None:
        """Return when it renders."""
        assert self._ready.wait(PATIENCE_S), self.lines
        assert any(line.startswith("ready in ") for line in self.lines), self.lines

    def signal(self, number: signal.Signals) -> None:
        """Send one to the process that was started."""
        self._process.send_signal(number)

    def ended(self) -> int:
        """Its exit status, once it has ended."""
        status = self._process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        return status

    def stop(self) -> None:
        """End it, by force if need be."""
        self._process.terminate()
        try:
            self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._reader.join(PATIENCE_S)
        assert self._process.stdout is not None
        self._process.stdout.close()

    @property
    def pid(self) -> int:
        """The process that works: the one that was started looks after it."""
        main = self._process.pid
        return int(Path(f"/proc/{main}/task/{main}/children").read_text().split()[0])

    @property
    def children(self) -> list[int]:
        """Processes that it has started and that have not ended."""
        lists = [(task / "children").read_text().split() for task in self._proc("task").iterdir()]
        return [int(child) for children in lists for child in children]

    @property
    def address_space_bytes(self) -> int:
        """All that it has mapped, in use or not."""
        return int(self._proc("statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")

    @property
    def resident_bytes(self) -> int:
        """Memory of it that is in use."""
        pages = int(self._proc("statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")

    @property
    def peak_bytes(self) -> int:
        """Most memory of it that was ever in use."""
        lines = dict(line.split(":", 1) for line in self._proc("status").read_text().splitlines())
        return int(lines["VmHWM"].split()[0]) << 10

    @property
    def descriptors(self) -> int:
        """Open files and sockets."""
        return len(list(self._proc("fd").iterdir()))

    @property
    def threads(self) -> int:
        return len(list(self._proc("task").iterdir()))

    def _proc(self, name: str) -> Path:
        return Path("/proc", str(self.pid), name)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip())
            if line.startswith(SERVES):
                self.address = line.removeprefix(SERVES).strip()
            if line.startswith("ready in "):
                self._ready.set()
        self._ready.set()


@contextmanager
def service_process(
    *flags: str, stderr: int | IO[bytes] = subprocess.STDOUT, **variables: str
) -> Iterator[ServiceProcess]:
    """`gazetrace serve` with these flags and variables, once it renders; ended with the block."""
    service = ServiceProcess(*flags, stderr=stderr, **variables)
    try:
        service.wait_ready()
        yield service
    finally:
        service.stop()
