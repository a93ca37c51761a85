"""A service whose memory in use can be told from outside.

What a process has resident says less: holes of the allocator fill before it grows, and then grow with chance; and the
interpreter's lists of free tuples, up to 2,000 of each length, fill over some 25,000 requests.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.service.process import ServiceProcess, service_process

INSIDE = Path(__file__).parent / "inside"


@contextmanager
def watched_process(*flags: str) -> Iterator[tuple[ServiceProcess, Callable[[], int]]]:
    """A service, and what tells the bytes that are allocated in it and no garbage, of Python's objects and others."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "in-use")
        path = os.pathsep.join(filter(None, (str(INSIDE), os.environ.get("PYTHONPATH"))))
        with service_process(*flags, PYTHONPATH=path, PYTHONMALLOC="malloc", IN_USE_FILE=str(file)) as service:
            yield service, lambda: int(file.read_text())
