"""What is held against scenes: a culprit is found, whatever runs beside it, and nobody else is refused."""

from __future__ import annotations

import mmap
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer.errors import SceneError
from renderer.frame import Abandoned
from service.app import LOOKUP_THREADS
from service.crash_record import MEMORY_S, NATIVE_CRASHES, CrashRecord, Past
from service.jobs import Stopping
from service.settings import MOST_RENDERS
from service.watch import Watch
from service.work_notes import PLACE_BYTES, PLACES, Edition, WorkNotes
from tests.service.conftest import PATIENCE_S

BAD, GOOD, OTHER = (Edition(name, "0123456789abcdef") for name in ("bad", "good", "o" * 64))
NOTHING: frozenset[Edition] = frozenset()

editions = st.builds(Edition, st.from_regex(r"[a-z0-9][a-z0-9_-]{0,63}", fullmatch=True), st.just("0a"))


@given(st.data(), st.integers(2, 4))
def test_a_culprit_is_refused_after_so_many_crashes_and_nobody_who_ran_beside_it(
    data: st.DataObject, most: int
) -> None:
    """Suspects are at work one at a time; who finishes a frame is none any more, and the culprit never does."""
    record = CrashRecord(most)
    others = st.frozensets(st.sampled_from([GOOD, OTHER]))
    for crash in range(most):
        assert record.past.refused == ()
        done = data.draw(others) & set(record.past.suspected)
        beside = data.draw(others) - (set(record.past.suspected) - done)
        record.crashed(data.draw(st.sampled_from(sorted(NATIVE_CRASHES))), beside | {BAD}, done)
        assert record.past.crashes == crash + 1
    assert record.past.refused == (BAD,)
    assert BAD not in record.past.suspected


@pytest.mark.parametrize("ended_by", ["SIGKILL", "SIGTERM", "SIGXCPU"])
def test_a_signal_from_outside_is_held_against_nobody(ended_by: str) -> None:
    record = CrashRecord(2)
    for _ in range(3):
        record.crashed(ended_by, {BAD}, NOTHING)
    assert (record.past.suspected, record.past.refused) == ((), ())


def test_a_crash_long_ago_is_forgotten_and_a_refusal_is_not() -> None:
    now_s = 0.0
    record = CrashRecord(2, lambda: now_s)
    record.crashed("SIGSEGV", {BAD}, NOTHING)
    now_s += MEMORY_S
    record.crashed("SIGSEGV", {BAD}, NOTHING)
    assert record.past.refused == ()
    record.crashed("SIGSEGV", {BAD}, NOTHING)
    now_s += 2 * MEMORY_S
    record.crashed("SIGBUS", NOTHING, NOTHING)
    assert record.past.refused == (BAD,)


def test_a_scene_that_crashes_now_and_then_is_refused_though_other_frames_of_it_succeed() -> None:
    record = CrashRecord(2)
    record.crashed("SIGSEGV", {BAD}, NOTHING)
    record.crashed("SIGSEGV", {BAD}, {BAD})
    assert record.past.refused == (BAD,)


@given(st.builds(Past, st.integers(0), st.just("SIGFPE"), *[st.lists(editions).map(tuple)] * 3))
def test_the_past_survives_its_line(past: Past) -> None:
    past = Past(past.crashes, past.ended_by, tuple(each.scene_id for each in past.told), past.suspected, past.refused)
    assert past.to_line().count(b"\n") == 1
    assert Past.from_line(past.to_line()) == past


def test_notes_say_what_is_at_work_and_damaged_ones_nothing() -> None:
    assert PLACES >= 3 * MOST_RENDERS + LOOKUP_THREADS + 1
    told = (BAD, GOOD)
    memory = mmap.mmap(-1, WorkNotes.size(told))
    notes, reader = WorkNotes(memory, told), WorkNotes(memory, told)
    places = [notes.begin(edition) for edition in (BAD, OTHER, BAD)]
    assert reader.at_work() == {BAD, OTHER}
    notes.end(places[0])
    assert reader.at_work() == {BAD, OTHER}
    notes.end(places[2])
    assert reader.at_work() == {OTHER}
    memory[places[1] * PLACE_BYTES + 1] = 0xFF
    assert reader.at_work() == NOTHING
    assert reader.done() == NOTHING
    notes.done_with(GOOD)
    assert reader.done() == {GOOD}


def watched(past: Past, *prepared: Edition) -> tuple[Watch, WorkNotes]:
    memory = mmap.mmap(-1, WorkNotes.size(past.told))
    watch = Watch(past, memory)
    for edition in prepared:
        with watch.preparing(*edition):
            pass
    return watch, WorkNotes(memory, past.told)


def test_suspects_are_at_work_one_at_a_time_until_a_frame_is_finished_and_others_at_any_time() -> None:
    watch, notes = watched(Past(suspected=(BAD, GOOD)), BAD, GOOD, OTHER)
    asked = threading.Event()

    def trace() -> frozenset[Edition]:
        asked.set()
        with watch.tracing(GOOD.scene_id):
            return notes.at_work()

    with ThreadPoolExecutor(1) as threads:
        with watch.tracing(BAD.scene_id):
            waits = threads.submit(trace)
            assert asked.wait(PATIENCE_S)
            with watch.tracing(OTHER.scene_id):
                assert notes.at_work() == {BAD, OTHER}
            assert not waits.done()
        assert waits.result(PATIENCE_S) == {GOOD}
    assert notes.at_work() == NOTHING


def test_a_suspect_waits_no_longer_when_it_is_given_up_or_the_service_ends() -> None:
    watch, _ = watched(Past(suspected=(BAD, GOOD)), BAD, GOOD)
    given_up = threading.Event()
    given_up.set()
    with watch.tracing(BAD.scene_id):
        with pytest.raises(Abandoned), watch.tracing(GOOD.scene_id, given_up):
            pass
        watch.close()
        with pytest.raises(Stopping), watch.tracing(GOOD.scene_id):
            pass


def test_a_suspect_does_not_wait_for_ever_for_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.watch.LONGEST_WAIT_S", 0.01)
    watch, notes = watched(Past(suspected=(BAD, GOOD)), BAD, GOOD)
    with watch.tracing(BAD.scene_id), watch.tracing(GOOD.scene_id):
        assert notes.at_work() == {BAD, GOOD}


def test_who_finished_a_frame_is_no_suspect() -> None:
    watch, notes = watched(Past(suspected=(BAD, GOOD)), BAD, GOOD)
    assert notes.done() == NOTHING  # to be prepared is not enough
    with watch.tracing(GOOD.scene_id):
        pass
    assert notes.done() == {GOOD}
    with watch.tracing(GOOD.scene_id), watch.tracing(BAD.scene_id), watch.tracing(GOOD.scene_id):
        assert notes.at_work() == {GOOD, BAD}


def test_a_refused_scene_is_prepared_when_its_files_have_changed() -> None:
    watch, notes = watched(Past(refused=(BAD,)), GOOD)
    assert watch.quarantined == ("bad",)
    for _ in range(2):
        with pytest.raises(SceneError, match=r"bad: .* until its files change"), watch.preparing(*BAD):
            pass
    with watch.preparing("bad", "ff"):
        assert notes.at_work() == {Edition("bad", "ff")}
    assert watch.quarantined == ()
    assert notes.done() == {BAD}
    record = CrashRecord(2)
    for _ in range(2):
        record.crashed("SIGSEGV", {BAD}, NOTHING)
    record.crashed("SIGSEGV", {GOOD}, notes.done())
    assert (record.past.refused, record.past.suspected) == ((), (GOOD,))
