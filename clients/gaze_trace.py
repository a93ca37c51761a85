"""Gaze traces: recorded gaze in a CSV file, read, checked and played back.

The first line names the columns, in any order; others may stand beside them and are ignored:

| column | what it holds |
|---|---|
| `t_ms` (or `t_s`, `t_us`, `t_ns`) | time since any start, not decreasing |
| `x_px`, `y_px` (or `x`, `y`) | gaze in pixels from the top-left corner; may lie off the screen |
| `x_fraction`, `y_fraction` | in place of them: 0 to 1 of the screen |
| `valid` | may be left out: 1, or 0 where the eye was lost; without it a blank x or y says so |
| `event` | may be left out: fixation, saccade, blink, anything |
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

MAX_TRACE_BYTES: Final = 1 << 28
"""Largest trace file that is read: 256 MiB, more than an hour at 1000 Hz."""

MILLISECONDS: Final = {"t_ms": 1.0, "t_s": 1e3, "t_us": 1e-3, "t_ns": 1e-6}
"""How many milliseconds one unit of each time column is."""

UNIT_OF_COLUMN: Final = {"x_px": "px", "x": "px", "x_fraction": "fraction"}
VALID: Final = {"1": True, "true": True, "0": False, "false": False}
LOST: Final = frozenset({"", "nan"})
"""What stands for a coordinate where the eye was lost, in files without a column `valid`."""


class GazeTraceError(Exception):
    """A trace that cannot be read; the message is one line naming file, line and column."""


@dataclass(frozen=True, slots=True)
class GazeSample:
    """One measurement of the eye.

    Attributes:
        time_ms: since the trace's own start of counting [ms].
        x, y: gaze in the trace's unit; NaN where the eye was lost.
        valid: False where the eye was lost.
        event: what the eye did, as the file says it; may be empty.
    """

    time_ms: float
    x: float
    y: float
    valid: bool
    event: str


@dataclass(frozen=True, eq=False, slots=True)
class GazeTrace:
    """Gaze over time.

    Attributes:
        time_ms: (n,) float64, n > 0, not decreasing [ms].
        x, y: (n,) float64 in `unit`; NaN where not valid.
        valid: (n,) bool.
        events: n texts, each may be empty.
        unit: "px" (display pixels) or "fraction" (of the screen).
    """

    time_ms: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    valid: NDArray[np.bool_]
    events: tuple[str, ...]
    unit: str

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time_ms)

    @property
    def seconds(self) -> float:
        """From the first sample to the last [s]."""
        return float(self.time_ms[-1] - self.time_ms[0]) / 1e3

    def sample(self, index: int) -> GazeSample:
        """The sample with this index."""
        return GazeSample(
            float(self.time_ms[index]),
            float(self.x[index]),
            float(self.y[index]),
            bool(self.valid[index]),
            self.events[index],
        )

    def newest(self, seconds: float) -> int:
        """Index of the newest sample not later than `seconds` after the first one; 0 before it."""
        # half a nanosecond, so that 7/25 s finds the sample at 280 ms, however the quotient was rounded
        return max(0, int(np.searchsorted(self.time_ms, self.time_ms[0] + seconds * 1e3 + 5e-7, "right")) - 1)

    def played(self, rate_hz: float, seconds: float | None = None) -> Iterator[tuple[float, GazeSample]]:
        """The newest sample each 1/rate_hz seconds: (seconds since the start, sample).

        Args:
            rate_hz: ticks a second, above 0.
            seconds: how long; the trace's own length unless given. The last sample stays after its end.
        """
        end = self.seconds if seconds is None else seconds
        for tick in count():
            now = tick / rate_hz
            if now > end:
                return
            yield now, self.sample(self.newest(now))

    def on_screen(self, width_px: int, height_px: int, recorded_px: tuple[int, int] | None = None) -> GazeTrace:
        """The same gaze in pixels of a screen.

        Args:
            width_px, height_px: the screen to look at [px].
            recorded_px: size of the screen that pixels of the trace are of; None for the same one.
        """
        if self.unit == "fraction":
            scale_x, scale_y = float(width_px), float(height_px)
        elif recorded_px is None:
            return self
        else:
            scale_x, scale_y = width_px / recorded_px[0], height_px / recorded_px[1]
        return replace(self, x=self.x * scale_x, y=self.y * scale_y, unit="px")

    def held(self, start: tuple[float, float]) -> GazeTrace:
        """The same trace with the last good gaze in place of lost ones, and `start` before there was any."""
        newest = np.maximum.accumulate(np.where(self.valid, np.arange(len(self)), -1))
        x, y = (
            np.where(newest >= 0, values[newest], first) for values, first in zip((self.x, self.y), start, strict=True)
        )
        return replace(self, x=x, y=y, valid=np.ones(len(self), dtype=np.bool_))


def read_gaze_trace(path: Path) -> GazeTrace:
    """The trace in a CSV file.

    Raises:
        GazeTraceError: "file: line 7: x_px: expected ..., found ...".
        OSError: for a file that cannot be opened.
    """
    size = path.stat().st_size
    if size > MAX_TRACE_BYTES:
        raise GazeTraceError(f"{path}: expected at most {MAX_TRACE_BYTES} bytes, found {size}")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise GazeTraceError(f"{path}: expected UTF-8 text, found another byte at {error.start}") from None
    return parse_gaze_trace(text, str(path))


def parse_gaze_trace(text: str, name: str) -> GazeTrace:
    """The trace that the text of a CSV file holds; `name` is what messages call it.

    Raises:
        GazeTraceError: as `read_gaze_trace`.
    """
    rows = csv.reader(io.StringIO(text, newline=None), strict=True)
    samples: list[GazeSample] = []
    try:
        columns = _Columns.of_header(next(rows, []), name)
        for row in rows:
            if row:
                samples.append(columns.sample(row, f"{name}: line {rows.line_num}", samples))
    except csv.Error as error:
        raise GazeTraceError(f"{name}: line {rows.line_num}: expected CSV, found a mistake: {error}") from None
    if not samples:
        raise GazeTraceError(f"{name}: expected at least one sample below the header, found none")
    return GazeTrace(
        time_ms=np.array([sample.time_ms for sample in samples], dtype=np.float64),
        x=np.array([sample.x for sample in samples], dtype=np.float64),
        y=np.array([sample.y for sample in samples], dtype=np.float64),
        valid=np.array([sample.valid for sample in samples], dtype=np.bool_),
        events=tuple(sample.event for sample in samples),
        unit=columns.unit,
    )


@dataclass(frozen=True, slots=True)
class _Columns:
    """Where a file keeps what: names of its columns, and the place of each."""

    time: str
    x: str
    y: str
    unit: str
    place: Mapping[str, int]

    @classmethod
    def of_header(cls, header: Sequence[str], name: str) -> _Columns:
        names = [column.strip().lower() for column in header]
        place = {column: index for index, column in enumerate(names)}
        twice = next((column for column in names if names.count(column) > 1 and column), None)
        if twice is not None:
            raise GazeTraceError(f"{name}: line 1: expected each column once, found {twice!r} twice")
        time = next((column for column in MILLISECONDS if column in place), None)
        x = next((column for column in UNIT_OF_COLUMN if column in place), None)
        if time is None or x is None:
            wanted = MILLISECONDS if time is None else UNIT_OF_COLUMN
            raise GazeTraceError(f"{name}: line 1: expected a column {' or '.join(wanted)}, found {_short(header)}")
        y = "y" + x[1:]
        if y not in place:
            raise GazeTraceError(f"{name}: line 1: expected a column {y} beside {x}, found {_short(header)}")
        return cls(time, x, y, UNIT_OF_COLUMN[x], place)

    def sample(self, row: Sequence[str], where: str, before: Sequence[GazeSample]) -> GazeSample:
        if len(row) != len(self.place):
            raise GazeTraceError(f"{where}: expected {len(self.place)} columns as in line 1, found {len(row)}")
        time_ms = self._number(row, self.time, where) * MILLISECONDS[self.time]
        if before and time_ms < before[-1].time_ms:
            raise GazeTraceError(
                f"{where}: {self.time}: expected a time not before the last one, found {row[self.place[self.time]]}"
            )
        event = row[self.place["event"]].strip() if "event" in self.place else ""
        if not self._valid(row, where):
            return GazeSample(time_ms, math.nan, math.nan, False, event)
        return GazeSample(time_ms, self._number(row, self.x, where), self._number(row, self.y, where), True, event)

    def _valid(self, row: Sequence[str], where: str) -> bool:
        if "valid" not in self.place:
            return not {row[self.place[column]].strip().lower() for column in (self.x, self.y)} & LOST
        text = row[self.place["valid"]].strip()
        if text.lower() not in VALID:
            raise GazeTraceError(f"{where}: valid: expected 1 or 0, found {_short(text)}")
        return VALID[text.lower()]

    def _number(self, row: Sequence[str], column: str, where: str) -> float:
        text = row[self.place[column]].strip()
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise GazeTraceError(f"{where}: {column}: expected a number, found {_short(text)}")
        return number


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
