"""Ctrl-C in a long run."""

from __future__ import annotations

import signal
import threading
import weakref
from collections.abc import Callable
from pathlib import Path

import pytest

from clients.command_line.interrupt import heeding
from renderer.frame import Abandoned
from tests.clients.commands import interrupted


def press() -> None:
    """Ctrl-C, heard before this returns."""
    signal.raise_signal(signal.SIGINT)


class Array:
    """Something that is freed."""


def heeded(*steps: Callable[[], object]) -> threading.Event:
    """Do some steps in one block that heeds Ctrl-C."""
    pressed = threading.Event()
    with heeding(pressed):
        for step in steps:
            step()
    return pressed


def give_up() -> None:
    """As the renderer does once its event is set."""
    raise Abandoned


def test_the_event_is_set_and_the_block_goes_on_until_it_ends() -> None:
    pressed, found = threading.Event(), []

    def block() -> None:
        with heeding(pressed):
            press()
            found.append(pressed.is_set())

    with pytest.raises(KeyboardInterrupt):
        block()
    assert found == [True]


def test_it_is_not_lost_where_python_drops_exceptions() -> None:
    arrays, after = [Array()], []
    weakref.finalize(arrays[0], press)
    with pytest.raises(KeyboardInterrupt):
        heeded(arrays.clear, lambda: after.append("freed"))
    assert after == ["freed"]


def test_a_frame_that_was_given_up_for_it_is_no_failure() -> None:
    with pytest.raises(KeyboardInterrupt):
        heeded(press, give_up)


def test_a_frame_that_was_given_up_for_something_else_is_one() -> None:
    with pytest.raises(Abandoned):
        heeded(give_up)


def test_the_second_time_it_stops_at_once() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt):
        heeded(press, lambda: reached.append("once"), press, lambda: reached.append("twice"))
    assert reached == ["once"]


def test_python_s_own_way_is_back_afterwards() -> None:
    heeded()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(KeyboardInterrupt):
        press()


def test_where_it_is_ignored_it_stays_so() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        pressed = heeded(press)
    finally:
        signal.signal(signal.SIGINT, before)
    assert not pressed.is_set()


def test_outside_the_main_thread_it_means_nothing() -> None:
    ended = []

    def work() -> None:
        heeded(lambda: ended.append(signal.getsignal(signal.SIGINT)))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert ended == [signal.default_int_handler]


def test_a_long_frame_is_given_up(tmp_path: Path) -> None:
    """Standard error is a terminal here. The only frame would take minutes."""
    words = (
        "atrium",
        "--gaze-trace",
        "simulated",
        "--seconds",
        "0.04",
        "--samples",
        "4096",
        "-o",
        str(tmp_path / "clip"),
    )
    seen = interrupted(b"rendering atrium", "animate", *words)
    assert b"stopped with 0 of 1 frames; the same command goes on" in seen
