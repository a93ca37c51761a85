"""What people and supervisors look at: the page, the documentation, health."""

from __future__ import annotations

import hashlib
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, HTTPException, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import HTMLResponse, Response

from service.desk import Desk, TheDesk
from service.docs import documentation
from service.metrics import MEDIA_TYPE, Now
from service.openapi import ERRORS
from service.request import NoQuery

MEDIA_TYPE_OF_SUFFIX = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}

MEDIA_TYPES = {
    file.name: MEDIA_TYPE_OF_SUFFIX[Path(file.name).suffix]
    for file in resources.files("service").joinpath("page").iterdir()
}
"""The page's files, and what each is."""

router = APIRouter()


class Health(BaseModel):
    """The process answers."""

    status: Literal["ok"] = "ok"


class Readiness(BaseModel):
    """Frames can be rendered."""

    status: Literal["ready"] = "ready"
    running: int = Field(description="frames being rendered")
    waiting: int = Field(description="frames that wait for their turn")


@router.get("/", include_in_schema=False)
async def index(request: Request) -> Response:
    """The page: look at a scene with the mouse as the gaze."""
    return _file("index.html", request)


@router.get("/page/{name}", include_in_schema=False)
async def page_file(name: str, request: Request) -> Response:
    """A file of the page."""
    if name not in MEDIA_TYPES:
        raise HTTPException(404)
    return _file(name, request)


@router.get("/docs", include_in_schema=False)
async def docs(request: Request) -> HTMLResponse:
    """The OpenAPI document for people; needs nothing from elsewhere, so it works without a network."""
    return HTMLResponse(documentation(request.app.openapi()))


@router.get("/openapi.json", include_in_schema=False)
async def openapi(request: Request) -> dict[str, object]:
    """The OpenAPI document."""
    document: dict[str, object] = request.app.openapi()
    return document


@router.get("/healthz", tags=["health"], summary="Does the process answer?")
async def healthz() -> Health:
    """Answer at once, also while kernels compile and frames are rendered."""
    return Health()


@router.get("/readyz", tags=["health"], summary="Can frames be rendered?", responses={503: ERRORS[503]})
async def readyz(desk: TheDesk) -> Readiness:
    """Answer 503 until the kernels are compiled, and while there is no place for another frame."""
    desk.studio.require_ready()
    desk.renders.require_place()
    return Readiness(running=desk.renders.running, waiting=desk.renders.waiting)


@router.get(
    "/metrics",
    tags=["health"],
    summary="Counts and times, for Prometheus",
    response_class=Response,
    responses={200: {"description": "Prometheus' text format", "content": {"text/plain": {}}}, 401: ERRORS[401]},
)
async def metrics(_: Annotated[NoQuery, Query()], request: Request, desk: TheDesk) -> Response:
    """Frames, rays by kind, times of the stages, cache hits, sessions, viewers, what was superseded and dropped.

    Also connections, frames in work, what was refused and why, and what the process takes of the machine.
    """
    return Response(desk.studio.metrics.text(_now(request, desk)), media_type=MEDIA_TYPE)


def _now(request: Request, desk: Desk) -> Now:
    sessions = desk.sessions.all()
    return Now(
        connections=len(request.app.state.connections),
        sessions=len(sessions),
        viewers=sum(len(each.viewers) for each in sessions),
        gaze_sources=sum(len(each.sources) for each in sessions),
        running_frames=desk.renders.running,
        waiting_frames=desk.renders.waiting,
        held_bytes=desk.studio.held_bytes(),
        quarantined=desk.studio.watch.quarantined,
    )


def _file(name: str, request: Request) -> Response:
    data = resources.files("service").joinpath("page", name).read_bytes()
    etag = f'"{hashlib.blake2b(data, digest_size=16).hexdigest()}"'
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if request.headers.get("if-none-match") == etag:
        return Response(status_code=304, headers=headers)
    return Response(data, media_type=MEDIA_TYPES[name], headers=headers)
