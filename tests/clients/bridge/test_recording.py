"""Recordings lose nothing, survive a crash, and come back in the same chunks; and traces as a device sends them."""

from __future__ import annotations

import os
import socket
import stat
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clients.bridge.codec import MILLISECOND_NS, SECOND_NS
from clients.bridge.emitter import emit, opened
from clients.bridge.errors import ConfigError
from clients.bridge.played import PlayedPort, Record, records
from clients.bridge.port import Chunk, EndOfInput, SerialPort
from clients.bridge.recording import Recorder, ReplayPort, framed, read_recording
from clients.bridge.screen import Origin, Place, Unit
from clients.gaze_trace import GazeTrace, parse_gaze_trace
from tests.clients.bridge.recorded import SCREEN, recorded
from tests.clients.bridge.streams import CODECS, decode, gazes
from tests.clients.bridge.terminal import PATIENCE_S

__all__ = ["recorded"]

CHUNKS = [Chunk(b"ET_S", 100, True), Chunk(b"PL 1 l 2 3\n", 250), Chunk(b"\0\xff", 900), Chunk(b"again", 1500, True)]


def record(path: Path, chunks: list[Chunk]) -> None:
    recorder = Recorder(path, {"protocol": "smi"})
    for chunk in chunks:
        recorder.keep(chunk)
    recorder.close()
    assert recorder.error is None
    assert recorder.bytes_written == sum(len(chunk.data) for chunk in chunks)


def play(port: ReplayPort | PlayedPort) -> list[Chunk]:
    chunks = []
    try:
        while True:
            chunk = port.read()
            if chunk is not None:
                chunks.append(chunk)
    except EndOfInput:
        return chunks


def test_what_was_recorded_comes_back_byte_for_byte_in_the_same_chunks(tmp_path: Path) -> None:
    record(tmp_path / "a.rec", CHUNKS)
    recording = read_recording(tmp_path / "a.rec")
    assert recording.chunks == CHUNKS
    assert (recording.about["protocol"], recording.torn) == ("smi", 0)
    played = play(ReplayPort(recording, speed=0))
    assert [(chunk.data, chunk.begins) for chunk in played] == [(chunk.data, chunk.begins) for chunk in CHUNKS]
    assert np.diff([chunk.arrival_ns for chunk in played]).tolist() == [150, 650, 600]


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    record(tmp_path / "a.rec", CHUNKS)
    with pytest.raises(ConfigError, match="does not exist yet"):
        Recorder(tmp_path / "a.rec", {})
    with pytest.raises(ConfigError, match="can be written"):
        Recorder(tmp_path / "no folder" / "a.rec", {})


def test_after_a_crash_everything_up_to_the_last_whole_chunk_is_there(tmp_path: Path) -> None:
    record(tmp_path / "a.rec", CHUNKS)
    whole = (tmp_path / "a.rec").read_bytes()
    begin = whole.index(b"\n") + 1
    ends = np.cumsum([begin] + [len(framed(chunk)) for chunk in CHUNKS])
    for size in range(begin, len(whole)):
        (tmp_path / "torn.rec").write_bytes(whole[:size])
        recording = read_recording(tmp_path / "torn.rec")
        count = int((ends <= size).sum()) - 1
        assert recording.chunks == CHUNKS[:count]
        assert recording.torn == size - ends[count]


@settings(max_examples=60)
@given(where=st.integers(0, 10_000), flip=st.integers(1, 255))
def test_a_damaged_chunk_is_never_played(tmp_path_factory: pytest.TempPathFactory, where: int, flip: int) -> None:
    path = tmp_path_factory.mktemp("damaged") / "a.rec"
    record(path, CHUNKS)
    data = bytearray(path.read_bytes())
    begin = data.index(b"\n") + 1
    data[begin + where % (len(data) - begin)] ^= flip
    path.write_bytes(data)
    chunks = read_recording(path).chunks
    assert len(chunks) < len(CHUNKS)
    assert chunks == CHUNKS[: len(chunks)]


@pytest.mark.parametrize("text", [b"", b"t_ms,x,y\n", b'{"format": "other"}\n', b"[]\n"])
def test_other_files_are_refused(tmp_path: Path, text: bytes) -> None:
    (tmp_path / "other").write_bytes(text)
    with pytest.raises(ConfigError, match="gazetrace-recording-1"):
        read_recording(tmp_path / "other")
    with pytest.raises(ConfigError, match="can be read"):
        read_recording(tmp_path / "nowhere")


