"""Watch over scenes at work: noted while native code has them, suspects one at a time, the refused not at all."""

from __future__ import annotations

import logging
import mmap
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from renderer.errors import SceneError
from renderer.frame import Abandoned
from service.crash_record import Past
from service.jobs import Stopping
from service.work_notes import Edition, WorkNotes

GLANCE_S = 0.05
"""How often a suspect that waits for its turn looks whether its frame was given up [s]."""

LONGEST_WAIT_S = 2.0
"""How long a suspect waits for its turn: a long frame of another one must not hold it up for ever [s]."""

log = logging.getLogger(__name__)


class Watch:
    """What one process of the service knows of its scenes' behaviour. Any thread may ask.

    Args:
        past: what happened in the processes before.
        memory: for notes, of `WorkNotes.size(past.told)` bytes; None for memory that ends with this process.

    Attributes:
        past: the same.
    """

    def __init__(self, past: Past | None = None, memory: mmap.mmap | None = None) -> None:
        self.past = past or Past()
        if memory is None:
            memory = mmap.mmap(-1, WorkNotes.size(self.past.told))
        self._notes = WorkNotes(memory, self.past.told)
        self._lock = threading.Lock()
        self._suspected = set(self.past.suspected)
        self._refused = set(self.past.refused)
        self._versions: dict[str, str] = {}
        self._turn = threading.Lock()
        self._closed = False

    def report(self) -> None:
        """Log what brought the process before down, and what is refused for it."""
        if self.past.crashes:
            at_work = ", ".join(self.past.at_work) or "none"
            message = "%s ended this service, which is started again: crash %d, scenes at work: %s"
            log.error(message, self.past.ended_by, self.past.crashes, at_work)
        if self.past.refused:
            scenes = ", ".join(edition.scene_id for edition in self.past.refused)
            log.error("scenes refused until their files change, since they bring this service down: %s", scenes)

    @property
    def quarantined(self) -> tuple[str, ...]:
        """Ids of the scenes that are refused; one whose files changed, until they are read."""
        with self._lock:
            return tuple(sorted({edition.scene_id for edition in self._refused}))

    @contextmanager
    def preparing(self, scene_id: str, version: str) -> Iterator[None]:
        """Note that a scene whose files were read is prepared during the block.

        Raises:
            SceneError: if it is refused.
            Stopping: if the service ends before it is its turn.
        """
        edition = Edition(scene_id, version)
        with self._lock:
            if edition in self._refused:
                raise SceneError(
                    f"{scene_id}: expected a scene that can be rendered, found that this service was brought down "
                    "again and again while it was at work; it is refused until its files change or the service is "
                    "started by hand"
                )
            for other in [other for other in self._refused if other.scene_id == scene_id]:
                self._refused.discard(other)
                self._notes.done_with(other)
            self._versions[scene_id] = version
        with self._at_work(edition, None):
            yield

    @contextmanager
    def tracing(self, scene_id: str, abandon: threading.Event | None = None) -> Iterator[None]:
        """Note that a frame of a scene is traced during the block; it is suspected of nothing when that succeeds.

        Args:
            scene_id: a scene that was prepared before.
            abandon: set it, from another thread, to wait no longer.

        Raises:
            Abandoned: soon after `abandon` is set, if it was not its turn by then.
            Stopping: if the service ends before it is.
        """
        edition = Edition(scene_id, self._versions[scene_id])
        with self._at_work(edition, abandon):
            yield
            with self._lock:
                if edition in self._suspected:
                    self._suspected.discard(edition)
                    self._notes.done_with(edition)

    def close(self) -> None:
        """Send away who still waits for a turn."""
        self._closed = True

    @contextmanager
    def _at_work(self, edition: Edition, abandon: threading.Event | None) -> Iterator[None]:
        has_turn = self._take_turn(edition, abandon)
        place = self._notes.begin(edition)
        try:
            yield
        finally:
            self._notes.end(place)
            if has_turn:
                self._turn.release()

    def _take_turn(self, edition: Edition, abandon: threading.Event | None) -> bool:
        """Wait, within reason, until no other suspect is at work; False for an edition that needs or got no turn."""
        until = time.monotonic() + LONGEST_WAIT_S
        while edition in self._suspected and time.monotonic() < until:
            if self._turn.acquire(timeout=GLANCE_S):
                return True
            if self._closed:
                raise Stopping("the service is stopping")
            if abandon is not None and abandon.is_set():
                raise Abandoned
        return False
