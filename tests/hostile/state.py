"""What a service must be like after an attack: no crash, nothing kept, no mistake in its log, and others are served."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import httpx

from tests.load.growth import Growth, growth_of
from tests.service.conftest import PATIENCE_S
from tests.service.process import ServiceProcess
from tests.service.streaming import configure, sessions, viewer

FLAGS = (
    "--threads", "1", "--max-pixels", "4096", "--max-camera-rays", "20000", "--max-sessions", "16",
    "--session-expiry-s", "1", "--map-cache-bytes", str(1 << 20), "--store-bytes", str(1 << 20),
    "--scene-bytes", str(256 << 20),
)  # fmt: skip
"""A small service that forgets soon, and whose caches are full soon."""

MORE_DESCRIPTORS = 8
MORE_THREADS = 16
"""Threads are begun as they are needed, up to the sizes of the queues."""

MORE_BYTES = 192 << 20
"""What scenes, caches and the allocator's own reserves may come to."""


def use(service: ServiceProcess) -> None:
    """What a client in good faith does: one frame over a stream, and one of each route."""
    with viewer(service.address) as found:
        found.say(configure(display={"width_px": 32, "height_px": 18}))
        found.final()
    query = {"gaze_x": 1, "gaze_y": 1, "width_px": 32, "height_px": 18}
    for path in ("/v1/scenes", "/v1/cellmap", "/v1/scenes/spheres/frame", "/metrics", "/readyz"):
        asked = query if "map" in path or "frame" in path else {}
        assert httpx.get(service.address + path, params=asked, timeout=PATIENCE_S).status_code == 200


WATCH_S = 0.25
"""Between two looks at the memory."""


class Watch:
    """The memory of a service while something is sent to it; looked at by a thread, until the block ends.

    Args:
        held: bytes that the service has in use, or resident.
        sent: how much was sent by now.
        warm_up: how much is sent before memory is held to anything.
    """

    def __init__(self, held: Callable[[], int], sent: Callable[[], int], warm_up: int) -> None:
        self._held, self._sent, self._warm_up = held, sent, warm_up
        self._series: list[tuple[int, int]] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look)

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    @property
    def growth(self) -> Growth:
        """Of the memory, for each of what was sent after the warm-up."""
        settled = [each for each in self._series if each[0] >= self._warm_up]
        return growth_of([sent for sent, _ in settled], [held for _, held in settled])

    def _look(self) -> None:
        while not self._over.wait(WATCH_S):
            self._series.append((self._sent(), self._held()))


class Before:
    """A service before an attack."""

    def __init__(self, service: ServiceProcess) -> None:
        use(service)
        self._service = service
        self._process = service.pid
        self._descriptors = service.descriptors
        self._threads = service.threads
        self._resident_bytes = service.resident_bytes

    def check(self) -> str:
        """Raise AssertionError unless it is as it was; the figures, for people."""
        service = self._service
        use(service)
        assert service.pid == self._process, "it crashed, and was started again"
        until = time.monotonic() + PATIENCE_S
        while (left := sessions(service.address)) or service.descriptors > self._descriptors + MORE_DESCRIPTORS:
            assert time.monotonic() < until, f"{service.descriptors} descriptors, sessions {left}"
        wrong = [line for line in service.lines if "Traceback" in line or "Error" in line or "mistake" in line]
        assert not wrong, service.lines[-60:]
        grown = service.resident_bytes - self._resident_bytes
        figures = (
            f"memory {self._resident_bytes >> 20} MiB before, {grown / (1 << 20):+.0f} MiB after; "
            f"descriptors {self._descriptors}, {service.descriptors}; threads {self._threads}, {service.threads}"
        )
        assert grown < MORE_BYTES, figures
        assert service.threads <= self._threads + MORE_THREADS, figures
        return figures