def test_time_runs_as_fast_as_asked(tmp_path: Path) -> None:
    record(tmp_path / "a.rec", [Chunk(b"x", i * 20 * MILLISECOND_NS) for i in range(5)])
    recording = read_recording(tmp_path / "a.rec")
    for speed in (1.0, 4.0):
        arrivals = [chunk.arrival_ns for chunk in play(ReplayPort(recording, speed=speed))]
        assert np.diff(arrivals).tolist() == [20 * MILLISECOND_NS / speed] * 4


def test_a_loop_begins_again(tmp_path: Path) -> None:
    record(tmp_path / "a.rec", CHUNKS[:2])
    port = ReplayPort(read_recording(tmp_path / "a.rec"), speed=0, loop=True)
    played = [port.read() for _ in range(5)]
    assert [chunk.begins for chunk in played if chunk] == [True, False, True, False, True]


def test_a_pause_can_be_interrupted(tmp_path: Path) -> None:
    record(tmp_path / "a.rec", [Chunk(b"x", 0), Chunk(b"y", 3600 * SECOND_NS)])
    port = ReplayPort(read_recording(tmp_path / "a.rec"))
    assert port.read() is not None
    assert port.read() is None
    port.close()
    assert port.read() is None


# Traces as a device sends them


@pytest.mark.parametrize("name", CODECS)
def test_a_real_recording_goes_through_every_encoder_and_decoder(recorded: GazeTrace, name: str) -> None:
    codec = CODECS[name]()
    unit = Unit.PX if codec.unit == "raw" else Unit(codec.unit)
    place = Place(
        unit, Origin.TOP_LEFT, SCREEN if codec.unit != "raw" else SCREEN.__class__(400, 300, 53.3, 30.1, 56.5)
    )
    inside = parse_gaze_trace(
        "t_ms,x_fraction,y_fraction,valid\n"
        + "".join(
            f"{s.time_ms},{min(max(s.x / 1920, 0.001), 1)},{min(max(s.y / 1080, 0.001), 1)},1\n"
            if s.valid
            else f"{s.time_ms},,,0\n"
            for s in (recorded.sample(index) for index in range(0, 4000, 2))
        ),
        "recording",
    )
    data = [record.data for record in records(inside, codec, place)]
    found = gazes(decode(CODECS[name](), data))
    truth = [inside.sample(index) for index in range(len(inside))][-len(found) :]
    assert len(found) >= len(inside) - 1
    assert [point is not None for point in found] == [sample.valid for sample in truth]
    seen = [(place.fraction(point), sample) for point, sample in zip(found, truth, strict=True) if point is not None]
    unit_px = {"asl": 1 / 240, "smi": 1 / 1080, "iscan": 1 / 3000}.get(name.split()[0].split("-")[0], 1e-4)
    assert max(abs(at.x - sample.x) for at, sample in seen) <= 0.51 * unit_px
    assert max(abs(at.y - sample.y) for at, sample in seen) <= 0.51 * unit_px


TRACE = parse_gaze_trace("t_ms,x_fraction,y_fraction\n0,0.25,0.5\n4,0.5,0.5\n8,,\n12,0.75,0.5\n", "short")
PLACE = Place(Unit.PX, Origin.TOP_LEFT, SCREEN)


def test_a_trace_can_be_sent_at_another_rate_and_again() -> None:
    source = records(TRACE, CODECS["smi"](), PLACE, rate_hz=500, loop=True)
    found = [next(source) for _ in range(14)]
    assert [record.due_ns for record in found] == [i * 2 * MILLISECOND_NS for i in range(14)]
    assert b" 480 480 540 540\r\n" in found[0].data
    assert found[1].data.split()[2:] == found[0].data.split()[2:]
    assert b" b 0 0 0 0" in found[4].data
    assert found[7].data.split()[2:] == found[0].data.split()[2:]
    own = records(TRACE, CODECS["smi"](), PLACE, loop=True)
    assert [next(own).due_ns for _ in range(6)] == [i * 4 * MILLISECOND_NS for i in range(6)]


def test_a_played_trace_is_a_port() -> None:
    port = PlayedPort(records(TRACE, CODECS["smi"](), PLACE), speed=0)
    assert len(gazes(decode(CODECS["smi"](), [chunk.data for chunk in play(port)]))) == 4


# Acting as a device


