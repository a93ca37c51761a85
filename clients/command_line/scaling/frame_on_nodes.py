"""One frame after another on a cluster, event by event: cut, handed out, traced, sent back and taken in.

What is simulated is time: a thread of the service that does one thing at a time, a wire that carries one piece at a
time each way, and workers whose pieces take now longer, now shorter. Each worker has a share and does its pieces in
order; who has none left takes over the last one of who has most. How many there are is what the cluster goes by.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from clients.command_line.scaling.rates import Machine, Rates, Work
from service.cluster.cluster import LONGEST_S, PIECES, SHORTEST_S, WORTH_S
from service.cluster.errand import AHEAD


@dataclass(frozen=True, slots=True)
class Bounds:
    """Least time of a frame by each thing alone [s].

    Attributes:
        picture: map and picture, on the service's cores.
        encode: the picture's encoding, on one of them.
        hand: the thread that packs pieces and takes in what comes back.
        wire: the busier way of the service's network.
        trace: all workers, without a break.
    """

    picture: float
    encode: float
    hand: float
    wire: float
    trace: float


def pieces_of(work: Work, rates: Rates, machine: Machine, nodes: int) -> list[list[int]]:
    """Cells of each piece of each worker, cut for workers of one speed."""
    if work.cells == 0:
        return [[]]
    rate = rates.samples_per_s * machine.cores / work.samples
    several = max(1, min(nodes, math.ceil(work.cells / (WORTH_S * rate))))
    share_s = work.cells / (several * rate)
    pieces = max(1, math.ceil(share_s / min(max(share_s / PIECES, SHORTEST_S), LONGEST_S)))
    return [_evenly(share, pieces) for share in _evenly(work.cells, several)]


def _evenly(total: int, parts: int) -> list[int]:
    """A number as the sum of nearly equal ones, none of them 0."""
    ends = [total * part // parts for part in range(parts + 1)]
    return [end - start for start, end in pairwise(ends) if end > start]


def bounds(work: Work, rates: Rates, machine: Machine, nodes: int) -> Bounds:
    """What keeps a frame from being faster."""
    pieces = sum(len(share) for share in pieces_of(work, rates, machine, nodes))
    a_cell_s = 1.0 / rates.pack_cells_per_s + 1.0 / rates.take_cells_per_s
    back = work.bytes_back_per_cell(rates)
    return Bounds(
        picture=work.picture_s(rates, machine.cores),
        encode=work.encode_s(rates),
        hand=pieces * rates.piece_s + work.cells * a_cell_s,
        wire=work.cells * max(rates.bytes_out_per_cell, back) / machine.bytes_per_s,
        trace=work.cells * work.samples / (rates.samples_per_s * machine.cores * nodes),
    )


def trace_s(work: Work, rates: Rates, machine: Machine, nodes: int, random: np.random.Generator) -> float:
    """Time from the first piece handed out to the last one taken in [s].

    Args:
        work: the frame.
        rates, machine: what was measured, and what each node is.
        nodes: that trace, beside the one of the service.
        random: for how long each piece takes: lognormal, with the mean and spread of `rates`.
    """
    left = [deque(share) for share in pieces_of(work, rates, machine, nodes)]
    cell_s = work.samples / (rates.samples_per_s * machine.cores)
    sigma = math.sqrt(math.log1p(rates.spread**2))
    back = work.bytes_back_per_cell(rates)
    way_s = rates.round_trip_s / 2
    hand = out = inward = 0.0
    busy_until = [0.0] * len(left)
    traced: list[tuple[float, int, int]] = []
    come: list[tuple[float, int, int]] = []

    def hand_out(worker: int) -> None:
        nonlocal hand, out
        cells = _next_piece(left, worker)
        if cells == 0:
            return
        hand += rates.piece_s + cells / rates.pack_cells_per_s
        out = max(hand, out) + cells * rates.bytes_out_per_cell / machine.bytes_per_s
        chance = random.lognormal(-sigma * sigma / 2, sigma)
        busy_until[worker] = max(out + way_s, busy_until[worker]) + cells * cell_s * chance
        heapq.heappush(traced, (busy_until[worker], worker, cells))

    for _ in range(AHEAD):
        for worker in range(len(left)):
            hand_out(worker)
    while traced or come:
        if traced and (not come or traced[0][0] + way_s <= come[0][0]):
            at, worker, cells = heapq.heappop(traced)
            inward = max(at, inward) + cells * back / machine.bytes_per_s
            heapq.heappush(come, (inward + way_s, worker, cells))
            continue
        at, worker, cells = heapq.heappop(come)
        hand = max(at, hand) + cells / rates.take_cells_per_s
        hand_out(worker)
    return hand


def _next_piece(left: Sequence[deque[int]], worker: int) -> int:
    """Cells of what a worker does next: its own, or the last of who has most left; 0 if all is begun."""
    if left[worker]:
        return left[worker].popleft()
    slowest = max(left, key=sum)
    return slowest.pop() if slowest else 0


def frame_s(work: Work, rates: Rates, machine: Machine, nodes: int, frames: int, seed: int = 0) -> float:
    """Mean time of a frame [s]: its map, its cells traced on `nodes` other nodes, its picture, and encoding that."""
    random = np.random.default_rng(seed)
    traced = [trace_s(work, rates, machine, nodes, random) for _ in range(frames)]
    return work.picture_s(rates, machine.cores) + math.fsum(traced) / frames + work.encode_s(rates)
