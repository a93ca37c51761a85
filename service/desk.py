"""Where requests meet the work: the studio, the scenes, and the queues in front of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, TypeVar

from fastapi import Depends, Request

from service.catalogue import Catalogue
from service.jobs import JobQueue
from service.rendering import Studio
from service.sessions import Sessions
from service.survey import Surveyor

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Desk:
    """What the routes work with.

    Attributes:
        studio: renders.
        catalogue: describes scenes.
        renders: queue of whole frames.
        lookups: queue of what is quick, so that it does not wait behind frames.
        sessions: of viewers and gaze sources.
        surveyor: measures what accuracy costs.
    """

    studio: Studio
    catalogue: Catalogue
    renders: JobQueue
    lookups: JobQueue
    sessions: Sessions
    surveyor: Surveyor

    async def render(self, request: Request, job: Callable[[], Result]) -> Result:
        """Run a job of the kind that takes a whole frame's time."""
        return await self.renders.run(job, lambda: client_left(request))

    async def look_up(self, request: Request, job: Callable[[], Result]) -> Result:
        """Run a quick job."""
        return await self.lookups.run(job, lambda: client_left(request))


async def client_left(request: Request) -> None:
    """Return when the client closes the connection. The body must have been read before."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def _desk(request: Request) -> Desk:
    desk = request.app.state.desk
    assert isinstance(desk, Desk)
    return desk


TheDesk = Annotated[Desk, Depends(_desk)]
