"""One choice against one alternative: time and error."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

REPEATS = 7
"""Pairs of runs that a ratio of times is the median of."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """One line of the table.

    Attributes:
        case: what it was tried on.
        measure: what the errors count or measure, with its unit.
        chosen, other: the renderer's way, and the one that it is compared with.
        chosen_error, other_error: in `measure`.
        time_ratio: time of the chosen way over that of the other; None where they differ in no step.
    """

    case: str
    measure: str
    chosen: str
    other: str
    chosen_error: float
    other_error: float
    time_ratio: float | None


def time_ratio(chosen: Callable[[], object], other: Callable[[], object]) -> float:
    """Processor time of `chosen` over that of `other`: median over pairs of runs, which go first in turn.

    Both are run once before, so that they are compiled. Both run on the thread that asks.
    """
    chosen()
    other()
    ratios = []
    for turn in range(REPEATS):
        spent = {}
        for run in (chosen, other) if turn % 2 == 0 else (other, chosen):
            began = time.thread_time_ns()
            run()
            spent[run] = time.thread_time_ns() - began
        ratios.append(spent[chosen] / max(1, spent[other]))
    return statistics.median(ratios)
