"""Hysteresis of the gaze, against made-up and recorded gaze."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.display import Display
from renderer.gaze import Gaze, GazeBucket, bucket_of
from renderer.steady_gaze import slack_deg, slack_px, steady_bucket, within

RECORDING = Path(__file__).parents[3] / "shared" / "data" / "gaze" / "irf_S1_500hz.csv"

SCREEN = st.floats(-100.0, 2000.0)


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
