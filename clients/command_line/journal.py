"""What a long run has finished so far, in a file, so that the same command goes on where it was stopped.

On the first line stands the request, then a record on each line. A record is added once what it stands for is
complete; half a line at the end does not count.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from clients.command_line.errors import UsageError

Request = Mapping[str, Any]


class Journal:
    """One run's journal; a context, so that two runs never share it.

    Attributes:
        path: the file; made if it is not there.
        records: of earlier runs, in their order.
        changed: names of the parts of the request that differ from those of the earlier runs, whose records are
            then of no use: `start_over` before anything is added.
    """

    def __init__(self, path: Path, request: Request) -> None:
        self.path = path
        self.records: list[dict[str, Any]] = []
        self.changed: tuple[str, ...] = ()
        self._request = json.loads(json.dumps(request))

    def __enter__(self) -> Journal:
        """Read what is there.

        Raises:
            UsageError: if another run is at work there, or the file is none of a journal.
        """
        self._file = self.path.open("a+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise UsageError(f"{self.path.parent}: expected no other run at work there, found one") from None
        self._read()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave everything as it is, for the next run."""
        try:
            self._file.close()
        except OSError:  # what could not be added before still cannot
            if error is None:
                raise

    def add(self, record: dict[str, Any]) -> None:
        """Keep a record.

        Raises:
            OSError: naming the file; half a record at its end does not count.
        """
        self._file.seek(0, os.SEEK_END)
        try:
            self._file.write(json.dumps(record).encode() + b"\n")
            self._file.flush()
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def start_over(self) -> None:
        """Forget all records."""
        self._file.truncate(0)
        self.records.clear()
        self.add({"request": self._request})

    def _read(self) -> None:
        self._file.seek(0)
        whole = self._file.read().rpartition(b"\n")[0]
        records = [_record(line) for line in whole.splitlines()]
        if not records:
            self.start_over()
            return
        earlier = records[0].get("request")
        if not isinstance(earlier, dict):
            self._file.close()
            raise UsageError(f"{self.path}: expected what an earlier run wrote there, found something else")
        self.records = records[1:]
        self._file.truncate(len(whole) + 1)
        names = dict.fromkeys((*self._request, *earlier))
        self.changed = tuple(name for name in names if earlier.get(name) != self._request.get(name))


def _record(line: bytes) -> dict[str, Any]:
    """One line of the journal; an empty record for a line that somebody else wrote."""
    try:
        record = json.loads(line)
    except ValueError:
        return {}
    return record if isinstance(record, dict) else {}
