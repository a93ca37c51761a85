"""SMI iView X: lines `ET_SPL ...` on a serial line or UDP, in a format that the client sets.

Each specifier stands for two columns, left then right, while both eyes are tracked. Servers are known to ignore the
format; what comes is then read by the place of its eye letter.
"""

from __future__ import annotations

import re
from typing import ClassVar

from clients.bridge.codec import IS_NUMBER, MICROSECOND_NS, MILLISECOND_NS, NUMBER, BadRecord, Line, LineCodec
from clients.bridge.errors import ConfigError
from clients.bridge.sample import Point, Sample, seen

MARK = "ET_SPL"
DEFAULT_FORMAT = "%TS %ET %SX %SY"
SPECIFIERS = frozenset(["TS", "TU", "ET", "SX", "SY", "DX", "DY", "PX", "PY", "CX", "CY", "EX", "EY", "EZ", "SC"])
SINGLE = frozenset(("TS", "TU", "ET", "SC"))
"""Specifiers that stand for one column also while both eyes are tracked."""

GAZE_COLUMNS = ("SX", "SXl", "SXr", "SY", "SYl", "SYr")
"""Names of the gaze's columns, of one eye or of both, in the order that lines have by default."""

SAME_WIDTH_IN_A_ROW = 3
"""How many lines of another width it takes to believe that the format has changed, not one line."""

HOPELESS_LINES = 20
"""Unreadable sample lines in a row after which the format is refused."""


class Smi(LineCodec):
    """SMI iView X.

    Args:
        sample_format: what `ET_FRM` asks for; needs `%SX` and `%SY`.

    Raises:
        ConfigError: for a format without them, or with an unknown specifier.
    """

    name = "smi"
    unit = "px"
    binocular: ClassVar[bool] = True
    ticks_ns = (MILLISECOND_NS, MICROSECOND_NS)
    """TS is said to be in ms, yet values of the size of microseconds occur: the rate decides."""

    def __init__(self, sample_format: str = DEFAULT_FORMAT) -> None:
        super().__init__()
        named = re.findall(r"%(\w\w)", sample_format)
        if not {"SX", "SY"} <= set(named) <= SPECIFIERS or len(set(named)) != len(named) or '"' in sample_format:
            raise ConfigError("smi_format", "%SX, %SY and other specifiers of iView X, each once", sample_format)
        self._format = sample_format
        self._patterns = (_pattern(sample_format, "lr"), _pattern(sample_format, "_"))
        self._width: int | None = None
        self._other_width: tuple[int, int] = (0, 0)
        self._unreadable = 0

    def start(self) -> tuple[bytes, ...]:
        """Set the format, then stream."""
        return (f'ET_FRM "{self._format}"\nET_STR\n'.encode("ascii"),)

    def stop(self) -> bytes:
        """End streaming."""
        return b"ET_EST\n"

    def read(self, line: Line) -> list[Sample]:
        """A sample, if the line holds one; other `ET_` lines and echoes of our commands say nothing about gaze."""
        _, mark, text = line.text.rpartition(MARK)
        if not mark:
            if "ET_" in line.text:
                return []
            raise BadRecord(line.text)
        sample = self._by_format(line, text.strip()) or self._by_letter(line, text.split())
        if sample is None:
            self._unreadable += 1
            if self._unreadable == HOPELESS_LINES:
                self.complaint = (
                    f'expected lines "{MARK} {self._format}", found "{MARK} {text.strip()}", '
                    "with no eye letter l, r or b in its first two columns"
                )
            raise BadRecord(line.text)
        self._unreadable, self.complaint = 0, None
        return [sample]

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """Both eyes on one point, in the default format with time in microseconds; lost eyes at (0, 0)."""
        x, y = (0, 0) if point is None else (round(point.x), round(point.y))
        return f"{MARK} {time_ns // MICROSECOND_NS} b {x} {x} {y} {y}\r\n".encode("ascii")

    def _by_format(self, line: Line, text: str) -> Sample | None:
        """The sample of a line in the format that was set."""
        for pattern in self._patterns:
            if match := pattern.fullmatch(text):
                columns = match.groupdict()
                letter = columns.get("ET", "_")
                if (letter == "b") != ("SXl" in columns) and letter != "_":
                    continue
                self._width = len(text.split())
                gaze = [float(columns[name]) for name in GAZE_COLUMNS if name in columns]
                return _sample(line, columns.get("TU") or columns.get("TS"), letter, gaze)
        return None

    def _by_letter(self, line: Line, words: list[str]) -> Sample | None:
        """The sample of a line in a format of the server's own: time and eye letter in some order, then gaze."""
        letters = [index for index in (0, 1) if words[index : index + 1] in (["l"], ["r"], ["b"])]
        if len(letters) != 1 or not self._usual_width(len(words)):
            return None
        letter = words.pop(letters[0])
        gaze_columns = 4 if letter == "b" else 2
        if len(words) < 1 + gaze_columns or not all(IS_NUMBER.fullmatch(word) for word in words):
            return None
        return _sample(line, words[0], letter, [float(word) for word in words[1 : 1 + gaze_columns]])

    def _usual_width(self, width: int) -> bool:
        """Whether lines have this many columns: the first one decides, or several of another width in a row."""
        if self._width in (None, width):
            self._width = width
            self._other_width = (0, 0)
            return True
        other, in_a_row = self._other_width
        self._other_width = (width, in_a_row + 1 if width == other else 1)
        if self._other_width[1] < SAME_WIDTH_IN_A_ROW:
            return False
        self._width = width
        return True


def _pattern(sample_format: str, eyes: str) -> re.Pattern[str]:
    """What a line of the format looks like; columns are named by specifier and eye."""
    parts = []
    for part in re.split(r"(%\w\w|\s+)", sample_format.strip()):
        name = part[1:]
        if part.isspace():
            parts.append(r"\s+")
        elif not part.startswith("%"):
            parts.append(re.escape(part))
        elif name == "ET":
            parts.append("(?P<ET>[lrb])")
        elif name in SINGLE or eyes == "_":
            parts.append(f"(?P<{name}>{NUMBER})")
        else:
            parts.append(r"\s+".join(f"(?P<{name}{eye}>{NUMBER})" for eye in eyes))
    return re.compile("".join(parts))


def _sample(line: Line, ticks: str | None, letter: str, gaze: list[float]) -> Sample:
    """From `xl xr yl yr`, or `x y` of one eye."""
    time = None if ticks is None else float(ticks)
    if len(gaze) == 4:
        xl, xr, yl, yr = gaze
        return Sample(line.first, line.size, time, left=seen(xl, yl), right=seen(xr, yr))
    point = seen(*gaze)
    if letter == "l":
        return Sample(line.first, line.size, time, left=point)
    if letter == "r":
        return Sample(line.first, line.size, time, right=point)
    return Sample(line.first, line.size, time, both=point)