def emitting(target: str, stop: threading.Event, rate_hz: float = 500) -> tuple[threading.Thread, str]:
    """An emitter in a thread, and where it says that it is."""
    told: list[str] = []
    ready = threading.Event()

    def announce(text: str) -> None:
        told.append(text)
        ready.set()

    def work() -> None:
        with opened(target, 115_200, announce) as write:
            emit(
                records(TRACE, CODECS["gazepoint"](), Place(Unit.FRACTION, Origin.TOP_LEFT, SCREEN), rate_hz, True),
                write,
                stop,
            )

    thread = threading.Thread(target=work)
    thread.start()
    assert ready.wait(PATIENCE_S)
    return thread, told[0].rpartition(" ")[2]


@pytest.mark.parametrize("kind", ["terminal", "tcp"])
def test_an_emitter_is_a_device_that_others_read(kind: str, tmp_path: Path) -> None:
    stop = threading.Event()
    thread, where = emitting("tcp:0" if kind == "tcp" else str(tmp_path / "tracker"), stop)
    try:
        for _ in range(2):
            port, codec = SerialPort(where, 115_200), CODECS["gazepoint"]()
            port.write(b"".join(codec.start()))
            found = 0
            while found < 20:
                chunk = port.read()
                found += len(codec.feed(chunk.data)) if chunk is not None else 0
            assert codec.bad <= 1
            port.close()
    finally:
        stop.set()
        thread.join(PATIENCE_S)
    assert not os.path.lexists(tmp_path / "tracker")


def test_an_emitter_that_nobody_reads_goes_on_and_counts(tmp_path: Path) -> None:
    with opened(str(tmp_path / "tracker"), 115_200, lambda _: None) as write:
        told = emit(iter([Record(0, b"x" * 100)] * 2000), write, threading.Event())
        assert (told.sent, told.discarded, told.unread) == (0, 0, 2000)
        assert stat.S_ISCHR((tmp_path / "tracker").stat().st_mode)


@pytest.mark.parametrize("held_up_s", [0.2, 0.8])
def test_a_reader_that_is_held_up_gets_every_record_whole(tmp_path: Path, held_up_s: float) -> None:
    """More than a pseudo-terminal holds: 1000 records of 100 bytes, at once."""
    target, told = str(tmp_path / "tracker"), []
    lines = [f"{i:098d}\r\n".encode() for i in range(1000)]
    with opened(target, 115_200, lambda _: None) as write:
        port = SerialPort(target, 115_200)
        source = iter([Record(0, line) for line in lines])
        thread = threading.Thread(target=lambda: told.append(emit(source, write, threading.Event())))
        thread.start()
        threading.Event().wait(held_up_s)
        read, chunk = b"", None
        while thread.is_alive() or chunk is not None or not read:
            chunk = port.read()
            read += chunk.data if chunk is not None else b""
        thread.join(PATIENCE_S)
        port.close()
    assert read == b"".join(lines)
    assert (told[0].sent, told[0].discarded, told[0].unread) == (1000, 0, 0)
    assert told[0].latest_ns > held_up_s * SECOND_NS / 2


def test_what_waits_for_too_long_is_discarded_and_counted(tmp_path: Path) -> None:
    target = str(tmp_path / "tracker")
    lines = [f"{i:098d}\r\n".encode() for i in range(1000)]
    with opened(target, 115_200, lambda _: None) as write:
        port = SerialPort(target, 115_200)
        told = emit((Record(0, line) for line in lines), write, threading.Event())
        assert 0 < told.sent < 1000
        assert (told.sent + told.discarded, told.unread) == (1000, 0)
        read = b""
        while (chunk := port.read()) is not None:
            read += chunk.data
        port.close()
    assert read[: 100 * (told.sent - 1)] == b"".join(lines[: told.sent - 1])


def test_an_emitter_does_not_take_a_file_or_a_wrong_port(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for target in (str(tmp_path / "file"), "tcp:x"):
        with pytest.raises(ConfigError, match="emit"), opened(target, 115_200, lambda _: None):
            pass
    assert (tmp_path / "file").read_text() == "mine"


def test_an_emitter_writes_to_a_port_of_pyserial() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        with opened(url, 115_200, lambda _: None) as write:
            peer, _ = listener.accept()
            with peer:
                assert emit(iter([Record(0, b"hello")]), write, threading.Event()).sent == 1
                assert peer.recv(5) == b"hello"
