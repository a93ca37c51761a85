"""Frames over the wire: pictures, headers, ETags, determinism, and several at once."""

from __future__ import annotations

import json
import re
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import pytest

from renderer.codec import decode_texture
from renderer.pace import Rates
from renderer.pipeline import Renderer
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving

SMALL = {"width_px": 96, "height_px": 54}
ORDER: dict[str, Any] = {
    "scene": "spheres",
    "gaze": {"x": 40, "y": 20},
    "display": SMALL,
    "quality": {"samples_per_cell": 2},
}
LONG: dict[str, Any] = {
    "scene": "spheres",
    "gaze": {"x": 0, "y": 0},
    "display": {"width_px": 800, "height_px": 450},
    "quality": {"map": "full", "samples_per_cell": 48},
}
"""A frame of seconds: 17 million camera rays."""

QUERY = {"gaze_x": 40, "gaze_y": 20, **SMALL, "samples_per_cell": 2}

MAGIC = {"png": b"\x89PNG\r\n\x1a\n", "jpeg": b"\xff\xd8\xff", "webp": b"RIFF"}
CONTENT_TYPE = {"png": "image/png", "jpeg": "image/jpeg", "webp": "image/webp", "raw": "application/octet-stream"}


def header_of(reply: httpx.Response) -> dict[str, Any]:
    assert reply.status_code == 200, reply.text
    header: dict[str, Any] = json.loads(reply.headers["gazetrace-frame"])
    return header


@pytest.mark.parametrize("image_format", ["png", "jpeg", "webp"])
def test_a_picture_of_the_asked_size_and_format(client: httpx.Client, image_format: str) -> None:
    reply = client.post("/v1/render", json={**ORDER, "format": image_format})
    assert reply.status_code == 200
    assert reply.headers["content-type"] == CONTENT_TYPE[image_format]
    assert reply.content.startswith(MAGIC[image_format])
    picture = decode_texture(reply.content, "reply")
    assert picture.pixels.shape == (54, 96, 3)
    assert picture.pixels.std() > 5


def test_raw_is_linear_float32_and_agrees_with_png(client: httpx.Client) -> None:
    raw = client.post("/v1/render", json={**ORDER, "format": "raw"})
    header = header_of(raw)
    assert raw.headers["content-type"] == "application/octet-stream"
    linear = np.frombuffer(raw.content, dtype="<f4").reshape(header["height"], header["width"], 3)
    assert np.isfinite(linear).all()
    assert linear.max() > 0
    png = decode_texture(client.post("/v1/render", json=ORDER).content, "reply").pixels
    brightness = np.argsort(linear.sum(axis=2).ravel())
    dark, bright = brightness[:200], brightness[-200:]
    assert png.reshape(-1, 3)[dark].mean() < png.reshape(-1, 3)[bright].mean()


def test_the_header_says_what_is_shown_and_what_it_cost(client: httpx.Client) -> None:
    reply = client.post("/v1/render", json={**ORDER, "gaze": {"x": 0.5, "y": 0.25, "unit": "fraction"}})
    header = header_of(reply)
    assert reply.headers["gazetrace-frame"].isascii()
    assert list(header) == [
        "frame", "scene", "width", "height", "format", "gaze", "map", "samples_per_cell", "samples", "acuity_scale",
        "deadline_ms", "deadline_promised", "deadline_met", "max_error", "error_met",
        "cells_traced", "cells_reused", "rays", "effects", "effect_reasons", "error",
        "rejected_samples",
        "timing_ms", "service_time_ns",
    ]  # fmt: skip
    assert (header["scene"], header["width"], header["height"], header["format"]) == ("spheres", 96, 54, "png")
    assert header["gaze"] == {"x": 48, "y": 13.5}
    assert header["map"]["kind"] == "aligned"
    assert header["map"]["bucket_px"] == 16
    assert header["map"]["cells"] == header["cells_traced"] + header["cells_reused"]
    assert (header["samples_per_cell"], header["samples"], header["acuity_scale"]) == (2, 2, 1)
    assert set(header["rays"]) == {"primary", "shadow", "reflection", "refraction"}
    assert header["rays"]["primary"] == 2 * header["cells_traced"]
    assert {"reflection", "refraction", "shadows"} <= set(header["effects"])
    assert header["error"]["rms"] > 0
    stages = header["timing_ms"]
    assert list(stages) == ["wait", "map", "trace", "reconstruct", "encode", "total"]
    assert sum(stages[stage] for stage in stages if stage != "total") <= stages["total"] + 0.1
    times = header["service_time_ns"]
    assert times["gaze_received"] <= times["started"] <= times["finished"]


def test_server_timing_has_every_stage(client: httpx.Client) -> None:
    reply = client.post("/v1/render", json=ORDER)
    stages = dict(re.findall(r"(\w+);dur=([\d.]+)", reply.headers["server-timing"]))
    assert {stage: float(time_ms) for stage, time_ms in stages.items()} == header_of(reply)["timing_ms"]


