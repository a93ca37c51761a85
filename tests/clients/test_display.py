"""The Python client against a real service: what it shows, and that it comes back."""

from __future__ import annotations

import asyncio
import contextlib
import http.server
import math
import threading
import time
from collections.abc import Coroutine, Iterator
from typing import Any, TypeVar

import httpx
import numpy as np
import pytest

from clients import connection
from clients import display as display_client
from clients.connection import ServiceGone, ServiceRefused, stream_url
from clients.decoding import decode_image
from clients.display import Display, DisplayFrame
from renderer.codec import encode
from renderer.pipeline import Renderer
from service.protocol import FrameHeader, ProtocolError, ServiceTimes
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.slow_line import SlowLine, slow_line

Result = TypeVar("Result")

SCREEN = {"width_px": 64, "height_px": 36}
COARSE = {"samples_per_cell": 2, "gaze_bucket_px": 1, "acuity": {"scale": 8.0}}
TOKEN = "a-long-secret"

MOST_OF_A_FRAME = 200_000
"""Bytes; it has 264,000."""


def run(work: Coroutine[Any, Any, Result]) -> Result:
    async def patiently() -> Result:
        return await asyncio.wait_for(work, PATIENCE_S)

    return asyncio.run(patiently())


async def final(display: Display) -> DisplayFrame:
    """The last frame for the present gaze."""
    async for frame in display.frames():
        if frame.header.phase == "final":
            return frame
    raise AssertionError


def test_frames_come_for_the_gaze_as_arrays(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            ready = await display.configure("spheres", display=SCREEN, quality=COARSE, gaze={"x": 5, "y": 5})
            assert ready.display is not None
            assert (ready.scene, ready.display["width_px"], ready.session) == ("spheres", 64, display.session)
            first = await display.next_frame()
            assert first.header.format == "jpeg"
            assert (first.pixels.shape, first.pixels.dtype) == ((36, 64, 3), np.uint8)
            assert first.received_ns <= first.decoded_ns <= time.monotonic_ns()
            pictures = [(await final(display)).pixels]
            for x, y in ((60, 30), (5, 5)):
                seq = display.look_at(x, y)
                last = await final(display)
                assert last.header.gaze is not None
                assert (last.header.gaze.seq, last.header.gaze.x, last.header.gaze.y) == (seq, x, y)
                pictures.append(last.pixels)
            np.testing.assert_array_equal(pictures[0], pictures[2], err_msg="the same gaze gives the same picture")
            assert (pictures[0] != pictures[1]).any()
            assert display.status is not None
            assert display.status.gaze_state == "live"

    run(work())


def test_frames_need_not_be_decoded(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN)
            frame = await display.next_frame(decode=False)
            assert frame.pixels.size == 0
            assert frame.decoded_ns == frame.received_ns
            assert decode_image(frame.header, frame.image).shape == (36, 64, 3)

    run(work())


@pytest.mark.parametrize(("image_format", "dtype"), [("webp", np.uint8), ("png", np.uint8), ("raw", np.float32)])
def test_every_format_is_decoded(image_format: str, dtype: type, address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN, format=image_format)
            frame = await display.next_frame()
            assert (frame.header.format, frame.pixels.shape, frame.pixels.dtype) == (image_format, (36, 64, 3), dtype)

    run(work())


def test_camera_and_quality_change_what_is_shown(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN, quality=COARSE)
            before = await final(display)
            ready = await display.change_camera({"position": [0, 9, 9], "look_at": [0, 0, 0]})
            moved = await final(display)
            assert moved.header.config == ready.config != before.header.config
            assert (moved.pixels != before.pixels).any()
            assert (await display.change_quality({**COARSE, "samples_per_cell": 4})).config is not None
            assert (await final(display)).header.samples == 4
            assert (await display.change_camera(None)).camera != ready.camera

    run(work())


def test_no_frame_of_an_old_configuration_is_given_out_after_ready(address: str) -> None:
    """Frames that have come, are on their way, or are being decoded."""

    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN)
            for round_trip in range(6):
                size = {"width_px": 64 + 2 * round_trip, "height_px": 36}
                taking = asyncio.create_task(display.next_frame())
                ready = await display.configure("matte", display=size)
                if not taking.done():
                    assert (await taking).header.config == ready.config
                assert (await display.next_frame()).pixels.shape[1] == 64 + 2 * round_trip

    run(work())


