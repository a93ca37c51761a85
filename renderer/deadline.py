"""What fits into a deadline: cells as fine as they can be with one sample each, then as many samples as there is
time for. The choice is a function of rates, counts and the deadline alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.acuity import MAX_SCALE, Acuity
from renderer.frame import FrameRequest
from renderer.growth import Growth
from renderer.pace import LEAST_SAMPLES, Rates
from renderer.quality import Quality
from renderer.store import SampleStore, held_by_number

NS_PER_MS = 1_000_000

LADDER = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Factors on the acuity scale, finest first; the coarsest leaves about a fiftieth of the cells."""


LATE_SHARE = 0.5
"""Share of the time for map and reconstruction that tracing may add to a frame that is late anyway: a coarser map
costs as much as a fine one, and another one when the gaze rests."""


class Work(NamedTuple):
    """What a frame of one acuity takes.

    Attributes:
        acuity: of its map.
        new_map: whether the map has to be built.
        held: (n + 1,) cells by the number of samples they hold already, those with all they need last.
    """

    acuity: Acuity
    new_map: bool
    held: NDArray[np.float64]


def ladder(quality: Quality) -> Iterator[Acuity]:
    """The acuities that may be chosen, finest first: that of `quality`, and unless its map is full coarser ones."""
    for factor in LADDER if quality.map != "full" else LADDER[:1]:
        scale = quality.acuity.scale * factor
        if factor == 1.0 or scale <= MAX_SCALE:
            yield replace(quality.acuity, scale=scale)


def fitted(request: FrameRequest, works: Iterable[Work], rates: Rates) -> tuple[FrameRequest, bool | None]:
    """`request`, with cells so coarse that a frame of one sample of each should be done by its deadline, if any.

    Returns:
        the request, and whether it should be done in time then; None for one without a deadline.
    """
    quality, pixels = request.quality, request.display.pixels
    if quality.deadline_ms is None:
        return request, None
    left_ns = NS_PER_MS * quality.deadline_ms
    chosen = choose_acuity(works, pixels, rates, left_ns)
    promised = around_ns(chosen, pixels, rates) + tracing_ns(chosen, rates) <= left_ns
    return replace(request, quality=replace(quality, acuity=chosen.acuity)), promised


def affordable_samples(
    request: FrameRequest, slots: NDArray[np.int32], store: SampleStore, wanted: int, rates: Rates, gone_ns: int
) -> int:
    """As many of `wanted` samples a cell as should be traced by the deadline, if there is any.

    Args:
        request: the frame.
        slots: (n,) int32 slots of its cells.
        store: what they hold.
        wanted: most samples a cell.
        rates: time for each part.
        gone_ns: since the frame was begun [ns].
    """
    deadline_ms = request.quality.deadline_ms
    if deadline_ms is None:
        return wanted
    held = held_by_number(store.samples.number, store.spread.settled, slots, wanted)
    return choose_samples(held, wanted, request.display.pixels, rates, NS_PER_MS * deadline_ms - gone_ns)


def seen(rates: Rates, growth: Growth) -> Rates:
    """`rates` in the light of what was traced for this very frame, if that was enough to tell."""
    if growth.asked < LEAST_SAMPLES:
        return rates
    return rates._replace(sample=growth.trace_ns / growth.asked)


def samples_lacking(held: NDArray[np.float64], wanted: int) -> float:
    """Samples to trace until every cell has `wanted`, (n + 1,) cells by what they hold; n is all they need."""
    return float((held[:wanted] * (wanted - np.arange(min(wanted, len(held))))).sum())


def around_ns(work: Work, pixels: int, rates: Rates) -> float:
    """Time to leave for all of a frame but tracing [ns]."""
    return rates.margin * (rates.frame_pixel + (rates.map_pixel if work.new_map else 0.0)) * pixels


def tracing_ns(work: Work, rates: Rates) -> float:
    """Time to leave for tracing the first sample of each cell that has none [ns]."""
    return rates.margin * rates.sample * samples_lacking(work.held, 1)


def choose_acuity(works: Iterable[Work], pixels: int, rates: Rates, left_ns: float) -> Work:
    """The first of `works` whose frame with one sample a cell fits into `left_ns`, else the last.

    Where map and reconstruction alone do not fit, coarser cells cannot help but by what tracing takes: the first
    whose tracing takes at most half their time is chosen.

    Args:
        works: one or more, finest first; asked for one by one.
        pixels: of the screen.
        rates: time for each part.
        left_ns: time until the deadline [ns].
    """
    chosen: Work | None = None
    for work in works:
        chosen = work
        around, tracing = around_ns(work, pixels, rates), tracing_ns(work, rates)
        if around + tracing <= left_ns or (around > left_ns and tracing <= LATE_SHARE * around):
            break
    assert chosen is not None
    return chosen


def choose_samples(held: NDArray[np.float64], most: int, pixels: int, rates: Rates, left_ns: float) -> int:
    """The most samples a cell, 1 to `most`, whose frame fits into `left_ns`; 1 if none does.

    Args:
        held: (n + 1,) cells by the number of samples they hold, n is all they need.
        most: most samples that are wanted.
        pixels: of the screen.
        rates: time for each part.
        left_ns: time until the deadline, the map being there [ns].
    """
    budget = left_ns / rates.margin - rates.frame_pixel * pixels
    low, high = 1, most
    while low < high:
        middle = (low + high + 1) // 2
        if rates.sample * samples_lacking(held, middle) <= budget:
            low = middle
        else:
            high = middle - 1
    return low
