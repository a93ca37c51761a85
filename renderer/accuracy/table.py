"""The settings of a report as a table, for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from renderer.accuracy.record import AccuracyReport


def csv_text(report: AccuracyReport) -> str:
    """A line for each setting, a column for each field under its dotted name; lists with blanks between, null empty."""
    rows = [dict(_columns(asdict(setting), "")) for setting in report.settings]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _columns(values: Mapping[str, Any], place: str) -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _columns(value, f"{place}{name}.")
        else:
            yield place + name, " ".join(map(str, value)) if isinstance(value, tuple) else value
