"""The service as a process of its own."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import httpx
import pytest

from renderer.errors import SettingsError
from service.listener import address_of, listen
from service.settings import Settings
from service.supervisor import serve
from tests.service.conftest import PATIENCE_S

SERVE = """
import os
from service.settings import Settings
from service.supervisor import serve

serve(Settings.from_environment(os.environ), lambda line: print(line, flush=True))
"""


@contextmanager
def process(**variables: str) -> Iterator[subprocess.Popen[str]]:
    """`serve` in a process; its lines come on stdout. Killed in the end if it has not stopped by itself."""
    environ = {**os.environ, "GAZETRACE_PORT": "0", "GAZETRACE_THREADS": "1", **variables}
    with subprocess.Popen(
        [sys.executable, "-c", SERVE], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environ
    ) as served:
        watchdog = threading.Timer(PATIENCE_S, served.kill)
        watchdog.start()
        try:
            yield served
        finally:
            watchdog.cancel()
            served.kill()


def lines_until(served: subprocess.Popen[str], wanted: str) -> list[str]:
    lines = []
    assert served.stdout is not None
    for line in served.stdout:
        lines.append(line.rstrip())
        if line.startswith(wanted):
            return lines
    pytest.fail(f"no line begins with {wanted!r}: {lines}")


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_it_says_how_to_ask_serves_and_stops(stop: signal.Signals) -> None:
    with process() as served:
        lines = lines_until(served, "ready in ")
        first = re.fullmatch(r"gazetrace serves on (http://127\.0\.0\.1:\d+)", lines[0])
        assert first, lines
        assert any(line.startswith("compiling the kernels") for line in lines)
        asked = re.search(r'curl -o frame\.png "([^"]+)"', "\n".join(lines))
        assert asked, lines
        assert httpx.get(first[1] + "/readyz").json() == {"status": "ready", "running": 0, "waiting": 0}
        reply = httpx.get(asked[1] + "&width_px=64&height_px=36", timeout=PATIENCE_S)
        assert reply.headers["content-type"] == "image/png"
        served.send_signal(stop)
        assert served.wait(PATIENCE_S) == (0 if stop == signal.SIGINT else -signal.SIGTERM)


def test_it_stops_quietly_while_kernels_compile() -> None:
    with process() as served:
        lines_until(served, "compiling the kernels")
        served.send_signal(signal.SIGINT)
        assert served.stdout is not None
        said = served.stdout.read()
        assert served.wait(PATIENCE_S) == 0
        assert "Traceback" not in said


@pytest.mark.slow
def test_it_does_not_wait_for_a_long_frame_when_told_to_stop() -> None:
    with process() as served, ThreadPoolExecutor(1) as other:
        address = lines_until(served, "ready in ")[0].removeprefix("gazetrace serves on ")
        query = {"gaze_x": 1, "gaze_y": 1, "map": "full", "samples_per_cell": 96}
        path = f"{address}/v1/scenes/spheres/frame"
        frame = other.submit(lambda: httpx.get(path, params=query, timeout=PATIENCE_S))
        while httpx.get(f"{address}/readyz").json()["running"] == 0:
            assert not frame.done()
        served.send_signal(signal.SIGINT)
        refused = frame.result(PATIENCE_S)
        assert refused.status_code == 503
        assert refused.json()["type"] == "urn:gazetrace:problem:stopping"
        assert served.wait(PATIENCE_S) == 0
        assert served.stdout is not None
        assert "Traceback" not in served.stdout.read()


def test_a_taken_port_is_one_clear_error() -> None:
    with listen(Settings(port=0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(SettingsError, match=f"127.0.0.1:{port}"):
            serve(Settings(port=port), lambda line: pytest.fail(line))


def test_an_address_that_is_not_ours_is_one_clear_error() -> None:
    for host in ("203.0.113.1", "no such host", "x" * 70):
        with pytest.raises(SettingsError, match=host[:30]):
            serve(Settings(host=host, port=0, insecure=True), lambda line: pytest.fail(line))


@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6 here")
def test_the_address_of_ipv6_has_brackets() -> None:
    settings = Settings(host="::1", port=0)
    try:
        listener = listen(settings)
    except SettingsError:
        pytest.skip("no IPv6 loopback here")
    with listener:
        assert address_of(settings, listener) == f"http://[::1]:{listener.getsockname()[1]}"
