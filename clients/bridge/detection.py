"""Which protocol bytes are of, if they are of one."""

from __future__ import annotations

from typing import NamedTuple

from clients.bridge.asl import Asl
from clients.bridge.codec import Codec
from clients.bridge.csv_lines import CsvLines
from clients.bridge.device_state import DeviceState
from clients.bridge.eyetribe import EyeTribe
from clients.bridge.gazepoint import Gazepoint
from clients.bridge.iscan import IscanAscii, IscanBinary
from clients.bridge.json_lines import JsonLines
from clients.bridge.smi import Smi

LEAST_SAMPLES = 3
LEAST_SHARE = 0.8
"""Of the bytes, the share that must belong to samples."""
MOST_NOISE = 0.1
"""A text has a smaller share of bytes that are no text."""
TEXT = frozenset(range(32, 127)) | frozenset(b"\t\r\n")
VIEWPOINT = b"VP"
VIEWPOINT_TYPES = frozenset((11, 12))


class Detection(NamedTuple):
    """A protocol that bytes may be of, and how many samples of it they hold."""

    codec: Codec
    protocol: str
    samples: int
    share: float


def candidates() -> list[tuple[str, Codec]]:
    """Every protocol with the options that devices have by default, the most telling first."""
    found: list[tuple[str, Codec]] = [
        ("smi", Smi()),
        ("gazepoint", Gazepoint()),
        ("eyetribe", EyeTribe()),
        ("asl", Asl()),
        ("asl --asl-counted", Asl(counted=True)),
    ]
    for parameters in range(2, 13):
        found.append((f"iscan --iscan-parameters {parameters}", IscanBinary(parameters)))
        found.append((f"iscan-ascii --iscan-parameters {parameters}", IscanAscii(parameters)))
    return [*found, ("jsonl", JsonLines()), ("csv", CsvLines())]


def detect(data: bytes) -> Detection | None:
    """The protocol that explains most of the bytes; None if none explains enough."""
    best: Detection | None = None
    for protocol, codec in candidates():
        samples = codec.feed(data)
        share = sum(sample.size for sample in samples) / max(1, len(data))
        if len(samples) >= LEAST_SAMPLES and share >= LEAST_SHARE and (best is None or share > best.share + 0.05):
            best = Detection(codec, protocol, len(samples), share)
    return best


def diagnose(data: bytes) -> tuple[DeviceState, str]:
    """Why bytes cannot be read: the state of the device, and an explanation."""
    detection = detect(data)
    if detection is not None:
        return DeviceState.WRONG_PROTOCOL, f"this looks like --protocol {detection.protocol}"
    if _is_viewpoint(data):
        return DeviceState.WRONG_PROTOCOL, "this looks like Arrington ViewPoint, which cannot be read"
    noise = sum(byte not in TEXT for byte in data) / max(1, len(data))
    if noise > MOST_NOISE:
        return DeviceState.WRONG_BAUD, "only noise comes: try another --baud, or --protocol"
    return DeviceState.WRONG_PROTOCOL, f"no known record comes, but text such as {_excerpt(data)!r}"


def _is_viewpoint(data: bytes) -> bool:
    """Packets are `VP`, a type, a size, so many bytes."""
    at, packets = data.find(VIEWPOINT), 0
    while 0 <= at <= len(data) - 4 and data[at : at + 2] == VIEWPOINT and data[at + 2] in VIEWPOINT_TYPES:
        packets += 1
        at += 4 + data[at + 3]
    return packets > 0 and at >= len(data)


def _excerpt(data: bytes) -> str:
    lines = [line for line in data.decode("ascii", "replace").splitlines() if line.strip()]
    return (lines[len(lines) // 2] if lines else "")[:60]
