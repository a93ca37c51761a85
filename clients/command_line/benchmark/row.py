"""One line of the benchmark's table."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from renderer.benchmark import Figure

RATIO = "ratio"


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity, measured several times or not at all.

    Attributes:
        group: rows that are asked for together.
        what: was measured.
        median, low, high: over the repeats; None where it was not measured.
        unit: `ratio`, `ms`, `s`, `MiB`, or what else the numbers are in.
        aim: what the median should be at most, or where `at_least` is True at least; None for a plain figure.
        at_least: which way is good.
        note: under which conditions, or why there is no figure.
    """

    group: str
    what: str
    median: float | None
    low: float | None
    high: float | None
    unit: str = RATIO
    aim: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the median is as good as the aim; None without either."""
        if self.aim is None or self.median is None:
            return None
        return self.median >= self.aim if self.at_least else self.median <= self.aim


def measured_row(
    group: str,
    what: str,
    series: Sequence[float],
    unit: str = RATIO,
    *,
    aim: float | None = None,
    at_least: bool = False,
    note: str = "",
) -> Row:
    """The row of a quantity by its repeats, at least one."""
    return Row(group, what, statistics.median(series), min(series), max(series), unit, aim, at_least, note)


def figure_row(group: str, what: str, figure: Figure, *, aim: float | None = None, note: str = "") -> Row:
    """The row of a figure."""
    return Row(group, what, figure.median, figure.low, figure.high, figure.unit, aim, note=note)


def missing_row(group: str, what: str, why: str) -> Row:
    """The row of a quantity that cannot be measured here."""
    return Row(group, what, None, None, None, note=why)


def table_text(rows: Iterable[Row]) -> str:
    """The rows for people: median, how far the repeats lie apart, the aim, and conditions."""
    rows = tuple(rows)
    width = max(len(row.what) for row in rows)
    lines = [f"{'':<{width}}    median    lowest   highest        aim"]
    for row in rows:
        aim = "" if row.aim is None else f"{'>=' if row.at_least else '<='} {row.aim:g}"
        numbers = "".join(_number(value, row.unit) for value in (row.median, row.low, row.high))
        unit = "" if row.unit == RATIO else row.unit
        lines.append(f"{row.what:<{width}}{numbers} {unit:<4}{aim:>7}  {row.note}".rstrip())
    return "\n".join(lines)


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return f"{'-':>10}"
    return f"{value:10,.{3 if unit == RATIO else 1}f}"
