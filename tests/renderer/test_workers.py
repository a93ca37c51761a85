"""The shared threads: every block once, turns between jobs, failures, and the end."""

from __future__ import annotations

import contextlib
import gc
import signal
import threading
import weakref
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from renderer.frame import Abandoned
from renderer.workers import WorkerPool, available_cores

PATIENCE_S = 30.0
"""How long another thread may take; only a failing test waits that long."""

TURN_S = 0.02
"""How long a block waits for what another thread may do, or may have to leave undone."""

LONG = 500
"""Blocks of a long job."""


@pytest.fixture(params=[1, 2, 5])
def pool(request: pytest.FixtureRequest) -> Iterator[WorkerPool]:
    workers = WorkerPool(request.param)
    yield workers
    workers.close()


@pytest.fixture
def single() -> Iterator[WorkerPool]:
    workers = WorkerPool(1)
    yield workers
    workers.close()


@pytest.mark.parametrize("count", [0, 1, 2, 7, 1000])
def test_every_block_is_run_once(pool: WorkerPool, count: int) -> None:
    blocks: list[int] = []
    pool.run(blocks.append, count)
    assert sorted(blocks) == list(range(count))


def test_blocks_run_on_the_pools_threads_all_at_once() -> None:
    pool = WorkerPool(3)
    together = threading.Barrier(3)
    names: list[str] = []

    def meet(_: int) -> None:
        together.wait(PATIENCE_S)
        names.append(threading.current_thread().name)

    pool.run(meet, 3)
    pool.close()
    assert len(set(names)) == 3
    assert threading.current_thread().name not in names


def test_by_default_there_is_a_thread_for_each_core() -> None:
    pool = WorkerPool()
    pool.close()
    assert pool.threads == available_cores() >= 1


@pytest.mark.parametrize("threads", [0, -1])
def test_a_pool_without_threads_is_refused(threads: int) -> None:
    with pytest.raises(ValueError, match=f"at least one thread, not {threads}"):
        WorkerPool(threads)


def test_jobs_of_many_threads_do_not_mix(pool: WorkerPool) -> None:
    seen: list[Counter[int]] = [Counter() for _ in range(8)]
    with ThreadPoolExecutor(8) as callers:
        list(callers.map(lambda job: pool.run(lambda block: seen[job].update([block]), 50 + job), range(8)))
    assert seen == [Counter(range(50 + job)) for job in range(8)]


def test_a_failure_is_raised_and_stops_the_blocks_not_yet_begun(single: WorkerPool) -> None:
    blocks: list[int] = []

    def fail_at_3(block: int) -> None:
        blocks.append(block)
        if block == 3:
            raise OSError("broken block")

    with pytest.raises(OSError, match="broken block"):
        single.run(fail_at_3, LONG)
    assert blocks == [0, 1, 2, 3]


def test_a_failure_waits_for_the_blocks_already_begun() -> None:
    pool = WorkerPool(2)
    both_begun, raised = threading.Barrier(2), threading.Event()
    ended: list[int] = []

    def work(block: int) -> None:
        both_begun.wait(PATIENCE_S)
        if block == 0:
            raise OSError("broken block")
        raised.wait(TURN_S)
        ended.append(block)

    with pytest.raises(OSError, match="broken block"):
        pool.run(work, 2)
    assert ended == [1]
    raised.set()
    pool.close()


def test_the_first_of_several_failures_is_raised(pool: WorkerPool) -> None:
    def fail(block: int) -> None:
        raise KeyError(block)

    for count in (1, 2, 50):
        with pytest.raises(KeyError):
            pool.run(fail, count)


def test_a_failure_leaves_the_pool_and_other_jobs_unharmed(pool: WorkerPool) -> None:
    def fail(block: int) -> None:
        raise SystemExit(block)

    blocks: list[int] = []
    with ThreadPoolExecutor(2) as callers:
        failing = callers.submit(pool.run, fail, 20)
        working = callers.submit(pool.run, blocks.append, 200)
        assert isinstance(failing.exception(PATIENCE_S), SystemExit)
        working.result(PATIENCE_S)
    assert sorted(blocks) == list(range(200))
    pool.run(blocks.append, 3)
    assert len(blocks) == 203


def test_a_short_job_is_done_long_before_a_long_one_that_came_first(single: WorkerPool) -> None:
    long_begun, short_done = threading.Event(), threading.Event()
    waited: list[int] = []

    def long_task(block: int) -> None:
        long_begun.set()
        if not short_done.wait(TURN_S):
            waited.append(block)

    with ThreadPoolExecutor(1) as caller:
        long_job = caller.submit(single.run, long_task, LONG)
        assert long_begun.wait(PATIENCE_S)
        single.run(lambda _: None, 3)
        short_done.set()
        long_job.result(PATIENCE_S)
    assert len(waited) < LONG // 2


def test_jobs_take_turns_block_by_block(single: WorkerPool) -> None:
    long_begun, short_begun = threading.Event(), threading.Event()
    order: list[str] = []

    def long_task(_: int) -> None:
        long_begun.set()
        order.append("long")
        short_begun.wait(TURN_S)

    def short_task(_: int) -> None:
        short_begun.set()
        order.append("short")

    with ThreadPoolExecutor(1) as caller:
        long_job = caller.submit(single.run, long_task, LONG)
        assert long_begun.wait(PATIENCE_S)
        single.run(short_task, 20)
        long_job.result(PATIENCE_S)
    first = order.index("short")
    assert order[first : first + 39] == ["short", "long"] * 19 + ["short"]


