"""Every error is a problem that names what is wrong; the service serves on."""

from __future__ import annotations

import contextlib
import gc
import json
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from service.settings import Settings
from tests.service.conftest import BROKEN_SCENE

ORDER: dict[str, Any] = {"scene": "spheres", "gaze": {"x": 1, "y": 2}, "display": {"width_px": 32, "height_px": 18}}
GAZE = {"gaze_x": 1, "gaze_y": 2}


@pytest.fixture(autouse=True)
def _serves_on(client: httpx.Client) -> Iterator[None]:
    yield
    assert client.post("/v1/render", json=ORDER).status_code == 200


def expect_problem(reply: httpx.Response, status: int, kind: str, *fields: str) -> dict[str, Any]:
    assert reply.status_code == status, ascii(reply.text)[:300]
    assert reply.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = reply.json()
    assert problem["status"] == status
    assert problem["type"] == (kind if kind == "about:blank" else f"urn:gazetrace:problem:{kind}")
    assert problem["title"]
    assert problem["detail"]
    assert "\n" not in problem["detail"]
    assert [error["field"] for error in problem.get("errors", [])] == list(fields)
    for field in fields:
        assert field in problem["detail"]
    return problem


def post(client: httpx.Client, text: str | bytes) -> httpx.Response:
    return client.post("/v1/render", content=text, headers={"Content-Type": "application/json"})


def test_a_body_that_is_no_text_is_told_so(client: httpx.Client) -> None:
    expect_problem(post(client, b'{"scene": "\xff"}'), 422, "invalid-request", "body")


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ('{"gaze": {"x": 1, "y": 2}}', "scene"),
        ('{"scene": "spheres"}', "gaze"),
        ('{"scene": "spheres", "gaze": {"x": 1}}', "gaze.y"),
        ('{"scene": "spheres", "gaze": {"x": NaN, "y": 2}}', "gaze.x"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": -Infinity}}', "gaze.y"),
        ('{"scene": "spheres", "gaze": {"x": 1e999, "y": 2}}', "gaze.x"),
        ('{"scene": "spheres", "gaze": {"x": "1", "y": 2}}', "gaze.x"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2, "z": 3}}', "gaze.z"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "display": {"width_px": 0}}', "display.width_px"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "display": {"width_px": 1e9}}', "display.width_px"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "display": {"distance_cm": 0}}', "display.distance_cm"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "camera": {"position": [0, 1], "look_at": [0, 0, 0]}}',
         "camera.position"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "camera": {"position": [0, "1", 2], "look_at": [0, 0, 0]}}',
         "camera.position[1]"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "camera": {"position": [0, 1, 2], "look_at": [0, 1, 2]}}',
         "camera.look_at"),
        ('{"scene": "spheres", "gaze": {"x": 1e30, "y": 2, "unit": "fraction"}}', "gaze.x"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "quality": {"deadline_ms": 0}}', "quality.deadline_ms"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}, "format": "gif"}', "format"),
        ('{"scene": "spheres", "gaze": {"x": 1, "y": 2}', "body"),
        ("[]", "body"),
        ('"' + "x" * 5000 + '"', "body"),
    ],
)  # fmt: skip
def test_a_wrong_body_names_the_field(client: httpx.Client, body: str, field: str) -> None:
    problem = expect_problem(post(client, body), 422, "invalid-request", field)
    assert len(problem["detail"]) < 300


@pytest.mark.parametrize("path", ["/v1/scenes", "/v1/scenes/spheres"])
def test_an_unknown_parameter_is_named(client: httpx.Client, path: str) -> None:
    expect_problem(client.get(path, params={"detail": "no"}), 422, "invalid-request", "detail")
    posted = client.post("/v1/render", params={"detail": "no"}, json=ORDER)
    expect_problem(posted, 422, "invalid-request", "detail")


