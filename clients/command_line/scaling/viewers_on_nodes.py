"""Many viewers at once, as a closed network of queues: each has one frame on its way, or rests until it wants the next.

Exact mean value analysis (Reiser and Lavenberg 1980, "Mean-value analysis of closed multichain queuing networks",
J. ACM 27). The cores of a node are one fast server, since a frame is divided among all of them; what one core has to
do alone is a delay beside that (Seidmann, Schweitzer and Shalev-Oren 1987).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from clients.command_line.scaling.frame_on_nodes import pieces_of
from clients.command_line.scaling.rates import Machine, Rates, Work


class Station(NamedTuple):
    """Something that frames pass, one at a time.

    Attributes:
        name: of it.
        demand_s: how long a frame keeps it [s].
        delay_s: how long a frame takes there beside that, and keeps nobody else waiting [s].
    """

    name: str
    demand_s: float
    delay_s: float = 0.0


class Flow(NamedTuple):
    """What comes of it.

    Attributes:
        frames_per_s: of all viewers together.
        response_s: from asking for a frame to having it.
        use: share of the time that each station works, 0 to 1.
    """

    frames_per_s: float
    response_s: float
    use: tuple[float, ...]


def flow(viewers: int, rest_s: float, stations: Sequence[Station]) -> Flow:
    """How frames flow.

    Args:
        viewers: 1 or more.
        rest_s: from having a frame to asking for the next one.
        stations: that a frame passes, one after the other.
    """
    delay_s = sum(station.delay_s for station in stations)
    waiting = [0.0] * len(stations)
    response_s, rate = 0.0, 0.0
    for number in range(1, viewers + 1):
        times = [station.demand_s * (1.0 + queue) for station, queue in zip(stations, waiting, strict=True)]
        response_s = delay_s + sum(times)
        rate = number / (rest_s + response_s)
        waiting = [rate * time for time in times]
    return Flow(rate, response_s, tuple(rate * station.demand_s for station in stations))


def flow_at(viewers: int, rate_hz: float, stations: Sequence[Station]) -> Flow:
    """The same for viewers who want a frame so often, where nothing else keeps them from it [Hz]."""
    alone_s = sum(station.demand_s + station.delay_s for station in stations)
    return flow(viewers, max(0.0, 1.0 / rate_hz - alone_s), stations)


def one_service(work: Work, rates: Rates, machine: Machine, nodes: int) -> tuple[Station, ...]:
    """Stations where one service has its frames traced on `nodes` other nodes."""
    shares = pieces_of(work, rates, machine, nodes)
    pieces = sum(len(share) for share in shares)
    cells_s = work.cells / rates.pack_cells_per_s + work.cells / rates.take_cells_per_s
    trace_s = work.cells * work.samples / (rates.samples_per_s * machine.cores)
    bytes_a_cell = max(rates.bytes_out_per_cell, work.bytes_back_per_cell(rates))
    return (
        _cores("the service's cores", work, rates, machine, cells_s),
        Station("handing out", pieces * rates.piece_s, rates.round_trip_s),
        Station("the service's network", work.cells * bytes_a_cell / machine.bytes_per_s),
        Station("workers", trace_s / nodes, trace_s / len(shares) - trace_s / nodes),
    )


def own_service(work: Work, rates: Rates, machine: Machine) -> tuple[Station, ...]:
    """The station where a node serves its viewers alone: its cores, which trace too."""
    trace_s = work.cells * work.samples / (rates.samples_per_s * machine.cores)
    name, demand_s, delay_s = _cores("its cores", work, rates, machine, 0.0)
    return (Station(name, demand_s + trace_s, delay_s),)


def _cores(name: str, work: Work, rates: Rates, machine: Machine, alone_s: float) -> Station:
    """A service's cores: map and picture on all of them, encoding and `alone_s` on one each."""
    alone_s += work.encode_s(rates)
    together_s = work.picture_s(rates, machine.cores)
    demand_s = together_s + alone_s / machine.cores
    return Station(name, demand_s, together_s + alone_s - demand_s)
