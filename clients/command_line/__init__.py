"""The command `gazetrace`, and the one place where clients, service and renderer are put together.

One file a command; each has `add`, which describes it to argparse, and `run`. What is slow to import
(compiled kernels, Embree, the web framework) is imported inside `run`.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import traceback
from collections.abc import Sequence
from importlib import metadata
from typing import Any, NoReturn

from clients.command_line import accuracy, animate, bench, bridge, figures, render, scenes, serve, simulate, watch
from clients.command_line.errors import BROKEN_PIPE, INTERRUPTED, UsageError, exit_code, one_line

DESCRIPTION = """\
Ray tracing that follows the eye: fine where you look, coarser where the eye could not tell.

Name a scene, a gaze point and a screen; get a frame, and what it cost."""

EXAMPLES = """\
start here:
  gazetrace scenes                                      what there is to render
  gazetrace render atrium --gaze 960,540 -o frame.png   one frame, looking at the middle
  gazetrace serve                                       a page in the browser and an HTTP service

`gazetrace COMMAND --help` explains each command with examples."""


class Parser(argparse.ArgumentParser):
    """Reports a bad command line as a `UsageError`, so that all errors look alike."""

    def error(self, message: str) -> NoReturn:
        """Raise what argparse would print and exit with."""
        raise UsageError(f"{message} (see {self.prog} --help)")


class ShowVersion(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print `gazetrace VERSION` and exit."""
        print("gazetrace", metadata.version("gazetrace"))
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """All commands and flags."""
    parser = Parser(
        prog="gazetrace",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=ShowVersion, nargs=0, help="print the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in (serve, render, scenes, accuracy, bench, animate, watch, bridge, figures, simulate):
        command.add(commands)
    for command_parser in commands.choices.values():
        command_parser.allow_abbrev = False
        command_parser.add_argument("--debug", action="store_true", help="on an error, show where it happened")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: what follows the program's name; None for the process's own.

    Returns:
        The exit status: 0; 2 for bad usage or input; 1 for any other failure; 130 after Ctrl-C.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        arguments = build_parser().parse_args(attach_negative_values(words), argparse.Namespace(words=words))
        status: int = arguments.run(arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # What is still in the buffer must not fail a second time when Python flushes it at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except Exception as error:
        if "--debug" in words:
            traceback.print_exc()
        print(f"gazetrace: {one_line(error)}", file=sys.stderr)
        return exit_code(error)
    return status


def attach_negative_values(words: Sequence[str]) -> list[str]:
    """Write `--gaze -20,300` as `--gaze=-20,300`, because argparse takes a word with a leading minus for a flag."""
    attached: list[str] = []
    for word in words:
        if attached and re.fullmatch(r"--[a-z-]+", attached[-1]) and re.match(r"-[\d.]", word):
            attached[-1] += "=" + word
        else:
            attached.append(word)
    return attached
