"""A service of one's own, for a command that needs one and was not told where one is."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from clients.command_line.errors import CommandFailed
from clients.command_line.progress import working

PACKAGES = Path(__file__).parents[2]


@contextmanager
def own_service(flags: Sequence[str]) -> Iterator[str]:
    """The address of a service on a free port of this machine, until the block ends.

    Args:
        flags: more flags of `gazetrace serve`.

    Raises:
        CommandFailed: if it did not come up; it has said why on stderr.
    """
    environ = {name: value for name, value in os.environ.items() if not name.startswith("GAZETRACE_")}
    environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(PACKAGES), environ.get("PYTHONPATH"))))
    words = [sys.executable, "-P", "-m", "clients.command_line", "serve", "--port", "0", *flags]
    with subprocess.Popen(words, env=environ, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield _address(process)
        finally:
            process.terminate()


def _address(process: subprocess.Popen[str]) -> str:
    """Where it listens, once it is ready."""
    said = ""
    assert process.stdout is not None
    with working("starting a service; the first time its kernels are compiled, which takes up to a minute"):
        for line in process.stdout:
            said += line
            if line.startswith("ready in"):
                break
    found = re.search(r"serves on (http://\S+)", said)
    if found is None or "\nready in" not in said:
        raise CommandFailed("the service did not start")
    return found[1]
