"""The systemd units and the udev rule, as far as the programs that read them can be asked."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from clients.command_line import build_parser
from service.server import GOODBYE_S
from tests.clients.commands import PATIENCE_S, ROOT

BRIDGE = ROOT / "docker" / "gazetrace-bridge.service"
SERVICE = ROOT / "docker" / "gazetrace.service"
RULE = ROOT / "docker" / "99-gazetrace-eyetracker.rules"

MOST_EXPOSURE = 20
"""What systemd may find a unit exposed by, in tenths: 100 is a unit that says nothing, below 20 is "OK"."""


def asked(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)


def with_a_command_that_is_there(unit: Path, folder: Path) -> Path:
    copy = folder / unit.name
    copy.write_text(re.sub(r"ExecStart=\S+", "ExecStart=/bin/true", unit.read_text()))
    return copy


def words_of(unit: Path) -> list[str]:
    """What the unit runs, after the program's name."""
    found = re.search(r"^ExecStart=(.+)$", unit.read_text(), re.MULTILINE)
    assert found is not None
    program, *words = shlex.split(found[1])
    assert Path(program).name == "gazetrace"
    return words


@pytest.mark.parametrize("unit", [BRIDGE, SERVICE], ids=lambda unit: unit.stem)
def test_systemd_understands_every_line_of_the_unit(unit: Path, tmp_path: Path) -> None:
    """And would complain about one that it does not know."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("there is no systemd-analyze here")
    copy = with_a_command_that_is_there(unit, tmp_path)
    told = asked("systemd-analyze", "verify", str(copy))
    assert (told.returncode, told.stdout, told.stderr) == (0, "", "")
    copy.write_text(copy.read_text().replace("TimeoutStopSec=", "TimeoutStopSecs="))
    assert "TimeoutStopSecs" in asked("systemd-analyze", "verify", str(copy)).stderr


def test_the_service_is_hardly_exposed(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None or "--offline" not in asked("systemd-analyze", "--help").stdout:
        pytest.skip("there is no systemd-analyze that judges files here (systemd 250 or later)")
    copy = with_a_command_that_is_there(SERVICE, tmp_path)
    judge = ("systemd-analyze", "security", "--offline=true", f"--threshold={MOST_EXPOSURE}", "--no-pager")
    told = asked(*judge, str(copy))
    assert told.returncode == 0, told.stdout + told.stderr
    copy.write_text("[Service]\nExecStart=/bin/true\n")
    assert asked(*judge, str(copy)).returncode != 0


def test_the_units_run_commands_that_exist() -> None:
    bridge = build_parser().parse_args(words_of(BRIDGE))
    assert bridge.config == Path("/etc/gazetrace/bridge.toml")
    service = build_parser().parse_args(words_of(SERVICE))
    assert service.log_json == "1"


def test_systemd_waits_until_streams_have_said_goodbye() -> None:
    found = re.search(r"^TimeoutStopSec=(\d+)$", SERVICE.read_text(), re.MULTILINE)
    assert found is not None
    assert int(found[1]) > GOODBYE_S


def test_udev_understands_the_rule() -> None:
    if shutil.which("udevadm") is None or "verify" not in asked("udevadm", "--help").stdout:
        pytest.skip("there is no udevadm that verifies rules here (systemd 254 or later)")
    told = asked("udevadm", "verify", str(RULE))
    assert told.returncode == 0, told.stdout + told.stderr
