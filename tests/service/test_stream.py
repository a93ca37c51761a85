"""Streams over real sockets."""

from __future__ import annotations

import gc
import io
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from renderer.frame import Abandoned
from renderer.pipeline import Renderer
from service.protocol import Ack, Camera, Error, Frame, Gaze, Quality, Ready, Status
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.streaming import COARSE, TINY, Clock, configure, sessions, settle, viewer


def pixels(image: bytes) -> Any:
    return np.asarray(Image.open(io.BytesIO(image)).convert("RGB"))


def wait_for_frames(address: str, session: str, frames: int) -> None:
    """Return when the session has rendered so many frames."""
    while sessions(address)[session]["frames"] < frames:
        pass


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def timed(renderer: Renderer, clock: Clock) -> Iterator[str]:
    """A service whose sessions go by `clock`."""
    with serving(Settings(port=0), renderer, clock=clock) as address:
        yield address


def test_a_still_gaze_ends_with_the_lossless_frame_of_a_render_request(address: str) -> None:
    """All samples come step by step; the pixels are those of the same request over HTTP."""
    with viewer(address) as eye:
        joined = eye.next(Ready)
        assert joined.config is None
        display = {**TINY, "distance_cm": 63.5}  # nothing of it is traced yet
        eye.say(configure(7, "spheres", display=display))
        ready = eye.next(Ready)
        assert (ready.session, ready.config, ready.scene) == (joined.session, 7, "spheres")
        assert {effect.name for effect in ready.effects} >= {"shadows", "reflection", "refraction"}
        headers = []
        while not headers or headers[-1].phase != "final":
            frame = eye.frame()
            headers.append(frame.header)
        assert [header.phase for header in headers] == ["moving", "still", "still", "final"]
        assert [header.samples for header in headers] == [1.0, 2.0, 4.0, 4.0]
        assert [header.format for header in headers] == ["jpeg"] * 3 + ["png"]
        assert {header.config for header in headers} == {7}
        assert [header.frame for header in headers] == [1, 2, 3, 4]
        margin = headers[-1].cost["map"]["margin_deg"]
        request = {
            "scene": "spheres",
            "gaze": {"x": 32, "y": 18},
            "display": display,
            "quality": {"samples_per_cell": 4, "acuity": {"margin_deg": margin}},
        }
        same = httpx.post(f"{address}/v1/render", json=request, timeout=PATIENCE_S)
        assert same.status_code == 200
        assert np.array_equal(pixels(frame.image), pixels(same.content))
        assert frame.image == same.content


@pytest.mark.parametrize("image_format", ["png", "raw"])
def test_a_format_without_loss_needs_no_other_for_the_last_frame(address: str, image_format: str) -> None:
    with viewer(address) as eye:
        display = {**TINY, "distance_cm": 61.0 if image_format == "raw" else 62.0}  # nothing of it is traced yet
        eye.say(configure(quality={"samples_per_cell": 2}, format=image_format, display=display))
        headers = [eye.frame().header, eye.frame().header]
        assert [header.phase for header in headers] == ["moving", "final"]
        assert {header.format for header in headers} == {image_format}
        settle(eye, 1)
        assert sessions(address)[headers[0].session]["frames"] == 2


@pytest.mark.parametrize(("max_error", "met", "samples"), [(0.9, True, 2), (1e-9, False, 7)])
def test_refinement_ends_as_soon_as_the_error_is_small_enough(
    address: str, renderer: Renderer, max_error: float, met: bool, samples: int
) -> None:
    renderer.forget_samples()
    with viewer(address) as eye:
        eye.say(configure(quality={"max_error": max_error, "samples_per_cell": 7}))
        header = eye.final().header
        assert (header.cost["max_error"], header.cost["error_met"]) == (max_error, met)
        assert header.samples == samples


def test_the_newest_gaze_wins_and_the_others_are_counted(address: str) -> None:
    with viewer(address, "burst") as eye:
        eye.say(configure(quality=COARSE | {"samples_per_cell": 8}))
        first = eye.next(Frame)
        wait_for_frames(address, "burst", 2)
        eye.say(*(Gaze(float(x), 9.0, seq=x) for x in range(1, 51)))
        settle(eye, 1)
        assert sessions(address)["burst"]["frames"] == 2
        eye.say(Ack(first.header.frame))
        frame = eye.frame(lambda header: header.gaze is not None and header.gaze.seq is not None)
        assert frame.header.gaze is not None
        assert frame.header.gaze.seq == 50
        assert (frame.header.gaze.x, frame.header.gaze.y) == (50.0, 9.0)
        assert frame.header.phase == "moving"
        assert frame.header.superseded == 49


def test_a_slow_viewer_slows_nobody_and_gets_the_newest_frame(address: str) -> None:
    moves = 12
    with viewer(address, "two") as fast, viewer(address, "two") as slow:
        fast.say(configure(quality=COARSE))
        stuck = slow.next(Frame)
        for move in range(moves):
            fast.say(Gaze(56.0 if move % 2 else 8.0, 18.0, seq=move))
            fast.frame(lambda header, move=move: header.gaze is not None and header.gaze.seq == move)
        last = fast.final()
        slow.say(Ack(stuck.header.frame))
        caught_up = slow.frame()
        assert caught_up.header.frame == last.header.frame
        assert caught_up.image == last.image
        assert caught_up.header.dropped == last.header.frame - stuck.header.frame - 1 >= moves
        assert last.header.dropped == 0


