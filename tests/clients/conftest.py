"""A place and an environment of one's own for each test."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.clients.commands import ROOT


@pytest.fixture
def plain_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No setting of the caller's shell, and a folder of one's own to work in."""
    for name in [name for name in os.environ if name.startswith(("GAZETRACE_", "PYTHON"))]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.chdir(tmp_path)
