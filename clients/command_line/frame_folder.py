"""The frames of a clip on disk, so that a run that was interrupted can go on.

Beside the pictures lies `frames.jsonl`, a journal of the finished frames with their costs.
"""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any, Final

from clients.command_line.errors import CommandFailed, one_line
from clients.command_line.journal import Journal, Request
from clients.command_line.render import write_whole

LOG: Final = "frames.jsonl"


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
        self._journal = Journal(folder / LOG, request)

    def __enter__(self) -> FrameFolder:
        """Take up what an earlier run of the same request left.

        Raises:
            UsageError: if another run is at work there.
        """
        self.folder.mkdir(exist_ok=True)
        self._journal.__enter__()
        for record in self._journal.records:
            frame, cost = record.get("frame"), record.get("cost")
            if isinstance(frame, int) and isinstance(cost, dict) and self.path(frame).is_file():
                self.costs[frame] = cost
        self.changed = self._journal.changed
        if self.changed:
            self._forget()
            self._journal.start_over()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave everything as it is, for the next run."""
        self._journal.__exit__(kind, error, traceback)

    def path(self, frame: int) -> Path:
        """Where a frame is, or will be."""
        return self.folder / (self.pattern % frame)

    def add(self, frame: int, picture: bytes, cost: dict[str, Any]) -> None:
        """Keep a finished frame.

        Raises:
            CommandFailed: where it cannot be written, as on a full disk.
        """
        try:
            write_whole(self.path(frame), picture)
            self._journal.add({"frame": frame, "cost": cost})
        except OSError as error:
            kept = f"{len(self.costs)} finished frames are kept, and the same command goes on once this is mended"
            raise CommandFailed(f"{one_line(error)}; {kept}") from error
        self.costs[frame] = cost

    def remove(self) -> None:
        """Remove the frames, and the folder if nothing else is in it."""
        self._forget()
        self._journal.path.unlink()
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _forget(self) -> None:
        for frame in self.costs:
            self.path(frame).unlink(missing_ok=True)
        self.costs.clear()
