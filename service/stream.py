"""The WebSocket routes: viewers on `/v1/stream`, gaze sources on `/v1/gaze`; and the list of sessions."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from dataclasses import replace
from typing import Annotated, Any

from fastapi import APIRouter, Query, WebSocket
from pydantic import BaseModel, Field, ValidationError
from starlette.websockets import WebSocketDisconnect

from renderer.errors import RenderError
from service import protocol
from service.access import Right, host_refusal, origin_refusal, right_refusal, rights_of
from service.allowance import Allowance
from service.desk import Desk, TheDesk
from service.jobs import Stopping
from service.openapi import ERRORS
from service.outbox import Close, Outbox
from service.protocol import CloseCode, ProtocolError
from service.record import plain
from service.refusal import refusal
from service.rendering import OverLimit
from service.request import NoQuery, StreamBody
from service.request_log import name_session
from service.session import Session
from service.sessions import TooMany

HELLO_S = 10.0
"""How long a client may take to say its first message [s]."""

LONGEST_REASON_BYTES = 123
"""Of a close frame (RFC 6455, 5.5)."""

ABNORMAL_CLOSURE = 1006
"""Code for a connection that ended without one (RFC 6455, 7.1.5)."""

log = logging.getLogger(__name__)

router = APIRouter(tags=["streams"])


class SessionSummary(BaseModel):
    """A session."""

    session: str
    scene: str | None = Field(description="null: not configured yet")
    config: int | None = Field(description="id of the configuration in force")
    viewers: int
    gaze_sources: int
    gaze_state: str = Field(description="live, held (a blink), lost, or none yet")
    frames: int = Field(description="rendered so far")


class SessionList(BaseModel):
    """All sessions, oldest first."""

    sessions: list[SessionSummary]


@router.get("/v1/sessions", summary="All sessions", responses=ERRORS)
async def sessions(_: Annotated[NoQuery, Query()], desk: TheDesk) -> SessionList:
    """The sessions of viewers and gaze sources."""
    return SessionList(sessions=[_summary(session) for session in desk.sessions.all()])


class Refused(Exception):
    """The connection is to be closed with `code`."""

    def __init__(self, code: CloseCode, error: protocol.Error) -> None:
        super().__init__(error.message)
        self.code = code
        self.error = error


@router.websocket("/v1/stream")
async def stream(websocket: WebSocket) -> None:
    """A viewer: configurations, gaze and acknowledgements up, frames down."""
    await _answer(websocket, _view)


@router.websocket("/v1/gaze")
async def gaze(websocket: WebSocket) -> None:
    """A gaze source: samples up."""
    await _answer(websocket, _feed)


async def _answer(websocket: WebSocket, talk: Callable[[WebSocket, Desk], Awaitable[None]]) -> None:
    """Accept a client, talk if it may come in, and close with a reason that it can read."""
    offered = protocol.SUBPROTOCOL in websocket.scope["subprotocols"]
    await websocket.accept(protocol.SUBPROTOCOL if offered else None)
    try:
        try:
            if not offered:
                raise ProtocolError("subprotocol", f"expected {protocol.SUBPROTOCOL} among those offered")
            _check_origin(websocket)
            await talk(websocket, websocket.app.state.desk)
        except ProtocolError as error:
            raise Refused(CloseCode.PROTOCOL, refusal(error)) from None
        except TooMany as error:
            raise Refused(CloseCode.TOO_MANY, protocol.Error("too-many", str(error))) from None
        except Stopping as error:
            raise Refused(CloseCode.STOPPING, protocol.Error("stopping", str(error))) from None
    except Refused as refused:
        with contextlib.suppress(WebSocketDisconnect):
            await _deliver(websocket.send_text(protocol.encode(refused.error)))
            await _deliver(websocket.close(refused.code, _reason(refused.error)))
    except WebSocketDisconnect:
        return


async def _view(websocket: WebSocket, desk: Desk) -> None:
    first = protocol.decode_stream_up(await _first_text(websocket))
    hello = first if isinstance(first, protocol.Hello) else protocol.Hello()
    rights = _check_token(websocket, hello, Right.VIEW)
    session, viewer = desk.sessions.view(hello.session)
    name_session(websocket.scope, session.name)

    async def hear(message: protocol.StreamUp) -> None:
        if isinstance(message, protocol.Gaze) and Right.GAZE not in rights:
            raise ProtocolError("type", f"expected no gaze, as the token does not entitle to {Right.GAZE.value}")
        await _hear_viewer(session, viewer, message, desk)

    async def listen() -> None:
        if first is not hello:
            await hear(first)
        async for text in _texts(websocket, desk):
            await hear(protocol.decode_stream_up(text))

    await _exchange(websocket, session, viewer, listen())


async def _feed(websocket: WebSocket, desk: Desk) -> None:
    name = protocol.Hello(session=websocket.query_params.get("session")).session
    if name is None:
        raise ProtocolError("session", "is required: /v1/gaze?session=NAME")
    if _authorization(websocket) is None and desk.studio.settings.token is not None:
        first = protocol.decode_gaze_up(await _first_text(websocket))
        _check_token(websocket, first if isinstance(first, protocol.Hello) else protocol.Hello(), Right.GAZE)
    else:
        _check_token(websocket, protocol.Hello(), Right.GAZE)
    session, source = desk.sessions.feed(name)
    name_session(websocket.scope, name)

    async def listen() -> None:
        async for text in _texts(websocket, desk):
            _hear_source(session, source, protocol.decode_gaze_up(text), desk)

    await _exchange(websocket, session, source, listen())


async def _hear_viewer(session: Session, viewer: Outbox, message: protocol.StreamUp, desk: Desk) -> None:
    match message:
        case protocol.Hello():
            raise ProtocolError("type", "expected hello first or not at all, found it later")
        case protocol.Configure() | protocol.Camera() | protocol.Quality():
            try:
                await session.configure(message.id, _body(session, message))
            except (LookupError, OverLimit, RenderError, ValidationError) as error:
                refused = replace(refusal(error), id=message.id)
                log.info("session %s: %s refused: %s", session.name, message.type, refused.message)
                viewer.tell(refused)
        case protocol.Gaze():
            session.look([message])
        case protocol.Ack():
            viewer.acknowledge(message.frame)
        case protocol.Ping():
            viewer.tell(protocol.Pong(message.id, message.client_time_ns, desk.sessions.clock()))


def _hear_source(session: Session, source: Outbox, message: protocol.GazeUp, desk: Desk) -> None:
    match message:
        case protocol.Hello():
            pass
        case protocol.Gaze():
            session.look([message])
        case protocol.GazeBatch():
            session.look(message.samples)
        case protocol.Margin():
            session.set_margin(source, message.margin_deg)
        case protocol.Target():
            session.forward(message)
        case protocol.Ping():
            source.tell(protocol.Pong(message.id, message.client_time_ns, desk.sessions.clock()))


def _body(session: Session, message: protocol.Configure | protocol.Camera | protocol.Quality) -> StreamBody:
    """What a client wants to see, whole.

    Raises:
        ValidationError: naming the field.
        LookupError: for a change of a configuration that there is not.
    """
    if isinstance(message, protocol.Configure):
        stated = plain(message)
        del stated["id"]
        return StreamBody.model_validate({name: value for name, value in stated.items() if value is not None})
    if isinstance(message, protocol.Camera):
        return StreamBody.model_validate({**session.body(), "camera": message.camera})
    return StreamBody.model_validate({**session.body(), "quality": message.quality})


async def _exchange(websocket: WebSocket, session: Session, outbox: Outbox, listen: Coroutine[Any, Any, None]) -> None:
    """Send what waits and hear what comes, until either side ends the connection."""
    hearing = asyncio.create_task(listen)
    sending = asyncio.create_task(_send(websocket, outbox))
    try:
        await asyncio.wait((hearing, sending), return_when=asyncio.FIRST_COMPLETED)
        if not sending.done():
            error = hearing.exception()
            if isinstance(error, Refused):
                outbox.close(error.code, error.error.message, error.error)
            elif isinstance(error, ProtocolError):
                outbox.close(CloseCode.PROTOCOL, str(error), refusal(error))
            elif not isinstance(error, WebSocketDisconnect):
                assert isinstance(error, Exception)
                outbox.close(CloseCode.TRY_LATER, "a mistake of the service; its log says more", refusal(error))
            else:
                return
        await sending
    finally:
        session.leave(outbox)
        hearing.cancel()
        sending.cancel()
        await asyncio.gather(hearing, sending, return_exceptions=True)


async def _send(websocket: WebSocket, outbox: Outbox) -> None:
    """Send until the connection is to end, and end it."""
    while True:
        match await outbox.next():
            case Close() as end:
                await _deliver(websocket.close(end.code, _cut(end.reason)))
                return
            case str() as text:
                await _deliver(websocket.send_text(text))
            case data:
                await _deliver(websocket.send_bytes(data))


async def _deliver(sending: Awaitable[None]) -> None:
    """Send something.

    Raises:
        WebSocketDisconnect: if the connection has ended, be it that the server ended it because of a damaged frame.
    """
    try:
        await sending
    except RuntimeError:
        raise WebSocketDisconnect(ABNORMAL_CLOSURE) from None


async def _first_text(websocket: WebSocket) -> str:
    try:
        async with asyncio.timeout(HELLO_S):
            return await _text(websocket)
    except TimeoutError:
        message = f"expected a first message within {HELLO_S:g} s, found none"
        raise Refused(CloseCode.EXPIRED, protocol.Error("idle", message)) from None


async def _texts(websocket: WebSocket, desk: Desk) -> AsyncIterator[str]:
    """What a client says, until it leaves.

    Raises:
        Refused: if it says too much.
    """
    most = desk.studio.settings.max_messages_per_s
    allowance = Allowance(most, desk.sessions.clock)
    while True:
        text = await _text(websocket)
        if not allowance.spend():
            raise Refused(
                CloseCode.TOO_MANY,
                protocol.Error("too-many", f"expected at most {most:,} messages a second, found more"),
            )
        yield text


async def _text(websocket: WebSocket) -> str:
    message = await websocket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message["code"])
    text = message.get("text")
    if text is None:
        raise ProtocolError("message", "expected text, found binary")
    return str(text)


def _check_origin(websocket: WebSocket) -> None:
    settings = websocket.app.state.desk.studio.settings
    headers = websocket.headers
    refused = host_refusal(settings, headers.get("host", "")) or origin_refusal(settings, headers)
    if refused:
        raise Refused(CloseCode.ORIGIN, protocol.Error("wrong-origin", refused))


def _authorization(websocket: WebSocket) -> str | None:
    return websocket.headers.get("authorization")


def _check_token(websocket: WebSocket, hello: protocol.Hello, right: Right) -> frozenset[Right]:
    """Refuse a client that shows no fitting token, neither in its header nor in its first message; else its rights."""
    settings = websocket.app.state.desk.studio.settings
    shown = _authorization(websocket)
    if shown is None and hello.token is not None:
        shown = f"Bearer {hello.token}"
    if refused := right_refusal(settings, shown, right):
        raise Refused(CloseCode.TOKEN, protocol.Error("token-needed", f"{refused}, or say hello with it first"))
    rights = rights_of(settings, shown)
    assert not isinstance(rights, str)
    return rights


def _reason(error: protocol.Error) -> str:
    """An error as a reason for the end of a connection."""
    return _cut(error.message if error.field is None else f"{error.field}: {error.message}")


def _cut(text: str) -> str:
    """As much of a reason as a close frame holds; JSON may bring halves of surrogate pairs, which UTF-8 has not."""
    return text.encode(errors="backslashreplace")[:LONGEST_REASON_BYTES].decode(errors="ignore")


def _summary(session: Session) -> SessionSummary:
    status, ready = session.status(), session.ready()
    return SessionSummary(
        session=session.name,
        scene=ready.scene,
        config=ready.config,
        viewers=status.viewers,
        gaze_sources=status.gaze_sources,
        gaze_state=status.gaze_state,
        frames=status.frames,
    )
