"""What each effect costs: one frame as planned, with every effect forced on, and with each forced off.

All are timed in turn within one run. What is timed is the processor time of all threads together, which
other programs on the machine disturb far less than the time on the clock.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from renderer.effect_choice import EFFECTS, EffectChoice
from renderer.frame import FrameRequest
from renderer.pipeline import Renderer
from renderer.prepared import PreparedScene

AS_PLANNED: EffectChoice = ()
ALL_ON: EffectChoice = tuple(f"+{effect}" for effect in EFFECTS)


@dataclass(frozen=True, slots=True)
class EffectCost:
    """What a frame costs under one choice of effects.

    Attributes:
        choice: what was forced; nothing for the frame as planned.
        rays: traced.
        ms: median processor time [ms].
        ratio, low, high: median, lowest and highest ratio to the frame as planned, turn by turn.
    """

    choice: EffectChoice
    rays: int
    ms: float
    ratio: float
    low: float
    high: float


def measure_effects(
    renderer: Renderer, prepared: PreparedScene, request: FrameRequest, repeats: int, tick: Callable[[], None]
) -> tuple[EffectCost, ...]:
    """Time a frame traced anew as planned, with all effects forced on, and with each that it calls for forced off.

    Args:
        renderer: its samples are dropped; its cell maps are used.
        prepared: the scene.
        request: the frame; what its quality forces is left aside.
        repeats: how often each is timed, 1 or more.
        tick: called after each turn, for a progress bar.
    """
    choices = (AS_PLANNED, ALL_ON, *((f"-{effect}",) for effect in prepared.plan.names))
    times: dict[EffectChoice, list[float]] = {choice: [] for choice in choices}
    rays: dict[EffectChoice, int] = {}

    def trace(choice: EffectChoice) -> float:
        renderer.forget_samples()
        began = time.process_time()
        frame = renderer.render(prepared, replace(request, quality=replace(request.quality, effects=choice)))
        rays[choice] = frame.cost.rays.total
        return 1e3 * (time.process_time() - began)

    for choice in choices:
        trace(choice)
    for _ in range(repeats):
        for choice in choices:
            times[choice].append(trace(choice))
        tick()
    return tuple(_cost(choice, rays[choice], times[choice], times[AS_PLANNED]) for choice in choices)


def _cost(choice: EffectChoice, rays: int, series: list[float], planned: list[float]) -> EffectCost:
    ratios = [mine / its for mine, its in zip(series, planned, strict=True)]
    return EffectCost(choice, rays, statistics.median(series), statistics.median(ratios), min(ratios), max(ratios))
