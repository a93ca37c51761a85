"""Faults for real, against a service in a process of its own: what was promised, and that nothing more is lost."""

from __future__ import annotations

import asyncio
import mmap
import os
import resource
import signal
import socket
import threading
import time
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import httpx

from clients.display import Display
from service import protocol
from service.protocol import CloseCode
from service.rendering import BYTES_A_PIXEL
from service.work_notes import WorkNotes
from tests.service.conftest import PATIENCE_S
from tests.service.process import ServiceProcess, service_process
from tests.service.streaming import configure, viewer
from tests.small_disk import small_disk

DRAIN_S = 5.0
"""How long a service may take to end."""

BUSY_S = 5.0
"""What a busy machine may add."""

SMALL: dict[str, str | int] = {"gaze_x": 1, "gaze_y": 1, "width_px": 64, "height_px": 36}
HUGE: dict[str, str | int] = {
    "gaze_x": 1,
    "gaze_y": 1,
    "width_px": 7680,
    "height_px": 4320,
    "map": "full",
    "samples_per_cell": 1,
}

LARGE: dict[str, str | int] = {**SMALL, "width_px": 2560, "height_px": 1440, "map": "full", "samples_per_cell": 32}
"""So much that the service is ended long before it is done."""

LARGE_BYTES = 2560 * 1440 * BYTES_A_PIXEL
LENT = 'gazetrace_held_bytes{kind="frames"}'

SPARE_BYTES = 256 << 20
"""Memory that a service is left: enough for a small frame, too little for an 8K one, whose radiance takes 400 MB."""


def frame(service: ServiceProcess, query: Mapping[str, str | int]) -> httpx.Response:
    return httpx.get(f"{service.address}/v1/scenes/matte/frame", params=query, timeout=PATIENCE_S)


def test_out_of_memory_fails_one_request_and_no_other() -> None:
    with service_process("--threads", "1") as service:
        assert frame(service, SMALL).status_code == 200
        limit = service.address_space_bytes + SPARE_BYTES
        resource.prlimit(service.pid, resource.RLIMIT_AS, (limit, limit))
        refused = frame(service, HUGE)
        assert refused.status_code == 503
        assert refused.json()["type"] == "urn:gazetrace:problem:out-of-memory"
        assert refused.headers["Retry-After"]
        assert frame(service, {**SMALL, "gaze_x": 60}).status_code == 200
        with viewer(service.address) as found:
            found.say(configure())
            assert found.final().header.phase == "final"


def test_a_service_told_to_stop_sends_its_viewers_away_and_ends() -> None:
    """Streams at rest and at work, one that reads nothing, and a request that is half there."""
    with service_process("--threads", "1") as service:
        host, port = service.address.removeprefix("http://").split(":")
        with (
            viewer(service.address) as resting,
            viewer(service.address) as working,
            viewer(service.address) as deaf,
            socket.create_connection((host, int(port))) as half,
        ):
            half.sendall(b"GET /healthz HTTP/1.1\r\n")
            resting.say(configure())
            resting.final()
            deaf.say(configure())
            working.say(configure(display={"width_px": 1280, "height_px": 720}, quality={"samples_per_cell": 64}))
            working.frame()
            began = time.monotonic()
            service.signal(signal.SIGTERM)
            assert [each.closed()[0] for each in (resting, working)] == [CloseCode.STOPPING] * 2
            assert service.ended() == -signal.SIGTERM
            assert time.monotonic() - began < DRAIN_S + BUSY_S
    assert not [line for line in service.lines if "Traceback" in line], service.lines


