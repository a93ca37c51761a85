"""The process in which a service works, started by `supervisor`: `python -m service SOCKET NOTES`.

The first line of its standard input says what happened before.
"""

from __future__ import annotations

import faulthandler
import mmap
import os
import signal
import socket
import sys
import threading

from renderer.allocator import keep_freed_memory
from service.crash_record import Past
from service.request_log import configure_logging
from service.server import run
from service.settings import Settings
from service.watch import Watch


def main(words: list[str]) -> None:
    """Serve on the socket of a descriptor, with the settings of the environment, until stopped.

    What is at work is noted in the memory of the other descriptor.
    """
    keep_freed_memory()  # before there are threads
    past = Past.from_line(sys.stdin.buffer.readline())
    threading.Thread(target=_end_with_parent, name="gazetrace-lifeline", daemon=True).start()
    faulthandler.enable()
    settings = Settings.from_environment(os.environ)
    configure_logging(settings.log_json, "--debug" in words)
    watch = Watch(past, mmap.mmap(int(words[1]), 0))
    watch.report()
    with socket.socket(fileno=int(words[0])) as listener:
        run(settings, listener, _announce, watch)


def _announce(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _end_with_parent() -> None:
    """Standard input ends with the process that holds its other end, be it killed: nobody would stop this one then."""
    sys.stdin.buffer.read()
    os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    main(sys.argv[1:])
