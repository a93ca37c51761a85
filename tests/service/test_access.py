"""Who may ask: token, host names, origins."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import pytest
from starlette.datastructures import Headers

from service.access import EVERY_RIGHT, Right, host_refusal, origin_refusal, right_refusal, rights_of
from service.settings import Settings

TOKEN = "correct-horse-battery"
VIEW_TOKEN = "only-to-look-at"
GAZE_TOKEN = "only-to-be-a-gaze"
GAZE = {"gaze_x": 1, "gaze_y": 2, "width_px": 32, "height_px": 18}

LOOPBACK = Settings()
BEYOND = Settings(host="0.0.0.0", token=TOKEN)
INSECURE = Settings(host="0.0.0.0", insecure=True)


@pytest.mark.parametrize(
    ("settings", "host", "welcome"),
    [
        (LOOPBACK, "127.0.0.1:8321", True),
        (LOOPBACK, "localhost", True),
        (LOOPBACK, "LocalHost:1", True),
        (LOOPBACK, "[::1]:8321", True),
        (LOOPBACK, "evil.example:8321", False),
        (LOOPBACK, "127.0.0.1.evil.example", False),
        (LOOPBACK, "localhost.evil.example", False),
        (LOOPBACK, "192.168.1.2:8321", False),
        (LOOPBACK, "", False),
        (Settings(allowed_hosts=("render.example",)), "render.example:443", True),
        (Settings(allowed_hosts=("render.example",)), "other.example", False),
        (Settings(allowed_hosts=("*",)), "other.example", True),
        (BEYOND, "render.example", True),
        (BEYOND, "192.168.1.2:8321", True),
        (Settings(host="0.0.0.0", token=TOKEN, allowed_hosts=("render.example",)), "evil.example", False),
        (INSECURE, "192.168.1.2:8321", True),
        (INSECURE, "[fe80::1]:8321", True),
        (INSECURE, "localhost", True),
        (INSECURE, "evil.example", False),
        (Settings(host="0.0.0.0", insecure=True, allowed_hosts=("gazetrace",)), "gazetrace:8321", True),
    ],
)
def test_names_of_the_service(settings: Settings, host: str, welcome: bool) -> None:
    assert (host_refusal(settings, host) is None) == welcome


@pytest.mark.parametrize(
    ("headers", "welcome"),
    [
        ({}, True),
        ({"origin": "http://127.0.0.1:8321"}, True),
        ({"origin": "https://127.0.0.1:8321"}, True),
        ({"origin": "http://127.0.0.1:9000"}, False),
        ({"origin": "http://evil.example"}, False),
        ({"origin": "null"}, False),
        ({"origin": "https://lab.example"}, True),
        ({"origin": "https://lab.example.evil.example"}, False),
        ({"sec-fetch-site": "none"}, True),
        ({"sec-fetch-site": "same-origin"}, True),
        ({"sec-fetch-site": "cross-site", "sec-fetch-dest": "image"}, False),
        ({"sec-fetch-site": "cross-site", "sec-fetch-dest": "iframe"}, False),
        ({"sec-fetch-site": "same-site", "sec-fetch-dest": "image"}, False),
        ({"sec-fetch-site": "cross-site", "sec-fetch-dest": "document"}, True),
        ({"sec-fetch-site": "cross-site", "origin": "https://lab.example"}, True),
    ],
)
def test_origins(headers: dict[str, str], welcome: bool) -> None:
    settings = Settings(allowed_origins=("https://lab.example",))
    assert (origin_refusal(settings, Headers({"host": "127.0.0.1:8321", **headers})) is None) == welcome


@pytest.mark.parametrize(
    ("authorization", "welcome"),
    [
        (f"Bearer {TOKEN}", True),
        (f"bearer  {TOKEN}", True),
        (None, False),
        ("", False),
        (TOKEN, False),
        (f"Basic {TOKEN}", False),
        ("Bearer", False),
        ("Bearer ", False),
        (f"Bearer {TOKEN}x", False),
        (f"Bearer {TOKEN[:-1]}", False),
        ("Bearer correct-hörse", False),
    ],
)
def test_tokens(authorization: str | None, welcome: bool) -> None:
    assert (right_refusal(Settings(token=TOKEN), authorization, Right.VIEW) is None) == welcome
    assert right_refusal(Settings(), authorization, Right.GAZE) is None


def test_each_token_has_its_rights() -> None:
    settings = Settings(token=TOKEN, view_token=VIEW_TOKEN, gaze_token=GAZE_TOKEN)
    assert rights_of(settings, f"Bearer {TOKEN}") == EVERY_RIGHT
    assert rights_of(settings, f"Bearer {VIEW_TOKEN}") == {Right.VIEW}
    assert rights_of(settings, f"Bearer {GAZE_TOKEN}") == {Right.GAZE}
    for shown in (f"Basic {TOKEN}", f"Bearer {VIEW_TOKEN}{GAZE_TOKEN}", "Bearer ", None):
        assert isinstance(rights_of(settings, shown), str)


def test_who_may_only_be_a_gaze_gets_no_frame(client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, token=TOKEN, view_token=VIEW_TOKEN, gaze_token=GAZE_TOKEN))
    refused = client.get("/v1/scenes", headers={"Authorization": f"Bearer {GAZE_TOKEN}"})
    assert refused.status_code == 403
    assert 'error="insufficient_scope"' in refused.headers["www-authenticate"]
    assert refused.json()["detail"] == "this token does not entitle to look at frames"
    assert client.get("/v1/scenes", headers={"Authorization": f"Bearer {VIEW_TOKEN}"}).status_code == 200


def test_with_a_token_all_but_health_and_the_page_asks_for_it(client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, token=TOKEN))
    for path in ("/healthz", "/readyz", "/", "/docs", "/page/page.js"):
        assert client.get(path).status_code == 200, path
    for path in (
        "/v1/scenes",
        "/v1/scenes/spheres",
        "/v1/scenes/spheres/frame",
        "/v1/cellmap",
        "/metrics",
        "/page",
    ):
        refused = client.get(path, params=GAZE)
        assert refused.status_code == 401, path
        assert refused.headers["content-type"] == "application/problem+json"
        assert refused.headers["www-authenticate"] == 'Bearer realm="gazetrace"'
        assert TOKEN not in refused.text
    body = {"scene": "spheres", "gaze": {"x": 1, "y": 2}, "display": {"width_px": 32, "height_px": 18}}
    assert client.post("/v1/render", json=body).status_code == 401
    wrong = client.post("/v1/render", json=body, headers={"Authorization": "Bearer wrong-token"})
    assert 'error="invalid_token"' in wrong.headers["www-authenticate"]
    right = {"Authorization": f"Bearer {TOKEN}"}
    assert client.post("/v1/render", json=body, headers=right).status_code == 200
    assert client.get("/v1/scenes/spheres/frame", params=GAZE, headers=right).status_code == 200
    assert "securitySchemes" in client.get("/openapi.json").json()["components"]


def test_another_host_name_is_refused(client: httpx.Client) -> None:
    for path in ("/", "/healthz", "/v1/scenes"):
        refused = client.get(path, headers={"Host": "evil.example"})
        assert refused.status_code == 421
        assert refused.json()["type"] == "urn:gazetrace:problem:wrong-host"
    assert client.get("/healthz", headers={"Host": "localhost:80"}).status_code == 200


def test_another_origin_is_refused(client: httpx.Client) -> None:
    refused = client.get("/v1/scenes/spheres/frame", params=GAZE, headers={"Origin": "http://evil.example"})
    assert refused.status_code == 403
    assert refused.json()["type"] == "urn:gazetrace:problem:wrong-origin"
    own = {"Origin": str(client.base_url).rstrip("/")}
    assert client.get("/v1/scenes/spheres/frame", params=GAZE, headers=own).status_code == 200


def test_an_allowed_origin_may_ask_and_read(client_of: Callable[[Settings], httpx.Client]) -> None:
    client = client_of(Settings(port=0, token=TOKEN, allowed_origins=("https://lab.example",)))
    lab = {"Origin": "https://lab.example"}
    asked = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization,content-type"}
    preflight = client.options("/v1/render", headers={**lab, **asked})
    assert preflight.status_code == 200
    assert preflight.headers["access-control-allow-origin"] == "https://lab.example"
    reply = client.get("/v1/scenes/spheres", headers={**lab, "Authorization": f"Bearer {TOKEN}"})
    assert reply.status_code == 200
    assert reply.headers["access-control-allow-origin"] == "https://lab.example"
    assert "Gazetrace-Frame" in reply.headers["access-control-expose-headers"]
    refused = client.get("/v1/scenes/spheres", headers=lab)
    assert (refused.status_code, refused.headers["access-control-allow-origin"]) == (401, "https://lab.example")
    assert client.get("/v1/scenes", headers={"Origin": "https://other.example"}).status_code == 403


@pytest.mark.parametrize("path", ["/", "/healthz", "/v1/scenes/nowhere", "/v1/cellmap", "/nowhere"])
def test_every_reply_is_safe_to_show(client: httpx.Client, path: str) -> None:
    headers = client.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    policy = headers["content-security-policy"]
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    assert "server" not in headers