def test_a_display_resumes_its_session_with_a_service_that_was_killed_and_started_again() -> None:
    async def work() -> None:
        first = await asyncio.to_thread(ServiceProcess, "--threads", "1")
        second = None
        try:
            await asyncio.to_thread(first.wait_ready)
            port = first.address.rpartition(":")[2]
            async with Display(first.address, session="lab", patience_s=PATIENCE_S) as display:
                await display.configure("matte", display={"width_px": 64, "height_px": 36})
                display.look_at(10, 20)
                while (await display.next_frame()).header.phase != "final":
                    pass
                first.signal(signal.SIGKILL)
                await asyncio.to_thread(first.ended)
                seq = display.look_at(50, 20)
                second = await asyncio.to_thread(ServiceProcess, "--threads", "1", "--port", port)
                while True:
                    last = (await display.next_frame()).header
                    if last.phase == "final" and last.gaze is not None and last.gaze.seq == seq:
                        break
                assert (last.session, last.scene, last.width) == ("lab", "matte", 64)
                assert display.connections >= 2
        finally:
            first.stop()
            if second is not None:
                second.stop()

    asyncio.run(asyncio.wait_for(work(), 2 * PATIENCE_S))


def test_a_native_crash_costs_the_frame_in_flight_and_nothing_else() -> None:
    """The service is started again; who asks meanwhile waits, a display and a gaze source come back and go on."""

    async def work(service: ServiceProcess) -> None:
        async with Display(service.address, session="lab", patience_s=PATIENCE_S) as display:
            await display.configure("matte", display={"width_px": 64, "height_px": 36})
            display.look_at(10, 20)
            while (await display.next_frame()).header.phase != "final":
                pass
            crashed = service.pid
            os.kill(crashed, signal.SIGSEGV)
            while Path(f"/proc/{crashed}").exists():
                await asyncio.sleep(0)
            waited = await asyncio.to_thread(httpx.get, f"{service.address}/healthz", timeout=PATIENCE_S)
            assert waited.status_code == 200
            seq = display.look_at(50, 20)
            while True:
                last = (await display.next_frame()).header
                if last.phase == "final" and last.gaze is not None and last.gaze.seq == seq:
                    break
            assert (last.session, last.scene, last.width) == ("lab", "matte", 64)
            assert service.pid != crashed

    with service_process("--threads", "1", "--log-json") as service:
        asyncio.run(asyncio.wait_for(work(service), 2 * PATIENCE_S))
        assert "gazetrace_crashes 1.0" in httpx.get(f"{service.address}/metrics").text
        assert frame(service, SMALL).status_code == 200
        service.signal(signal.SIGTERM)
        assert service.ended() == -signal.SIGTERM
    assert [line for line in service.lines if "SIGSEGV ended this service, which is started again: crash 1" in line]


def test_a_crash_while_a_scene_is_read_is_an_error_of_that_scene(tmp_path: Path) -> None:
    scene = tmp_path / "lab" / "scene.toml"
    scene.parent.mkdir()
    scene.write_text("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n")
    with service_process("--threads", "1", "--scenes-folder", str(tmp_path)) as service, ThreadPoolExecutor(1) as other:
        path = f"{service.address}/v1/scenes/lab/frame"
        reply = other.submit(lambda: httpx.get(path, params=SMALL, timeout=PATIENCE_S))
        while not (readers := service.children):
            assert not reply.done()
        os.kill(readers[0], signal.SIGSTOP)
        assert frame(service, SMALL).status_code == 200
        os.kill(readers[0], signal.SIGSEGV)
        os.kill(readers[0], signal.SIGCONT)
        refused = reply.result(PATIENCE_S)
        assert (refused.status_code, refused.json()["type"]) == (422, "urn:gazetrace:problem:broken-scene")
        assert "ends in SIGSEGV" in refused.json()["detail"]
        os.utime(scene)
        assert httpx.get(path, params=SMALL, timeout=PATIENCE_S).status_code == 200
        assert "gazetrace_crashes 0.0" in httpx.get(f"{service.address}/metrics").text


def scenes_at_work(service: ServiceProcess) -> set[str]:
    """What the service has noted; nothing while it is being started."""
    with suppress(OSError, IndexError):
        for link in Path(f"/proc/{service.pid}/fd").iterdir():
            if os.readlink(link).startswith("/memfd:gazetrace-notes"):
                with link.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as memory:
                    return {edition.scene_id for edition in WorkNotes(memory).at_work()}
    return set()


