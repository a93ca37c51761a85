"""The frames of a clip on disk, so that a run that was interrupted can go on.

Beside the pictures lies `frames.jsonl`: on its first line the request they are of, then a line for each finished
frame with its cost. A line is written once its picture is complete; half a line at the end does not count.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from clients.command_line.errors import UsageError
from clients.command_line.render import write_whole

LOG: Final = "frames.jsonl"

Request = Mapping[str, Any]


class FrameFolder:
    """Frames 0 to n - 1 in a folder; a context, so that two runs never share it.

    Attributes:
        folder: where they are; made if it is not there.
        pattern: their names, as "frame-%05d.png".
        costs: of each frame that is finished.
        changed: names of the parts of the request that differ from those of an earlier run, whose frames are gone.
    """

    def __init__(self, folder: Path, pattern: str, request: Request) -> None:
        self.folder = folder
        self.pattern = pattern
        self.costs: dict[int, dict[str, Any]] = {}
        self.changed: tuple[str, ...] = ()
        self._request = json.loads(json.dumps(request))

    def __enter__(self) -> FrameFolder:
        """Take up what an earlier run of the same request left.

        Raises:
            UsageError: if another run is at work there.
        """
        self.folder.mkdir(exist_ok=True)
        self._log = (self.folder / LOG).open("a+b")
        try:
            fcntl.flock(self._log, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._log.close()
            raise UsageError(f"{self.folder}: expected no other run at work there, found one") from None
        self._take_up()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave everything as it is, for the next run."""
        self._log.close()

    def path(self, frame: int) -> Path:
        """Where a frame is, or will be."""
        return self.folder / (self.pattern % frame)

    def add(self, frame: int, picture: bytes, cost: dict[str, Any]) -> None:
        """Keep a finished frame."""
        write_whole(self.path(frame), picture)
        self._write({"frame": frame, "cost": cost})
        self.costs[frame] = cost

    def remove(self) -> None:
        """Remove the frames, and the folder if nothing else is in it."""
        self._forget()
        (self.folder / LOG).unlink()
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _take_up(self) -> None:
        self._log.seek(0)
        whole = self._log.read().rpartition(b"\n")[0]
        records = [_record(line) for line in whole.splitlines()]
        earlier = records[0].get("request") if records else self._request
        if not isinstance(earlier, dict):
            self._log.close()
            raise UsageError(f"{self.folder / LOG}: expected what an earlier run wrote there, found something else")
        for record in records[1:]:
            frame, cost = record.get("frame"), record.get("cost")
            if isinstance(frame, int) and isinstance(cost, dict) and self.path(frame).is_file():
                self.costs[frame] = cost
        if records and earlier == self._request:
            self._log.truncate(len(whole) + 1)
            return
        names = dict.fromkeys((*self._request, *earlier))
        self.changed = tuple(name for name in names if earlier.get(name) != self._request.get(name))
        self._forget()
        self._log.truncate(0)
        self._write({"request": self._request})

    def _forget(self) -> None:
        for frame in self.costs:
            self.path(frame).unlink(missing_ok=True)
        self.costs.clear()

    def _write(self, record: dict[str, Any]) -> None:
        self._log.seek(0, os.SEEK_END)
        self._log.write(json.dumps(record).encode() + b"\n")
        self._log.flush()


def _record(line: bytes) -> dict[str, Any]:
    """One line of the log; an empty record for a line that somebody else wrote."""
    try:
        record = json.loads(line)
    except ValueError:
        return {}
    return record if isinstance(record, dict) else {}
