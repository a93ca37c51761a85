"""The routes that tell about scenes."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from service.catalogue import SceneDetail, SceneList
from service.desk import TheDesk
from service.openapi import ERRORS, SCENE_ERRORS
from service.request import NoQuery, SceneListQuery

router = APIRouter(tags=["scenes"])


@router.get("/v1/scenes", summary="All scenes", responses=ERRORS, response_model_exclude_none=True)
async def scenes(query: Annotated[SceneListQuery, Query()], request: Request, desk: TheDesk) -> SceneList:
    """One line on each scene. A broken scene is listed with its error.

    The first time this loads every scene; `details=false` answers at once with their ids alone.
    """
    return await desk.look_up(request, desk.catalogue.all if query.details else desk.catalogue.ids)


@router.get("/v1/scenes/{scene_id}", summary="One scene", responses=SCENE_ERRORS)
async def scene(scene_id: str, _: Annotated[NoQuery, Query()], request: Request, desk: TheDesk) -> SceneDetail:
    """How large the scene is, which effects it calls for and why, and its own camera."""
    return await desk.look_up(request, lambda: desk.catalogue.detail(scene_id))