def test_frames_are_numbered(client: httpx.Client) -> None:
    first, second = (header_of(client.post("/v1/render", json=ORDER))["frame"] for _ in range(2))
    assert second > first


def test_the_same_request_gives_the_same_bytes_again_and_elsewhere(client: httpx.Client) -> None:
    first = client.post("/v1/render", json=ORDER)
    again = client.post("/v1/render", json=ORDER)
    assert header_of(again)["cells_traced"] == 0
    with serving(Settings(port=0, threads=1)) as elsewhere:
        fresh = httpx.post(f"{elsewhere}/v1/render", json=ORDER, timeout=PATIENCE_S)
    assert header_of(fresh)["cells_reused"] == 0
    assert first.content == again.content == fresh.content


def test_a_query_gives_the_picture_of_the_same_body(client: httpx.Client) -> None:
    posted = client.post("/v1/render", json=ORDER)
    got = client.get("/v1/scenes/spheres/frame", params=QUERY)
    assert got.content == posted.content
    assert header_of(got)["gaze"] == header_of(posted)["gaze"]


def test_a_camera_moves_the_view(client: httpx.Client) -> None:
    moved = {**ORDER, "camera": {"position": [0, 3, 9], "look_at": [0, 0, 0], "vertical_fov_deg": 20}}
    assert client.post("/v1/render", json=moved).content != client.post("/v1/render", json=ORDER).content


def test_an_etag_saves_the_picture(client: httpx.Client) -> None:
    path = "/v1/scenes/spheres/frame"
    first = client.get(path, params=QUERY)
    etag = first.headers["etag"]
    assert re.fullmatch(r'"[0-9a-f]+"', etag)
    before = header_of(client.post("/v1/render", json=ORDER))["frame"]
    for known in (etag, f"W/{etag}", f'"other", {etag}', "*"):
        unchanged = client.get(path, params=QUERY, headers={"If-None-Match": known})
        assert (unchanged.status_code, unchanged.content) == (304, b"")
        assert unchanged.headers["etag"] == etag
        assert "gazetrace-frame" not in unchanged.headers
    assert header_of(client.post("/v1/render", json=ORDER))["frame"] == before + 1
    other = client.get(path, params=QUERY, headers={"If-None-Match": '"other"'})
    assert (other.status_code, other.content) == (200, first.content)


@pytest.mark.parametrize(
    "change",
    [
        {"gaze_x": 41},
        {"width_px": 97},
        {"samples_per_cell": 3},
        {"shadow_samples": 5},
        {"max_depth": 2},
        {"effects": "-reflection"},
        {"map": "full"},
        {"acuity_scale": 2},
        {"format": "jpeg"},
        {"image_quality": 91},
    ],
)
def test_another_request_has_another_etag(client: httpx.Client, change: dict[str, Any]) -> None:
    path = "/v1/scenes/spheres/frame"
    etag = client.get(path, params=QUERY).headers["etag"]
    other = client.get(path, params={**QUERY, **change}, headers={"If-None-Match": etag})
    assert other.status_code == 200
    assert other.headers["etag"] != etag


