"""What the command line says when something goes wrong, and how it exits."""

from __future__ import annotations

from clients.bridge.errors import BridgeError
from clients.gaze_trace import GazeTraceError
from renderer.errors import RenderError, SettingsError

OK = 0
FAILED = 1
BAD_INPUT = 2
INTERRUPTED = 130
"""128 + SIGINT, as shells report it."""
BROKEN_PIPE = 141
"""128 + SIGPIPE, as shells report it."""


class UsageError(Exception):
    """A command line that cannot be carried out; the message is one line."""


class CommandFailed(Exception):
    """What was asked for could not be done, by no fault of the command line; the message is one line."""


BAD_INPUTS = (UsageError, RenderError, GazeTraceError, BridgeError)
"""What the user can mend by other input; their messages are one line fit to show."""


def exit_code(error: Exception) -> int:
    """2 where the user can mend it by other input, else 1."""
    return BAD_INPUT if isinstance(error, BAD_INPUTS) else FAILED


def one_line(error: Exception) -> str:
    """What happened, on one line: our own errors as they are, the system's with the file they are about."""
    if isinstance(error, (*BAD_INPUTS, CommandFailed)):
        text = str(error)
    elif isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    else:
        text = f"{type(error).__name__}: {error} (add --debug to see where)"
    return " ".join(text.split())


def blame_flag(error: SettingsError, flags: dict[str, str]) -> UsageError:
    """The same complaint in the words of the command line.

    Args:
        error: about a field such as `quality.samples_per_cell` or `gaze.x`.
        flags: the flag of each field, or of the record that holds it.
    """
    flag = flags.get(error.field) or flags.get(error.field.rpartition(".")[0]) or error.field
    return UsageError(f"{flag}: expected {error.expected}, found {error.found!r}")
