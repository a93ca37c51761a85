"""Clients of the streams that say what they should not: each message is answered, ignored or ends its connection."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
from collections import Counter
from dataclasses import dataclass, field

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from service import protocol
from tests.hostile.messages import mutated, mutated_frame
from tests.service.conftest import PATIENCE_S

CLIENTS = 16
"""At once, so that the service never waits for them."""

FRAME_SHARE = 0.1
"""How many of the messages are damaged WebSocket frames in place of damaged messages in whole ones."""

GAZE_SHARE = 0.4
"""How many of the connections are those of gaze sources."""

SESSIONS = 24

MISTAKES = (1011, protocol.CloseCode.TRY_LATER)
"""Close codes with which a service admits a mistake of its own."""

TOO_SLOW = "keepalive ping timeout"
"""Why a connection ends with one of these codes where it was no mistake: this process had no processor for too long."""

TOO_SLOW_STATUS = 408
"""The same, before the connection is one of messages."""


@dataclass
class Attacked:
    """What was sent, and what came of it.

    Attributes:
        sent: messages.
        closes: connections that the service ended, by close code or, where there was none, status.
        mistakes: what the service said or did by a mistake of its own, and the message before it.
    """

    sent: int = 0
    closes: Counter[int | None] = field(default_factory=Counter)
    mistakes: list[str] = field(default_factory=list)


def attack(address: str, messages: int, number: int = 1, attacked: Attacked | None = None) -> Attacked:
    """Send so many mutated messages; another `number` makes up others. `attacked` is counted up meanwhile."""
    attacked = attacked or Attacked()

    async def all_clients() -> None:
        share = -(-messages // CLIENTS)
        clients = (_client(address, share, random.Random(f"{number} {i}"), attacked) for i in range(CLIENTS))
        await asyncio.gather(*clients)

    asyncio.run(all_clients())
    return attacked


async def _client(address: str, messages: int, chance: random.Random, attacked: Attacked) -> None:
    left = messages
    while left > 0:
        path = "/v1/stream"
        if chance.random() < GAZE_SHARE:
            path = f"/v1/gaze?session=s{chance.randrange(SESSIONS)}"
        connecting = connect(
            address.replace("http", "ws", 1) + path,
            subprotocols=[Subprotocol(protocol.SUBPROTOCOL)],
            max_size=None,
            compression=None,
            proxy=None,
            ping_interval=None,
            open_timeout=PATIENCE_S,
        )
        try:
            async with connecting as connection:
                left -= await asyncio.wait_for(_talk(connection, path, left, chance, attacked), PATIENCE_S)
        except InvalidStatus as refused:
            attacked.closes[refused.response.status_code] += 1
            if refused.response.status_code != TOO_SLOW_STATUS:
                attacked.mistakes.append(str(refused))


async def _talk(connection: ClientConnection, path: str, most: int, chance: random.Random, attacked: Attacked) -> int:
    """Send until the service ends the connection; how many messages that were."""
    sent, last = 0, ""
    try:
        if path == "/v1/stream" and chance.random() < 0.7:
            name = f"s{chance.randrange(SESSIONS)}"
            await connection.send(protocol.encode(protocol.Hello(session=name)))
        while sent < most:
            sent += 1
            attacked.sent += 1
            if chance.random() < FRAME_SHARE:
                frame = mutated_frame(chance)
                last = repr(frame)
                with contextlib.suppress(OSError, RuntimeError):  # the service has ended the connection already
                    connection.transport.write(frame)
                    connection.transport.write_eof()
                while True:
                    _note(await connection.recv(), last, attacked)
            message = mutated(chance)
            last = repr(message)
            await connection.send(message)
            await connection.send(protocol.encode(protocol.Ping(sent, 0)))
            while not _note(await connection.recv(), last, attacked):
                pass
    except ConnectionClosed:
        close = connection.protocol.close_rcvd
        attacked.closes[close.code if close else None] += 1
        if close and close.code in MISTAKES and close.reason != TOO_SLOW:
            attacked.mistakes.append(f"closed with {close.code} {close.reason} after {last}")
    return sent


def _note(received: str | bytes, last: str, attacked: Attacked) -> bool:
    """Keep what is a mistake of the service; whether this answers a ping."""
    if isinstance(received, bytes):
        return False
    said = json.loads(received)
    if said["type"] == "error" and said["code"] == "mistake":
        attacked.mistakes.append(f"{received} after {last}")
    return bool(said["type"] == "pong")
