"""The whole bridge: a real pseudo-terminal on one side, a real WebSocket on the other, either coming and going."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from clients.backoff import Backoff
from clients.bridge.calibration import load_calibration
from clients.bridge.calibration_walk import NINE_POINTS, CalibrationWalk
from clients.bridge.config import Config
from clients.bridge.daemon import NewCalibration
from clients.bridge.errors import ConfigError
from clients.bridge.gaze import Gaze
from clients.bridge.notify import notify, watchdog_interval_s
from clients.bridge.recording import read_recording
from clients.bridge.sample import Point
from clients.bridge.screen import Screen
from clients.bridge.service_link import Listeners, ServiceLink, ServiceState, gaze_url
from clients.bridge.slot import Slot
from clients.bridge.smi import Smi
from renderer.pipeline import Renderer
from service import protocol
from service.settings import Settings
from tests.clients.bridge.running import Listener, News, hanging, listener, running
from tests.clients.bridge.terminal import PATIENCE_S, Terminal
from tests.service.conftest import serving
from tests.service.streaming import configure, viewer

START = Smi().start()[0]


@pytest.fixture
def service() -> Iterator[Listener]:
    with listener() as found:
        yield found


def line(index: int, x: int = 480, y: int = 270) -> bytes:
    return f"ET_SPL {100_000_000 + index * 4000} b {x} {x} {y} {y}\r\n".encode()


def config(terminal: Terminal, service: Listener | str, **changes: Any) -> Config:
    url = service if isinstance(service, str) else service.url
    return Config(**({"port": str(terminal.path), "protocol": "smi", "service": url} | changes))


def valid(items: list[Any]) -> list[protocol.Gaze]:
    return [item for item in items if isinstance(item, protocol.Gaze) and item.valid]


def lost(items: list[Any]) -> list[protocol.Gaze]:
    return [item for item in items if isinstance(item, protocol.Gaze) and not item.valid]


@contextmanager
def looking(terminal: Terminal, x: int = 480, y: int = 270) -> Iterator[None]:
    """An eye that rests on one place, 250 times a second."""
    stop = threading.Event()

    def look() -> None:
        index = 0
        while not stop.wait(0.004):
            terminal.write(line(index, x, y))
            index += 1

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def test_gaze_goes_from_the_line_to_the_service(terminal: Terminal, service: Listener) -> None:
    with running(config(terminal, service, session="lab")) as found:
        found.says("service", "ready: session")
        terminal.read(len(START))
        before = time.monotonic_ns()
        terminal.write(line(0))
        (gaze,) = service.heard.until(valid)
        assert (gaze.x, gaze.y, gaze.unit, gaze.seq, gaze.phase) == (0.25, 0.25, "fraction", 0, "fixation")
        assert gaze.captured_time_ns is not None
        assert before - 10**7 < gaze.captured_time_ns < time.monotonic_ns()
        assert service.heard.items[0] == ("path", "/v1/gaze?session=lab")
        terminal.write(line(1, 0, 0))
        (gaze,) = service.heard.until(lost)
        assert (gaze.x, gaze.y, gaze.phase, gaze.seq) == (None, None, "blink", 1)
    assert found.result == 0
    assert terminal.read(7) == b"ET_EST\n"
    assert service.closes.until(list) == [1001]


def test_the_service_may_come_late_go_and_return(terminal: Terminal) -> None:
    service = Listener()
    with socket.create_server(("127.0.0.1", 0)) as free:
        service.port = free.getsockname()[1]
    with running(config(terminal, service)) as found:
        at = found.says("service", f"absent: ws://127.0.0.1:{service.port}/v1/gaze?session=main: nobody listens there")
        terminal.read(len(START))
        with looking(terminal):
            found.says("device", "streaming")
            seen = 0
            for _ in range(2):
                service.start()
                at = found.says("service", "ready", at)
                service.heard.until(lambda items, least=seen + 20: len(valid(items)) >= least)
                service.stop()
                at = found.says("service", "absent: the service closed the connection: 1001", at)
                seen = len(valid(service.heard.items))
        assert found.bridge.device.opens == 1


def test_the_device_may_come_late_go_and_return(terminal: Terminal, service: Listener) -> None:
    terminal.unplug()
    with running(config(terminal, service)) as found:
        at = found.says("device", "absent")
        for count in (1, 2):
            terminal.plug()
            terminal.read(len(START))
            with looking(terminal):
                service.heard.until(lambda items, least=20 * count: len(valid(items)) >= least)
            terminal.unplug()
            at = found.says("device", "lost", at)
            service.heard.until(lambda items, count=count: len(lost(items)) >= count and not items[-1].valid)
        assert found.bridge.device.opens == 2


def test_a_service_that_hangs_is_noticed_and_left_while_memory_stays_bounded(terminal: Terminal) -> None:
    """Neither a reset nor a close comes from a half-open connection: only the silence tells."""
    slot, states, stop = Slot(), News(), threading.Event()
    kept: list[int] = []

    async def work(url: str) -> None:
        ears = Listeners(lambda state, why: states.add((state, why)), lambda _: None, lambda _: None)
        link = ServiceLink(url, "main", None, slot, ears, Backoff(lambda: 0.5), ping_s=0.5)
        task = asyncio.create_task(link.run())
        number = 0
        while not stop.is_set():
            now_ns = time.monotonic_ns()
            slot.put(Gaze(number, 0.5, 0.5, None, now_ns, now_ns, now_ns, "fixation", None))
            kept.append(len(slot))
            link.filled()
            number += 1
            await asyncio.sleep(0.0005)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    with hanging() as url:
        thread = threading.Thread(target=lambda: asyncio.run(work(url)))
        thread.start()
        try:
            states.until(lambda items: [s for s, _ in items].count(ServiceState.READY) >= 2)
            seen = [state for state, _ in states.items]
        finally:
            stop.set()
            thread.join(PATIENCE_S)
    assert ServiceState.ABSENT in seen
    assert max(kept) <= 2
    assert slot.dropped > 50


def test_a_wrong_token_is_refused_and_said(terminal: Terminal, renderer: Renderer) -> None:
    with serving(Settings(port=0, token="a-long-secret"), renderer, ready=False) as address:
        with running(config(terminal, address, token="another-secret")) as found:
            found.says("service", "refused: the service closed the connection: 4401")
        with running(config(terminal, address, token="a-long-secret")) as found:
            found.says("service", "ready: session main")


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    renderer = Renderer()
    yield renderer
    renderer.close()


def test_a_frame_is_rendered_for_what_the_tracker_says(terminal: Terminal, renderer: Renderer) -> None:
    with (
        serving(Settings(port=0), renderer) as address,
        viewer(address, "lab") as eye,
        running(config(terminal, address, session="lab", screen_px=(1920, 1080))) as found,
    ):
        eye.say(configure())
        found.says("service", "ready")
        terminal.read(len(START))
        with looking(terminal, 1440, 810):
            frame = eye.frame(lambda header: header.gaze is not None and header.gaze.seq is not None)
            assert frame.header.gaze is not None
            assert (frame.header.gaze.x, frame.header.gaze.y) == (48, 27)
            assert frame.header.gaze.captured_time_ns is not None
        eye.next(protocol.Status, lambda status: status.gaze_state == "held")
        link = found.bridge.link
        assert link is not None
        assert link.clock.offset_ns is not None
        assert abs(link.clock.offset_ns) < 10**8  # the same clock, on this machine


def test_calibration_walks_the_viewers_through_nine_points(
    terminal: Terminal, service: Listener, tmp_path: Path
) -> None:
    """The eye looks at each target; the device says something else, in camera units."""
    file = tmp_path / "lab.json"
    walk = CalibrationWalk(arrive_ns=20_000_000, look_ns=20_000_000)
    settings = config(terminal, service, protocol="csv", unit="raw")
    stop = threading.Event()

    def looked() -> None:
        while not stop.wait(0.001):
            targets = [item for item in service.heard.items if isinstance(item, protocol.Target)]
            if targets and targets[-1].x is not None and targets[-1].y is not None:
                if targets[-1].index != walk.index:  # the next target is on its way
                    continue
                terminal.write(f"{200 + 300 * targets[-1].x},{90 + 100 * targets[-1].y}\n".encode())
            else:
                terminal.write(b"350,140\n")

    with running(settings, None, NewCalibration(file, walk)) as found:
        found.says("device", "open")
        eye = threading.Thread(target=looked)
        eye.start()
        try:
            found.says("calibration", "deg off")
            margin = service.heard.until(lambda items: [item for item in items if isinstance(item, protocol.Margin)])
            service.heard.until(valid)
        finally:
            stop.set()
            eye.join()
        terminal.write(b"275,140\n")
        service.heard.until(lambda items: abs(valid(items)[-1].x - 0.25) < 0.01)
    shown = [item for item in service.heard.items if isinstance(item, protocol.Target)]
    assert [(target.x, target.y) for target in shown] == [*NINE_POINTS, (None, None)]
    assert [target.index for target in shown[:9]] == list(range(9))
    calibration = load_calibration(file)
    assert margin[0].margin_deg == pytest.approx(calibration.margin_deg(Screen(1920, 1080, 50, 30, 60)), abs=1e-6)
    assert calibration.apply(Point(350, 140)) == pytest.approx((0.5, 0.5), abs=0.02)
    with running(config(terminal, service, protocol="csv", unit="raw", calibration=file)) as found:
        service.heard.until(lambda items: sum(isinstance(item, protocol.Margin) for item in items) >= 2)


def test_no_target_is_shown_before_somebody_can_see_it(terminal: Terminal, service: Listener, tmp_path: Path) -> None:
    service.viewers = 0
    settings = config(terminal, service, session="lab")
    with running(settings, None, NewCalibration(tmp_path / "lab.json")) as found:
        found.says("service", "ready")
        with looking(terminal):
            found.says("calibration", f"waiting for somebody to open {service.url}/?session=lab")
    assert not [item for item in service.heard.items if isinstance(item, protocol.Target)]


def test_the_margin_is_told_before_anybody_has_configured_the_session(
    terminal: Terminal, service: Listener, tmp_path: Path
) -> None:
    file = tmp_path / "lab.json"
    file.write_text('{"model": "affine", "points": [[0, 0, 0, 0], [9, 0, 1, 0], [0, 9, 0, 1], [9, 9, 1, 1.1]]}')
    service.display = None
    with running(config(terminal, service, calibration=file)):
        (margin,) = service.heard.until(lambda items: [i for i in items if isinstance(i, protocol.Margin)])
    assert margin.margin_deg > 0.1


def test_camera_units_are_not_sent_without_a_calibration(terminal: Terminal, service: Listener) -> None:
    with pytest.raises(ConfigError, match="--calibrate makes one"):
        running(config(terminal, service, protocol="iscan")).__enter__()


def test_a_recording_holds_every_byte_and_replays_to_the_same_gaze(
    terminal: Terminal, service: Listener, tmp_path: Path
) -> None:
    file = tmp_path / "run.rec"
    sent = b"".join(line(index, 300 + index, 0 if index % 7 == 0 else 200) for index in range(300))
    with running(config(terminal, service, record=file), None, None, {"protocol": "smi"}) as found:
        terminal.read(len(START))
        for begin in range(0, len(sent), 97):
            terminal.write(sent[begin : begin + 97])
        found.log.until(lambda _: found.bridge.health()["recorded_bytes"] == len(sent))
    recording = read_recording(file)
    assert b"".join(chunk.data for chunk in recording.chunks) == sent
    assert recording.about["settings"] == {"protocol": "smi"}
    live: list[Gaze] = []
    for speed in (0.0, 20.0):
        shown: list[Gaze] = []
        with running(Config(replay=file, protocol="smi", speed=speed), shown.append) as found:
            assert found.ended() == 0
        assert [gaze.seq for gaze in shown] == list(range(301))
        assert not shown[300].valid  # the recording has ended
        assert not live or [gaze[:3] for gaze in shown] == [gaze[:3] for gaze in live]
        live = shown
    assert valid(service.heard.items)[-1].seq == 299


def test_a_simulated_eye_needs_no_hardware(service: Listener) -> None:
    with running(Config(simulate=True, speed=4.0, service=service.url)) as found:
        service.heard.until(lambda items: len(valid(items)) > 300)
        assert found.bridge.health()["bad_records"] == 0
    gazes = valid(service.heard.items)
    assert all(a.seq < b.seq for a, b in pairwise(gazes) if a.seq is not None and b.seq is not None)
    assert "saccade" in {gaze.phase for gaze in gazes}


def test_a_rate_limit_thins_out_but_never_hides_a_loss(service: Listener) -> None:
    with running(Config(simulate=True, speed=4.0, service=service.url, max_rate_hz=50.0)) as found:
        service.heard.until(lambda items: len(lost(items)) > 0)
        assert found.bridge.health()["decimated"] > 0
    kept = valid(service.heard.items)
    assert all(
        b.captured_time_ns - a.captured_time_ns >= 2e7
        for a, b in pairwise(service.gazes())
        if a.valid == b.valid and a.captured_time_ns is not None and b.captured_time_ns is not None
    )
    assert kept


def test_health_is_told_and_kept_in_a_file(terminal: Terminal, service: Listener, tmp_path: Path) -> None:
    with running(config(terminal, service, status_file=tmp_path / "status.json")) as found:
        found.says("service", "ready")
        terminal.read(len(START))
        terminal.write(b"noise\r\n" + b"".join(line(index) for index in range(50)))
        service.heard.until(lambda items: valid(items) and valid(items)[-1].seq == 49)
    (health,) = (item for item in found.log.items if item["event"] == "health")
    assert json.loads((tmp_path / "status.json").read_text()).items() <= health.items()
    assert (health["device"], health["bad_records"], health["valid_percent"]) == ("stopped", 1, 100)
    assert health["sent"] + health["dropped"] == 51  # the last one says that no sample comes any more
    assert 0 < health["latency_ms_p50"] <= health["latency_ms_p99"]
    assert health["interval_ms_p50"] is not None
    assert health["rate_hz"] > 0
    assert health["line_load_percent"] > 0


def test_systemd_is_told(
    terminal: Terminal, service: Listener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(path))
        systemd.settimeout(PATIENCE_S)
        monkeypatch.setenv("NOTIFY_SOCKET", str(path))
        monkeypatch.setenv("WATCHDOG_USEC", "100000")
        with running(config(terminal, service)):
            told = [systemd.recv(100) for _ in range(4)]
        assert sorted(set(told)) == [b"READY=1", b"WATCHDOG=1"]
        while (last := systemd.recv(100)) == b"WATCHDOG=1":
            pass
        assert last == b"STOPPING=1"
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "nobody"))
    notify("READY=1", os.environ)
    assert watchdog_interval_s({"WATCHDOG_USEC": "10000000"}) == 5
    assert watchdog_interval_s({}) is None


def test_a_loop_that_is_stuck_tells_systemd_nothing_until_it_goes_on(
    terminal: Terminal, service: Listener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "40000")
        stuck, go_on = threading.Event(), threading.Event()

        def block() -> None:
            stuck.set()
            go_on.wait(PATIENCE_S)

        with running(config(terminal, service)) as found:
            systemd.settimeout(PATIENCE_S)
            while systemd.recv(100) != b"WATCHDOG=1":
                pass
            found.bridge._call(block)
            assert stuck.wait(PATIENCE_S)
            systemd.settimeout(0)
            with suppress(BlockingIOError):
                while systemd.recv(100):
                    pass
            systemd.settimeout(0.5)  # more than ten intervals
            with pytest.raises(TimeoutError):
                systemd.recv(100)
            go_on.set()
            systemd.settimeout(PATIENCE_S)
            assert systemd.recv(100) == b"WATCHDOG=1"


@pytest.mark.parametrize("address", ["ftp://here", "localhost:8321", ""])
def test_an_address_is_one(address: str) -> None:
    with pytest.raises(ConfigError, match="service: expected an address"):
        gaze_url(address, "lab")


def test_the_gaze_route_of_an_address() -> None:
    assert gaze_url("https://lab.example/gt/", "a-b") == "wss://lab.example/gt/v1/gaze?session=a-b"
