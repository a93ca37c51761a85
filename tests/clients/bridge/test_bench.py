"""What the bridge costs, measured: from a serial byte to the service, and from a recorded gaze to a frame."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

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


class Told(NamedTuple):
    """What became of a tracker's records, and what the bridge said of its health."""

    emitted: dict[str, int]
    decoded: int
    bad: int
    missing_after: list[int]
    health: list[dict[str, Any]]
    cpu_share: float


def recorded_run(folder: Path, service: str, seconds: float) -> Told:
    """A tracker at 1000 samples a second and the bridge, each a process of its own, for so long."""
    target, recording = str(folder / "tracker"), folder / "run.rec"
    with process("--emit", "smi", target, "--rate-hz", str(RATE_HZ), "--json") as tracker:
        assert tracker.stdout is not None
        tracker.stdout.readline()
        words = ["--port", target, "--protocol", "smi", "--service", service, "--record", str(recording), "--log-json"]
        with process(*words) as bridge:
            assert bridge.stderr is not None
            health, begin, used = [], time.monotonic(), 0.0
            while time.monotonic() - begin < seconds:
                event = json.loads(bridge.stderr.readline())
                if event["event"] == "health":
                    used, begin = (used, begin) if health else (cpu_s(bridge.pid), time.monotonic())
                    health.append(event)
            share = (cpu_s(bridge.pid) - used) / (time.monotonic() - begin)
            bridge.terminate()
            bridge.communicate(timeout=PATIENCE_S)
        tracker.terminate()
        emitted = json.loads(tracker.communicate(timeout=PATIENCE_S)[0])
    codec = Smi()
    samples = [sample for chunk in read_recording(recording).chunks for sample in codec.feed(chunk.data)]
    steps = np.diff([sample.ticks for sample in samples if sample.ticks is not None])
    gaps = np.flatnonzero(steps != 1e6 / RATE_HZ).tolist()
    return Told(emitted, len(samples), codec.bad, gaps, health[1:], share)


def figures(told: Told) -> str:
    """The same for people: the latencies of the median and of the worst health line, which come every 5 s."""
    sending = [line for line in told.health if line["latency_ms_p50"] is not None]
    p50, p99 = (sorted(line[f"latency_ms_{name}"] for line in sending) for name in ("p50", "p99"))
    sent, discarded, late_ms = told.emitted["sent"], told.emitted["discarded"], told.emitted["latest_ns"] / 1e6
    return (
        f"\n{sent:,} records sent (the latest {late_ms:.1f} ms after its time), {discarded} discarded by the tracker, "
        f"{told.decoded:,} decoded from the recording, {told.bad} damaged; last byte to sent: p50 {p50[len(p50) // 2]} "
        f"ms, p99 {p99[len(p99) // 2]} ms, in the worst 5 s {p99[-1]} ms; {told.cpu_share:.0%} of a core; "
        f"{told.health[-1]['dropped']} superseded, {told.health[-1]['connections']} connections\n"
    )


def nothing_is_lost(told: Told) -> bool:
    """The first record may be cut off, and the last ones are still on the line when the bridge ends."""
    assert told.missing_after == []
    assert told.bad <= 1
    assert told.emitted["discarded"] == 0
    return told.emitted["sent"] - told.decoded < RATE_HZ // 10


def test_at_1000_samples_a_second_the_service_has_them_within_2_ms_and_none_is_lost(tmp_path: Path) -> None:
    """A tracker, the bridge and a listener that renders nothing; on idle cores."""
    with listener() as service:
        told = recorded_run(tmp_path, service.url, 20)
    sys.stdout.write(figures(told))
    assert nothing_is_lost(told)
    assert max(line["latency_ms_p99"] for line in told.health) < 2


def test_a_recording_of_ten_minutes_beside_a_rendering_service_loses_nothing(tmp_path: Path) -> None:
    """What lies in the recording, even though the service renders on every core."""
    renderer, stop = Renderer(), threading.Event()
    with serving(Settings(port=0), renderer) as address, viewer(address, "main") as eye:
        eye.say(configure(scene="spheres", display=DISPLAY, quality={"samples_per_cell": 1}, format="jpeg"))

        def watch() -> None:
            while not stop.is_set():
                eye.frame()

        watching = threading.Thread(target=watch)
        watching.start()
        told = recorded_run(tmp_path, address, 600)
        stop.set()
        eye.say(configure(2, scene="spheres", display=DISPLAY, format="jpeg"))
        watching.join(PATIENCE_S)
    renderer.close()
    sys.stdout.write(figures(told))
    assert nothing_is_lost(told)


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
