"""The OpenAPI document: what each route answers besides its model, errors above all."""

from __future__ import annotations

from importlib import metadata
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from renderer.codec import CONTENT_TYPE
from service.problem import MEDIA_TYPE, Problem
from service.settings import Settings

Replies = dict[int | str, dict[str, Any]]

SCHEMAS = "#/components/schemas/"


def _error(description: str) -> dict[str, Any]:
    return {"description": description, "content": {MEDIA_TYPE: {"schema": {"$ref": SCHEMAS + "Problem"}}}}


ERRORS: Replies = {
    401: _error("the token is missing or wrong"),
    403: _error("a browser's request from a page that may not use this service"),
    421: _error("a request for a host name that this service does not go by"),
    422: _error("a field is wrong, or more than this service grants one request"),
    503: _error("not ready, or busy: try again after Retry-After seconds"),
}

SCENE_ERRORS: Replies = {**ERRORS, 404: _error("no such scene")}

PICTURE_REPLY: Replies = {
    200: {
        "description": "the image",
        "content": {media_type: {} for media_type in CONTENT_TYPE.values()},
        "headers": {
            "Gazetrace-Frame": {
                "description": "JSON: what the frame shows, the effects that ran, cells, rays and times. "
                "`error`: the standard error of its cells' means by their own samples, as shares of white, root mean "
                "square over the screen (`rms`) and within 2.5 deg of the gaze (`foveal_rms`); what is lost since "
                "cells are wider than pixels is not in it. `guessed`: share of the screen whose cells hold one "
                "sample, which are judged by their neighbours. `deadline_met`, `error_met`: whether what "
                "was wished for came true; `deadline_promised`: whether that was expected from the outset",
                "schema": {"type": "string"},
            },
            "Server-Timing": {"description": "time of each stage [ms]", "schema": {"type": "string"}},
        },
    },
    413: _error("the body is too large"),
    415: _error("the body is not application/json"),
}


def describe_api(app: FastAPI, settings: Settings) -> None:
    """Make `app` answer `/openapi.json` with the routes, this service's limits, its errors and its token."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            document = get_openapi(
                title="gazetrace",
                version=package_version(),
                summary="Gaze-dependent ray tracing: a scene, a gaze and a display in, a frame out",
                description=_limits(settings),
                routes=app.routes,
            )
            components = document.setdefault("components", {})
            problem = Problem.model_json_schema(ref_template=SCHEMAS + "{model}", mode="serialization")
            components.setdefault("schemas", {}).update(problem.pop("$defs"), Problem=problem)
            if settings.token is not None:
                components["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
                document["security"] = [{"token": []}]
            app.openapi_schema = document
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]


def package_version() -> str:
    """Version of the installed package; `unknown` where it runs without being installed."""
    try:
        return metadata.version("gazetrace")
    except metadata.PackageNotFoundError:
        return "unknown"


def _limits(settings: Settings) -> str:
    return (
        f"Limits of this service: {settings.max_pixels:,} pixels, {settings.max_samples_per_cell} samples a cell, "
        f"{settings.max_camera_rays:,} camera rays, depth {settings.max_depth}, "
        f"{settings.max_body_bytes:,} bytes of body; {settings.max_concurrent_renders} frames at once and "
        f"{settings.max_queued_renders} waiting."
    )
