"""A second place on the network: a namespace of its own behind a line that can be cut."""

from __future__ import annotations

import ctypes
import itertools
import os
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

CLONE_NEWNET = 0x40000000

_numbers = itertools.count(1)


class FarPlace:
    """There.

    Attributes:
        name: of its namespace.
        here: our end's address, which is reached from there.
    """

    def __init__(self, name: str, device: str, here: str) -> None:
        self.name = name
        self.here = here
        self._device = device

    def connect(self, port: int) -> socket.socket:
        """A connection from there to a port of ours."""
        found: list[socket.socket | OSError] = []

        def work() -> None:
            with Path(f"/var/run/netns/{self.name}").open() as namespace:
                if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), CLONE_NEWNET):
                    found.append(OSError(ctypes.get_errno(), "setns"))
                    return
            found.append(socket.create_connection((self.here, port)))

        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
        (made,) = found
        assert isinstance(made, socket.socket), made
        return made

    def cut(self) -> None:
        """Cut the line: nothing passes, and no program is told."""
        _run("ip", "-n", self.name, "link", "set", "far", "down")

    def mend(self) -> None:
        """Let everything pass again."""
        _run("ip", "-n", self.name, "link", "set", "far", "up")


@contextmanager
def far_place() -> Iterator[FarPlace]:
    """A place that is reached over a line of its own; the test is skipped where this user may not make one."""
    number = next(_numbers)
    name, device = f"gazetrace-{os.getpid()}-{number}", f"gz{os.getpid() % 100_000}-{number}"
    here, there = (f"10.{os.getpid() // 256 % 256}.{os.getpid() % 256}.{4 * number + end}" for end in (1, 2))
    try:
        _run("ip", "netns", "add", name)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("this user may not make a network")
    try:
        try:
            _run("ip", "link", "add", device, "type", "veth", "peer", "name", "far", "netns", name)
            _run("ip", "addr", "add", f"{here}/30", "dev", device)
            _run("ip", "link", "set", device, "up")
            _run("ip", "-n", name, "addr", "add", f"{there}/30", "dev", "far")
            _run("ip", "-n", name, "link", "set", "far", "up")
        except subprocess.CalledProcessError:
            pytest.skip("this machine has no virtual network devices")
        yield FarPlace(name, device, here)
    finally:
        subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)


def _run(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True)
