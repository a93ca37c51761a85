"""A service of one's own, for a command that needs one and was not told where one is."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from clients.command_line.errors import CommandFailed
from clients.command_line.progress import working

PACKAGES = Path(__file__).parents[2]


@dataclass(frozen=True, slots=True)
class OwnService:
    """A service that runs.

    Attributes:
        url: where it listens.
        process: number of the process that renders.
    """

    url: str
    process: int


@contextmanager
def own_service(flags: Sequence[str]) -> Iterator[str]:
    """The address of a service on a free port of this machine, until the block ends.

    Args:
        flags: more flags of `gazetrace serve`.

    Raises:
        CommandFailed: if it did not come up; it has said why on stderr.
    """
    with own_service_process(flags, {}) as service:
        yield service.url


@contextmanager
def own_service_process(flags: Sequence[str], variables: Mapping[str, str]) -> Iterator[OwnService]:
    """The same with its process.

    Args:
        flags: more flags of `gazetrace serve`.
        variables: of its environment, beside those of ours.

    Raises:
        CommandFailed: if it did not come up; it has said why on stderr.
    """
    environ = {name: value for name, value in os.environ.items() if not name.startswith("GAZETRACE_")}
    environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(PACKAGES), environ.get("PYTHONPATH"))))
    environ |= variables
    words = [sys.executable, "-P", "-m", "clients.command_line", "serve", "--port", "0", *flags]
    with subprocess.Popen(words, env=environ, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield OwnService(_address(process), _working(process.pid))
        finally:
            process.terminate()


def _working(process: int) -> int:
    """The process that a service has started to do its work; itself where Linux does not tell."""
    children = Path(f"/proc/{process}/task/{process}/children")
    return int(children.read_text().split()[0]) if children.exists() else process


def _address(process: subprocess.Popen[str]) -> str:
    """Where it listens, once it is ready."""
    said = ""
    assert process.stdout is not None
    with working("starting a service; the first time its kernels are compiled, which takes a minute or two"):
        for line in process.stdout:
            said += line
            if line.startswith("ready in"):
                break
    found = re.search(r"serves on (http://\S+)", said)
    if found is None or "\nready in" not in said:
        raise CommandFailed("the service did not start")
    return found[1]
