"""The systemd unit and the udev rule, as far as the programs that read them can be asked."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from clients.command_line import build_parser
from tests.clients.commands import PATIENCE_S, ROOT

UNIT = ROOT / "docker" / "gazetrace-bridge.service"
RULE = ROOT / "docker" / "99-gazetrace-eyetracker.rules"


def asked(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)


def test_systemd_understands_every_line_of_the_unit(tmp_path: Path) -> None:
    """With a command that is there, and a line that it does not know for comparison."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("there is no systemd-analyze here")
    text = re.sub(r"ExecStart=\S+", "ExecStart=/bin/true", UNIT.read_text())
    unit = tmp_path / UNIT.name
    unit.write_text(text)
    told = asked("systemd-analyze", "verify", str(unit))
    assert (told.returncode, told.stdout, told.stderr) == (0, "", "")
    unit.write_text(text.replace("WatchdogSec=10", "WatchdogSecs=10"))
    assert "WatchdogSecs" in asked("systemd-analyze", "verify", str(unit)).stderr


def test_the_units_command_is_one() -> None:
    found = re.search(r"^ExecStart=(.+)$", UNIT.read_text(), re.MULTILINE)
    assert found is not None
    program, *words = shlex.split(found[1])
    assert Path(program).name == "gazetrace"
    assert build_parser().parse_args(words).config == Path("/etc/gazetrace/bridge.toml")


def test_udev_understands_the_rule() -> None:
    if shutil.which("udevadm") is None or "verify" not in asked("udevadm", "--help").stdout:
        pytest.skip("there is no udevadm that verifies rules here (systemd 254 or later)")
    told = asked("udevadm", "verify", str(RULE))
    assert told.returncode == 0, told.stdout + told.stderr
