"""From samples to gaze: places on the screen, lost eyes, and what is never sent."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clients.bridge.calibration import Calibration, Model, Pair, fit, load_calibration
from clients.bridge.calibration_walk import (
    ARRIVE_NS,
    LOOK_NS,
    NINE_POINTS,
    PATIENCE_NS,
    CalibrationWalk,
    WalkState,
    middle_of,
)
from clients.bridge.clock import DeviceClock
from clients.bridge.codec import MILLISECOND_NS
from clients.bridge.errors import ConfigError
from clients.bridge.gaze import SILENCE_NS, Gaze, GazeOptions, GazePath
from clients.bridge.sample import Eye, Point, Sample
from clients.bridge.screen import Origin, Place, Screen, Unit
from clients.bridge.slot import MOST_CHANGES, TOO_OLD_NS, Slot

SCREEN = Screen(1920, 1080, 50, 30, 60)
STEP_NS = 4 * MILLISECOND_NS


# Places


@pytest.mark.parametrize(
    ("unit", "origin", "point", "fraction"),
    [
        (Unit.PX, Origin.TOP_LEFT, (480, 270), (0.25, 0.25)),
        (Unit.PX, Origin.BOTTOM_LEFT, (480, 270), (0.25, 0.75)),
        (Unit.PX, Origin.CENTER, (-480, 270), (0.25, 0.75)),
        (Unit.FRACTION, Origin.TOP_LEFT, (0.25, 1.085), (0.25, 1.085)),
        (Unit.FRACTION, Origin.BOTTOM_LEFT, (0.25, 0.75), (0.25, 0.25)),
        (Unit.ASL, Origin.TOP_LEFT, (65, 60), (0.25, 0.25)),
        (Unit.DEG, Origin.CENTER, (0, 0), (0.5, 0.5)),
        (Unit.DEG, Origin.CENTER, (math.degrees(math.atan(25 / 60)), 0), (1.0, 0.5)),
        (Unit.DEG, Origin.BOTTOM_LEFT, (0, math.degrees(math.atan(15 / 60))), (0.5, 0.0)),
        (Unit.RAW, Origin.TOP_LEFT, (255.3, 127.9), (255.3, 127.9)),
    ],
)
def test_a_devices_numbers_have_a_place(
    unit: Unit, origin: Origin, point: tuple[float, float], fraction: tuple[float, float]
) -> None:
    place = Place(unit, origin, SCREEN)
    assert place.fraction(Point(*point)) == pytest.approx(fraction)
    assert place.device(Point(*fraction)) == pytest.approx(point)


@given(x=st.floats(-1, 2), y=st.floats(-1, 2))
def test_degrees_and_back(x: float, y: float) -> None:
    assert SCREEN.fraction(*SCREEN.degrees(x, y)) == pytest.approx((x, y), abs=1e-9)


def test_an_angle_is_that_between_two_lines_of_sight() -> None:
    assert SCREEN.angle(Point(0.5, 0.5), Point(1, 0.5)) == pytest.approx(math.degrees(math.atan(25 / 60)))
    corner = SCREEN.angle(Point(0, 0), Point(1, 1))
    assert corner == pytest.approx(2 * math.degrees(math.atan(math.hypot(25, 15) / 60)))


def test_angles_of_90_degrees_are_nowhere() -> None:
    assert all(math.isnan(part) for part in Place(Unit.DEG, Origin.CENTER, SCREEN).fraction(Point(90, 0)))


def test_a_screen_has_a_size() -> None:
    with pytest.raises(ConfigError, match="width_cm"):
        Screen(width_cm=0)


# Lost eyes


def path(unit: Unit = Unit.FRACTION, calibration: Calibration | None = None, **options: object) -> GazePath:
    return GazePath(Place(unit, Origin.TOP_LEFT, SCREEN), DeviceClock(()), GazeOptions(**options), calibration)  # type: ignore[arg-type]


def run(gaze_path: GazePath, points: list[Point | None]) -> list[Gaze]:
    return [gaze_path.take(Sample(0, 1, both=point), i * STEP_NS, i * STEP_NS) for i, point in enumerate(points)]


HERE = Point(0.5, 0.4)


def test_a_loss_is_told_at_once_and_trust_returns_after_a_while() -> None:
    gazes = run(path(pad_ns=50 * MILLISECOND_NS), [HERE] * 5 + [None] * 20 + [HERE] * 20)
    valid = [gaze.valid for gaze in gazes]
    assert valid == [True] * 5 + [False] * 20 + [False] * 13 + [True] * 7
    assert {gaze.phase for gaze in gazes if not gaze.valid} == {"blink"}
    assert all((gaze.x, gaze.y) == (None, None) for gaze in gazes if not gaze.valid)
    assert [gaze.seq for gaze in gazes] == list(range(45))


def test_a_second_loss_starts_the_wait_anew() -> None:
    gazes = run(path(pad_ns=20 * MILLISECOND_NS), [HERE, None, HERE, HERE, None, HERE, HERE, HERE, HERE, HERE, HERE])
    assert [gaze.valid for gaze in gazes] == [True] + [False] * 9 + [True]


def test_an_eye_is_lost_when_no_sample_comes_and_that_is_said_once() -> None:
    gaze_path = path()
    assert gaze_path.missing(10**12, gone=True) is None
    (last,) = run(gaze_path, [HERE])
    assert gaze_path.missing(SILENCE_NS - 1) is None
    gaze = gaze_path.missing(SILENCE_NS)
    assert gaze is not None
    assert (gaze.valid, gaze.seq, gaze.captured_ns) == (False, last.seq + 1, SILENCE_NS)
    assert gaze_path.missing(SILENCE_NS + 1, gone=True) is None
    gaze_path = path()
    run(gaze_path, [HERE])
    assert gaze_path.missing(1, gone=True) is not None


def test_the_first_gaze_counts_at_once() -> None:
    assert run(path(), [HERE])[0].valid


@given(
    x=st.floats(allow_nan=True, allow_infinity=True),
    y=st.floats(allow_nan=True, allow_infinity=True),
    unit=st.sampled_from(list(Unit)),
)
def test_what_is_sent_is_finite_and_near_the_screen(x: float, y: float, unit: Unit) -> None:
    (gaze,) = run(path(unit), [Point(x, y)])
    if gaze.x is not None and gaze.y is not None:
        assert max(abs(gaze.x - 0.5), abs(gaze.y - 0.5)) <= 2.5


@pytest.mark.parametrize("code", [Point(3.6, 0.5), Point(0.5, -2.6), Point(1e30, 0), Point(math.nan, 0.5)])
def test_codes_far_off_the_screen_are_a_lost_eye(code: Point) -> None:
    assert not run(path(), [code])[0].valid


def test_a_saccade_is_told_and_forgotten_over_a_blink() -> None:
    course = [Point(0.3, 0.5)] * 5 + [Point(0.35, 0.5), Point(0.45, 0.5)] + [Point(0.5, 0.5)] * 4
    phases = [gaze.phase for gaze in run(path(), course)]
    assert phases == ["fixation"] * 5 + ["saccade"] * 3 + ["fixation"] * 3
    jumped = run(path(pad_ns=0), [Point(0.1, 0.5)] * 3 + [None] + [Point(0.9, 0.5)] * 3)
    assert [gaze.phase for gaze in jumped] == ["fixation"] * 3 + ["blink"] + ["fixation"] * 3


def test_the_filter_is_off_unless_asked_for() -> None:
    jitter = [Point(0.5 + 0.001 * (-1) ** i, 0.5) for i in range(20)]
    assert [gaze.x for gaze in run(path(), jitter)] == [point.x for point in jitter]
    calm = [gaze.x for gaze in run(path(smooth=True), jitter)]
    assert max(abs(x - 0.501) for x in calm if x is not None) < 0.0012
    assert len(set(calm[5:])) > 1
    assert max(calm[10:]) - min(calm[10:]) < 0.0005  # type: ignore[type-var, operator]


def test_one_eye_or_both() -> None:
    sample = Sample(0, 1, left=Point(0.2, 0.4), right=Point(0.4, 0.6))
    expected = {Eye.LEFT: (0.2, 0.4), Eye.RIGHT: (0.4, 0.6), Eye.BEST: (0.3, 0.5), Eye.AVERAGE: (0.3, 0.5)}
    for eye, at in expected.items():
        gaze = path(eye=eye).take(sample, 0, 0)
        assert (gaze.x, gaze.y) == pytest.approx(at)
    half = sample._replace(right=None)
    assert [path(eye=eye).take(half, 0, 0).valid for eye in Eye] == [True, True, False, False]


# Calibration


def distorted(target: Point) -> Point:
    """What a camera might say of a target."""
    u, v = target.x - 0.5, target.y - 0.5
    return Point(250 + 300 * u - 20 * v, 130 - 15 * u + 200 * v)


def curved(measured: Point) -> Point:
    u, v = (measured.x - 250) / 200, (measured.y - 130) / 100
    return Point(0.5 + 0.4 * u + 0.05 * u * v - 0.03 * u * u, 0.5 + 0.4 * v + 0.02 * v * v)


def test_an_affine_mapping_is_found_exactly() -> None:
    pairs = tuple(Pair(distorted(target), target) for target in NINE_POINTS)
    calibration = fit(Model.AFFINE, pairs)
    for target in (Point(0.3, 0.7), Point(-0.2, 1.1)):
        assert calibration.apply(distorted(target)) == pytest.approx(target)
    assert calibration.margin_deg(SCREEN) == pytest.approx(0, abs=1e-9)


def test_a_quadratic_mapping_is_found_exactly_and_an_affine_one_says_how_far_off_it_is() -> None:
    measured = [distorted(target) for target in NINE_POINTS]
    pairs = tuple(Pair(point, curved(point)) for point in measured)
    quadratic = fit(Model.QUADRATIC, pairs)
    assert quadratic.apply(Point(200, 150)) == pytest.approx(curved(Point(200, 150)))
    assert max(quadratic.residuals_deg(SCREEN)) < 1e-9
    affine = fit(Model.AFFINE, pairs)
    assert affine.margin_deg(SCREEN) > max(quadratic.residuals_deg(SCREEN)) + 0.05


def test_the_margin_is_not_flattered_by_a_model_that_passes_through_its_points() -> None:
    pairs = tuple(Pair(Point(target.x, target.y + 0.01 * (-1) ** i), target) for i, target in enumerate(NINE_POINTS))
    calibration = fit(Model.QUADRATIC, pairs[:7])
    assert calibration.margin_deg(SCREEN) > 2 * max(calibration.residuals_deg(SCREEN))


def test_a_calibration_survives_its_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    pairs = tuple(Pair(distorted(target), target) for target in NINE_POINTS)
    file = tmp_path / "lab.json"
    fit(Model.QUADRATIC, pairs).save(file)
    loaded = load_calibration(file)
    assert loaded.pairs == pairs
    gaze = run(path(Unit.RAW, loaded), [distorted(Point(0.3, 0.6))])[0]
    assert (gaze.x, gaze.y) == pytest.approx((0.3, 0.6))
    assert gaze.measured == pytest.approx(distorted(Point(0.3, 0.6)))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "a model and points"),
        ('{"model": "cubic", "points": []}', "a model and points"),
        ('{"model": "affine", "points": [[1, 2, 3]]}', "a model and points"),
        ('{"model": "affine", "points": [[1, 2, 0, 0], [2, 3, 1, 1]]}', "3 points or more"),
        ('{"model": "affine", "points": [[1, 2, 0, 0], [2, 3, 1, 1], [3, 4, 0, 1]]}', "points that settle"),
        ('{"model": "affine", "points": [[1, 2, 0, 0], [1, 3, 1, 1], [1, 4, 0, 1]]}', "differ in x and in y"),
        ('{"model": "affine", "points": [[1, NaN, 0, 0], [2, 3, 1, 1], [1, 4, 0, 1]]}', "finite"),
    ],
)
def test_a_broken_calibration_is_refused_by_name(tmp_path, text: str, complaint: str) -> None:  # type: ignore[no-untyped-def]
    file = tmp_path / "lab.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_calibration(file)
    assert "lab.json" in str(caught.value)


def test_a_walk_shows_nine_points_and_takes_what_is_measured_once_the_eye_has_arrived() -> None:
    walk, now, shown = CalibrationWalk(), 0, []
    while walk.state is WalkState.WALKING:
        arrived = bool(shown) and now - shown[-1][1] >= ARRIVE_NS
        at = distorted(walk.target) if arrived else Point(-5000, 0)
        blinks = now // STEP_NS % 10 == 0
        if walk.step(now, None if blinks else at) and walk.state is WalkState.WALKING:
            shown.append((walk.target, now))
        now += STEP_NS
    assert walk.state is WalkState.DONE
    assert tuple(target for target, _ in shown) == NINE_POINTS
    assert [pair.target for pair in walk.pairs] == list(NINE_POINTS)
    assert fit(Model.AFFINE, tuple(walk.pairs)).margin_deg(SCREEN) == pytest.approx(0, abs=1e-9)
    assert now <= 10 * (ARRIVE_NS + LOOK_NS)


def test_a_walk_without_an_eye_ends() -> None:
    walk = CalibrationWalk()
    assert walk.step(0, None)
    assert not walk.step(PATIENCE_NS, None)
    assert walk.step(PATIENCE_NS + 1, None)
    assert walk.state is WalkState.FAILED
    assert not walk.step(PATIENCE_NS + 2, None)


def test_glances_elsewhere_do_not_count() -> None:
    points = [Point(10 + 0.1 * (i % 3), 20 - 0.1 * (i % 2)) for i in range(20)] + [Point(400, 5)] * 3
    assert middle_of(points) == pytest.approx((10.1, 19.95), abs=0.02)


# The slot


def gaze(seq: int, valid: bool = True, at_ns: int = 0) -> Gaze:
    x = 0.5 if valid else None
    return Gaze(seq, x, x, None, at_ns, at_ns, at_ns, None, None)


def test_the_newest_gaze_replaces_the_one_that_waits() -> None:
    slot = Slot()
    for seq in range(100):
        slot.put(gaze(seq))
        assert len(slot) == 1
    assert [item.seq for item in slot.take(0)] == [99]
    assert slot.dropped == 99
    for seq in range(100, 200):
        slot.put(gaze(seq))
    assert [item.seq for item in slot.take(0)] == [199]


@settings(max_examples=200)
@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=60))
def test_no_change_is_ever_lost_and_little_waits(steps: list[tuple[bool, bool]]) -> None:
    """Each step brings a gaze; some are followed by a send. What was sent changes as often as what was put."""
    slot, put = Slot(), [True]
    slot.put(gaze(0))
    sent = slot.take(0)
    for seq, (valid, take) in enumerate(steps, 1):
        slot.put(gaze(seq, valid))
        put.append(valid)
        changes = len(runs(put))
        assert len(slot) <= changes + 1
        if take:
            sent += slot.take(0)
            assert sent[-1].seq == seq
    sent += slot.take(0)
    assert runs([item.valid for item in sent]) == runs(put)
    assert [item.seq for item in sent] == sorted(item.seq for item in sent)
    assert slot.dropped == len(put) - len(sent)


def runs(values: list[bool]) -> list[bool]:
    return [value for index, value in enumerate(values) if index == 0 or values[index - 1] != value]


def test_after_a_stall_only_changes_and_what_is_new_are_sent() -> None:
    slot = Slot()
    slot.put(gaze(0))
    slot.take(0)
    slot.put(gaze(1, True, 0))
    slot.put(gaze(2, False, 0))
    slot.put(gaze(3, False, 0))
    assert [item.seq for item in slot.take(TOO_OLD_NS + 1)] == [2]
    slot.put(gaze(4, False, TOO_OLD_NS))
    assert [item.seq for item in slot.take(TOO_OLD_NS + 1)] == [4]


def test_memory_is_bounded_and_a_new_listener_begins_with_the_newest() -> None:
    slot = Slot()
    slot.put(gaze(0))
    slot.take(0)
    for seq in range(4 * MOST_CHANGES):
        slot.put(gaze(seq, seq % 2 == 1))
    assert len(slot) == MOST_CHANGES
    slot.clear()
    for seq in range(5):
        slot.put(gaze(seq, seq % 2 == 0))
    assert [item.seq for item in slot.take(0)] == [4]
    slot.clear()
    slot.put(gaze(7))
    assert slot.take(TOO_OLD_NS + 1) == []
