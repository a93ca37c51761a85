"""The routes that answer with a picture."""

from __future__ import annotations

import json
import time
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Query, Request
from starlette.responses import Response

from renderer.codec import CONTENT_TYPE
from service.desk import Desk, TheDesk
from service.openapi import PICTURE_REPLY, SCENE_ERRORS
from service.rendering import Order, Picture
from service.request import FrameQuery, NoQuery, RenderBody

REVALIDATE = "private, no-cache"
"""A browser may keep a picture, and asks each time whether it is still the same."""

router = APIRouter(tags=["frames"])


async def _json_only(request: Request) -> None:
    content_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if content_type != "application/json":
        raise HTTPException(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "send the header Content-Type: application/json")


@router.post(
    "/v1/render",
    summary="A frame for a gaze",
    response_class=Response,
    responses={**PICTURE_REPLY, **SCENE_ERRORS},
    dependencies=[Depends(_json_only)],
)
async def render(body: RenderBody, _: Annotated[NoQuery, Query()], request: Request, desk: TheDesk) -> Response:
    """Render a scene for a gaze on a display. Only `scene` and `gaze` are required.

    The reply is the image. Its header `Gazetrace-Frame` says as JSON what the frame shows, which effects ran, what
    it cost and how accurate it is; `Server-Timing` has the time of each stage.

    `error` of the header is the standard error of the cells' means by their own samples, as a share of white: `rms`
    over the screen, `foveal_rms` within 2.5 deg of the gaze. What is lost since cells are wider than pixels is not in
    it. It is a bound for regular samples and for lights with a size, and a guess in the share `guessed` of the
    screen, where cells hold one sample. `deadline_met` and `error_met` say whether the wishes `deadline_ms` and
    `max_error` of the quality came true; if not, the frame is the best there was. `deadline_promised` is false where
    nothing was expected to fit the deadline from the outset.
    """
    received_ns = time.monotonic_ns()
    order = body.order()
    desk.studio.check_order(order)
    return _reply(await _rendered(order, received_ns, request, desk))


@router.get(
    "/v1/scenes/{scene_id}/frame",
    summary="A frame for a gaze, for a browser or curl",
    response_class=Response,
    responses={
        **PICTURE_REPLY,
        304: {"description": "the picture named by If-None-Match is still right"},
        **SCENE_ERRORS,
    },
)
async def frame(scene_id: str, query: Annotated[FrameQuery, Query()], request: Request, desk: TheDesk) -> Response:
    """The same as a render request, of the scene's own view, with an ETag.

    The same request gives the same bytes as long as the scene is the same, so a client that sends the ETag back as
    `If-None-Match` gets a 304 without anything being rendered. A frame with a deadline depends on how fast the
    service happens to be; it has no ETag and is not to be kept.
    """
    received_ns = time.monotonic_ns()
    order = query.order(scene_id)
    desk.studio.check_order(order)
    if query.deadline_ms is not None:
        reply = _reply(await _rendered(order, received_ns, request, desk))
        reply.headers["Cache-Control"] = "no-store"
        return reply
    etag = await desk.look_up(request, lambda: desk.studio.etag(order))
    kept = {"ETag": etag, "Cache-Control": REVALIDATE}
    if _is_known(etag, request.headers.get("if-none-match")):
        return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=kept)
    reply = _reply(await _rendered(order, received_ns, request, desk))
    reply.headers.update(kept)
    return reply


async def _rendered(order: Order, received_ns: int, request: Request, desk: Desk) -> Picture:
    desk.studio.require_ready()
    return await desk.render(request, lambda: desk.studio.render(order, received_ns))


def _reply(picture: Picture) -> Response:
    stages = ", ".join(f"{stage};dur={time_ms}" for stage, time_ms in picture.timing_ms.items())
    return Response(
        picture.data,
        media_type=CONTENT_TYPE[str(picture.header["format"])],
        headers={
            "Gazetrace-Frame": json.dumps(picture.header, separators=(",", ":"), allow_nan=False),
            "Server-Timing": stages,
        },
    )


def _is_known(etag: str, if_none_match: str | None) -> bool:
    """Whether an If-None-Match header names `etag` (RFC 9110, 13.1.2: weak comparison)."""
    if if_none_match is None:
        return False
    named = [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]
    return etag in named or "*" in named