def test_every_wrong_field_is_named(client: httpx.Client) -> None:
    body = {"gaze": {"x": "a", "y": None}, "blur": 1}
    fields = ("scene", "gaze.x", "gaze.y", "blur")
    problem = expect_problem(post(client, json.dumps(body)), 422, "invalid-request", *fields)
    assert [error["message"] for error in problem["errors"]] == [
        "is required",
        "expected a valid number, found 'a'",
        "expected a valid number, found None",
        "there is no such field",
    ]


@pytest.mark.parametrize("body", [b"", b"\xff\xfe", b"[" * 50_000, b'{"x": ' + b"1" * 20_000 + b"}"])
def test_what_is_no_json_at_all_is_refused(client: httpx.Client, body: bytes) -> None:
    reply = post(client, body)
    assert reply.status_code in (400, 422)
    assert reply.headers["content-type"] == "application/problem+json"
    assert len(reply.json()["detail"]) < 300


def test_a_damaged_body_leaves_no_garbage(client: httpx.Client) -> None:
    """It would hold the body until garbage is looked for."""
    gc.collect()
    gc.disable()
    try:
        for body in (b"{", b"\xff", b"no JSON"):
            expect_problem(post(client, body), 422, "invalid-request", "body")
        client.get("/v1/scenes")
        left = [thing for thing in gc.get_objects() if type(thing) in (RequestValidationError, HTTPException)]
    finally:
        gc.enable()
    assert not left


def test_a_body_that_is_not_called_json_is_refused(client: httpx.Client) -> None:
    problem = expect_problem(client.post("/v1/render", data={"scene": "spheres"}), 415, "about:blank")
    assert "application/json" in problem["detail"]


@pytest.mark.parametrize(
    ("query", "fields"),
    [
        ({}, ["gaze_x", "gaze_y"]),
        ({"gaze_x": "nan", "gaze_y": 1}, ["gaze_x"]),
        ({**GAZE, "gaze_z": 1}, ["gaze_z"]),
        ({**GAZE, "width_px": 40_000}, ["width_px"]),
        ({**GAZE, "width_px": "1.5"}, ["width_px"]),
        ({**GAZE, "map": "round", "margin_deg": -1}, ["map", "margin_deg"]),
        ({"gaze_x": 1e30, "gaze_y": 1, "unit": "fraction"}, ["gaze_x"]),
        ({**GAZE, "width_cm": 1e-300}, ["width_cm"]),
    ],
)
@pytest.mark.parametrize("path", ["/v1/scenes/spheres/frame", "/v1/cellmap"])
def test_a_wrong_query_names_the_parameter(
    client: httpx.Client, path: str, query: dict[str, Any], fields: list[str]
) -> None:
    expect_problem(client.get(path, params=query), 422, "invalid-request", *fields)


@pytest.mark.parametrize("scene_id", ["nowhere", "Spheres", "..", "../../etc", "a" * 64, "%00", "\u00e4"])
def test_an_unknown_scene_is_not_found(client: httpx.Client, scene_id: str) -> None:
    problem = expect_problem(client.post("/v1/render", json={**ORDER, "scene": scene_id}), 404, "unknown-scene")
    assert "spheres" in problem["detail"]


def test_an_unknown_scene_in_a_path_is_not_found(client: httpx.Client) -> None:
    for path in ("/v1/scenes/nowhere", "/v1/scenes/%2e%2e", "/v1/scenes/a%00b"):
        expect_problem(client.get(path), 404, "unknown-scene")
    expect_problem(client.get("/v1/scenes/nowhere/frame", params=GAZE), 404, "unknown-scene")


def test_a_broken_scene_says_what_is_wrong_with_it(client: httpx.Client) -> None:
    for reply in (
        client.post("/v1/render", json={**ORDER, "scene": BROKEN_SCENE}),
        client.get(f"/v1/scenes/{BROKEN_SCENE}"),
        client.get(f"/v1/scenes/{BROKEN_SCENE}/frame", params=GAZE),
    ):
        problem = expect_problem(reply, 422, "broken-scene")
        assert "scene.toml" in problem["detail"]


