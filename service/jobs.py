"""CPU work off the event loop: a few threads, a bounded queue, and nobody waits for a client that has left."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")


class Busy(Exception):
    """Every place is taken, those in the queue too."""


class Stopping(Exception):
    """The service ends before the job is done."""


class ClientLeft(Exception):
    """The client closed the connection before its job was done."""


class JobQueue:
    """Runs blocking jobs on threads of its own, oldest first.

    Args:
        name: of the threads.
        threads: jobs at once.
        queue: jobs that may wait for a thread.
    """

    def __init__(self, name: str, threads: int, queue: int) -> None:
        self.threads = threads
        self.places = threads + queue
        self._taken = 0
        self._lock = threading.Lock()
        self._executor = ThreadPoolExecutor(threads, thread_name_prefix=name)

    @property
    def running(self) -> int:
        """Jobs that have a thread."""
        return min(self._taken, self.threads)

    @property
    def waiting(self) -> int:
        """Jobs that wait for one."""
        return max(self._taken - self.threads, 0)

    async def run(self, job: Callable[[], Result], client_left: Callable[[], Coroutine[Any, Any, None]]) -> Result:
        """The result of `job()`.

        Args:
            job: blocks its thread; may raise.
            client_left: returns when nobody waits for the result any more. A job still in the queue then
                frees its place; one that has begun is left to end.

        Raises:
            Busy: at once, if there is no place.
            ClientLeft: when `client_left` returns first.
            Stopping: when the server gives up waiting for the job, in order to end.
        """
        begun = self._submit(job)
        result = asyncio.wrap_future(begun)
        left = asyncio.ensure_future(client_left())
        try:
            await asyncio.wait((result, left), return_when=asyncio.FIRST_COMPLETED)
            if result.done():
                return result.result()
            raise ClientLeft
        except asyncio.CancelledError:
            raise Stopping("the service is stopping") from None
        finally:
            left.cancel()
            result.cancel()

    def close(self) -> None:
        """Drop the jobs in the queue and take no more; those that have begun end by themselves."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def require_place(self) -> None:
        """Return if there is one for another job.

        Raises:
            Busy: if not.
        """
        if self._taken >= self.places:
            raise Busy(f"{self.places} requests are being worked on or waiting, and there is room for no more")

    def _submit(self, job: Callable[[], Result]) -> Future[Result]:
        with self._lock:
            self.require_place()
            self._taken += 1
        begun = self._executor.submit(job)
        begun.add_done_callback(self._free)
        return begun

    def _free(self, _: Future[Any]) -> None:
        with self._lock:
            self._taken -= 1
