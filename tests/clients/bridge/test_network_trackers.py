"""Trackers that other packages speak with: a real outlet of the Lab Streaming Layer, real sockets of ZeroMQ."""

from __future__ import annotations

import json
import math
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from clients.bridge.config import Config
from clients.bridge.errors import ConfigError, PortError
from clients.bridge.lsl import Lsl, lsl_line
from clients.bridge.pupil import Pupil, pupil_lines
from clients.bridge.sample import Point
from clients.bridge.screen import Unit
from clients.command_line import main
from tests.clients.bridge.running import Listener, listener, running
from tests.clients.bridge.terminal import PATIENCE_S
from tests.clients.bridge.test_daemon import lost, valid


@pytest.fixture
def service() -> Iterator[Listener]:
    with listener() as found:
        yield found


# The Lab Streaming Layer


@pytest.fixture(scope="module")
def lsl(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The package, kept to this machine."""
    if "LSLAPICFG" not in os.environ:
        file = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
        file.write_text(
            "[lab]\nKnownPeers = {127.0.0.1}\n[multicast]\nResolveScope = machine\n[ports]\nIPv6 = disable\n"
            "[log]\nlevel = -3\n"
        )
        os.environ["LSLAPICFG"] = str(file)
    return pytest.importorskip("pylsl", reason="the extra 'lsl' is not installed")


def outlet(lsl: Any, name: str, labels: tuple[str, ...], kind: str = "Gaze") -> Any:
    info = lsl.StreamInfo(name, kind, len(labels), 250, "float32", f"{name} of a test")
    info.set_channel_labels(list(labels))
    return lsl.StreamOutlet(info)


PUPIL_LABELS = ("confidence", "norm_pos_x", "norm_pos_y")


def test_a_stream_is_found_read_lost_and_found_again(lsl: Any, service: Listener) -> None:
    """By its labels, not by their order; two outlets of that name, one after the other."""
    config = Config(port="lsl://eyes", unit=Unit.FRACTION, pad_ms=0, service=service.url)
    with running(config) as found:
        at = found.says("device", "absent: lsl://eyes: no stream of name 'eyes' answers")
        for count, labels in enumerate((PUPIL_LABELS, PUPIL_LABELS[::-1])):
            tracker = outlet(lsl, "eyes", labels)
            assert tracker.wait_for_consumers(PATIENCE_S)
            order = [labels.index(label) for label in PUPIL_LABELS]
            for index in range(20):
                sample = (0.9, 0.25 + index / 1000, 0.75)
                tracker.push_sample([sample[order.index(i)] for i in range(3)], 5000 + index / 250)
            service.heard.until(lambda items, n=count: sum(gaze.y == 0.75 for gaze in valid(items)) > n)
            at = found.says("device", "streaming", at)
            tracker.push_sample([0.3, 0.3, 0.3], 5001)
            del tracker
            at = found.says("device", "lost: lsl://eyes: the stream has been lost", at)
    assert {round(gaze.x, 3) for gaze in valid(service.heard.items) if gaze.x is not None} <= {
        round(0.25 + index / 1000, 3) for index in range(20)
    }
    assert lost(service.heard.items)


def test_every_sample_of_a_stream_is_recorded_and_its_time_is_the_trackers(
    lsl: Any, service: Listener, tmp_path: Path
) -> None:
    """The first stream of type Gaze, and labels of the user's choice."""
    labels = ("Left.X", "Left.Y", "Right.X", "Right.Y", "trigger")
    paths = "xl=Left.X,yl=Left.Y,xr=Right.X,yr=Right.Y"
    config = Config.read({
        "port": "lsl://", "unit": "px", "paths": paths, "record": str(tmp_path / "run.rec"), "service": service.url,
    })  # fmt: skip
    with running(config, None, None, {"protocol": "lsl", "unit": "px", "paths": paths}) as found:
        tracker = outlet(lsl, "pixels", labels)
        assert tracker.wait_for_consumers(PATIENCE_S)
        for index in range(500):
            tracker.push_sample([960, 540, 960, 540 if index != 7 else math.nan, 0], 100 + index / 250)
        pushed = 500
        while not (late := [gaze for gaze in valid(service.heard.items) if gaze.seq >= 499]):
            heard = len(service.heard.items)
            tracker.push_sample([960, 540, 960, 540, 0], 100 + pushed / 250)
            pushed += 1
            service.heard.until(lambda items, n=heard: len(items) > n)
    newest = late[0]
    assert newest.tracker_time_ns == pytest.approx(100_000_000_000 + newest.seq * 4_000_000)
    replayed: list[Any] = []
    with running(Config.read({"replay": str(tmp_path / "run.rec"), "protocol": "lsl", "unit": "px", "paths": paths,
                              "speed": "0"}), replayed.append) as found:  # fmt: skip
        assert found.ended() == 0
    assert newest.seq + 1 < len(replayed) <= pushed + 1  # and one that says that there are no more
    assert all(gaze[1:3] == (0.5, 0.5) for gaze in replayed[:-1])


def test_labels_that_are_not_there_are_named() -> None:
    codec = Lsl()
    line = lsl_line(1.0, {"left_x": 0.5, "left_y": 0.5})
    assert codec.feed(line) == []
    assert codec.complaint == (
        "expected channels norm_pos_x, norm_pos_y, found left_x, left_y: --paths x=LABEL,y=LABEL names them"
    )
    (sample,) = codec.feed(lsl_line(2.5, {"norm_pos_x": 0.25, "norm_pos_y": "0.5", "else": 1}))
    assert (sample.ticks, sample.both, codec.complaint) == (2.5, (0.25, 0.5), None)
    (lost,) = codec.feed(lsl_line(2.5, {"norm_pos_x": math.nan, "norm_pos_y": math.nan}))
    assert lost.both is None
    with pytest.raises(ConfigError, match="no t"):
        Lsl({"x": "a", "y": "b", "t": "c"})


def test_what_a_confidence_below_the_least_says_is_not_believed() -> None:
    for least, seen in ((0.6, False), (0.5, True)):
        (sample,) = Lsl(least_confidence=least).feed(
            lsl_line(1.0, {"norm_pos_x": 0.5, "norm_pos_y": 0.5, "confidence": 0.55})
        )
        assert (sample.both is not None) is seen


# Pupil Core


class Capture:
    """Pupil Capture's network interface: Pupil Remote, and a publisher that knows who has subscribed to what."""

    def __init__(self, zmq: Any, msgpack: Any) -> None:
        self._zmq, self._msgpack = zmq, msgpack
        self._context = zmq.Context()
        self._remote = self._context.socket(zmq.REP)
        self.port = self._remote.bind_to_random_port("tcp://127.0.0.1")
        self._publisher = self._context.socket(zmq.XPUB)
        self._publisher_port = self._publisher.bind_to_random_port("tcp://127.0.0.1")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def _answer(self) -> None:
        while not self._stop.is_set():
            if self._remote.poll(50):
                assert self._remote.recv_string() == "SUB_PORT"
                self._remote.send_string(str(self._publisher_port))

    def subscription(self) -> bytes:
        """The next topic that somebody subscribes to."""
        while True:
            assert self._publisher.poll(1000 * PATIENCE_S)
            said: bytes = self._publisher.recv()
            if said[:1] == b"\1":
                return said[1:]

    def publish(self, topic: str, record: Any) -> None:
        packed = record if isinstance(record, bytes) else self._msgpack.packb(record)
        self._publisher.send_multipart([topic.encode(), packed])

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._context.destroy(linger=0)


@contextmanager
def capture() -> Iterator[Capture]:
    zmq = pytest.importorskip("zmq", reason="the extra 'pupil' is not installed")
    msgpack = pytest.importorskip("msgpack", reason="the extra 'pupil' is not installed")
    found = Capture(zmq, msgpack)
    try:
        yield found
    finally:
        found.close()


def gaze_record(time_s: float, x: float, y: float, confidence: float = 0.99, **more: Any) -> dict[str, Any]:
    """As Pupil Capture publishes it, with the pupils that it was made of."""
    pupil = {"topic": "pupil.0.3d", "timestamp": time_s, "norm_pos": [0.1, 0.2], "confidence": 0.9, "id": 0}
    return {
        "topic": "gaze.3d.01.", "timestamp": time_s, "norm_pos": [x, y], "confidence": confidence,
        "gaze_point_3d": [1.0, 2.0, 300.0], "eye_centers_3d": {0: [1.0, 2.0, 3.0]}, "base_data": [pupil], **more,
    }  # fmt: skip


def test_gaze_on_a_surface_is_gaze_on_the_screen(service: Listener) -> None:
    """Fractions from the bottom left, several records a message; other surfaces do not count."""
    with capture() as pupil:
        port = f"pupil://127.0.0.1:{pupil.port}"
        with running(Config(port=port, surface="screen", service=service.url)) as found:
            found.says("service", "ready")
            assert pupil.subscription() == b"surfaces.screen"
            for index in range(10):
                times = (60.0 + index / 60, 60.008 + index / 60)
                records = [gaze_record(t, 0.25, 0.125, on_surf=True) for t in times]
                other = [gaze_record(times[0], 0.9, 0.9)]
                pupil.publish("surfaces.screen 2", {"name": "screen 2", "gaze_on_surfaces": other})
                pupil.publish("surfaces.screen", {"name": "screen", "gaze_on_surfaces": records})
            service.heard.until(valid)
            pupil.publish("surfaces.screen", b"\xc1")
            pupil.publish("surfaces.screen", {"gaze_on_surfaces": [gaze_record(60.2, 0.5, 0.5, confidence=0.2)]})
            service.heard.until(lost)
            assert found.bridge.codec.bad == 1
    assert {(gaze.x, gaze.y) for gaze in valid(service.heard.items)} == {(0.25, 0.875)}
    assert lost(service.heard.items)[0].seq == 20


def test_gaze_in_the_scene_cameras_picture_wants_a_calibration(service: Listener, tmp_path: Path) -> None:
    with capture() as pupil:
        port = f"pupil://127.0.0.1:{pupil.port}"
        with pytest.raises(ConfigError, match="calibration"):
            running(Config(port=port, service=service.url)).__enter__()
        file = tmp_path / "lab.json"
        file.write_text('{"model": "affine", "points": [[0, 1, 0, 0], [1, 1, 1, 0], [0, 0, 0, 1], [1, 0, 1, 1]]}')
        with running(Config(port=port, calibration=file, service=service.url)) as found:
            found.says("service", "ready")
            assert pupil.subscription() == b"gaze."
            pupil.publish("gaze.3d.01.", gaze_record(1.0, 0.75, 0.25))
            (gaze,) = service.heard.until(valid)
            assert (gaze.x, gaze.y) == pytest.approx((0.75, 0.75))


def test_nobody_answers(service: Listener) -> None:
    pytest.importorskip("zmq", reason="the extra 'pupil' is not installed")
    with running(Config(port="pupil://127.0.0.1:1", surface="screen", service=service.url)) as found:
        found.says("device", "absent: pupil://127.0.0.1:1: no answer: is Pupil Capture running")


def test_a_url_without_a_host_will_never_work() -> None:
    pytest.importorskip("zmq", reason="the extra 'pupil' is not installed")
    from clients.bridge.pupil_port import PupilPort

    for url in ("pupil://", "pupil://:50020", "pupil://host:port"):
        with pytest.raises(ConfigError, match="pupil://HOST"):
            PupilPort(url, None)
    with pytest.raises(PortError):
        PupilPort("pupil://[::1]:1", None)


def test_a_record_is_kept_without_what_is_about_pupils() -> None:
    (line,) = pupil_lines(gaze_record(1.5, 0.25, 0.75)).splitlines()
    assert json.loads(line).keys() == {"topic", "timestamp", "norm_pos", "confidence"}
    (sample,) = Pupil("screen").feed(line + b"\n")
    assert (sample.ticks, sample.both) == (1.5, Point(0.25, 0.75))


def test_a_probe_knows_the_protocol_by_the_port(capsys: pytest.CaptureFixture[str]) -> None:
    with capture() as pupil:
        stop = threading.Event()

        def publish() -> None:
            pupil.subscription()
            index = 0
            while not stop.wait(0.01):
                pupil.publish("gaze.3d.01.", gaze_record(index / 100, 0.5, 0.5))
                index += 1

        thread = threading.Thread(target=publish)
        thread.start()
        try:
            assert main(["bridge", "--probe", "--port", f"pupil://127.0.0.1:{pupil.port}"]) == 0
        finally:
            stop.set()
            thread.join()
    assert "protocol  pupil\n" in capsys.readouterr().out


def test_ports_and_protocols_belong_together(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--port", "lsl://", "--protocol", "smi"], ["--port", "/dev/null", "--protocol", "pupil"]):
        assert main(["bridge", *words]) == 2
        assert "--protocol: expected one that" in capsys.readouterr().err
