"""What waits for one client: bounded, in order, the newest frame alone."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from service import protocol
from service.metrics import Metrics
from service.outbox import MOST_MESSAGES, Close, Outbox
from service.protocol import CloseCode, ProtocolError
from service.shown import Shown
from tests.service.test_protocol import HEADER

PER_VIEWER = ("frame", "image_bytes", "dropped", "service_time_ns")
STATUS = protocol.Status(1, 2, 3, 0, 1, 0, "live")


@pytest.fixture
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


def shown(number: int, image: bytes = b"image") -> Shown:
    fields = {name: getattr(HEADER, name) for name in protocol.FrameHeader.__slots__ if name not in PER_VIEWER}
    return Shown(number, fields, {"gaze_received": 1, "started": 2, "finished": 3}, image)


def outbox() -> Outbox:
    return Outbox(lambda: 4, lambda: STATUS, Metrics())


def taken(runner: asyncio.Runner, box: Outbox) -> Any:
    """What comes next, decoded; None if nothing does."""

    async def take() -> Any:
        try:
            async with asyncio.timeout(0):
                return await box.next()
        except TimeoutError:
            return None

    found = runner.run(take())
    if isinstance(found, bytes):
        return protocol.unpack_frame(found).header
    return protocol.decode_stream_down(found) if isinstance(found, str) else found


def test_the_newest_frame_takes_the_place_of_those_before(runner: asyncio.Runner) -> None:
    box = outbox()
    for number in range(1, 6):
        assert box.wants_frame
        box.offer(shown(number))
    header = taken(runner, box)
    assert (header.frame, header.dropped, header.service_time_ns.sent) == (5, 4, 4)
    assert taken(runner, box) is None
    assert box.wants_frame
    box.offer(shown(6))
    assert not box.wants_frame
    box.offer(shown(7))
    assert taken(runner, box) is None
    box.acknowledge(4)
    assert taken(runner, box) is None
    box.acknowledge(5)
    assert taken(runner, box).frame == 7
    assert box.dropped == 5


def test_a_frame_that_was_not_sent_cannot_be_acknowledged(runner: asyncio.Runner) -> None:
    box = outbox()
    box.offer(shown(3))
    with pytest.raises(ProtocolError, match="up to 0, found 3"):
        box.acknowledge(3)


def test_messages_come_in_order_and_before_frames(runner: asyncio.Runner) -> None:
    box = outbox()
    box.offer(shown(1))
    box.tell_status()
    box.tell_status()
    pongs = [protocol.Pong(number, 0, 0) for number in range(3)]
    for pong in pongs:
        box.tell(pong)
    assert [taken(runner, box) for _ in range(3)] == pongs
    assert taken(runner, box) == STATUS
    assert taken(runner, box).frame == 1
    assert taken(runner, box) is None


def test_a_withdrawn_frame_is_not_sent(runner: asyncio.Runner) -> None:
    box = outbox()
    box.offer(shown(1))
    box.withdraw()
    assert taken(runner, box) is None
    assert box.dropped == 1


def test_a_client_that_does_not_read_is_sent_away_and_costs_no_more(runner: asyncio.Runner) -> None:
    box = outbox()
    for number in range(10 * MOST_MESSAGES):
        box.tell(protocol.Pong(number, 0, 0))
        box.offer(shown(number + 1))
    told = []
    while not isinstance(heard := taken(runner, box), Close):
        told.append(heard.id)
    assert told == list(range(MOST_MESSAGES))
    assert heard.code == CloseCode.TOO_MANY


def test_what_waits_is_said_before_the_end(runner: asyncio.Runner) -> None:
    box = outbox()
    box.tell(protocol.Pong(1, 0, 0))
    box.offer(shown(1))
    error = protocol.Error("stopping", "the end")
    box.close(CloseCode.STOPPING, "the end", error)
    box.close(CloseCode.PROTOCOL, "another end")
    assert [taken(runner, box), taken(runner, box), taken(runner, box)] == [
        protocol.Pong(1, 0, 0), error, Close(CloseCode.STOPPING, "the end"),
    ]  # fmt: skip
