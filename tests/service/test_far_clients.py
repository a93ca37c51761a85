"""Clients behind a line that breaks: they are given up."""

from __future__ import annotations

import httpx

from renderer.pipeline import Renderer
from service.settings import Settings
from tests.far import far_place
from tests.service.conftest import PATIENCE_S, serving
from tests.service.streaming import sessions, viewer


def test_a_client_that_vanishes_is_forgotten(renderer: Renderer) -> None:
    with (
        far_place() as far,
        serving(
            Settings(host=far.here, port=0, insecure=True, ping_s=1, session_expiry_s=0), renderer, ready=False
        ) as address,
        far.connect(int(address.rpartition(":")[2])) as line,
        viewer(address, "gone", sock=line) as found,
    ):
        assert found.connection.ping().wait(PATIENCE_S)
        assert sessions(address)["gone"]["viewers"] == 1
        far.cut()
        while sessions(address):
            pass
        assert "gazetrace_viewers 0.0" in httpx.get(f"{address}/metrics").text
        line.close()
