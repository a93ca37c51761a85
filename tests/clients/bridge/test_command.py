"""`gazetrace bridge` as a process, and its settings."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path

import pytest

from clients.bridge.codec import MILLISECOND_NS
from clients.bridge.config import _READ, VARIABLE_PREFIX, Config, of_environment, of_file
from clients.bridge.errors import ConfigError
from clients.bridge.sample import Eye
from clients.bridge.screen import Origin, Unit
from clients.command_line import main
from clients.command_line.serve import setting_texts
from tests.clients.bridge.running import listener
from tests.clients.bridge.streams import CODECS, records
from tests.clients.bridge.terminal import PATIENCE_S, Terminal
from tests.clients.commands import failing, start

pytestmark = pytest.mark.usefixtures("plain_environment")


@contextmanager
def process(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """The bridge as a process of its own; it stops when it is told to."""
    with start("bridge", *words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as found:
        end_of_patience = threading.Timer(2 * PATIENCE_S, found.kill)
        end_of_patience.start()
        try:
            yield found
        finally:
            end_of_patience.cancel()
            if found.poll() is None:
                found.terminate()
                found.communicate(timeout=PATIENCE_S)


def test_a_device_is_emitted_bridged_and_stopped(tmp_path: Path) -> None:
    """Two processes: one is the tracker, the other reads it; SIGTERM ends both in good order."""
    with listener() as service, process("--emit", "asl", str(tmp_path / "tracker")) as tracker:
        assert tracker.stdout is not None
        assert tracker.stdout.readline() == f"a tracker at {tmp_path / 'tracker'}\n".encode()
        words = ["--port", str(tmp_path / "tracker"), "--protocol", "asl", "--service", service.url, "--log-json"]
        with process(*words, "--record", str(tmp_path / "run.rec")) as bridge:
            service.heard.until(lambda items: len(items) > 200)
            bridge.send_signal(signal.SIGTERM)
            out, err = bridge.communicate(timeout=PATIENCE_S)
        assert (bridge.returncode, out) == (0, b"")
        events = [json.loads(line) for line in err.splitlines()]
        assert {event["event"] for event in events} >= {"device", "service", "health"}
        assert service.closes.until(list) == [1001]
        tracker.send_signal(signal.SIGTERM)
        out, _ = tracker.communicate(timeout=PATIENCE_S)
        assert tracker.returncode == 0
        assert re.match(rb"\d+ records sent, .* 0 discarded because the reader was too slow, \d+ while nobody", out)
    assert (tmp_path / "run.rec").stat().st_size > 2000
    assert not (tmp_path / "tracker").is_symlink()


def test_a_recording_needs_no_settings_to_be_printed(
    terminal: Terminal, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.rec"
    words = ["--port", str(terminal.path), "--protocol", "csv", "--fields", "t,x,y", "--time-unit", "ns", "--dry-run"]
    with process(*words, "--record", str(file)) as bridge:
        assert bridge.stdout is not None
        assert bridge.stderr is not None
        assert bridge.stderr.readline() == b"device: open: the port is open\n"
        for record in [b"\n", *records(CODECS["csv"](), 20)] * 5:
            terminal.write(record)
        assert sum(bridge.stdout.readline().count(b",") == 6 for _ in range(90)) == 90
    assert main(["bridge", "--replay", str(file), "--speed", "0", "--dry-run", "--json"]) == 0
    lines = [json.loads(text) for text in capsys.readouterr().out.splitlines()]
    assert len(lines) >= 90
    assert [line["seq"] for line in lines] == list(range(len(lines)))
    assert lines[0]["x"] == pytest.approx(5 / 1920)
    assert any(line["x"] is None for line in lines)


def test_a_probe_says_what_a_known_device_sends(tmp_path: Path) -> None:
    target = str(tmp_path / "tracker")
    with process("--emit", "iscan", target, "--rate-hz", "200") as tracker:
        assert tracker.stdout is not None
        tracker.stdout.readline()
        with process("--probe", "--port", target, "--protocol", "iscan") as probe:
            out, _ = probe.communicate(timeout=PATIENCE_S)
    assert b"protocol  iscan\n" in out


def test_a_probe_warns_of_a_line_that_is_nearly_full(tmp_path: Path) -> None:
    target = str(tmp_path / "tracker")
    with process("--emit", "smi", target, "--rate-hz", "200") as tracker:
        assert tracker.stdout is not None
        tracker.stdout.readline()
        with process("--probe", "--port", target, "--baud", "9600") as probe:
            out, _ = probe.communicate(timeout=PATIENCE_S)
        text = out.decode()
        assert probe.returncode == 0
        assert "protocol  smi" in text
        assert "warning   the line is loaded above 80%" in text
        assert len([line for line in text.splitlines() if "left" in line or "lost" in line]) == 20
        with process("--probe", "--port", target, "--json") as probe:
            out, _ = probe.communicate(timeout=PATIENCE_S)
        found = json.loads(out)
        assert found["rate_hz"] == pytest.approx(200, rel=0.1)
        assert (found["valid"] > 0.5, found["bad"] <= 1, len(found["samples"])) == (True, True, 20)


@pytest.mark.slow
def test_a_device_that_never_comes_ends_it_if_that_is_wanted(tmp_path: Path) -> None:
    with process("--port", str(tmp_path / "nothing"), "--protocol", "asl", "--dry-run", "--fail-fast") as bridge:
        _, err = bridge.communicate(timeout=PATIENCE_S)
    assert bridge.returncode == 3
    assert b"there is no such device" in err
    assert b"no sample in 5 s: giving up" in err


def test_ports_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bridge", "--list-ports"]) == 0
    assert capsys.readouterr().out
    assert main(["bridge", "--list-ports", "--json"]) == 0
    assert isinstance(json.loads(capsys.readouterr().out), list)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "--protocol: expected one of smi, asl"),
        (("--protocol", "smi"), "--port: expected a device"),
        (("--protocol", "telepathy", "--port", "x"), "--protocol: expected one of"),
        (("--simulate", "--port", "x"), "--simulate: expected one source of gaze"),
        (("--protocol", "asl", "--port", "x", "--eye", "left"), "--eye: expected best"),
        (("--protocol", "iscan", "--port", "x"), "--calibration: expected a file"),
        (("--simulate", "--baud", "fast"), "--baud: expected an integer, found 'fast'"),
        (("--simulate", "--screen-px", "0x5"), "--screen-px: expected two numbers above 0"),
        (("--simulate", "--service", "localhost"), "--service: expected an address"),
        (("--simulate", "--origin", "middle"), "--origin: expected top-left or bottom-left or center"),
        (("--simulate", "--calibration", "none.json"), "--calibration none.json: expected a file that can be read"),
        (("--replay", "none.rec"), "--replay: expected a file that can be read"),
        (("--trace", "none.csv"), "--trace: expected a file that can be read"),
        (("--config", "none.toml"), "--config: expected a file that can be read"),
        (("--emit", "asl", "tcp:x"), "--emit: expected tcp:PORT"),
        (("--simulate", "--dry-run", "--calibrate", "f"), "--calibrate: expected a service"),
        (("--protocol", "gopher", "--probe", "--port", "gopher://x"), "--protocol: expected one of"),
        (("--protocol", "smi", "--port", "gopher://x", "--dry-run"), "--port: expected a device or a URL"),
    ],
)
def test_wrong_settings_are_named(words: tuple[str, ...], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["bridge", *words])
    lines = capsys.readouterr().err.splitlines()
    assert status == 2
    assert complaint in lines[-1]


def test_flags_win_over_variables_and_variables_over_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "lab.toml"
    file.write_text('protocol = "csv"\nfields = ["t", "x", "y"]\nsession = "from-file"\nsmooth = true\nbaud = 9600\n')
    stated = {
        **of_file(file),
        **of_environment({"GAZETRACE_BRIDGE_SESSION": "from-variable", "GAZETRACE_TOKEN": "tok"}),
    }
    config = Config.read(stated, {"baud": "19200"})
    assert (config.fields, config.session, config.smooth) == (("t", "x", "y"), "from-variable", True)
    assert (config.baud, config.token) == (19200, "tok")
    monkeypatch.setenv("GAZETRACE_BRIDGE_CONFIG", str(file))
    monkeypatch.setenv("GAZETRACE_BRIDGE_EYE", "third")
    failing(capsys, "bridge", "--port", "x")
    assert main(["bridge", "--port", "x"]) == 2
    assert "GAZETRACE_BRIDGE_EYE: expected" in capsys.readouterr().err
    file.write_text("smi_fromat = 'x'\n")
    monkeypatch.delenv("GAZETRACE_BRIDGE_EYE")
    assert main(["bridge", "--port", "x"]) == 2
    assert "--smi-fromat: expected a setting of the bridge" in capsys.readouterr().err


def test_texts_are_read_as_what_they_mean() -> None:
    config = Config.read({
        "unit": "deg", "origin": "center", "eye": "right", "screen_cm": "50x35", "time_unit": "ms",
        "iscan_columns": "2,0", "paths": "x=gaze.0,y=gaze.1", "poll_byte": "0x53", "pad_ms": "80",
    })  # fmt: skip
    assert (config.unit, config.origin, config.eye) == (Unit.DEG, Origin.CENTER, Eye.RIGHT)
    assert (config.screen_cm, config.time_unit, config.iscan_columns) == ((50, 35), MILLISECOND_NS, (2, 0))
    assert (config.paths, config.poll_byte, config.pad_ms) == ({"x": "gaze.0", "y": "gaze.1"}, 0x53, 80)


@pytest.mark.parametrize(
    "wrong",
    [{"baud": "1"}, {"pad_ms": "-1"}, {"speed": "nan"}, {"rate_hz": "0"}, {"iscan_columns": "1"}, {"paths": "x"},
     {"smooth": "maybe"}, {"distance_cm": "far"}, {"screen_px": "wide"}, {"time_unit": "h"}],
)  # fmt: skip
def test_what_means_nothing_is_refused_by_name(wrong: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        Config.read(wrong)


def test_every_setting_can_be_stated_and_is_described() -> None:
    names = {setting.name for setting in fields(Config)}
    assert _READ.keys() == names
    assert setting_texts(Config).keys() == names
    assert VARIABLE_PREFIX == "GAZETRACE_BRIDGE_"