def test_unknown_paths_and_methods(client: httpx.Client) -> None:
    for path in (
        "/v2",
        "/v1/scenes/",
        "/page/",
        "/page/../settings.py",
        "/page/settings.py",
        "/v1/scenes/spheres/frames",
    ):
        expect_problem(client.get(path), 404, "about:blank")
    reply = client.get("/v1/render")
    expect_problem(reply, 405, "about:blank")
    assert reply.headers["allow"] == "POST"
    expect_problem(client.delete("/v1/scenes"), 405, "about:blank")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"display": {"width_px": 201, "height_px": 100}}, "display"),
        ({"quality": {"samples_per_cell": 9}}, "quality.samples_per_cell"),
        ({"quality": {"shadow_samples": 9}}, "quality.shadow_samples"),
        ({"quality": {"max_depth": 4}}, "quality.max_depth"),
        ({"display": {"width_px": 200, "height_px": 100}, "quality": {"map": "full", "samples_per_cell": 8}},
         "quality.samples_per_cell"),
        ({"display": {"width_px": 200, "height_px": 100, "distance_cm": 10}, "quality": {"samples_per_cell": 8}},
         "quality.samples_per_cell"),
    ],
)  # fmt: skip
def test_more_than_the_limits_is_refused(
    client_of: Callable[[Settings], httpx.Client], change: dict[str, Any], field: str
) -> None:
    limited = Settings(port=0, max_pixels=20_000, max_samples_per_cell=8, max_depth=3, max_camera_rays=100_000)
    limited_client = client_of(limited)
    body = {**ORDER, "quality": {"max_depth": 3}, **change}
    body["quality"] = {"max_depth": 3, **body["quality"]}
    expect_problem(limited_client.post("/v1/render", json=body), 422, "over-limit", field)


def test_few_cells_may_have_many_samples(client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, max_camera_rays=100_000))
    body = {
        **ORDER,
        "display": {"width_px": 200, "height_px": 100, "distance_cm": 20_000},
        "quality": {"samples_per_cell": 8},
    }
    reply = client.post("/v1/render", json=body)
    assert reply.status_code == 200
    header = json.loads(reply.headers["gazetrace-frame"])
    assert header["map"]["cells"] * 8 <= 100_000 < 200 * 100 * 8
    assert not header["map"]["cached"]
    over = client.get("/v1/cellmap", params={**GAZE, "width_px": 40_000 // 2, "height_px": 20_000})
    expect_problem(over, 422, "over-limit", "display")


def test_a_format_that_cannot_hold_the_frame_is_refused(client: httpx.Client) -> None:
    body = {**ORDER, "display": {"width_px": 20_000, "height_px": 1}, "format": "webp"}
    expect_problem(client.post("/v1/render", json=body), 422, "over-limit", "format")


def test_a_body_too_large_is_refused(client: httpx.Client) -> None:
    for size in (64 * 1024 + 1, 1 << 20, 4 << 20):
        expect_problem(post(client, b" " * size), 413, "body-too-large")


def test_who_sends_without_end_is_dropped(client: httpx.Client) -> None:
    def endless() -> Iterator[bytes]:
        while True:
            yield b" " * 65_536

    with contextlib.suppress(httpx.TransportError):
        reply = client.post("/v1/render", content=endless(), headers={"Content-Type": "application/json"})
        expect_problem(reply, 413, "body-too-large")


def test_a_body_too_large_in_chunks_is_refused(client: httpx.Client) -> None:
    def chunks(count: int) -> Iterator[bytes]:
        for _ in range(count):
            yield b" " * 1024

    for count in (65, 1024):
        reply = client.post("/v1/render", content=chunks(count), headers={"Content-Type": "application/json"})
        expect_problem(reply, 413, "body-too-large")
    within = json.dumps(ORDER).encode().ljust(64 * 1024)
    assert post(client, within).status_code == 200
