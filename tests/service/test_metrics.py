"""What Prometheus is told, against what the frames themselves say."""

from __future__ import annotations

import json
from collections.abc import Iterator

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from renderer.pipeline import Renderer
from service.protocol import Gaze, Status
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.streaming import COARSE, configure, settle, source, viewer


@pytest.fixture
def address(renderer: Renderer) -> Iterator[str]:
    """A service of its own, that has counted nothing yet."""
    with serving(Settings(port=0), renderer) as address:
        yield address


def metrics(address: str) -> dict[tuple[str, ...], float]:
    """Every sample by its name and the values of its labels."""
    reply = httpx.get(f"{address}/metrics", timeout=PATIENCE_S)
    assert reply.status_code == 200
    assert reply.headers["content-type"].startswith("text/plain; version=")
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(reply.text)
        for sample in family.samples
    }


def test_a_request_counts_as_its_header_says(address: str, renderer: Renderer) -> None:
    renderer.forget_samples()
    query = {"gaze_x": 10, "gaze_y": 10, "width_px": 64, "height_px": 36, "map": "full", "deadline_ms": 1e-3}
    replies = [httpx.get(f"{address}/v1/scenes/spheres/frame", params=query, timeout=PATIENCE_S) for _ in range(2)]
    headers = [json.loads(reply.headers["Gazetrace-Frame"]) for reply in replies]
    found = metrics(address)
    for kind in ("primary", "shadow", "reflection", "refraction"):
        assert found["gazetrace_rays_total", kind] == sum(header["rays"][kind] for header in headers)
    assert found["gazetrace_rays_total", "primary"] > 0
    assert found["gazetrace_cells_total", "traced"] == sum(header["cells_traced"] for header in headers)
    assert found["gazetrace_cells_total", "reused"] == sum(header["cells_reused"] for header in headers)
    assert headers[1]["map"]["cached"]
    assert found["gazetrace_maps_total", "cache"] == sum(header["map"]["cached"] for header in headers)
    assert found["gazetrace_frames_total", "request"] == 2
    for reason in ("not_a_number", "negative", "too_bright"):
        assert found["gazetrace_rejected_samples_total", reason] == 0
    assert found["gazetrace_missed_deadlines_total",] == 2
    assert found["gazetrace_image_bytes_total", "request"] == sum(len(reply.content) for reply in replies)
    for stage in ("map", "trace", "reconstruct", "encode"):
        assert found["gazetrace_stage_seconds_count", stage] == 2
        spent_s = sum(header["timing_ms"][stage] for header in headers) / 1000
        assert found["gazetrace_stage_seconds_sum", stage] == pytest.approx(spent_s, abs=2e-6)


def test_a_stream_counts_what_was_sent_superseded_and_dropped(address: str) -> None:
    with viewer(address, "counted") as eye, viewer(address, "counted") as slow, source(address, "counted") as tracker:
        slow.next(Status, lambda status: status.viewers == 2)
        eye.say(configure(quality=COARSE))
        frames = [eye.frame()]
        for move in range(4):
            eye.say(Gaze(8.0 if move % 2 else 56.0, 18.0, seq=move))
            frames.append(eye.frame(lambda header, move=move: header.gaze is not None and header.gaze.seq == move))
        frames.append(eye.final())
        tracker.say(*(Gaze(8.0, 18.0) for _ in range(3)))
        settle(tracker, 1)
        found = metrics(address)
        last = frames[-1].header
        assert found["gazetrace_sessions",] == 1
        assert found["gazetrace_viewers",] == 2
        assert found["gazetrace_gaze_sources",] == 1
        assert found["gazetrace_gaze_to_frame_seconds_count",] >= 5
        assert found["gazetrace_dropped_frames_total",] >= 4
        assert found["gazetrace_superseded_gazes_total",] >= last.superseded
        sent = found["gazetrace_image_bytes_total", "stream"]
        assert sent >= sum(len(frame.image) for frame in frames)
    assert metrics(address)["gazetrace_frames_total", "stream"] >= last.frame


def test_each_service_counts_for_itself(address: str, renderer: Renderer) -> None:
    query = {"gaze_x": 1, "gaze_y": 1, "width_px": 32, "height_px": 18}
    with serving(Settings(port=0), renderer) as other:
        assert httpx.get(f"{other}/v1/scenes/matte/frame", params=query, timeout=PATIENCE_S).status_code == 200
        assert metrics(other)["gazetrace_frames_total", "request"] == 1
        assert ("gazetrace_frames_total", "request") not in metrics(address)
