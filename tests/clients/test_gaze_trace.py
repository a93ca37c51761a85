"""Gaze traces: what is read is what was written, and what cannot be read is said with its place."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clients.gaze_trace import MILLISECONDS, GazeTrace, GazeTraceError, parse_gaze_trace, read_gaze_trace

RECORDING = Path(__file__).parents[3] / "shared" / "data" / "gaze" / "irf_S1_500hz.csv"
SMALL = "t_ms,x_px,y_px,valid,event\n0,10,20,1,fixation\n2,11,21,1,saccade\n4,,,0,blink\n6,-3.5,2e3,1,\n"

times = st.lists(st.integers(0, 10**9), min_size=1, max_size=30).map(sorted)
numbers = st.floats(-1e6, 1e6)
points = st.one_of(st.none(), st.tuples(numbers, numbers))


def test_a_small_trace_is_read_as_it_stands() -> None:
    trace = parse_gaze_trace(SMALL, "a.csv")
    np.testing.assert_array_equal(trace.time_ms, [0, 2, 4, 6])
    np.testing.assert_array_equal(trace.x, [10, 11, math.nan, -3.5])
    np.testing.assert_array_equal(trace.y, [20, 21, math.nan, 2000])
    assert trace.valid.tolist() == [True, True, False, True]
    assert trace.events == ("fixation", "saccade", "blink", "")
    assert (trace.unit, len(trace), trace.seconds) == ("px", 4, 0.006)


@given(
    ticks=times,
    data=st.data(),
    unit=st.sampled_from(["t_ms", "t_s", "t_us", "t_ns"]),
    suffix=st.sampled_from(["", "_px", "_fraction"]),
    states_valid=st.booleans(),
    order=st.randoms(use_true_random=False),
)
def test_whatever_is_written_is_read(
    ticks: list[int], data: st.DataObject, unit: str, suffix: str, states_valid: bool, order: st.DataObject
) -> None:
    """Columns by name in any order, beside others; lost samples blank; times in any unit."""
    gaze = [data.draw(points) for _ in ticks]
    columns = [unit, f"x{suffix}", f"y{suffix}", "pupil", *(["valid"] if states_valid else [])]
    order.shuffle(columns)  # type: ignore[attr-defined]
    lines = [",".join(columns)]
    for tick, point in zip(ticks, gaze, strict=True):
        x, y = ("", "") if point is None else (repr(part) for part in point)
        row = {unit: str(tick), f"x{suffix}": x, f"y{suffix}": y, "pupil": "wide", "valid": str(int(point is not None))}
        lines.append(",".join(row[column] for column in columns))
    trace = parse_gaze_trace("\r\n".join(lines), "a.csv")
    np.testing.assert_allclose(trace.time_ms, np.array(ticks) * MILLISECONDS[unit])
    assert trace.valid.tolist() == [point is not None for point in gaze]
    expected = np.array([point or (math.nan, math.nan) for point in gaze])
    np.testing.assert_array_equal(np.stack([trace.x, trace.y], axis=1), expected)
    assert trace.unit == ("fraction" if suffix == "_fraction" else "px")


@given(st.text(alphabet=st.sampled_from('tmsxy_px,\n\r"0123456789.-eventvalid\0é'), max_size=200))
def test_any_text_is_a_trace_or_one_line_that_names_the_file(text: str) -> None:
    for attempt in (text, "t_ms,x_px,y_px\n" + text):
        trace, said = attempted(attempt)
        if trace is None:
            assert said.startswith("a.csv: ")
            assert "\n" not in said
        else:
            assert (np.diff(trace.time_ms) >= 0).all()
            assert np.isfinite(trace.x[trace.valid]).all()


def attempted(text: str) -> tuple[GazeTrace | None, str]:
    """The trace, or the complaint."""
    try:
        return parse_gaze_trace(text, "a.csv"), ""
    except GazeTraceError as error:
        return None, str(error)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "line 1: expected a column t_ms or t_s or t_us or t_ns, found []"),
        ("t_ms,y_px\n1,2", "line 1: expected a column x_px or x or x_fraction, found ['t_ms', 'y_px']"),
        ("t_ms,x_px,y\n1,2,3", "line 1: expected a column y_px beside x_px, found ['t_ms', 'x_px', 'y']"),
        ("t_ms,x,y,x\n1,2,3,4", "line 1: expected each column once, found 'x' twice"),
        ("t_ms,x,y\n", "expected at least one sample below the header, found none"),
        ("t_ms,x,y\n1,2,3\n2,3", "line 3: expected 3 columns as in line 1, found 2"),
        ("t_ms,x,y\nsoon,2,3", "line 2: t_ms: expected a number, found 'soon'"),
        ("t_ms,x,y\n1,2,3\n\n0.5,2,3", "line 4: t_ms: expected a time not before the last one, found 0.5"),
        ("t_ms,x,y\n1,2,far", "line 2: y: expected a number, found 'far'"),
        ("t_ms,x,y\n1,inf,3", "line 2: x: expected a number, found 'inf'"),
        ("t_ms,x,y,valid\n1,,3,1", "line 2: x: expected a number, found ''"),
        ("t_ms,x,y,valid\n1,2,3,maybe", "line 2: valid: expected 1 or 0, found 'maybe'"),
        ('t_ms,x,y\n1,2,"3', "line 2: expected CSV, found a mistake: unexpected end of data"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(text: str, complaint: str) -> None:
    with pytest.raises(GazeTraceError) as caught:
        parse_gaze_trace(text, "a.csv")
    assert str(caught.value) == f"a.csv: {complaint}"


def test_a_file_that_is_no_text_is_said_to_be_none(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"t_ms,x,y\n1,2,\xff")
    with pytest.raises(GazeTraceError, match=r"a\.csv: expected UTF-8 text, found another byte at 13"):
        read_gaze_trace(tmp_path / "a.csv")


def test_a_byte_order_mark_is_no_part_of_the_first_column(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbft_ms,x,y\n1,2,3\n")
    assert len(read_gaze_trace(tmp_path / "a.csv")) == 1


@given(ticks=times, seconds=st.floats(-1.0, 1.1e6))
def test_the_newest_sample_not_later_is_shown(ticks: list[int], seconds: float) -> None:
    lines = ["t_ms,x,y", *(f"{tick},{index},0" for index, tick in enumerate(ticks))]
    trace = parse_gaze_trace("\n".join(lines), "a.csv")
    chosen = trace.newest(seconds)
    now = ticks[0] + seconds * 1e3
    assert chosen == max([index for index, tick in enumerate(ticks) if tick <= now + 5e-7], default=0)


def test_playback_takes_the_newest_sample_at_each_tick() -> None:
    trace = parse_gaze_trace(SMALL, "a.csv")
    assert [(at, sample.time_ms) for at, sample in trace.played(1e3 / 3)] == [(0.0, 0.0), (0.003, 2.0), (0.006, 6.0)]
    assert [sample.time_ms for _, sample in trace.played(200, seconds=0.02)] == [0, 4, 6, 6, 6]
    frames = [sample.time_ms for _, sample in parse_gaze_trace(every_millisecond(2000), "a.csv").played(25)]
    assert frames == [40.0 * frame for frame in range(50)], "rounding of k/25 must not reach for an older sample"


def every_millisecond(count: int) -> str:
    return "t_ms,x,y\n" + "".join(f"{tick},0,0\n" for tick in range(count))


def test_a_lost_eye_holds_the_last_good_gaze() -> None:
    trace = parse_gaze_trace("t_ms,x,y\n0,,\n1,5,6\n2,,\n3,,\n4,7,8\n", "a.csv").held((1.0, 2.0))
    np.testing.assert_array_equal(trace.x, [1, 5, 5, 5, 7])
    np.testing.assert_array_equal(trace.y, [2, 6, 6, 6, 8])
    assert trace.valid.all()


def test_a_trace_is_scaled_to_the_screen_it_is_played_on() -> None:
    fractions = parse_gaze_trace("t_ms,x_fraction,y_fraction\n0,0.25,0.5\n", "a.csv").on_screen(200, 100)
    assert (fractions.x[0], fractions.y[0], fractions.unit) == (50, 50, "px")
    pixels = parse_gaze_trace("t_ms,x,y\n0,960,540\n", "a.csv")
    assert pixels.on_screen(200, 100) is pixels
    scaled = pixels.on_screen(200, 100, recorded_px=(1920, 1080))
    assert (scaled.x[0], scaled.y[0]) == (100, 50)


def test_a_real_recording_is_read() -> None:
    if not RECORDING.exists():
        pytest.skip("the recording is not beside this checkout")
    trace = read_gaze_trace(RECORDING)
    assert (len(trace), trace.seconds) == (10_001, 20.0)
    assert (trace.x[0], trace.y[0]) == (962.78, 836.80)
    assert Counter(trace.events).keys() == {"fixation", "saccade", "post_saccadic", "blink"}
    assert trace.valid.sum() == 9845
