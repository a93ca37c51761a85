"""Gaze sources over real sockets: what they say reaches the session's viewers as frames."""

from __future__ import annotations

import pytest

from service.protocol import Error, Gaze, GazeBatch, Margin, Ping, Pong, Ready, Status, Target
from tests.service.streaming import COARSE, TINY, configure, sessions, source, viewer


def test_a_source_may_come_first_and_learns_of_the_display(address: str) -> None:
    with source(address, "early") as tracker:
        ready = tracker.next(Ready)
        assert (ready.session, ready.config, ready.display) == ("early", None, None)
        tracker.say(Gaze(0.75, 0.5, "fraction", seq=1))
        with viewer(address, "early") as eye:
            eye.say(configure(2, gaze=None))
            ready = tracker.next(Ready)
            assert (ready.config, ready.display) == (2, {**TINY, "height_cm": None})
            header = eye.final().header
            assert header.gaze is not None
            assert (header.gaze.x, header.gaze.y, header.gaze.seq) == (48.0, 18.0, 1)
            eye.say(configure(3, gaze=None, display={**TINY, "width_px": 32}))
            ready = tracker.next(Ready)
            assert ready.display is not None
            assert ready.display["width_px"] == 32


def test_the_last_of_a_batch_counts(address: str) -> None:
    with viewer(address, "batch") as eye, source(address, "batch") as tracker:
        eye.say(configure())
        eye.final()
        samples = tuple(Gaze(float(x), 30.0, seq=x, tracker_time_ns=10 * x) for x in (2, 30, 60))
        tracker.say(GazeBatch(samples), GazeBatch(()))
        header = eye.frame().header
        assert header.gaze is not None
        assert (header.gaze.x, header.gaze.seq, header.gaze.tracker_time_ns) == (60.0, 60, 600)
        assert header.superseded == 2


def test_an_error_of_the_tracker_makes_cells_finer(address: str) -> None:
    with viewer(address, "margin") as eye:
        eye.say(configure(quality=COARSE, gaze={"x": 4.0, "y": 4.0}))
        before = eye.final().header.cost["map"]
        with source(address, "margin") as tracker:
            tracker.say(Margin(8.0))
            after = eye.final().header.cost["map"]
            assert after["margin_deg"] == pytest.approx(before["margin_deg"] + 8.0)
            assert after["cells"] > before["cells"]
        assert eye.final().header.cost["map"] == {**before, "cached": True}


def test_a_target_is_shown_to_every_viewer(address: str) -> None:
    with viewer(address, "target") as one, viewer(address, "target") as other, source(address, "target") as tracker:
        tracker.next(Status, lambda status: status.viewers == 2)
        targets = [Target(0.1, 0.9, "fraction", 0, 2), Target(None, None, "fraction", 2, 2)]
        tracker.say(*targets)
        for eye in (one, other):
            assert [eye.next(Target), eye.next(Target)] == targets


def test_a_source_asks_for_the_clock(address: str) -> None:
    with source(address, "clock") as tracker:
        tracker.say(Ping(1, 5), Ping(2, 6))
        first, second = tracker.next(Pong), tracker.next(Pong)
        assert (first.id, first.client_time_ns, second.id, second.client_time_ns) == (1, 5, 2, 6)
        assert first.service_time_ns <= second.service_time_ns


def test_a_source_sees_what_is_refused_and_counted(address: str) -> None:
    with viewer(address, "seen") as eye, source(address, "seen") as tracker:
        assert tracker.next(Status, lambda status: status.viewers == 1).gaze_sources == 1
        tracker.say(Gaze(valid=False))
        eye.say(configure(gaze=None))
        assert eye.frame().header.gaze_state == "none"
        tracker.say(Gaze(5.0, 5.0), Gaze(valid=False))
        assert tracker.next(Status, lambda status: status.gaze_state == "held")
        tracker.say(Gaze(5.0, 5.0, phase="blink"), Gaze(6.0, 5.0))
        assert tracker.next(Status, lambda status: status.gaze_state == "live")
        assert sessions(address)["seen"]["gaze_sources"] == 1
        eye.say(configure(2, "nowhere"))
        assert eye.next(Error).id == 2