def end_while_tracing(
    service: ServiceProcess, scene_id: str, number: signal.Signals, asked: Future[httpx.Response], served: list[int]
) -> None:
    """End the service when it has served others while it traces a large frame of a scene; return when it has ended."""
    before: int | None = None
    while before is None or served.count(200) == before:
        assert not asked.done(), asked.result()
        with suppress(httpx.TransportError):
            metrics = httpx.get(f"{service.address}/metrics", timeout=PATIENCE_S).text
            (lent,) = (float(line.split()[1]) for line in metrics.splitlines() if line.startswith(LENT))
            if lent >= LARGE_BYTES and scene_id in scenes_at_work(service):
                before = served.count(200) if before is None else before
    pid = service.pid
    os.kill(pid, number)
    while Path(f"/proc/{pid}").exists():
        pass


def test_a_scene_that_crashes_each_time_is_refused_until_its_files_change_and_others_are_served(tmp_path: Path) -> None:
    scene = tmp_path / "bad" / "scene.toml"
    scene.parent.mkdir()
    scene.write_text("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n")
    over = threading.Event()
    statuses: list[int] = []

    def ask_for_others(address: str) -> None:
        while not over.is_set():
            with suppress(httpx.TransportError):
                query = {**SMALL, "gaze_x": len(statuses) % 64}
                statuses.append(
                    httpx.get(f"{address}/v1/scenes/matte/frame", params=query, timeout=PATIENCE_S).status_code
                )

    def ask_for_bad(address: str, query: Mapping[str, str | int]) -> httpx.Response:
        while True:
            with suppress(httpx.TransportError):
                reply = httpx.get(f"{address}/v1/scenes/bad/frame", params=query, timeout=PATIENCE_S)
                if reply.status_code != 503:
                    return reply

    with (
        service_process("--threads", "1", "--log-json", "--scenes-folder", str(tmp_path)) as service,
        ThreadPoolExecutor(2) as clients,
    ):
        try:
            others = clients.submit(ask_for_others, service.address)
            asked = clients.submit(ask_for_bad, service.address, LARGE)
            for number in (signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT):
                end_while_tracing(service, "bad", number, asked, statuses)
            refused = asked.result(PATIENCE_S)
            served = statuses.count(200)
            assert (refused.status_code, refused.json()["type"]) == (422, "urn:gazetrace:problem:broken-scene")
            assert "bad: expected a scene that can be rendered, found that" in refused.json()["detail"]
            with viewer(service.address) as found:
                found.say(configure(scene="bad"))
                assert found.next(protocol.Error).message == refused.json()["detail"]
            quarantined = 'gazetrace_quarantined_scenes{scene="bad"} 1.0'
            assert [quarantined] == [
                line
                for line in httpx.get(f"{service.address}/metrics").text.splitlines()
                if line.startswith("gazetrace_quarantined_scenes")
            ]
            os.utime(scene)
            assert ask_for_bad(service.address, SMALL).status_code == 200
            assert "gazetrace_quarantined_scenes{" not in httpx.get(f"{service.address}/metrics").text
            while statuses.count(200) == served:
                assert not others.done()
        finally:
            over.set()
        others.result(PATIENCE_S)
    assert set(statuses) <= {200, 503}
    logged = [line for line in service.lines if "scenes refused until their files change" in line]
    assert len(logged) == 1
    assert logged[0].count(": bad") == 1


def test_a_full_disk_under_the_log_costs_lines_of_the_log(tmp_path: Path) -> None:
    with (
        small_disk(tmp_path / "disk") as disk,
        (disk / "log").open("wb") as log,
        service_process("--threads", "1", "--log-json", stderr=log) as service,
        httpx.Client(base_url=service.address, timeout=PATIENCE_S) as client,
    ):
        while os.statvfs(disk).f_bfree:
            assert client.get("/healthz").status_code == 200
        for _ in range(50):
            assert client.get("/healthz").status_code == 200
        assert frame(service, SMALL).status_code == 200
