"""Ctrl-C in a long run: heard at any moment, obeyed where nothing is lost by it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from renderer.frame import Abandoned


@contextmanager
def heeding(pressed: threading.Event) -> Iterator[None]:
    """Until the block ends, have Ctrl-C set an event that makes the renderer give its frame up; again, stop at once.

    Python's own way is to raise KeyboardInterrupt between any two instructions of the main thread. Where these are
    called back because an array is freed, as after every frame, it prints the exception and goes on as if nobody had
    pressed anything; between opening a file and keeping it, it leaves the file open.

    Does nothing where Ctrl-C means something else: outside the main thread, or where it is ignored.

    Raises:
        KeyboardInterrupt: at the end of the block, if Ctrl-C was pressed in it.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    presses = 0

    def hear(*_: object) -> None:
        nonlocal presses
        presses += 1
        if presses > 1:
            raise KeyboardInterrupt
        pressed.set()

    signal.signal(signal.SIGINT, hear)
    try:
        yield
    except Abandoned:
        if not presses:
            raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if presses:
        raise KeyboardInterrupt
