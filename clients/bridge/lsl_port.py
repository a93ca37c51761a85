"""A stream of the Lab Streaming Layer as a port. The only file that knows pylsl."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pylsl
from pylsl.util import LostError

from clients.bridge.errors import PortError
from clients.bridge.lsl import SCHEME, lsl_line
from clients.bridge.port import WAIT_S, Chunk

TYPE = "Gaze"
"""The content type that gaze streams declare."""
RESOLVE_S = 0.8
"""How long an answer to "who is there" may take; it is asked again at the next try."""
OPEN_S = 1.0
MOST_AT_ONCE = 1024
CONFIGURATIONS = (Path("lsl_api.cfg"), Path("~/lsl_api/lsl_api.cfg"), Path("/etc/lsl_api/lsl_api.cfg"))
"""Where the library looks for its own settings, unless LSLAPICFG names a file."""
QUIET = "[log]\nlevel = -3\n"
"""Without this the library writes lines of its own on stderr, between ours; what goes wrong we say."""

if not os.environ.get("LSLAPICFG") and not any(path.expanduser().exists() for path in CONFIGURATIONS):
    pylsl.set_config_content(QUIET)


class LslPort:
    """The stream of that name, or the first one of gaze.

    Args:
        url: `lsl://NAME`, or `lsl://`.

    Raises:
        PortError: if there is none now.
    """

    byte_ns = 0.0
    stale_when_silent = True

    def __init__(self, url: str) -> None:
        self._url = url
        wanted = ("name", name) if (name := url.removeprefix(SCHEME)) else ("type", TYPE)
        found = pylsl.resolve_byprop(*wanted, timeout=RESOLVE_S)
        if not found:
            raise PortError(f"{url}: no stream of {wanted[0]} {wanted[1]!r} answers on this network")
        try:
            self._inlet = pylsl.StreamInlet(found[0], recover=False)
            labels = self._inlet.info(OPEN_S).get_channel_labels() or []
            self._inlet.open_stream(OPEN_S)
        except (LostError, TimeoutError) as error:
            raise PortError(f"{url}: {error}") from None
        count = found[0].channel_count()
        self._labels = [label or str(i) for i, label in enumerate([*labels, *[None] * count][:count])]

    def read(self) -> Chunk | None:
        """The samples that have come, a line each; None after a short wait without one. Raises PortError."""
        try:
            samples, times_s = self._inlet.pull_chunk(WAIT_S, MOST_AT_ONCE, min_samples=1)
        except LostError as error:
            raise PortError(f"{self._url}: {error}") from None
        lines = [
            lsl_line(time_s, dict(zip(self._labels, sample, strict=True)))
            for sample, time_s in zip(samples, times_s, strict=True)
        ]
        return Chunk(b"".join(lines), time.monotonic_ns()) if lines else None

    def write(self, data: bytes) -> None:
        """A stream obeys nobody."""

    def close(self) -> None:
        """Leave the stream."""
        self._inlet.close_stream()
