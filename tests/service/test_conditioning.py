"""From raw gaze to what is rendered for: pure functions, against made-up gaze."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from service import protocol
from service.conditioning import (
    HOLD_NS,
    LONGEST_SACCADE_NS,
    NS_PER_MS,
    Attention,
    elapse,
    next_change_ns,
    observe,
)

GOOD, LOST = protocol.Gaze(10.0, 20.0), protocol.Gaze(valid=False)


def test_a_blink_is_held_and_a_loss_is_not() -> None:
    live = observe(Attention(), GOOD, 100)
    assert (live.state, live.sample, next_change_ns(live)) == ("live", GOOD, None)
    held = observe(live, LOST, 200)
    assert (held.state, held.sample, next_change_ns(held)) == ("held", GOOD, 200 + HOLD_NS)
    assert observe(held, LOST, 200 + HOLD_NS - 1) == held
    lost = elapse(held, 200 + HOLD_NS)
    assert lost.state == "lost"
    assert observe(held, LOST, 200 + HOLD_NS) == lost
    assert observe(lost, LOST, 300 + HOLD_NS) == lost
    assert observe(lost, GOOD, 400 + HOLD_NS).state == "live"
    assert observe(held, GOOD, 300).state == "live"


def test_a_gaze_that_rests_is_not_lost() -> None:
    assert elapse(observe(Attention(), GOOD, 0), 10**15).state == "live"


def test_nothing_is_held_before_the_first_good_gaze() -> None:
    assert observe(Attention(), LOST, 0) == elapse(Attention(), 10**15) == Attention()


def test_a_blink_that_the_tracker_names_is_no_gaze() -> None:
    blink = protocol.Gaze(1.0, 2.0, phase="blink")
    assert observe(observe(Attention(), GOOD, 0), blink, 1).sample == GOOD


def test_a_saccade_ends_with_its_landing_its_loss_or_its_time() -> None:
    flying = observe(Attention(), protocol.Gaze(1.0, 2.0, phase="saccade"), 50)
    assert flying.saccade
    assert next_change_ns(flying) == 50 + LONGEST_SACCADE_NS
    assert elapse(flying, 50 + LONGEST_SACCADE_NS - 1).saccade
    assert not elapse(flying, 50 + LONGEST_SACCADE_NS).saccade
    assert not observe(flying, GOOD, 60).saccade
    assert not observe(flying, LOST, 60).saccade


@given(st.lists(st.tuples(st.booleans(), st.integers(0, HOLD_NS)), max_size=30))
def test_the_state_is_what_the_samples_say(steps: list[tuple[bool, int]]) -> None:
    """Live after a good sample; else held while the last good one was less than the hold before the first bad one."""
    attention, now_ns, seen, bad_since = Attention(), 0, False, None
    for valid, pause_ns in steps:
        now_ns += pause_ns
        attention = observe(attention, GOOD if valid else LOST, now_ns)
        seen, bad_since = seen or valid, None if valid else (now_ns if bad_since is None else bad_since)
        if bad_since is None:
            expected = "live"
        elif not seen:
            expected = "none"
        else:
            expected = "held" if now_ns - bad_since < HOLD_NS else "lost"
        assert attention.state == expected


def test_the_hold_is_longer_than_a_blink() -> None:
    assert HOLD_NS == 600 * NS_PER_MS
