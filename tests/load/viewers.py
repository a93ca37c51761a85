"""Viewers of many sessions, each taking every frame it is sent while the gaze of its session moves."""

from __future__ import annotations

import asyncio
import math
import random
import time
from collections import Counter
from dataclasses import dataclass, field

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from service import protocol
from tests.load.growth import Growth, growth_of
from tests.load.kept import kept_bytes
from tests.service.conftest import PATIENCE_S
from tests.service.process import ServiceProcess

SCREEN = {"width_px": 320, "height_px": 180, "width_cm": 50.0, "distance_cm": 60.0}
SCENE = "spheres"
QUALITY = {"samples_per_cell": 1, "gaze_bucket_px": 8}

GAZE_S = 1 / 30
"""Between two places of a session's gaze."""

REQUEST_S = 0.2
"""Between two small requests."""

SAMPLE_S = 0.5
"""Between two looks at what the service holds."""

MIB = 1 << 20

WARM_UP_SHARE = 0.25
"""Of the time, before anything is counted: caches fill, threads begin."""

SMALL = "/v1/scenes/matte/frame?gaze_x=0.5&gaze_y=0.5&unit=fraction&width_px=64&height_px=36"


@dataclass
class Load:
    """What was measured after the warm-up.

    Attributes:
        seconds: how long.
        frames: taken in by all viewers, by session.
        request_ms: of each small request.
        memory_mib, descriptors, threads: of the service, over time.
        kept_mib: of that memory, what the service says that it keeps.
        done: frames by then.
        lost: connections that ended, and requests that were not answered with a frame.
    """

    seconds: float = 0.0
    frames: Counter[str] = field(default_factory=Counter)
    request_ms: list[float] = field(default_factory=list)
    memory_mib: list[float] = field(default_factory=list)
    kept_mib: list[float] = field(default_factory=list)
    descriptors: list[int] = field(default_factory=list)
    threads: list[int] = field(default_factory=list)
    done: list[int] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    @property
    def least_share(self) -> float:
        """Frames of the session with the fewest, over the mean."""
        return min(self.frames.values()) * len(self.frames) / self.frames.total()

    def request_at(self, share: float) -> float:
        """Time within which this share of the small requests was answered [ms]."""
        return sorted(self.request_ms)[min(int(share * len(self.request_ms)), len(self.request_ms) - 1)]

    @property
    def growth(self) -> Growth:
        """Of the memory beside what is kept, for each frame taken in; of a run that lasts for minutes."""
        besides = [MIB * (held - kept) for held, kept in zip(self.memory_mib, self.kept_mib, strict=True)]
        return growth_of(self.done, besides)

    @property
    def memory_growth_mib(self) -> float:
        """Median memory of the last third over that of the first."""
        third = max(len(self.memory_mib) // 3, 1)
        first, last = sorted(self.memory_mib[:third]), sorted(self.memory_mib[-third:])
        return last[len(last) // 2] - first[len(first) // 2]


def load(service: ServiceProcess, viewers: int, sessions: int, seconds: float) -> Load:
    """Hold `viewers` over `sessions` for so long."""
    return asyncio.run(_load(service, viewers, sessions, seconds))


async def _load(service: ServiceProcess, viewers: int, sessions: int, seconds: float) -> Load:
    found = Load()
    names = [f"load-{number}" for number in range(sessions)]
    counting = asyncio.Event()
    joined = asyncio.Semaphore(0)
    work = [_view(service.address, names[i % sessions], i < sessions, found, counting, joined) for i in range(viewers)]
    tasks = [asyncio.create_task(each) for each in work]
    try:
        async with asyncio.timeout(PATIENCE_S):
            for _ in range(viewers):
                await joined.acquire()
        tasks += [
            asyncio.create_task(each) for each in (_ask(service, found, counting), _watch(service, found, counting))
        ]
        await asyncio.sleep(WARM_UP_SHARE * seconds)
        found.frames = Counter(dict.fromkeys(names, 0))
        began = time.monotonic()
        counting.set()
        await asyncio.sleep((1 - WARM_UP_SHARE) * seconds)
        counting.clear()
        found.seconds = time.monotonic() - began
    finally:
        for task in tasks:
            task.cancel()
        failures = [
            each for each in await asyncio.gather(*tasks, return_exceptions=True) if isinstance(each, Exception)
        ]
        found.lost += [repr(failure) for failure in failures]
    return found


async def _view(
    address: str, session: str, leads: bool, found: Load, counting: asyncio.Event, joined: asyncio.Semaphore
) -> None:
    """One viewer; the one that leads configures its session and moves its gaze."""
    async with connect(
        address.replace("http", "ws", 1) + "/v1/stream",
        subprotocols=[Subprotocol(protocol.SUBPROTOCOL)],
        max_size=None,
        compression=None,
        proxy=None,
        open_timeout=PATIENCE_S,
        ping_interval=None,
    ) as connection:
        await connection.send(protocol.encode(protocol.Hello(session=session)))
        if leads:
            await connection.send(protocol.encode(protocol.Configure(1, SCENE, display=SCREEN, quality=QUALITY)))
        moving = asyncio.create_task(_move(connection, session)) if leads else None
        try:
            first = True
            while True:
                received = await connection.recv()
                if isinstance(received, bytes):
                    frame = protocol.unpack_frame(received)
                    await connection.send(protocol.encode(protocol.Ack(frame.header.frame)))
                    found.frames[session] += counting.is_set()
                    if first:
                        joined.release()
                        first = False
        except ConnectionClosed as closed:
            found.lost.append(f"{session}: {closed}")
        finally:
            if moving is not None:
                moving.cancel()


async def _move(connection: ClientConnection, session: str) -> None:
    """A gaze that goes round and jumps."""
    chance = random.Random(session)
    angle = chance.uniform(0.0, math.tau)
    while True:
        angle += 0.15 if chance.random() < 0.95 else chance.uniform(0.0, math.tau)
        x, y = 0.5 + 0.4 * math.cos(angle), 0.5 + 0.4 * math.sin(angle)
        await connection.send(protocol.encode(protocol.Gaze(x=x, y=y, unit="fraction")))
        await asyncio.sleep(GAZE_S)


async def _ask(service: ServiceProcess, found: Load, counting: asyncio.Event) -> None:
    async with httpx.AsyncClient(base_url=service.address, timeout=PATIENCE_S, trust_env=False) as client:
        while True:
            began = time.monotonic()
            reply = await client.get(SMALL)
            if reply.status_code != 200:
                found.lost.append(f"{reply.status_code}: {reply.text}")
            elif counting.is_set():
                found.request_ms.append(1000 * (time.monotonic() - began))
            await asyncio.sleep(REQUEST_S)


async def _watch(service: ServiceProcess, found: Load, counting: asyncio.Event) -> None:
    async with httpx.AsyncClient(base_url=service.address, timeout=PATIENCE_S, trust_env=False) as client:
        while True:
            await counting.wait()
            found.kept_mib.append(await kept_bytes(client) / MIB)
            found.memory_mib.append(service.resident_bytes / MIB)
            found.descriptors.append(service.descriptors)
            found.threads.append(service.threads)
            found.done.append(found.frames.total())
            await asyncio.sleep(SAMPLE_S)
