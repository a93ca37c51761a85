"""Every codec with a stream that its device sends: distinct samples, so that each can be recognised."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from clients.bridge.asl import Asl
from clients.bridge.codec import Codec
from clients.bridge.csv_lines import CsvLines
from clients.bridge.eyetribe import EyeTribe
from clients.bridge.gazepoint import Gazepoint
from clients.bridge.iscan import IscanAscii, IscanBinary
from clients.bridge.json_lines import JsonLines
from clients.bridge.lsl import Lsl
from clients.bridge.pattern_lines import PatternLines
from clients.bridge.pupil import Pupil
from clients.bridge.sample import Eye, Point, Sample, gaze_of
from clients.bridge.smi import Smi

STEP_NS = 4_000_000
LOST = (3, 7)
"""Which of the samples are lost eyes."""

CODECS: dict[str, Callable[[], Codec]] = {
    "smi": Smi,
    "asl": Asl,
    "asl counted": lambda: Asl(counted=True),
    "iscan": IscanBinary,
    "iscan of 4": lambda: IscanBinary(parameters=4, columns=(2, 1)),
    "iscan-ascii": IscanAscii,
    "gazepoint": Gazepoint,
    "eyetribe": EyeTribe,
    "csv": lambda: CsvLines(("t", "x", "y")),
    "jsonl": JsonLines,
    "regex": PatternLines,
    "lsl": Lsl,
    "pupil": lambda: Pupil("screen"),
}


def points(codec: Codec, count: int = 12) -> list[Point | None]:
    """Distinct points in the device's unit, some of them lost; with coordinates of several lengths."""
    scale = 1 / 1000 if codec.unit == "fraction" else 1
    return [None if i in LOST else Point((5 + 21 * i) * scale, (237 - 19 * i) * scale) for i in range(count)]


def records(codec: Codec, count: int = 12) -> list[bytes]:
    return [codec.encode(10**12 + i * STEP_NS, point) for i, point in enumerate(points(codec, count))]


def decode(codec: Codec, chunks: Sequence[bytes]) -> list[Sample]:
    return [sample for chunk in chunks for sample in codec.feed(chunk)]


def gazes(samples: Sequence[Sample]) -> list[Point | None]:
    return [gaze_of(sample, Eye.BEST) for sample in samples]
