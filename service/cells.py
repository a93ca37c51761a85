"""The route that shows how the screen is divided into cells."""

from __future__ import annotations

import time
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import Response

from renderer.cellmap import CellMap
from renderer.codec import CONTENT_TYPE, encode
from renderer.overlay import draw_cells, draw_rays
from service.desk import TheDesk
from service.openapi import ERRORS
from service.rendering import NS_PER_MS
from service.request import CellMapQuery

BACKGROUND = 128
"""Grey under the drawn cells: the neutral value of a page that blends the drawing with a frame."""

router = APIRouter(tags=["cells"])


class SideCount(BaseModel):
    """The cells of one size."""

    side_px: int
    cells: int
    pixels: int
    share_of_pixels: float


class CellCounts(BaseModel):
    """A cell map in numbers."""

    kind: str
    bucket_px: int = Field(description="side of the square of gazes that the map serves; 0: one gaze")
    cached: bool
    cells: int
    pixels: int
    share: float = Field(description="cells over pixels: the rays that are left of one a pixel")
    samples_per_cell: int
    camera_rays: int = Field(description="cells times samples a cell")
    camera_rays_full: int = Field(description="pixels times samples a cell")
    bytes: int = Field(description="memory the map takes")
    map_ms: float
    sides: list[SideCount] = Field(description="by size, smallest first")


@router.get(
    "/v1/cellmap",
    summary="The cells for a gaze",
    responses={
        200: {"model": CellCounts, "content": {"image/png": {}}, "description": "counts, or a drawing"},
        **ERRORS,
    },
)
async def cellmap(query: Annotated[CellMapQuery, Query()], request: Request, desk: TheDesk) -> Response:
    """How the screen is divided for a gaze: numbers, or a picture of the cells coloured by size or by rays a pixel."""
    display, quality, gaze = query.display(), query.quality(), query.gaze()
    desk.studio.check(display, quality)
    desk.studio.require_ready()
    as_picture = query.format == "png" or (query.format is None and _prefers_png(request.headers.get("accept", "")))

    def answer() -> Response:
        started_ns = time.monotonic_ns()
        cells, cached = desk.studio.cell_map(display, quality, gaze)
        map_ms = (time.monotonic_ns() - started_ns) / NS_PER_MS
        if as_picture:
            drawing = _drawing(cells, query.drawing, quality.samples_per_cell)
            return Response(drawing, media_type=CONTENT_TYPE["png"])
        counts = _counts(cells, cached, quality.samples_per_cell, map_ms)
        return Response(counts.model_dump_json(), media_type="application/json")

    reply = await desk.look_up(request, answer)
    reply.headers["Vary"] = "Accept"
    return reply


def _prefers_png(accept: str) -> bool:
    """Whether an Accept header names PNG and not JSON."""
    named = [media.partition(";")[0].strip().lower() for media in accept.split(",")]
    return "image/png" in named and "application/json" not in named


def _drawing(cells: CellMap, drawing: str, samples_per_cell: int) -> bytes:
    background = np.full((*cells.mask.shape, 3), BACKGROUND, dtype=np.uint8)
    if drawing == "rays":
        return encode(draw_rays(background, cells, samples_per_cell), "png")
    return encode(draw_cells(background, cells), "png")


def _counts(cells: CellMap, cached: bool, samples_per_cell: int, map_ms: float) -> CellCounts:
    pixels = cells.mask.size
    cells_by_side = np.bincount(cells.side)
    pixels_by_side = np.bincount(cells.side[cells.mask.ravel()], minlength=len(cells_by_side))
    sides = [
        SideCount(
            side_px=int(side),
            cells=int(cells_by_side[side]),
            pixels=int(pixels_by_side[side]),
            share_of_pixels=float(pixels_by_side[side] / pixels),
        )
        for side in np.flatnonzero(cells_by_side)
    ]
    return CellCounts(
        kind=cells.kind,
        bucket_px=cells.bucket.side_px,
        cached=cached,
        cells=cells.cells,
        pixels=pixels,
        share=cells.cells / pixels,
        samples_per_cell=samples_per_cell,
        camera_rays=cells.cells * samples_per_cell,
        camera_rays_full=pixels * samples_per_cell,
        bytes=cells.nbytes,
        map_ms=round(map_ms, 3),
        sides=sides,
    )
