"""Simulated frames against what can be reckoned: one resource at a time, and all of them."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clients.command_line.scaling.frame_on_nodes import bounds, frame_s, pieces_of, trace_s
from clients.command_line.scaling.rates import Machine, Rates, Work

FREE = Rates(samples_per_s=1e6, pack_cells_per_s=1e30, take_cells_per_s=1e30, piece_s=0.0, round_trip_s=0.0, spread=0.0)
"""Only tracing takes time."""

ENDLESS_WIRE = Machine(cores=4, gbit_per_s=1e30)
WORK = Work(pixels=2_000_000, cells=960_000)


def simulated(work: Work, rates: Rates, machine: Machine, nodes: int) -> float:
    return trace_s(work, rates, machine, nodes, np.random.default_rng(7))


@pytest.mark.parametrize("nodes", [1, 2, 3, 10])
def test_tracing_alone_is_divided_evenly(nodes: int) -> None:
    assert simulated(WORK, FREE, ENDLESS_WIRE, nodes) == pytest.approx(960_000 / (4e6 * nodes), rel=1e-4)


def test_nothing_to_trace_takes_no_time() -> None:
    assert simulated(replace(WORK, cells=0), Rates(), Machine(), 3) == 0.0


def test_samples_count_each() -> None:
    four = simulated(replace(WORK, samples=4), FREE, ENDLESS_WIRE, 2)
    assert four == pytest.approx(4 * simulated(WORK, FREE, ENDLESS_WIRE, 2), rel=1e-4)


@pytest.mark.parametrize("nodes", [1, 7, 40])
def test_a_slow_thread_does_one_thing_after_the_other(nodes: int) -> None:
    rates = replace(FREE, samples_per_s=1e9, pack_cells_per_s=4e6, take_cells_per_s=1e6, piece_s=0.001)
    pieces = sum(map(len, pieces_of(WORK, rates, ENDLESS_WIRE, nodes)))
    expected = 960_000 / 4e6 + 960_000 / 1e6 + 0.001 * pieces
    assert simulated(WORK, rates, ENDLESS_WIRE, nodes) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("samples", "bytes_back"), [(1, 12), (2, 20), (32, 20)])
def test_a_slow_wire_carries_one_byte_after_the_other(samples: int, bytes_back: int) -> None:
    machine = Machine(cores=4, gbit_per_s=0.01)
    rates = replace(FREE, samples_per_s=1e8, bytes_out_per_cell=1e-6)
    expected = 960_000 * bytes_back * 8 / 1e7
    assert simulated(replace(WORK, samples=samples), rates, machine, 8) == pytest.approx(expected, rel=0.01)


def test_a_way_is_as_long_for_one_piece() -> None:
    rates = replace(FREE, round_trip_s=0.5)
    assert simulated(Work(4, 4), rates, ENDLESS_WIRE, 1) == pytest.approx(0.5 + 1e-6)


@given(
    cells=st.integers(1, 20_000),
    samples=st.integers(1, 8),
    nodes=st.integers(1, 60),
    gbit=st.floats(0.01, 100.0),
    piece_s=st.floats(0.0, 0.01),
    round_trip_s=st.floats(0.0, 0.01),
)
def test_a_frame_takes_as_long_as_its_slowest_part_and_no_longer_than_all(
    cells: int, samples: int, nodes: int, gbit: float, piece_s: float, round_trip_s: float
) -> None:
    work, machine = Work(cells, cells, samples), Machine(cores=2, gbit_per_s=gbit)
    rates = replace(FREE, pack_cells_per_s=1e7, take_cells_per_s=1e7, piece_s=piece_s, round_trip_s=round_trip_s)
    least = bounds(work, rates, machine, nodes)
    took = simulated(work, rates, machine, nodes)
    assert took >= max(least.hand, least.wire, least.trace) * (1 - 1e-9)
    shares = pieces_of(work, rates, machine, nodes)
    longest_s = max(map(sum, shares)) * samples / (rates.samples_per_s * machine.cores)
    both_ways = 1 + rates.bytes_out_per_cell / work.bytes_back_per_cell(rates)
    rounds = max(map(len, shares))
    assert took <= least.hand + both_ways * least.wire + longest_s + rounds * round_trip_s + 1e-9


@given(nodes=st.integers(1, 500))
def test_more_nodes_trace_faster_and_want_more_pieces(nodes: int) -> None:
    few, many = (bounds(WORK, Rates(), Machine(), count) for count in (nodes, 2 * nodes))
    assert many.trace == pytest.approx(few.trace / 2)
    assert many.hand >= few.hand * (1 - 1e-9)
    assert (many.picture, many.encode, many.wire) == (few.picture, few.encode, few.wire)


@given(cells=st.integers(0, 10**6), nodes=st.integers(1, 300))
def test_every_cell_is_in_one_piece(cells: int, nodes: int) -> None:
    shares = pieces_of(Work(cells, cells), Rates(), Machine(), nodes)
    assert sum(map(sum, shares)) == cells
    assert len(shares) <= nodes


def test_stragglers_delay_a_frame_and_chance_is_the_seeds() -> None:
    machine = Machine(cores=2, gbit_per_s=100.0)
    even, uneven = (
        [trace_s(WORK, replace(FREE, spread=spread), machine, 16, np.random.default_rng(seed)) for seed in range(8)]
        for spread in (0.0, 1.0)
    )
    assert sum(uneven) > 1.1 * sum(even)
    assert len(set(uneven)) > 1
    assert frame_s(WORK, Rates(), machine, 16, frames=2) == frame_s(WORK, Rates(), machine, 16, frames=2)


def test_what_the_service_does_alone_is_added() -> None:
    shown_s, map_s = 2e6 / Rates().picture_px_per_s / 4, 2e6 / Rates().map_px_per_s / 4
    assert replace(WORK, new_map=False).picture_s(Rates(), 4) == pytest.approx(shown_s)
    assert WORK.picture_s(Rates(), 4) == pytest.approx(shown_s + map_s)
    own_s = shown_s + map_s + 2e6 / Rates().encode_px_per_s
    traced_s = simulated(WORK, FREE, ENDLESS_WIRE, 2)
    assert frame_s(WORK, FREE, ENDLESS_WIRE, 2, frames=1) == pytest.approx(traced_s + own_s)
    assert min(astuple(bounds(WORK, Rates(), Machine(), 2))) > 0
