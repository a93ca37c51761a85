"""The long forms: `python -m tests.hostile http` and `python -m tests.hostile stream`."""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tests.hostile.odd_names import ask_odd_names
from tests.hostile.requests import Asked, ask
from tests.hostile.state import FLAGS, Before, Watch
from tests.hostile.stream import Attacked, attack
from tests.load.growth import Growth
from tests.service.process import ServiceProcess, service_process

TELL_S = 30.0

SMALLEST_BLOCK_BYTES = 16
"""The smallest block that Python's allocator hands out: what grows by less keeps nothing of each request or message."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("what", choices=("http", "stream"))
    parser.add_argument("--cases", type=int, default=10_000, help="requests (default %(default)s)")
    parser.add_argument("--messages", type=int, default=100_000, help="messages (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="another one makes up others (default %(default)s)")
    parser.add_argument("--workers", type=int, default=2, help="processes that make up requests (default %(default)s)")
    arguments = parser.parse_args()
    with service_process(*FLAGS) as service:
        before = Before(service)
        if arguments.what == "http":
            growth = _http(service, arguments.cases, arguments.seed, arguments.workers)
        else:
            growth = _stream(service, arguments.messages, arguments.seed)
        print("state   ", before.check())
        print("memory  ", growth, "messages" if arguments.what == "stream" else "requests")
        assert growth.flat or growth.most < SMALLEST_BLOCK_BYTES


def _http(service: ServiceProcess, cases: int, seed: int, workers: int) -> Growth:
    asked = Asked()
    with (
        _telling(lambda: f"{asked.total:,} requests, {len(asked.wrong)} answered wrongly"),
        Watch(service, lambda: asked.total) as watch,
    ):
        ask(service.address, cases, seed, workers, asked)
    for (operation, status), count in sorted(asked.replies.items()):
        print(f"{count:8,}  {status} {operation}")
    assert not asked.wrong, "\n\n".join(f"{wrong.operation}: {wrong.found}" for wrong in asked.wrong)
    odd = ask_odd_names(service.address)
    assert not odd, "\n".join(odd)
    return watch.growth


def _stream(service: ServiceProcess, messages: int, seed: int) -> Growth:
    attacked = Attacked()
    with (
        _telling(
            lambda: f"{attacked.sent:,} messages, {len(attacked.mistakes)} mistakes {attacked.mistakes[-1:] or ''}"
        ),
        Watch(service, lambda: attacked.sent) as watch,
    ):
        attack(service.address, messages, seed, attacked)
    print("connections ended, by close code:", dict(attacked.closes), flush=True)
    assert not attacked.mistakes, attacked.mistakes[:20]
    return watch.growth


@contextmanager
def _telling(line: Callable[[], str]) -> Iterator[None]:
    """Print how far it has come, now and then, and at the end of the block."""
    over, began = threading.Event(), time.monotonic()

    def tell() -> None:
        while not over.wait(TELL_S):
            print(f"{time.monotonic() - began:6.0f} s  {line()}", flush=True)

    teller = threading.Thread(target=tell)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()
        print(f"{time.monotonic() - began:6.0f} s  {line()}", flush=True)


if __name__ == "__main__":
    main()
