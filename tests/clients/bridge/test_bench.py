"""What the bridge costs, measured: from a serial byte to the service, and from a recorded gaze to a frame."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from clients.bridge.recording import read_recording
from clients.bridge.smi import Smi
from renderer.pipeline import Renderer
from service.settings import Settings
from tests.clients.bridge.recorded import FILE
from tests.clients.bridge.running import listener
from tests.clients.bridge.terminal import PATIENCE_S
from tests.clients.commands import start
from tests.service.conftest import serving
from tests.service.streaming import configure, viewer

pytestmark = [pytest.mark.bench, pytest.mark.usefixtures("plain_environment")]

RATE_HZ = 1000
SAMPLES = 10 * RATE_HZ
FRAMES = 100
DISPLAY = {"width_px": 640, "height_px": 360, "width_cm": 50.0, "distance_cm": 60.0}


@contextmanager
def process(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    with start("bridge", *words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as found:
        try:
            yield found
        finally:
            found.terminate()
            found.communicate(timeout=PATIENCE_S)


def cpu_s(process_id: int) -> float:
    """Processor time that a process has used."""
    words = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def test_at_1000_samples_a_second_the_service_has_them_within_2_ms_and_none_is_lost(tmp_path: Path) -> None:
    """A tracker, the bridge and a listener, each a process or a thread of its own; on idle cores."""
    target, recording = str(tmp_path / "tracker"), tmp_path / "run.rec"
    with listener() as service, process("--emit", "smi", target, "--rate-hz", str(RATE_HZ)) as tracker:
        assert tracker.stdout is not None
        tracker.stdout.readline()
        status = ["--status-file", str(tmp_path / "status.json"), "--record", str(recording)]
        with process("--port", target, "--protocol", "smi", "--service", service.url, *status) as bridge:
            service.heard.until(lambda items: len(items) > RATE_HZ // 2)
            begin, used = time.monotonic(), cpu_s(bridge.pid)
            service.heard.until(lambda items: len(items) > SAMPLES * 3 // 4)
            share = (cpu_s(bridge.pid) - used) / (time.monotonic() - begin)
            health = json.loads((tmp_path / "status.json").read_text())
    codec = Smi()
    samples = [sample for chunk in read_recording(recording).chunks for sample in codec.feed(chunk.data)]
    steps = np.diff([sample.ticks for sample in samples if sample.ticks is not None])
    sys.stdout.write(
        f"\n{health['rate_hz']} samples/s, last byte to sent: p50 {health['latency_ms_p50']} ms, "
        f"p99 {health['latency_ms_p99']} ms; {share:.0%} of a core; {health['dropped']} of {len(samples)} superseded\n"
    )
    assert codec.bad <= 1
    gaps = np.flatnonzero(steps != 1e6 / RATE_HZ)
    assert gaps.size == 0, f"records are missing after {gaps}: {steps[gaps]} us"
    assert health["latency_ms_p99"] < 2


def test_from_a_recorded_gaze_to_its_frame(tmp_path: Path) -> None:
    """The recording as an SMI tracker, the bridge, a service that renders, a viewer; all on one clock."""
    if not FILE.exists():
        pytest.skip(f"there is no recording {FILE.name} beside the checkout")
    target, renderer, late = str(tmp_path / "tracker"), Renderer(), []
    emitted = process("--emit", "smi", target, "--trace", str(FILE), "--loop", "--screen-px", "1920x1080")
    with serving(Settings(port=0), renderer) as address, emitted as tracker, viewer(address, "lab") as eye:
        assert tracker.stdout is not None
        tracker.stdout.readline()
        eye.say(configure(scene="spheres", display=DISPLAY, quality={"samples_per_cell": 1}, format="jpeg"))
        bridge = ["--port", target, "--protocol", "smi", "--service", address, "--session", "lab"]
        with process(*bridge, "--screen-px", "1920x1080"):
            newest = -1
            while len(late) < FRAMES:
                header = eye.frame(lambda header: header.gaze is not None and header.gaze.seq is not None).header
                now_ns = time.monotonic_ns()
                gaze = header.gaze
                assert gaze is not None
                assert gaze.seq is not None
                assert gaze.captured_time_ns is not None
                if gaze.seq > newest and header.gaze_state == "live" and header.phase == "moving":
                    late.append((now_ns - gaze.captured_time_ns) / 1e6)
                newest = max(newest, gaze.seq)
    renderer.close()
    p50, p95 = np.percentile(late, (50, 95))
    sys.stdout.write(
        f"\nfrom capture to the frame at the viewer: p50 {p50:.1f} ms, p95 {p95:.1f} ms, {len(late)} frames\n"
    )
    assert p50 < p95 < 1000