def test_a_frame_with_a_deadline_says_what_fitted_and_is_not_kept(
    client: httpx.Client, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With rates by which a sample takes a microsecond and nothing else any time: what fits is certain."""
    monkeypatch.setattr(renderer._pace, "rates", lambda *_: Rates(0.0, 0.0, 1000.0))
    for deadline_ms, scale, samples, met in ((1e-3, 8, 1, False), (6e5, 1, 2, True)):
        path, params = "/v1/scenes/cornell/frame", {**QUERY, "deadline_ms": deadline_ms}
        renderer.forget_samples()
        reply = client.get(path, params=params)
        assert "etag" not in reply.headers
        assert reply.headers["cache-control"] == "no-store"
        body = {"scene": "cornell", "gaze": {"x": 40, "y": 20}, "display": SMALL}
        quality = {"samples_per_cell": 2, "deadline_ms": deadline_ms}
        renderer.forget_samples()
        for header in (header_of(reply), header_of(client.post("/v1/render", json={**body, "quality": quality}))):
            assert (header["deadline_ms"], header["deadline_met"]) == (deadline_ms, met)
            assert header["samples_per_cell"] == samples
            assert header["acuity_scale"] == scale


def test_a_frame_by_its_error_is_the_same_by_every_route_and_says_whether_it_came_true(client: httpx.Client) -> None:
    path = "/v1/scenes/cornell/frame"
    query = {name: value for name, value in QUERY.items() if name != "samples_per_cell"}
    body = {"scene": "cornell", "gaze": {"x": 40, "y": 20}, "display": SMALL}
    for wish, samples, met in (({"max_error": 0.9}, 2, True), ({"max_error": 1e-9, "samples_per_cell": 3}, 3, False)):
        got = client.get(path, params={**query, **wish})
        posted = client.post("/v1/render", json={**body, "quality": wish})
        assert got.content == posted.content
        assert "etag" in got.headers
        for header in (header_of(got), header_of(posted)):
            assert (header["max_error"], header["error_met"]) == (wish["max_error"], met)
            assert header["samples_per_cell"] == samples
            assert met == (max(header["error"]["rms"], header["error"]["foveal_rms"]) <= wish["max_error"])


def test_a_gaze_in_another_unit_has_the_same_etag(client: httpx.Client) -> None:
    shares = {**QUERY, "gaze_x": 0.5, "gaze_y": 0.5, "unit": "fraction"}
    pixels = {**QUERY, "gaze_x": 48, "gaze_y": 27}
    tags = {client.get("/v1/scenes/spheres/frame", params=query).headers["etag"] for query in (shares, pixels)}
    assert len(tags) == 1


def test_a_short_frame_overtakes_a_long_one(client: httpx.Client) -> None:
    with ThreadPoolExecutor(1) as other:
        long = _started(other, client, LONG)
        short = header_of(client.post("/v1/render", json=ORDER))
        assert not long.done()
        finished = header_of(long.result(PATIENCE_S))
    assert finished["frame"] > short["frame"]
    assert finished["service_time_ns"]["started"] < short["service_time_ns"]["started"]


def test_the_service_answers_while_it_renders(client: httpx.Client) -> None:
    with ThreadPoolExecutor(1) as other:
        long = _started(other, client, _never_seen(LONG))
        for _ in range(20):
            assert client.get("/healthz").json() == {"status": "ok"}
            assert client.get("/v1/scenes/spheres").status_code == 200
        assert not long.done()
        assert long.result(PATIENCE_S).status_code == 200


def test_a_full_queue_sends_away_and_a_client_that_leaves_frees_its_place(
    client_of: Callable[[Settings], httpx.Client],
) -> None:
    client = client_of(Settings(port=0, max_concurrent_renders=1, max_queued_renders=1))
    with ThreadPoolExecutor(1) as other:
        long = _started(other, client, _never_seen(LONG))
        body = json.dumps(ORDER).encode()
        with socket.create_connection((client.base_url.host, client.base_url.port)) as queued:
            queued.sendall(
                b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                b"Content-Length: %d\r\n\r\n%b" % (len(body), body)
            )
            while client.get("/readyz").status_code == 200:
                assert not long.done()
            for refused in (client.get("/readyz"), client.post("/v1/render", json=ORDER)):
                assert refused.status_code == 503
                assert refused.json()["type"] == "urn:gazetrace:problem:busy"
                assert int(refused.headers["retry-after"]) >= 1
        _await_readiness(client, {"running": 1, "waiting": 0})
        assert not long.done()
        assert client.post("/v1/render", json=ORDER).status_code == 200
        assert long.result(PATIENCE_S).status_code == 200


def test_not_ready_before_the_kernels_are_compiled_but_alive() -> None:
    release = threading.Event()

    class SlowToStart(Renderer):
        def warm_up(self) -> None:
            assert release.wait(PATIENCE_S)

    slow = SlowToStart(threads=1)
    with serving(Settings(port=0), slow, ready=False) as address, httpx.Client(base_url=address) as client:
        assert client.get("/healthz").status_code == 200
        assert client.get("/v1/scenes/spheres").status_code == 200
        for reply in (
            client.get("/readyz"),
            client.post("/v1/render", json=ORDER),
            client.get("/v1/scenes/spheres/frame", params=QUERY),
            client.get("/v1/cellmap", params={"gaze_x": 1, "gaze_y": 1}),
        ):
            assert reply.status_code == 503
            assert reply.json()["type"] == "urn:gazetrace:problem:not-ready"
            assert "retry-after" in reply.headers
        release.set()
        _await_readiness(client, {"running": 0, "waiting": 0})
    slow.close()


_seen = iter(range(1, 1000))


def _never_seen(order: dict[str, Any]) -> dict[str, Any]:
    """The order from a slightly different distance, so that no stored sample serves it."""
    return {**order, "display": {**order["display"], "distance_cm": 60 + next(_seen)}}


def _started(other: ThreadPoolExecutor, client: httpx.Client, order: dict[str, Any]) -> Future[httpx.Response]:
    """A request in another thread, once the service renders it."""
    url = client.base_url.join("/v1/render")
    future = other.submit(lambda: httpx.post(url, json=order, timeout=PATIENCE_S))
    _await_readiness(client, {"running": 1, "waiting": 0})
    return future


def _await_readiness(client: httpx.Client, wanted: dict[str, int]) -> None:
    """Ask until the service says so."""
    deadline = time.monotonic() + PATIENCE_S
    found: dict[str, Any] = {}
    while time.monotonic() < deadline:
        found = client.get("/readyz").json()
        if {key: found.get(key) for key in wanted} == wanted:
            return
    pytest.fail(f"expected {wanted}, found {found}")
