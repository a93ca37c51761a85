"""The device's states, and its thread on a real pseudo-terminal that comes and goes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from clients.backoff import Backoff
from clients.bridge.asl import Asl
from clients.bridge.clock import DeviceClock
from clients.bridge.codec import SECOND_NS, Codec
from clients.bridge.detection import detect, diagnose
from clients.bridge.device import Device, Ears
from clients.bridge.device_state import RESTART_NS, SILENT_NS, STALE_NS, UNREADABLE_NS, DeviceState, DeviceWatch
from clients.bridge.gaze import Gaze, GazeOptions, GazePath
from clients.bridge.iscan import IscanBinary
from clients.bridge.port import Chunk, Port, SerialPort
from clients.bridge.screen import Origin, Place, Unit
from clients.bridge.smi import Smi
from tests.clients.bridge.recorded import SCREEN
from tests.clients.bridge.streams import CODECS, LOST, records
from tests.clients.bridge.terminal import PATIENCE_S, Terminal

# States


class Told:
    """A watch and what it has told."""

    def __init__(self) -> None:
        self.states: list[DeviceState] = []
        self.watch = DeviceWatch(diagnose, lambda state, _: self.states.append(state))


def test_a_device_that_comes_speaks_falls_silent_and_is_lost() -> None:
    told = Told()
    watch = told.watch
    watch.failed("no such device")
    watch.failed("no such device")
    watch.opened(0)
    watch.waited(SILENT_NS - 1)
    watch.received(SILENT_NS, b"ET_SPL", 1)
    watch.received(SILENT_NS + 1, b"ET_SPL", 1)
    watch.waited(2 * SILENT_NS)
    watch.waited(2 * SILENT_NS + 1)
    watch.received(3 * SILENT_NS, b"ET_SPL", 1)
    watch.failed("unplugged")
    watch.failed("no such device")
    watch.opened(4 * SILENT_NS)
    watch.stopped("bye")
    state = DeviceState
    assert told.states == [
        state.ABSENT, state.OPEN, state.STREAMING, state.SILENT, state.STREAMING, state.LOST, state.OPEN, state.STOPPED,
    ]  # fmt: skip


def test_a_silent_device_is_started_again_and_in_the_end_given_up() -> None:
    watch = Told().watch
    watch.opened(0)
    assert not watch.start_again(RESTART_NS)
    watch.waited(SILENT_NS)
    assert not watch.start_again(RESTART_NS - 1)
    assert watch.start_again(RESTART_NS)
    assert not watch.start_again(RESTART_NS + 1)
    assert watch.start_again(2 * RESTART_NS)
    assert not watch.stale(STALE_NS - 1)
    assert watch.stale(STALE_NS)


def test_bytes_without_a_sample_are_looked_into_after_a_second() -> None:
    told = Told()
    told.watch.opened(0)
    noise = np.random.default_rng(0).integers(0, 256, 500, dtype=np.uint8).tobytes()
    told.watch.received(UNREADABLE_NS - 1, noise, 0)
    assert told.states == [DeviceState.OPEN]
    told.watch.received(UNREADABLE_NS, noise, 0)
    assert told.states[-1] is DeviceState.WRONG_BAUD
    told.watch.received(UNREADABLE_NS + 1, b"", 1)
    assert told.states[-1] is DeviceState.STREAMING


@pytest.mark.parametrize("name", [name for name in CODECS if name not in ("csv", "regex", "lsl", "pupil")])
def test_every_protocol_is_recognised_from_the_middle_of_its_stream(name: str) -> None:
    detection = detect(b"".join(records(CODECS[name](), 14))[3:])
    assert detection is not None
    codec = CODECS[name]()
    expected = {"jsonl": "jsonl", "asl counted": "asl --asl-counted"}.get(name)
    if expected is None and name.startswith("iscan"):
        expected = f"{codec.name} --iscan-parameters {4 if 'of 4' in name else 2}"
    assert detection.protocol == (expected or codec.name)


def test_pairs_of_numbers_are_recognised() -> None:
    detection = detect(b"(1522, 431)\n(1523, 432)\r\n" * 9)
    assert detection is not None
    assert detection.protocol == "csv"


@pytest.mark.parametrize(
    ("data", "state", "hint"),
    [
        (b"ET_SPL 100 b 1 2 3 4\r\n" * 9, DeviceState.WRONG_PROTOCOL, "--protocol smi"),
        (b"\x56\x50\x0c\x08stimulus" * 6, DeviceState.WRONG_PROTOCOL, "ViewPoint"),
        (b"login: \r\n" * 20, DeviceState.WRONG_PROTOCOL, "'login: '"),
        (bytes(range(128, 256)) * 3, DeviceState.WRONG_BAUD, "--baud"),
    ],
)
def test_a_diagnosis_says_what_to_change(data: bytes, state: DeviceState, hint: str) -> None:
    found, why = diagnose(data)
    assert found is state
    assert hint in why


# The thread


class Listening:
    """A device's thread and everything it tells."""

    def __init__(self, open_port: Callable[[], Port], codec: Codec) -> None:
        self.gazes: list[Gaze] = []
        self.chunks: list[Chunk] = []
        self.states: list[DeviceState] = []
        self.whys: list[str] = []
        self._news = threading.Condition()
        place = Place(Unit.PX, Origin.TOP_LEFT, SCREEN)
        self.path = GazePath(place, DeviceClock(codec.ticks_ns), GazeOptions())
        ears = Ears(self._keeper(self.gazes), self._keeper(self.chunks), self._state, self._keeper(self.whys))
        self.device = Device(open_port, codec, self.path, ears, Backoff(lambda: 0.0))

    def _keeper(self, kept: list) -> Callable[..., None]:  # type: ignore[type-arg]
        def keep(item: object) -> None:
            with self._news:
                kept.append(item)
                self._news.notify_all()

        return keep

    def _state(self, state: DeviceState, why: str) -> None:
        with self._news:
            self.states.append(state)
            self.whys.append(why)
            self._news.notify_all()

    def until(self, condition: Callable[[], bool]) -> None:
        with self._news:
            assert self._news.wait_for(condition, PATIENCE_S), (self.states, self.whys, len(self.gazes))