def test_a_slow_viewer_skips_frames_and_never_queues(address: str) -> None:
    async def work() -> None:
        async with Display(address) as fast:
            ready = await fast.configure("matte", display=SCREEN, quality=COARSE)
            async with Display(address, session=ready.session) as slow:
                old = await slow.next_frame()
                newest = old.header
                for step in range(20):
                    seq = fast.look_at(3 * step + 1, 18)
                    while newest.gaze is None or newest.gaze.seq != seq or newest.phase != "final":
                        newest = (await fast.next_frame()).header
                seen = [old.header.frame]
                while seen[-1] < newest.frame:
                    seen.append((await slow.next_frame()).header.frame)
                assert len(seen) <= 4 < 20 < newest.frame
                assert slow.status is not None
                assert slow.status.dropped > 0

    run(work())


def test_the_newest_gaze_wins(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN, quality=COARSE)
            await final(display)
            seqs = [display.look_at(step, 9) for step in range(50)]
            frame = await final(display)
            assert frame.header.gaze is not None
            assert frame.header.gaze.seq == seqs[-1]
            assert frame.header.superseded == 0, "the others were never sent"

    run(work())


def test_a_blink_holds_the_gaze(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN, quality=COARSE)
            seq = display.look_at(9, 9)
            await final(display)
            display.look_away()
            while display.status is None or display.status.gaze_state != "lost":
                frame = await display.next_frame()
            assert frame.header.gaze is not None
            assert frame.header.gaze.seq == seq

    run(work())


