"""Tells systemd that the bridge runs (sd_notify): one datagram to the socket it names."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from contextlib import suppress


def notify(state: str, environ: Mapping[str, str] = os.environ) -> None:
    """Send a state such as `READY=1` or `WATCHDOG=1`; nothing where systemd did not start this."""
    address = environ.get("NOTIFY_SOCKET", "")
    if address:
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notifier:
            notifier.connect("\0" + address[1:] if address.startswith("@") else address)
            notifier.sendall(state.encode("ascii", "replace"))


def watchdog_interval_s(environ: Mapping[str, str] = os.environ) -> float | None:
    """How often to say `WATCHDOG=1`: twice in the time that systemd waits; None if it does not."""
    microseconds = environ.get("WATCHDOG_USEC", "")
    return int(microseconds) / 2e6 if microseconds.isdecimal() and int(microseconds) > 0 else None
