"""A place and an environment of one's own for each test."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from renderer.pipeline import Renderer
from service.settings import Settings
from tests.clients.commands import ROOT
from tests.service.conftest import serving


@pytest.fixture
def plain_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No setting of the caller's shell, and a folder of one's own to work in."""
    for name in [name for name in os.environ if name.startswith(("GAZETRACE_", "PYTHON"))]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def renderer() -> Iterator[Renderer]:
    """One renderer for all services, so that kernels are loaded once."""
    renderer = Renderer()
    yield renderer
    renderer.close()


@pytest.fixture(scope="session")
def address(renderer: Renderer) -> Iterator[str]:
    """A service with the default limits, on a real port."""
    with serving(Settings(port=0), renderer) as address:
        yield address
