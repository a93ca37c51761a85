"""The network between a bridge and its service is cut for a while: the bridge comes back and sends the newest gaze."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import pytest

from renderer.pipeline import Renderer
from service.protocol import Status
from service.settings import Settings
from tests.far import far_place
from tests.service.conftest import PATIENCE_S, serving
from tests.service.streaming import sessions, viewer


@pytest.mark.parametrize("seconds", [12, pytest.param(60, marks=pytest.mark.bench)])
def test_a_bridge_comes_back_after_a_cut(seconds: float) -> None:
    renderer = Renderer(threads=1)
    with (
        far_place() as far,
        serving(Settings(host=far.here, port=0, insecure=True, ping_s=1), renderer, ready=False) as address,
    ):
        words = ["bridge", "--simulate", "--session", "lab", "--service", address]
        with (
            viewer(address, "lab") as found,
            subprocess.Popen(
                ["ip", "netns", "exec", far.name, sys.executable, "-m", "clients.command_line", *words],
                stderr=subprocess.DEVNULL,
            ) as bridge,
        ):
            try:
                found.next(Status, lambda status: status.gaze_sources == 1 and status.gaze_state == "live")
                far.cut()
                began = time.monotonic()
                found.next(Status, lambda status: status.gaze_sources == 0)
                threading.Event().wait(max(0.0, began + seconds - time.monotonic()))
                assert sessions(address)["lab"]["gaze_sources"] == 0
                far.mend()
                found.next(Status, lambda status: status.gaze_sources == 1)
                assert bridge.poll() is None
            finally:
                bridge.terminate()
                bridge.wait(PATIENCE_S)
    renderer.close()
