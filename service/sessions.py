"""The sessions of a service: made when their name is first used, kept for a while after everyone has left."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable

from service.jobs import Stopping
from service.outbox import Outbox
from service.protocol import CloseCode
from service.session import Session
from service.settings import Settings
from service.stage import Stage

NS_PER_S = 1_000_000_000

SWEEP_S = 0.5
"""How often abandoned sessions are looked for [s]."""

GOODBYE_S = 1.0
"""How long clients may take to leave when the service stops [s]."""

RANDOM_NAME_BYTES = 9


log = logging.getLogger(__name__)


class TooMany(Exception):
    """More sessions, viewers or gaze sources than this service grants."""


class Sessions:
    """All sessions of one service. Belongs to the event loop.

    Args:
        settings: limits.
        stage: renders for all of them.
        clock: monotonic [ns].
    """

    def __init__(self, settings: Settings, stage: Stage, clock: Callable[[], int]) -> None:
        self.stage = stage
        self.clock = clock
        self._settings = settings
        self._sessions: dict[str, Session] = {}
        self._work: dict[str, asyncio.Task[None]] = {}
        self._sweeper: asyncio.Task[None] | None = None
        self._stopping = False

    def all(self) -> tuple[Session, ...]:
        """The sessions there are, oldest first."""
        return tuple(self._sessions.values())

    def view(self, name: str | None) -> tuple[Session, Outbox]:
        """A viewer's place in the session of this name, made if need be; None for a new one.

        Raises:
            TooMany: if there is none.
            Stopping: if the service is about to end.
        """
        session = self._session(name)
        _require_room(len(session.viewers), self._settings.max_viewers, "viewers")
        viewer = session.outbox()
        session.join_viewer(viewer)
        return session, viewer

    def feed(self, name: str) -> tuple[Session, Outbox]:
        """A gaze source's place in the session of this name, made if need be.

        Raises:
            TooMany: if there is none.
            Stopping: if the service is about to end.
        """
        session = self._session(name)
        _require_room(len(session.sources), self._settings.max_viewers, "gaze sources")
        source = session.outbox()
        session.join_source(source)
        return session, source

    def expire(self) -> None:
        """Forget the sessions that have been empty for too long."""
        now_ns = self.clock()
        for session in self.all():
            since_ns = session.empty_since_ns
            if since_ns is not None and now_ns - since_ns >= self._settings.session_expiry_s * NS_PER_S:
                self._forget(session)

    def open(self) -> None:
        """Begin to look for abandoned sessions."""
        self._sweeper = asyncio.create_task(self._sweep(), name="gazetrace-sweep")

    async def stop(self) -> None:
        """Tell every client that the service is stopping, and wait a little for them to leave."""
        self._stopping = True
        for session in self.all():
            session.close(CloseCode.STOPPING, "the service is stopping")
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(GOODBYE_S):
                while any(session.empty_since_ns is None for session in self.all()):
                    await asyncio.sleep(GOODBYE_S / 100)

    def close(self) -> None:
        """Forget every session."""
        for session in self.all():
            self._forget(session)
        if self._sweeper is not None:
            self._sweeper.cancel()
        self.stage.close()

    def _session(self, name: str | None) -> Session:
        if self._stopping:
            raise Stopping("the service is stopping")
        if name is not None and name in self._sessions:
            return self._sessions[name]
        if len(self._sessions) >= self._settings.max_sessions:
            self._make_room()
        name = name or secrets.token_urlsafe(RANDOM_NAME_BYTES)
        session = Session(name, self.stage, self.clock)
        self._sessions[name] = session
        self._work[name] = asyncio.create_task(session.run(), name=f"gazetrace-session-{name}")
        self._work[name].add_done_callback(lambda work: self._ended(session, work))
        return session

    def _make_room(self) -> None:
        """Forget the session that has been empty for longest."""
        empty = [session for session in self.all() if session.empty_since_ns is not None]
        if not empty:
            raise TooMany(f"this service has its {self._settings.max_sessions} sessions already")
        self._forget(min(empty, key=lambda session: session.empty_since_ns or 0))

    def _forget(self, session: Session) -> None:
        del self._sessions[session.name]
        self._work.pop(session.name).cancel()

    def _ended(self, session: Session, work: asyncio.Task[None]) -> None:
        """Let the clients of a session that failed by a mistake of ours come back to a new one."""
        if work.cancelled() or (error := work.exception()) is None:
            return
        log.error("session %s failed", session.name, exc_info=error)
        self._forget(session)
        session.close(CloseCode.TRY_LATER, "a mistake of the service; its log says more")

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            self.expire()


def _require_room(taken: int, most: int, what: str) -> None:
    if taken >= most:
        raise TooMany(f"this session has its {most} {what} already")
