"""`gazetrace bridge --calibrate` with the page in a real browser: an eye that looks at what is drawn there."""

from __future__ import annotations

import json
import math
import subprocess
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from service.protocol import FrameHeader
from tests.clients.bridge.terminal import Terminal
from tests.clients.commands import start
from tests.service.chromium import Page
from tests.service.conftest import PATIENCE_S

pytestmark = [pytest.mark.browser, pytest.mark.slow]

WIDTH, HEIGHT = 800, 480
SETTINGS = {"samples_per_cell": "1", "scale": "2", "deadline_ms": "500", "source": "tracker"}

SHOWN = """(() => {
  const layer = document.getElementById("target");
  if (layer.hidden) return null;
  const box = layer.querySelector("i").getBoundingClientRect();
  return [Number(layer.innerText.match(/[0-9]+/)[0]), (box.left + box.right) / 2, (box.top + box.bottom) / 2];
})()"""
"""Number and place of the target that is drawn [CSS px]."""


class Eye:
    """A camera's eye tracker in front of the page: camera units, a little noise, and off by something else at each
    target. While the page does not show the target that the bridge has asked for, the eye is closed.
    """

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal
        self._generator = np.random.default_rng(5)
        self._bias = self._generator.normal(0, 2.0, (9, 2))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self.at: tuple[int, float, float] | None = None
        self.asked = 0

    def measured(self, number: int, x: float, y: float) -> NDArray[np.float64]:
        """What the camera makes of a place in the window [CSS px], without noise."""
        u, v = x / WIDTH, y / HEIGHT
        return np.array((210 + 300 * u + 14 * u * v, 95 + 180 * v - 9 * u * u)) + self._bias[number - 1]

    def _look(self) -> None:
        while not self._stop.wait(0.004):
            at = self.at
            if at is None or (self.asked and at[0] != self.asked):
                self._terminal.write(b"nan,nan\n")
                continue
            x, y = self.measured(*at) + self._generator.normal(0, 0.3, 2)
            self._terminal.write(f"{x:.3f},{y:.3f}\n".encode())

    def __enter__(self) -> Eye:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


@contextmanager
def calibrating(eye: Eye, *words: str) -> Iterator[tuple[subprocess.Popen[bytes], dict[str, Any]]]:
    """The command, and the event with which its calibration ended, once it has."""
    ended: dict[str, Any] = {}
    bridge = start("bridge", "--log-json", *words, stderr=subprocess.PIPE)

    def listen() -> None:
        assert bridge.stderr is not None
        for line in bridge.stderr:
            event = json.loads(line)
            if event["event"] == "calibration" and event["text"].startswith("target "):
                eye.asked = int(event["text"].split()[1])
            elif event["event"] == "calibration" and not event["text"].startswith("waiting"):
                ended.update(event)

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        yield bridge, ended
    finally:
        bridge.terminate()
        listener.join(PATIENCE_S)
        assert bridge.stderr is not None
        bridge.stderr.close()
        bridge.wait(PATIENCE_S)


def left_out_error_deg(points: NDArray[np.float64], display: Mapping[str, float]) -> float:
    """Root mean square error at the points, each left out of a quadratic fit: its residual over 1 - leverage."""
    measured, targets = points[:, :2], points[:, 2:]
    u, v = ((measured - measured.mean(axis=0)) / measured.std(axis=0)).T
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)
    hat = terms @ np.linalg.pinv(terms)
    predicted = targets - (targets - hat @ targets) / (1 - np.diag(hat))[:, None]
    size = np.array((display["width_cm"], display["height_cm"]))
    depth = np.full((len(points), 1), display["distance_cm"])
    directions = [np.hstack([(place - 0.5) * size, depth]) for place in (predicted, targets)]
    a, b = (direction / np.linalg.norm(direction, axis=1)[:, None] for direction in directions)
    return math.degrees(np.sqrt(np.mean(np.arccos(np.clip((a * b).sum(axis=1), -1, 1)) ** 2)))


def test_the_page_shows_nine_targets_and_the_error_left_becomes_the_sessions_margin(
    page: Page, address: str, tmp_path: Path
) -> None:
    file, terminal = tmp_path / "lab.json", Terminal(tmp_path / "tracker")
    terminal.plug()
    page.open(f"{address}/#spheres", WIDTH, HEIGHT, settings=SETTINGS)
    before = page.shown()
    session = page.evaluate("document.getElementById('session').value")
    device = ["--port", str(terminal.path), "--protocol", "csv", "--unit", "raw"]
    words = [*device, "--service", address, "--session", session, "--calibrate", str(file)]
    drawn: dict[int, tuple[float, float]] = {}
    with Eye(terminal) as eye, calibrating(eye, *words) as (bridge, ended):
        eye.at = (1, WIDTH / 2, HEIGHT / 2)
        while not ended and bridge.poll() is None:
            shown = page.evaluate(SHOWN)
            if shown is not None:
                number, x, y = shown
                eye.at = (number, x, y)
                drawn[number] = (x / WIDTH, y / HEIGHT)
        assert "deg off" in ended["text"], (ended, drawn, eye.asked, eye.at, page.heard("target"))
        page.wait_for("document.getElementById('target').hidden")
        eye.asked, eye.at = 0, (9, 0.9 * WIDTH, 0.9 * HEIGHT)

        def follows(header: FrameHeader) -> bool:
            assert header.gaze is not None
            near = math.hypot(header.gaze.x - 0.9 * WIDTH, header.gaze.y - 0.9 * HEIGHT) < 0.05 * WIDTH
            return near and header.gaze_state == "live"

        after = page.shown(follows)
    expected = [(x, y) for y in (0.1, 0.5, 0.9) for x in (0.1, 0.5, 0.9)]
    assert [drawn[number] for number in range(1, 10)] == [pytest.approx(place, abs=1e-3) for place in expected]
    points = np.array(json.loads(file.read_text())["points"])
    np.testing.assert_allclose(points[:, 2:], expected)
    np.testing.assert_allclose(
        points[:, :2], [eye.measured(n, x * WIDTH, y * HEIGHT) for n, (x, y) in enumerate(expected, 1)], atol=0.3
    )
    display = page.said("configure")[-1]["display"] | {"distance_cm": 60.0}
    assert ended["margin_deg"] == pytest.approx(left_out_error_deg(points, display), rel=1e-3)
    assert ended["margin_deg"] > 0.05
    assert after.cost["map"]["margin_deg"] - before.cost["map"]["margin_deg"] == pytest.approx(
        ended["margin_deg"], rel=0.01
    )
    terminal.unplug()
    assert page.complaints() == []
