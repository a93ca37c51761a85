"""Memory of a whole service stays below a ceiling that its settings add up to, whatever its clients ask for."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest

from renderer.pipeline import Renderer
from service.rendering import BYTES_A_PIXEL
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.process import service_process

CLIENTS = 50
FRAMES = 3
"""Of each client, each of another display and gaze."""

CACHE_BYTES = 16 << 20
FRAME_BYTES = 24 << 20
"""Two frames at once, of the four that have a thread."""

FLAGS = (
    "--threads", "1", "--map-cache-bytes", str(CACHE_BYTES), "--store-bytes", str(CACHE_BYTES),
    "--frame-bytes", str(FRAME_BYTES), "--max-queued-renders", str(CLIENTS), "--max-pixels", "131072",
)  # fmt: skip

RESERVE_BYTES = 64 << 20
"""What connections and the allocator's own reserves come to."""


def test_fifty_clients_with_displays_and_gazes_of_their_own_stay_below_a_ceiling() -> None:
    with service_process(*FLAGS) as service:

        def ask(client: int) -> list[int]:
            statuses = []
            for number in range(FRAMES):
                query = {
                    "width_px": 320 + client,
                    "height_px": 180 + 3 * number,
                    "gaze_x": 3 * client,
                    "gaze_y": 20 * number,
                    "samples_per_cell": 1,
                }
                path = f"{service.address}/v1/scenes/matte/frame"
                statuses.append(httpx.get(path, params=query, timeout=PATIENCE_S).status_code)
            return statuses

        assert ask(0) == [200] * FRAMES
        ceiling = service.resident_bytes + 2 * CACHE_BYTES + FRAME_BYTES + RESERVE_BYTES
        with ThreadPoolExecutor(CLIENTS) as clients:
            for statuses in clients.map(ask, range(CLIENTS)):
                assert statuses == [200] * FRAMES
                assert service.resident_bytes < ceiling, f"{service.resident_bytes >> 20} MiB, ceiling {ceiling >> 20}"
        metrics = httpx.get(f"{service.address}/metrics").text
        held = {line.split('"')[1]: float(line.split()[1]) for line in metrics.splitlines() if "held_bytes{" in line}
        assert 0 < held["maps"] <= CACHE_BYTES
        assert 0 < held["samples"] <= CACHE_BYTES
        assert held["frames"] == 0


def test_a_frame_that_there_would_never_be_memory_for_is_refused(renderer: Renderer) -> None:
    query = {"gaze_x": 1, "gaze_y": 1, "width_px": 64, "height_px": 36}
    with serving(Settings(port=0, frame_bytes=64 * 36 * BYTES_A_PIXEL - 1), renderer) as address:
        for path in ("/v1/scenes/matte/frame", "/v1/cellmap"):
            reply = httpx.get(address + path, params=query)
            assert (reply.status_code, reply.json()["type"]) == (422, "urn:gazetrace:problem:over-limit")
            assert "64 x 36 px take 294,912 bytes of memory, more than 294,911" in reply.json()["detail"]
        assert httpx.get(f"{address}/v1/cellmap", params={**query, "width_px": 63}).status_code == 200


@pytest.mark.slow
@pytest.mark.parametrize("quality", [{"map": "full"}, {"map": "full", "antialiasing": "adaptive"}, {"map": "scanline"}])
def test_a_frame_takes_no_more_than_it_is_granted(quality: dict[str, str]) -> None:
    """The peak of one frame in a service that keeps nothing of it."""
    width, height = 1280, 720
    with service_process("--map-cache-bytes", "0", "--store-bytes", "0") as service:

        def ask(width_px: int, height_px: int) -> None:
            query = {
                "gaze_x": 1,
                "gaze_y": 1,
                "width_px": width_px,
                "height_px": height_px,
                "format": "jpeg",
                **quality,
            }
            assert httpx.get(f"{service.address}/v1/scenes/spheres/frame", params=query, timeout=PATIENCE_S).is_success

        ask(64, 36)
        before = service.peak_bytes
        ask(width, height)
        assert service.peak_bytes - before < BYTES_A_PIXEL * width * height
