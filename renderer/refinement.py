"""More samples until a frame's stated error is small enough, its time is over, or it has all it may have."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from renderer.growth import Growth
from renderer.quality import MAX_SAMPLES
from renderer.standard_error import StatedError
from renderer.tracing import total_rays

CERTAIN_SHARE = 0.9
"""Share of the samples that the error so far calls for which are traced before the error is looked at again."""

FINENESS = 16
"""Samples are added a sixteenth at a time when an error is about to be met, and one at a time below 32."""


class Refined(NamedTuple):
    """A frame's samples.

    Attributes:
        growth: what was traced.
        error: the frame's own account.
        wanted: samples that each cell was to have in the end.
    """

    growth: Growth
    error: StatedError
    wanted: int


def refine(
    grow_to: Callable[[int], Growth],
    judge: Callable[[], StatedError],
    affordable: Callable[[Growth], int],
    most: int,
    max_error: float | None,
    *,
    hurried: bool,
) -> Refined:
    """Trace as many samples a cell as a frame may have, or as few as its error allows.

    With neither a deadline nor an error to meet, all of them at once. The result depends on nothing but the samples,
    unless `affordable` does.

    Args:
        grow_to: gives each cell so many samples, those it has counted.
        judge: states the error of what is there.
        affordable: how many samples a cell there is time for, going by what was traced so far.
        most: samples a cell may have, 1 or more.
        max_error: error to stop at, None for no such bound.
        hurried: whether there is a deadline: the first sample of each cell then shows how fast more would come.
    """
    wanted = 1 if hurried or max_error is not None else most
    growth, error = grow_to(wanted), None
    wanted = min(max(wanted, growth.fewest), most)
    while wanted < most:
        following = most
        if max_error is not None:
            error = judge()
            if error.within(max_error):
                break
            following = min(foreseen(error, wanted, max_error), most)
        if hurried:
            following = min(following, affordable(growth))
        if following <= wanted:
            break
        growth, wanted, error = _added(growth, grow_to(following)), following, None
    return Refined(growth, judge() if error is None else error, wanted)


def foreseen(error: StatedError, samples: int, max_error: float) -> int:
    """The next number of samples a cell at which the error may be small enough, more than `samples`.

    The squared error falls as one over the samples. What one sample leaves is a guess, which nothing is built on.
    """
    if error.guessed > 0.0:
        return samples + 1
    called_for = samples * min(error.greatest / max_error, MAX_SAMPLES) ** 2
    return max(samples + max(1, samples // FINENESS), int(CERTAIN_SHARE * called_for))


def _added(before: Growth, after: Growth) -> Growth:
    """Both together; what gets more samples later was short of them before, or has settled since."""
    return Growth(
        cells=max(before.cells, after.cells),
        samples=before.samples + after.samples,
        asked=before.asked + after.asked,
        rays=total_rays([before.rays, after.rays]),
        rejected=before.rejected + after.rejected,
        held=after.held,
        fewest=after.fewest,
        trace_ns=before.trace_ns + after.trace_ns,
    )
