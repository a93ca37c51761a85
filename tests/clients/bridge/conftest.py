"""What several test files of the bridge use."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.clients.bridge.terminal import Terminal


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    """A serial line, plugged in."""
    terminal = Terminal(tmp_path / "tracker")
    terminal.plug()
    yield terminal
    terminal.unplug()