@contextmanager
def listening(open_port: Callable[[], Port], codec: Codec) -> Iterator[Listening]:
    listener = Listening(open_port, codec)
    thread = threading.Thread(target=listener.device.run)
    thread.start()
    try:
        yield listener
    finally:
        listener.device.stop()
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


def opener(terminal: Terminal, baud: int = 115_200) -> Callable[[], SerialPort]:
    return lambda: SerialPort(str(terminal.path), baud)


LINES = records(Smi(), 40)
START = Smi().start()[0]


def test_a_device_may_come_late_be_unplugged_and_return(terminal: Terminal) -> None:
    terminal.unplug()
    with listening(opener(terminal), Smi()) as listener:
        listener.until(lambda: listener.states == [DeviceState.ABSENT])
        assert "there is no such device" in listener.whys[0]
        for _ in range(2):
            terminal.plug()
            assert terminal.read(len(START)) == START
            seen = len(listener.gazes)
            terminal.write(b"".join(LINES[:20]) + LINES[20][:9])
            listener.until(lambda seen=seen: len(listener.gazes) >= seen + 20)  # type: ignore[misc]
            terminal.unplug()
            listener.until(lambda: listener.states[-1] is DeviceState.LOST)
    assert listener.states == [DeviceState.ABSENT] + [DeviceState.OPEN, DeviceState.STREAMING, DeviceState.LOST] * 2 + [
        DeviceState.STOPPED
    ]
    assert len([gaze for gaze in listener.gazes if gaze.measured is not None]) == 40 - 2 * len(LOST)
    assert [chunk.begins for chunk in listener.chunks].count(True) == 2


def test_a_device_is_told_to_start_and_at_the_end_to_stop(terminal: Terminal) -> None:
    with listening(opener(terminal), IscanBinary()) as listener:
        assert terminal.read(2) == b"\x81\x80"
        listener.until(lambda: bool(listener.states))
    assert terminal.read(1) == b"\x81"


def test_a_silent_device_is_told_to_start_again(terminal: Terminal) -> None:
    with listening(opener(terminal), Smi()) as listener:
        assert terminal.read(len(START)) == START
        listener.until(lambda: listener.states[-1:] == [DeviceState.SILENT])
        assert terminal.read(len(START)) == START
        terminal.write(LINES[0])
        listener.until(lambda: listener.states[-1] is DeviceState.STREAMING)


def test_another_protocol_is_named_and_the_right_one_read_when_it_comes(terminal: Terminal) -> None:
    stop = threading.Event()

    def babble() -> None:
        while not stop.wait(0.05):
            terminal.write(b"".join(records(Asl(), 20)))

    with listening(opener(terminal), Smi()) as listener:
        babbling = threading.Thread(target=babble)
        babbling.start()
        listener.until(lambda: listener.states[-1:] == [DeviceState.WRONG_PROTOCOL])
        stop.set()
        babbling.join()
        assert "--protocol asl" in listener.whys[-1]
        terminal.write(b"\n" + b"".join(LINES[:5]))
        listener.until(lambda: listener.states[-1] is DeviceState.STREAMING)


def test_a_device_on_demand_is_asked_for_each_sample(terminal: Terminal) -> None:
    answers = records(Asl(request=0x53), 10)
    with listening(opener(terminal), Asl(request=0x53)) as listener:
        for answer in answers:
            assert terminal.read(1) == b"\x53"
            terminal.write(answer)
        listener.until(lambda: len(listener.gazes) == len(answers))


def test_the_time_on_the_line_is_taken_off(terminal: Terminal) -> None:
    """At 9600 baud a chunk of n bytes began n * 10 / 9600 s before its last byte."""
    with listening(opener(terminal, 9600), CODECS["csv"]()) as listener:
        listener.until(lambda: bool(listener.states))
        terminal.write(b"\n")
        listener.until(lambda: len(listener.chunks) == 1)
        terminal.write(b"1,2,3\n")
        listener.until(lambda: len(listener.gazes) == 1)
    gaze = listener.gazes[0]
    first = listener.chunks[1]
    assert gaze.arrival_ns == first.arrival_ns - round(len(first.data) * 10 * SECOND_NS / 9600)
    assert gaze.received_ns == listener.chunks[-1].arrival_ns


def test_a_format_that_cannot_be_read_is_told_once(terminal: Terminal) -> None:
    with listening(opener(terminal), Smi()) as listener:
        assert terminal.read(len(START)) == START
        terminal.write(b"ET_SPL 1 2 3 4 5 6 7\r\n" * 60)
        listener.until(lambda: any("no eye letter" in why for why in listener.whys))
    assert sum("no eye letter" in why for why in listener.whys) == 1


def test_the_thread_shows_that_it_lives_while_there_is_no_device(terminal: Terminal) -> None:
    terminal.unplug()
    with listening(opener(terminal), Smi()) as listener:
        listener.until(lambda: bool(listener.states))
        begin = listener.device.beat_ns
        end = time.monotonic() + PATIENCE_S
        while listener.device.beat_ns == begin:
            assert time.monotonic() < end
            assert not listener.device.ended.wait(0.05)
