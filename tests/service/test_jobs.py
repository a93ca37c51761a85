"""The job queue: bounded, fair, and rid of clients that have left."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest

from service.jobs import Busy, ClientLeft, JobQueue, Stopping

PATIENCE_S = 20


@pytest.fixture
def queue() -> Iterator[JobQueue]:
    """One job at once, one waiting."""
    queue = JobQueue("test", threads=1, queue=1)
    yield queue
    queue.close()


class Blocker:
    """A job that says when it has begun, and ends when told."""

    def __init__(self) -> None:
        self.begun = threading.Event()
        self.end = threading.Event()

    def __call__(self) -> str:
        self.begun.set()
        assert self.end.wait(PATIENCE_S)
        return "done"


async def stays() -> None:
    """A client that never leaves."""
    await asyncio.Event().wait()


async def begun(blocker: Blocker) -> None:
    assert await asyncio.to_thread(blocker.begun.wait, PATIENCE_S)


def test_a_result_and_an_exception_come_back(queue: JobQueue) -> None:
    async def run() -> None:
        assert await queue.run(lambda: 42, stays) == 42
        with pytest.raises(ZeroDivisionError):
            await queue.run(lambda: 1 // 0, stays)

    asyncio.run(run())
    assert (queue.running, queue.waiting) == (0, 0)


def test_jobs_run_off_the_event_loop(queue: JobQueue) -> None:
    async def run() -> None:
        blocker = Blocker()
        job = asyncio.create_task(queue.run(blocker, stays))
        await begun(blocker)
        assert not job.done()
        blocker.end.set()
        assert await job == "done"

    asyncio.run(run())


def test_without_a_place_it_says_so_at_once(queue: JobQueue) -> None:
    async def run() -> None:
        first = Blocker()
        jobs = [asyncio.create_task(queue.run(first, stays))]
        await begun(first)
        jobs.append(asyncio.create_task(queue.run(lambda: "next", stays)))
        await asyncio.sleep(0)
        assert (queue.running, queue.waiting) == (1, 1)
        with pytest.raises(Busy):
            await queue.run(lambda: "no place", stays)
        first.end.set()
        assert await asyncio.gather(*jobs) == ["done", "next"]
        assert await queue.run(lambda: "a place again", stays) == "a place again"

    asyncio.run(run())


def test_a_client_that_leaves_the_queue_frees_its_place(queue: JobQueue) -> None:
    async def run() -> None:
        first, left = Blocker(), asyncio.Event()
        ran: list[str] = []
        running = asyncio.create_task(queue.run(first, stays))
        await begun(first)

        async def leaves() -> None:
            await left.wait()

        queued = asyncio.create_task(queue.run(lambda: ran.append("left"), leaves))
        await asyncio.sleep(0)
        left.set()
        with pytest.raises(ClientLeft):
            await queued
        assert (queue.running, queue.waiting) == (1, 0)
        successor = asyncio.create_task(queue.run(lambda: "successor", stays))
        first.end.set()
        assert await asyncio.gather(running, successor) == ["done", "successor"]
        assert ran == []

    asyncio.run(run())


def test_a_job_that_has_begun_keeps_its_place_until_it_ends(queue: JobQueue) -> None:
    async def run() -> None:
        first = Blocker()

        async def leaves_when_it_has_begun() -> None:
            await begun(first)

        with pytest.raises(ClientLeft):
            await queue.run(first, leaves_when_it_has_begun)
        assert queue.running == 1
        waiting = asyncio.create_task(queue.run(lambda: "next", stays))
        await asyncio.sleep(0)
        with pytest.raises(Busy):
            await queue.run(lambda: "no place", stays)
        first.end.set()
        assert await waiting == "next"

    asyncio.run(run())


def test_a_server_that_gives_up_waiting_says_so(queue: JobQueue) -> None:
    async def run() -> None:
        first = Blocker()
        job = asyncio.create_task(queue.run(first, stays))
        await begun(first)
        job.cancel()
        with pytest.raises(Stopping):
            await job
        first.end.set()

    asyncio.run(run())


def test_two_threads_run_two_jobs_at_once() -> None:
    queue = JobQueue("test", threads=2, queue=0)
    meeting = threading.Barrier(2, timeout=PATIENCE_S)

    async def run() -> None:
        await asyncio.gather(queue.run(meeting.wait, stays), queue.run(meeting.wait, stays))

    asyncio.run(run())
    queue.close()
