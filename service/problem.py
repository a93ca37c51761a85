"""Every error the service answers with: RFC 9457 `application/problem+json`, naming the field."""

from __future__ import annotations

import json
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from http import HTTPStatus

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.responses import Response

from renderer.errors import SceneError, SettingsError, UnknownScene
from service.headers import SECURITY_HEADERS
from service.jobs import Busy, ClientLeft, Stopping
from service.rendering import NotReady, OverLimit

MEDIA_TYPE = "application/problem+json"
LONGEST_FOUND = 80
"""Characters of an offending value that a message repeats."""

CLIENT_CLOSED_REQUEST = 499
"""What a log calls a request whose client has left; nobody receives it."""

RETRY_AFTER_S = 1
"""When a client that was turned away may ask again [s]."""

OUT_OF_MEMORY = "this service has too little memory for it now; a smaller frame needs less"

Answer = Callable[[Request, Exception], Response]
"""What a kind of error is answered with."""

log = logging.getLogger(__name__)


class FieldError(BaseModel):
    """What is wrong with one field."""

    field: str = Field(description="dotted path of the field, such as display.width_px")
    message: str = Field(description="what was expected, and what was found")


class Problem(BaseModel):
    """An error, after RFC 9457."""

    type: str = Field(description="`urn:gazetrace:problem:...` for errors of this service, else `about:blank`")
    title: str = Field(description="the kind of error")
    status: int = Field(description="the HTTP status")
    detail: str = Field(description="what is wrong, in one line")
    errors: list[FieldError] = Field(default=[], description="every field that is wrong")


def problem(
    status: int,
    detail: str,
    kind: str | None = None,
    errors: Sequence[FieldError] = (),
    headers: Mapping[str, str] | None = None,
) -> Response:
    """The reply for an error.

    Args:
        status: HTTP status.
        detail: one line fit to show.
        kind: last part of the type, such as `unknown-scene`; None for a plain HTTP error.
        errors: the fields that are wrong.
        headers: further headers.
    """
    body: dict[str, object] = {
        "type": f"urn:gazetrace:problem:{kind}" if kind else "about:blank",
        "title": kind.replace("-", " ").capitalize() if kind else HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    if errors:
        body["errors"] = [error.model_dump() for error in errors]
    return Response(json.dumps(body), status, headers, media_type=MEDIA_TYPE)


def answer_errors(app: FastAPI) -> None:
    """Make `app` answer every error with a problem: the one table from errors to statuses."""
    answers: dict[type[Exception], Answer] = {
        HTTPException: _http,
        RequestValidationError: _invalid,
        SettingsError: _settings,
        OverLimit: _over_limit,
        UnknownScene: lambda _, error: problem(404, str(error), "unknown-scene"),
        SceneError: lambda _, error: problem(422, str(error), "broken-scene"),
        NotReady: lambda _, error: _later(str(error), "not-ready"),
        Busy: lambda _, error: _later(str(error), "busy"),
        Stopping: lambda _, error: _later(str(error), "stopping"),
        MemoryError: _out_of_memory,
        ClientLeft: lambda *_: Response(status_code=CLIENT_CLOSED_REQUEST),
        Exception: _mistake,
    }
    for kind, answer in answers.items():
        app.add_exception_handler(kind, _at_once(answer))


def _at_once(answer: Answer) -> Callable[[Request, Exception], Awaitable[Response]]:
    """`answer` on the event loop: a thread for it could be cancelled when the service stops, and the answer lost."""

    async def answer_at_once(request: Request, error: Exception) -> Response:
        try:
            return answer(request, error)
        finally:
            if isinstance(error, HTTPException | RequestValidationError):
                _part_from_frames(error)

    return answer_at_once


def _part_from_frames(error: Exception) -> None:
    """Forget where an error comes from: FastAPI's frame that raised it for a damaged body holds it, and it the frame.

    Together they would stay, with all of the body, until Python looks for garbage.
    """
    error.__traceback__ = error.__cause__ = error.__context__ = None


def _later(detail: str, kind: str) -> Response:
    return problem(503, detail, kind, headers={"Retry-After": str(RETRY_AFTER_S)})


def _out_of_memory(request: Request, error: Exception) -> Response:
    log.error("%s %s: out of memory: %s", request.method, request.url.path, error)
    return _later(OUT_OF_MEMORY, "out-of-memory")


def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    detail = str(error.detail)
    if error.status_code == HTTPStatus.BAD_REQUEST:
        item = FieldError(field="body", message="expected JSON in UTF-8")
        return problem(422, f"{item.field}: {item.message}", "invalid-request", [item])
    if error.status_code == HTTPStatus.NOT_FOUND:
        detail = f"no such path: {request.url.path}; /docs lists what there is"
    elif error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        allowed = (error.headers or {}).get("Allow", "")
        detail = f"{request.url.path} does not answer {request.method}, only {allowed}"
    return problem(error.status_code, detail, headers=error.headers)


def _invalid(_: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    errors = [field_error(item) for item in error.errors()]
    return problem(422, "; ".join(f"{item.field}: {item.message}" for item in errors), "invalid-request", errors)


def _settings(request: Request, error: Exception) -> Response:
    assert isinstance(error, SettingsError)
    item = FieldError(
        field=_as_asked(error.field, request), message=f"expected {error.expected}, found {shown(error.found)}"
    )
    return problem(422, f"{item.field}: {item.message}", "invalid-request", [item])


def _over_limit(request: Request, error: Exception) -> Response:
    assert isinstance(error, OverLimit)
    item = FieldError(field=_as_asked(error.field, request), message=error.message)
    return problem(422, f"{item.field}: {item.message}", "over-limit", [item])


def _as_asked(field: str, request: Request) -> str:
    """A field's name where the request has it: query parameters are not nested."""
    if request.method == "POST":
        return field
    return field.removeprefix("quality.").removeprefix("display.").replace("gaze.", "gaze_")


def _mistake(request: Request, _: Exception) -> Response:
    detail = f"{request.method} {request.url.path} failed by a mistake of the service; its log says more"
    return problem(500, detail, headers=SECURITY_HEADERS)


def field_error(item: Mapping[str, object]) -> FieldError:
    """One of pydantic's errors in the terms of the request."""
    location = item["loc"]
    assert isinstance(location, Sequence)
    if item["type"] == "json_invalid":
        context = item["ctx"]
        assert isinstance(context, Mapping)
        return FieldError(field="body", message=f"expected JSON: {context['error']} at character {location[-1]}")
    field = ""
    for part in location[1:]:
        field += f"[{part}]" if isinstance(part, int) else f".{part}"
    field = field.removeprefix(".") or str(location[0])
    if item["type"] == "extra_forbidden":
        return FieldError(field=field, message="there is no such field")
    if item["type"] == "missing":
        return FieldError(field=field, message="is required")
    expected = str(item["msg"]).removeprefix("Input should be ").removeprefix("Input should ")
    return FieldError(field=field, message=f"expected {expected}, found {shown(item['input'])}")


def shown(value: object) -> str:
    """A value as a message repeats it: short, printable."""
    if isinstance(value, bytes):
        value = value.decode(errors="replace")
    try:
        text = ascii(value)
    except (ValueError, RecursionError):
        return f"a {type(value).__name__} too long to show"
    return text if len(text) <= LONGEST_FOUND else text[: LONGEST_FOUND - 3] + "..."