def test_a_refusal_names_the_field_and_changes_nothing(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            with pytest.raises(ServiceRefused, match="unknown scene 'sphres': the scenes are") as refused:
                await display.configure("sphres")
            assert (refused.value.code, refused.value.field) == ("unknown-scene", "scene")
            ready = await display.configure("matte", display=SCREEN)
            with pytest.raises(ServiceRefused) as refused:
                await display.configure("matte", display={"width_px": 0, "height_px": 4})
            assert refused.value.code == "invalid-request"
            assert refused.value.field is not None
            assert refused.value.field.endswith("display.width_px")
            with pytest.raises(ServiceRefused) as refused:
                await display.change_quality({"samples_per_cell": 100_000})
            assert refused.value.code in ("invalid-request", "over-limit")
            assert (await display.next_frame()).header.config == ready.config

    run(work())


def test_a_token_is_needed_where_the_service_wants_one(renderer: Renderer) -> None:
    async def refused(address: str, token: str | None) -> None:
        async with Display(address, token=token) as display:
            with pytest.raises(ServiceRefused) as error:
                await display.configure("matte", display=SCREEN)
            assert error.value.code == "token-needed"
            with pytest.raises(ServiceRefused):
                await display.next_frame()

    async def admitted(address: str) -> None:
        async with Display(address, token=TOKEN) as display:
            await display.configure("matte", display=SCREEN)
            await display.next_frame()

    with serving(Settings(port=0, token=TOKEN), renderer) as address:
        run(refused(address, None))
        run(refused(address, "another-secret"))
        run(admitted(address))


def test_it_comes_back_when_the_service_does(renderer: Renderer) -> None:
    """A new service on the same port knows nothing: session, configuration and gaze are told to it again."""

    async def work() -> None:
        with contextlib.ExitStack() as first:
            address = await asyncio.to_thread(first.enter_context, serving(Settings(port=0), renderer))
            port = int(address.rpartition(":")[2])
            async with Display(address, session="mine") as display:
                await display.configure("matte", display=SCREEN, quality=COARSE)
                await display.change_camera({"position": [0, 9, 9], "look_at": [0, 0, 0]})
                seq = display.look_at(40, 9)
                before = await final(display)
                await asyncio.to_thread(first.close)
                waiting = asyncio.create_task(final(display))
                with contextlib.ExitStack() as second:
                    await asyncio.to_thread(second.enter_context, serving(Settings(port=port), renderer))
                    after = await waiting
                    while after.header.gaze is None or after.header.gaze.seq != seq:
                        after = await final(display)
                    assert (display.connections, display.session) == (2, "mine")
                    np.testing.assert_array_equal(after.pixels, before.pixels)
                    await display.configure("spheres", display=SCREEN)
                    assert (await display.next_frame()).header.scene == "spheres"
                    await display.__aexit__(None, None, None)

    run(work())


def test_it_stays_on_a_slow_line_and_leaves_one_on_which_nothing_comes(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A frame takes three seconds: longer than the service has to answer, and than as many answers may wait.

    What came of it is a sign of life, even where the line breaks before all of it has.
    """
    monkeypatch.setattr(display_client, "PINGS_S", 0.001)
    monkeypatch.setattr(connection, "PING_S", 0.25)
    monkeypatch.setattr(connection, "SILENCE_S", 2.0)
    monkeypatch.setattr(connection, "OPEN_S", 0.5)

    async def work(line: SlowLine) -> None:
        async with Display(line.url, patience_s=1.0) as display:
            await display.configure("matte", display={"width_px": 200, "height_px": 110}, quality=COARSE, format="raw")
            await asyncio.to_thread(line.wait, MOST_OF_A_FRAME)
            assert display.connections == 1
            line.cut()
            await display.next_frame()
            assert display.connections == 2
            line.bytes_per_s = 0
            with pytest.raises(ServiceGone):
                await final(display)

    with serving(Settings(port=0), renderer) as address, slow_line(address, 80_000) as line:
        first = {
            "gaze_x": 1,
            "gaze_y": 1,
            "width_px": 200,
            "height_px": 110,
            "format": "raw",
        }  # compiles what is needed
        httpx.get(f"{address}/v1/scenes/matte/frame", params=first, timeout=PATIENCE_S).raise_for_status()
        run(work(line))


def test_it_gives_up_after_its_patience() -> None:
    async def work() -> None:
        async with Display("http://127.0.0.1:1", patience_s=0.1) as display:
            with pytest.raises(ServiceGone, match=r"ws://127\.0\.0\.1:1/v1/stream: no service for 0\.1 s"):
                await display.configure("matte")
            with pytest.raises(ServiceGone):
                await display.next_frame()
            with pytest.raises(ServiceGone):
                await display.configure("matte")

    run(work())


@pytest.fixture
def stranger() -> Iterator[str]:
    """A web server that knows no stream."""

    class Quiet(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            self.send_error(404)

        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Quiet) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def test_another_kind_of_server_is_said_to_be_one(stranger: str) -> None:
    async def work() -> None:
        async with Display(stranger, patience_s=math.inf) as display:
            with pytest.raises(ServiceRefused, match=r"expected a stream, found .*404") as refused:
                await display.next_frame()
            assert refused.value.code == "no-stream"

    run(work())


def test_the_clocks_of_one_machine_agree(address: str) -> None:
    async def work() -> None:
        async with Display(address) as display:
            await display.configure("matte", display=SCREEN)
            await display.next_frame()
            offset, trip = display.clock.offset_ns, display.clock.round_trip_ns
            assert offset is not None
            assert trip is not None
            assert abs(offset) <= trip / 2 + 1

    run(work())


@pytest.mark.parametrize(
    ("url", "stream"),
    [
        ("http://127.0.0.1:8321", "ws://127.0.0.1:8321/v1/stream"),
        ("https://lab.example/gaze/", "wss://lab.example/gaze/v1/stream"),
        ("ws://[::1]:9/", "ws://[::1]:9/v1/stream"),
    ],
)
def test_where_the_stream_of_a_service_is(url: str, stream: str) -> None:
    assert stream_url(url, "/v1/stream") == stream


@pytest.mark.parametrize("url", ["127.0.0.1:8321", "ftp://a", "http://", ""])
def test_what_is_no_address(url: str) -> None:
    with pytest.raises(ValueError, match="expected an address such as http://127"):
        Display(url)


# Decoding


def header(image: bytes, image_format: Any, width: int = 8, height: int = 4) -> FrameHeader:
    times = ServiceTimes(0, 0, 0, 0)
    return FrameHeader(
        1,
        "s",
        1,
        "matte",
        width,
        height,
        image_format,
        len(image),
        "final",
        None,
        "none",
        1.0,
        1.0,
        0,
        0,
        {},
        times,
        {},
    )


def test_pictures_are_what_was_encoded() -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (4, 8, 3)).astype(np.uint8)
    image = encode(pixels, "png")
    np.testing.assert_array_equal(decode_image(header(image, "png"), image), pixels)
    radiance = pixels.astype(np.float32) / 7
    image = encode(radiance, "raw")
    np.testing.assert_array_equal(decode_image(header(image, "raw"), image), radiance)


@pytest.mark.parametrize("image_format", ["png", "jpeg", "webp", "raw"])
def test_an_image_that_is_not_what_its_header_says_is_refused(image_format: str) -> None:
    dtype = np.float32 if image_format == "raw" else np.uint8
    image = encode(np.zeros((4, 8, 3), dtype), image_format)
    for wrong in (image[: len(image) // 2], b"", b"GIF89a" + image, encode(np.zeros((8, 8, 3), dtype), image_format)):
        with pytest.raises(ProtocolError):
            decode_image(header(wrong, image_format), wrong)