def test_closing_lets_the_jobs_that_were_begun_finish() -> None:
    before = set(threading.enumerate())
    pool = WorkerPool(2)
    members = set(threading.enumerate()) - before
    begun, release = threading.Event(), threading.Event()
    blocks: list[int] = []

    def work(block: int) -> None:
        begun.set()
        assert release.wait(PATIENCE_S)
        blocks.append(block)

    with ThreadPoolExecutor(2) as callers:
        job = callers.submit(pool.run, work, 10)
        assert begun.wait(PATIENCE_S)
        closing = callers.submit(pool.close)
        release.set()
        job.result(PATIENCE_S)
        closing.result(PATIENCE_S)
    assert sorted(blocks) == list(range(10))
    assert len(members) == 2
    assert not any(member.is_alive() for member in members)


def test_a_pool_can_be_closed_without_waiting_for_more_than_the_blocks_in_work() -> None:
    pool = WorkerPool(2)
    both_begun, never = threading.Barrier(3), threading.Event()
    begun: list[int] = []
    ended: list[int] = []
    ended_when_told: list[int] = []

    def work(block: int) -> None:
        begun.append(block)
        if block < 2:
            both_begun.wait(PATIENCE_S)
        never.wait(TURN_S)
        ended.append(block)

    def ask() -> None:
        try:
            pool.run(work, LONG)
        finally:
            ended_when_told.extend(ended)

    with ThreadPoolExecutor(1) as caller:
        job = caller.submit(ask)
        both_begun.wait(PATIENCE_S)
        pool.close(abandon=True)
        with pytest.raises(RuntimeError, match="closed before the job was done"):
            job.result(PATIENCE_S)
    assert 2 <= len(begun) < LONG
    assert sorted(ended_when_told) == sorted(begun)


def test_a_job_that_is_abandoned_ends_with_the_blocks_in_work() -> None:
    pool = WorkerPool(2)
    abandon, both_begun, go_on = threading.Event(), threading.Barrier(3), threading.Event()
    begun: list[int] = []
    ended: list[int] = []

    def work(block: int) -> None:
        begun.append(block)
        both_begun.wait(PATIENCE_S)
        assert go_on.wait(PATIENCE_S)
        ended.append(block)

    with ThreadPoolExecutor(1) as caller:
        job = caller.submit(pool.until(abandon).run, work, LONG)
        both_begun.wait(PATIENCE_S)
        abandon.set()
        go_on.set()
        assert isinstance(job.exception(PATIENCE_S), Abandoned)
    assert sorted(begun) == sorted(ended) == [0, 1]
    pool.close()


def test_an_abandoned_job_leaves_the_others_alone(pool: WorkerPool) -> None:
    abandon = threading.Event()
    blocks: list[int] = []
    with ThreadPoolExecutor(2) as callers:
        given_up = callers.submit(pool.until(abandon).run, lambda _: abandon.set(), LONG)
        working = callers.submit(pool.run, blocks.append, 200)
        assert isinstance(given_up.exception(PATIENCE_S), Abandoned)
        working.result(PATIENCE_S)
    assert sorted(blocks) == list(range(200))
    with pytest.raises(Abandoned):
        pool.until(abandon).run(blocks.append, 1)
    pool.until(threading.Event()).run(blocks.append, 3)
    pool.until(None).run(blocks.append, 3)
    assert len(blocks) == 206


def test_a_job_whose_last_block_was_begun_is_done_all_the_same(single: WorkerPool) -> None:
    abandon = threading.Event()
    single.until(abandon).run(lambda _: abandon.set(), 1)


def test_a_closed_pool_takes_no_job() -> None:
    pool = WorkerPool(2)
    pool.close()
    pool.close()
    with pytest.raises(RuntimeError, match="the worker pool is closed"):
        pool.run(lambda _: None, 1)


def test_an_idle_worker_holds_on_to_nothing(pool: WorkerPool) -> None:
    class Picture:
        def draw(self, block: int) -> None:
            pass

    picture, freed = Picture(), threading.Event()
    weakref.finalize(picture, freed.set)
    pool.run(picture.draw, 10)
    del picture
    assert freed.wait(PATIENCE_S)


@pytest.mark.parametrize("error", [Abandoned, MemoryError])
def test_a_job_that_failed_keeps_nothing_until_garbage_is_collected(pool: WorkerPool, error: type[Exception]) -> None:
    """Its arrays are most of a frame's memory, and the oldest garbage is looked for seldom."""

    class Picture:
        def draw(self, _: int) -> None:
            raise error

    picture, freed = Picture(), threading.Event()
    weakref.finalize(picture, freed.set)
    gc.collect()
    gc.disable()
    try:
        with contextlib.suppress(error):
            pool.run(picture.draw, 10)
        del picture
        assert freed.wait(PATIENCE_S)
    finally:
        gc.enable()


def test_ctrl_c_waits_for_the_blocks_begun_and_begins_no_other(pool: WorkerPool) -> None:
    """A block that still ran while the process ends would use what the process has given back."""
    main = threading.get_ident()
    begun: list[int] = []
    ended: list[int] = []

    def interrupt(block: int) -> None:
        begun.append(block)
        if block == 0:
            signal.pthread_kill(main, signal.SIGINT)
        threading.Event().wait(TURN_S)
        ended.append(block)

    with pytest.raises(KeyboardInterrupt):
        pool.run(interrupt, LONG)
    assert sorted(begun) == sorted(ended)
    assert len(begun) < LONG
    again: list[int] = []
    pool.run(again.append, 3)
    assert sorted(again) == [0, 1, 2]
