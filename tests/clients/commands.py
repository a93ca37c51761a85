"""Running `gazetrace`, as a process and in this one."""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

import pytest

from clients.command_line import build_parser, main

ROOT = Path(__file__).parents[2]
SMALL = ("--size", "96x54")
PATIENCE_S = 120
"""How long a process may take to say something: the first one compiles the kernels."""


def start(*words: str, **options: object) -> subprocess.Popen[bytes]:
    """The command as a process of its own."""
    return subprocess.Popen([sys.executable, "-W", "error", "-m", "clients.command_line", *words], **options)  # type: ignore[call-overload, no-any-return]


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