def test_all_viewers_are_sent_the_same_images(address: str) -> None:
    with viewer(address, "shared") as one, viewer(address, "shared") as other:
        assert one.next(Status, lambda status: status.viewers == 2)
        one.say(configure())
        images = [{}, {}]
        for seen, eye in zip(images, (one, other), strict=True):
            phase = None
            while phase != "final":
                frame = eye.frame()
                phase = frame.header.phase
                seen[frame.header.frame] = frame.image
        both = images[0].keys() & images[1].keys()
        assert len(both) >= 2
        assert all(images[0][number] == images[1][number] for number in both)


def test_whoever_comes_back_finds_the_session_as_it_was(address: str) -> None:
    with viewer(address) as eye:
        eye.say(configure(3))
        name = eye.next(Ready).session
        last = eye.final()
    with viewer(address, name) as eye:
        ready = eye.next(Ready)
        assert (ready.session, ready.config, ready.scene) == (name, 3, "matte")
        assert ready.display == {**TINY, "height_cm": None}
        frame = eye.frame()
        assert frame.image == last.image
        assert frame.header.frame == last.header.frame
        eye.say(Gaze(50.0, 30.0))
        assert eye.final().header.config == 3


def test_no_frame_of_an_old_configuration_follows_the_new_one(address: str) -> None:
    with viewer(address) as eye:
        eye.say(configure(1, "spheres", quality={"samples_per_cell": 64}))
        assert eye.frame().header.config == 1
        eye.say(
            configure(2, quality={"samples_per_cell": 32}),
            Quality(3, {"samples_per_cell": 16}),
            Camera(4, {"position": [0, 2, 8], "look_at": [0, 1, 0]}),
            configure(5, display={**TINY, "width_px": 32}, quality={"samples_per_cell": 2}),
        )
        told, shown = [], []
        while True:
            heard = eye.hear()
            if isinstance(heard, Ready):
                told.append(heard.config)
            if isinstance(heard, Frame):
                eye.say(Ack(heard.header.frame))
                shown.append(heard.header.config)
                assert heard.header.config == (told[-1] if told else 1)
                if heard.header.config == 5 and heard.header.phase == "final":
                    break
        assert told == [2, 3, 4, 5]
        assert shown == sorted(shown)
        assert pixels(heard.image).shape == (36, 32, 3)


def test_a_camera_that_moves_all_the_time_is_seen(address: str) -> None:
    """Views that come faster than frames are rendered must not keep each other from being shown."""
    with viewer(address) as eye:
        eye.say(configure(0, "spheres"))
        for turn in range(1, 40):
            eye.say(Camera(turn, {"position": [turn / 10, 2, 8], "look_at": [0, 1, 0]}))
        shown = []
        while not shown or shown[-1] != 39:
            shown.append(eye.frame().header.config)
        assert shown == sorted(shown)
        eye.next(Frame, lambda frame: frame.header.phase == "final")


def test_a_frame_that_was_given_up_leaves_no_garbage(address: str) -> None:
    """What it held would stay until the oldest garbage is looked for, which is seldom."""
    gc.collect()
    gc.disable()
    try:
        with viewer(address) as eye:
            screen = {**TINY, "width_px": 320, "height_px": 180}
            eye.say(configure(1, "spheres", display=screen, quality={"samples_per_cell": 256}))
            for x in range(0, 320, 64):
                eye.say(Gaze(float(x), 90.0))
                eye.frame(lambda header, x=x: header.gaze is not None and header.gaze.x == x)
            eye.say(configure(2))
            eye.frame(lambda header: header.config == 2 and header.phase == "final")
            given_up = [thing for thing in gc.get_objects() if type(thing) is Abandoned]
    finally:
        gc.enable()
    assert not given_up


def test_a_refused_configuration_leaves_the_one_in_force(address: str) -> None:
    with viewer(address) as eye:
        eye.next(Ready)
        eye.say(Quality(1, {}))
        assert eye.next(Error) == Error("invalid-request", "expected configure before a change of it", "type", 1)
        eye.say(configure(2))
        assert eye.next(Ready).config == 2
        refused = [
            (configure(3, "nowhere"), "unknown-scene", "scene"),
            (configure(4, display={"width_px": 0}), "invalid-request", "display.width_px"),
            (configure(5, quality={"samples_per_cell": 1000}), "over-limit", "quality.samples_per_cell"),
            (configure(6, camera={"position": [0, 0, 0], "look_at": [0, 0, 0]}), "invalid-request", "camera.look_at"),
            (configure(7, format="gif"), "invalid-request", "format"),
            (Quality(8, {"map": "round"}), "invalid-request", "quality.map"),
            (Camera(9, {"position": [0, 0, 0]}), "invalid-request", "camera.look_at"),
            (configure(10, "broken"), "broken-scene", "scene"),
        ]
        for message, code, field in refused:
            eye.say(message)
            error = eye.next(Error)
            assert (error.code, error.id) == (code, message.id), error
            assert error.field == field, error
        eye.say(Gaze(10.0, 10.0))
        assert eye.final().header.config == 2


