"""What the program is doing, for a person who waits: a spinner on stderr, and nothing where stderr is a file."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def working(text: str) -> Iterator[None]:
    """Show `text` and the seconds it has taken until the block ends; on a terminal only."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        progress.add_task(text, total=None)
        yield


@contextmanager
def counting(text: str, total: int, done: int = 0) -> Iterator[Callable[[], None]]:
    """Show `text` and how many of `total` steps are done until the block ends; it calls what it gets after each.

    Args:
        text: what is going on.
        total: number of steps.
        done: how many of them were done before.
    """
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    times = (TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), *times)
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(text, total=total, completed=done)
        yield lambda: progress.advance(task)


def say(text: str) -> None:
    """One line for whoever waits."""
    print(f"gazetrace: {text}", file=sys.stderr)


def milliseconds_since(start_ns: int) -> float:
    """Wall-clock time since `start_ns` of `time.perf_counter_ns` [ms]."""
    return (time.perf_counter_ns() - start_ns) / 1e6
