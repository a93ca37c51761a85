"""A viewer at the end of a slow line: it gets what is newest, costs the others nothing, and is kept while it reads."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from itertools import pairwise
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed

from renderer.pipeline import Renderer
from service.protocol import FrameHeader, Gaze, Status
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.slow_line import slow_line
from tests.service.streaming import COARSE, Peer, configure, sessions, viewer

PING_S = 2

FRAME_BYTES = 96 * 54 * 12
SMALL: dict[str, Any] = {"quality": COARSE, "format": "raw", "display": {"width_px": 96, "height_px": 54}}
FIRST = {"gaze_x": 1, "gaze_y": 1, "width_px": 96, "height_px": 54, "format": "raw"}
"""A frame after which no kernel has to be compiled while clients are asked whether they are there."""

LINE_BYTES_PER_S = 15_000
"""A frame takes four seconds: longer than a client has to answer whether it is there."""

LARGE: dict[str, Any] = {"quality": COARSE, "format": "raw", "display": {"width_px": 1280, "height_px": 720}}
"""Frames of 11 MB: more than the kernel takes off the service's hands."""

SLOW_FRAMES = 2
MANY_TIMES = 5

DRAIN_S, BUSY_S = 5.0, 5.0
"""How long a service may take to end, and what a busy machine may add."""


@pytest.fixture
def strict(renderer: Renderer) -> Iterator[str]:
    """A service that soon gives up clients that are not there."""
    with serving(Settings(port=0, ping_s=PING_S, session_expiry_s=0), renderer) as address:
        httpx.get(f"{address}/v1/scenes/matte/frame", params=FIRST, timeout=PATIENCE_S).raise_for_status()
        yield address


def metric(address: str, name: str) -> float:
    lines = httpx.get(f"{address}/metrics", timeout=PATIENCE_S).text.splitlines()
    (value,) = (float(line.split()[1]) for line in lines if line.startswith(f"{name} "))
    return value


def moved_until(still: threading.Thread, eye: Peer) -> list[FrameHeader]:
    """What a viewer sees that moves its gaze with every frame for as long as a thread runs."""
    seen: list[FrameHeader] = []
    seq = 0
    while still.is_alive():
        seq += 1
        eye.say(Gaze(8.0 + seq * 37 % 80, 27.0, seq=seq))
        while not seen or seen[-1].gaze is None or seen[-1].gaze.seq != seq:
            seen.append(eye.frame().header)
    return seen


def test_a_viewer_on_a_slow_line_gets_the_newest_frames_and_slows_nobody(strict: str) -> None:
    with (
        viewer(strict, "two") as fast,
        slow_line(strict, LINE_BYTES_PER_S) as line,
        viewer(strict, "two", sock=line.client) as slow,
    ):
        arrived: list[FrameHeader] = []
        fast.say(configure(**SMALL))
        reader = threading.Thread(target=lambda: arrived.extend(slow.frame().header for _ in range(SLOW_FRAMES)))
        reader.start()
        seen = moved_until(reader, fast)
        assert len(arrived) == SLOW_FRAMES
        assert len(seen) > MANY_TIMES * SLOW_FRAMES
        for number, header in enumerate(arrived):
            assert header.dropped == header.frame - number - 1
            before = [other for other in seen if other.service_time_ns.sent < header.service_time_ns.sent]
            assert all(other.frame <= header.frame for other in before)
            newest = max((other.gaze.seq or 0 for other in before if other.gaze is not None), default=0)
            assert number == 0 or (header.gaze is not None and header.gaze.seq is not None)
            assert header.gaze is None or (header.gaze.seq or 0) >= newest
        for earlier, later in pairwise(arrived):
            assert later.frame > earlier.frame + MANY_TIMES
            assert later.service_time_ns.sent - earlier.service_time_ns.sent > PING_S * 10**9
        assert metric(strict, "gazetrace_dropped_frames_total") >= arrived[-1].dropped
        sent = metric(strict, 'gazetrace_image_bytes_total{via="stream"}') / FRAME_BYTES
        assert sent - len(arrived) - len(seen) <= 2  # one on its way to each
        assert sessions(strict)["two"]["viewers"] == 2
        line.bytes_per_s = 1e9  # or an answer to a ping behind a frame comes after the service has ended the connection
        slow.frame()
        slow.connection.close()
        assert slow.connection.protocol.close_code == 1000
        assert fast.next(Status, lambda status: status.viewers == 1)


def test_a_viewer_whose_line_stands_still_in_a_frame_is_given_up(strict: str) -> None:
    with slow_line(strict, 1e9) as line, viewer(strict, "stuck", sock=line.client) as stuck:
        line.bytes_per_s = 0
        stuck.say(configure(**LARGE))
        until = time.monotonic() + PATIENCE_S
        while sessions(strict):
            assert time.monotonic() < until
        assert metric(strict, "gazetrace_connections") <= 2  # ours


def test_a_service_ends_while_a_frame_is_on_a_slow_line(renderer: Renderer) -> None:
    with ExitStack() as clients:
        with serving(Settings(port=0), renderer) as address:
            line = clients.enter_context(slow_line(address, LINE_BYTES_PER_S))
            slow = clients.enter_context(viewer(address, sock=line.client))
            slow.say(configure(**LARGE))
            line.wait(LINE_BYTES_PER_S)
            began = time.monotonic()
        assert time.monotonic() - began < DRAIN_S + BUSY_S
        with suppress(ConnectionClosed):  # else no word comes in time
            while True:
                slow.connection.recv(BUSY_S)
