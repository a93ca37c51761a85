"""Records as a table, for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def csv_text(records: Sequence[DataclassInstance]) -> str:
    """A line for each record, a column for each field under its dotted name; lists with blanks between, null empty.

    Args:
        records: one or more, of one class.
    """
    rows = [dict(_columns(asdict(record), "")) for record in records]
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
