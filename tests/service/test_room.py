"""Memory for frames in work: never more than there is, in the order of asking, and nobody waits for ever."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.frame import Abandoned
from service.jobs import Stopping
from service.room import Room
from tests.service.conftest import PATIENCE_S


@given(st.lists(st.integers(0, 10), min_size=1, max_size=30))
def test_never_more_is_lent_than_there_is_and_all_come_to_their_turn(sizes: list[int]) -> None:
    room, most = Room(10), []

    def hold(nbytes: int) -> None:
        with room.take(nbytes):
            most.append(room.lent)

    with ThreadPoolExecutor(8) as threads:
        list(threads.map(hold, sizes, timeout=PATIENCE_S))
    assert len(most) == len(sizes)
    assert max(most) <= 10
    assert room.lent == 0


def test_a_large_one_is_not_passed_by_small_ones_that_came_later() -> None:
    room, order, asked = Room(10), [], threading.Event()

    def hold(name: str, nbytes: int) -> None:
        asked.set()
        with room.take(nbytes):
            order.append(name)

    with ThreadPoolExecutor(2) as threads, room.take(6):
        large = threads.submit(hold, "large", 10)
        assert asked.wait(PATIENCE_S)
        while not room.waiting:
            pass
        small = threads.submit(hold, "small", 1)
        while room.waiting < 2:
            pass
        assert order == []
        assert not large.done()
        assert not small.done()
    assert order == ["large", "small"]


def test_a_frame_that_is_given_up_waits_no_longer_and_leaves_the_others_their_turn() -> None:
    room, abandon = Room(10), threading.Event()

    def hold() -> None:
        with room.take(5, abandon):
            pass

    with ThreadPoolExecutor(1) as threads:
        with room.take(10):
            given_up = threads.submit(hold)
            while not room.waiting:
                pass
            abandon.set()
            with pytest.raises(Abandoned):
                given_up.result(PATIENCE_S)
        with room.take(10):
            assert room.lent == 10


def test_who_waits_is_sent_away_when_the_service_ends() -> None:
    room = Room(10)

    def hold() -> None:
        with room.take(5):
            pass

    with ThreadPoolExecutor(1) as threads, room.take(10):
        waiting = threads.submit(hold)
        while not room.waiting:
            pass
        room.close()
        with pytest.raises(Stopping):
            waiting.result(PATIENCE_S)


def test_more_than_there_will_ever_be_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="expected at most 10 bytes, found 11"), Room(10).take(11):
        pass
