"""Threads that share the cores between frames.

Work comes as jobs of many blocks. Workers take one block of each job in turn, so that a small frame is
not kept waiting by a large one that came first. Blocks run compiled code without the interpreter lock.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable
from typing import Final, Protocol

from renderer.frame import Abandoned

GLANCE_S = 0.25
"""How often whoever waits for a job looks up [s]: Ctrl-C in the moment before a wait is noticed when that ends."""


class Workers(Protocol):
    """Whoever runs the blocks of a job."""

    @property
    def threads(self) -> int:
        """How many blocks it runs at once."""

    @property
    def abandon(self) -> threading.Event | None:
        """Once it is set, what was begun is given up; None for never."""

    def run(self, task: Callable[[int], None], count: int) -> None:
        """Call `task(0)` .. `task(count - 1)` and return when all have finished."""


class _Job:
    """Blocks 0 .. count-1 of one task; `taken` and `finished` are guarded by the pool's condition."""

    def __init__(self, task: Callable[[int], None], count: int, abandon: threading.Event | None) -> None:
        self.task = task
        self.count = count
        self.abandon = abandon
        self.taken = 0
        self.finished = 0
        self.error: BaseException | None = None
        self.done = threading.Event()

    def drop(self, error: BaseException) -> None:
        """Begin no further block; `error` is raised once those already begun have finished."""
        self.error = self.error or error
        self.count = self.taken
        if self.finished == self.count:
            self.done.set()


class WorkerPool:
    """A fixed number of threads that run the blocks of jobs, one block of each job in turn."""

    abandon: Final = None

    def __init__(self, threads: int | None = None) -> None:
        self.threads = threads if threads is not None else available_cores()
        if self.threads < 1:
            raise ValueError(f"a worker pool needs at least one thread, not {self.threads}")
        self._jobs: deque[_Job] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._members = [
            threading.Thread(target=self._work, name=f"render-{index}", daemon=True) for index in range(self.threads)
        ]
        for member in self._members:
            member.start()

    def run(self, task: Callable[[int], None], count: int, abandon: threading.Event | None = None) -> None:
        """Call `task(0)` .. `task(count - 1)` on the workers and return when all have finished.

        The first exception of a block stops the blocks not yet begun and is raised here; so does one that reaches
        the caller while it waits, such as KeyboardInterrupt. Must not be called from a block.

        Args:
            task: does one block.
            count: number of blocks.
            abandon: once it is set, no further block is begun.

        Raises:
            Abandoned: when those that were begun have finished, if `abandon` kept others from being begun.
        """
        if count == 0:
            return
        job = _Job(task, count, abandon)
        try:
            with self._changed:
                if self._closed:
                    raise RuntimeError("the worker pool is closed")
                self._jobs.append(job)
                self._changed.notify_all()
            while not job.done.wait(GLANCE_S):
                pass
        except BaseException as interruption:  # blocks still running when the process ends would bring it down
            with self._changed:
                if job in self._jobs:
                    self._jobs.remove(job)
                job.drop(interruption)
            job.done.wait()
            raise
        if job.error is not None:
            try:
                raise job.error
            finally:
                del job  # the error refers to this call: the two would keep each other, and all arrays of the frame

    def until(self, abandon: threading.Event | None) -> Workers:
        """The same workers for jobs that end as soon as `abandon` is set."""
        return self if abandon is None else _WorkersUntil(self, abandon)

    def close(self, *, abandon: bool = False) -> None:
        """Let the jobs that were begun finish, then end the threads.

        Args:
            abandon: True to run no further block of them; whoever waits for them gets a RuntimeError.
        """
        with self._changed:
            self._closed = True
            while abandon and self._jobs:
                self._jobs.popleft().drop(RuntimeError("the worker pool was closed before the job was done"))
            self._changed.notify_all()
        for member in self._members:
            member.join()

    def _work(self) -> None:
        while self._run_next_block():
            pass

    def _run_next_block(self) -> bool:
        """Wait for a block and run it; False when the pool is closed and nothing is left to do.

        A call of its own, so that an idle worker holds on to no job, and so to none of its arrays.
        """
        with self._changed:
            while not self._jobs:
                if self._closed:
                    return False
                self._changed.wait()
            job = self._jobs.popleft()
            if job.abandon is not None and job.abandon.is_set():
                job.drop(Abandoned())
                return True
            block = job.taken
            job.taken += 1
            if job.taken < job.count:
                self._jobs.append(job)
        error: BaseException | None = None
        try:
            job.task(block)
        except BaseException as problem:
            error = problem
        with self._changed:
            if error is not None and job.error is None:
                job.error = error
                if job in self._jobs:
                    self._jobs.remove(job)
                job.count = job.taken
            job.finished += 1
            if job.finished == job.count:
                job.done.set()
        del job, error  # as in `run`
        return True


class _WorkersUntil:
    """A pool whose jobs end as soon as an event is set."""

    def __init__(self, pool: WorkerPool, abandon: threading.Event) -> None:
        self._pool = pool
        self.threads = pool.threads
        self.abandon = abandon

    def run(self, task: Callable[[int], None], count: int) -> None:
        self._pool.run(task, count, self.abandon)


def available_cores() -> int:
    """Cores this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
