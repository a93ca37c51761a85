"""Which worker does what: shares by speed, and whoever is done takes from whoever has most left."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Hashable, Iterable, Mapping, Sequence
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Worker = TypeVar("Worker", bound=Hashable)

RATE_GAIN = 0.25
"""Weight of the newest measurement in a worker's speed."""


def rate_after(rate: float | None, measured: float) -> float:
    """A worker's speed after another measurement; None before the first."""
    return measured if rate is None else rate + RATE_GAIN * (measured - rate)


def cut(ends: NDArray[np.int64], rates: Sequence[float], piece_s: float) -> list[list[slice]]:
    """Cut a row of cells into a share for each worker by its speed, and each share into pieces.

    Args:
        ends: (c,) int64 work up to the end of each cell, rising, above 0.
        rates: work a second of each worker, above 0.
        piece_s: about how long a worker should take for a piece [s].

    Returns:
        the pieces of each worker, in the order of the cells; together all cells, each once.
    """
    total, speed = int(ends[-1]), sum(rates)
    shares, begin, done = [], 0, 0.0
    for number, rate in enumerate(rates):
        done += rate
        last = number == len(rates) - 1
        end = len(ends) if last else int(np.searchsorted(ends, total * done / speed, side="right"))
        pieces = []
        while begin < end:
            before = int(ends[begin - 1]) if begin else 0
            stop = int(np.searchsorted(ends, before + max(1.0, rate * piece_s), side="right"))
            stop = min(end, max(begin + 1, stop))
            pieces.append(slice(begin, stop))
            begin = stop
        shares.append(pieces)
    return shares


class Backlog(Generic[Worker]):
    """Items that nobody works on yet: each worker's own, in order, and those that lost their worker, for anyone.

    Args:
        shares: items of each worker.
        weights: work of each item.
    """

    def __init__(self, shares: Mapping[Worker, Iterable[int]], weights: Sequence[float]) -> None:
        self._own = {worker: deque(items) for worker, items in shares.items()}
        self._anyones: deque[int] = deque()
        self._weights = weights

    def __len__(self) -> int:
        return len(self._anyones) + sum(map(len, self._own.values()))

    def put_back(self, items: Iterable[int]) -> None:
        """Have someone else do these, first of all."""
        self._anyones.extend(items)

    def keep(self, workers: Container[Worker]) -> None:
        """Give what workers have not begun to the others, where they are none of these any more."""
        for worker in [worker for worker in self._own if worker not in workers]:
            self._anyones.extend(self._own.pop(worker))

    def owns(self, worker: Worker) -> bool:
        """Whether a worker was given a share."""
        return worker in self._own

    def take(self, worker: Worker, rates: Mapping[Worker, float]) -> int | None:
        """What a worker does next: lost items, its own, or the last of who would take longest; None if all is begun.

        Args:
            worker: who asks.
            rates: work a second of each worker.
        """
        if self._anyones:
            return self._anyones.popleft()
        if self._own.get(worker):
            return self._own[worker].popleft()
        busy = {other: items for other, items in self._own.items() if items}
        if not busy:
            return None

        def left_s(other: Worker) -> float:
            return sum(self._weights[item] for item in busy[other]) / rates.get(other, 1.0)

        return busy[max(busy, key=left_s)].pop()
