"""The long forms: `python -m tests.hostile http` and `python -m tests.hostile stream`."""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from tests.hostile.in_use import watched_process
from tests.hostile.odd_names import ask_odd_names
from tests.hostile.requests import Asked, ask
from tests.hostile.state import FLAGS, Before, Watch
from tests.hostile.stream import Attacked, attack
from tests.load.growth import Growth
from tests.service.process import ServiceProcess, service_process

TELL_S = 30.0

SMALLEST_BLOCK_BYTES = 16
"""The smallest block that Python's allocator hands out: what grows by less keeps nothing of each request or message."""

WARM_UP = 15_000
"""Requests before memory in use counts: until then caches of maps, samples and rates, each of a bounded size, fill, for
few of the requests ask for frames."""

WARM_UP_PART = 4
"""One in so many of the messages is sent before memory counts: that which is resident, since what is in use swings with
the frames at work."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("what", choices=("http", "stream"))
    parser.add_argument("--cases", type=int, default=10_000, help="requests after the warm-up (default %(default)s)")
    parser.add_argument("--messages", type=int, default=100_000, help="messages (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="another one makes up others (default %(default)s)")
    parser.add_argument("--workers", type=int, default=2, help="processes that make up requests (default %(default)s)")
    arguments = parser.parse_args()
    if arguments.what == "http":
        with watched_process(*FLAGS) as (service, in_use):
            attack_it = partial(_http, service.address, in_use, arguments.cases, arguments.seed, arguments.workers)
            _judge(service, attack_it, "requests")
    else:
        with service_process(*FLAGS) as service:
            _judge(service, partial(_stream, service, arguments.messages, arguments.seed), "messages")


def _judge(service: ServiceProcess, attack_it: Callable[[], Growth], what: str) -> None:
    before = Before(service)
    growth = attack_it()
    print("state   ", before.check())
    print("memory  ", growth, what)
    assert growth.flat or growth.most < SMALLEST_BLOCK_BYTES


def _http(address: str, in_use: Callable[[], int], cases: int, seed: int, workers: int) -> Growth:
    asked = Asked()
    with (
        _telling(lambda: f"{asked.total:,} requests, {len(asked.wrong)} answered wrongly"),
        Watch(in_use, lambda: asked.total, WARM_UP) as watch,
    ):
        ask(address, WARM_UP + cases, seed, workers, asked)
    for (operation, status), count in sorted(asked.replies.items()):
        print(f"{count:8,}  {status} {operation}")
    assert not asked.wrong, "\n\n".join(f"{wrong.operation}: {wrong.found}" for wrong in asked.wrong)
    odd = ask_odd_names(address)
    assert not odd, "\n".join(odd)
    return watch.growth


def _stream(service: ServiceProcess, messages: int, seed: int) -> Growth:
    attacked = Attacked()
    with (
        _telling(
            lambda: f"{attacked.sent:,} messages, {len(attacked.mistakes)} mistakes {attacked.mistakes[-1:] or ''}"
        ),
        Watch(lambda: service.resident_bytes, lambda: attacked.sent, messages // WARM_UP_PART) as watch,
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
