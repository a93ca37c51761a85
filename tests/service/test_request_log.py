"""What a service says of its requests and streams, as a process: enough to find one, and no secret."""

from __future__ import annotations

import json
from typing import Any

import httpx

from service import protocol
from tests.service.conftest import PATIENCE_S
from tests.service.process import ServiceProcess, service_process
from tests.service.streaming import configure, viewer
from tests.service.test_connection import all_of, connected

TOKEN = "a-long-secret"
BEARER = {"Authorization": f"Bearer {TOKEN}"}
FRAME = "/v1/scenes/matte/frame"


def said(service: ServiceProcess) -> list[dict[str, Any]]:
    """The lines of JSON so far."""
    return [json.loads(line) for line in service.lines if line.startswith("{")]


def test_each_request_and_stream_is_a_line_and_counted_if_it_was_refused() -> None:
    with service_process("--threads", "1", "--log-json", "--token", TOKEN) as service:
        query: dict[str, str | int] = {
            "gaze_x": 1,
            "gaze_y": 1,
            "width_px": 32,
            "height_px": 18,
            "token": "in-the-query",
        }
        with httpx.Client(base_url=service.address, timeout=PATIENCE_S) as client:
            none = client.get(FRAME, params=query)
            wrong = client.get(FRAME, params=query, headers=BEARER)
            del query["token"]
            fine = client.get(FRAME, params=query, headers=BEARER)
            with viewer(service.address, "lab", TOKEN) as found:
                found.say(configure(scene="no-such-scene"))
                assert found.next(protocol.Error).code == "unknown-scene"
                found.connection.send("no message")
                assert found.closed()[0] == protocol.CloseCode.PROTOCOL
            metrics = client.get("/metrics", headers=BEARER).text
    lines = {line.get("request"): line for line in said(service)}
    for reply, status, kind in ((none, 401, "token-needed"), (wrong, 422, "invalid-request"), (fine, 200, None)):
        line = lines[reply.headers["X-Request-Id"]]
        assert (line["event"], line["method"], line["path"]) == ("http", "GET", FRAME)
        assert (reply.status_code, line["status"], line["kind"]) == (status, status, kind)
        assert line["ms"] > 0
        assert line["why"] == (None if kind is None else reply.json()["detail"])
    (stream,) = (line for line in lines.values() if line["event"] == "websocket")
    assert (stream["session"], stream["status"], stream["kind"]) == ("lab", 4400, "protocol")
    assert any("lab: configure refused" in line["why"] for line in said(service) if line["event"] == "service.stream")
    assert 'gazetrace_refusals_total{kind="token-needed",via="http"} 1.0' in metrics
    assert 'gazetrace_refusals_total{kind="protocol",via="websocket"} 1.0' in metrics
    everything = "\n".join(service.lines)
    assert TOKEN not in everything
    assert "in-the-query" not in everything


def test_debug_says_only_what_was_refused_and_a_path_cannot_forge_a_line() -> None:
    with service_process("--threads", "1", "--debug", "--client-timeout-s", "1") as service:
        assert httpx.get(f"{service.address}/healthz").status_code == 200
        assert httpx.get(f"{service.address}/v1/scenes/x%0Aforged").status_code == 404
        for sent, status in ((b"nonsense\r\n\r\n", b"400"), (b"GET / HTTP/1.1\r\n", b"408"), (b"", b"408")):
            with connected(service.address) as connection:
                connection.sendall(sent)
                assert all_of(connection).split()[1] == status
    lines = [line for line in service.lines if "event=" in line]
    assert len(lines) == 4
    assert '"/v1/scenes/x\\nforged"' in lines[0]
    assert "unknown-scene" in lines[0]
    assert "forged" not in service.lines
    assert 'event="connection" status=400 kind="damaged-request" why="expected HTTP/1.1' in lines[1]
    assert all('kind="request-timeout" why="expected a whole request within 1 s"' in line for line in lines[2:])
