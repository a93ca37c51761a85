"""What numerical care costs, for people and for programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from renderer.numerics import Comparison

HEADINGS: Final = ("", "measure", "the renderer's way", "error", "another way", "error", "time ratio")
NUMBERS: Final = (3, 5, 6)
"""Columns of numbers, which stand to the right."""


def numerics_record(chapters: Mapping[str, Sequence[Comparison]]) -> dict[str, Any]:
    """The comparisons by subject, as `--json` prints them."""
    return {subject: [asdict(line) for line in lines] for subject, lines in chapters.items()}


def numerics_text(chapters: Mapping[str, Sequence[Comparison]]) -> str:
    """A table: by subject what was tried, the error of the renderer's way and of another, and the ratio of times."""
    rows: list[tuple[str, ...]] = [HEADINGS]
    for subject, lines in chapters.items():
        for line in lines:
            ratio = "" if line.time_ratio is None else f"{line.time_ratio:.2f}"
            errors = f"{line.chosen_error:.2g}", f"{line.other_error:.2g}"
            rows.append((f"{subject}: {line.case}", line.measure, line.chosen, errors[0], line.other, errors[1], ratio))
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADINGS))]
    table = "\n".join("  ".join(_cell(row[k], k, widths[k]) for k in range(len(row))).rstrip() for row in rows)
    return f"{table}\n\ntime ratio: processor time of the renderer's way over that of the other, median of runs in turn"


def _cell(text: str, column: int, width: int) -> str:
    return text.rjust(width) if column in NUMBERS else text.ljust(width)
