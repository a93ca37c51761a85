"""The service put together: settings in, an ASGI application out. Nothing of it outlives the application."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from fastapi import FastAPI
from starlette.middleware import Middleware
from starlette.middleware.cors import CORSMiddleware

from renderer.library import SceneLibrary
from renderer.pipeline import Renderer
from service import accuracy, cells, frames, pages, scenes, stream
from service.access import OwnNamesOnly, SmallBodiesOnly, TokenOnly
from service.catalogue import Catalogue
from service.desk import Desk
from service.headers import SafeHeaders
from service.jobs import JobQueue
from service.loader import Loader
from service.metrics import Metrics
from service.openapi import describe_api
from service.problem import answer_errors
from service.rendering import Studio
from service.request_log import RequestLog
from service.sessions import Sessions
from service.settings import Settings
from service.stage import Stage
from service.survey import Survey, Surveyor
from service.watch import Watch

if TYPE_CHECKING:
    from service.cluster.cluster import Cluster

LOOKUP_THREADS = 4
QUEUED_LOOKUPS = 64
"""Lookups are quick (a cell map, a description), so many may wait."""

log = logging.getLogger(__name__)


def create_app(
    settings: Settings,
    renderer: Renderer | None = None,
    announce: Callable[[str], None] = log.info,
    clock: Callable[[], int] = time.monotonic_ns,
    survey: Survey | None = None,
    watch: Watch | None = None,
    settled: Callable[[], None] = lambda: None,
) -> FastAPI:
    """The application.

    Args:
        settings: limits and access.
        renderer: renders for this application and others, on this machine; None for one of its own.
        announce: receives a line when the kernels begin to compile and one when frames can be rendered.
        clock: of the sessions, monotonic [ns].
        survey: what is measured of a scene in idle time; None for the usual.
        watch: over its scenes; None where nothing is known of them, nor kept.
        settled: called when the kernels are compiled, just before frames can be rendered.
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        cluster = None if settings.cluster is None else _join(settings.cluster, settings.threads, announce)
        own = renderer or Renderer(settings.threads, settings.map_cache_bytes, settings.store_bytes, cluster)
        loader = Loader(settings)
        over = watch or Watch()
        library = SceneLibrary(settings.scenes, settings.scene_bytes, loader.read, over.preparing)
        obstacle = (lambda: None) if cluster is None else (lambda: cluster.obstacle)
        studio = Studio(settings, own, library, Metrics(over.past.crashes), over, obstacle)
        desk = Desk(
            studio,
            Catalogue(library),
            JobQueue("gazetrace-render", settings.max_concurrent_renders, settings.max_queued_renders),
            JobQueue("gazetrace-lookup", LOOKUP_THREADS, QUEUED_LOOKUPS),
            Sessions(settings, Stage(studio, settings.max_concurrent_renders), clock),
            Surveyor(studio, survey or Survey(), own.threads),
        )
        app.state.desk = desk
        desk.studio.warm_up(announce, settled)
        desk.sessions.open()
        yield
        desk.studio.close()
        if cluster is not None:
            await asyncio.to_thread(cluster.close)
        desk.sessions.close()
        loader.close()
        await asyncio.to_thread(desk.surveyor.close)
        desk.renders.close()
        desk.lookups.close()
        if renderer is None:
            await asyncio.to_thread(own.close, abandon=True)

    app = FastAPI(
        lifespan=lifespan,
        middleware=_gates(settings),
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    app.state.connections = set()
    answer_errors(app)
    for part in (frames, cells, scenes, accuracy, stream, pages):
        app.include_router(part.router)
    describe_api(app, settings)
    return app


def _join(address: str, threads: int | None, announce: Callable[[str], None]) -> Cluster:
    from service.cluster.cluster import Cluster

    return Cluster(address, threads, announce)


def _gates(settings: Settings) -> list[Middleware]:
    """What a request passes, outermost first."""
    gates = [Middleware(RequestLog), Middleware(SafeHeaders), Middleware(OwnNamesOnly, settings=settings)]
    if settings.allowed_origins:
        gates.append(
            Middleware(
                CORSMiddleware,
                allow_origins=settings.allowed_origins,
                allow_methods=("GET", "POST"),
                allow_headers=("Authorization", "Content-Type", "If-None-Match"),
                expose_headers=("ETag", "Gazetrace-Frame", "Retry-After", "Server-Timing"),
            )
        )
    return [
        *gates,
        Middleware(TokenOnly, settings=settings),
        Middleware(SmallBodiesOnly, max_bytes=settings.max_body_bytes),
    ]
