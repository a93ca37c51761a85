"""The first look at a device: which protocol, how fast, how much of it valid, how full the line."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from clients.bridge.codec import SECOND_NS, Codec
from clients.bridge.detection import detect, diagnose
from clients.bridge.device_state import RECENT_BYTES
from clients.bridge.errors import PortError
from clients.bridge.port import Port
from clients.bridge.sample import Eye, Point, Sample, gaze_of

LISTEN_S = 2.0
"""How long is listened once bytes come: 60 samples of a slow tracker."""
PATIENCE_S = 5.0
SHOWN = 20
"""Samples that are shown."""


class Probe(NamedTuple):
    """What was found.

    Attributes:
        protocol: as the command line calls it, with its options.
        samples: the first ones.
        rate_hz: samples a second.
        bytes_per_s: of the device.
        line_load: share of what the line can carry; None where there is no line.
        valid: share of samples with a gaze.
        bad: records that were damaged or unknown.
    """

    protocol: str
    samples: list[Sample]
    rate_hz: float
    bytes_per_s: float
    line_load: float | None
    valid: float
    bad: int


def probe(open_port: Callable[[], Port], known: Codec | None) -> Probe:
    """Listen to a device.

    Args:
        open_port: opens it.
        known: its protocol, whose commands then start it; None to find out.

    Raises:
        PortError: if it cannot be opened, nothing comes, or nothing that can be read.
    """
    port = open_port()
    try:
        if known is not None:
            for command in known.start():
                port.write(command)
        data, seconds = _listen(port, known)
        if known is not None:
            port.write(known.stop())
    finally:
        port.close()
    if known is None:
        detection = detect(data[-RECENT_BYTES:])
        if detection is None:
            state, why = diagnose(data[-RECENT_BYTES:])
            raise PortError(f"{state}: {why}")
        known, protocol = detection.codec, detection.protocol
        bad_before = known.bad
        known.reset()
    else:
        protocol, bad_before = known.name, 0
    samples = known.feed(data)
    if not samples:
        state, why = diagnose(data[-RECENT_BYTES:])
        raise PortError(known.complaint or f"{state}: {why}")
    points: list[Point | None] = [gaze_of(sample, Eye.BEST) for sample in samples]
    return Probe(
        protocol,
        samples[:SHOWN],
        len(samples) / seconds,
        len(data) / seconds,
        len(data) / seconds * port.byte_ns / SECOND_NS if port.byte_ns else None,
        sum(point is not None for point in points) / len(points),
        known.bad - bad_before,
    )


def _listen(port: Port, known: Codec | None) -> tuple[bytes, float]:
    """What comes from the first byte on, and how long that took [s]."""
    data, first_ns, begin_ns = bytearray(), None, time.monotonic_ns()
    while True:
        chunk = port.read()
        now_ns = time.monotonic_ns()
        if known is not None and (due := known.due(now_ns)):
            port.write(due)
        if chunk is not None:
            first_ns = chunk.arrival_ns if first_ns is None else first_ns
            data += chunk.data
        if first_ns is not None and now_ns - first_ns >= LISTEN_S * SECOND_NS:
            return bytes(data), (now_ns - first_ns) / SECOND_NS
        if first_ns is None and now_ns - begin_ns >= PATIENCE_S * SECOND_NS:
            raise PortError(
                f"nothing has come in {PATIENCE_S:g} s: is the device on, and tracking?"
                + (" With --protocol it is told to start." if known is None else "")
            )
