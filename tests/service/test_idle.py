"""Idle time: none while somebody waits for a frame, over at once when somebody does."""

from __future__ import annotations

import threading
import time

import pytest

from service.idle import Closed, Idle
from tests.service.conftest import PATIENCE_S


def test_idle_work_is_interrupted_as_soon_as_somebody_waits_for_a_frame() -> None:
    idle = Idle(quiet_s=0.0)
    interrupt = idle.wait()
    assert not interrupt.is_set()
    with idle.busy():
        assert interrupt.is_set()
    assert not idle.wait().is_set()


def test_there_is_no_idle_time_before_the_last_frame_is_done_and_some_quiet_after_it() -> None:
    idle = Idle(quiet_s=0.1)
    began: list[float] = []

    def work() -> None:
        idle.wait()
        began.append(time.monotonic())

    with idle.busy():
        with idle.busy():
            worker = threading.Thread(target=work)
            worker.start()
        worker.join(0.2)
        assert not began
        ended = time.monotonic()
    worker.join(PATIENCE_S)
    assert began[0] >= ended + 0.1


def test_closing_interrupts_work_and_ends_waiting() -> None:
    idle = Idle(quiet_s=0.0)
    interrupt = idle.wait()
    raised: list[BaseException] = []

    def wait() -> None:
        try:
            idle.wait()
        except Closed as closed:
            raised.append(closed)

    with idle.busy():
        waiting = threading.Thread(target=wait)
        waiting.start()
        idle.close()
        waiting.join(PATIENCE_S)
    assert interrupt.is_set()
    assert len(raised) == 1
    with pytest.raises(Closed):
        idle.wait()


def test_a_frame_that_fails_ends_the_wait_too() -> None:
    idle = Idle(quiet_s=0.0)
    with pytest.raises(ZeroDivisionError), idle.busy():
        1 / 0  # noqa: B018
    assert not idle.wait().is_set()
