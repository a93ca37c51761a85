"""Which settings are worth their time."""

from __future__ import annotations

from collections.abc import Sequence


def pareto_front(times: Sequence[float], losses: Sequence[float]) -> tuple[int, ...]:
    """Settings that no other one beats: none is as fast and as accurate, and better in one of the two.

    Args:
        times: of each setting, less is better.
        losses: of each setting, less is better.

    Returns:
        their indices, from the fastest to the most accurate; settings that are equal in both are all there.
    """
    order = sorted(range(len(times)), key=lambda index: (times[index], losses[index]))
    front: list[int] = []
    for index in order:
        best = front[-1] if front else index
        same = (times[index], losses[index]) == (times[best], losses[best])
        if same or losses[index] < losses[best]:
            front.append(index)
    return tuple(front)