def test_an_invalid_gaze_is_held_then_lost_and_back_within_a_frame(timed: str, clock: Clock) -> None:
    with viewer(timed) as eye:
        eye.say(configure(quality=COARSE, gaze={"x": 4.0, "y": 4.0}))
        live = eye.frame().header
        assert live.gaze_state == "live"
        eye.say(Gaze(valid=False))
        assert eye.next(Status, lambda status: status.gaze_state != "live").gaze_state == "held"
        clock.advance(0.59)
        eye.say(Gaze(valid=False))
        settle(eye, 1)
        assert sessions(timed)[live.session]["gaze_state"] == "held"
        clock.advance(0.02)
        lost = eye.frame(lambda header: header.gaze_state != "live").header
        assert lost.gaze_state == "lost"
        assert lost.cost["map"]["cells"] == 64 * 36 > live.cost["map"]["cells"]
        eye.say(Gaze(4.0, 4.0, seq=9))
        back = eye.frame(lambda header: header.gaze_state != "lost").header
        assert (back.gaze_state, back.phase) == ("live", "moving")
        assert back.gaze is not None
        assert back.gaze.seq == 9
        assert back.cost["map"]["cells"] == live.cost["map"]["cells"]


def test_before_the_first_gaze_the_whole_screen_is_fine(address: str) -> None:
    with viewer(address) as eye:
        eye.say(configure(quality=COARSE, gaze=None))
        header = eye.final().header
        assert (header.gaze, header.gaze_state) == (None, "none")
        assert header.cost["map"]["cells"] == 64 * 36


def test_an_eye_on_its_way_sees_little_until_it_lands(timed: str, clock: Clock) -> None:
    with viewer(timed) as eye:
        eye.say(configure(quality=COARSE, gaze={"x": 4.0, "y": 4.0}))
        eye.frame()
        eye.say(Gaze(40.0, 18.0, phase="saccade", seq=1))
        flying = eye.frame().header
        assert (flying.phase, flying.acuity_scale) == ("moving", 80.0)
        settle(eye, 1)
        assert sessions(timed)[flying.session]["frames"] == flying.frame
        eye.say(Gaze(41.0, 18.0, phase="fixation", seq=2))
        landed = eye.frame().header
        assert (landed.frame, landed.acuity_scale) == (flying.frame + 1, 40.0)
        assert landed.cost["map"]["cells"] > flying.cost["map"]["cells"]


def test_a_saccade_that_nobody_ends_is_over_soon(timed: str, clock: Clock) -> None:
    with viewer(timed) as eye:
        eye.say(configure(quality=COARSE), Gaze(40.0, 18.0, phase="saccade"))
        eye.frame(lambda header: header.acuity_scale == 80.0)
        clock.advance(0.2)
        assert eye.frame().header.acuity_scale == 40.0


def test_a_gaze_that_stays_about_its_bucket_brings_no_frame(address: str) -> None:
    with viewer(address) as eye:
        eye.say(configure(gaze={"x": 22.0, "y": 16.0}))
        last = eye.final().header
        for seq in range(20):
            eye.say(Gaze(27.9 if seq % 2 else 8.0, 16.0, seq=seq))
        settle(eye, 1)
        assert sessions(address)[last.session]["frames"] == last.frame
        eye.say(Gaze(28.1, 16.0, seq=99))
        assert eye.frame().header.gaze.seq == 99


def test_status_counts(address: str) -> None:
    with viewer(address, "counted") as eye:
        assert eye.next(Status) == Status(0, 0, 0, 0, 1, 0, "none")
        eye.say(configure())
        final = eye.final().header
        with viewer(address, "counted"):
            status = eye.next(Status, lambda status: status.viewers == 2)
            assert status == Status(final.frame, 0, 0, 0, 2, 0, "live")
        assert eye.next(Status, lambda status: status.viewers == 1)
        found = sessions(address)["counted"]
        assert found == {
            "session": "counted",
            "scene": "matte",
            "config": 1,
            "viewers": 1,
            "gaze_sources": 0,
            "gaze_state": "live",
            "frames": final.frame,
        }


def test_the_header_tells_times_in_order(address: str) -> None:
    with viewer(address) as eye:
        eye.say(configure(), Gaze(9.0, 9.0, tracker_time_ns=5, captured_time_ns=6))
        header = eye.frame(lambda header: header.gaze is not None and header.gaze.captured_time_ns == 6).header
        times = header.service_time_ns
        assert times.gaze_received <= times.started <= times.finished <= times.sent
        assert header.gaze is not None
        assert header.gaze.tracker_time_ns == 5
        assert set(header.timing_ms) == {"wait", "map", "trace", "reconstruct", "encode", "total"}
        assert all(time_ms >= 0 for time_ms in header.timing_ms.values())
        assert header.cost["rays"]["primary"] >= 0
