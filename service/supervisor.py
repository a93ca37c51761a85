"""The service kept running: it works in a process of its own, which is started again if native code brings it down.

The socket belongs to the process here, so that clients who connect meanwhile wait instead of being refused.
"""

from __future__ import annotations

import mmap
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from service.crash_record import CrashRecord, Past
from service.listener import address_of, listen
from service.settings import Settings
from service.work_notes import WorkNotes

PACKAGES = Path(__file__).parents[1]

GRACE_S = 10.0
"""How long a service that was told to stop may take before it is ended by force [s]."""

FIRST_PAUSE_S = 0.25
LONGEST_PAUSE_S = 30.0
"""Before a service is started again; the pause doubles with each crash [s]."""

STEADY_S = 60.0
"""A service that ran for so long before it crashed is started again after the first pause [s]."""


def serve(settings: Settings, announce: Callable[[str], None], *, debug: bool = False) -> None:
    """Serve until stopped (Ctrl-C or SIGTERM), in a process of its own. Call from the main thread.

    Args:
        settings: address, limits and access.
        announce: receives lines for people: the address, how to ask for a frame. Its process writes on
            standard output when it is ready.
        debug: say on standard error why a request was refused.

    Raises:
        SettingsError: if the address cannot be listened on.
        SystemExit: with the status of the process, if it ended otherwise than by a crash.
    """
    with listen(settings) as listener:
        address = address_of(settings, listener)
        announce(f"gazetrace serves on {address}")
        token = ' -H "Authorization: Bearer $GAZETRACE_TOKEN"' if settings.token is not None else ""
        announce(f"a page to look with: {address}/    the API: {address}/docs    a frame:")
        announce(f'curl{token} -o frame.png "{address}/v1/scenes/spheres/frame?gaze_x=0.5&gaze_y=0.5&unit=fraction"')
        stopped_by = _Supervisor(settings, listener, debug).run()
    if stopped_by is signal.SIGINT:
        announce("stopped")
    elif stopped_by is not None:
        signal.raise_signal(stopped_by)


class _Supervisor:
    """Starts the process of a service, and starts it again."""

    def __init__(self, settings: Settings, listener: socket.socket, debug: bool) -> None:
        self._settings = settings
        self._listener = listener
        self._debug = debug
        self._stopped_by: signal.Signals | None = None
        self._stop = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None

    def run(self) -> signal.Signals | None:
        """Return when the service has ended: the signal that stopped it."""
        record, pause_s = CrashRecord(self._settings.max_scene_crashes), FIRST_PAUSE_S
        with self._hearing_signals():
            while not self._stop.is_set():
                began = time.monotonic()
                with _shared_memory(WorkNotes.size(record.past.told)) as (memory, descriptor):
                    status = self._run(record.past, descriptor)
                    notes = WorkNotes(memory, record.past.told)
                    at_work, done = notes.at_work(), notes.done()
                if self._stop.is_set():
                    break
                if status >= 0:
                    raise SystemExit(status)
                pause_s = FIRST_PAUSE_S if time.monotonic() - began > STEADY_S else pause_s
                record.crashed(_signal_name(-status), at_work, done)
                self._stop.wait(pause_s)
                pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
        return self._stopped_by

    def _run(self, past: Past, notes: int) -> int:
        """The status with which a process ended that was told of those before it."""
        with self._start(notes) as process:
            self._process = process
            if self._stop.is_set():
                self._end(process)
            assert process.stdin is not None
            with suppress(BrokenPipeError):
                process.stdin.write(past.to_line())
                process.stdin.flush()
            return process.wait()

    def _start(self, notes: int) -> subprocess.Popen[bytes]:
        """The process; it reads its standard input until that ends, and ends with it.

        In a process group of its own: Ctrl-C in a terminal then reaches it once, from here.
        """
        words = [sys.executable, "-P", "-m", "service", str(self._listener.fileno()), str(notes)]
        path = os.pathsep.join(filter(None, (str(PACKAGES), os.environ.get("PYTHONPATH"))))
        return subprocess.Popen(
            [*words, *(["--debug"] if self._debug else [])],
            env={**os.environ, **self._settings.to_environment(), "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            pass_fds=[self._listener.fileno(), notes],
            process_group=0,
        )

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        process.send_signal(signal.SIGTERM)
        force = threading.Timer(GRACE_S, process.kill)
        force.daemon = True
        force.start()

    @contextmanager
    def _hearing_signals(self) -> Iterator[None]:
        """Pass on that the service is to stop."""

        def hear(number: int, _: FrameType | None) -> None:
            self._stopped_by = signal.Signals(number)
            self._stop.set()
            if self._process is not None:
                self._end(self._process)

        before = {number: signal.signal(number, hear) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


@contextmanager
def _shared_memory(nbytes: int) -> Iterator[tuple[mmap.mmap, int]]:
    """Memory of no file, all zero, and a descriptor by which a process started here shares it."""
    descriptor = os.memfd_create("gazetrace-notes")
    try:
        os.ftruncate(descriptor, nbytes)
        with mmap.mmap(descriptor, nbytes) as memory:
            yield memory, descriptor
    finally:
        os.close(descriptor)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
