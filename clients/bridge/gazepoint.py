"""Gazepoint and Mirametrix, "Open Gaze API": lines like `<REC BPOGX="0.43" ... />` over TCP, port 4242.

The point that counts is BPOG, both eyes and unfiltered; FPOG is the running mean of a fixation and lags.
"""

from __future__ import annotations

import re
from typing import ClassVar

from clients.bridge.codec import SECOND_NS, BadRecord, Line, LineCodec, number
from clients.bridge.sample import Point, Sample, seen

SENT = ("COUNTER", "TIME", "POG_LEFT", "POG_RIGHT", "POG_BEST")
"""What the device is asked to send."""
RECORD = re.compile(r"<REC((?:\s+\w+=\"[^\"<>]*\")*)\s*/>")
FIELD = re.compile(r'(\w+)="([^"]*)"')


class Gazepoint(LineCodec):
    """Gazepoint GP3, GP3 HD and Mirametrix trackers."""

    name = "gazepoint"
    unit = "fraction"
    binocular: ClassVar[bool] = True
    ticks_ns = (SECOND_NS,)

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def start(self) -> tuple[bytes, ...]:
        """Choose what is sent, then have it sent."""
        commands = [_set(f"ENABLE_SEND_{name}", 1) for name in (*SENT, "DATA")]
        return (b"".join(commands),)

    def stop(self) -> bytes:
        """Have nothing sent."""
        return _set("ENABLE_SEND_DATA", 0)

    def read(self, line: Line) -> list[Sample]:
        """The samples of a line; an acknowledgement holds none, and two records may have run together."""
        records = RECORD.findall(line.text)
        if not records:
            if "<ACK" in line.text or "<CAL" in line.text or "<NACK" in line.text:
                return []
            raise BadRecord(line.text)
        return [self._sample(line, dict(FIELD.findall(record))) for record in records]

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """A record with all three points the same."""
        self._count += 1
        x, y = point or (0.0, 0.0)
        points = " ".join(
            f'{which}POGX="{x:.5f}" {which}POGY="{y:.5f}" {which}POGV="{int(point is not None)}"' for which in "LRB"
        )
        return f'<REC CNT="{self._count}" TIME="{time_ns / SECOND_NS:.5f}" {points} />\r\n'.encode("ascii")

    def _sample(self, line: Line, fields: dict[str, str]) -> Sample:
        if not {"BPOGX", "BPOGY", "BPOGV"} <= fields.keys():
            raise BadRecord(line.text)
        ticks = number(fields["TIME"]) if "TIME" in fields else None
        return Sample(line.first, line.size, ticks, *(_point(fields, which) for which in "LRB"))


def _point(fields: dict[str, str], which: str) -> Point | None:
    x, y, valid = (fields.get(f"{which}POG{part}") for part in "XYV")
    if x is None or y is None or valid != "1":
        if valid not in (None, "0", "1"):
            raise BadRecord(valid)
        return None
    return seen(number(x), number(y))


def _set(name: str, state: int) -> bytes:
    return f'<SET ID="{name}" STATE="{state}" />\r\n'.encode("ascii")
