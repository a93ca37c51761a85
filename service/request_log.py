"""One line for each request and stream, and counts of what was refused and why.

A line holds no query, no header and no message: tokens never come into the log.
"""

from __future__ import annotations

import json
import logging
import secrets
import sys
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from http import HTTPStatus
from typing import Any

from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.protocol import CloseCode

REQUEST_ID_BYTES = 6

SAID = "gazetrace.said"
"""Key of a request's scope under which lies what its line will say."""

MS_PER_NS = 1e-6

PROBLEM_PREFIX = "urn:gazetrace:problem:"

log = logging.getLogger(__name__)


class RequestLog:
    """Names each request in its reply (`X-Request-Id`), logs it when it is over, and counts it if it was refused."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, or talk to one client of a stream."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        began_ns = time.monotonic_ns()
        said: dict[str, object] = {"event": scope["type"], "request": secrets.token_hex(REQUEST_ID_BYTES)}
        said |= {"method": scope.get("method"), "path": scope["path"], "status": None, "kind": None, "why": None}
        scope[SAID] = said
        is_problem = False
        problem = b""
        accepted = False

        async def send_and_see(message: Message) -> None:
            nonlocal accepted, is_problem, problem
            match message["type"]:
                case "http.response.start":
                    headers = MutableHeaders(scope=message)
                    headers["X-Request-Id"] = str(said["request"])
                    said["status"] = message["status"]
                    is_problem = message["status"] >= HTTPStatus.BAD_REQUEST
                case "http.response.body" if is_problem:
                    problem += message.get("body", b"")
                case "websocket.accept":
                    accepted = True
                case "websocket.close" if not accepted:
                    why = "there is no such stream, only /v1/stream and /v1/gaze"
                    said.update(status=HTTPStatus.FORBIDDEN, kind="not-found", why=why)
                case "websocket.close":
                    said["status"], said["why"] = message.get("code"), message.get("reason")
                    said["kind"] = _close_kind(message.get("code"))
            await send(message)

        try:
            await self._app(scope, receive, send_and_see)
        except Exception as error:
            said |= {"status": HTTPStatus.INTERNAL_SERVER_ERROR, "kind": "mistake", "why": type(error).__name__}
            raise
        finally:
            if is_problem:
                said["kind"], said["why"] = _problem_kind(problem, said["status"])
            said["ms"] = round((time.monotonic_ns() - began_ns) * MS_PER_NS, 3)
            if said["kind"] is not None:
                scope["app"].state.desk.studio.metrics.refused(scope["type"], str(said["kind"]))
            level = logging.DEBUG if said["kind"] is None else logging.INFO
            log.log(level, "%s %s", scope["type"], scope["path"], extra={"said": said})


def name_session(scope: Scope, name: str) -> None:
    """Let the line of a stream's client name its session."""
    scope[SAID]["session"] = name


def stream_ended(scope: Mapping[str, Any], status: int | None, kind: str, why: str) -> None:
    """Let the line of a stream's client say why the connection was ended without a word of the application."""
    if SAID in scope:
        scope[SAID].update(status=status, kind=kind, why=why)


def connection_refused(app: Starlette, status: int | None, kind: str, why: str) -> None:
    """Log and count a connection that was ended before there was a request, or apart from any."""
    app.state.desk.studio.metrics.refused("connection", kind)
    said: dict[str, object] = {"event": "connection", "status": status, "kind": kind, "why": why}
    log.info("connection", extra={"said": said})


class _Line(logging.Formatter):
    """A record as one line: what a request said of itself, or a message with its traceback, as text or as JSON."""

    def __init__(self, as_json: bool) -> None:
        super().__init__()
        self._as_json = as_json

    def format(self, record: logging.LogRecord) -> str:
        time_text = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        said: dict[str, object] = getattr(record, "said", {"event": record.name, "why": super().format(record)})
        if self._as_json:
            return json.dumps({"time": time_text, "level": record.levelname.lower(), **said})
        return " ".join(
            [time_text, *(f"{name}={json.dumps(value)}" for name, value in said.items() if value is not None)]
        )


def configure_logging(as_json: bool, debug: bool) -> None:
    """Write this process's log to standard error.

    Args:
        as_json: every request and stream as a line of JSON.
        debug: those that were refused, and why; as text, unless as JSON.
    """
    # What uvicorn warns of, such as bytes that are no HTTP, is a refusal, which has a line of its own.
    logging.getLogger("uvicorn.error").setLevel(logging.ERROR)
    if as_json or debug:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(_Line(as_json))
        logging.getLogger().addHandler(handler)
        logging.getLogger("service").setLevel(logging.DEBUG if as_json else logging.INFO)


def _problem_kind(body: bytes, status: object) -> tuple[str, str | None]:
    """The kind of a problem and what it says; the status where the reply is another one."""
    try:
        problem = json.loads(body)
    except ValueError:
        return str(status), None
    kind = problem["type"].removeprefix(PROBLEM_PREFIX)
    return (problem["title"].lower().replace(" ", "-") if kind == "about:blank" else kind), problem["detail"]


def _close_kind(code: int | None) -> str | None:
    """The kind of refusal that a close code is; None for a close that is none."""
    try:
        return CloseCode(code).name.lower().replace("_", "-") if code is not None else None
    except ValueError:
        return None
