"""Pupil Capture as a port: its network interface, of ZeroMQ sockets and msgpack. The only file that knows either."""

from __future__ import annotations

import time
from urllib.parse import urlsplit

import msgpack
import zmq

from clients.bridge.errors import ConfigError, PortError
from clients.bridge.port import WAIT_S, Chunk
from clients.bridge.pupil import pupil_lines, topic_of

REMOTE_PORT = 50020
"""Pupil Remote, unless it is set to another one."""
ANSWER_MS = 1000
MOST_WAITING = 100_000
"""Messages that wait to be read: minutes."""
MOST_AT_ONCE = 1024
NO_MESSAGE = b"a message that is no msgpack\n"


class PupilPort:
    """The gaze that Pupil Capture publishes.

    Args:
        url: `pupil://HOST` or `pupil://HOST:PORT` of Pupil Remote.
        surface: whose gaze; None for that in the scene camera's picture.

    Raises:
        ConfigError: for a URL without a host.
        PortError: if nobody answers now.
    """

    byte_ns = 0.0
    stale_when_silent = True

    def __init__(self, url: str, surface: str | None) -> None:
        self._topic = topic_of(surface).encode()
        self._whole_topic = surface is not None
        host, port = _address(url)
        self._context = zmq.Context()
        try:
            self._messages = self._context.socket(zmq.SUB)
            self._messages.setsockopt(zmq.RCVHWM, MOST_WAITING)
            self._messages.connect(f"tcp://{host}:{self._publisher(f'tcp://{host}:{port}')}")
            self._messages.subscribe(self._topic)
        except zmq.ZMQError as error:
            self.close()
            hint = "no answer: is Pupil Capture running, with Pupil Remote on?" if error.errno == zmq.EAGAIN else error
            raise PortError(f"{url}: {hint}") from None

    def read(self) -> Chunk | None:
        """The records that have come, a line each; None after a short wait without one."""
        if not self._messages.poll(round(1000 * WAIT_S)):
            return None
        lines: list[bytes] = []
        while len(lines) < MOST_AT_ONCE and self._messages.poll(0):
            topic, *payload = self._messages.recv_multipart()
            if topic == self._topic or not self._whole_topic:
                lines.append(_lines(payload))
        data = b"".join(lines)
        return Chunk(data, time.monotonic_ns()) if data else None

    def write(self, data: bytes) -> None:
        """Whether Pupil Capture tracks is set there."""

    def close(self) -> None:
        """Hang up."""
        self._context.destroy(linger=0)

    def _publisher(self, remote: str) -> str:
        """The port that messages come from."""
        with self._context.socket(zmq.REQ) as question:
            question.setsockopt(zmq.LINGER, 0)
            question.setsockopt(zmq.RCVTIMEO, ANSWER_MS)
            question.connect(remote)
            question.send_string("SUB_PORT")
            return question.recv_string()


def _lines(payload: list[bytes]) -> bytes:
    try:
        (packed,) = payload
        return pupil_lines(msgpack.unpackb(packed, strict_map_key=False))
    except (ValueError, TypeError, AttributeError):
        return NO_MESSAGE


def _address(url: str) -> tuple[str, int]:
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if host is None:
        raise ConfigError("port", "pupil://HOST or pupil://HOST:PORT", url)
    return (f"[{host}]" if ":" in host else host), port or REMOTE_PORT
