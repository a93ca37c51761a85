"""Ports: real pseudo-terminals and sockets, and what happens when they go away."""

from __future__ import annotations

import os
import socket
import time

import pytest

from clients.bridge.errors import ConfigError, PortError
from clients.bridge.port import WAIT_S, SerialPort, listed_ports, reason
from tests.clients.bridge.terminal import PATIENCE_S, Terminal


def read_all(port: SerialPort, count: int) -> bytes:
    data, end = b"", time.monotonic() + PATIENCE_S
    while len(data) < count and time.monotonic() < end:
        chunk = port.read()
        data += chunk.data if chunk is not None else b""
    return data


def test_bytes_go_both_ways(terminal: Terminal) -> None:
    port = SerialPort(str(terminal.path), 115_200)
    before = time.monotonic_ns()
    terminal.write(b"ET_SPL 1 l 2 3\n")
    assert read_all(port, 15) == b"ET_SPL 1 l 2 3\n"
    terminal.write(b"x")
    chunk = port.read()
    assert chunk is not None
    assert before < chunk.arrival_ns <= time.monotonic_ns()
    port.write(b"ET_STR\n")
    assert terminal.read(7) == b"ET_STR\n"
    port.close()
    port.close()


def test_a_byte_takes_ten_bits(terminal: Terminal) -> None:
    port = SerialPort(str(terminal.path), 9600)
    assert port.byte_ns == pytest.approx(1_041_667, abs=1)
    assert not port.stale_when_silent
    port.close()


def test_silence_is_told_after_a_short_wait(terminal: Terminal) -> None:
    port = SerialPort(str(terminal.path), 115_200, dtr=False)
    took = []
    for _ in range(10):
        begin = time.monotonic()
        assert port.read() is None
        took.append(time.monotonic() - begin)
    assert WAIT_S * 0.9 < min(took) < 2 * WAIT_S  # the shortest: a busy machine makes some of them longer
    port.close()


def test_an_unplugged_device_is_an_error_of_the_port_whatever_is_called(terminal: Terminal) -> None:
    port = SerialPort(str(terminal.path), 115_200)
    terminal.unplug()
    with pytest.raises(PortError, match=str(terminal.path)):
        port.read()
    with pytest.raises(PortError):
        port.write(b"x")
    port.close()


def test_a_port_is_for_one_program_alone(terminal: Terminal) -> None:
    port = SerialPort(str(terminal.path), 115_200)
    with pytest.raises(PortError, match="in use: is another program reading it"):
        SerialPort(str(terminal.path), 115_200)
    port.close()
    SerialPort(str(terminal.path), 115_200).close()


def test_a_missing_device_and_a_missing_match_may_come_later(terminal: Terminal) -> None:
    with pytest.raises(PortError, match="there is no such device"):
        SerialPort(f"{terminal.path}-of-another", 115_200)
    with pytest.raises(PortError, match="no ports found"):
        SerialPort("hwgrep://no such thing", 115_200)


def test_a_url_of_no_known_kind_will_never_work() -> None:
    with pytest.raises(ConfigError, match="port: expected a device or a URL"):
        SerialPort("gopher://tracker", 115_200)


def test_a_loop_gives_back_what_it_got() -> None:
    port = SerialPort("loop://", 115_200)
    port.write(b"abc")
    assert read_all(port, 3) == b"abc"
    assert port.byte_ns == 0
    port.close()


def test_a_socket_gives_whole_chunks_and_loses_nothing_when_it_is_closed() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = SerialPort(f"socket://127.0.0.1:{listener.getsockname()[1]}", 115_200)
        assert port.stale_when_silent
        peer, _ = listener.accept()
        with peer:
            peer.sendall(b"x" * 1000)
            assert read_all(port, 1000) == b"x" * 1000
            port.write(b"hello")
            assert peer.recv(5) == b"hello"
            peer.sendall(b"y" * 10)
            chunk = port.read()
            assert chunk is not None
            assert len(chunk.data) > 1
            rest = b"y" * (10 - len(chunk.data))
            assert read_all(port, len(rest)) == rest
            peer.sendall(b"last")
        assert read_all(port, 4) == b"last"
        with pytest.raises(PortError, match="disconnected"):
            port.read()
        port.close()


def test_nobody_listens() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        number = listener.getsockname()[1]
    with pytest.raises(PortError, match="refused"):
        SerialPort(f"socket://127.0.0.1:{number}", 115_200)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (PermissionError(13, "no"), "dialout"),
        (OSError(5, "Input/output error"), "Input/output error"),
        (TypeError(), "TypeError"),
        (OSError("device reports readiness to read but returned no data"), "unplugged, or is another program"),
    ],
)
def test_reasons_come_with_a_hint(error: Exception, text: str) -> None:
    assert text in reason(error)


def test_listed_ports_are_devices() -> None:
    assert all(os.path.exists(port.device) for port in listed_ports())
