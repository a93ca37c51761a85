"""The short form of the soak, and what its verdict tells apart."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from clients.simulated_gaze import simulated_gaze
from tests.load.growth import BLOCKS
from tests.load.soak import Held, Soak, soak
from tests.service.process import service_process

SECONDS = 6.0
MIB = 1 << 20


def test_a_stream_is_held_and_looked_at() -> None:
    told: list[str] = []
    with service_process() as service:
        found = asyncio.run(soak(service, "matte", (64, 36), simulated_gaze(SECONDS / 2), SECONDS, told.append))
    assert found.connections == 1
    assert found.rejected == 0
    assert len(found.settled) >= BLOCKS
    assert found.series[-1].frames > found.series[0].frames > 0
    assert all(each.memory_bytes > each.kept_bytes > 0 for each in found.series)
    assert all(each.descriptors and each.threads for each in found.series)
    assert not told, "a line a minute"


@pytest.fixture
def flat() -> Soak:
    noise = np.random.default_rng(1).normal(0.0, MIB, 400)
    series = [Held(2.0 * i, 20 * i, 900 * MIB + int(noise[i]), 300 * MIB, 8, 10) for i in range(400)]
    return Soak(series, connections=1)


def test_flat_passes(flat: Soak) -> None:
    assert "flat: " in flat.verdict()


@pytest.mark.parametrize(
    "changed",
    [
        lambda held: replace(held, memory_bytes=held.memory_bytes + 2000 * held.frames),
        lambda held: replace(held, descriptors=8 + held.frames // 1000),
        lambda held: replace(held, threads=8 + held.frames // 1000),
    ],
)
def test_growth_does_not(flat: Soak, changed: Callable[[Held], Held]) -> None:
    with pytest.raises(AssertionError, match="memory"):
        Soak([changed(held) for held in flat.series], connections=1).verdict()


@pytest.mark.parametrize(("connections", "rejected"), [(2, 0), (1, 1)])
def test_nor_does_a_stream_that_broke_or_a_sample_that_is_no_light(flat: Soak, connections: int, rejected: int) -> None:
    with pytest.raises(AssertionError, match="memory"):
        Soak(flat.series, connections, rejected).verdict()


def test_what_is_kept_does_not_count(flat: Soak) -> None:
    more = [(held, 2000 * held.frames) for held in flat.series]
    series = [replace(held, memory_bytes=held.memory_bytes + n, kept_bytes=held.kept_bytes + n) for held, n in more]
    assert "flat: " in Soak(series, connections=1).verdict()


def test_growth_at_first_does_not_count(flat: Soak) -> None:
    series = [replace(held, memory_bytes=held.memory_bytes + MIB * min(i, 90)) for i, held in enumerate(flat.series)]
    assert "flat: " in Soak(series, connections=1).verdict()
