"""The engine's process as seen from the service: started, listened to, and started again when it ends."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

SCENE, FORGET, ASK = "scene", "forget", "ask"
"""Messages to the engine: a packed scene and its key; a key; a job, a worker, a method, a key and a buffer (None for
the scene itself)."""

UP, START, JOINED, GONE, ANSWER, LOST, DOWN = "up", "start", "joined", "gone", "answer", "lost", "down"
"""Messages of the engine: it has joined the cluster; a worker is started, is ready, is gone; the answer to a job, or
that it has none since its worker was lost; why the engine ends."""

ADDRESS, THREADS, OBJECT_STORE_BYTES = "address", "threads", "object_store_bytes"
"""Options of the engine."""

LOCAL: Final = "local"
"""In place of an address: a cluster on this machine, which ends with the engine."""

DEFAULT_OBJECT_STORE_BYTES: Final = 512 << 20
"""Shared memory of a cluster on this machine, for scenes and pieces on their way [byte]."""

PAUSE_S: Final = 1.0
"""Before an engine that has ended is started again [s]."""

PACKAGES: Final = Path(__file__).parents[2]


class LinkDown(Exception):
    """There is no engine to send to."""


class Link:
    """Keeps an engine running. Every method may be called from any thread.

    Args:
        options: of the engine.
        heard: called with each of its messages, and with (DOWN, why) when it has ended, on one thread.
    """

    def __init__(self, options: dict[str, Any], heard: Callable[..., None]) -> None:
        self._options = options
        self._heard = heard
        self._lock = threading.Lock()
        self._channel: Connection | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="gazetrace-cluster", daemon=True)
        self._thread.start()

    def send(self, *message: Any) -> None:
        """Send a message to the engine.

        Raises:
            LinkDown: if there is none.
        """
        with self._lock:
            if self._channel is None:
                raise LinkDown
            try:
                self._channel.send(message)
            except OSError:
                raise LinkDown from None

    def close(self) -> None:
        """End the engine."""
        self._closed.set()
        with self._lock:
            process = self._process
        if process is not None:
            process.terminate()
        self._thread.join()

    def _run(self) -> None:
        while not self._closed.is_set():
            ours, theirs = socket.socketpair()
            with theirs:
                process = self._start(theirs.fileno())
            channel = Connection(ours.detach())
            with self._lock:
                self._channel, self._process = channel, process
            if self._closed.is_set():
                process.terminate()
            why = self._listen(channel)
            with self._lock:
                self._channel = None
            channel.close()
            _end(process)
            if not self._closed.is_set():
                self._heard(DOWN, why)
                self._closed.wait(PAUSE_S)

    def _start(self, descriptor: int) -> subprocess.Popen[bytes]:
        environ = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (str(PACKAGES), os.getenv("PYTHONPATH"))))}
        words = [sys.executable, "-P", "-m", "service.cluster.engine", str(descriptor), json.dumps(self._options)]
        return subprocess.Popen(
            words, pass_fds=(descriptor,), env=environ, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def _listen(self, channel: Connection) -> str:
        """Pass messages on until the engine ends; why it did."""
        why = "the cluster is lost: the process that talks to Ray has ended"
        with contextlib.suppress(EOFError, OSError):
            while True:
                message = channel.recv()
                if message[0] == DOWN:
                    why = message[1]
                else:
                    self._heard(*message)
        return why


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process, by force if it takes longer than it may."""
    process.terminate()
    try:
        process.wait(PAUSE_S * 5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
