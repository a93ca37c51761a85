"""Who may ask: names and origins this service answers to, its token, and how much a client may send.

A web page anywhere can make a visitor's browser send requests to that visitor's own machine, or rebind its own
name to 127.0.0.1. So requests must name this service by a name of its own, and a browser's must come from this
service's page or from an origin that was allowed.
"""

from __future__ import annotations

import hmac
import ipaddress
from enum import Enum
from http import HTTPStatus

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problem import problem
from service.settings import Settings, is_loopback

OPEN_PATHS = ("/", "/docs", "/openapi.json", "/healthz", "/readyz")
OPEN_FOLDER = "/page/"
"""What needs no token: the page that asks for it, what describes the service, and its health; no scene, no frame."""

DRAINED_BYTES = 4 << 20
"""How much of a too large body is read and forgotten, so that its sender lives to read the reply."""


def host_refusal(settings: Settings, host: str) -> str | None:
    """Why a request for `host` (the Host header) is refused; None if it is not."""
    name = host_name(host)
    allowed = {host_name(allowed) for allowed in settings.allowed_hosts}
    if is_loopback(name) or name in allowed or "*" in allowed:
        return None
    token_decides = settings.token is not None and not allowed
    if not is_loopback(settings.host) and (token_decides or _is_address(name)):
        return None
    return f"this service does not go by the name {host!r}; GAZETRACE_ALLOWED_HOSTS gives it further names"


def origin_refusal(settings: Settings, headers: Headers) -> str | None:
    """Why a browser's request is refused because of the page it comes from; None if it is not."""
    origin = headers.get("origin")
    if origin is not None:
        own = {f"{scheme}://{headers.get('host', '')}" for scheme in ("http", "https")}
        if origin in own or origin in settings.allowed_origins:
            return None
        return f"pages of {origin} may not use this service; GAZETRACE_ALLOWED_ORIGINS lists those that may"
    if headers.get("sec-fetch-site", "none") in ("none", "same-origin"):
        return None
    if headers.get("sec-fetch-dest") == "document":
        return None
    return "pages of other origins may not use this service without saying who they are (fetch with CORS)"


class Right(Enum):
    """What a token lets its holder do."""

    VIEW = "look at frames"
    GAZE = "be a gaze"


EVERY_RIGHT = frozenset(Right)


def rights_of(settings: Settings, authorization: str | None) -> frozenset[Right] | str:
    """What an Authorization header entitles to; or why to nothing."""
    if settings.token is None:
        return EVERY_RIGHT
    if authorization is None:
        return "this service asks for its token: send the header Authorization: Bearer TOKEN"
    scheme, _, shown = authorization.partition(" ")
    rights: frozenset[Right] = frozenset()
    for token, granted in (
        (settings.token, EVERY_RIGHT),
        (settings.view_token, frozenset({Right.VIEW})),
        (settings.gaze_token, frozenset({Right.GAZE})),
    ):
        if token is not None and hmac.compare_digest(shown.strip().encode(errors="surrogatepass"), token.encode()):
            rights |= granted
    return rights if rights and scheme.lower() == "bearer" else "the token is wrong"


def right_refusal(settings: Settings, authorization: str | None, right: Right) -> str | None:
    """Why an Authorization header does not entitle to `right`; None if it does, or if nobody is asked for a token."""
    rights = rights_of(settings, authorization)
    if isinstance(rights, str):
        return rights
    return None if right in rights else f"this token does not entitle to {right.value}"


class OwnNamesOnly:
    """Refuses requests for another host, and browsers' requests from another origin."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            if refusal := host_refusal(self._settings, headers.get("host", "")):
                await problem(HTTPStatus.MISDIRECTED_REQUEST, refusal, "wrong-host")(scope, receive, send)
                return
            if refusal := origin_refusal(self._settings, headers):
                await problem(HTTPStatus.FORBIDDEN, refusal, "wrong-origin")(scope, receive, send)
                return
        await self._app(scope, receive, send)


class TokenOnly:
    """Refuses requests without a token that lets look, where there is one and the path is not open."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] == "http" and not _is_open(scope["path"]):
            authorization = Headers(scope=scope).get("authorization")
            if refusal := right_refusal(self._settings, authorization, Right.VIEW):
                known = not isinstance(rights_of(self._settings, authorization), str)
                error = "insufficient_scope" if known else "invalid_token"
                challenge = 'Bearer realm="gazetrace"' + (f', error="{error}"' if authorization else "")
                status = HTTPStatus.FORBIDDEN if known else HTTPStatus.UNAUTHORIZED
                reply = problem(status, refusal, "token-needed", headers={"WWW-Authenticate": challenge})
                await reply(scope, receive, send)
                return
        await self._app(scope, receive, send)


class SmallBodiesOnly:
    """Reads a request's body whole before anything else sees it, and refuses one that is too large."""

    def __init__(self, app: ASGIApp, max_bytes: int) -> None:
        self._app = app
        self._max_bytes = max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        body, size = bytearray(), 0
        more = True
        while more and size <= self._max_bytes + DRAINED_BYTES:
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            size += len(message.get("body", b""))
            if size <= self._max_bytes:
                body += message.get("body", b"")
            more = message.get("more_body", False)
        if size > self._max_bytes:
            detail = f"the body is larger than {self._max_bytes:,} bytes"
            headers = {"Connection": "close"} if more else None
            await problem(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, detail, "body-too-large", headers=headers)(
                scope, receive, send
            )
            return
        read = False

        async def receive_again() -> Message:
            nonlocal read
            if read:
                return await receive()
            read = True
            return {"type": "http.request", "body": bytes(body), "more_body": False}

        await self._app(scope, receive_again, send)


def host_name(host: str) -> str:
    """The name or address in a Host header, without port and brackets, in small letters."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    name, _, port = host.rpartition(":")
    return (name if name and port.isdigit() else host).lower()


def _is_open(path: str) -> bool:
    return path in OPEN_PATHS or path.startswith(OPEN_FOLDER)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
