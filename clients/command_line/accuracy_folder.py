"""What a measurement has found so far, on disk, so that one that was interrupted can go on.

`measurement.jsonl` is its journal; the pictures are in `frames`, the reference's radiance in `reference.raw` until
all is measured.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

from clients.command_line.journal import Journal, Request
from clients.command_line.render import write_whole

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from renderer.accuracy.measurement import Measured
    from renderer.accuracy.record import Reference
    from renderer.frame import StageTimes

LOG: Final = "measurement.jsonl"
FRAMES: Final = "frames"
RADIANCE: Final = "reference.raw"
REFERENCE_FRAME: Final = f"{FRAMES}/reference.png"


class AccuracyFolder:
    """One measurement in a folder; a context, so that two runs never share it.

    Attributes:
        folder: where it is; made if it is not there.
        reference: what the settings are held against, once it is rendered.
        measured: what was found of each setting, by id.
        times: of each setting by id, those of each repeat that has it.
        changed: names of the parts of the request that differ from those of an earlier run, which is gone.
    """

    def __init__(self, folder: Path, request: Request) -> None:
        self.folder = folder
        self.reference: Reference | None = None
        self.measured: dict[str, Measured] = {}
        self.times: dict[str, dict[int, StageTimes]] = {}
        self.changed: tuple[str, ...] = ()
        self._journal = Journal(folder / LOG, request)

    def __enter__(self) -> AccuracyFolder:
        """Take up what an earlier run of the same request left.

        Raises:
            UsageError: if another run is at work there.
        """
        (self.folder / FRAMES).mkdir(parents=True, exist_ok=True)
        self._journal.__enter__()
        self.changed = self._journal.changed
        if self.changed:
            self._forget()
            self._journal.start_over()
        for record in self._journal.records:
            self._take_up(record)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Leave everything as it is, for the next run."""
        self._journal.__exit__(kind, error, traceback)

    def frame(self, setting: str) -> str:
        """Path of a setting's picture beside the report."""
        return f"{FRAMES}/{setting}.png"

    def error_map(self, setting: str) -> str:
        """Path of a setting's error map beside the report."""
        return f"{FRAMES}/{setting}-error.png"

    def keep_reference(self, reference: Reference, radiance: NDArray[np.float32], picture: bytes) -> None:
        """Keep the reference."""
        from renderer.codec import encode

        write_whole(self.folder / RADIANCE, encode(radiance, "raw"))
        write_whole(self.folder / REFERENCE_FRAME, picture)
        self._journal.add({"reference": asdict(reference)})
        self.reference = reference

    @property
    def holds_radiance(self) -> bool:
        """Whether the radiance of the reference is there."""
        return self.reference is not None and (self.folder / RADIANCE).is_file()

    def radiance(self, shape: tuple[int, int]) -> NDArray[np.float32]:
        """The radiance of the reference, (h, w, 3)."""
        import numpy as np

        return np.fromfile(self.folder / RADIANCE, dtype="<f4").reshape(*shape, 3).astype(np.float32, copy=False)

    def keep_measured(self, setting: str, measured: Measured, picture: bytes, error_map: bytes) -> None:
        """Keep what was found of a setting."""
        write_whole(self.folder / self.frame(setting), picture)
        write_whole(self.folder / self.error_map(setting), error_map)
        self._journal.add({"setting": setting, "measured": asdict(measured)})
        self.measured[setting] = measured

    def keep_time(self, setting: str, repeat: int, times: StageTimes) -> None:
        """Keep what a frame took."""
        self._journal.add({"setting": setting, "repeat": repeat, "times": asdict(times)})
        self.times.setdefault(setting, {})[repeat] = times

    def finish(self) -> None:
        """Remove what is of no use once all is measured."""
        (self.folder / RADIANCE).unlink(missing_ok=True)

    def _take_up(self, record: dict[str, Any]) -> None:
        from renderer.accuracy.measurement import Measured
        from renderer.accuracy.record import Reference, read_record
        from renderer.frame import StageTimes

        setting = record.get("setting", "")
        if "reference" in record:
            self.reference = read_record(Reference, record["reference"])
        elif "measured" in record and all(
            (self.folder / path).is_file() for path in (self.frame(setting), self.error_map(setting))
        ):
            self.measured[setting] = read_record(Measured, record["measured"])
        elif "times" in record:
            self.times.setdefault(setting, {})[record["repeat"]] = read_record(StageTimes, record["times"])

    def _forget(self) -> None:
        """Remove the pictures of an earlier run."""
        settings = {record["setting"] for record in self._journal.records if "setting" in record}
        pictures = [path for setting in settings for path in (self.frame(setting), self.error_map(setting))]
        for path in (*pictures, REFERENCE_FRAME, RADIANCE):
            (self.folder / path).unlink(missing_ok=True)
