"""The route that tells what accuracy costs on this machine."""

from __future__ import annotations

from dataclasses import asdict
from http import HTTPStatus
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import JSONResponse

from renderer.accuracy.record import AccuracyReport
from service.desk import TheDesk
from service.openapi import SCENE_ERRORS
from service.request import NoQuery
from service.survey import Progress

RETRY_AFTER_S = 2

router = APIRouter(tags=["scenes"])


@router.get(
    "/v1/scenes/{scene_id}/accuracy",
    summary="What accuracy costs here, measured",
    response_class=JSONResponse,
    responses={
        200: {"description": "the table: for each setting its times, rays, stated and true error"},
        202: {"description": "it is being measured: `done` of `of` steps; ask again after Retry-After seconds"},
        **SCENE_ERRORS,
    },
)
async def accuracy(scene_id: str, _: Annotated[NoQuery, Query()], request: Request, desk: TheDesk) -> JSONResponse:
    """A dozen settings of the scene's own view, each timed on this machine and held against a reference.

    The first request begins the measurement, which goes on only while nobody waits for a frame, and is begun again
    when the scene's files have changed. The table is `accuracy.json` of `gazetrace accuracy`, without pictures; it is
    kept until the service ends.
    """
    desk.studio.require_ready()
    found = await desk.look_up(request, lambda: desk.surveyor.table(scene_id))
    headers = {"Cache-Control": "no-store"}
    if isinstance(found, Progress):
        headers["Retry-After"] = str(RETRY_AFTER_S)
        return JSONResponse(asdict(found), HTTPStatus.ACCEPTED, headers)
    return JSONResponse(_without_pictures(found), headers=headers)


def _without_pictures(report: AccuracyReport) -> dict[str, Any]:
    table = asdict(report)
    del table["reference"]["frame"]
    for setting in table["settings"]:
        del setting["frame"], setting["error_map"]
    return table
