"""A display client: says what to show and where the eye looks, and takes in frames.

```python
async with Display("http://127.0.0.1:8321") as display:
    await display.configure("atrium", display={"width_px": 1280, "height_px": 720})
    display.look_at(640, 360)
    async for frame in display.frames():
        show(frame.pixels)                  # (720, 1280, 3) uint8
        display.look_at(*pointer())         # at any time, as often as you like
```

The newest wins both ways: of gaze that could not be sent yet only the last is, and while a frame is being looked at no
more than one waits at the service. A connection that is lost is made again, and the session taken up where it was.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import secrets
import time
from collections import deque
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

from clients.connection import ServiceRefused, stay_connected, stream_url
from clients.decoding import decode_image
from clients.service_clock import ServiceClock
from service import protocol
from service.protocol import FrameHeader

STREAM_PATH: Final = "/v1/stream"

PATIENCE_S: Final = 30.0
"""How long to try without a service unless told [s]."""

FIRST_PINGS: Final = 5
FIRST_PINGS_S: Final = 0.05
PINGS_S: Final = 0.25
"""Seconds between round trips: five quick ones on a new connection, then four a second at most."""

PASSING: Final = frozenset({"not-ready", "stopping", "idle", "too-many"})
"""Refusals that call for nothing but patience."""

Asked = protocol.Configure | protocol.Camera | protocol.Quality


@dataclass(frozen=True, eq=False, slots=True)
class DisplayFrame:
    """A frame that was taken in.

    Attributes:
        header: what it shows and what it cost.
        image: the file.
        pixels: (h, w, 3) uint8 sRGB, for `raw` float32 linear Rec.709; empty unless decoded.
        received_ns: when it had come in whole, by `time.monotonic_ns`.
        decoded_ns: when it was decoded; the same for frames that are not.
    """

    header: FrameHeader
    image: bytes
    pixels: NDArray[np.uint8] | NDArray[np.float32]
    received_ns: int
    decoded_ns: int


@dataclass(frozen=True, slots=True)
class _Received:
    """A frame in the slot, and the connection it came on."""

    frame: protocol.Frame
    received_ns: int
    connection: int


class Display:
    """One viewer of one session, for one event loop; a context.

    Args:
        url: of the service, such as http://127.0.0.1:8321; https for one behind a proxy with TLS.
        token: the service's, if it wants one.
        session: name of a session to create or join; None for one's own.
        patience_s: how long to try without any service; math.inf never gives up.

    Attributes:
        session: its name, once it is known.
        ready: what is in force; None before anything was heard.
        status: the session in numbers.
        target: the calibration target to show now.
        connections: how often it has connected.
        clock: the service's clock against `time.monotonic_ns`.

    Raises, in whatever waits for the service:
        ServiceRefused: when it said no, and will again.
        ServiceGone: when it was away for too long.
        ProtocolError: for a message that is none.
    """

    def __init__(
        self, url: str, token: str | None = None, session: str | None = None, patience_s: float = PATIENCE_S
    ) -> None:
        self.session = session
        self.status: protocol.Status | None = None
        self.ready: protocol.Ready | None = None
        self.target: protocol.Target | None = None
        self.connections = 0
        self.clock = ServiceClock()
        self._url = stream_url(url, STREAM_PATH)
        self._token = token
        self._patience_s = patience_s
        self._heard_s = time.monotonic()
        self._joined = False
        self._outgoing: deque[protocol.StreamUp] = deque()
        self._gaze: protocol.Gaze | None = None
        self._gaze_waits = False
        self._seq = 0
        self._last_id = secrets.randbelow(1 << 32) << 20  # so that the numbers of two viewers differ
        self._configuration: protocol.Configure | None = None
        self._asked: dict[int | None, tuple[Asked, asyncio.Future[protocol.Ready]]] = {}
        self._slot: _Received | None = None
        self._taken: _Received | None = None
        self._refusal: ServiceRefused | None = None
        self._failure: Exception | None = None
        self._to_send = asyncio.Event()
        self._news = asyncio.Event()
        self._answered = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Display:
        """Begin to connect."""
        self._heard_s = time.monotonic()
        self._task = asyncio.create_task(self._work())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close the connection."""
        assert self._task is not None
        self._task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._task

    async def configure(
        self,
        scene: str,
        *,
        gaze: Mapping[str, Any] | None = None,
        display: Mapping[str, Any] | None = None,
        camera: Mapping[str, Any] | None = None,
        quality: Mapping[str, Any] | None = None,
        format: str | None = None,  # noqa: A002 - the name of the field
        image_quality: int | None = None,
    ) -> protocol.Ready:
        """Say what to show, in the fields of a render request; the frames after it show that.

        Raises:
            ServiceRefused: naming the field; what was shown before still is.
        """
        asked = protocol.Configure(self._new_id(), scene, gaze, display, camera, quality, format, image_quality)
        return await self._ask(asked)

    async def change_camera(self, camera: Mapping[str, Any] | None) -> protocol.Ready:
        """Another view of what is shown; None for the scene's own. Raises ServiceRefused."""
        return await self._ask(protocol.Camera(self._new_id(), camera))

    async def change_quality(self, quality: Mapping[str, Any]) -> protocol.Ready:
        """Another quality of what is shown. Raises ServiceRefused."""
        return await self._ask(protocol.Quality(self._new_id(), quality))

    def look_at(self, x: float, y: float, unit: protocol.Unit = "px", phase: protocol.EyePhase | None = None) -> int:
        """Say where the eye looks now; never waits.

        Returns:
            The number that the header of a frame made for this gaze carries as `gaze.seq`.
        """
        return self._look(x=x, y=y, unit=unit, phase=phase)

    def look_away(self) -> int:
        """Say that the eye is lost, as in a blink."""
        return self._look(valid=False)

    async def frames(self, *, decode: bool = True) -> AsyncIterator[DisplayFrame]:
        """All frames there is time for; each is acknowledged when the next one is asked for."""
        while True:
            yield await self.next_frame(decode=decode)

    async def next_frame(self, *, decode: bool = True) -> DisplayFrame:
        """The newest frame that was not taken yet, once there is one; acknowledges the one before."""
        while True:
            taken, self._taken = self._taken, None
            self._acknowledge(taken)
            self._taken = taken = await self._arrived()
            header, image = taken.frame.header, taken.frame.image
            pixels: NDArray[np.uint8] | NDArray[np.float32] = np.zeros((0, 0, 3), dtype=np.uint8)
            decoded_ns = taken.received_ns
            if decode:
                pixels = await asyncio.to_thread(decode_image, header, image)
                decoded_ns = time.monotonic_ns()
            if not self._is_outdated(header):
                return DisplayFrame(header, image, pixels, taken.received_ns, decoded_ns)

    async def _arrived(self) -> _Received:
        """The frame in the slot, once there is one."""
        while self._slot is None:
            if self._failure is not None:
                raise self._failure
            refusal, self._refusal = self._refusal, None
            if refusal is not None:
                raise refusal
            self._news.clear()
            await self._news.wait()
        arrived, self._slot = self._slot, None
        return arrived

    def _look(self, **fields: Any) -> int:
        self._seq += 1
        self._gaze = protocol.Gaze(seq=self._seq, captured_time_ns=time.monotonic_ns(), **fields)
        self._gaze_waits = True
        self._to_send.set()
        return self._seq

    def _new_id(self) -> int:
        self._last_id += 1
        return self._last_id

    async def _ask(self, asked: Asked) -> protocol.Ready:
        """Send a configuration and wait until it is in force, over reconnections if need be."""
        if self._failure is not None:
            raise self._failure
        answer: asyncio.Future[protocol.Ready] = asyncio.get_running_loop().create_future()
        self._asked[asked.id] = asked, answer
        if self._joined:
            self._send(asked)
        try:
            return await answer
        finally:
            del self._asked[asked.id]

    def _send(self, message: protocol.StreamUp) -> None:
        self._outgoing.append(message)
        self._to_send.set()

    def _acknowledge(self, received: _Received | None) -> None:
        """Give the service credit for another frame, if it still is the one that sent this."""
        if received is not None and received.connection == self.connections:
            self._send(protocol.Ack(received.frame.header.frame))

    def _is_outdated(self, header: FrameHeader) -> bool:
        """Whether a frame shows what is no longer in force."""
        return self.ready is not None and self.ready.config != header.config

    async def _work(self) -> None:
        try:
            await stay_connected(self._url, self._talk, lambda: self._heard_s, self._patience_s)
        except Exception as failure:
            self._failure = failure
            for _, answer in self._asked.values():
                if not answer.done():
                    answer.set_exception(failure)
            self._news.set()

    async def _talk(self, connection: ClientConnection) -> None:
        self.connections += 1
        self.clock.restart()
        self._joined = False
        self._outgoing.clear()
        self._send(protocol.Hello(self._token, self.session))
        tasks = [asyncio.create_task(self._write(connection)), asyncio.create_task(self._ping())]
        try:
            while True:
                self._hear(await connection.recv())
        except ConnectionClosed as closed:
            if self._refusal is not None and closed.rcvd is not None and closed.rcvd.code in protocol.LASTING:
                raise self._refusal from None
            raise
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _write(self, connection: ClientConnection) -> None:
        """Send what waits: messages in order, then the newest gaze."""
        with contextlib.suppress(ConnectionClosed):  # whoever receives is told
            while True:
                while self._outgoing:
                    await connection.send(protocol.encode(self._outgoing.popleft()))
                if self._gaze_waits and self._joined and self._gaze is not None:
                    self._gaze_waits = False
                    await connection.send(protocol.encode(self._gaze))
                    continue
                self._to_send.clear()
                await self._to_send.wait()

    async def _ping(self) -> None:
        """Measure round trips, one at a time: on a slow line the answers would pile up behind a frame."""
        for number in itertools.count():
            self._answered.clear()
            self._send(protocol.Ping(number, time.monotonic_ns()))
            await asyncio.sleep(FIRST_PINGS_S if number < FIRST_PINGS else PINGS_S)
            await self._answered.wait()

    def _hear(self, data: str | bytes) -> None:
        received_ns = time.monotonic_ns()
        if isinstance(data, bytes):
            self._slot = _Received(protocol.unpack_frame(data), received_ns, self.connections)
            self._news.set()
        else:
            match protocol.decode_stream_down(data):
                case protocol.Pong() as pong:
                    self._answered.set()
                    self.clock.answered(pong.client_time_ns, pong.service_time_ns, received_ns)
                case protocol.Status() as status:
                    self.status = status
                case protocol.Target() as target:
                    self.target = None if target.x is None else target
                case protocol.Error() as error:
                    self._hear_error(error)
                    return
                case protocol.Ready() as ready:
                    self._hear_ready(ready)
        self._heard_s = time.monotonic()

    def _hear_error(self, error: protocol.Error) -> None:
        refusal = ServiceRefused(error.code, error.message, error.field)
        if error.id in self._asked:
            _, answer = self._asked[error.id]
            if not answer.done():
                answer.set_exception(refusal)
        elif error.code not in PASSING:
            self._refusal = refusal
            self._news.set()

    def _hear_ready(self, ready: protocol.Ready) -> None:
        self.ready, self.session = ready, ready.session
        if self._slot is not None and self._is_outdated(self._slot.frame.header):
            outdated, self._slot = self._slot, None
            self._acknowledge(outdated)
        if ready.config in self._asked:
            asked, answer = self._asked[ready.config]
            self._keep(asked)
            if not answer.done():
                answer.set_result(ready)
        if not self._joined:
            self._resume(ready)

    def _keep(self, asked: Asked) -> None:
        """Remember what was put in force, for a service that forgets it."""
        if isinstance(asked, protocol.Configure):
            self._configuration = asked
        elif self._configuration is not None and isinstance(asked, protocol.Camera):
            self._configuration = replace(self._configuration, camera=asked.camera)
        elif self._configuration is not None and isinstance(asked, protocol.Quality):
            self._configuration = replace(self._configuration, quality=asked.quality)

    def _resume(self, ready: protocol.Ready) -> None:
        """Say again what a service that has just been joined does not know."""
        self._joined = True
        if ready.config is None and self._configuration is not None:
            self._send(replace(self._configuration, id=self._new_id()))
        for asked, _ in self._asked.values():
            self._send(asked)
        self._gaze_waits = self._gaze is not None
        self._to_send.set()
