"""Running `gazetrace`, as a process and in this one."""

from __future__ import annotations

import argparse
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import IO

import pytest

from clients.command_line import build_parser, main

ROOT = Path(__file__).parents[2]
SMALL = ("--size", "96x54")
PATIENCE_S = 120
"""How long a process may take to say something: the first one compiles the kernels."""


def start(*words: str, **options: object) -> subprocess.Popen[bytes]:
    """The command as a process of its own."""
    return subprocess.Popen([sys.executable, "-W", "error", "-m", "clients.command_line", *words], **options)  # type: ignore[call-overload, no-any-return]


def interrupted(when: bytes, *words: str, stdout: IO[bytes] | None = None) -> bytes:
    """Run a command with a terminal as its standard error, and press Ctrl-C once that shows `when`, a pattern.

    Returns:
        What the terminal showed in all.
    """
    screen, terminal = pty.openpty()
    process = start(*words, stdout=stdout, stderr=terminal)
    os.close(terminal)
    seen = b""
    deadline = time.monotonic() + PATIENCE_S
    try:
        while not re.search(when, seen):
            assert select.select([screen], [], [], deadline - time.monotonic())[0], seen
            more = _shown(screen)
            assert more, f"it ended before it could be stopped: {seen!r}"
            seen += more
        process.send_signal(signal.SIGINT)
        while more := _shown(screen):
            seen += more
        assert process.wait(PATIENCE_S) == 130, seen
    finally:
        process.kill()
        process.wait()
        os.close(screen)
    assert b"Traceback" not in seen, seen
    return seen


def _shown(screen: int) -> bytes:
    """What a terminal shows next; nothing once its other end is closed."""
    try:
        return os.read(screen, 4096)
    except OSError:
        return b""


def failing(capsys: pytest.CaptureFixture[str], *words: str, status: int = 2) -> str:
    """Run a command that must fail; the one line it says about it."""
    assert main(words) == status
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"gazetrace: [^\n]+\n", said.err), said.err
    return said.err


def help_of(command: str) -> str:
    """What `gazetrace COMMAND --help` prints."""
    parser = build_parser()
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return str(commands.choices[command].format_help())
