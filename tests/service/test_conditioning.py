"""From raw gaze to what is rendered for: pure functions, against made-up and recorded gaze."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.display import Display
from renderer.gaze import Gaze, GazeBucket, bucket_of
from service import protocol
from service.conditioning import (
    HOLD_NS,
    LONGEST_SACCADE_NS,
    NS_PER_MS,
    Attention,
    elapse,
    next_change_ns,
    observe,
    slack_deg,
    slack_px,
    steady_bucket,
    within,
)

RECORDING = Path(__file__).parents[3] / "shared" / "data" / "gaze" / "irf_S1_500hz.csv"

GOOD, LOST = protocol.Gaze(10.0, 20.0), protocol.Gaze(valid=False)
SCREEN = st.floats(-100.0, 2000.0)


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


@given(SCREEN, SCREEN, st.lists(st.tuples(SCREEN, SCREEN), max_size=20), st.integers(0, 64))
def test_a_bucket_is_kept_only_near_its_gaze(x: float, y: float, moves: list[tuple[float, float]], side: int) -> None:
    bucket: GazeBucket | None = None
    for gaze in (Gaze(x, y), *(Gaze(*move) for move in moves)):
        bucket = steady_bucket(bucket, gaze, side)
        nearest = within(bucket, gaze)
        assert bucket_of(nearest, side) == bucket
        assert max(abs(nearest.x - gaze.x), abs(nearest.y - gaze.y)) <= slack_px(side) * (1 + 1e-9) + 1e-9


def test_jitter_across_an_edge_stays_in_one_bucket() -> None:
    edge = 24.0
    bucket = bucket_of(Gaze(edge + 1.0, 0.0), 16)
    for step in range(100):
        gaze = Gaze(edge + (3.0 if step % 2 else -3.0), 0.0)
        assert steady_bucket(bucket, gaze, 16) == bucket
    assert steady_bucket(bucket, Gaze(edge - 4.1, 0.0), 16) != bucket
    assert steady_bucket(bucket, Gaze(edge - 1.0, 0.0), 32) == bucket_of(Gaze(edge - 1.0, 0.0), 32)


@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0), st.floats(0.0, 2.0 * math.pi))
def test_the_margin_covers_the_slack_everywhere(x_cm: float, y_cm: float, turn: float) -> None:
    """No two points of the screen that are the slack apart are farther apart for the eye than the margin says."""
    display = Display(1920, 1080, 50.0, 35.0, 60.0)
    pitch = max(display.pitch_x_cm, display.pitch_y_cm)
    reach = math.sqrt(2.0) * slack_px(16) * pitch
    ax, ay = x_cm, y_cm
    bx, by = x_cm + reach * math.cos(turn), y_cm + reach * math.sin(turn)
    cosine = (ax * bx + ay * by + 3600.0) / math.sqrt((ax * ax + ay * ay + 3600.0) * (bx * bx + by * by + 3600.0))
    margin_deg = slack_deg(16, pitch, display.distance_cm)
    assert math.degrees(math.acos(min(1.0, cosine))) <= margin_deg * 1.001
    assert slack_deg(0, pitch, 60.0) == 0.0


@pytest.mark.skipif(not RECORDING.exists(), reason="the recorded gaze is not beside this checkout")
def test_recorded_fixations_change_their_bucket_less_often() -> None:
    """During the fixations of a real eye, the slack spares most changes of the map; while the eye moves, none."""
    with RECORDING.open() as lines:
        rows = list(csv.DictReader(lines))
    changes = {"steady": 0, "plain": 0}
    steady: GazeBucket | None = None
    plain: GazeBucket | None = None
    for row in rows:
        if row["valid"] != "1":
            continue
        gaze = Gaze(float(row["x_px"]), float(row["y_px"]))
        found, nearest = steady_bucket(steady, gaze, 16), bucket_of(gaze, 16)
        if row["event"] == "fixation":
            changes["steady"] += found != steady
            changes["plain"] += nearest != plain
        assert abs(found.x - gaze.x) <= 12.0
        steady, plain = found, nearest
    assert changes["plain"] > 400
    assert changes["steady"] < changes["plain"] / 5


def test_the_hold_is_longer_than_a_blink() -> None:
    assert HOLD_NS == 600 * NS_PER_MS
