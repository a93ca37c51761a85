"""The network of queues against closed forms, and the services made of it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clients.command_line.scaling.rates import Machine, Rates, Work
from clients.command_line.scaling.viewers_on_nodes import Station, flow, flow_at, one_service, own_service

FRAME = Work(pixels=2_073_600, cells=24_000)
DEMANDS = st.lists(st.floats(1e-4, 1.0), min_size=1, max_size=5)


def stations(demands: list[float]) -> list[Station]:
    return [Station(str(index), demand) for index, demand in enumerate(demands)]


@given(demands=DEMANDS, rest=st.floats(0.0, 10.0), delay=st.floats(0.0, 1.0))
def test_one_viewer_waits_for_nobody(demands: list[float], rest: float, delay: float) -> None:
    found = flow(1, rest, [*stations(demands), Station("delay", 0.0, delay)])
    assert found.response_s == pytest.approx(sum(demands) + delay)
    assert found.frames_per_s == pytest.approx(1 / (rest + sum(demands) + delay))


@given(viewers=st.integers(1, 60), kinds=st.integers(1, 6), demand=st.floats(1e-4, 1.0))
def test_equal_stations_without_rest(viewers: int, kinds: int, demand: float) -> None:
    """N customers, K stations of demand D: throughput N / ((N + K - 1) D)."""
    found = flow(viewers, 0.0, stations([demand] * kinds))
    assert found.frames_per_s == pytest.approx(viewers / ((viewers + kinds - 1) * demand))


@given(viewers=st.integers(1, 30), demand=st.floats(0.01, 1.0), rest=st.floats(0.01, 10.0))
def test_one_station_and_rest_is_the_machine_repairman(viewers: int, demand: float, rest: float) -> None:
    """Idle with probability 1 / sum over k of N! / (N - k)! (D / Z)^k."""
    terms = [math.perm(viewers, count) * (demand / rest) ** count for count in range(viewers + 1)]
    found = flow(viewers, rest, stations([demand]))
    assert found.frames_per_s == pytest.approx((1 - 1 / math.fsum(terms)) / demand)
    assert found.use == pytest.approx((1 - 1 / math.fsum(terms),))


@given(demands=DEMANDS, rest=st.floats(0.0, 10.0), viewers=st.integers(1, 80))
def test_more_viewers_get_more_together_and_less_each_within_the_bounds(
    demands: list[float], rest: float, viewers: int
) -> None:
    few, many = (flow(count, rest, stations(demands)) for count in (viewers, viewers + 1))
    assert many.frames_per_s >= few.frames_per_s * (1 - 1e-9)
    assert many.frames_per_s / (viewers + 1) <= few.frames_per_s / viewers * (1 + 1e-9)
    assert few.frames_per_s <= min(1 / max(demands), viewers / (rest + sum(demands))) * (1 + 1e-9)
    assert max(few.use) <= 1 + 1e-9


def test_who_wants_less_than_there_is_gets_it() -> None:
    assert flow_at(1, 60.0, own_service(FRAME, Rates(), Machine())).frames_per_s == pytest.approx(60.0)


def test_nodes_that_trace_do_not_help_a_busy_service_and_nodes_that_serve_do() -> None:
    """Each service has its own cores; workers have all the time in the world."""
    one = [flow_at(1000, 60.0, one_service(FRAME, Rates(), Machine(), nodes)).frames_per_s for nodes in (10, 1000)]
    assert one[1] < 1.01 * one[0]
    each = [flow_at(1000 // nodes, 60.0, own_service(FRAME, Rates(), Machine())).frames_per_s for nodes in (1, 10)]
    assert each[1] == pytest.approx(each[0], rel=0.01)  # of each node: ten nodes serve ten times as much


def test_workers_are_used_by_as_many_nodes_as_a_frame_is_cut_for() -> None:
    """A small frame goes to one node, whose cores it then has to itself."""
    trace_s = FRAME.cells / (Rates().samples_per_s * Machine().cores)
    workers = one_service(FRAME, Rates(), Machine(), 8)[-1]
    assert workers.demand_s == pytest.approx(trace_s / 8)
    assert workers.demand_s + workers.delay_s == pytest.approx(trace_s)
